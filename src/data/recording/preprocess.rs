//! From segments to phases ready for training: accelerations by differences, resampling of each phase to whole batches
//! (section IV-C4).
//!
//! Nothing crosses the border of a segment. Scaling belongs to the model.

use std::ops::Range;

use nalgebra::DMatrix;

use super::error::{RecordingError, RecordingFault};
use super::phases::{PhaseRule, PhaseSpan};
use super::segment::{Recording, Segment};

/// Samples of a batch: every phase of a jump is resampled to a multiple (section IV-C4).
pub const BATCH_ROWS: usize = 100;

/// The phases of every segment of a recording, each with its samples resampled to a multiple of 100.
///
/// # Errors
/// [`RecordingFault::Unexpected`] for a span of one sample, [`RecordingFault::NoPhase`].
pub fn prepare(
    recording: &Recording,
    rule: &PhaseRule,
) -> Result<Vec<(PhaseSpan, Segment)>, RecordingError> {
    let mut out = Vec::new();
    for segment in &recording.segments {
        for span in rule.spans(segment)? {
            let part = segment.slice(span.range.clone());
            let rows = part.len().div_ceil(BATCH_ROWS).max(1) * BATCH_ROWS;
            out.push((span, resampled(&part, rows)?));
        }
    }
    Ok(out)
}

/// Slopes of each row over time: second-order differences inside, also for unequal steps, first-order at the two ends
/// (equation 21).
///
/// `rows` has one column a time; a single sample has slope 0.
pub fn differences(time_s: &[f64], rows: &DMatrix<f64>) -> DMatrix<f64> {
    let n = time_s.len().min(rows.ncols());
    let mut out = DMatrix::zeros(rows.nrows(), rows.ncols());
    if n < 2 {
        return out;
    }
    for row in 0..rows.nrows() {
        let slope =
            |a: usize, b: usize| (rows[(row, b)] - rows[(row, a)]) / (time_s[b] - time_s[a]);
        out[(row, 0)] = slope(0, 1);
        out[(row, n - 1)] = slope(n - 2, n - 1);
        for j in 1..n - 1 {
            // The parabola through three samples, at the middle one.
            let (before, after) = (time_s[j] - time_s[j - 1], time_s[j + 1] - time_s[j]);
            let share = before / (before + after);
            let (left, right) = (slope(j - 1, j), slope(j, j + 1));
            out[(row, j)] = left + share * (right - left);
        }
    }
    out
}

/// [`differences`] within each of the ranges alone; 0 outside them.
pub(super) fn differences_within(
    ranges: &[Range<usize>],
    time_s: &[f64],
    rows: &DMatrix<f64>,
) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(rows.nrows(), rows.ncols());
    for range in ranges {
        let own = rows.columns(range.start, range.len()).into_owned();
        let slopes = differences(&time_s[range.clone()], &own);
        (out.columns_mut(range.start, range.len())).copy_from(&slopes);
    }
    out
}

/// A segment at `rows` equally spaced times over the same duration, by straight lines between samples.
///
/// Contact flags are those of the nearest sample.
///
/// # Errors
/// [`RecordingFault::Unexpected`] if it has one sample or `rows` is below 2.
pub fn resampled(segment: &Segment, rows: usize) -> Result<Segment, RecordingError> {
    let n = segment.len();
    if n < 2 || rows < 2 {
        return Err(RecordingFault::too_short(n.min(rows), 2).at(&segment.path, segment.row(0)));
    }
    let own_s = &segment.time_s;
    let (start, end) = (own_s[0], own_s[n - 1]);
    let even = |i: usize| start + (end - start) * (i as f64 / (rows - 1) as f64);
    let time_s: Vec<f64> = (0..rows).map(|i| even(i).clamp(start, end)).collect();
    let places: Vec<_> = time_s.iter().map(|&time| place(own_s, time)).collect();
    let nearest = |&(left, share): &(usize, f64)| segment.feet[left + usize::from(share >= 0.5)];
    let feet = places.iter().map(nearest).collect();
    let at_places = |m: &DMatrix<f64>| {
        DMatrix::from_fn(m.nrows(), rows, |row, i| {
            let (left, share) = places[i];
            let (a, b) = (m[(row, left)], m[(row, left + 1)]);
            a + share * (b - a)
        })
    };
    Ok(Segment {
        row_stride: segment.row_stride * (n - 1) as f64 / (rows - 1) as f64,
        ..segment.remade(time_s, feet, at_places)
    })
}

/// The sample on the left of a time, never the last, and the time's share of the way to the next.
pub(super) fn place(own_s: &[f64], time_s: f64) -> (usize, f64) {
    let after = own_s.partition_point(|own| *own <= time_s);
    let left = after.clamp(1, own_s.len() - 1) - 1;
    let step_s = own_s[left + 1] - own_s[left];
    (left, (time_s - own_s[left]) / step_s)
}

pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}
