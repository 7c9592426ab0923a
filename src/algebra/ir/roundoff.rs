//! How far single precision may be from the exact value: a bound that the interpreter computes.
//!
//! A [`Rounded`] stands for all states of a box at once. It holds the range of exact values, the
//! range of what single precision computes, and a bound on the difference. Each operator adds its
//! own rounding to what it inherits, with `u = 2^-24` for an operation rounded to nearest:
//!
//! `|fl(a' b') - a b| <= |a' - a| |b'| + |a| |b' - b| + u |a' b'|`, and alike for the others
//! (Higham, Accuracy and Stability of Numerical Algorithms, 2002, chapter 3).
//!
//! The bound also holds where compilers fuse a product with a sum, which rounds less often, and where a
//! processor replaces numbers below the least normal one by zero.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::interpret::Interpreter;
use super::program::{Program, Unary};
use super::range::Range;
use super::real::Real;

/// Largest relative error of one operation rounded to nearest in single precision.
const UNIT: f64 = 1.0 / (1u64 << 24) as f64;
/// Least normal number: what a processor that flushes to zero may lose.
pub(super) const TINY: f64 = f32::MIN_POSITIVE as f64;
/// Units by which the sine-and-cosine kernel or a library's sine may be off: two of the last place.
const SIN_COS_UNITS: f64 = 4.0;
/// Units by which another library function may be off: four of the last place.
const LIBRARY_UNITS: f64 = 8.0;
/// What an operation of this module itself may lose, in double precision.
const OWN: f64 = 1.0 / (1u64 << 50) as f64;

/// What single precision makes of a value, over all states of a box.
#[derive(Clone, Copy, Debug)]
pub struct Rounded {
    exact: Range,
    computed: Range,
    error: f64,
}

impl Rounded {
    /// An input that single precision represents, somewhere in a range.
    pub fn input(range: Range) -> Self {
        Self {
            exact: range,
            computed: range,
            error: 0.0,
        }
    }

    /// Bound on the difference between computed and exact value; `None` if there is none, because
    /// a divisor may vanish, a value may overflow, or a root or logarithm may leave its domain.
    pub fn bound(self) -> Option<f64> {
        self.error.is_finite().then_some(self.error * (1.0 + 1e-6))
    }

    const UNBOUNDED: Self = Self {
        exact: Range::new(f64::NEG_INFINITY, f64::INFINITY),
        computed: Range::new(f64::NEG_INFINITY, f64::INFINITY),
        error: f64::INFINITY,
    };

    /// The range of exact and that of computed values under a function.
    fn mapped(self, of: impl Fn(Range) -> Range) -> [Range; 2] {
        [of(self.exact), of(self.computed)]
    }

    /// The same with two operands.
    fn with(self, other: Self, of: fn(Range, Range) -> Range) -> [Range; 2] {
        [
            of(self.exact, other.exact),
            of(self.computed, other.computed),
        ]
    }

    /// A result that inherits an error and is then rounded to within `units`.
    fn result([exact, before]: [Range; 2], inherited: f64, units: f64) -> Self {
        let exact = exact.widened(OWN);
        let computed = before.widened(units * UNIT + OWN).flushed();
        let error = inherited + units * UNIT * before.magnitude() + TINY;
        let apart = (computed.high - exact.low).max(exact.high - computed.low);
        let all = [exact.low, exact.high, error, computed.low, computed.high];
        if all.iter().any(|x| !x.is_finite()) || computed.magnitude() > f64::from(f32::MAX) {
            return Self::UNBOUNDED;
        }
        Self {
            exact,
            computed,
            error: error.min(apart) * (1.0 + OWN),
        }
    }

    fn is_unbounded(self) -> bool {
        self.error.is_infinite()
    }

    fn hull(self) -> Range {
        self.exact.hull(self.computed)
    }

    fn sqrt(self) -> Self {
        if self.hull().low < 0.0 {
            return Self::UNBOUNDED;
        }
        let roots = self.exact.low.sqrt() + self.computed.low.sqrt();
        let inherited = (self.error / roots).min(self.error.sqrt());
        Self::result(self.mapped(|x| x.mapped(f64::sqrt)), inherited, 1.0)
    }

    fn sign(self) -> Self {
        let of = |range: Range| range.mapped(|x| f64::from(i8::from(x > 0.0) - i8::from(x < 0.0)));
        let [exact, computed] = self.mapped(of);
        Self {
            exact,
            computed,
            error: (computed.high - exact.low).max(exact.high - computed.low),
        }
    }

