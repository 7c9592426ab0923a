//! Coefficients of a group as exact multiples of a unit.

use super::{Scaled, Summands};
use crate::symbolic::number::Number;

/// Largest numerator and denominator of a ratio of coefficients.
const MAX_NUMERATOR: f64 = 4096.0;
const MAX_DENOMINATOR: i32 = 64;

/// A unit, and the coefficients as multiples of it: small fractions if all are such.
pub(super) fn in_units(summands: &Summands) -> (Number, Scaled) {
    let unit = summands[0].0;
    let ratios: Option<Scaled> = (summands.iter())
        .map(|&(coefficient, expr)| Some((small_ratio(coefficient, unit)?, expr)))
        .collect();
    match ratios {
        Some(scaled) => (decimal(unit), scaled),
        None => {
            let exact = summands.iter().map(|&(c, expr)| (decimal(c), expr));
            (Number::ONE, exact.collect())
        }
    }
}

/// `a / b` as a fraction of small numbers, if it is one to a unit in the last place.
fn small_ratio(a: f64, b: f64) -> Option<Number> {
    let ratio = a / b;
    (1..=MAX_DENOMINATOR).find_map(|denominator| {
        let numerator = (ratio * f64::from(denominator)).round();
        let error = (numerator * b / f64::from(denominator) - a).abs();
        let fits =
            numerator != 0.0 && numerator.abs() <= MAX_NUMERATOR && error <= f64::EPSILON * a.abs();
        fits.then(|| Number::rational(numerator as i64, i64::from(denominator)))?
    })
}

/// The decimal fraction that is written for a float, if it is short; the float itself otherwise.
fn decimal(value: f64) -> Number {
    let number = Number::from_f64(value).expect("coefficients are finite");
    number.decimal().unwrap_or(number)
}

/// `number * unit`, rounded once if the unit is a short decimal fraction, else twice.
pub(super) fn in_f64(number: Number, unit: Number) -> f64 {
    match number.as_rational() {
        Some((numerator, denominator)) if !unit.is_exact() => {
            numerator as f64 * unit.to_f64() / denominator as f64
        }
        _ => number
            .checked_mul(unit)
            .map_or(f64::INFINITY, Number::to_f64),
    }
}
