//! Identities of exponentials, logarithms and roots, and where each is applied; those of tangents, magnitudes and signs
//! are in `factors`. Rules lead towards a normal form in which equal expressions coincide, or towards fewer function
//! calls. Each is an identity wherever its left side has a value:
//!
//! | normal form | |
//! |---|---|
//! | `exp(a)*exp(b)`, `exp(a)^n`, `exp(n*log(a))` | `exp(a + b)`, `exp(n*a)`, `a^n` |
//! | `log(a^n)`, `log(exp(a)*b)` | `n*log(a)` (`n*log(abs(a))` for even `n`), `a + log(b)` |
//! | `n*log(a) + m*log(b)` | `log(a^n*b^m)` for small integers `n`, `m` up to a common factor |
//! | `sqrt(a)*sqrt(b)`, `sqrt(exp(a))` | `sqrt(a*b)`, `exp(a/2)` |
//! | `1/(a^2 + a*b)`, `1/(1 + exp(-a))` | `1/(a*(a + b))`, `exp(a)/(exp(a) + 1)` |
//! | `abs(a*b)`, `sign(a)*sign(b)` | `abs(a)*abs(b)`, `sign(a*b)` |
//!
//! | fewer calls | |
//! |---|---|
//! | `abs(a)*abs(b)` | `abs(a*b)` |
//! | `(exp(a) - exp(b))/(exp(a) + exp(b))` | `tanh((a - b)/2)` |

use super::factors::Stage;
use super::*;

/// Largest power that merging logarithms may create, and most parts of a number that are tried as unit.
const MAX_LOG_POWER: i64 = 4;

impl ExprPool {
    pub(super) fn normal_rules(&mut self, expr: ExprId) -> ExprId {
        match *self.node(expr) {
            Node::Apply(Function::Log, argument) => self.split_log(argument).unwrap_or(expr),
            Node::Apply(Function::Exp, argument) => self.split_exp(argument).unwrap_or(expr),
            Node::Apply(Function::Abs, argument) => self.split_abs(argument).unwrap_or(expr),
            Node::Apply(Function::Sqrt, argument) => match *self.node(argument) {
                Node::Apply(Function::Exp, exponent) => {
                    let half = self.scale(Number::HALF, exponent);
                    self.apply(Function::Exp, half)
                }
                _ => expr,
            },
            Node::Product(_) | Node::Power(..) => {
                let expr = self.split_divisor(expr);
                let expr = self.merge_exponentials(expr);
                let expr = self.merge_factors(Stage::Normal, expr);
                let expr = self.merge_calls(Function::Sign, expr);
                self.merge_roots(expr)
            }
            Node::Sum(_) => self.merge_logs(expr),
            Node::Number(_) | Node::Symbol(_) | Node::Apply(..) => expr,
        }
    }

    pub(super) fn compact_rules(&mut self, expr: ExprId) -> ExprId {
        if !matches!(self.node(expr), Node::Product(_)) {
            return expr;
        }
        let expr = self.merge_factors(Stage::Angles, expr);
        let expr = self.merge_hyperbolic_tangent(expr).unwrap_or(expr);
        let expr = self.merge_calls(Function::Abs, expr);
        self.merge_factors(Stage::Signs, expr)
    }

    fn split_exp(&mut self, argument: ExprId) -> Option<ExprId> {
        let mut powers = Vec::new();
        let mut left = Vec::new();
        for (number, rest) in self.terms_of(argument) {
            let Some((cofactor, base)) = self.as_log_term(rest) else {
                left.push((number, rest));
                continue;
            };
            let exponent = self.scale(number, cofactor);
            powers.push(self.pow(base, exponent));
        }
        if powers.is_empty() {
            return None;
        }
        let left = self.sum_of_terms(left);
        powers.push(self.apply(Function::Exp, left));
        Some(self.product(&powers))
    }

    fn split_log(&mut self, argument: ExprId) -> Option<ExprId> {
        // A logarithm has a value only where the sign is one.
        if let Node::Apply(Function::Sign, _) = self.node(argument) {
            return Some(ExprId::ZERO);
        }
        if let Some((1, divisor @ 2..)) = self.as_number(argument).and_then(Number::as_rational) {
            let divisor = self.integer(divisor);
            let log = self.apply(Function::Log, divisor);
            return Some(self.scale(Number::MINUS_ONE, log));
        }
        if let (base, Exponent::Number(exponent)) = self.base_and_exponent(argument)
            && !exponent.is_one()
            && self.as_number(base).is_none()
        {
            let base = match exponent.is_even() {
                true => self.apply(Function::Abs, base),
                false => base,
            };
            let log = self.apply(Function::Log, base);
            return Some(self.scale(exponent, log));
        }
        let (mut outside, inside) = self.split_exponentials(argument);
        if outside.is_empty() {
            return None;
        }
        let inside = self.product(&inside);
        outside.push(self.apply(Function::Log, inside));
        Some(self.sum(&outside))
    }

