//! Samples become segments.

use std::path::Path;

use nalgebra::DMatrix;

use super::columns::Column;
use super::error::{RecordingError, RecordingFault};
use super::preprocess::differences;
use super::segment::Segment;
use crate::robot::{BODY_DIM, ContactFlags, JOINT_DIM, STATE_DIM};

/// The note on a recording whose accelerations are made here.
pub(super) const DERIVED_DDX: &str = "accelerations are differences of velocities";
/// A step this many times the one before it starts a new segment, as a jump
/// back does: samples were left out between the two.
const GAP_STEPS: f64 = 20.0;
/// A first time beyond this is that of a clock that counts from an epoch: times count from it then.
pub(super) const EPOCH_S: f64 = 1e7;
/// Largest mean distance between samples: a jump lasts less than a second.
const LARGEST_STEP_S: f64 = 0.1;

/// One sample, sorted by meaning.
#[derive(Default)]
pub(super) struct Sample {
    pub time_s: f64,
    pub x: [f64; STATE_DIM],
    pub dx: [f64; STATE_DIM],
    pub ddx: [f64; STATE_DIM],
    pub torque_nm: [f64; JOINT_DIM],
    pub force: [f64; BODY_DIM],
    pub feet: ContactFlags,
}

impl Sample {
    /// Puts a value where its column belongs; a foot with 1 is down.
    pub fn set(&mut self, column: Column, value: f64) {
        match column {
            Column::Time => self.time_s = value,
            Column::Position(i) => self.x[i] = value,
            Column::Velocity(i) => self.dx[i] = value,
            Column::Acceleration(i) => self.ddx[i] = value,
            Column::Torque(i) => self.torque_nm[i] = value,
            Column::Force(i) => self.force[i] = value,
            Column::Foot(i) => self.feet[i] = value == 1.0,
        }
    }
}

/// The segments of a recording, sample by sample.
pub(super) struct SegmentBuilder<'a> {
    path: &'a Path,
    has_acceleration: bool,
    has_force: bool,
    /// Time of the first sample if the clock counts from an epoch, else 0.
    origin_s: Option<f64>,
    /// The segment so far: its first row, its times, contacts, and x, dx, ddx, torques and forces sample after sample.
    first_row: usize,
    time_s: Vec<f64>,
    feet: Vec<ContactFlags>,
    values: [Vec<f64>; 5],
    segments: Vec<Segment>,
}

impl<'a> SegmentBuilder<'a> {
    /// Of samples that carry accelerations, or else get differences; and the body wrench.
    pub fn new(path: &'a Path, has_acceleration: bool, has_force: bool) -> Self {
        SegmentBuilder {
            path,
            has_acceleration,
            has_force,
            origin_s: None,
            first_row: 0,
            time_s: Vec::new(),
            feet: Vec::new(),
            values: Default::default(),
            segments: Vec::new(),
        }
    }

    pub fn push(&mut self, row: usize, sample: Sample) -> Result<(), RecordingError> {
        let is_clock = sample.time_s.abs() > EPOCH_S;
        let first_s = if is_clock { sample.time_s } else { 0.0 };
        let time_s = sample.time_s - *self.origin_s.get_or_insert(first_s);
        if begins_segment(&self.time_s, time_s)
            .map_err(|fault| fault.in_cell(self.path, row, "Time"))?
        {
            self.close()?;
        }
        if self.time_s.is_empty() {
            self.first_row = row;
        }
        self.time_s.push(time_s);
        self.feet.push(sample.feet);
        let ddx = &sample.ddx[..if self.has_acceleration { STATE_DIM } else { 0 }];
        let force = &sample.force[..if self.has_force { BODY_DIM } else { 0 }];
        let own = [&sample.x[..], &sample.dx, ddx, &sample.torque_nm, force];
        for (all, own) in self.values.iter_mut().zip(own) {
            all.extend_from_slice(own);
        }
        Ok(())
    }

    fn close(&mut self) -> Result<(), RecordingError> {
        let time_s = std::mem::take(&mut self.time_s);
        let n = time_s.len();
        if n < 2 {
            return Err(RecordingFault::too_short(n, 2).at(self.path, self.first_row));
        }
        let step_s = (time_s[n - 1] - time_s[0]) / (n - 1) as f64;
        if step_s > LARGEST_STEP_S {
            let (found, expected) = (step_s, LARGEST_STEP_S);
            let fault = RecordingFault::Sampling { found, expected };
            return Err(fault.in_cell(self.path, self.first_row, "Time"));
        }
        let matrix = |mut all: Vec<f64>| {
            all.shrink_to_fit();
            DMatrix::from_vec(all.len() / n, n, all)
        };
        let [x, dx, ddx, torque_nm, force] = std::mem::take(&mut self.values).map(matrix);
        let ddx = match self.has_acceleration {
            true => ddx,
            false => differences(&time_s, &dx),
        };
        self.require_finite(&ddx)?;
        self.segments.push(Segment {
            path: self.path.to_owned(),
            first_row: self.first_row,
            row_stride: 1.0,
            time_s,
            x,
            dx,
            ddx,
            torque_nm,
            feet: std::mem::take(&mut self.feet),
            body_wrench: self.has_force.then_some(force),
        });
        Ok(())
    }

    /// Differences of huge velocities over tiny steps can overflow.
    fn require_finite(&self, ddx: &DMatrix<f64>) -> Result<(), RecordingError> {
        let Some(place) = ddx.iter().position(|value| !value.is_finite()) else {
            return Ok(());
        };
        let found = format!("{} from differences", ddx[place]);
        let expected = "a finite number";
        let row = self.first_row + place / STATE_DIM;
        let column = Column::Acceleration(place % STATE_DIM).name();
        Err(RecordingFault::Number { found, expected }.in_cell(self.path, row, &column))
    }

    /// The segments of a file of so many columns.
    pub fn finish(mut self, columns: usize) -> Result<Vec<Segment>, RecordingError> {
        if self.time_s.is_empty() {
            return Err(RecordingFault::HeaderOnly(columns).of(self.path));
        }
        self.close()?;
        Ok(self.segments)
    }
}

/// Whether a time belongs to a new segment: it jumps back by more than a step or to where the segment of these times
/// began, or far ahead.
///
/// # Errors
/// [`RecordingFault::Time`] if time stands still, or steps back by less.
pub(super) fn begins_segment(open_s: &[f64], time_s: f64) -> Result<bool, RecordingFault> {
    let (Some(&first), Some(&last)) = (open_s.first(), open_s.last()) else {
        return Ok(false);
    };
    let before = match open_s {
        [.., a, b] => b - a,
        _ => f64::INFINITY,
    };
    let step = time_s - last;
    if step > 0.0 {
        return Ok(step > GAP_STEPS * before);
    }
    if step < 0.0 && (time_s <= first || -step > 1.5 * before) {
        return Ok(true);
    }
    let (found, previous) = (time_s, last);
    Err(RecordingFault::Time { found, previous })
}
