//! Bounds of expressions over boxes.

use super::interval::Interval;
use super::node::{ExprId, Function, Node, SymbolId};
use super::number::Number;
use super::pool::ExprPool;

impl ExprPool {
    /// For each expression an interval that contains every value which it takes where symbols lie in
    /// the intervals that `range_of` gives, at the points where it is defined.
    ///
    /// Sound but not tight: occurrences of a symbol in different terms count as independent.
    pub fn evaluate_intervals(
        &self,
        exprs: &[ExprId],
        range_of: &dyn Fn(SymbolId) -> Interval,
    ) -> Vec<Interval> {
        self.fold_up(exprs, |pool, expr, child| match pool.node(expr) {
            Node::Number(number) => enclose(*number),
            Node::Symbol(symbol) => range_of(*symbol),
            Node::Sum(terms) => terms
                .iter()
                .map(|term| child(*term))
                .fold(Interval::point(0.0), |a, b| a + b),
            Node::Product(factors) => factors
                .iter()
                .map(|factor| child(*factor))
                .fold(Interval::point(1.0), |a, b| a * b),
            Node::Power(base, exponent) => match pool.as_integer(*exponent) {
                Some(integer) => child(*base).powi(integer),
                None => child(*base).pow(child(*exponent)),
            },
            Node::Apply(function, argument) => {
                let argument = child(*argument);
                match function {
                    Function::Sin => argument.sin(),
                    Function::Cos => argument.cos(),
                    Function::Tan => argument.tan(),
                    Function::Tanh => argument.tanh(),
                    Function::Exp => argument.exp(),
                    Function::Log => argument.log(),
                    Function::Sqrt => argument.sqrt(),
                    Function::Abs => argument.abs(),
                    Function::Sign => argument.sign(),
                }
            }
        })
    }
}

/// The floats around a number; one if it is a float or a short integer.
fn enclose(number: Number) -> Interval {
    match number.as_rational() {
        None => Interval::point(number.to_f64()),
        Some((numerator, denominator)) => enclose_integer(numerator) / enclose_integer(denominator),
    }
}

fn enclose_integer(integer: i64) -> Interval {
    let nearest = integer as f64;
    if nearest as i128 == i128::from(integer) {
        Interval::point(nearest)
    } else {
        Interval::new(nearest.next_down(), nearest.next_up())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounds(text: &str, range: Interval) -> Interval {
        let mut pool = ExprPool::new();
        let expr = pool.parsed(text);
        pool.evaluate_intervals(&[expr], &|_| range)[0]
    }

    #[test]
    fn bounds_of_polynomial_use_collected_powers() {
        let range = Interval::new(-2.0, 1.0);
        assert_eq!(bounds("x*x", range), Interval::new(0.0, 4.0));
        assert_eq!(bounds("1 + 2*x", range), Interval::new(-3.0, 3.0));
        assert_eq!(bounds("x - x", range), Interval::point(0.0));
    }

    #[test]
    fn bounds_of_fraction_contain_the_exact_value() {
        let third = bounds("1/3", Interval::EMPTY);
        assert!(third.contains(1.0 / 3.0) && third.lo() < third.hi());
        let large = bounds("9007199254740993", Interval::EMPTY);
        assert_eq!(
            large,
            Interval::new(9_007_199_254_740_991.0, 9_007_199_254_740_994.0)
        );
    }

    #[test]
    fn bounds_of_undefined_expression_are_empty() {
        assert!(bounds("log(-1 - x^2)", Interval::new(-1.0, 1.0)).is_empty());
        assert!(bounds("1/0", Interval::ENTIRE).is_empty());
    }
}