    fn tan(self) -> Self {
        let hull = self.hull();
        let branch = |x: f64| (x / std::f64::consts::PI + 0.5).floor();
        if branch(hull.low) != branch(hull.high) {
            return Self::UNBOUNDED;
        }
        let steepest = hull.mapped(f64::tan).magnitude();
        let inherited = self.error * (1.0 + steepest * steepest);
        self.library(f64::tan, inherited)
    }

    fn log(self) -> Self {
        let hull = self.hull();
        if hull.low <= 0.0 {
            return Self::UNBOUNDED;
        }
        self.library(f64::ln, self.error / hull.low)
    }

    /// An increasing function of the library.
    fn library(self, function: fn(f64) -> f64, inherited: f64) -> Self {
        let ranges = self.mapped(|x| x.mapped(function));
        Self::result(ranges, inherited, LIBRARY_UNITS)
    }
}

impl Add for Rounded {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let sums = self.with(other, Range::sum);
        Self::result(sums, self.error + other.error, 1.0)
    }
}

impl Sub for Rounded {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Rounded {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        if self.is_unbounded() || other.is_unbounded() {
            return Self::UNBOUNDED;
        }
        let inherited =
            self.error * other.computed.magnitude() + self.exact.magnitude() * other.error;
        Self::result(self.with(other, Range::product), inherited, 1.0)
    }
}

impl Div for Rounded {
    type Output = Self;

    /// `|a'/b' - a/b| <= (|a' - a| + |a/b| |b' - b|) / |b'|`
    fn div(self, other: Self) -> Self {
        if self.is_unbounded() || other.is_unbounded() || other.hull().has_zero() {
            return Self::UNBOUNDED;
        }
        let [above, below] = other.mapped(Range::reciprocal);
        let (exact, computed) = (self.exact.product(above), self.computed.product(below));
        let inherited = (self.error + exact.magnitude() * other.error) * below.magnitude();
        Self::result([exact, computed], inherited, 1.0)
    }
}

impl Neg for Rounded {
    type Output = Self;

    fn neg(self) -> Self {
        Self {
            exact: self.exact.negated(),
            computed: self.computed.negated(),
            error: self.error,
        }
    }
}

impl Real for Rounded {
    fn constant(value: f64) -> Self {
        let computed = f64::from(value as f32);
        if !computed.is_finite() {
            return Self::UNBOUNDED;
        }
        Self {
            exact: Range::point(value),
            computed: Range::point(computed).flushed(),
            error: (value - computed).abs() + if computed.abs() < TINY { TINY } else { 0.0 },
        }
    }

    fn square(self) -> Self {
        if self.is_unbounded() {
            return Self::UNBOUNDED;
        }
        let inherited = self.error * (self.exact.magnitude() + self.computed.magnitude());
        Self::result(self.mapped(Range::squared), inherited, 1.0)
    }

    fn unary(op: Unary, a: Self) -> Self {
        if a.is_unbounded() {
            return Self::UNBOUNDED;
        }
        match op {
            Unary::Neg => -a,
            Unary::Sqrt => a.sqrt(),
            Unary::Abs => Self {
                exact: a.exact.absolute(),
                computed: a.computed.absolute(),
                error: a.error,
            },
            Unary::Sign => a.sign(),
            Unary::Tan => a.tan(),
            // The slope of tanh is 1 - tanh^2.
            Unary::Tanh => {
                let least = a.hull().absolute().low.tanh();
                a.library(f64::tanh, a.error * (1.0 - least * least))
            }
            Unary::Exp => a.library(f64::exp, a.error * a.hull().high.exp()),
            Unary::Log => a.log(),
        }
    }

    /// As `exp(exponent log(self))`, whose errors are larger.
    fn power(self, exponent: Self) -> Self {
        Self::unary(Unary::Exp, exponent * Self::unary(Unary::Log, self))
    }

    /// Both values where the test may be zero in one arithmetic and not in the other.
    fn select(test: Self, zero: Self, other: Self) -> Self {
        if !test.hull().has_zero() {
            return other;
        }
        if [zero, other].iter().any(|value| value.is_unbounded()) {
            return Self::UNBOUNDED;
        }
        let (exact, computed) = (
            zero.exact.hull(other.exact),
            zero.computed.hull(other.computed),
        );
        let apart = (computed.high - exact.low).max(exact.high - computed.low);
        Self {
            exact,
            computed,
            error: match test.error > 0.0 {
                true => apart,
                false => zero.error.max(other.error),
            },
        }
    }

