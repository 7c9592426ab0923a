//! Quotients: common denominators and exact division.

use std::collections::BTreeMap;

use super::expand::{Terms, WIDE};
use super::function::Function;
use super::node::{ExprId, Node};
use super::number::Number;
use super::order::Exponent;
use super::perfect_power::add;
use super::pool::ExprPool;
use super::rules::common_unit;

/// Most steps of one polynomial division.
const MAX_STEPS: usize = 500;
/// Largest exponent of a monomial, in units of its base.
const MAX_EXPONENT: i64 = 1 << 32;
/// Most different denominators that are brought together: the numerator grows with all of them.
const MAX_DENOMINATORS: usize = 12;

/// Exact coefficients by the exponents of common [`Bases`], in their units.
pub(super) type Monomials = BTreeMap<Vec<i64>, Number>;

/// What polynomials are in: `x` of `x^2 + x`, `x` with the unit 1/2 of `x + sqrt(x)`, `exp(x)` of
/// `exp(2*x) + exp(-x)`.
pub(super) struct Bases {
    /// In canonical order; all exponents of a base are multiples of its unit.
    units: Vec<(ExprId, Number)>,
    /// Whether a coefficient is a float, so that results are written as such.
    has_floats: bool,
}

impl Bases {
    /// A coefficient as the float that it is written as, if one of the terms had a float.
    pub(super) fn written(&self, coefficient: Number) -> Number {
        let float = Number::from_f64(coefficient.to_f64());
        let is_decimal = |float: &Number| float.decimal() == Some(coefficient);
        let written = float.filter(|float| self.has_floats && is_decimal(float));
        written.unwrap_or(coefficient)
    }
}

impl ExprPool {
    /// The terms of a sum over one common denominator, with the numerator multiplied out and
    /// divided by parts of the denominator where that leaves no remainder:
    /// `x/(x + y) + y/(x + y)` becomes `1`, `(x^2 - 1)/(x - 1)` becomes `1 + x`.
    ///
    /// Nothing changes unless a sum or a function occurs in a denominator, or if there are too
    /// many different ones.
    pub(super) fn together(&mut self, expr: ExprId) -> ExprId {
        let terms = self.terms_of(expr);
        let mut denominators: Vec<(ExprId, Number)> = Vec::new();
        for (_, rest) in &terms {
            for (base, exponent) in self.numeric_powers(*rest) {
                if !exponent.is_negative() || exponent.as_integer().is_none() {
                    continue;
                }
                let exponent = -exponent;
                match denominators.iter_mut().find(|(known, _)| *known == base) {
                    Some((_, known)) => *known = (*known).max(exponent),
                    None => denominators.push((base, exponent)),
                }
            }
        }
        let is_needed = |(base, _): &(ExprId, Number)| self.as_symbol(*base).is_none();
        let is_manageable = denominators.len() <= MAX_DENOMINATORS && self.affords(1);
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
            numerators.push(self.expand_node(numerator, WIDE));
        }
        let numerator = self.sum(&numerators);
        self.cancel(numerator, &denominators)
    }

    /// The factors of a term as powers with constant exponents.
    pub(super) fn numeric_powers(&self, rest: ExprId) -> Vec<(ExprId, Number)> {
        self.factors_of(rest)
            .iter()
            .filter_map(|factor| match self.base_and_exponent(*factor) {
                (base, Exponent::Number(number)) => {
                    self.as_number(base).is_none().then_some((base, number))
                }
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
        let bases = self.bases_of(terms.iter().flatten())?;
        let [_] = bases.units[..] else { return None };
        let [(mut a, _), (mut b, _)] = [
            lowered(self.monomials(&terms[0], &bases)?),
            lowered(self.monomials(&terms[1], &bases)?),
        ];
        while !b.is_empty() {
            (a, b) = (b.clone(), self.divided(a, &b)?.1);
        }
        let (degree, leading) = a.last_key_value()?;
        if degree[0] == 0 {
            return None;
        }
        let leading = *leading;
        for coefficient in a.values_mut() {
            *coefficient = coefficient.checked_div(leading)?;
        }
        let divisor = self.sum_of_monomials(&a, &bases)?;
        Some((
            self.divide_exactly(above, divisor)?,
            self.divide_exactly(below, divisor)?,
        ))
    }

    /// `dividend / divisor` if both are sums of products of powers with exact or decimal coefficients,
    /// and the division leaves no remainder.
    fn divide_exactly(&mut self, dividend: ExprId, divisor: ExprId) -> Option<ExprId> {
        let (dividend, divisor) = (self.terms_of(dividend), self.terms_of(divisor));
        let bases = self.bases_of(dividend.iter().chain(&divisor))?;
        let (dividend, least) = lowered(self.monomials(&dividend, &bases)?);
        let (divisor, least_of_divisor) = lowered(self.monomials(&divisor, &bases)?);
        let (quotient, remainder) = self.divided(dividend, &divisor)?;
        if !remainder.is_empty() {
            return None;
        }
        let place = |step: Vec<i64>| {
            let exponents = step.iter().zip(&least).zip(&least_of_divisor);
            exponents.map(|((step, a), b)| step + a - b).collect()
        };
        let quotient = quotient
            .into_iter()
            .map(|(step, factor)| (place(step), factor));
        self.sum_of_monomials(&quotient.collect(), &bases)
    }

    /// See [`divided`]; nothing if that would be too much work.
    fn divided(
        &mut self,
        dividend: Monomials,
        divisor: &Monomials,
    ) -> Option<(Monomials, Monomials)> {
        let n_steps = dividend.len().min(MAX_STEPS) * divisor.len();
        self.spend(n_steps).then(|| divided(dividend, divisor))?
    }

    /// The bases of the powers in some terms; `None` for roots of numbers and for exponents without
    /// a common unit.
    pub(super) fn bases_of<'t>(
        &mut self,
        terms: impl IntoIterator<Item = &'t (Number, ExprId)>,
    ) -> Option<Bases> {
        let mut powers = Vec::new();
        let mut has_floats = false;
        for &(coefficient, rest) in terms {
            has_floats |= !coefficient.is_exact();
            powers.append(&mut self.powers_of(rest)?);
        }
        powers.sort_by(|(a, _), (b, _)| self.compare(*a, *b));
        let mut units = Vec::new();
        for of_base in powers.chunk_by(|(a, _), (b, _)| a == b) {
            let exponents = of_base.iter().map(|(_, exponent)| *exponent);
            let is_whole = |exponent: Number| exponent.as_integer().is_some();
            let unit = if exponents.clone().all(is_whole) {
                Number::ONE
            } else {
                common_unit(exponents)
            };
            units.push((of_base[0].0, unit));
        }
        Some(Bases { units, has_floats })
    }

    /// The factors of a term as powers with constant exponents, where `exp(2*a - b)` is
    /// `exp(a)^2*exp(b)^-1`; `None` for roots of numbers.
    fn powers_of(&mut self, rest: ExprId) -> Option<Vec<(ExprId, Number)>> {
        let mut powers = Vec::new();
        for factor in self.factors_of(rest).to_vec() {
            match self.base_and_exponent(factor) {
                _ if factor == ExprId::ONE => {}
                (base, Exponent::Number(exponent)) => match *self.node(base) {
                    Node::Number(_) => return None,
                    Node::Apply(Function::Exp, argument) => {
                        for (coefficient, inner) in self.terms_of(argument) {
                            let base = self.apply(Function::Exp, inner);
                            powers.push((base, coefficient.checked_mul(exponent)?));
                        }
                    }
                    _ => powers.push((base, exponent)),
                },
                (_, Exponent::Expr(_)) => powers.push((factor, Number::ONE)),
            }
        }
        Some(powers)
    }

    /// Terms by exponents; `None` for floats that are not written as short decimals.
    pub(super) fn monomials(&mut self, terms: &Terms, bases: &Bases) -> Option<Monomials> {
        let mut monomials = Monomials::new();
        for (coefficient, rest) in terms {
            let mut exponents = vec![0_i64; bases.units.len()];
            for (base, exponent) in self.powers_of(*rest)? {
                let place = (bases.units.iter()).position(|(known, _)| *known == base)?;
                let multiple = exponent.checked_div(bases.units[place].1)?.as_integer()?;
                exponents[place] = exponents[place]
                    .checked_add(multiple)
                    .filter(|exponent| exponent.abs() <= MAX_EXPONENT)?;
            }
            add(&mut monomials, exponents, coefficient.decimal()?)?;
        }
        Some(monomials)
    }

    /// The sum of some monomials, exponentials being merged.
    pub(super) fn sum_of_monomials(
        &mut self,
        monomials: &Monomials,
        bases: &Bases,
    ) -> Option<ExprId> {
        let mut terms = Vec::with_capacity(monomials.len());
        for (exponents, &coefficient) in monomials {
            let (mut powers, mut arguments) = (Vec::new(), Vec::new());
            for (&(base, unit), exponent) in bases.units.iter().zip(exponents) {
                let whole = Number::integer(*exponent);
                let exponent = whole.checked_mul(unit)?;
                match *self.node(base) {
                    Node::Apply(Function::Exp, argument) => {
                        arguments.push(self.scale(exponent, argument));
                    }
                    _ => powers.push(self.pow_number(base, exponent)),
                }
            }
            let argument = self.sum(&arguments);
            powers.push(self.apply(Function::Exp, argument));
            let product = self.product(&powers);
            terms.push(self.scale(bases.written(coefficient), product));
        }
        Some(self.sum(&terms))
    }
}

