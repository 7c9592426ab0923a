//! Intervals of reals with outward rounding: each result contains the exact results for all points of the operands.
//! Sums, products, quotients and square roots are widened by at most one unit in the last place. Elementary functions
//! are widened by a few units, more than the error of any current mathematical library.

use super::number::power;
use super::*;

/// Arguments beyond this are not reduced: sines of them are only known to lie in `[-1, 1]`.
const LARGEST_ANGLE: f64 = 1e9;

/// A closed interval `[lo, hi]`; bounds may be infinite. No points if empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    lo: f64,
    hi: f64,
}

impl Interval {
    /// All reals.
    pub(crate) const ENTIRE: Interval = Interval::between(f64::NEG_INFINITY, f64::INFINITY);
    /// No points: the value of an expression that is defined nowhere in its domain.
    pub const EMPTY: Interval = Interval::between(f64::INFINITY, f64::NEG_INFINITY);
    const NON_NEGATIVE: Interval = Interval::between(0.0, f64::INFINITY);

    /// The interval from `lo` to `hi`; empty if `lo > hi`, all reals if a bound is NaN.
    pub fn new(lo: f64, hi: f64) -> Interval {
        if lo.is_nan() || hi.is_nan() {
            Interval::ENTIRE
        } else if lo > hi {
            Interval::EMPTY
        } else {
            Interval::between(lo, hi)
        }
    }

    /// As [`new`](Interval::new), from bounds that are no NaN.
    const fn between(lo: f64, hi: f64) -> Interval {
        Interval { lo, hi }
    }

    /// The interval of one point.
    pub fn point(value: f64) -> Interval {
        Interval::new(value, value)
    }

    /// The lower bound; infinite for an empty interval.
    pub fn lo(self) -> f64 {
        self.lo
    }

    /// The upper bound; negative infinite for an empty interval.
    pub fn hi(self) -> f64 {
        self.hi
    }

    pub fn is_empty(self) -> bool {
        self.lo > self.hi
    }

    pub fn contains(self, value: f64) -> bool {
        self.lo <= value && value <= self.hi
    }

    /// The middle, in floating point.
    pub fn middle(self) -> f64 {
        0.5 * self.lo + 0.5 * self.hi
    }

    /// An upper bound of `hi - lo`; 0 for an empty interval.
    pub fn width(self) -> f64 {
        if self.is_empty() {
            0.0
        } else {
            sub_up(self.hi, self.lo)
        }
    }

    /// The largest magnitude of a point; 0 for an empty interval.
    pub fn magnitude(self) -> f64 {
        if self.is_empty() {
            0.0
        } else {
            self.lo.abs().max(self.hi.abs())
        }
    }

    /// The smallest interval that contains both.
    pub fn hull(self, other: Interval) -> Interval {
        Interval::between(self.lo.min(other.lo), self.hi.max(other.hi))
    }

    pub fn intersection(self, other: Interval) -> Interval {
        Interval::new(self.lo.max(other.lo), self.hi.min(other.hi))
    }

    pub(crate) fn recip(self) -> Interval {
        if self.is_empty() || (self.lo == 0.0 && self.hi == 0.0) {
            return Interval::EMPTY;
        }
        match (self.lo < 0.0, self.hi > 0.0) {
            (true, true) => Interval::ENTIRE,
            (false, _) if self.lo == 0.0 => Interval::between(recip_down(self.hi), f64::INFINITY),
            (false, _) => Interval::between(recip_down(self.hi), recip_up(self.lo)),
            (true, false) => -(-self).recip(),
        }
    }

    pub(crate) fn abs(self) -> Interval {
        if self.is_empty() || self.lo >= 0.0 {
            self
        } else if self.hi <= 0.0 {
            -self
        } else {
            Interval::between(0.0, self.magnitude())
        }
    }

    pub(crate) fn sign(self) -> Interval {
        if self.is_empty() {
            return self;
        }
        let [lo, hi] = [self.lo, self.hi].map(|end| Function::Sign.evaluate(end));
        Interval::between(lo, hi)
    }

