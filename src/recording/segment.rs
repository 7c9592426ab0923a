//! The data: recordings and their segments of consecutive samples.

use std::ops::Range;
use std::path::PathBuf;

use nalgebra::DMatrix;

use super::error::{RecordingError, RecordingFault};
use crate::robot::{BODY_DIM, ContactFlags, JOINT_DIM, Robot, STATE_DIM};

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The file, or the name that its bytes were given.
    pub path: PathBuf,
    /// Stretches of increasing time, in the order of the file; never empty when read.
    pub segments: Vec<Segment>,
    /// Columns that the format does not know and that were not read.
    pub ignored_columns: Vec<String>,
}

impl Recording {
    /// Number of samples in all segments.
    pub fn sample_count(&self) -> usize {
        self.segments.iter().map(Segment::len).sum()
    }
}

/// Consecutive samples; every matrix has one column a sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// The file that the samples come from.
    pub path: PathBuf,
    /// Line of the first sample in the file (the header is line 1).
    pub first_row: usize,
    /// Lines of the file from one sample to the next: 1, less after resampling.
    pub row_stride: f64,
    /// Increasing times, in s.
    pub time_s: Vec<f64>,
    /// State, 18 x n: joint angles (rad), body position (m), roll pitch yaw (rad).
    pub x: DMatrix<f64>,
    /// Its rate, 18 x n, per s.
    pub dx: DMatrix<f64>,
    /// Its acceleration, 18 x n, per s^2.
    pub ddx: DMatrix<f64>,
    /// Joint torques, 12 x n, in N m.
    pub torque_nm: DMatrix<f64>,
    /// Contact of each foot.
    pub feet: Vec<ContactFlags>,
    /// `[F_lin; F_ang]`, 6 x n (N, N m), when the file carries it.
    pub body_wrench: Option<DMatrix<f64>>,
}

impl Segment {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Line of the file that a sample comes from, for messages.
    pub fn row(&self, sample: usize) -> usize {
        self.first_row + (sample as f64 * self.row_stride).round() as usize
    }

