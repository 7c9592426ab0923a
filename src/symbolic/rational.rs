//! Quotients: common denominators and exact division.

use std::collections::BTreeMap;

use super::expand::{MAX_TERMS, Terms};
use super::node::{ExprId, Node};
use super::number::Number;
use super::order::Exponent;
use super::perfect_power::add;
use super::pool::ExprPool;

/// Most steps of one polynomial division.
const MAX_STEPS: usize = 500;
/// Most different denominators that are brought together: the numerator grows with all of them.
const MAX_DENOMINATORS: usize = 12;

/// Exact coefficients by the exponents of common bases.
pub(super) type Monomials = BTreeMap<Vec<i64>, Number>;

impl ExprPool {
    /// The terms of a sum over one common denominator, with the numerator multiplied out and
    /// divided by parts of the denominator where that leaves no remainder:
    /// `x/(x + y) + y/(x + y)` becomes `1`, `(x^2 - 1)/(x - 1)` becomes `1 + x`.
    ///
    /// Nothing changes unless a sum or a function occurs in a denominator, or if there are too
    /// many different ones. Numerators that would exceed `budget` products stay products.
    pub(super) fn together(&mut self, expr: ExprId, budget: &mut usize) -> ExprId {
        let terms = self.terms_of(expr);
        let mut denominators: Vec<(ExprId, Number)> = Vec::new();
        for (_, rest) in &terms {
            for (base, exponent) in self.denominators_of(*rest) {
                match denominators.iter_mut().find(|(known, _)| *known == base) {
                    Some((_, known)) => *known = (*known).max(exponent),
                    None => denominators.push((base, exponent)),
                }
            }
        }
        let is_needed = |(base, _): &(ExprId, Number)| self.as_symbol(*base).is_none();
        let is_manageable = denominators.len() <= MAX_DENOMINATORS;
        if !is_manageable || !denominators.iter().any(is_needed) {
            return expr;
        }
        let powers: Vec<ExprId> = denominators
            .iter()
            .map(|(base, exponent)| self.pow_number(*base, *exponent))
            .collect();
        let mut numerators = Vec::with_capacity(terms.len());
        for (coefficient, rest) in terms {
            let mut factors = powers.clone();
            factors.push(rest);
            let numerator = self.product(&factors);
            let numerator = self.scale(coefficient, numerator);
            numerators.push(self.expand_node(numerator, MAX_TERMS, budget));
        }
        let numerator = self.sum(&numerators);
        self.cancel(numerator, &denominators)
    }

    /// Bases with negative integer exponents in a term, and the magnitudes of these.
    fn denominators_of(&self, rest: ExprId) -> Vec<(ExprId, Number)> {
        self.numeric_powers(rest)
            .into_iter()
            .filter(|(_, exponent)| exponent.is_negative() && exponent.as_integer().is_some())
            .map(|(base, exponent)| (base, -exponent))
            .collect()
    }

    /// The factors of a term as powers with constant exponents.
    pub(super) fn numeric_powers(&self, rest: ExprId) -> Vec<(ExprId, Number)> {
        self.factors_of(rest)
            .iter()
            .filter_map(|factor| match self.base_and_exponent(*factor) {
                (base, Exponent::Number(number)) if self.as_number(base).is_none() => {
                    Some((base, number))
                }
                (_, Exponent::Number(_)) => None,
                (_, Exponent::Expr(_)) => Some((*factor, Number::ONE)),
            })
            .collect()
    }

    /// `numerator / denominators` with exact divisions carried out.
    fn cancel(&mut self, numerator: ExprId, denominators: &[(ExprId, Number)]) -> ExprId {
        let mut numerator = numerator;
        let mut factors = Vec::new();
        for &(base, exponent) in denominators {
            let mut left = exponent;
            while !left.is_zero() && matches!(self.node(base), Node::Sum(_)) {
                let Some(quotient) = self.divide_exactly(numerator, base) else {
                    break;
                };
                numerator = quotient;
                left = left.checked_add(Number::MINUS_ONE).unwrap_or(Number::ZERO);
            }
            // What is left may have a common divisor of fewer terms than either.
            if left.is_one()
                && let Some((above, below)) = self.without_common_divisor(numerator, base)
            {
                numerator = above;
                factors.push(self.powi(below, -1));
                continue;
            }
            factors.push(self.pow_number(base, -left));
        }
        factors.push(numerator);
        self.product(&factors)
    }