    fn sin_cos(self) -> (Self, Self) {
        if self.is_unbounded() {
            return (Self::UNBOUNDED, Self::UNBOUNDED);
        }
        let of = |function: fn(Range) -> Range| {
            Self::result(self.mapped(function), self.error, SIN_COS_UNITS)
        };
        (of(Range::sine), of(Range::cosine))
    }
}

/// The bound of each element of each output, over a range of each element of the inputs; `None` where
/// there is none, see [`Rounded::bound`].
///
/// # Panics
/// If the number or a length of the ranges differs from the program's input slots.
pub fn rounding_errors(program: &Program, ranges: &[Vec<Range>]) -> Vec<Vec<Option<f64>>> {
    let inputs = ranges.iter();
    let inputs = inputs.map(|slot| slot.iter().copied().map(Rounded::input).collect());
    let inputs: Vec<Vec<Rounded>> = inputs.collect();
    let outputs = Interpreter::new(program).results(&inputs);
    let bounds = outputs.into_iter();
    bounds
        .map(|slot| slot.into_iter().map(Rounded::bound).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::{Binary, ProgramBuilder};
    use super::*;

    /// y = (sin(3 x0) x1 - x0^2, tanh(x1) / (1 + x0^2), sqrt(x0^2 + x1^2)).
    fn program() -> Program {
        let mut builder = ProgramBuilder::new("test");
        let x = builder.input("x", 2);
        let (one, three) = (builder.constant(1.0), builder.constant(3.1));
        let argument = builder.binary(Binary::Mul, three, x[0]);
        let (sines, _) = builder.sin_cos(&[argument]);
        let square = builder.binary(Binary::Mul, x[0], x[0]);
        let product = builder.binary(Binary::Mul, sines[0], x[1]);
        let first = builder.binary(Binary::Sub, product, square);
        let below = builder.binary(Binary::Add, one, square);
        let above = builder.unary(Unary::Tanh, x[1]);
        let second = builder.binary(Binary::Div, above, below);
        let other = builder.binary(Binary::Mul, x[1], x[1]);
        let sum = builder.binary(Binary::Add, square, other);
        let third = builder.unary(Unary::Sqrt, sum);
        builder.output("y", &[first, second, third]);
        builder.finish().expect("valid program")
    }

    fn bounds(program: &Program, box_: Range) -> [Option<f64>; 3] {
        let bounds = rounding_errors(program, &[vec![box_; 2]]).remove(0);
        bounds.try_into().expect("three results")
    }

    #[test]
    fn single_precision_stays_within_the_bound_of_its_box_and_not_far_below() {
        let program = program();
        let (mut double, mut single) = (
            Interpreter::new(&program),
            Interpreter::<f32>::new(&program),
        );
        for magnitude in [0.1_f64, 1.0, 10.0] {
            let bounds = bounds(&program, Range::within(magnitude)).map(|b| b.expect("a bound"));
            let mut worst = [0.0_f64; 3];
            let mut state = 1u64;
            for _ in 0..20_000 {
                let x: [f32; 2] = std::array::from_fn(|_| {
                    state = state
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1);
                    (magnitude * ((state >> 11) as f64 / (1u64 << 52) as f64 - 1.0)) as f32
                });
                let (mut y, mut exact) = ([0.0_f32; 3], [0.0_f64; 3]);
                single.run(&[&x], &mut [&mut y]);
                double.run(&[&x.map(f64::from)], &mut [&mut exact]);
                for k in 0..3 {
                    worst[k] = worst[k].max((f64::from(y[k]) - exact[k]).abs());
                }
            }
            for k in 0..3 {
                assert!(worst[k] <= bounds[k], "{magnitude}: {worst:?} {bounds:?}");
            }
            assert!(worst[0] > 0.05 * bounds[0], "{worst:?} {bounds:?}");
        }
    }

    #[test]
    fn bound_is_absent_where_a_divisor_may_vanish_or_a_value_overflow() {
        let mut builder = ProgramBuilder::new("test");
        let x = builder.input("x", 1);
        let one = builder.constant(1.0);
        let quotient = builder.binary(Binary::Div, one, x[0]);
        let exponential = builder.unary(Unary::Exp, x[0]);
        let logarithm = builder.unary(Unary::Log, x[0]);
        builder.output("y", &[quotient, exponential, logarithm]);
        let program = builder.finish().expect("valid program");
        let at = |low: f64, high: f64| {
            let bounds = rounding_errors(&program, &[vec![Range { low, high }]]).remove(0);
            [0, 1, 2].map(|k: usize| bounds[k].is_some())
        };
        assert_eq!(at(-1.0, 1.0), [false, true, false]);
        assert_eq!(at(0.5, 100.0), [true, false, true]);
    }
}
