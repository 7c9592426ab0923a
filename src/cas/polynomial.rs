//! Sums as polynomials in powers of common bases: common denominators, exact division, perfect powers.

use super::region::{Terms, WIDE};
use super::rules::common_unit;
use super::*;

const MAX_STEPS: usize = 500;
/// Largest exponent of a monomial, in units of its base.
const MAX_EXPONENT: i64 = 1 << 32;
const MAX_DENOMINATORS: usize = 12;

pub(super) const MAX_POWER: i64 = 4;
const MAX_POWER_TERMS: usize = 35;

/// Exact coefficients by the exponents of common [`Bases`], in their units.
type Monomials = BTreeMap<Vec<i64>, Number>;

/// Bases of polynomials: `x` in `x^2 + x`, `x` with the unit 1/2 in `x + sqrt(x)`, `exp(x)` in `exp(2*x) + exp(-x)`.
struct Bases {
    /// In canonical order; all exponents of a base are multiples of its unit.
    units: Vec<(ExprId, Number)>,
    /// Whether a coefficient is a float, so that results are written as such.
    has_floats: bool,
}

impl Bases {
    /// A coefficient as the float that it is written as, if one of the terms had a float.
    fn written(&self, coefficient: Number) -> Number {
        let float = Number::from_f64(coefficient.to_f64());
        let is_decimal = |float: &Number| float.decimal() == Some(coefficient);
        let written = float.filter(|float| self.has_floats && is_decimal(float));
        written.unwrap_or(coefficient)
    }
}

impl ExprPool {
    /// The terms of a sum over one common denominator. The numerator is multiplied out and divided by parts of the
    /// denominator if no remainder is left: `x/(x + y) + y/(x + y)` is `1`, `(x^2 - 1)/(x - 1)` is `1 + x`. Nothing
    /// changes unless a denominator has a sum or function, or if there are too many different ones.
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
        let powers = denominators
            .iter()
            .map(|(base, power)| self.pow_number(*base, *power));
        let powers: Vec<ExprId> = powers.collect();
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
            // The remaining fraction may have a common divisor of fewer terms than either part.
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

    /// Both sums over their greatest common divisor: by exact division of the lower, or Euclid's algorithm in one base.
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

    /// `dividend / divisor` of sums of products of powers, with exact or decimal coefficients, if nothing remains.
    fn divide_exactly(&mut self, dividend: ExprId, divisor: ExprId) -> Option<ExprId> {
        let (dividend, divisor) = (self.terms_of(dividend), self.terms_of(divisor));
        let bases = self.bases_of(dividend.iter().chain(&divisor))?;
        let (dividend, least) = lowered(self.monomials(&dividend, &bases)?);
        let (divisor, least_of_divisor) = lowered(self.monomials(&divisor, &bases)?);
        let (quotient, remainder) = self.divided(dividend, &divisor)?;
        if !remainder.is_empty() {
            return None;
        }
        let quotient = quotient.into_iter().map(|(mut exponents, factor)| {
            for (place, exponent) in exponents.iter_mut().enumerate() {
                *exponent += least[place] - least_of_divisor[place];
            }
            (exponents, factor)
        });
        self.sum_of_monomials(&quotient.collect(), &bases)
    }

    fn divided(
        &mut self,
        dividend: Monomials,
        divisor: &Monomials,
    ) -> Option<(Monomials, Monomials)> {
        let n_steps = dividend.len().min(MAX_STEPS) * divisor.len();
        self.spend(n_steps).then(|| divided(dividend, divisor))?
    }

    /// The bases of the powers in some terms; `None` for roots of numbers and for exponents without a common unit.
    fn bases_of<'t>(
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

