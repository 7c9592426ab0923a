//! Sine and cosine together, without branches; the arithmetic of the emitted kernels.
//!
//! The argument is reduced by the nearest multiple of pi/2, held as three parts
//! (Cody and Waite); two minimax polynomials give sine and cosine of the
//! remainder, and the low two bits of the multiple exchange and negate them.
//! The polynomials minimise the relative error over +-pi/4 and were found by a
//! Remez exchange with coefficients rounded one after the other; their error is
//! 2^-57.9 (sine) and 2^-63.9 (cosine), in single precision 2^-27.9 and 2^-33. Arguments beyond `LIMIT`, infinities and
//! NaN go to the standard library.
//!
//! C and Rust emit these very operations in this very order, from these constants. The parts of pi/2 (40, 40 and 53 bits;
//! in single precision 17, 17 and 24) are cut off rather than rounded: the first two times a multiple up to 2^13, 2^7 are
//! exact, and a positive tail keeps the sign of zero. Adding `ROUND`, 1.5 times 2^52 or 2^23, rounds to an integer, which
//! the low bits then hold. `SIN` is (r - sin r) / r^3 in powers of r^2, `COS` is (cos r - 1 + r^2/2) / r^4.

pub use double::{LIMIT, reduced_sin_cos, sin_cos};

/// A kernel for one kind of number: its constants, its polynomial in `t = r^2`, and the tail of the remainder, of which
/// `lost` is what rounding the remainder loses.
macro_rules! kernel {
    (
        $float:ident, limit: $limit:expr, round: $round:expr, to_sign: $to_sign:expr, pi_2: $pi_2:expr,
        n: $n:expr, sin: $sin:expr, cos: $cos:expr, polynomial: $polynomial:expr, tail: $tail:expr,
    ) => {
        /// Largest magnitude that the reduction takes, in rad.
        pub const LIMIT: $float = $limit;
        const TWO_OVER_PI: $float = std::$float::consts::FRAC_2_PI;
        const ROUND: $float = $round;
        const PI_2: [$float; 3] = $pi_2;
        const SIN: [$float; $n] = $sin;
        const COS: [$float; $n] = $cos;

        /// The limit, 2/pi and the number that rounds; parts of pi/2, coefficients of sine and of cosine.
        pub(crate) fn constants() -> [Vec<f64>; 4] {
            let lists: [&[$float]; 4] = [&[LIMIT, TWO_OVER_PI, ROUND], &PI_2, &SIN, &COS];
            lists.map(|list| list.iter().map(|&constant| f64::from(constant)).collect())
        }

        /// Sine and cosine of `x` rad. Beyond the limit, and for infinities and NaN, the standard library's functions.
        #[inline]
        pub fn sin_cos(x: $float) -> ($float, $float) {
            if x.abs() <= LIMIT {
                reduced_sin_cos(x)
            } else {
                (x.sin(), x.cos())
            }
        }

        /// Sine and cosine of `x` rad with `|x|` up to [`LIMIT`]; without a branch, so that loops over it vectorise.
        #[inline(always)]
        pub fn reduced_sin_cos(x: $float) -> ($float, $float) {
            let shifted = x * TWO_OVER_PI + ROUND;
            let quadrant = shifted.to_bits();
            let multiple = shifted - ROUND;
            let high = x - multiple * PI_2[0];
            let low = multiple * PI_2[1];
            let r = high - low;
            let tail = $tail(multiple * PI_2[2], (high - r) - low);
            let t = r * r;
            let t2 = t * t;
            let (p, q) = ($polynomial(SIN, t, t2), $polynomial(COS, t, t2));
            let half = 0.5 * t;
            let near = 1.0 - half;
            let sine = (r - ((r * t) * p + tail)).to_bits();
            let cosine = (near + (((1.0 - near) - half) + (t2 * q + r * tail))).to_bits();
            let exchange = (sine ^ cosine) & (quadrant & 1).wrapping_neg();
            (
                $float::from_bits((sine ^ exchange) ^ ((quadrant & 2) << $to_sign)),
                $float::from_bits(
                    (cosine ^ exchange) ^ ((quadrant.wrapping_add(1) & 2) << $to_sign),
                ),
            )
        }
    };
}

/// Within 1.6 ulp: the remainder is rounded to half its last place, which counts up to 0.87 of the sine's, the last sum
/// adds 0.5, the products before it 0.2.
pub(crate) mod double {
    kernel! {
        f64, limit: 8192.0, round: 6_755_399_441_055_744.0, to_sign: 62,
        pi_2: [1.570_796_326_794_152_3, 7.443547480480255e-13, 6.36831716351095e-25],
        n: 6,
        sin: [
            0.166_666_666_666_666_3, -0.008_333_333_333_321_84, 0.000_198_412_698_293_588_23,
            -2.755_731_353_885_304_7e-6, 2.505_073_450_137_862_6e-8, -1.589_544_451_671_563_3e-10,
        ],
        cos: [
            0.041_666_666_666_666_595, -0.001_388_888_888_887_334, 2.480_158_728_899_962_3e-5,
            -2.755_731_421_606_139e-7, 2.087_570_523_162_879e-9, -1.135_873_928_367_384_2e-11,
        ],
        polynomial: |c: [f64; 6], t: f64, t2: f64| {
            (c[0] + c[1] * t) + t2 * ((c[2] + c[3] * t) + t2 * (c[4] + c[5] * t))
        },
        tail: |tail: f64, _lost: f64| tail,
    }
}

/// Within 0.94 ulp over all numbers up to the limit. No operation is wider than 32 bits, so processors without double
/// precision lose nothing.
pub(crate) mod single {
    kernel! {
        f32, limit: 128.0, round: 12_582_912.0, to_sign: 30,
        pi_2: [1.570_785_5, 1.080_427_3e-5, 6.0771e-11],
        n: 3,
        sin: [0.166_666_55, -0.008_332_187, 0.000_195_178_97],
        cos: [0.041_666_646, -0.001_388_731, 2.443_232_7e-5],
        polynomial: |c: [f32; 3], t: f32, t2: f32| (c[0] + c[1] * t) + t2 * c[2],
        tail: |tail: f32, lost: f32| tail - lost,
    }
}
