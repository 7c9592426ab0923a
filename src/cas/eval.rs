//! Numeric values.

use super::node::{ExprId, Node, SymbolId};
use super::pool::ExprPool;
use super::rounding::power_by;

impl ExprPool {
    /// The value of `expr` where variables have the values that `value_of` gives.
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
            Node::Symbol(symbol) => match (pool.selection(*symbol), pool.decimal_of(*symbol)) {
                (Some([test, zero, _]), _) if child(test) == 0.0 => child(zero),
                (Some([_, _, other]), _) => child(other),
                (None, Some((_, value))) => value,
                (None, None) => value_of(*symbol),
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

/// `base^exponent` by squaring, in the order of multiplications of the interpreter and of generated code.
#[inline]
pub fn integer_power(base: f64, exponent: i64) -> f64 {
    let power = power_by(base, exponent.unsigned_abs(), |a, b| a * b);
    if exponent < 0 { 1.0 / power } else { power }
}
