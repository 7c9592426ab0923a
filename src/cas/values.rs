//! Values of expressions, and bounds of them over boxes, those of smooth ones sharpened by their slopes.

use std::ops::Neg;

use super::interval::power_by;
use super::*;

impl ExprPool {
    /// The value of `expr` for values of variables by `value_of`; NaN or infinite where it has none. Each subexpression
    /// is computed once, sums and products from left to right, integer powers as multiplication chains.
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

    /// Computes `step` for all that `roots` are made of, from the results of operands; the results for `roots`.
    pub fn fold_up<T: Clone>(
        &self,
        roots: &[ExprId],
        mut step: impl FnMut(&ExprPool, ExprId, &dyn Fn(ExprId) -> T) -> T,
    ) -> Vec<T> {
        let order = self.reachable(roots);
        let mut results: Vec<T> = Vec::with_capacity(order.len());
        let place = |expr: ExprId| order.binary_search(&expr).expect("operands come first");
        for &expr in &order {
            let result = step(self, expr, &|child| results[place(child)].clone());
            results.push(result);
        }
        let of_root = |root: &ExprId| results[place(*root)].clone();
        roots.iter().map(of_root).collect()
    }

    /// For each expression an interval that contains its values for symbols in the intervals of `range_of`, at points
    /// where it is defined. Sound but not tight: occurrences of a symbol in different terms count as independent.
    pub fn evaluate_intervals(
        &self,
        exprs: &[ExprId],
        range_of: &dyn Fn(SymbolId) -> Interval,
    ) -> Vec<Interval> {
        let range_of = |symbol| match self.decimal_of(symbol) {
            Some((decimal, value)) => {
                let radius = decimal.radius();
                Interval::new((value - radius).next_down(), (value + radius).next_up())
            }
            None => range_of(symbol),
        };
        self.fold_up(exprs, |pool, expr, child| {
            pool.bounds_of_node(expr, &range_of, child)
        })
    }

    pub(super) fn bounds_of_node(
        &self,
        expr: ExprId,
        range_of: &dyn Fn(SymbolId) -> Interval,
        child: &dyn Fn(ExprId) -> Interval,
    ) -> Interval {
        match self.node(expr) {
            Node::Number(number) => enclose(*number),
            Node::Symbol(symbol) => range_of(*symbol),
            Node::Sum(terms) => {
                (terms.iter()).fold(Interval::point(0.0), |sum, term| sum + child(*term))
            }
            Node::Product(factors) => {
                (factors.iter()).fold(Interval::point(1.0), |all, factor| all * child(*factor))
            }
            Node::Power(base, exponent) => match self.as_integer(*exponent) {
                Some(integer) => child(*base).powi(integer),
                None => child(*base).pow(child(*exponent)),
            },
            Node::Apply(function, argument) => (function.row().image)(child(*argument)),
        }
    }

    /// An interval that contains every value of `expr` for symbols in the given intervals (others are unbounded), where
    /// it is defined. `slopes` are its derivatives by the symbols of `domain`. Where it is Lipschitz continuous on the
    /// whole box, they sharpen [`evaluate_intervals`](ExprPool::evaluate_intervals). A symbol of which it is monotone
    /// goes to its ends; for others the mean value form `f(c) + sum D_i (X_i - c_i)` around the centre is used.
    /// `sin(x) - x` on `[-0.1, 0.1]` is bounded by 1.7e-4 this way, instead of by 0.2.
    pub fn bound_by_slopes(
        &self,
        expr: ExprId,
        slopes: &[ExprId],
        domain: &[(SymbolId, Interval)],
    ) -> Interval {
        let natural = self.bound_naturally(expr, domain);
        if !self.is_lipschitz_on(expr, domain) {
            return natural;
        }
        let slopes = slopes
            .iter()
            .map(|slope| self.bound_naturally(*slope, domain));
        let slopes: Vec<Interval> = slopes.collect();
        let lowest = self.bound_from_side(expr, domain, &slopes, |slope| slope);
        let highest = self.bound_from_side(expr, domain, &slopes, Neg::neg);
        natural.intersection(Interval::new(lowest.lo(), highest.hi()))
    }

    fn bound_naturally(&self, expr: ExprId, domain: &[(SymbolId, Interval)]) -> Interval {
        self.evaluate_intervals(&[expr], &|symbol| range_of(domain, symbol))[0]
    }

    /// Bounds of `expr` with monotone symbols at the ends from which it goes up, or down if `away` negates slopes.
    fn bound_from_side(
        &self,
        expr: ExprId,
        domain: &[(SymbolId, Interval)],
        slopes: &[Interval],
        away: fn(Interval) -> Interval,
    ) -> Interval {
        let mut reduced = domain.to_vec();
        for ((_, range), slope) in reduced.iter_mut().zip(slopes) {
            let away = away(*slope);
            if away.lo() >= 0.0 {
                *range = Interval::point(range.lo());
            } else if away.hi() <= 0.0 {
                *range = Interval::point(range.hi());
            }
        }
        let natural = self.bound_naturally(expr, &reduced);
        let mut centred = reduced.clone();
        let mut spread = Interval::point(0.0);
        for ((_, range), slope) in centred.iter_mut().zip(slopes) {
            let centre = Interval::point(range.middle());
            spread = spread + *slope * (*range - centre);
            *range = centre;
        }
        natural.intersection(self.bound_naturally(expr, &centred) + spread)
    }

    /// Whether `expr` is surely defined with bounded slopes on the whole box: no jump, arguments inside of domains.
    fn is_lipschitz_on(&self, expr: ExprId, domain: &[(SymbolId, Interval)]) -> bool {
        let nodes = self.reachable(&[expr]);
        let ranges = self.evaluate_intervals(&nodes, &|symbol| range_of(domain, symbol));
        let range = |expr: ExprId| {
            let place = nodes.binary_search(&expr);
            ranges[place.expect("operands are reachable")]
        };
        nodes.iter().all(|node| match *self.node(*node) {
            Node::Number(_) | Node::Sum(_) | Node::Product(_) => true,
            Node::Symbol(_) => range(*node).magnitude().is_finite() && !range(*node).is_empty(),
            Node::Power(base, exponent) => match self.as_integer(exponent) {
                Some(integer) => integer > 0 || !range(base).contains(0.0),
                None => range(base).lo() > 0.0,
            },
            Node::Apply(function, argument) => (function.row().is_lipschitz)(range(argument)),
        })
    }
}

/// `base^exponent` by squaring, in the order of multiplications of the interpreter and of generated code.
#[inline]
pub fn integer_power(base: f64, exponent: i64) -> f64 {
    let power = power_by(base, exponent.unsigned_abs(), |a, b| a * b);
    if exponent < 0 { 1.0 / power } else { power }
}

fn range_of(domain: &[(SymbolId, Interval)], symbol: SymbolId) -> Interval {
    let found = domain.iter().find(|(known, _)| *known == symbol);
    found.map_or(Interval::ENTIRE, |(_, range)| *range)
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
