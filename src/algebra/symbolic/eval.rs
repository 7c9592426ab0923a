//! Numeric values.

use super::node::{ExprId, Node, SymbolId};
use super::pool::ExprPool;
use super::rounding::power_by;

impl ExprPool {
    /// The value of `expr` where symbols have the values that `value_of` gives.
    ///
    /// NaN or an infinity where the expression has no value. Every distinct subexpression is
    /// computed once, sums and products from left to right, integer powers as multiplication
    /// chains.
    pub fn evaluate(&self, expr: ExprId, value_of: &dyn Fn(SymbolId) -> f64) -> f64 {
        self.evaluate_all(&[expr], value_of)[0]
    }

    /// The values of several expressions, which share the work of common subexpressions.
    pub fn evaluate_all(&self, exprs: &[ExprId], value_of: &dyn Fn(SymbolId) -> f64) -> Vec<f64> {
        self.fold_up(exprs, |pool, expr, child| match pool.node(expr) {
            Node::Number(number) => number.to_f64(),
            Node::Symbol(symbol) => match pool.selection(*symbol) {
                Some([test, zero, _]) if child(test) == 0.0 => child(zero),
                Some([_, _, other]) => child(other),
                None => value_of(*symbol),
            },
            Node::Sum(terms) => terms.iter().map(|term| child(*term)).sum(),
            Node::Product(factors) => factors.iter().map(|factor| child(*factor)).product(),
            Node::Power(base, exponent) => match pool.as_integer(*exponent) {
                Some(integer) => integer_power(child(*base), integer),
                None => child(*base).powf(child(*exponent)),
            },
            Node::Apply(function, argument) => function.evaluate(child(*argument)),
        })
    }

    /// Computes something for every expression that `roots` are made of, operands first, and
    /// gives the results for `roots`. `step` receives the results of operands.
    pub fn fold_up<T: Clone>(
        &self,
        roots: &[ExprId],
        mut step: impl FnMut(&ExprPool, ExprId, &dyn Fn(ExprId) -> T) -> T,
    ) -> Vec<T> {
        let order = self.reachable(roots);
        let mut results: Vec<T> = Vec::with_capacity(order.len());
        let place = |expr: ExprId| {
            order
                .binary_search(&expr)
                .expect("operands come before what uses them")
        };
        for &expr in &order {
            let result = step(self, expr, &|child| results[place(child)].clone());
            results.push(result);
        }
        roots
            .iter()
            .map(|root| results[place(*root)].clone())
            .collect()
    }
}

/// `base ^ exponent` by squaring.
#[inline]
pub(crate) fn integer_power(base: f64, exponent: i64) -> f64 {
    let power = power_by(base, exponent.unsigned_abs(), |a, b| a * b);
    if exponent < 0 { 1.0 / power } else { power }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::symbolic::Function;

    fn at_two(text: &str) -> f64 {
        let mut pool = ExprPool::new();
        let expr = pool.parsed(text);
        pool.evaluate(expr, &|_| 2.0)
    }

    #[test]
    fn evaluate_gives_the_values_of_all_operations() {
        assert_eq!(at_two("3 - x + x^3/4"), 3.0);
        assert_eq!(at_two("x^-2"), 0.25);
        assert_eq!(at_two("x^0.3"), 2f64.powf(0.3));
        assert_eq!(at_two("x^y"), 4.0);
        assert_eq!(at_two("1/3"), 1.0 / 3.0);
        assert_eq!(at_two("sign(x) + sign(-x) + abs(-x)"), 2.0);
        assert_eq!(at_two("sqrt(x)^3"), 2f64.sqrt() * 2f64.sqrt() * 2f64.sqrt());
    }

    #[test]
    fn evaluate_outside_the_domain_is_not_finite() {
        assert_eq!(at_two("1/0"), f64::INFINITY);
        assert!(at_two("sqrt(1 - x)").is_nan());
        assert_eq!(at_two("log(0)"), f64::NEG_INFINITY);
    }

    #[test]
    fn evaluate_visits_shared_subexpressions_once() {
        let mut pool = ExprPool::new();
        let mut expr = pool.symbol("x");
        // A tree of 2^200 leaves, but only a few hundred distinct nodes.
        for _ in 0..200 {
            let sine = pool.apply(Function::Sin, expr);
            let cosine = pool.apply(Function::Cos, expr);
            expr = pool.mul(sine, cosine);
        }
        assert!(pool.evaluate(expr, &|_| 0.4).is_finite());
    }
}