    pub(crate) fn powi(self, exponent: i64) -> Interval {
        if self.is_empty() {
            return self;
        }
        if exponent < 0 {
            let positive = exponent.checked_neg().unwrap_or(i64::MAX);
            return self.powi(positive).recip();
        }
        let exponent = exponent.unsigned_abs();
        // Of an x that is not negative, rounded up or down.
        let above = |x: f64| power_by(x, exponent, mul_up);
        let below = |x: f64| power_by(x, exponent, |a, b| (-mul_up(-a, b)).max(0.0));
        let is_even = exponent.is_multiple_of(2);
        let base = if is_even { self.abs() } else { self };
        Interval::between(
            if base.lo < 0.0 {
                -above(-base.lo)
            } else {
                below(base.lo)
            },
            if base.hi < 0.0 {
                -below(-base.hi)
            } else {
                above(base.hi)
            },
        )
    }

    /// `x^exponent`, for all pairs of points for which that is real: exponents of a negative base are integers.
    pub(crate) fn pow(self, exponent: Interval) -> Interval {
        if self.is_empty() || exponent.is_empty() {
            return Interval::EMPTY;
        }
        let power = (self.intersection(Interval::NON_NEGATIVE)).pow_non_negative(exponent);
        if self.lo >= 0.0 || exponent.lo.ceil() > exponent.hi {
            return power;
        }
        let magnitude = self.abs().pow_non_negative(exponent);
        power.hull(magnitude).hull(-magnitude)
    }

    fn pow_non_negative(self, exponent: Interval) -> Interval {
        let mut power = (exponent * self.log()).exp();
        if self.contains(0.0) && exponent.hi > 0.0 {
            power = power.hull(Interval::point(0.0));
        }
        if self.contains(0.0) && exponent.contains(0.0) {
            power = power.hull(Interval::point(1.0));
        }
        power
    }

    pub(crate) fn sqrt(self) -> Interval {
        let inside = self.intersection(Interval::NON_NEGATIVE);
        if inside.is_empty() {
            return inside;
        }
        let (lo, hi) = (inside.lo.sqrt(), inside.hi.sqrt());
        let is_exact = [is_exact_root(lo, inside.lo), is_exact_root(hi, inside.hi)];
        Interval::between(
            if is_exact[0] {
                lo
            } else {
                lo.next_down().max(0.0)
            },
            if is_exact[1] { hi } else { hi.next_up() },
        )
    }

    pub(crate) fn exp(self) -> Interval {
        self.increasing(f64::exp)
            .intersection(Interval::NON_NEGATIVE)
    }

    pub(crate) fn log(self) -> Interval {
        let inside = self.intersection(Interval::NON_NEGATIVE);
        if inside.hi == 0.0 {
            return Interval::EMPTY;
        }
        inside.increasing(f64::ln)
    }

    /// The image under a function that increases between poles at `(k + 1/2) pi`: all reals if one may lie inside.
    pub(crate) fn branch(self, function: impl Fn(f64) -> f64) -> Interval {
        let is_large = self.magnitude() > LARGEST_ANGLE;
        match !self.is_empty() && (is_large || self.contains_angle(1.0, 0.5)) {
            true => Interval::ENTIRE,
            false => self.increasing(function),
        }
    }

    pub(super) fn increasing(self, function: impl Fn(f64) -> f64) -> Interval {
        if self.is_empty() {
            return self;
        }
        Interval::new(widen_down(function(self.lo)), widen_up(function(self.hi)))
    }

    /// The image under sine or cosine, whose maxima are at `(2k + offset) pi`.
    pub(super) fn oscillation(self, function: impl Fn(f64) -> f64, offset: f64) -> Interval {
        if self.is_empty() {
            return self;
        }
        if self.magnitude() > LARGEST_ANGLE {
            return Interval::between(-1.0, 1.0);
        }
        let (at_lo, at_hi) = (function(self.lo), function(self.hi));
        let lo = match self.contains_angle(2.0, offset + 1.0) {
            true => -1.0,
            false => widen_down(at_lo.min(at_hi)).max(-1.0),
        };
        let hi = match self.contains_angle(2.0, offset) {
            true => 1.0,
            false => widen_up(at_lo.max(at_hi)).min(1.0),
        };
        Interval::between(lo, hi)
    }

    /// Whether `(k period + offset) pi` may lie inside for an integer `k`.
    fn contains_angle(self, period: f64, offset: f64) -> bool {
        let turns = (self / PI - Interval::point(offset)) * Interval::point(1.0 / period);
        turns.lo.ceil() <= turns.hi
    }
}

const PI: Interval = Interval::between(std::f64::consts::PI, std::f64::consts::PI.next_up());

