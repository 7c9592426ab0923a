//! Roots, logarithms, exponentials and magnitudes of normal forms.

use super::*;

impl CanonicalForms<'_> {
    /// A form that is positive where it is used, as `scale * prod base^power * exp(E)` with positive scale and bases.
    pub(super) fn split(&mut self, form: &CanonicalForm) -> Option<Split> {
        let form = self.argument(form.clone());
        let scale = form.leading()?.size();
        let inverse = Coefficient::from(scale.recip());
        let Some((coefficient, monomial)) = form.as_term() else {
            if let Some((exponent, rest)) = self.without_exponential(&form) {
                // log(exp(x) + 1) = x + log(1 + exp(-x)).
                let mut split = self.split(&rest?)?;
                split.exponent = split.exponent.plus(&exponent);
                return Some(split);
            }
            let shared = self.shared_powers(&form);
            if !shared.powers.is_empty() {
                // sqrt(x + x^2) = sqrt(x) sqrt(1 + x) where x is positive.
                let inverse = CanonicalForm::monomial(shared.reciprocal());
                let rest = self.product(&form, &inverse)?;
                let mut split = self.split(&rest)?;
                for &(atom, power) in &shared.powers {
                    split.factors.push((self.magnitude_of(atom)?, power));
                }
                return Some(split);
            }
            if let Some((divisor, quotient)) = self.positive_divisor(&form) {
                // sqrt(2 + 3*x + x^2) = sqrt(1 + x) sqrt(2 + x) where 1 + x is positive.
                let (mut split, other) = (self.split(&divisor)?, self.split(&quotient)?);
                split.scale *= other.scale;
                split.factors.extend(other.factors);
                split.exponent = split.exponent.plus(&other.exponent);
                return Some(split);
            }
            let (scale, factors) = match self.square_root(&form) {
                Some((scale, root)) => (scale, vec![(self.abs(&root)?, 2)]),
                None => (scale, vec![(form.scaled(&inverse), 1)]),
            };
            return Some(Split {
                scale,
                factors,
                exponent: CanonicalForm::default(),
            });
        };
        let mut factors = Vec::new();
        let mut rest = Monomial::default();
        for &(atom, power) in &monomial.powers {
            match self.is_positive(atom) || power % 2 == 0 {
                true => factors.push((self.magnitude_of(atom)?, power)),
                false => rest = rest.times(&Monomial::atom(atom, power)),
            }
        }
        let sign = coefficient * &inverse;
        // A real radicand has real factors: its root has no other interpretation.
        sign.as_real()?;
        match rest.powers[..] {
            [] if sign.is_one() => {}
            [] => return None,
            [(atom, power)] => {
                let base = match &self.atoms[atom as usize] {
                    Atom::Sum(sum) => sum.scaled(&sign),
                    _ => CanonicalForm::term(sign, Monomial::atom(atom, 1)),
                };
                factors.push((base, power));
            }
            // Of a product and its reciprocal one is kept, so that they are known to be powers of each other.
            [(_, power), ..] if power < 0 => {
                factors.push((self.settled(vec![(sign, rest.reciprocal())])?, -1));
            }
            _ => factors.push((CanonicalForm::term(sign, rest), 1)),
        }
        Some(Split {
            scale,
            factors,
            exponent: monomial.exponent.clone(),
        })
    }

    /// The exponent of the exponential of largest real part among the terms of a sum, and the sum divided by that
    /// exponential; nothing if there is none. `exp(x) + 1` and `1 + exp(-x)` leave the same sum.
    fn without_exponential(
        &mut self,
        form: &CanonicalForm,
    ) -> Option<(CanonicalForm, Option<CanonicalForm>)> {
        let names = form.exponents();
        let power = |monomial: &Monomial, name: &Monomial| {
            let found = monomial.exponent.terms.get(name);
            found.map_or_else(Rational::zero, |power| power.re.clone())
        };
        let powers = |monomial: &Monomial| -> Vec<Rational> {
            names.iter().map(|name| power(monomial, name)).collect()
        };
        let largest = form.terms.keys().map(powers).max()?;
        let mut exponent = CanonicalForm::default();
        for (name, power) in names.into_iter().zip(largest) {
            exponent.add(power.into(), name.clone());
        }
        if exponent.is_zero() {
            return None;
        }
        let [_, inverse] = exponentials(&exponent, false);
        let rest = self.product(form, &inverse);
        Some((exponent, rest))
    }

    fn is_positive(&self, atom: u32) -> bool {
        matches!(
            self.atoms[atom as usize],
            Atom::Root(..) | Atom::Call(Function::Abs, _)
        ) || self.positive.contains(&atom)
    }

    /// The magnitude of an atom: itself if it is positive.
    fn magnitude_of(&mut self, atom: u32) -> Option<CanonicalForm> {
        let base = CanonicalForm::atom(atom);
        match self.atoms[atom as usize].clone() {
            Atom::Sum(sum) if self.is_positive(atom) => Some(sum),
            Atom::Sum(sum) => self.abs(&sum),
            _ if self.is_positive(atom) => Some(base),
            _ if self.negative.contains(&atom) => Some(base.scaled(&Coefficient::integer(-1))),
            _ => Some(self.call(Function::Abs, base)),
        }
    }

    /// Powers that all terms of a sum share and that are not negative: those of positive atoms, and even ones.
    fn shared_powers(&self, form: &CanonicalForm) -> Monomial {
        let smaller = |a: i32, b: i32| match a.signum() == b.signum() {
            true => a.signum() * a.abs().min(b.abs()),
            false => 0,
        };
        let mut powers =
            (form.terms.keys().next()).map_or(Vec::new(), |first| first.powers.clone());
        for (atom, power) in &mut powers {
            let others = form.terms.keys().map(|monomial| monomial.power_of(*atom));
            *power = others.fold(*power, smaller);
            if !self.is_positive(*atom) {
                *power -= *power % 2;
            }
        }
        powers.retain(|(_, power)| *power != 0);
        Monomial {
            powers,
            exponent: CanonicalForm::default(),
        }
    }

    pub(super) fn log(&mut self, form: &CanonicalForm) -> Option<CanonicalForm> {
        let split = self.split(form)?;
        let mut sum = split.exponent;
        for (prime, power) in prime_powers(&split.scale) {
            let log = self.call(Function::Log, prime);
            sum = sum.plus(&log.scaled(&Coefficient::integer(power.into())));
        }
        for (base, power) in split.factors {
            let (base, index) = self.radicand(base);
            let log = self.call(Function::Log, base);
            sum = sum.plus(&log.scaled(&ratio(power, index).into()));
        }
        Some(sum)
    }

    pub(super) fn root(&mut self, form: &CanonicalForm, index: u32) -> Option<CanonicalForm> {
        if form.is_zero() {
            return Some(CanonicalForm::default());
        }
        let split = self.split(form)?;
        let mut root = self.exp(split.exponent.scaled(&ratio(1, index).into()))?;
        let primes = prime_powers(&split.scale).into_iter();
        for (base, power) in primes.chain(split.factors) {
            let (base, inner) = self.radicand(base);
            let exponent = ratio(power, BigInt::from(index) * inner);
            let factor = self.positive_power(&base, &exponent)?;
            root = self.product(&root, &factor)?;
        }
        Some(root)
    }

    /// The radicand of a root, with the root's index; anything else with 1.
    pub(super) fn radicand(&self, base: CanonicalForm) -> (CanonicalForm, u32) {
        match base.as_atom().map(|atom| &self.atoms[atom as usize]) {
            Some(Atom::Root(radicand, index)) => (radicand.clone(), *index),
            _ => (base, 1),
        }
    }

    pub(super) fn positive_power(
        &mut self,
        base: &CanonicalForm,
        exponent: &Rational,
    ) -> Option<CanonicalForm> {
        let whole = exponent.floor();
        let power = self.power(base, whole.to_i32()?)?;
        let rest = exponent - whole;
        if rest.is_zero() {
            return Some(power);
        }
        let index = rest.denom().to_i64().filter(|index| *index <= MAX_ROOT)?;
        let root = self.number(Atom::Root(base.clone(), u32::try_from(index).ok()?));
        let root = Monomial::atom(root, rest.numer().to_i32()?);
        self.product(&power, &CanonicalForm::monomial(root))
    }

    pub(super) fn exp(&mut self, argument: CanonicalForm) -> Option<CanonicalForm> {
        let argument = self.argument(argument);
        let mut rest = CanonicalForm::default();
        let mut product = CanonicalForm::one();
        for (monomial, coefficient) in &argument.terms {
            let log = match (monomial.powers.as_slice(), monomial.exponent.is_zero()) {
                ([(atom, 1)], true) => match &self.atoms[*atom as usize] {
                    Atom::Call(Function::Log, base) => Some(base.clone()),
                    _ => None,
                },
                _ => None,
            };
            let factor = match (log, coefficient.as_real()) {
                (Some(base), Some(exponent)) => self.positive_power(&base, exponent),
                _ => None,
            };
            match factor {
                Some(factor) => product = self.product(&product, &factor)?,
                None => rest.add(coefficient.clone(), monomial.clone()),
            }
        }
        let [exponential, _] = exponentials(&rest, false);
        self.product(&product, &exponential)
    }

    pub(super) fn abs(&mut self, form: &CanonicalForm) -> Option<CanonicalForm> {
        let form = self.argument(form.clone());
        if form.is_zero() {
            return Some(form);
        }
        if form.terms.len() > 1
            && let Some((exponent, rest)) = self.without_exponential(&form)
        {
            let [factor, _] = exponentials(&exponent, false);
            let magnitude = self.abs(&rest?)?;
            return self.product(&factor, &magnitude);
        }
        let (normed, scale, sign) = form.normed()?;
        if let Some(known) = self.known_sign(&normed) {
            return Some(form.scaled(&(&sign * &known)));
        }
        let Some((_, monomial)) = normed.as_term().filter(|(c, _)| c.is_one()) else {
            return Some(self.call(Function::Abs, normed).scaled(&scale));
        };
        let mut product = CanonicalForm::exponential(monomial.exponent.clone());
        for &(atom, power) in &monomial.powers {
            let base = match self.is_positive(atom) || power % 2 == 0 {
                true => CanonicalForm::atom(atom),
                false => self.magnitude_of(atom)?,
            };
            let factor = self.power(&base, power)?;
            product = self.product(&product, &factor)?;
        }
        Some(product.scaled(&scale))
    }

    pub(super) fn sign(&mut self, form: &CanonicalForm) -> Option<CanonicalForm> {
        let form = self.argument(form.clone());
        if form.is_zero() {
            return Some(form);
        }
        if form.terms.len() > 1
            && let Some((_, rest)) = self.without_exponential(&form)
        {
            return self.sign(&rest?);
        }
        let (normed, _, sign) = form.normed()?;
        if let Some(known) = self.known_sign(&normed) {
            return Some(CanonicalForm::constant(&sign * &known));
        }
        let powers = (normed.as_term())
            .filter(|(coefficient, _)| coefficient.is_one())
            .map(|(_, monomial)| monomial.powers.clone());
        let Some(powers) = powers.filter(|powers| self.have_signs(powers)) else {
            return Some(self.call(Function::Sign, normed).scaled(&sign));
        };
        let mut product = CanonicalForm::constant(sign);
        for (atom, power) in powers {
            if self.positive.contains(&atom) {
                continue;
            }
            if self.negative.contains(&atom) {
                let sign = if power % 2 == 0 { 1 } else { -1 };
                product = product.scaled(&Coefficient::integer(sign));
                continue;
            }
            let base = CanonicalForm::atom(atom);
            let (factor, power) = match self.atoms[atom as usize].clone() {
                Atom::Sum(sum) => (self.sign(&sum)?, power),
                Atom::Call(Function::Abs, inner) => (self.sign(&inner)?, 2),
                _ => (self.call(Function::Sign, base), power),
            };
            let factor = self.power(&factor, 2 - (power.abs() % 2))?;
            product = self.product(&product, &factor)?;
        }
        Some(product)
    }

    /// The sign of a sum that stands under a root or logarithm, up to a factor, divided by its leading coefficient.
    fn known_sign(&self, normed: &CanonicalForm) -> Option<Coefficient> {
        let sums = self.positive_sums.iter().filter_map(CanonicalForm::normed);
        let mut signs = sums.filter_map(|(sum, _, sign)| (sum == *normed).then_some(sign));
        signs.next()
    }

    /// Whether the sign of each factor can be determined independently of the others.
    fn have_signs(&self, powers: &[(u32, i32)]) -> bool {
        powers.iter().all(|(atom, _)| {
            let atom = &self.atoms[*atom as usize];
            matches!(
                atom,
                Atom::Symbol(_) | Atom::Sum(_) | Atom::Call(Function::Abs, _)
            )
        })
    }
}

pub(super) struct Split {
    pub(super) scale: Rational,
    pub(super) factors: Vec<(CanonicalForm, i32)>,
    pub(super) exponent: CanonicalForm,
}

const LARGEST_DIVISOR: u64 = 2_000;

/// A positive number as a product of primes to integer powers. The remainder after small divisors counts as a prime.
fn prime_powers(value: &Rational) -> Vec<(CanonicalForm, i32)> {
    let form = |prime: BigUint| CanonicalForm::constant(Rational::from(BigInt::from(prime)).into());
    let mut powers = Vec::new();
    for (part, sign) in [(value.numer(), 1), (value.denom(), -1)] {
        let mut rest = part.magnitude().clone();
        for divisor in (2..=LARGEST_DIVISOR).filter(|d| *d == 2 || d % 2 == 1) {
            if rest.to_u64().is_some_and(|rest| divisor * divisor > rest) {
                break;
            }
            let divisor = BigUint::from(divisor);
            let mut count = 0;
            while (&rest % &divisor).is_zero() {
                rest /= &divisor;
                count += sign;
            }
            if count != 0 {
                powers.push((form(divisor), count));
            }
        }
        if rest != BigUint::from(1_u8) {
            powers.push((form(rest), sign));
        }
    }
    powers
}
