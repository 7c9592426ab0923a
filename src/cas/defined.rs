//! Whether an expression that is read has a value. Logarithms and roots of numbers below zero and quotients by zero
//! have none. Canonical forms would lose these singularities (`0*log(z)` is 0 wherever it has a value), so each is
//! checked when it is read. `0^0` is 1, as in floating point; powers with an exponent that is not an integer have
//! values only for bases from zero on.

use super::*;

/// Largest constant, in nodes, of which it is proven that it is zero.
const MAX_PROOF: usize = 300;
const SMALL: f64 = 1e-6;

#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The expression in canonical form.
    pub expr: ExprId,
    /// Expressions with a value exactly where the expression as written has one, and NaN or infinite elsewhere.
    pub guards: Vec<ExprId>,
}

#[derive(Debug, Default)]
pub(super) struct Guards {
    pub(super) found: Vec<ExprId>,
    bounds: IdMap<Interval>,
}

impl Guards {
    /// Notes a call; whether it has a value anywhere.
    pub(super) fn call(
        &mut self,
        pool: &mut ExprPool,
        function: Function,
        argument: ExprId,
    ) -> bool {
        if !matches!(function, Function::Log | Function::Sqrt) {
            return true;
        }
        let guard = pool.apply(function, argument);
        self.note(pool, guard) && (function == Function::Sqrt || !self.is_zero(pool, argument))
    }

    pub(super) fn division(&mut self, pool: &mut ExprPool, divisor: ExprId) -> bool {
        let guard = pool.powi(divisor, -1);
        self.note(pool, guard) && !self.is_zero(pool, divisor)
    }

    pub(super) fn power(&mut self, pool: &mut ExprPool, base: ExprId, exponent: ExprId) -> bool {
        let Some(number) = pool.as_number(exponent) else {
            let guard = pool.pow(base, exponent);
            return self.note(pool, guard);
        };
        let is_real = number.as_integer().is_some() || self.call(pool, Function::Sqrt, base);
        is_real && (!number.is_negative() || self.division(pool, base))
    }

    /// Adds a guard; whether it has a value anywhere, as far as bounds show it.
    fn note(&mut self, pool: &ExprPool, guard: ExprId) -> bool {
        if !is_constant(pool, guard) {
            self.found.push(guard);
        }
        !self.bounds(pool, guard).is_empty()
    }

    fn bounds(&mut self, pool: &ExprPool, expr: ExprId) -> Interval {
        let unseen = pool.walk(&[expr], |part| !self.bounds.contains_key(&part), |_| true);
        for part in unseen {
            let range_of = |symbol: SymbolId| match pool.decimal_of(symbol) {
                Some((_, value)) => Interval::point(value),
                None => Interval::ENTIRE,
            };
            let bounds = pool.bounds_of_node(part, &range_of, &|operand| self.bounds[&operand]);
            self.bounds.insert(part, bounds);
        }
        self.bounds[&expr]
    }

    /// Whether a constant is zero, as `sin(1)^2 + cos(1)^2 - 1` is.
    fn is_zero(&mut self, pool: &ExprPool, expr: ExprId) -> bool {
        if !is_constant(pool, expr) {
            return false;
        }
        let bounds = self.bounds(pool, expr);
        if !bounds.contains(0.0) || bounds.magnitude() > SMALL {
            return false;
        }
        if pool.reachable(&[expr]).len() > MAX_PROOF {
            return false;
        }
        let mut forms = CanonicalForms::new(pool, &[expr]);
        let form = forms.of(expr);
        let cleared = forms.without_fractions(&form);
        cleared.is_some_and(|form| form.is_zero())
    }
}

/// Whether an expression has no variables; decimals are none.
fn is_constant(pool: &ExprPool, expr: ExprId) -> bool {
    let mut symbols = pool.symbols_of(expr).into_iter();
    symbols.all(|symbol| pool.decimal_of(symbol).is_some())
}
