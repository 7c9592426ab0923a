//! What the numbers say: a velocity is the derivative of its position in one unit, sign and frame only.

use nalgebra::DMatrix;

use super::super::map::Frame;
use super::physics::NamedUnit;
use crate::recording::check::quantile;
use crate::recording::preprocess::differences_within;
use crate::recording::segment::stretches;

const UNEXPLAINED: f64 = 0.5; // share of a derivative that a velocity leaves unexplained at most
const AS_GOOD: f64 = 1.1; // times the least residual below which a plainer explanation is preferred

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    pub unit: &'static str,
    pub sign: f64,
    pub frame: Frame,
    pub left: f64, // squared residual as a share of the derivative
}

/// Slopes without the samples at which time jumps.
pub(super) fn slopes(times_s: &[f64], rows: &DMatrix<f64>) -> DMatrix<f64> {
    let ranges = stretches(0..times_s.len(), |before, at| times_s[at] > times_s[before]);
    differences_within(&ranges, times_s, rows)
}

/// Unit, sign and axes in which velocities are these derivatives; of the `frames`, each with the velocities turned from
/// it, the first that fits nearly as well as the best. `None` if none does.
pub(super) fn scale(
    derivative: &DMatrix<f64>,
    frames: &[(Frame, DMatrix<f64>)],
    units: &[NamedUnit],
) -> Option<Scale> {
    let whole = derivative.norm_squared().max(1e-30);
    let best = |(frame, raw): &(Frame, DMatrix<f64>)| {
        let signed = units.iter().flat_map(|unit| [(*unit, 1.0), (*unit, -1.0)]);
        let scales = signed.map(|((unit, factor), sign)| Scale {
            unit,
            sign,
            frame: *frame,
            left: (derivative - raw * (sign * factor)).norm_squared() / whole,
        });
        let best = scales.min_by(|a, b| a.left.total_cmp(&b.left));
        best.filter(|scale| scale.left < UNEXPLAINED)
    };
    let found: Vec<Scale> = frames.iter().filter_map(best).collect();
    let least = (found.iter().map(|scale| scale.left)).fold(f64::INFINITY, f64::min);
    (found.into_iter()).find(|scale| scale.left <= AS_GOOD * least + 1e-12)
}

/// The largest value, the 99th percentile of absolute values, so that single spikes do not count.
pub(super) fn reach(values: impl Iterator<Item = f64>) -> f64 {
    quantile(values.map(f64::abs), 0.99)
}
