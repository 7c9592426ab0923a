//! Products and powers of normal forms, with the powers of atoms in their ranges.

use super::atoms::Atom;
use super::coefficient::Coefficient;
use super::forms::CanonicalForms;
use super::polynomial::{CanonicalForm, Monomial};
use crate::number::power;

/// Largest power of a sum that is multiplied out, and of a single term.
const MAX_SUM_POWER: u32 = 40;
const MAX_TERM_POWER: u32 = 2_000;
/// Most terms that are looked at while one product is put in order.
const MAX_STEPS: usize = 200_000;

impl CanonicalForms<'_> {
    pub(super) fn product(
        &mut self,
        a: &CanonicalForm,
        b: &CanonicalForm,
    ) -> Option<CanonicalForm> {
        let products = a.products(b)?;
        self.settled(products)
    }

    /// The sum of terms, with the powers of roots, magnitudes and signs in their ranges.
    pub(super) fn settled(
        &mut self,
        mut pending: Vec<(Coefficient, Monomial)>,
    ) -> Option<CanonicalForm> {
        let mut form = CanonicalForm::default();
        let mut steps = 0;
        while let Some((coefficient, monomial)) = pending.pop() {
            steps += 1;
            if steps > MAX_STEPS {
                return None;
            }
            let Some((rest, factor)) = self.rewritten(&monomial) else {
                form.add(coefficient, monomial);
                continue;
            };
            let factor = factor?.terms.into_iter();
            let term = |(other, scale)| (coefficient.times(&scale), rest.times(&other));
            pending.extend(factor.map(term));
        }
        Some(form)
    }

    /// A monomial with one atom out of range, as a monomial without it times a form, or nothing for one that is too
    /// large.
    fn rewritten(&mut self, monomial: &Monomial) -> Option<(Monomial, Option<CanonicalForm>)> {
        for &(atom, power) in &monomial.powers {
            let with_power = |power: i32| match power {
                0 => monomial.without(atom),
                _ => monomial.without(atom).times(&Monomial::atom(atom, power)),
            };
            match self.atoms[atom as usize].clone() {
                Atom::Sum(sum) if power > 0 => {
                    return Some((with_power(0), self.power(&sum, power)));
                }
                Atom::Root(base, index) => {
                    let index = i32::try_from(index).expect("indices are at most `MAX_ROOT`");
                    let (whole, rest) = (power.div_euclid(index), power.rem_euclid(index));
                    if whole != 0 {
                        return Some((with_power(rest), self.power(&base, whole)));
                    }
                }
                Atom::Abs(base) => {
                    let rest = power.rem_euclid(2);
                    if rest != power {
                        return Some((with_power(rest), self.power(&base, power - rest)));
                    }
                    let sum = self.numbers.get(&Atom::Sum(base.clone())).copied();
                    let shared = base.as_atom().or(sum);
                    let shared = shared.filter(|shared| monomial.power_of(*shared) < 0);
                    if let Some(shared) = shared {
                        // |x| / x = sign(x).
                        let rest = monomial.without(atom).times(&Monomial::atom(shared, 1));
                        return Some((rest, Some(self.atom(Atom::Sign(base)))));
                    }
                    let sign = self.numbers.get(&Atom::Sign(base.clone())).copied();
                    let sign = sign.map_or((0, 0), |sign| (sign, monomial.power_of(sign)));
                    if sign.1 > 0 {
                        // |x| sign(x) = x, |x| sign(x)^2 = |x|.
                        let rest = monomial.without(sign.0);
                        return Some(match sign.1 % 2 {
                            0 => (rest, Some(CanonicalForm::one())),
                            _ => (rest.without(atom), Some(base)),
                        });
                    }
                }
                Atom::Sign(_) if !(0..=2).contains(&power) => {
                    let rest = 2 - power.rem_euclid(2);
                    return Some((with_power(rest), Some(CanonicalForm::one())));
                }
                Atom::Sign(base) => {
                    let shared = base.as_atom().filter(|base| monomial.power_of(*base) != 0);
                    if let Some(shared) = shared {
                        // x sign(x) = |x|, x sign(x)^2 = x, sign(x)/x as it is.
                        let rest = monomial.without(atom);
                        let is_over = monomial.power_of(shared) > 0;
                        let magnitude = Atom::Abs(base);
                        return Some(match power {
                            2 => (rest, Some(CanonicalForm::one())),
                            _ if !is_over => continue,
                            _ => {
                                let rest = rest.times(&Monomial::atom(shared, -1));
                                (rest, Some(self.atom(magnitude)))
                            }
                        });
                    }
                }
                _ => {}
            }
        }
        None
    }

    pub(super) fn power(&mut self, base: &CanonicalForm, exponent: i32) -> Option<CanonicalForm> {
        if exponent == 0 {
            return Some(CanonicalForm::one());
        }
        let base = if exponent < 0 {
            self.reciprocal(base)?
        } else {
            base.clone()
        };
        let count = exponent.unsigned_abs();
        let limit = if base.terms.len() > 1 {
            MAX_SUM_POWER
        } else {
            MAX_TERM_POWER
        };
        if count > limit {
            return None;
        }
        power(CanonicalForm::one(), base, count.into(), |a, b| {
            self.product(a, b)
        })
    }

    pub(super) fn reciprocal(&mut self, form: &CanonicalForm) -> Option<CanonicalForm> {
        if let Some((coefficient, monomial)) = form.as_term() {
            let reciprocal = (coefficient.reciprocal()?, monomial.reciprocal());
            return self.settled(vec![reciprocal]);
        }
        // A real factor: the sum of a real form is real, as magnitudes, signs and roots take it to be.
        let (normed, size, sign) = form.normed()?;
        let normed = self.argument(normed);
        let atom = Monomial::atom(self.number(Atom::Sum(normed)), -1);
        Some(CanonicalForm::term(size.reciprocal()?.times(&sign), atom))
    }
}
