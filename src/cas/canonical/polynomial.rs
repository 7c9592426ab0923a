//! Sums of complex rational coefficients, known to a radius, times products of atoms and one exponential.

use std::ops::{Add, Mul, Sub};

use super::*;

pub(super) use num_rational::BigRational as Rational;

const MAX_TERMS: usize = 2_000;

/// A factor that is not decomposed.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum Atom {
    Symbol(SymbolId),
    /// A sum whose leading coefficient has size one and is not negative, to negative powers only.
    Sum(CanonicalForm),
    /// `form^(1/index)`, to powers below the index.
    Root(CanonicalForm, u32),
    /// A function that is no exponential and no root.
    Call(Function, CanonicalForm),
    /// An expression that is too large to decompose, or has no value.
    Opaque(ExprId),
}

/// `prod_k atom_k^power_k * exp(sum_j c_j monomial_j)`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Monomial {
    /// Atoms by their numbers, ascending, with powers that are not zero.
    pub(super) powers: Vec<(u32, i32)>,
    /// The exponential's argument, without radii.
    pub(super) exponent: CanonicalForm,
}

impl Monomial {
    pub(super) fn atom(atom: u32, power: i32) -> Self {
        Self {
            powers: vec![(atom, power)],
            exponent: CanonicalForm::default(),
        }
    }

    pub(super) fn is_one(&self) -> bool {
        self.powers.is_empty() && self.exponent.is_zero()
    }

    pub(super) fn power_of(&self, atom: u32) -> i32 {
        let found = self.powers.iter().find(|(known, _)| *known == atom);
        found.map_or(0, |(_, power)| *power)
    }

    pub(super) fn without(&self, atom: u32) -> Self {
        let mut rest = self.clone();
        rest.powers.retain(|(known, _)| *known != atom);
        rest
    }

    pub(super) fn times(&self, other: &Self) -> Self {
        let mut powers: BTreeMap<u32, i32> = self.powers.iter().copied().collect();
        for (atom, power) in &other.powers {
            let sum = powers.entry(*atom).or_insert(0);
            *sum = sum.saturating_add(*power);
        }
        powers.retain(|_, power| *power != 0);
        Self {
            powers: powers.into_iter().collect(),
            exponent: self.exponent.plus(&other.exponent),
        }
    }

    pub(super) fn reciprocal(&self) -> Self {
        let powers = self.powers.iter();
        let powers = powers.map(|(atom, power)| (*atom, power.saturating_neg()));
        Self {
            powers: powers.collect(),
            exponent: self.exponent.scaled(&Coefficient::integer(-1)),
        }
    }
}

/// A sum in normal form, made by [`CanonicalForms`](super::forms::CanonicalForms).
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CanonicalForm {
    pub(super) terms: BTreeMap<Monomial, Coefficient>,
}

impl CanonicalForm {
    pub(super) fn constant(coefficient: Coefficient) -> Self {
        Self::term(coefficient, Monomial::default())
    }

    pub(super) fn term(coefficient: Coefficient, monomial: Monomial) -> Self {
        let mut form = Self::default();
        form.add(coefficient, monomial);
        form
    }

    pub(super) fn one() -> Self {
        Self::monomial(Monomial::default())
    }

    pub(super) fn atom(atom: u32) -> Self {
        Self::monomial(Monomial::atom(atom, 1))
    }

    pub(super) fn monomial(monomial: Monomial) -> Self {
        Self::term(Coefficient::integer(1), monomial)
    }

    pub(super) fn exponential(exponent: CanonicalForm) -> Self {
        Self::monomial(Monomial {
            powers: Vec::new(),
            exponent,
        })
    }

    /// Adds a term. A coefficient of value zero is kept as long as it has a radius.
    pub(super) fn add(&mut self, coefficient: Coefficient, monomial: Monomial) {
        let sum = match self.terms.remove(&monomial) {
            Some(before) => &before + &coefficient,
            None => coefficient,
        };
        if !sum.is_zero() || sum.radius() > 0.0 {
            self.terms.insert(monomial, sum);
        }
    }

    /// Whether every coefficient has the value zero.
    pub fn is_zero(&self) -> bool {
        self.terms.values().all(Coefficient::is_zero)
    }

    /// Whether zero is among the sums that the form may represent, each coefficient considered separately.
    pub fn may_be_zero(&self) -> bool {
        self.terms.values().all(Coefficient::may_be_zero)
    }

    pub fn coefficients(&self) -> impl Iterator<Item = &Coefficient> {
        self.terms.values()
    }