    /// A term's factors as powers, with `exp(2*a - b)` as `exp(a)^2*exp(b)^-1`; `None` for roots of numbers.
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
    fn monomials(&mut self, terms: &Terms, bases: &Bases) -> Option<Monomials> {
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

    fn sum_of_monomials(&mut self, monomials: &Monomials, bases: &Bases) -> Option<ExprId> {
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

    /// `c*(a + b)^n` for a sum that is such a power multiplied out, as `x^2 + 2*x*y + y^2` is.
    pub(super) fn as_power(&mut self, expr: ExprId) -> Option<ExprId> {
        let terms = match self.node(expr) {
            Node::Sum(terms) if (3..=MAX_POWER_TERMS).contains(&terms.len()) => self.terms_of(expr),
            _ => return None,
        };
        let bases = self.bases_of(&terms)?;
        let dividend = self.monomials(&terms, &bases)?;
        (2..=MAX_POWER).rev().find_map(|power| {
            let (content, root) = root_of(&dividend, power)?;
            let root = self.sum_of_monomials(&root, &bases)?;
            let whole = self.pow_number(root, Number::integer(power));
            Some(self.scale(bases.written(content), whole))
        })
    }

    /// A term whose factors are powers to multiples of `n`, to the power `1/n`.
    pub(super) fn whole_root(&mut self, expr: ExprId, n: i64) -> Option<ExprId> {
        let mut factors: Terms = Vec::new();
        for (base, exponent) in self.numeric_powers(expr) {
            let exponent = exponent.checked_div(Number::integer(n))?;
            exponent.as_integer().filter(|exponent| *exponent > 0)?;
            factors.push((exponent, base));
        }
        let powers = (factors.into_iter()).map(|(power, base)| self.pow_number(base, power));
        let powers: Vec<ExprId> = powers.collect();
        Some(self.product(&powers))
    }
}

/// A polynomial over the highest product of powers that leaves no negative exponent, and that product's exponents.
fn lowered(polynomial: Monomials) -> (Monomials, Vec<i64>) {
    let least = (polynomial.keys().cloned())
        .reduce(|a, b| a.iter().zip(&b).map(|(a, b)| *a.min(b)).collect());
    let least = least.unwrap_or_default();
    let lower = |exponents: Vec<i64>| exponents.iter().zip(&least).map(|(a, b)| a - b).collect();
    let lowered = (polynomial.into_iter()).map(|(exponents, number)| (lower(exponents), number));
    (lowered.collect(), least)
}

/// Quotient and remainder of two polynomials by highest monomials; nothing if a coefficient is no longer exact.
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

/// `content` and `root` of a polynomial `content * root^power`, the root's coefficients being whole. Each next term of
/// the root is the remainder divided by the derivative of the power.
fn root_of(polynomial: &Monomials, power: i64) -> Option<(Number, Monomials)> {
    let (highest, leading) = polynomial.last_key_value()?;
    let halved = |exponent: &i64| (exponent % power == 0).then_some(exponent / power);
    let first: Vec<i64> = highest.iter().map(halved).collect::<Option<_>>()?;
    // A power of k terms has at least n (k - 1) + 1.
    let most = (polynomial.len() - 1) / usize::try_from(power).ok()?;
    let slope = leading.checked_mul(Number::integer(power))?;
    let mut root = Monomials::from([(first.clone(), Number::ONE)]);
    loop {
        let mut whole = Monomials::from([(vec![0; first.len()], *leading)]);
        for _ in 0..power {
            whole = product(&whole, &root)?;
        }
        for (exponents, coefficient) in polynomial {
            add(&mut whole, exponents.clone(), -*coefficient)?;
        }
        let Some((exponents, excess)) = whole.last_key_value() else {
            break;
        };
        let next: Vec<i64> = (exponents.iter().zip(&first))
            .map(|(exponent, first)| exponent - (power - 1) * first)
            .collect();
        let is_lower = root.first_key_value().is_some_and(|(last, _)| next < *last);
        if !is_lower || root.len() > most {
            return None;
        }
        root.insert(next, (-*excess).checked_div(slope)?);
    }
    let mut denominators = root.values().map(|number| number.as_rational());
    let common = denominators.try_fold(1_i64, |common, number| {
        let (_, denominator) = number?;
        common.checked_mul(denominator / common.gcd(&denominator))
    })?;
    let common = Number::integer(common);
    let content = leading.checked_div(common.checked_powi(power)?)?;
    for coefficient in root.values_mut() {
        *coefficient = coefficient.checked_mul(common)?;
    }
    content.is_exact().then_some((content, root))
}

fn product(a: &Monomials, b: &Monomials) -> Option<Monomials> {
    let mut product = Monomials::new();
    for (exponents_a, coefficient_a) in a {
        for (exponents_b, coefficient_b) in b {
            let exponents = exponents_a.iter().zip(exponents_b).map(|(a, b)| a + b);
            let coefficient = coefficient_a.checked_mul(*coefficient_b)?;
            add(&mut product, exponents.collect(), coefficient)?;
        }
    }
    Some(product)
}

/// Adds a term to a polynomial; nothing if a coefficient is no longer exact.
fn add(to: &mut Monomials, exponents: Vec<i64>, coefficient: Number) -> Option<()> {
    let entry = to.entry(exponents.clone()).or_insert(Number::ZERO);
    // Rounded coefficients may add up to zero although the numbers that were rounded do not.
    let sum = (entry.checked_add(coefficient)).filter(|sum| sum.is_exact());
    *entry = sum.filter(|_| coefficient.is_exact())?;
    if entry.is_zero() {
        to.remove(&exponents);
    }
    Some(())
}