    /// Both sums divided by their greatest common divisor, if that is not a number: found by exact
    /// division of the lower one, or by Euclid's algorithm if both are in one base.
    fn without_common_divisor(&mut self, above: ExprId, below: ExprId) -> Option<(ExprId, ExprId)> {
        let is_sum = |expr| matches!(self.node(expr), Node::Sum(_));
        if !is_sum(above) || !is_sum(below) {
            return None;
        }
        if let Some(quotient) = self.divide_exactly(below, above) {
            return Some((ExprId::ONE, quotient));
        }
        let terms = [self.terms_of(above), self.terms_of(below)];
        let bases = bases_of(self, terms.iter().flatten());
        let [_] = bases[..] else { return None };
        let [mut a, mut b] = [
            self.monomials(&terms[0], &bases)?,
            self.monomials(&terms[1], &bases)?,
        ];
        while !b.is_empty() {
            (a, b) = (b.clone(), remainder(a, &b)?);
        }
        let (degree, leading) = a.last_key_value()?;
        if degree[0] == 0 {
            return None;
        }
        let leading = *leading;
        for coefficient in a.values_mut() {
            *coefficient = coefficient.checked_div(leading)?;
        }
        let divisor = self.sum_of_monomials(&a, &bases);
        Some((
            self.divide_exactly(above, divisor)?,
            self.divide_exactly(below, divisor)?,
        ))
    }

    /// `dividend / divisor` if both are sums of products with exact coefficients and positive
    /// integer powers, and the division leaves no remainder.
    fn divide_exactly(&mut self, dividend: ExprId, divisor: ExprId) -> Option<ExprId> {
        let (dividend, divisor) = (self.terms_of(dividend), self.terms_of(divisor));
        let bases = bases_of(self, dividend.iter().chain(&divisor));
        let mut remainder = self.monomials(&dividend, &bases)?;
        let divisor = self.monomials(&divisor, &bases)?;
        let (leading, leading_coefficient) = divisor.last_key_value()?;
        let mut quotient = Monomials::new();
        for _ in 0..MAX_STEPS {
            let Some((exponents, coefficient)) = remainder.last_key_value() else {
                return Some(self.sum_of_monomials(&quotient, &bases));
            };
            let step: Vec<i64> = exponents.iter().zip(leading).map(|(a, b)| a - b).collect();
            if step.iter().any(|exponent| *exponent < 0) {
                return None;
            }
            let factor = coefficient.checked_div(*leading_coefficient)?;
            for (exponents, coefficient) in &divisor {
                let place: Vec<i64> = exponents.iter().zip(&step).map(|(a, b)| a + b).collect();
                add(&mut remainder, place, -coefficient.checked_mul(factor)?)?;
            }
            quotient.insert(step, factor);
        }
        None
    }

    /// Terms by exponents; `None` for floats, numeric roots and powers that are not positive
    /// integers.
    pub(super) fn monomials(&self, terms: &Terms, bases: &[ExprId]) -> Option<Monomials> {
        let mut monomials = Monomials::new();
        for (coefficient, rest) in terms {
            let powers = self.numeric_powers(*rest);
            let n_factors = self
                .factors_of(*rest)
                .iter()
                .filter(|f| **f != ExprId::ONE)
                .count();
            if !coefficient.is_exact() || powers.len() != n_factors {
                return None;
            }
            let mut exponents = vec![0; bases.len()];
            for (base, exponent) in powers {
                let place = bases.iter().position(|known| *known == base)?;
                exponents[place] = exponent.as_integer().filter(|exponent| *exponent > 0)?;
            }
            monomials.insert(exponents, *coefficient);
        }
        Some(monomials)
    }

    pub(super) fn sum_of_monomials(&mut self, monomials: &Monomials, bases: &[ExprId]) -> ExprId {
        let mut terms = Vec::with_capacity(monomials.len());
        for (exponents, coefficient) in monomials {
            let powers: Vec<ExprId> = bases
                .iter()
                .zip(exponents)
                .map(|(base, exponent)| self.pow_number(*base, Number::integer(*exponent)))
                .collect();
            let product = self.product(&powers);
            terms.push(self.scale(*coefficient, product));
        }
        self.sum(&terms)
    }
}