    /// Time from the first to the last sample, in s.
    pub fn duration_s(&self) -> f64 {
        match (self.time_s.first(), self.time_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Mean time between samples, in s; 0 for a single one.
    pub fn mean_step_s(&self) -> f64 {
        self.duration_s() / self.len().saturating_sub(1).max(1) as f64
    }

    /// Joint angles of a sample, in rad.
    ///
    /// # Panics
    /// If there is no such sample.
    pub fn joints(&self, sample: usize) -> [f64; JOINT_DIM] {
        std::array::from_fn(|i| self.x[(i, sample)])
    }

    /// Joint torques of a sample, in N m.
    ///
    /// # Panics
    /// If there is no such sample.
    pub fn torque(&self, sample: usize) -> [f64; JOINT_DIM] {
        std::array::from_fn(|i| self.torque_nm[(i, sample)])
    }

    /// Force and moment on the body, 6 x n: the file's own, or computed from
    /// torques and contact (equation 22).
    ///
    /// # Errors
    /// [`RecordingFault::Wrench`] with the row at which a leg in contact is singular.
    pub fn wrench(&self, robot: &Robot) -> Result<DMatrix<f64>, RecordingError> {
        if let Some(recorded) = &self.body_wrench {
            return Ok(recorded.clone());
        }
        let mut out = DMatrix::zeros(BODY_DIM, self.len());
        for sample in 0..self.len() {
            let wrench = robot
                .body_wrench(
                    &self.joints(sample),
                    &self.torque(sample),
                    self.feet[sample],
                )
                .map_err(|e| {
                    RecordingFault::Wrench(Box::new(e)).at(&self.path, self.row(sample))
                })?;
            out.column_mut(sample).copy_from(&wrench);
        }
        Ok(out)
    }

    /// Input `u = [tau; F]`, 18 x n, in N m and N (equation 23).
    ///
    /// # Errors
    /// As [`Segment::wrench`].
    pub fn input(&self, robot: &Robot) -> Result<DMatrix<f64>, RecordingError> {
        let mut out = DMatrix::zeros(STATE_DIM, self.len());
        out.rows_mut(0, JOINT_DIM).copy_from(&self.torque_nm);
        out.rows_mut(JOINT_DIM, BODY_DIM)
            .copy_from(&self.wrench(robot)?);
        Ok(out)
    }

    /// The samples of a range as a segment of their own.
    ///
    /// # Panics
    /// If the range leaves the segment, as indexing a slice does.
    pub fn slice(&self, range: Range<usize>) -> Segment {
        let columns = |m: &DMatrix<f64>| m.columns(range.start, range.len()).into_owned();
        Segment {
            path: self.path.clone(),
            first_row: self.row(range.start),
            row_stride: self.row_stride,
            time_s: self.time_s[range.clone()].to_vec(),
            x: columns(&self.x),
            dx: columns(&self.dx),
            ddx: columns(&self.ddx),
            torque_nm: columns(&self.torque_nm),
            feet: self.feet[range.clone()].to_vec(),
            body_wrench: self.body_wrench.as_ref().map(columns),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::robot::RobotError;

    /// A segment whose entries all differ, of a robot that stands.
    pub fn sample_segment(n: usize) -> Segment {
        let fill = |rows: usize, offset: f64| {
            DMatrix::from_fn(rows, n, |i, j| offset + 0.01 * i as f64 + 0.001 * j as f64)
        };
        let mut x = fill(STATE_DIM, 0.0);
        for j in 0..n {
            for i in 0..JOINT_DIM {
                x[(i, j)] += [0.0, 0.7, -1.6][i % 3];
            }
        }
        Segment {
            path: PathBuf::from("sample.csv"),
            first_row: 2,
            row_stride: 1.0,
            time_s: (0..n).map(|j| 0.002 * j as f64).collect(),
            x,
            dx: fill(STATE_DIM, 1.0),
            ddx: fill(STATE_DIM, 2.0),
            torque_nm: fill(JOINT_DIM, 3.0),
            feet: vec![[true; 4]; n],
            body_wrench: None,
        }
    }

    #[test]
    fn input_stacks_torques_and_the_robots_wrench() {
        let segment = sample_segment(4);
        let go1 = Robot::by_name("go1").unwrap();
        let u = segment.input(go1).unwrap();
        assert_eq!(u.rows(0, 12), segment.torque_nm.rows(0, 12));
        let wrench = go1
            .body_wrench(&segment.joints(2), &segment.torque(2), [true; 4])
            .unwrap();
        for axis in 0..BODY_DIM {
            assert_eq!(u[(12 + axis, 2)], wrench[axis]);
        }
    }

    #[test]
    fn input_prefers_the_wrench_of_the_file() {
        let mut segment = sample_segment(3);
        segment.body_wrench = Some(DMatrix::from_element(6, 3, 7.5));
        let u = segment.input(Robot::by_name("go1").unwrap()).unwrap();
        assert_eq!(u[(12, 0)], 7.5);
        assert_eq!(u[(17, 2)], 7.5);
    }

    #[test]
    fn input_singular_leg_in_contact_names_its_row() {
        let mut segment = sample_segment(5);
        segment.x[(5, 3)] = 0.0;
        let go1 = Robot::by_name("go1").unwrap();
        let error = segment.input(go1).unwrap_err();
        let RecordingFault::Wrench(source) = &error.kind else {
            panic!("{error:?}");
        };
        assert_eq!(error.place.row(), Some(5));
        assert!(matches!(**source, RobotError::SingularLeg { .. }));
        segment.feet[3][1] = false;
        assert!(segment.input(go1).is_ok());
    }

    #[test]
    fn slice_keeps_rows_of_the_file() {
        let segment = sample_segment(6);
        let part = segment.slice(2..5);
        assert_eq!((part.len(), part.first_row, part.row(1)), (3, 4, 5));
        assert_eq!(part.x.column(0), segment.x.column(2));
        assert_eq!(part.time_s, segment.time_s[2..5]);
    }
}
