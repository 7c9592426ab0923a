//! Sine and cosine together, without branches; the arithmetic of the emitted kernels.
//!
//! The argument is reduced by the nearest multiple of pi/2, held as three parts
//! (Cody and Waite); two minimax polynomials give sine and cosine of the
//! remainder, and the low two bits of the multiple exchange and negate them.
//! The polynomials minimise the relative error over +-pi/4 and were found by a
//! Remez exchange with coefficients rounded one after the other; their error is
//! 2^-57.9 (sine) and 2^-63.9 (cosine). Arguments beyond [`LIMIT`], infinities and
//! NaN go to the standard library.
//!
//! C and Rust emit these very operations in this very order, from these constants.

/// Largest magnitude that the reduction takes, in rad.
pub const LIMIT: f64 = 8192.0;
/// 2/pi.
pub(crate) const TWO_OVER_PI: f64 = std::f64::consts::FRAC_2_PI;
/// 1.5 x 2^52: adding it rounds to an integer, which the low bits then hold.
pub(crate) const ROUND: f64 = 6_755_399_441_055_744.0;
/// pi/2 in parts of 40, 40 and 53 bits, each cut off rather than rounded: the first two times
/// a multiple up to 2^13 are exact, and a positive tail keeps the sign of zero.
pub(crate) const PI_2: [f64; 3] = [
    1.570_796_326_794_152_3,
    7.443547480480255e-13,
    6.36831716351095e-25,
];
/// (r - sin r) / r^3 in powers of r^2.
pub(crate) const SIN: [f64; 6] = [
    0.166_666_666_666_666_3,
    -0.008_333_333_333_321_84,
    0.000_198_412_698_293_588_23,
    -2.755_731_353_885_304_7e-6,
    2.505_073_450_137_862_6e-8,
    -1.589_544_451_671_563_3e-10,
];
/// (cos r - 1 + r^2/2) / r^4 in powers of r^2.
pub(crate) const COS: [f64; 6] = [
    0.041_666_666_666_666_595,
    -0.001_388_888_888_887_334,
    2.480_158_728_899_962_3e-5,
    -2.755_731_421_606_139e-7,
    2.087_570_523_162_879e-9,
    -1.135_873_928_367_384_2e-11,
];

/// Sine and cosine of `x` rad, each within 1.6 ulp for |x| up to [`LIMIT`]: the remainder is rounded to half its
/// last place, which counts up to 0.87 of the sine's, the last sum adds 0.5, the products before it 0.2.
///
/// Beyond the limit, and for infinities and NaN, the standard library's functions.
#[inline]
pub fn sin_cos(x: f64) -> (f64, f64) {
    if x.abs() <= LIMIT {
        reduced_sin_cos(x)
    } else {
        (x.sin(), x.cos())
    }
}

/// Sine and cosine of `x` rad with `|x|` up to [`LIMIT`]; without a branch, so that loops over it vectorise.
#[inline(always)]
pub fn reduced_sin_cos(x: f64) -> (f64, f64) {
    let shifted = x * TWO_OVER_PI + ROUND;
    let quadrant = shifted.to_bits();
    let multiple = shifted - ROUND;
    let r = (x - multiple * PI_2[0]) - multiple * PI_2[1];
    let tail = multiple * PI_2[2];
    let t = r * r;
    let t2 = t * t;
    let p = (SIN[0] + SIN[1] * t) + t2 * ((SIN[2] + SIN[3] * t) + t2 * (SIN[4] + SIN[5] * t));
    let q = (COS[0] + COS[1] * t) + t2 * ((COS[2] + COS[3] * t) + t2 * (COS[4] + COS[5] * t));
    let half = 0.5 * t;
    let near = 1.0 - half;
    let sine = (r - ((r * t) * p + tail)).to_bits();
    let cosine = (near + (((1.0 - near) - half) + (t2 * q + r * tail))).to_bits();
    let exchange = (sine ^ cosine) & 0u64.wrapping_sub(quadrant & 1);
    (
        f64::from_bits((sine ^ exchange) ^ ((quadrant & 2) << 62)),
        f64::from_bits((cosine ^ exchange) ^ ((quadrant.wrapping_add(1) & 2) << 62)),
    )
}