    pub(super) fn as_constant(&self) -> Option<Coefficient> {
        match self.as_term() {
            None if self.terms.is_empty() => Some(Coefficient::integer(0)),
            Some((coefficient, monomial)) if monomial.is_one() => Some(coefficient.clone()),
            _ => None,
        }
    }

    pub(super) fn as_atom(&self) -> Option<u32> {
        let (coefficient, monomial) = self.as_term()?;
        match monomial.powers[..] {
            [(atom, 1)] if coefficient.is_one() && monomial.exponent.is_zero() => Some(atom),
            _ => None,
        }
    }

    pub(super) fn as_term(&self) -> Option<(&Coefficient, &Monomial)> {
        let (monomial, coefficient) = self.terms.first_key_value()?;
        (self.terms.len() == 1).then_some((coefficient, monomial))
    }

    /// The form divided by size and sign of its leading coefficient, and these; nothing for zero or infinite sizes.
    pub(super) fn normed(&self) -> Option<(Self, Coefficient, Coefficient)> {
        let leading = self.leading()?;
        let (size, sign) = (Coefficient::from(leading.size()), leading.sign());
        let factor = &size.reciprocal()? * &sign;
        Some((self.scaled(&factor), size, sign))
    }

    pub(super) fn exponents(&self) -> BTreeSet<&Monomial> {
        let monomials = self.terms.keys();
        monomials
            .flat_map(|monomial| monomial.exponent.terms.keys())
            .collect()
    }

    pub(super) fn leading(&self) -> Option<&Coefficient> {
        self.terms.values().next_back()
    }

    pub(super) fn has_radius(&self) -> bool {
        self.terms.values().any(|c| c.radius() > 0.0)
    }

    pub(super) fn exact(&self) -> Self {
        let terms = self.terms.iter().filter(|(_, c)| !c.is_zero());
        let terms = terms.map(|(monomial, c)| (monomial.clone(), c.exact()));
        Self {
            terms: terms.collect(),
        }
    }

    pub(super) fn scaled(&self, factor: &Coefficient) -> Self {
        let mut scaled = Self::default();
        for (monomial, coefficient) in &self.terms {
            scaled.add(coefficient * factor, monomial.clone());
        }
        scaled
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        let (mut sum, rest) = match self.terms.len() >= other.terms.len() {
            true => (self.clone(), other),
            false => (other.clone(), self),
        };
        for (monomial, coefficient) in &rest.terms {
            sum.add(coefficient.clone(), monomial.clone());
        }
        sum
    }

    pub(super) fn is_small(&self) -> bool {
        self.terms.len() <= MAX_TERMS
    }
}

impl Sub for &CanonicalForm {
    type Output = CanonicalForm;

    fn sub(self, other: Self) -> CanonicalForm {
        self.plus(&other.scaled(&Coefficient::integer(-1)))
    }
}

/// Widens a radius by more than the rounding errors of the operations on it.
const OUTWARD: f64 = 1.0 + 1e-12;

pub(super) fn ratio(numerator: impl Into<BigInt>, denominator: impl Into<BigInt>) -> Rational {
    Rational::new(numerator.into(), denominator.into())
}

/// The nearest float; infinite beyond the range of floats.
pub(super) fn nearest(value: &Rational) -> f64 {
    value.to_f64().unwrap_or(f64::NAN)
}

/// `re + i im`, known to `radius` in magnitude.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Coefficient {
    pub(super) re: Rational,
    pub(super) im: Rational,
    /// Bits of the [`radius`](Coefficient::radius), whose order is that of the numbers.
    radius: u64,
}

impl From<Rational> for Coefficient {
    fn from(value: Rational) -> Self {
        Self::complex(value, Rational::zero())
    }
}

/// A float is the shortest decimal that reads back to it.
impl From<Number> for Coefficient {
    fn from(number: Number) -> Self {
        let Some((top, bottom)) = number.as_rational() else {
            let decimal = Self::parse(&format!("{:?}", number.to_f64()), false);
            return decimal.unwrap_or_else(|| Self::integer(0));
        };
        ratio(top, bottom).into()
    }
}

impl Coefficient {
    /// Reads a decimal as written, such as `0.36` or `1.2e-3`; the radius of a rounded one is half a unit of its last
    /// digit. `None` for other texts and for exponents beyond 400.
    pub fn parse(text: &str, is_rounded: bool) -> Option<Self> {
        let (digits, exponent) = match text.split_once(['e', 'E']) {
            Some((digits, exponent)) => (digits, exponent.parse::<i32>().ok()?),
            None => (text, 0),
        };
        let (before, after) = digits.split_once('.').unwrap_or((digits, ""));
        let mantissa: BigInt = format!("{before}{after}").parse().ok()?;
        let last = exponent.checked_sub(i32::try_from(after.len()).ok()?)?;
        if !(-800..=400).contains(&last) {
            return None;
        }
        let unit = ratio(10, 1).pow(last);
        let radius = match is_rounded {
            true => 0.5 * nearest(&unit),
            false => 0.0,
        };
        Some(Self {
            re: Rational::from(mantissa) * unit,
            im: Rational::zero(),
            radius: radius.to_bits(),
        })
    }

