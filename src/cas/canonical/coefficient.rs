//! Complex rational coefficients with a radius.

use num_bigint::BigInt;
pub(super) use num_rational::BigRational as Rational;
use num_traits::{One, Signed, ToPrimitive, Zero};

use crate::Number;

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
    /// Reads a decimal as it is written: digits with at most one point and an exponent, such as `0.36` or `1.2e-3`.
    /// Where it stands for a rounded number its radius is half a unit of its last digit.
    ///
    /// `None` for other texts and for exponents beyond 400.
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

    /// The magnitude of the value.
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

    /// Whether zero is among the numbers that it may stand for.
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

    /// Whether the value is an integer.
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

    /// `self - other`.
    pub fn minus(&self, other: &Self) -> Self {
        self.plus(&other.times(&Self::integer(-1)))
    }

    /// `self + other`.
    pub fn plus(&self, other: &Self) -> Self {
        let radius = match (self.radius(), other.radius()) {
            (0.0, radius) | (radius, 0.0) => radius,
            (a, b) => (a + b) * OUTWARD,
        };
        Self {
            re: &self.re + &other.re,
            im: &self.im + &other.im,
            radius: radius.to_bits(),
        }
    }

    /// `self * other`.
    pub fn times(&self, other: &Self) -> Self {
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
        Self {
            re,
            im,
            radius: radius.to_bits(),
        }
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