/// What is left of a polynomial in one base when another is divided out; nothing if a coefficient is
/// no longer exact.
fn remainder(mut of: Monomials, divisor: &Monomials) -> Option<Monomials> {
    let (degree, leading) = divisor.last_key_value()?;
    for _ in 0..MAX_STEPS {
        let Some((highest, coefficient)) = of.last_key_value() else {
            return Some(of);
        };
        let step = highest[0] - degree[0];
        if step < 0 {
            return Some(of);
        }
        let factor = coefficient.checked_div(*leading)?;
        for (exponents, coefficient) in divisor {
            let term = -coefficient.checked_mul(factor)?;
            add(&mut of, vec![exponents[0] + step], term)?;
        }
    }
    None
}

/// The bases of the powers in some terms, in canonical order.
pub(super) fn bases_of<'t>(
    pool: &ExprPool,
    terms: impl IntoIterator<Item = &'t (Number, ExprId)>,
) -> Vec<ExprId> {
    let powers = (terms.into_iter()).flat_map(|(_, rest)| pool.numeric_powers(*rest));
    let mut bases: Vec<ExprId> = powers.map(|(base, _)| base).collect();
    bases.sort_by(|a, b| pool.compare(*a, *b));
    bases.dedup();
    bases
}

#[cfg(test)]
mod tests {
    use super::*;

    fn together(text: &str) -> String {
        let mut pool = ExprPool::new();
        let expr = pool.parse(text, &|_| true).expect("test text parses");
        let result = pool.together(expr, &mut 100_000);
        pool.display(result).to_string()
    }

    #[test]
    fn together_finds_the_common_denominator_and_cancels() {
        assert_eq!(together("x/(x + y) + y/(x + y)"), "1");
        assert_eq!(together("(x^2 - 1)/(x - 1)"), "1 + x");
        assert_eq!(together("1/(x + 1) - 1/(x + 2)"), "1/((1 + x)*(2 + x))");
        assert_eq!(together("1/x - 1/(x*(x + 1))"), "1/(1 + x)");
        assert_eq!(together("(x + 1)/(x^2 - 1)"), "-1/(1 - x)");
        assert_eq!(
            together("(x^2 + 3*x + 2)/(x^2 + 4*x + 3)"),
            "(2 + x)/(3 + x)"
        );
        assert_eq!(
            together("(exp(x)^2 - 1)/(2*exp(x) + 2)"),
            "-1/2 + 1/2*exp(x)"
        );
        assert_eq!(together("(x + y)/(x^2 - y^2)"), "1/(x - y)");
        assert_eq!(together("(x^2 + 1)/(x^2 - 1)"), "-(1 + x^2)/(1 - x^2)");
        assert_eq!(
            together("(x^3 - y^3)/(x - y)^2"),
            "(x^2 + x*y + y^2)/(x - y)"
        );
    }

    #[test]
    fn together_without_sums_in_denominators_changes_nothing() {
        assert_eq!(together("1/x + 1/y"), "1/x + 1/y");
        assert_eq!(together("x + y"), "x + y");
    }

    #[test]
    fn divide_exactly_refuses_remainders_and_floats() {
        let mut pool = ExprPool::new();
        let mut divide = |a: &str, b: &str| {
            let a = pool.parse(a, &|_| true).expect("test text parses");
            let b = pool.parse(b, &|_| true).expect("test text parses");
            pool.divide_exactly(a, b)
                .map(|quotient| pool.display(quotient).to_string())
        };
        assert_eq!(divide("x^2 + 2*x*y + y^2", "x + y"), Some("x + y".into()));
        assert_eq!(divide("2*x + 2", "3*x + 3"), Some("2/3".into()));
        assert_eq!(divide("x^2 + 1", "x + 1"), None);
        assert_eq!(divide("0.5*x^2 - 0.5", "x - 1"), None);
        assert_eq!(divide("1/x - x", "1 - x"), None);
    }
}
