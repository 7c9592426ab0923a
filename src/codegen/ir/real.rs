//! The kinds of numbers on which a program can be run.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::program::Unary;
use super::{sin_cos, sin_cos_f32};

/// A number that programs compute with: `f64` or `f32`.
///
/// Each operator rounds once, as generated code does with contraction off.
pub trait Real:
    Copy
    + Debug
    + PartialEq
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// A constant of a program.
    fn constant(value: f64) -> Self;

    /// A function of one number.
    fn unary(op: Unary, a: Self) -> Self;

    /// `self ^ exponent`.
    fn power(self, exponent: Self) -> Self;

    /// Sine and cosine by the kernel of this precision.
    fn sin_cos(self) -> (Self, Self);
}

macro_rules! real {
    ($float:ident, $kernel:path) => {
        impl Real for $float {
            /// The nearest number; infinite beyond the largest.
            #[inline]
            fn constant(value: f64) -> Self {
                value as $float
            }

            #[inline]
            fn unary(op: Unary, a: $float) -> $float {
                match op {
                    Unary::Neg => -a,
                    Unary::Sqrt => a.sqrt(),
                    Unary::Abs => a.abs(),
                    Unary::Sign if a > 0.0 => 1.0,
                    Unary::Sign if a < 0.0 => -1.0,
                    // 0 of either zero, NaN of NaN.
                    Unary::Sign => a - a,
                    Unary::Tan => a.tan(),
                    Unary::Tanh => a.tanh(),
                    Unary::Exp => a.exp(),
                    Unary::Log => a.ln(),
                }
            }

            #[inline]
            fn power(self, exponent: $float) -> $float {
                self.powf(exponent)
            }

            #[inline]
            fn sin_cos(self) -> ($float, $float) {
                $kernel(self)
            }
        }
    };
}

real!(f64, sin_cos::sin_cos);
real!(f32, sin_cos_f32::sin_cos);
