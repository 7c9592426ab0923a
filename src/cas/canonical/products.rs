//! Products, powers, quotients and square roots of normal forms, with the powers of atoms in their ranges.

use super::*;
use crate::number::power;

/// Largest power of a sum that is multiplied out, and of a single term.
const MAX_SUM_POWER: u32 = 40;
const MAX_TERM_POWER: u32 = 2_000;
/// Most products of terms that one multiplication makes.
const MAX_PRODUCTS: usize = 40_000;
const MAX_STEPS: usize = 200_000;
/// Most terms of a square or dividend.
const MAX_SQUARE: usize = 60;

impl CanonicalForms<'_> {
    pub(super) fn product(
        &mut self,
        a: &CanonicalForm,
        b: &CanonicalForm,
    ) -> Option<CanonicalForm> {
        if a.terms.len().checked_mul(b.terms.len())? > MAX_PRODUCTS {
            return None;
        }
        let pairs = (a.terms.iter()).flat_map(|of_a| b.terms.iter().map(move |of_b| (of_a, of_b)));
        let products = pairs.map(|((m, c), (n, d))| (c * d, m.times(n)));
        self.settled(products.collect())
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
            let term = |(other, scale)| (&coefficient * &scale, rest.times(&other));
            pending.extend(factor.map(term));
        }
        Some(form)
    }

    /// A monomial with one atom out of range, as one without it times a form, or nothing if that is too large.
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
                Atom::Call(Function::Abs, base) => {
                    let rest = power.rem_euclid(2);
                    if rest != power {
                        return Some((with_power(rest), self.power(&base, power - rest)));
                    }
                    let beside = [
                        Atom::Sum(base.clone()),
                        Atom::Call(Function::Sign, base.clone()),
                    ];
                    let [sum, sign] = beside.map(|atom| self.numbers.get(&atom).copied());
                    let shared = base.as_atom().or(sum);
                    if let Some(shared) = shared.filter(|shared| monomial.power_of(*shared) < 0) {
                        // |x| / x = sign(x).
                        let rest = monomial.without(atom).times(&Monomial::atom(shared, 1));
                        return Some((rest, Some(self.call(Function::Sign, base))));
                    }
                    if let Some(sign) = sign.filter(|sign| monomial.power_of(*sign) > 0) {
                        // |x| sign(x) = x, |x| sign(x)^2 = |x|.
                        let rest = monomial.without(sign);
                        return Some(match monomial.power_of(sign) % 2 {
                            0 => (rest, Some(CanonicalForm::one())),
                            _ => (rest.without(atom), Some(base)),
                        });
                    }
                }
                Atom::Call(Function::Sign, base) => {
                    if !(0..=2).contains(&power) {
                        let rest = 2 - power.rem_euclid(2);
                        return Some((with_power(rest), Some(CanonicalForm::one())));
                    }
                    // x sign(x) = |x|, x sign(x)^2 = x, sign(x)/x as it is.
                    let rest = monomial.without(atom);
                    match base.as_atom().map(|x| (x, monomial.power_of(x))) {
                        None | Some((_, 0)) => {}
                        Some(_) if power == 2 => return Some((rest, Some(CanonicalForm::one()))),
                        Some((_, ..0)) => {}
                        Some((x, _)) => {
                            let rest = rest.times(&Monomial::atom(x, -1));
                            return Some((rest, Some(self.call(Function::Abs, base))));
                        }
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
        let base = match exponent < 0 {
            true => self.reciprocal(base)?,
            false => base.clone(),
        };
        let count = exponent.unsigned_abs();
        let is_sum = base.terms.len() > 1;
        if count
            > if is_sum {
                MAX_SUM_POWER
            } else {
                MAX_TERM_POWER
            }
        {
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
        // A real factor: the sum of a real form is real, as magnitudes, signs and roots assume.
        let (normed, size, sign) = form.normed()?;
        let normed = self.argument(normed);
        let atom = Monomial::atom(self.number(Atom::Sum(normed)), -1);
        Some(CanonicalForm::term(&size.reciprocal()? * &sign, atom))
    }

    /// `(scale, q)` with `form = scale * q^2` and a positive scale, if there is such a sum `q`; `form` is real. The
    /// terms of `q` follow one after the other, largest first, in an order that products keep.
    pub(super) fn square_root(
        &mut self,
        form: &CanonicalForm,
    ) -> Option<(Rational, CanonicalForm)> {
        if form.terms.len() > MAX_SQUARE {
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
            let rest = &monic - &square;
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
            root.add(&coefficient * &ratio(1, 2).into(), next);
        }
        None
    }

    /// A sum that is positive where it is used and divides the form, and the quotient, which is a sum too.
    pub(super) fn positive_divisor(
        &mut self,
        form: &CanonicalForm,
    ) -> Option<(CanonicalForm, CanonicalForm)> {
        if self.positive_sums.len() < 2 || form.terms.len() > MAX_SQUARE {
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
        for _ in 0..MAX_SQUARE {
            let Some((monomial, coefficient)) = order.largest(&rest) else {
                return Some(quotient);
            };
            let weight = order.weight(&monomial);
            let next = monomial.times(&inverse);
            if weight >= last || next.powers.iter().any(|(_, power)| *power < 0) {
                return None;
            }
            last = weight;
            let term = CanonicalForm::term(&coefficient * &factor, next);
            rest = &rest - &self.product(&term, divisor)?;
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
        let distinct = form.exponents().into_iter().enumerate();
        let weighted = distinct.map(|(place, of)| (of.clone(), (place as f64 + 2.7).sqrt()));
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