impl fmt::Display for Interval {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_empty() {
            formatter.write_str("[]")
        } else {
            write!(formatter, "[{:?}, {:?}]", self.lo, self.hi)
        }
    }
}

impl std::ops::Neg for Interval {
    type Output = Interval;

    fn neg(self) -> Interval {
        Interval::between(-self.hi, -self.lo)
    }
}

impl std::ops::Add for Interval {
    type Output = Interval;

    fn add(self, other: Interval) -> Interval {
        if self.is_empty() || other.is_empty() {
            return Interval::EMPTY;
        }
        Interval::between(-sub_up(-self.lo, other.lo), sub_up(self.hi, -other.hi))
    }
}

impl std::ops::Sub for Interval {
    type Output = Interval;

    fn sub(self, other: Interval) -> Interval {
        self + -other
    }
}

impl std::ops::Mul for Interval {
    type Output = Interval;

    fn mul(self, other: Interval) -> Interval {
        if self.is_empty() || other.is_empty() {
            return Interval::EMPTY;
        }
        let corners = [
            (self.lo, other.lo),
            (self.lo, other.hi),
            (self.hi, other.lo),
            (self.hi, other.hi),
        ];
        let lower = corners.map(|(a, b)| -mul_up(-a, b)).into_iter();
        let upper = corners.map(|(a, b)| mul_up(a, b)).into_iter();
        Interval::between(
            lower.fold(f64::INFINITY, f64::min),
            upper.fold(f64::NEG_INFINITY, f64::max),
        )
    }
}

impl std::ops::Div for Interval {
    type Output = Interval;

    // A quotient is a product with the reciprocal: one more rounding, still outward.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn div(self, other: Interval) -> Interval {
        self * other.recip()
    }
}

/// Steps by which the value of an elementary function is widened.
const FUNCTION_ULPS: usize = 4;

/// The float rounded to nearest, or the next if the exact result is above it, as one that overflows downward is.
fn up(nearest: f64, is_above: bool, operands: [f64; 2]) -> f64 {
    match nearest.is_finite() {
        true if is_above => nearest.next_up(),
        false if nearest < 0.0 && operands.iter().all(|x| x.is_finite()) => f64::MIN,
        _ => nearest,
    }
}

/// `a - b` rounded up; infinite for infinities of the same sign, of which nothing is known.
fn sub_up(a: f64, b: f64) -> f64 {
    let difference = a - b;
    if difference.is_nan() {
        return f64::INFINITY;
    }
    // The rounding error of a difference, exactly (Knuth's two-sum).
    let b_rounded = a - difference;
    let error = (a - (difference + b_rounded)) + (b_rounded - b);
    up(difference, error > 0.0 || error.is_nan(), [a, b])
}

/// `a * b` rounded up, with `0 * inf = 0` as bounds of intervals need it.
fn mul_up(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 {
        return 0.0;
    }
    // The error of a product is exact in one fused operation, except near underflow.
    let product = a * b;
    let is_above = product.abs() < 1e-290 || a.mul_add(b, -product) > 0.0;
    up(product, is_above, [a, b])
}

/// `1/x` of a positive `x`.
fn recip_up(x: f64) -> f64 {
    let quotient = 1.0 / x;
    match quotient.mul_add(x, -1.0) == 0.0 {
        true => quotient,
        false => quotient.next_up(),
    }
}

fn recip_down(x: f64) -> f64 {
    let quotient = 1.0 / x;
    if quotient.is_infinite() {
        f64::MAX
    } else if quotient.mul_add(x, -1.0) == 0.0 {
        quotient
    } else {
        quotient.next_down().max(0.0)
    }
}

/// A power by squaring; a bound if `product` is monotone and all factors are non-negative.
pub(super) fn power_by(x: f64, exponent: u64, product: impl Fn(f64, f64) -> f64) -> f64 {
    let power = power(1.0, x, exponent, |a, b| Some(product(*a, *b)));
    power.expect("no product fails")
}

fn is_exact_root(root: f64, square: f64) -> bool {
    root == f64::INFINITY
        || (square > 1e-290 && root.mul_add(root, -square) == 0.0)
        || square == 0.0
}

fn widen_down(value: f64) -> f64 {
    -widen_up(-value)
}

fn widen_up(value: f64) -> f64 {
    if value == f64::NEG_INFINITY {
        return f64::MIN;
    }
    (0..FUNCTION_ULPS).fold(value, |value, _| value.next_up())
}
