//! Samples divided into segments.

use std::ops::Range;

use super::columns::Column;
use super::error::{RecordingError, RecordingFault};
use super::preprocess::differences;
use super::segment::Segment;
use crate::robot::STATE_DIM;

pub(super) const DERIVED_DDX: &str = "accelerations are differences of velocities";
/// A step this many times the one before it starts a new segment, as a jump back does: samples were left out between
/// the two.
const GAP_STEPS: f64 = 20.0;
/// A first time beyond this is that of a clock that counts from an epoch: times count from it then.
pub(super) const EPOCH_S: f64 = 1e7;
/// Largest mean distance between samples: a jump lasts less than a second.
const LARGEST_STEP_S: f64 = 0.1;

/// The segments of all samples of a file, which get differences for accelerations that they do not have.
pub(super) fn divided(
    mut whole: Segment,
    has_acceleration: bool,
) -> Result<Vec<Segment>, RecordingError> {
    let start_s = whole.time_s.first().copied().unwrap_or_default();
    if start_s.abs() > EPOCH_S {
        whole.time_s.iter_mut().for_each(|time| *time -= start_s);
    }
    let ranges = ranges(&whole.time_s)
        .map_err(|(at, fault)| fault.in_cell(&whole.path, whole.row(at), "Time"))?;
    let mut segments = match &ranges[..] {
        [_] => vec![whole],
        _ => ranges.into_iter().map(|range| whole.slice(range)).collect(),
    };
    for segment in &mut segments {
        let (n, step_s) = (segment.len(), segment.mean_step_s());
        let row = segment.first_row;
        if n < 2 {
            return Err(RecordingFault::too_short(n, 2).at(&segment.path, row));
        }
        if step_s > LARGEST_STEP_S {
            let found = format!("a sample every {step_s} s on average");
            let expected = format!("at most {LARGEST_STEP_S} s; is `Time` in milliseconds?");
            let fault = RecordingFault::unexpected(found, expected);
            return Err(fault.in_cell(&segment.path, row, "Time"));
        }
        if !has_acceleration {
            segment.ddx = differences(&segment.time_s, &segment.dx);
        }
        // Differences of huge velocities over tiny steps can overflow.
        if let Some(place) = segment.ddx.iter().position(|value| !value.is_finite()) {
            let found = format!("{} from differences", segment.ddx[place]);
            let column = Column::Acceleration(place % STATE_DIM).name();
            let fault = RecordingFault::number(&found, "a finite number");
            return Err(fault.in_cell(&segment.path, row + place / STATE_DIM, &column));
        }
    }
    Ok(segments)
}

/// Stretches of increasing time without gaps. A new one begins where time jumps back by more than a step or to where
/// the stretch began, or far ahead. An error has the sample at which time stands still, or steps back by less.
pub(super) fn ranges(times_s: &[f64]) -> Result<Vec<Range<usize>>, (usize, RecordingFault)> {
    let mut ranges = Vec::new();
    let mut start = 0;
    for at in 1..times_s.len() {
        let before = match &times_s[start..at] {
            [.., a, b] => b - a,
            _ => f64::INFINITY,
        };
        let (found, previous) = (times_s[at], times_s[at - 1]);
        let step = found - previous;
        let is_new = match step > 0.0 {
            true => step > GAP_STEPS * before,
            false if step < 0.0 && (found <= times_s[start] || -step > 1.5 * before) => true,
            false => return Err((at, RecordingFault::time(found, previous))),
        };
        if is_new {
            ranges.push(start..at);
            start = at;
        }
    }
    ranges.push(start..times_s.len());
    Ok(ranges)
}
