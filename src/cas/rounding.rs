//! Floating-point operations with directed rounding, for the bounds of intervals.
//!
//! The processor rounds to nearest; the rounding error of a sum or product, found exactly, tells
//! whether the neighbour is needed. Rounding down is rounding up of the negative.

use super::number::power;

/// Steps by which the value of an elementary function is widened.
const FUNCTION_ULPS: usize = 4;

/// `a - b` rounded up; infinite for infinities of the same sign, of which nothing is known.
pub(super) fn sub_up(a: f64, b: f64) -> f64 {
    let difference = a - b;
    if difference.is_nan() {
        return f64::INFINITY;
    }
    if !difference.is_finite() {
        // A finite difference that overflows downward is still above the largest negative float.
        return if difference == f64::NEG_INFINITY && a.is_finite() && b.is_finite() {
            f64::MIN
        } else {
            difference
        };
    }
    // The rounding error of a difference, exactly (Knuth's two-sum).
    let b_rounded = a - difference;
    let error = (a - (difference + b_rounded)) + (b_rounded - b);
    if error > 0.0 || error.is_nan() {
        difference.next_up()
    } else {
        difference
    }
}

/// `a * b` rounded up, with `0 * inf = 0` as bounds of intervals need it.
pub(super) fn mul_up(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 {
        return 0.0;
    }
    let product = a * b;
    if !product.is_finite() {
        let overflowed = a.is_finite() && b.is_finite();
        return if product < 0.0 && overflowed {
            f64::MIN
        } else {
            product
        };
    }
    // The error of a product is exact in one fused operation, except near underflow.
    if product.abs() < 1e-290 || a.mul_add(b, -product) > 0.0 {
        product.next_up()
    } else {
        product
    }
}

/// `1/x` rounded up for a positive `x`.
pub(super) fn recip_up(x: f64) -> f64 {
    let quotient = 1.0 / x;
    if quotient.is_finite() && quotient * x == 1.0 && quotient.mul_add(x, -1.0) == 0.0 {
        quotient
    } else {
        quotient.next_up()
    }
}

/// `1/x` rounded down for a positive `x`.
pub(super) fn recip_down(x: f64) -> f64 {
    let quotient = 1.0 / x;
    if quotient.is_infinite() {
        f64::MAX
    } else if quotient.mul_add(x, -1.0) == 0.0 {
        quotient
    } else {
        quotient.next_down().max(0.0)
    }
}

/// `x^exponent` rounded up for `x >= 0`.
pub(super) fn power_up(x: f64, exponent: u64) -> f64 {
    power_by(x, exponent, mul_up)
}

/// `x^exponent` rounded down for `x >= 0`.
pub(super) fn power_down(x: f64, exponent: u64) -> f64 {
    power_by(x, exponent, |a, b| (-mul_up(-a, b)).max(0.0))
}

/// A power by squaring; a bound if `product` is monotone and all factors are non-negative.
pub(super) fn power_by(x: f64, exponent: u64, product: impl Fn(f64, f64) -> f64) -> f64 {
    let power = power(1.0, x, exponent, |a, b| Some(product(*a, *b)));
    power.expect("no product fails")
}

pub(super) fn is_exact_root(root: f64, square: f64) -> bool {
    root == f64::INFINITY
        || (square > 1e-290 && root.mul_add(root, -square) == 0.0)
        || square == 0.0
}

pub(super) fn widen_down(value: f64) -> f64 {
    -widen_up(-value)
}

pub(super) fn widen_up(value: f64) -> f64 {
    if value == f64::NEG_INFINITY {
        return f64::MIN;
    }
    (0..FUNCTION_ULPS).fold(value, |value, _| value.next_up())
}