    pub(super) fn integer(value: i64) -> Self {
        Rational::from(BigInt::from(value)).into()
    }

    fn complex(re: Rational, im: Rational) -> Self {
        Self { re, im, radius: 0 }
    }

    pub(super) fn imaginary(numerator: i64, denominator: i64) -> Self {
        let im = ratio(numerator, denominator);
        Self::complex(Rational::zero(), im)
    }

    /// Whether the value is zero; its radius may not be.
    pub fn is_zero(&self) -> bool {
        self.re.is_zero() && self.im.is_zero()
    }

    pub fn magnitude(&self) -> f64 {
        nearest(&self.re).hypot(nearest(&self.im))
    }

    /// The real part as the nearest float.
    pub fn to_f64(&self) -> f64 {
        nearest(&self.re)
    }

    /// Largest distance that rounded decimals allow.
    pub fn radius(&self) -> f64 {
        f64::from_bits(self.radius)
    }

    pub fn may_be_zero(&self) -> bool {
        let is_within = || self.magnitude() <= self.radius() * (1.0 + 1e-9);
        self.is_zero() || (self.radius > 0 && is_within())
    }

    pub(super) fn exact(&self) -> Self {
        Self::complex(self.re.clone(), self.im.clone())
    }

    pub(super) fn as_real(&self) -> Option<&Rational> {
        self.im.is_zero().then_some(&self.re)
    }

    pub fn is_integer(&self) -> bool {
        self.as_real().is_some_and(Rational::is_integer)
    }

    pub(super) fn is_one(&self) -> bool {
        self.im.is_zero() && self.re.is_one()
    }

    pub(super) fn is_negative(&self) -> bool {
        self.re.is_negative() || (self.re.is_zero() && self.im.is_negative())
    }

    pub(super) fn sign(&self) -> Self {
        Self::integer(if self.is_negative() { -1 } else { 1 })
    }

    /// `|re| + |im|`: a positive factor that scales with the value.
    pub(super) fn size(&self) -> Rational {
        self.re.abs() + self.im.abs()
    }

    /// The reciprocal; `None` for zero, or where zero is within the radius.
    pub(super) fn reciprocal(&self) -> Option<Self> {
        let square = &self.re * &self.re + &self.im * &self.im;
        let magnitude = self.magnitude();
        if square.is_zero() || self.radius() >= magnitude {
            return None;
        }
        let radius = match self.radius() {
            0.0 => 0.0,
            radius => radius / (magnitude * (magnitude - radius)) * OUTWARD,
        };
        Some(Self {
            re: &self.re / &square,
            im: -(&self.im / &square),
            radius: radius.to_bits(),
        })
    }
}

impl Sub for &Coefficient {
    type Output = Coefficient;

    fn sub(self, other: Self) -> Coefficient {
        self + &(other * &Coefficient::integer(-1))
    }
}

impl Add for &Coefficient {
    type Output = Coefficient;

    fn add(self, other: Self) -> Coefficient {
        let radius = match (self.radius(), other.radius()) {
            (0.0, radius) | (radius, 0.0) => radius,
            (a, b) => (a + b) * OUTWARD,
        };
        Coefficient {
            re: &self.re + &other.re,
            im: &self.im + &other.im,
            radius: radius.to_bits(),
        }
    }
}

impl Mul for &Coefficient {
    type Output = Coefficient;

    fn mul(self, other: Self) -> Coefficient {
        let radius = match (self.radius(), other.radius()) {
            (0.0, 0.0) => 0.0,
            (a, b) => (self.magnitude() * b + other.magnitude() * a + a * b) * OUTWARD,
        };
        let (re, im) = match (self.im.is_zero(), other.im.is_zero()) {
            (true, true) => (&self.re * &other.re, Rational::zero()),
            (true, false) => (&self.re * &other.re, &self.re * &other.im),
            (false, true) => (&self.re * &other.re, &self.im * &other.re),
            (false, false) => (
                &self.re * &other.re - &self.im * &other.im,
                &self.re * &other.im + &self.im * &other.re,
            ),
        };
        Coefficient {
            re,
            im,
            radius: radius.to_bits(),
        }
    }
}
