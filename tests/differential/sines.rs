//! The kernel of sines and cosines against the standard library.

use crate::ir::{Interpreter, LIMIT, ProgramBuilder, sin_cos};

/// Largest magnitude that the single-precision kernel reduces itself, in rad.
const LIMIT_F32: f32 = 128.0;

/// Sine and cosine by the interpreter in single precision.
fn single() -> impl FnMut(f32) -> [f32; 2] {
    let mut builder = ProgramBuilder::new("angle");
    let x = builder.input("x", 1);
    let (sines, cosines) = builder.sin_cos(&x);
    builder.output("y", &[sines[0], cosines[0]]);
    let program = builder.finish().expect("a valid program");
    let mut interpreter = Interpreter::<f32>::new(&program);
    move |x| {
        let mut y = [0.0; 2];
        interpreter.run(&[&[x]], &mut [&mut y]);
        y
    }
}

/// Distance in units of the last place of `reference`, which the library gives within 0.6.
fn ulps(found: f64, reference: f64) -> f64 {
    let next = f64::from_bits(reference.abs().to_bits() + 1);
    ((found - reference) / (next - reference.abs())).abs()
}

fn assert_near_the_library(x: f64) {
    let (sine, cosine) = sin_cos(x);
    assert!(ulps(sine, x.sin()) <= 1.0, "sin({x}): {sine}");
    assert!(ulps(cosine, x.cos()) <= 1.0, "cos({x}): {cosine}");
}

/// Within 0.94 units of the last place of the exact values.
fn assert_near_double_precision(x: f32, found: [f32; 2]) {
    let x = f64::from(x);
    for (found, exact) in found.into_iter().zip([x.sin(), x.cos()]) {
        let nearest = (exact as f32).abs();
        let unit = f64::from(f32::from_bits(nearest.to_bits() + 1) - nearest);
        let error = (f64::from(found) - exact).abs() / unit;
        assert!(error <= 0.94, "{x}: {found} {exact}");
    }
}

#[test]
fn kernel_is_within_two_ulp_of_the_library_everywhere() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    for k in 0..400_000 {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let unit = (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0;
        assert_near_the_library(unit * [0.1, 1.0, 4.0, 100.0, LIMIT][k % 5]);
    }
}

#[test]
fn single_precision_kernel_is_within_its_stated_error_of_double_precision() {
    let mut sin_cos = single();
    // Every 1021st number up to the limit: all binary orders, about a million numbers.
    for bits in (0..=LIMIT_F32.to_bits()).step_by(1021) {
        let x = f32::from_bits(bits);
        assert_near_double_precision(x, sin_cos(x));
    }
}

#[test]
fn kernels_next_to_multiples_of_half_pi_keep_relative_accuracy() {
    for multiple in 1..5000 {
        assert_near_the_library(f64::from(multiple) * std::f64::consts::FRAC_PI_2);
    }
    let mut sin_cos = single();
    for multiple in 1..=81 {
        let nearest = (f64::from(multiple) * std::f64::consts::FRAC_PI_2) as f32;
        for bits in nearest.to_bits() - 8..=nearest.to_bits() + 8 {
            let x = f32::from_bits(bits);
            assert_near_double_precision(x, sin_cos(x));
        }
    }
}

#[test]
fn kernels_keep_signed_zero_and_fall_back_beyond_their_limits() {
    assert_eq!(sin_cos(-0.0).0.to_bits(), (-0.0f64).to_bits());
    assert_eq!(sin_cos(0.0), (0.0, 1.0));
    for x in [LIMIT * 1.5, -1e9, 1e300] {
        assert_eq!(sin_cos(x), (x.sin(), x.cos()));
    }
    assert!(sin_cos(f64::NAN).0.is_nan() && sin_cos(f64::INFINITY).1.is_nan());
    let mut sin_cos = single();
    assert_eq!(sin_cos(-0.0)[0].to_bits(), (-0.0f32).to_bits());
    assert_eq!(sin_cos(0.0), [0.0, 1.0]);
    for x in [LIMIT_F32 * 1.5, -1e9, 1e30] {
        assert_eq!(sin_cos(x), [x.sin(), x.cos()]);
    }
    assert!(sin_cos(f32::NAN)[0].is_nan() && sin_cos(f32::INFINITY)[1].is_nan());
}
