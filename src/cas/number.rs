//! Numbers of the algebra: exact rationals, and floats where exactness ends. A learned coefficient is a float and keeps
//! its bits; an integer exponent or the `1/2` of a derivative is exact. A sum or product with a float is a float, and
//! so is a rational beyond the range of `i64`. A float of at most 15 digits represents the decimal fraction that is
//! written for it, so `0.1 + 0.2` is `0.3`. Only correctly rounded operations are folded (`+ - * /`, square roots,
//! integer powers as multiplication chains), so results are equal on every machine. An operation whose result would be
//! infinite, undefined or denormal is refused ([`None`]) and stays symbolic.

use super::*;

/// Largest magnitude below which every integer is a float: `2^53`.
const EXACT_INTEGER: f64 = 9_007_199_254_740_992.0;
/// Most digits of a decimal fraction that is treated as exact.
const MAX_DECIMALS: usize = 15;

/// A finite real constant: exact, or a float with its bits. Integral floats up to `2^53` are stored as exact integers,
/// and there is no negative zero: equal values of that range have one representation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Number(Repr);

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Repr {
    /// Numerator and denominator in lowest terms, the latter positive and neither `i64::MIN`.
    Rational(i64, i64),
    /// The bits of a finite float which is not an integer of magnitude up to `2^53`.
    Float(u64),
}

impl Number {
    pub const ZERO: Number = Number::integer(0);
    pub const ONE: Number = Number::integer(1);
    pub(crate) const MINUS_ONE: Number = Number::integer(-1);
    pub(crate) const HALF: Number = Number(Repr::Rational(1, 2));

    /// The exact integer `value` (`i64::MIN` becomes `-i64::MAX`, because the range is symmetric).
    pub(crate) const fn integer(value: i64) -> Number {
        let numerator = if value == i64::MIN { -i64::MAX } else { value };
        Number(Repr::Rational(numerator, 1))
    }

    /// `numerator / denominator` in lowest terms; `None` for a zero denominator.
    pub(crate) fn rational(numerator: i64, denominator: i64) -> Option<Number> {
        Number::from_ratio(i128::from(numerator), i128::from(denominator))
    }

    /// The number of a finite float; `None` for NaN and infinities.
    pub fn from_f64(value: f64) -> Option<Number> {
        if !value.is_finite() {
            None
        } else if value.fract() == 0.0 && value.abs() <= EXACT_INTEGER {
            Some(Number::integer(value as i64))
        } else {
            Some(Number(Repr::Float(value.to_bits())))
        }
    }

    /// Reduces a ratio; a ratio beyond the range becomes a float. `None` for a zero denominator, and if only rounding
    /// would make the float a whole number, because whole numbers are exact.
    fn from_ratio(numerator: i128, denominator: i128) -> Option<Number> {
        if denominator == 0 {
            return None;
        }
        let divisor = gcd(numerator, denominator) * denominator.signum();
        let (numerator, denominator) = (numerator / divisor, denominator / divisor);
        match (i64::try_from(numerator), i64::try_from(denominator)) {
            (Ok(n), Ok(d)) if n != i64::MIN => Some(Number(Repr::Rational(n, d))),
            _ => {
                let rounded = Number::from_f64(numerator as f64 / denominator as f64);
                rounded.filter(|rounded| !rounded.is_exact())
            }
        }
    }

    /// The nearest float for an exact integer, the quotient of numerator and denominator for an exact fraction.
    pub fn to_f64(self) -> f64 {
        match self.0 {
            Repr::Rational(numerator, denominator) => numerator as f64 / denominator as f64,
            Repr::Float(bits) => f64::from_bits(bits),
        }
    }

    /// Whether the value is known exactly (an integer or a fraction).
    pub fn is_exact(self) -> bool {
        matches!(self.0, Repr::Rational(..))
    }

    /// Whether this is the exact zero; no other number has that value.
    pub fn is_zero(self) -> bool {
        self == Number::ZERO
    }

    pub fn is_one(self) -> bool {
        self == Number::ONE
    }

    pub fn is_negative(self) -> bool {
        match self.0 {
            Repr::Rational(numerator, _) => numerator < 0,
            Repr::Float(bits) => f64::from_bits(bits) < 0.0,
        }
    }

    /// The exact fraction in lowest terms, `(numerator, denominator)`.
    pub fn as_rational(self) -> Option<(i64, i64)> {
        match self.0 {
            Repr::Rational(numerator, denominator) => Some((numerator, denominator)),
            Repr::Float(_) => None,
        }
    }

