//! Sums that are squares.

use std::collections::{BTreeMap, BTreeSet};

use num_traits::Signed;

use super::coefficient::{Coefficient, Rational, nearest, ratio};
use super::forms::CanonicalForms;
use super::polynomial::{CanonicalForm, Monomial};

const MAX_TERMS: usize = 60;

impl CanonicalForms<'_> {
    /// `(scale, q)` with `form = scale * q^2` and a positive scale, if there is such a sum `q`; `form` is
    /// real. The terms of `q` follow one after the other, largest first, in an order that products keep.
    pub(super) fn square_root(
        &mut self,
        form: &CanonicalForm,
    ) -> Option<(Rational, CanonicalForm)> {
        if form.terms.len() > MAX_TERMS {
            return None;
        }
        let order = Order::of(form);
        let (largest, leading) = order.largest(form)?;
        let leading = leading.as_real()?.clone();
        let monic = form.scaled(&leading.recip().into());
        let first = halved(&largest)?;
        let mut root = CanonicalForm::monomial(first.clone());
        let smallest = form.terms.keys().map(|monomial| order.weight(monomial));
        // The smallest term of a square is that of its root squared.
        let least = 0.5 * smallest.fold(f64::INFINITY, f64::min) - 1e-9;
        let mut last = order.weight(&first);
        for _ in 0..form.terms.len() {
            let square = self.product(&root, &root)?;
            let rest = monic.minus(&square);
            let Some((monomial, coefficient)) = order.largest(&rest) else {
                let imaginary = Coefficient::imaginary(1, 1);
                return Some(match leading.is_negative() {
                    true => (leading.abs(), root.scaled(&imaginary)),
                    false => (leading, root),
                });
            };
            let next = monomial.times(&first.reciprocal());
            let weight = order.weight(&next);
            if weight >= last || weight < least {
                return None;
            }
            last = weight;
            root.add(coefficient.times(&ratio(1, 2).into()), next);
        }
        None
    }

    /// A sum that is positive where it is used and divides the form, and the quotient, which is a sum too.
    pub(super) fn positive_divisor(
        &mut self,
        form: &CanonicalForm,
    ) -> Option<(CanonicalForm, CanonicalForm)> {
        if self.positive_sums.len() < 2 || form.terms.len() > MAX_TERMS {
            return None;
        }
        self.positive_sums.clone().into_iter().find_map(|divisor| {
            let quotient = self.divided(form, &divisor)?;
            (quotient.terms.len() > 1).then_some((divisor, quotient))
        })
    }

    fn divided(&mut self, form: &CanonicalForm, divisor: &CanonicalForm) -> Option<CanonicalForm> {
        let order = Order::of(&form.plus(divisor));
        let (leading, coefficient) = order.largest(divisor)?;
        let (inverse, factor) = (leading.reciprocal(), coefficient.reciprocal()?);
        let (mut quotient, mut rest) = (CanonicalForm::default(), form.clone());
        let mut last = f64::INFINITY;
        for _ in 0..MAX_TERMS {
            let Some((monomial, coefficient)) = order.largest(&rest) else {
                return Some(quotient);
            };
            let weight = order.weight(&monomial);
            let next = monomial.times(&inverse);
            if weight >= last || next.powers.iter().any(|(_, power)| *power < 0) {
                return None;
            }
            last = weight;
            let term = CanonicalForm::term(coefficient.times(&factor), next);
            rest = rest.minus(&self.product(&term, divisor)?);
            quotient = quotient.plus(&term);
        }
        None
    }
}

fn halved(monomial: &Monomial) -> Option<Monomial> {
    let powers = monomial.powers.iter();
    let powers: Option<Vec<_>> = powers
        .map(|&(atom, power)| (power % 2 == 0).then_some((atom, power / 2)))
        .collect();
    Some(Monomial {
        powers: powers?,
        exponent: monomial.exponent.scaled(&ratio(1, 2).into()),
    })
}

/// An order of monomials: by a sum of their powers and exponents with weights that have no simple ratio.
struct Order {
    exponents: BTreeMap<Monomial, f64>,
}

impl Order {
    fn of(form: &CanonicalForm) -> Self {
        let all = form
            .terms
            .keys()
            .flat_map(|monomial| monomial.exponent.terms.keys());
        let distinct: BTreeSet<&Monomial> = all.collect();
        let weighted = (distinct.into_iter().enumerate())
            .map(|(place, of)| (of.clone(), (place as f64 + 2.7).sqrt()));
        Self {
            exponents: weighted.collect(),
        }
    }

    fn weight(&self, monomial: &Monomial) -> f64 {
        let powers = monomial.powers.iter();
        let powers = powers.map(|&(atom, power)| f64::from(power) * (f64::from(atom) + 3.1).ln());
        let exponents = monomial.exponent.terms.iter().map(|(of, power)| {
            let weight = self.exponents.get(of).copied().unwrap_or(1.0);
            weight * (nearest(&power.re) + 1.618 * nearest(&power.im))
        });
        powers.chain(exponents).sum()
    }

    fn largest(&self, form: &CanonicalForm) -> Option<(Monomial, Coefficient)> {
        let weighed = form.terms.iter().map(|term| (self.weight(term.0), term));
        let largest = weighed.max_by(|a, b| a.0.total_cmp(&b.0))?.1;
        Some((largest.0.clone(), largest.1.clone()))
    }
}
