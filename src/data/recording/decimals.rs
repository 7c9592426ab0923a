//! Numbers that lost their decimal point, and the samples that they were before a resampling.
//!
//! A spreadsheet that separates thousands by points reads `1.13946` as 113946 and `6.06e-05` as 6.06, and leaves
//! `0.374` alone; some exports divide all by 1000. Joint angles beyond a full turn reveal such a file. Then a number of
//! magnitude 1 or more may represent itself with the point one or more places to the left, down to 1. A number between
//! 1 and 10 may also represent 1e-5 times itself. The value that continues the motion is chosen. If the file was
//! resampled afterwards, by a cubic spline, its rows mix broken and sound numbers; the samples of the spline are found
//! first.

use super::*;

const FULL_TURN_RAD: f64 = std::f64::consts::TAU; // no joint of a leg turns by more
const STEPS_S: [f64; 6] = [0.01, 0.005, 0.004, 0.0025, 0.002, 0.001]; // of loggers, before a resampling; longest first
const FITS: f64 = 1e-6; // largest error of the spline, relative to the largest value
const EXPONENT: f64 = 1e-5; // of numbers that are written with one; the next, 1e-6, makes no difference
const OUTLIER: (f64, f64) = (0.3, 0.2); // an angle or place that far from its neighbours, which are that close together
const SOUND_STEP: f64 = 0.5; // from one sample to the next, rad or m, below which a row is left alone
const LARGEST_TORQUE_NM: f64 = 100.0; // up to which all torques are left alone
const LARGEST_RATE: f64 = 60.0; // of a joint, rad/s, above which angles stay broken

/// A segment whose numbers have their points again.
pub(super) struct Restored {
    pub segment: Segment,
    /// How many numbers changed.
    pub numbers: usize,
    /// Whether rows of a resampling became the samples before it.
    pub resampled: bool,
}

/// The largest joint angle, if it is beyond a full turn and some angle turns by half of one in a sample.
pub(super) fn broken_angle(segment: &Segment) -> Option<f64> {
    let angles = segment.x.rows(0, JOINT_DIM);
    let steps = angles.columns_range(1..) - angles.columns_range(..segment.len() - 1);
    let (largest, step) = (angles.amax(), steps.amax());
    (largest > FULL_TURN_RAD && step > 0.5 * FULL_TURN_RAD).then_some(largest)
}

/// None if the motion stays broken.
pub(super) fn restored(segment: &Segment) -> Option<Restored> {
    let spline = STEPS_S
        .iter()
        .find_map(|step_s| samples_of(segment, *step_s));
    let resampled = spline.is_some();
    let mut found = spline.unwrap_or_else(|| segment.clone());
    let before = found.clone();
    remake(&mut found.x, |values| match is_sound(values) {
        true => values.to_vec(),
        false => without_outliers(continuous(values)),
    });
    let slopes = differences(&found.time_s, &found.x);
    for (rate, slope) in found.dx.iter_mut().zip(&slopes) {
        let nearest = |a: &f64, b: &f64| (a - slope).abs().total_cmp(&(b - slope).abs());
        *rate = meanings(*rate)
            .into_iter()
            .min_by(nearest)
            .expect("itself at least");
    }
    if found.torque_nm.amax() > LARGEST_TORQUE_NM {
        remake(&mut found.torque_nm, continuous);
    }
    found.ddx = differences(&found.time_s, &found.dx);
    let slopes = slopes.rows(0, JOINT_DIM);
    let angles = found.x.rows(0, JOINT_DIM);
    let is_whole = angles.amax() <= FULL_TURN_RAD && slopes.amax() < LARGEST_RATE;
    let pairs = [
        (&before.x, &found.x),
        (&before.dx, &found.dx),
        (&before.torque_nm, &found.torque_nm),
    ];
    let changed = |(old, new): (&DMatrix<f64>, &DMatrix<f64>)| {
        old.iter().zip(new).filter(|(old, new)| old != new).count()
    };
    let numbers = pairs.into_iter().map(changed).sum();
    is_whole.then_some(Restored {
        segment: found,
        numbers,
        resampled,
    })
}

fn largest(values: &[f64]) -> f64 {
    values
        .iter()
        .fold(0.0, |largest, value| largest.max(value.abs()))
}

/// Whether angles or places, rad or m, can be as they are.
fn is_sound(values: &[f64]) -> bool {
    let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    largest(values) <= FULL_TURN_RAD && largest(&steps) < SOUND_STEP
}

/// Each row of a matrix, remade as a whole.
fn remake(rows: &mut DMatrix<f64>, remade: impl Fn(&[f64]) -> Vec<f64>) {
    for mut row in rows.row_iter_mut() {
        let values: Vec<f64> = row.iter().copied().collect();
        let cells = row.iter_mut().zip(remade(&values));
        cells.for_each(|(cell, value)| *cell = value);
    }
}

