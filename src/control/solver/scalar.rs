//! The numbers that the solver computes with.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// `f64` or `f32`: the operations that the solver requires of a number, all available in `core`.
pub trait Real:
    Copy
    + Debug
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + Send
    + 'static
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;

    /// The nearest number of this type.
    fn of(value: f64) -> Self;

    /// The same in double precision.
    fn wide(self) -> f64;

    /// Its magnitude.
    #[inline(always)]
    fn magnitude(self) -> Self {
        if self < Self::ZERO { -self } else { self }
    }

    /// The larger of two; not a number if the other is not.
    #[inline(always)]
    fn or_larger(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    /// The larger of two; not a number if either is not.
    #[inline(always)]
    fn or_kept_larger(self, other: Self) -> Self {
        if self <= other { other } else { self }
    }

    /// Whether it is neither infinite nor not a number.
    #[inline(always)]
    fn is_finite_number(self) -> bool {
        // Infinity less itself is not a number, and no such number equals itself.
        #[allow(clippy::eq_op)]
        let difference = self - self;
        difference == Self::ZERO
    }
}

macro_rules! real {
    ($($number:ty),*) => {$(
        impl Real for $number {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;

            #[inline(always)]
            fn of(value: f64) -> Self {
                value as $number
            }

            #[inline(always)]
            fn wide(self) -> f64 {
                self.into()
            }
        }
    )*};
}

real!(f64, f32);
