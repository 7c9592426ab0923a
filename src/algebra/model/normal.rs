//! The normal distribution, for the activation gelu.
//!
//! With `x = |a|/sqrt(2)` and `t = 2/(2 + x)` the tail is `exp(-x^2) t q(2 t - 1) / 2`, where `q` is
//! the Chebyshev interpolation of `exp(x^2) erfc(x) / t`. Its error is below 1e-15 of the tail, and
//! it needs no branch, so that generated code computes the same.

/// Chebyshev coefficients of `q`: those of its interpolation at 22 nodes.
pub(crate) const TAIL: [f64; 22] = [
    0.577_033_738_616_469_7,
    0.355_436_921_270_498_5,
    0.065_095_158_828_786_53,
    0.003_671_142_395_836_639,
    -0.001_112_844_743_352_632_5,
    -0.000_160_758_299_153_780_8,
    3.278_031_574_173_137e-5,
    5.442_441_645_505_016e-6,
    -1.515_466_555_317_148e-6,
    -1.429_760_818_116_992_8e-7,
    8.234_608_827_419_559e-8,
    -1.296_284_685_226_087e-9,
    -4.154_721_631_038_787e-9,
    6.347_058_278_707_451e-10,
    1.432_082_272_628_723_2e-10,
    -6.160_390_194_238_038e-11,
    2.061_215_387_926_281e-12,
    3.571_498_198_656_854_2e-12,
    -8.586_782_010_887_115e-13,
    -6.139_287_883_339_875e-14,
    7.441_508_714_836_163e-14,
    -1.446_797_769_320_091_7e-14,
];

/// `1/sqrt(2 pi)`.
pub(crate) const DENSITY_AT_ZERO: f64 = 0.398_942_280_401_432_7;

/// Probability that a normal number is below `a`.
pub(crate) fn normal_cumulative(a: f64) -> f64 {
    let t = 2.0 / (2.0 + a.abs() * std::f64::consts::FRAC_1_SQRT_2);
    let w = 2.0 * t - 1.0;
    // Clenshaw's recurrence.
    let (mut next, mut last) = (0.0, 0.0);
    for coefficient in TAIL[1..].iter().rev() {
        (next, last) = (2.0 * w * next - last + coefficient, next);
    }
    let q = w * next - last + TAIL[0];
    let tail = 0.5 * t * q * (-0.5 * a * a).exp();
    match a > 0.0 {
        true => 1.0 - tail,
        false => tail,
    }
}

/// Density of the normal distribution at `a`.
pub(crate) fn normal_density(a: f64) -> f64 {
    DENSITY_AT_ZERO * (-0.5 * a * a).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cumulative_agrees_with_tabulated_values() {
        // scipy.stats.norm.cdf
        for (a, expected) in [
            (-8.0, 6.220960574271786e-16),
            (-3.0, 0.0013498980316300933),
            (-0.5, 0.3085375387259869),
            (0.0, 0.5),
            (1.0, 0.8413447460685429),
            (4.0, 0.9999683287581669),
        ] {
            let found = normal_cumulative(a);
            assert!(
                (found - expected).abs() < 4e-15 * expected,
                "{a}: {found:e}"
            );
        }
        assert_eq!(
            (normal_cumulative(-800.0), normal_cumulative(800.0)),
            (0.0, 1.0)
        );
    }
}
