//! What the numbers say: a velocity is the derivative of its position in one unit, sign and frame only.

use nalgebra::DMatrix;

use super::super::map::Frame;
use crate::recording::check::quantile;
use crate::recording::preprocess::differences_within;
use crate::recording::segment::stretches;

/// Share of a derivative that a velocity must leave unexplained at most to be evidence.
const UNEXPLAINED: f64 = 0.5;
/// Times the least residual below which a plainer explanation is preferred.
const AS_GOOD: f64 = 1.1;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    pub unit: &'static str,
    pub sign: f64,
}

/// Slopes without the samples at which time jumps.
pub(super) fn slopes(times_s: &[f64], rows: &DMatrix<f64>) -> DMatrix<f64> {
    let ranges = stretches(0..times_s.len(), |before, at| times_s[at] > times_s[before]);
    differences_within(&ranges, times_s, rows)
}

/// The unit and sign in which velocities are the derivatives best, and the squared residual as a share of the
/// derivative; `None` if in none of `units`.
pub(super) fn scale(
    derivative: &DMatrix<f64>,
    raw: &DMatrix<f64>,
    units: &[(&'static str, f64)],
) -> Option<(Scale, f64)> {
    let signs = [1.0, -1.0];
    let candidates = units.iter().flat_map(|(unit, factor)| {
        signs.map(|sign| {
            let left = (derivative - raw * (sign * factor)).norm_squared();
            let left = left / derivative.norm_squared().max(1e-30);
            (Scale { unit, sign }, left)
        })
    });
    let best = candidates.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (best.1 < UNEXPLAINED).then_some(best)
}

/// Unit and axes of a velocity whose position or angles have these rates: of `frames`, the first that fits nearly as
/// well as the best. `turned` gives the velocity, if it is in a frame, in the axes of the rates.
pub(super) fn axes(
    frames: &[Frame],
    turned: impl Fn(Frame) -> Option<DMatrix<f64>>,
    rates: &DMatrix<f64>,
    units: &[(&'static str, f64)],
) -> Option<(Scale, Frame)> {
    let explained = |frame: &Frame| {
        let (scale, left) = scale(rates, &turned(*frame)?, units)?;
        Some((*frame, scale, left))
    };
    let found: Vec<(Frame, Scale, f64)> = frames.iter().filter_map(explained).collect();
    let least = found.iter().map(|choice| choice.2);
    let least = least.fold(f64::INFINITY, f64::min);
    let is_as_good = |choice: &(Frame, Scale, f64)| choice.2 <= AS_GOOD * least + 1e-12;
    let (frame, scale, _) = found.into_iter().find(is_as_good)?;
    Some((scale, frame))
}

/// The largest value, the 99th percentile of absolute values, so that single spikes do not count.
pub(super) fn reach(values: impl Iterator<Item = f64>) -> f64 {
    quantile(values.map(f64::abs), 0.99)
}