/// A polynomial divided by the highest product of powers that leaves no negative exponent, and the
/// exponents of that product.
fn lowered(polynomial: Monomials) -> (Monomials, Vec<i64>) {
    let least = (polynomial.keys().cloned())
        .reduce(|a, b| a.iter().zip(&b).map(|(a, b)| *a.min(b)).collect());
    let least = least.unwrap_or_default();
    let lower = |exponents: Vec<i64>| exponents.iter().zip(&least).map(|(a, b)| a - b).collect();
    let lowered = (polynomial.into_iter()).map(|(exponents, number)| (lower(exponents), number));
    (lowered.collect(), least)
}

/// The quotient of two polynomials, and what is left once the highest monomial of the divisor is no
/// part of that of the dividend; nothing if a coefficient is no longer exact.
fn divided(dividend: Monomials, divisor: &Monomials) -> Option<(Monomials, Monomials)> {
    let (lowest, leading) = divisor.last_key_value()?;
    let (mut quotient, mut left) = (Monomials::new(), dividend);
    for _ in 0..MAX_STEPS {
        let Some((highest, coefficient)) = left.last_key_value() else {
            return Some((quotient, left));
        };
        let step: Vec<i64> = highest.iter().zip(lowest).map(|(a, b)| a - b).collect();
        if step.iter().any(|exponent| *exponent < 0) {
            return Some((quotient, left));
        }
        let factor = coefficient.checked_div(*leading)?;
        for (exponents, coefficient) in divisor {
            let place = exponents.iter().zip(&step).map(|(a, b)| a + b).collect();
            add(&mut left, place, -coefficient.checked_mul(factor)?)?;
        }
        quotient.insert(step, factor);
    }
    None
}
