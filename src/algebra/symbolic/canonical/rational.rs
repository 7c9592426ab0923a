//! Fractions of integers of any size.

use std::ops::{Add, Mul, Neg};

use num_bigint::{BigInt, Sign};
use num_integer::Integer;
use num_traits::ToPrimitive;

/// A fraction in lowest terms with a positive denominator.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Rational {
    numerator: BigInt,
    denominator: BigInt,
}

impl Rational {
    /// `numerator / denominator`, whose denominator is not zero.
    pub(super) fn new(numerator: impl Into<BigInt>, denominator: impl Into<BigInt>) -> Self {
        let (mut numerator, mut denominator) = (numerator.into(), denominator.into());
        debug_assert!(denominator.sign() != Sign::NoSign);
        let divisor = numerator.gcd(&denominator);
        if divisor != BigInt::from(1) {
            (numerator, denominator) = (numerator / &divisor, denominator / divisor);
        }
        if denominator.sign() == Sign::Minus {
            (numerator, denominator) = (-numerator, -denominator);
        }
        Self {
            numerator,
            denominator,
        }
    }

    pub(super) fn zero() -> Self {
        Self::from(BigInt::ZERO)
    }

    pub(super) fn numerator(&self) -> &BigInt {
        &self.numerator
    }

    pub(super) fn denominator(&self) -> &BigInt {
        &self.denominator
    }

    /// `1 / self`, which is not zero.
    pub(super) fn recip(&self) -> Self {
        Self::new(self.denominator.clone(), self.numerator.clone())
    }

    pub(super) fn abs(&self) -> Self {
        if self.is_negative() {
            -self.clone()
        } else {
            self.clone()
        }
    }

    /// The largest integer that is not above it.
    pub(super) fn floor(&self) -> BigInt {
        self.numerator.div_floor(&self.denominator)
    }

    pub(super) fn is_zero(&self) -> bool {
        self.numerator.sign() == Sign::NoSign
    }

    pub(super) fn is_one(&self) -> bool {
        self.numerator == self.denominator
    }

    pub(super) fn is_negative(&self) -> bool {
        self.numerator.sign() == Sign::Minus
    }

    pub(super) fn is_integer(&self) -> bool {
        self.denominator == BigInt::from(1)
    }

    /// The nearest float, or one beside it; infinite beyond the range of floats.
    pub(super) fn to_f64(&self) -> f64 {
        // Each part as 64 bits times a power of two, the powers in two steps for numbers near the ends of the range.
        let parts = [&self.numerator, &self.denominator].map(|part| {
            let excess = part.bits().saturating_sub(64);
            ((part >> excess).to_f64().unwrap_or(0.0), excess)
        });
        let [(numerator, above), (denominator, below)] = parts;
        let power = (above as i64 - below as i64).clamp(-4_000, 4_000) as i32;
        let half = 2_f64.powi(power / 2);
        numerator / denominator * half * 2_f64.powi(power - power / 2)
    }
}

impl From<BigInt> for Rational {
    fn from(numerator: BigInt) -> Self {
        Self {
            numerator,
            denominator: BigInt::from(1),
        }
    }
}

impl Neg for Rational {
    type Output = Rational;

    fn neg(self) -> Rational {
        Rational {
            numerator: -self.numerator,
            ..self
        }
    }
}

impl Add for &Rational {
    type Output = Rational;

    fn add(self, other: &Rational) -> Rational {
        let left = &self.numerator * &other.denominator;
        let right = &other.numerator * &self.denominator;
        Rational::new(left + right, &self.denominator * &other.denominator)
    }
}

impl Mul for &Rational {
    type Output = Rational;

    fn mul(self, other: &Rational) -> Rational {
        Rational::new(
            &self.numerator * &other.numerator,
            &self.denominator * &other.denominator,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic_is_exact_and_in_lowest_terms() {
        let third = Rational::new(-2, -6);
        assert_eq!(
            (third.numerator(), third.denominator()),
            (&1.into(), &3.into())
        );
        assert_eq!(&third + &Rational::new(1, 6), Rational::new(1, 2));
        assert_eq!(&third + &-third.clone(), Rational::zero());
        assert!((&third * &Rational::new(3, 1)).is_one());
        assert_eq!(Rational::new(-7, 2).floor(), BigInt::from(-4));
        assert_eq!(Rational::new(-7, 2).recip(), Rational::new(2, -7));
    }

    #[test]
    fn floats_of_large_parts_are_near() {
        let large = BigInt::from(10).pow(400);
        assert_eq!(
            Rational::new(large.clone() * 3, large.clone() * 4).to_f64(),
            0.75
        );
        assert_eq!(Rational::from(-large.clone()).to_f64(), f64::NEG_INFINITY);
        assert_eq!(Rational::new(1, large).to_f64(), 0.0);
        for exponent in [290, 305, 308] {
            let power = BigInt::from(10).pow(exponent);
            let value: f64 = format!("1e{exponent}").parse().expect("a number");
            let tiny: f64 = format!("1e-{exponent}").parse().expect("a number");
            let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
            assert!(near(Rational::from(power.clone()).to_f64(), value));
            assert!(near(Rational::new(1, power).to_f64(), tiny));
        }
    }
}
