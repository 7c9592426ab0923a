//! Sine and cosine in single precision: the method of [`super::sin_cos`] with 24-bit constants.
//!
//! The polynomials minimise the relative error over +-pi/4 with coefficients rounded one after
//! the other; their error is 2^-27.9 (sine) and 2^-33 (cosine). The rounding of the remainder is
//! carried along in its tail. Over all numbers up to [`LIMIT`] the error is at most 0.94 ulp. No
//! operation is wider than 32 bits, so processors without double precision lose nothing.

/// Largest magnitude that the reduction takes, in rad.
pub(crate) const LIMIT: f32 = 128.0;
/// 2/pi.
pub(crate) const TWO_OVER_PI: f32 = std::f32::consts::FRAC_2_PI;
/// 1.5 x 2^23: adding it rounds to an integer, which the low bits then hold.
pub(crate) const ROUND: f32 = 12_582_912.0;
/// pi/2 in parts of 17, 17 and 24 bits, each cut off rather than rounded: the first two times a
/// multiple up to 2^7 are exact, and a positive tail keeps the sign of zero.
pub(crate) const PI_2: [f32; 3] = [1.570_785_5, 1.080_427_3e-5, 6.0771e-11];
/// (r - sin r) / r^3 in powers of r^2.
pub(crate) const SIN: [f32; 3] = [0.166_666_55, -0.008_332_187, 0.000_195_178_97];
/// (cos r - 1 + r^2/2) / r^4 in powers of r^2.
pub(crate) const COS: [f32; 3] = [0.041_666_646, -0.001_388_731, 2.443_232_7e-5];

/// Sine and cosine of `x` rad, each within 1 ulp for |x| up to [`LIMIT`].
///
/// Beyond the limit, and for infinities and NaN, the standard library's functions.
#[inline]
pub fn sin_cos(x: f32) -> (f32, f32) {
    if x.abs() <= LIMIT {
        reduced_sin_cos(x)
    } else {
        (x.sin(), x.cos())
    }
}

/// Sine and cosine of `x` rad with `|x|` up to [`LIMIT`], without a branch.
#[inline(always)]
pub(crate) fn reduced_sin_cos(x: f32) -> (f32, f32) {
    let shifted = x * TWO_OVER_PI + ROUND;
    let quadrant = shifted.to_bits();
    let multiple = shifted - ROUND;
    let high = x - multiple * PI_2[0];
    let low = multiple * PI_2[1];
    let r = high - low;
    let tail = multiple * PI_2[2] - ((high - r) - low);
    let t = r * r;
    let t2 = t * t;
    let p = (SIN[0] + SIN[1] * t) + t2 * SIN[2];
    let q = (COS[0] + COS[1] * t) + t2 * COS[2];
    let half = 0.5 * t;
    let near = 1.0 - half;
    let sine = (r - ((r * t) * p + tail)).to_bits();
    let cosine = (near + (((1.0 - near) - half) + (t2 * q + r * tail))).to_bits();
    let exchange = (sine ^ cosine) & 0u32.wrapping_sub(quadrant & 1);
    (
        f32::from_bits((sine ^ exchange) ^ ((quadrant & 2) << 30)),
        f32::from_bits((cosine ^ exchange) ^ ((quadrant.wrapping_add(1) & 2) << 30)),
    )
}