    /// `1/(a^2 + a*b) = 1/(a*(a + b))`, also with the least negative powers in front.
    fn split_divisor(&mut self, expr: ExprId) -> ExprId {
        let Some((base, power @ ..0)) = self.sum_power(expr) else {
            return expr;
        };
        let exponent = Number::integer(power);
        let terms = self.summands_of(base).to_vec();
        let powers = terms
            .iter()
            .map(|term| self.powers_with_exponentials(*term));
        let powers: Vec<Vec<(ExprId, Number)>> = powers.collect();
        let mut shared: Vec<(ExprId, Number)> = Vec::new();
        for &(factor, _) in powers.iter().flatten() {
            let exponents = powers.iter().map(|powers| {
                let found = powers.iter().find(|(base, _)| *base == factor);
                found.map_or(Number::ZERO, |(_, exponent)| *exponent)
            });
            let least = exponents.min_by(|a, b| a.to_f64().total_cmp(&b.to_f64()));
            let least = least.filter(|least| !least.is_zero() && least.as_integer().is_some());
            shared.extend(least.map(|least| (factor, least)));
        }
        shared.sort_unstable_by_key(|(factor, _)| *factor);
        shared.dedup();
        if shared.is_empty() {
            return expr;
        }
        let divisors = (shared.into_iter()).map(|(base, least)| self.pow_number(base, -least));
        let divisors: Vec<ExprId> = divisors.collect();
        let divisor = self.product(&divisors);
        let rest: Vec<ExprId> = (terms.into_iter())
            .map(|term| {
                let term = self.mul(term, divisor);
                self.merge_exponentials(term)
            })
            .collect();
        let rest = self.sum(&rest);
        let parts = [
            self.pow_number(rest, exponent),
            self.pow_number(divisor, -exponent),
        ];
        self.product(&parts)
    }

    /// Factors of a term with their powers, where `exp(2*a - b)` is `exp(a)^2*exp(b)^-1`.
    fn powers_with_exponentials(&mut self, term: ExprId) -> Vec<(ExprId, Number)> {
        let mut powers = Vec::new();
        for (base, power) in self.numeric_powers(term) {
            let Node::Apply(Function::Exp, argument) = *self.node(base) else {
                powers.push((base, power));
                continue;
            };
            for (coefficient, rest) in self.terms_of(argument) {
                let whole = match coefficient.is_negative() {
                    _ if coefficient.as_integer().is_some() && rest != ExprId::ONE => coefficient,
                    true => Number::MINUS_ONE,
                    false => Number::ONE,
                };
                let unit = coefficient.checked_div(whole).unwrap_or(Number::ONE);
                let unit = self.scale(unit, rest);
                let single = self.apply(Function::Exp, unit);
                powers.push((single, whole.checked_mul(power).unwrap_or(power)));
            }
        }
        powers
    }

    /// The exponents of the exponentials among the factors of a product, and its other factors.
    fn split_exponentials(&mut self, expr: ExprId) -> (Vec<ExprId>, Vec<ExprId>) {
        self.partition_factors(expr, |pool, factor| match pool.function_power(factor) {
            Some((Function::Exp, argument, power)) => {
                Some(pool.scale(Number::integer(power), argument))
            }
            _ => None,
        })
    }

    fn merge_exponentials(&mut self, expr: ExprId) -> ExprId {
        let (exponents, mut others) = self.split_exponentials(expr);
        if exponents.is_empty() {
            return expr;
        }
        let exponent = self.sum(&exponents);
        others.push(self.apply(Function::Exp, exponent));
        self.product(&others)
    }

    fn merge_roots(&mut self, expr: ExprId) -> ExprId {
        // Each as its base and the remaining power after one root of it is removed.
        let (roots, mut outside) = self.partition_factors(expr, |pool, factor| {
            let (base, Exponent::Number(exponent)) = pool.base_and_exponent(factor) else {
                return None;
            };
            let halves = exponent.as_rational().filter(|parts| parts.1 == 2)?.0;
            let whole = pool.pow_number(base, Number::integer((halves - 1) / 2));
            Some((factor, base, whole))
        });
        let (numbers, others): (Vec<_>, Vec<_>) =
            (roots.into_iter()).partition(|root| self.as_number(root.1).is_some());
        let mut inside: Vec<ExprId> = others.iter().map(|root| root.1).collect();
        outside.extend(others.iter().map(|root| root.2));
        // Roots of numbers stay outside unless they meet another root that makes them rational.
        for (factor, base, whole) in numbers {
            let radicand = self.product(&[inside.as_slice(), &[base]].concat());
            let content = self.constant(self.split(radicand).0);
            let root = self.pow_number(content, Number::HALF);
            if !inside.is_empty() && self.as_number(root).is_some() {
                inside.push(base);
                outside.push(whole);
            } else {
                outside.push(factor);
            }
        }
        if inside.len() < 2 {
            return expr;
        }
        let radicand = self.product(&inside);
        outside.push(self.pow_number(radicand, Number::HALF));
        self.product(&outside)
    }