/// The values that a number may represent.
fn meanings(value: f64) -> Vec<f64> {
    let mut all = vec![value];
    let mut divisor = 10.0;
    while value.abs() / divisor >= 1.0 - 1e-9 {
        all.push(value / divisor);
        divisor *= 10.0;
    }
    if (1.0..10.0).contains(&value.abs()) {
        all.push(value * EXPONENT);
    }
    all
}

/// Of all readings of these numbers the one that changes least from one to the next, in sum.
fn continuous(values: &[f64]) -> Vec<f64> {
    let choices: Vec<Vec<f64>> = values.iter().map(|value| meanings(*value)).collect();
    let mut costs = vec![0.0; choices.first().map_or(0, Vec::len)];
    let mut origins = Vec::new();
    for pair in choices.windows(2) {
        let best = pair[1].iter().map(|to| {
            let each = pair[0].iter().zip(&costs).enumerate();
            let each = each.map(|(from, (value, cost))| (from, cost + (to - value).abs()));
            each.min_by(|a, b| a.1.total_cmp(&b.1))
                .expect("itself at least")
        });
        let (from, next): (Vec<usize>, Vec<f64>) = best.unzip();
        origins.push(from);
        costs = next;
    }
    let last = (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
    let Some(mut choice) = last else {
        return Vec::new();
    };
    let mut out = vec![0.0; values.len()];
    for at in (0..values.len()).rev() {
        out[at] = choices[at][choice];
        if at > 0 {
            choice = origins[at - 1][choice];
        }
    }
    out
}

/// Single samples far from two neighbours that are close together become the mean of these.
fn without_outliers(mut values: Vec<f64>) -> Vec<f64> {
    for at in 1..values.len().saturating_sub(1) {
        let (left, right) = (values[at - 1], values[at + 1]);
        let mean = 0.5 * (left + right);
        if (values[at] - mean).abs() > OUTLIER.0 && (right - left).abs() < OUTLIER.1 {
            values[at] = mean;
        }
    }
    values
}

/// The samples `step_s` apart whose cubic spline (not-a-knot) has the rows of the segment; none if there is none.
fn samples_of(segment: &Segment, step_s: f64) -> Option<Segment> {
    let (n, steps) = (segment.len(), segment.duration_s() / step_s);
    let count = steps.round() as usize + 1;
    if (steps - steps.round()).abs() > 1e-6 || !(5..n).contains(&count) {
        return None;
    }
    let start_s = segment.time_s[0];
    let places = segment.time_s.iter().map(|time| (time - start_s) / step_s);
    let spline = spline(count, &places.collect::<Vec<_>>());
    let factor = spline.tr_mul(&spline).cholesky()?;
    let samples = |rows: &DMatrix<f64>| factor.solve(&spline.tr_mul(&rows.transpose())).transpose();
    let error = samples(&segment.x) * spline.transpose() - &segment.x;
    if error.amax() > FITS * segment.x.amax() {
        return None;
    }
    let time_s = (0..count).map(|i| start_s + step_s * i as f64).collect();
    let nearest = |i: usize| (i as f64 * (n - 1) as f64 / (count - 1) as f64).round() as usize;
    let feet = (0..count).map(|i| segment.feet[nearest(i)]).collect();
    Some(Segment {
        row_stride: segment.row_stride * (n - 1) as f64 / (count - 1) as f64,
        ..segment.remade(time_s, feet, samples)
    })
}

/// Values of the not-a-knot cubic spline through `count` samples one apart, at these places: `places x count`.
fn spline(count: usize, places: &[f64]) -> DMatrix<f64> {
    let mut system = DMatrix::zeros(count, count);
    let mut curved = DMatrix::zeros(count, count);
    for i in 1..count - 1 {
        for (k, weight) in [(i - 1, 1.0), (i, 4.0), (i + 1, 1.0)] {
            system[(i, k)] = weight;
        }
        for (k, weight) in [(i - 1, 6.0), (i, -12.0), (i + 1, 6.0)] {
            curved[(i, k)] = weight;
        }
    }
    for (row, first) in [(0, 0), (count - 1, count - 3)] {
        for (k, weight) in [1.0, -2.0, 1.0].into_iter().enumerate() {
            system[(row, first + k)] = weight;
        }
    }
    let second = system.lu().solve(&curved).expect("invariant: a spline");
    let mut values = DMatrix::zeros(places.len(), count);
    for (place, mut row) in places.iter().zip(values.row_iter_mut()) {
        let left = (place.floor().max(0.0) as usize).min(count - 2);
        let right = place - left as f64;
        for (i, share) in [1.0 - right, right].into_iter().enumerate() {
            row[left + i] += share;
            row += second.row(left + i) * ((share.powi(3) - share) / 6.0);
        }
    }
    values
}
