//! Whether what is read has a value.
//!
//! A logarithm or root of a number below zero and a quotient by zero have none, whatever they are multiplied with;
//! canonical forms would forget them, as `0*log(z)` is 0 wherever it has a value. So each is looked at when it is read.
//! `0^0` is 1, as in floating point; powers that are not integers have values for bases from zero on only.

use std::collections::HashMap;

use super::canonical::{CanonicalForms, Coefficient};
use super::id_map::IdMap;
use super::interval::Interval;
use super::node::{ExprId, Function, SymbolId};
use super::pool::ExprPool;

/// Largest constant, in nodes, of which it is proven that it is zero.
const MAX_PROOF: usize = 300;
/// Magnitude below which a constant may be zero.
const SMALL: f64 = 1e-6;

/// An expression that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// The expression in canonical form.
    pub expr: ExprId,
    /// What has a value exactly where the expression as written has one: NaN or infinite elsewhere.
    pub guards: Vec<ExprId>,
}

/// What is known of the parts of a text.
#[derive(Debug, Default)]
pub(super) struct Guards {
    pub(super) found: Vec<ExprId>,
    /// Symbols that stand for decimals, with their texts.
    pub(super) decimals: HashMap<SymbolId, String>,
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
        match function {
            Function::Log => {
                let guard = pool.apply(Function::Log, argument);
                self.note(pool, guard) && !self.is_zero(pool, argument)
            }
            Function::Sqrt => {
                let guard = pool.apply(Function::Sqrt, argument);
                self.note(pool, guard)
            }
            Function::Sin
            | Function::Cos
            | Function::Tan
            | Function::Tanh
            | Function::Exp
            | Function::Abs
            | Function::Sign => true,
        }
    }

    /// Notes a quotient by `divisor`; whether it has a value anywhere.
    pub(super) fn division(&mut self, pool: &mut ExprPool, divisor: ExprId) -> bool {
        let guard = pool.powi(divisor, -1);
        self.note(pool, guard) && !self.is_zero(pool, divisor)
    }

    /// Notes a power; whether it has a value anywhere.
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
        if !self.is_constant(pool, guard) {
            self.found.push(guard);
        }
        !self.bounds(pool, guard).is_empty()
    }

    fn is_constant(&self, pool: &ExprPool, expr: ExprId) -> bool {
        let is_decimal = |symbol| self.decimals.contains_key(&symbol);
        pool.is_constant(expr)
            || (!self.decimals.is_empty() && pool.symbols_of(expr).into_iter().all(is_decimal))
    }

    fn decimal(&self, symbol: SymbolId) -> Option<Coefficient> {
        Coefficient::parse(self.decimals.get(&symbol)?, false)
    }

    fn bounds(&mut self, pool: &ExprPool, expr: ExprId) -> Interval {
        let unseen = pool.walk(&[expr], |part| !self.bounds.contains_key(&part), |_| true);
        for part in unseen {
            let range_of = |symbol: SymbolId| match self.decimal(symbol) {
                Some(decimal) => Interval::point(decimal.to_f64()),
                None => Interval::ENTIRE,
            };
            let bounds = pool.bounds_of_node(part, &range_of, &|operand| self.bounds[&operand]);
            self.bounds.insert(part, bounds);
        }
        self.bounds[&expr]
    }

    /// Whether a constant is zero, as `sin(1)^2 + cos(1)^2 - 1` is.
    fn is_zero(&mut self, pool: &ExprPool, expr: ExprId) -> bool {
        if !self.is_constant(pool, expr) {
            return false;
        }
        let bounds = self.bounds(pool, expr);
        if !bounds.contains(0.0) || bounds.magnitude() > SMALL {
            return false;
        }
        if pool.reachable(&[expr]).len() > MAX_PROOF {
            return false;
        }
        let literal = |symbol| self.decimal(symbol);
        let mut forms = CanonicalForms::new(pool, &[expr], &literal);
        let form = forms.of(expr);
        let cleared = forms.without_fractions(&form);
        cleared.is_some_and(|form| form.is_zero())
    }
}