    /// `(exp(a) - exp(b))/(exp(a) + exp(b)) = tanh((a - b)/2)`, where `1` is `exp(0)`.
    fn merge_hyperbolic_tangent(&mut self, expr: ExprId) -> Option<ExprId> {
        let mut factors = self.factors_of(expr).to_vec();
        let (above, below, scale, [a, b]) =
            factors.iter().enumerate().find_map(|(above, top)| {
                let [(first, a), (second, b)] = self.two_exponentials(*top)?;
                let (below, unit) = factors.iter().enumerate().find_map(|(below, factor)| {
                    let (base, -1) = self.integer_power(*factor)? else {
                        return None;
                    };
                    let [(unit, c), (other, d)] = self.two_exponentials(base)?;
                    (unit == other && [a, b] == [c, d]).then_some((below, unit))
                })?;
                let scale = first.checked_div(unit).filter(|_| first == -second)?;
                Some((above, below, scale, [a, b]))
            })?;
        let difference = self.sub(a, b);
        let half = self.scale(Number::HALF, difference);
        let tangent = self.apply(Function::Tanh, half);
        factors[above] = self.scale(scale, tangent);
        factors[below] = ExprId::ONE;
        Some(self.product(&factors))
    }

    /// Coefficients and exponents of a sum of two exponentials, of which one may be a number.
    fn two_exponentials(&self, expr: ExprId) -> Option<[(Number, ExprId); 2]> {
        let Node::Sum(terms) = self.node(expr) else {
            return None;
        };
        let exponential = |term: ExprId| match (self.split(term), self.node(self.split(term).1)) {
            ((number, ExprId::ONE), _) => Some((number, ExprId::ZERO)),
            ((number, _), Node::Apply(Function::Exp, exponent)) => Some((number, *exponent)),
            _ => None,
        };
        match terms[..] {
            [a, b] => Some([exponential(a)?, exponential(b)?]),
            _ => None,
        }
    }

    /// Adds logarithms that have the same cofactor and coefficients in small integer ratios.
    fn merge_logs(&mut self, expr: ExprId) -> ExprId {
        let mut logs: Vec<(ExprId, Number, ExprId)> = Vec::new();
        let mut others = Vec::new();
        for (coefficient, rest) in self.terms_of(expr) {
            match self.as_log_term(rest) {
                Some((cofactor, argument)) => logs.push((cofactor, coefficient, argument)),
                None => others.push((coefficient, rest)),
            }
        }
        if logs.len() < 2 {
            return expr;
        }
        logs.sort_by_key(|(cofactor, coefficient, _)| (*cofactor, coefficient.abs()));
        let mut parts = vec![self.sum_of_terms(others)];
        for group in logs.chunk_by(|a, b| a.0 == b.0) {
            let cofactor = group[0].0;
            let unit = common_unit(group.iter().map(|(_, coefficient, _)| *coefficient));
            let mut arguments = Vec::new();
            for &(_, coefficient, argument) in group {
                let ratio = coefficient.checked_div(unit).and_then(Number::as_integer);
                match ratio.filter(|ratio| ratio.abs() <= MAX_LOG_POWER) {
                    Some(ratio) => {
                        arguments.push(self.pow_number(argument, Number::integer(ratio)));
                    }
                    None => {
                        let log = self.apply(Function::Log, argument);
                        let term = self.product(&[cofactor, log]);
                        parts.push(self.scale(coefficient, term));
                    }
                }
            }
            let product = self.product(&arguments);
            let product = self.together(product);
            let log = self.apply(Function::Log, product);
            let term = self.product(&[cofactor, log]);
            parts.push(self.scale(unit, term));
        }
        self.sum(&parts)
    }

    pub(super) fn as_log_term(&mut self, rest: ExprId) -> Option<(ExprId, ExprId)> {
        let (logs, cofactors) =
            self.partition_factors(rest, |pool, factor| match *pool.node(factor) {
                Node::Apply(Function::Log, argument) => Some(argument),
                _ => None,
            });
        match logs[..] {
            [argument] => Some((self.product(&cofactors), argument)),
            _ => None,
        }
    }
}

/// The largest fraction of the first number of which all are whole multiples; else the first.
pub(super) fn common_unit(numbers: impl Iterator<Item = Number> + Clone) -> Number {
    let first = numbers.clone().next().unwrap_or(Number::ONE).abs();
    let mut units =
        (1..=MAX_LOG_POWER).filter_map(|parts| first.checked_div(Number::integer(parts)));
    let is_common = |unit: &Number| {
        let is_whole = |number: Number| number.checked_div(*unit)?.as_integer();
        numbers.clone().all(|number| is_whole(number).is_some())
    };
    units.find(is_common).unwrap_or(first)
}