    fn fractions(self, other: Number) -> Option<[i128; 4]> {
        let ((a, b), (c, d)) = (self.as_rational()?, other.as_rational()?);
        Some([a, b, c, d].map(i128::from))
    }

    pub fn as_integer(self) -> Option<i64> {
        match self.as_rational() {
            Some((numerator, 1)) => Some(numerator),
            _ => None,
        }
    }

    pub(crate) fn is_even(self) -> bool {
        self.as_integer().is_some_and(|value| value % 2 == 0)
    }

    pub fn abs(self) -> Number {
        if self.is_negative() { -self } else { self }
    }

    /// `self + other`, exactly if both are exact and the result fits; `None` on overflow.
    pub fn checked_add(self, other: Number) -> Option<Number> {
        // |a d|, |c b| and b d stay below 2^126: their sum fits an i128.
        let sum = |[a, b, c, d]: [i128; 4]| Number::from_ratio(a * d + c * b, b * d);
        self.combined(other, sum, |a, b| Number::from_f64(a + b))
    }

    /// The decimal fraction that is written for a float, if it is short; an exact number itself.
    pub(super) fn decimal(self) -> Option<Number> {
        if self.is_exact() {
            return Some(self);
        }
        let text = format!("{:e}", self.to_f64());
        let (mantissa, exponent) = text.split_once('e')?;
        let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
        if whole.len() + fraction.len() > MAX_DECIMALS {
            return None;
        }
        let exponent = exponent.parse::<i32>().ok()? - fraction.len() as i32;
        let digits: i64 = format!("{whole}{fraction}").parse().ok()?;
        let power = 10_i64.checked_pow(exponent.unsigned_abs())?;
        let exact = match exponent {
            0.. => Number::integer(digits.checked_mul(power)?),
            _ => Number::rational(digits, power)?,
        };
        (exact.is_exact() && exact.to_f64() == self.to_f64()).then_some(exact)
    }

    /// An operation on exact numbers or decimals of floats, rounded once; on floats if a decimal or result is too long.
    fn combined(
        self,
        other: Number,
        exact: impl Fn([i128; 4]) -> Option<Number>,
        rounded: impl Fn(f64, f64) -> Option<Number>,
    ) -> Option<Number> {
        if let Some(parts) = self.fractions(other) {
            return exact(parts);
        }
        let of_decimals = || exact(self.decimal()?.fractions(other.decimal()?)?)?.rounded();
        of_decimals().or_else(|| rounded(self.to_f64(), other.to_f64()))
    }

    fn rounded(self) -> Option<Number> {
        let (numerator, denominator) = self.as_rational()?;
        let is_short = |part: i64| part.unsigned_abs() <= EXACT_INTEGER as u64;
        let is_rounded_once = is_short(numerator) && is_short(denominator);
        Number::from_f64(self.to_f64()).filter(|_| is_rounded_once)
    }

    /// `self * other`; `None` when a float result overflows or loses digits to underflow.
    pub fn checked_mul(self, other: Number) -> Option<Number> {
        if self.is_zero() || other.is_zero() {
            return Some(Number::ZERO);
        }
        let product = |[a, b, c, d]: [i128; 4]| Number::from_ratio(a * c, b * d);
        self.combined(other, product, |a, b| normal(a * b))
    }

    pub(crate) fn checked_div(self, other: Number) -> Option<Number> {
        if self.is_zero() && !other.is_zero() {
            return Some(Number::ZERO);
        }
        let quotient = |[a, b, c, d]: [i128; 4]| Number::from_ratio(a * d, b * c);
        self.combined(other, quotient, |a, b| normal(a / b))
    }

    /// `self ^ exponent` by multiplications (`0^0 = 1`); `None` for zero to a negative power, overflow and underflow.
    pub(crate) fn checked_powi(self, exponent: i64) -> Option<Number> {
        if self.abs().is_one() {
            return Some(if exponent % 2 == 0 { Number::ONE } else { self });
        }
        let product = |a: &Number, b: &Number| a.checked_mul(*b);
        let power = power(Number::ONE, self, exponent.unsigned_abs(), product)?;
        match exponent {
            0.. => Some(power),
            _ => Number::ONE.checked_div(power),
        }
    }

