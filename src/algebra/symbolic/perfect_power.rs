//! Sums that are powers of shorter sums.

use num_integer::Integer;

use super::expand::Terms;
use super::node::{ExprId, Node};
use super::number::Number;
use super::pool::ExprPool;
use super::rational::Monomials;

/// Largest power that is looked for, and longest sum.
pub(super) const MAX_POWER: i64 = 4;
const MAX_TERMS: usize = 35;

impl ExprPool {
    /// `c*(a + b)^n` for a sum that is such a power multiplied out, as `x^2 + 2*x*y + y^2` is.
    pub(super) fn as_power(&mut self, expr: ExprId) -> Option<ExprId> {
        let terms = match self.node(expr) {
            Node::Sum(terms) if (3..=MAX_TERMS).contains(&terms.len()) => self.terms_of(expr),
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
        let powers: Vec<ExprId> = (factors.into_iter())
            .map(|(exponent, base)| self.pow_number(base, exponent))
            .collect();
        Some(self.product(&powers))
    }
}

/// `content` and `root` of a polynomial `content * root^power`, the root's coefficients being whole.
///
/// Each next term of the root is what is left over, divided by the derivative of the power.
fn root_of(polynomial: &Monomials, power: i64) -> Option<(Number, Monomials)> {
    let (highest, leading) = polynomial.last_key_value()?;
    let divisible = highest.iter().all(|exponent| exponent % power == 0);
    let first: Vec<i64> = highest.iter().map(|exponent| exponent / power).collect();
    if !divisible {
        return None;
    }
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
pub(super) fn add(to: &mut Monomials, exponents: Vec<i64>, coefficient: Number) -> Option<()> {
    let entry = to.entry(exponents.clone()).or_insert(Number::ZERO);
    // Floats may cancel to an exact zero where what they stand for does not.
    let sum = (entry.checked_add(coefficient)).filter(|sum| sum.is_exact());
    *entry = sum.filter(|_| coefficient.is_exact())?;
    if entry.is_zero() {
        to.remove(&exponents);
    }
    Some(())
}
