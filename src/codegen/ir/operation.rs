//! Operations on scalars: their names, and their values in either precision.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::interpret::{double, single};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Unary {
    Neg,
    /// Square root, correctly rounded.
    Sqrt,
    Abs,
    /// `1`, `-1` or `0` as `a` is positive, negative or zero; NaN of NaN.
    Sign,
    /// Tangent; this and those below by the target's library.
    Tan,
    Tanh,
    Exp,
    /// Natural logarithm.
    Log,
}

/// Usual names of the functions in programming languages, in the order of [`Unary`].
pub(crate) const FUNCTIONS: [&str; 8] = ["neg", "sqrt", "abs", "sign", "tan", "tanh", "exp", "log"];

impl Unary {
    const ALL: [Self; FUNCTIONS.len()] = {
        use Unary::*;
        [Neg, Sqrt, Abs, Sign, Tan, Tanh, Exp, Log]
    };

    pub(crate) fn name(self) -> &'static str {
        FUNCTIONS[self as usize]
    }

    /// None for sines and cosines, which are computed together.
    pub(crate) fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|op| op.name() == name)
    }

    /// Whether a mathematics library computes it, which is many times slower than a product.
    pub(crate) fn is_by_library(self) -> bool {
        self >= Self::Tan
    }
}

/// Operations on two scalars, each rounded once except powers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    /// `a ^ b` of the target's library, for exponents that are no integers.
    Pow,
}

/// Adds the first, third and so on of the terms to `start`, the second, fourth and so on to one another, and both sums.
/// `None` is skipped but keeps its turn.
pub(crate) fn alternating<S>(
    start: Option<S>,
    terms: impl Iterator<Item = Option<S>>,
    add: impl Fn(S, S) -> S,
) -> Option<S> {
    let add = |a: Option<S>, b: Option<S>| match (a, b) {
        (Some(a), Some(b)) => Some(add(a, b)),
        (a, b) => a.or(b),
    };
    let (even, odd) = terms.fold((start, None), |(next, last), term| (last, add(next, term)));
    add(even, odd)
}

/// `f64` or `f32`; each operator rounds once, as generated code does with contraction off.
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
    fn constant(value: f64) -> Self;

    fn unary(op: Unary, a: Self) -> Self;

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

real!(f64, double::sin_cos);
real!(f32, single::sin_cos);