    /// The non-negative `root`-th root if it is exact, or correctly rounded (square root of a float); `None` otherwise.
    pub(crate) fn checked_root(self, root: u32) -> Option<Number> {
        if self.is_negative() || root == 0 {
            return None;
        }
        match self.as_rational() {
            Some((numerator, denominator)) => {
                let numerator = exact_root(numerator, root)?;
                Number::rational(numerator, exact_root(denominator, root)?)
            }
            None if root == 2 => normal(self.to_f64().sqrt()),
            None => None,
        }
    }
}

/// The sum, rounded once: cancelling large numbers keep small ones; `None` for fewer than three and overflow.
pub(super) fn exact_sum(numbers: &[Number]) -> Option<Number> {
    if numbers.len() < 3 || numbers.iter().all(|number| number.is_exact()) {
        return None;
    }
    let mut decimals = numbers.iter().map(|number| number.decimal());
    let sum = decimals.try_fold(Number::ZERO, |sum, next| {
        sum.checked_add(next?).filter(|sum| sum.is_exact())
    });
    sum.and_then(Number::rounded).or_else(|| {
        let floats: Vec<f64> = numbers.iter().map(|number| number.to_f64()).collect();
        Number::from_f64(sum_of_floats(&floats))
    })
}

/// The sum of floats, rounded once, keeping all parts (Shewchuk, Adaptive precision floating-point arithmetic, 1997).
pub fn sum_of_floats(values: &[f64]) -> f64 {
    let plain = values.iter().fold(0.0, |sum, value| sum + value);
    if values.len() < 3 || !plain.is_finite() {
        return plain;
    }
    // Parts without overlap, the smallest first.
    let mut parts: Vec<f64> = Vec::new();
    for &value in values {
        let mut sum = value;
        parts.retain_mut(|part| {
            let (large, small) = match sum.abs() < part.abs() {
                true => (*part, sum),
                false => (sum, *part),
            };
            sum = large + small;
            *part = small - (sum - large);
            *part != 0.0
        });
        parts.push(sum);
    }
    parts.iter().sum()
}

fn normal(value: f64) -> Option<Number> {
    Number::from_f64(value).filter(|_| value.is_normal())
}

/// `base ^ exponent` as a chain of squares and products, which may fail.
pub(super) fn power<T>(
    one: T,
    base: T,
    exponent: u64,
    mut product: impl FnMut(&T, &T) -> Option<T>,
) -> Option<T> {
    let (mut power, mut square, mut remaining) = (one, base, exponent);
    loop {
        if remaining % 2 == 1 {
            power = product(&power, &square)?;
        }
        remaining /= 2;
        if remaining == 0 {
            return Some(power);
        }
        square = product(&square, &square)?;
    }
}

/// Greatest common divisor. Arithmetic with 128 bits is slow, and the operands are nearly always short.
fn gcd(a: i128, b: i128) -> i128 {
    match (i64::try_from(a), i64::try_from(b)) {
        (Ok(a), Ok(b)) => a.unsigned_abs().gcd(&b.unsigned_abs()).into(),
        _ => a.gcd(&b),
    }
}

/// The integer whose `root`-th power is `value`, which is not negative.
fn exact_root(value: i64, root: u32) -> Option<i64> {
    let floor = value.nth_root(root);
    (floor.checked_pow(root) == Some(value)).then_some(floor)
}

impl std::ops::Neg for Number {
    type Output = Number;

    fn neg(self) -> Number {
        Number(match self.0 {
            Repr::Rational(numerator, denominator) => Repr::Rational(-numerator, denominator),
            Repr::Float(bits) => Repr::Float((-f64::from_bits(bits)).to_bits()),
        })
    }
}

impl PartialOrd for Number {
    fn partial_cmp(&self, other: &Number) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// By value; of an exact number and a float that is its nearest, the exact one comes first.
impl Ord for Number {
    fn cmp(&self, other: &Number) -> Ordering {
        let by_value = self.to_f64().total_cmp(&other.to_f64());
        by_value.then_with(|| match self.fractions(*other) {
            Some([a, b, c, d]) => (a * d).cmp(&(c * b)),
            None => other.is_exact().cmp(&self.is_exact()),
        })
    }
}

/// An integer, `numerator/denominator`, or the shortest decimal that reads back to the same bits.
impl fmt::Display for Number {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Repr::Rational(numerator, 1) => write!(formatter, "{numerator}"),
            Repr::Rational(numerator, denominator) => {
                write!(formatter, "{numerator}/{denominator}")
            }
            Repr::Float(bits) => write!(formatter, "{:?}", f64::from_bits(bits)),
        }
    }
}
