//! The data: recordings and their segments of consecutive samples.

use super::preprocess::moving_average;
use super::*;

const WALK_WINDOW_S: f64 = 0.0095; // in walks: 5 samples of 2 ms, where 10 ms would be between 5 and 7
const ACCELERATION_WINDOW_S: f64 = 0.02; // joint accelerations are averaged over it before motor inertia counts

pub(crate) type Rows = DMatrix<f64>; // quantities by row, one column a sample

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
    pub(crate) fn with_segments(&self, segments: Vec<Segment>) -> Self {
        Self {
            path: self.path.clone(),
            segments,
            ignored_columns: self.ignored_columns.clone(),
        }
    }

    pub fn sample_count(&self) -> usize {
        self.segments.iter().map(Segment::len).sum()
    }
}

impl From<Segment> for Recording {
    fn from(segment: Segment) -> Self {
        Self {
            path: segment.path.clone(),
            segments: vec![segment],
            ignored_columns: Vec::new(),
        }
    }
}

/// Consecutive samples of a file; every matrix has one column a sample.
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
    pub feet: Vec<ContactFlags>,
    /// `[F_lin; F_ang]`, 6 x n (N, N m), when the file carries it.
    pub body_wrench: Option<DMatrix<f64>>,
    /// Whether it is part of a walk, whose feet stand for a tenth to a quarter of a second each.
    pub is_walk: bool,
}

/// The longest stretches of samples in which each is like the one before it, by `alike(before, sample)`.
pub fn stretches(samples: Range<usize>, alike: impl Fn(usize, usize) -> bool) -> Vec<Range<usize>> {
    let mut out: Vec<Range<usize>> = Vec::new();
    for sample in samples {
        match out.last_mut() {
            Some(open) if alike(open.end - 1, sample) => open.end = sample + 1,
            _ => out.push(sample..sample + 1),
        }
    }
    out
}

/// The samples left and right of a time, its share of the way between them; outside, the nearest sample twice.
pub fn between(times_s: &[f64], time_s: f64) -> (usize, usize, f64) {
    let after = times_s.partition_point(|&t| t <= time_s);
    let (left, right) = (after.saturating_sub(1), after.min(times_s.len() - 1));
    let step = times_s[right] - times_s[left];
    let share = match step > 0.0 {
        true => (time_s - times_s[left]) / step,
        false => 0.0,
    };
    (left, right, share)
}

impl Segment {
    /// Samples at these times, all zero, with all feet on the ground.
    pub fn still(path: impl Into<PathBuf>, time_s: Vec<f64>) -> Self {
        let zeros = |rows: usize| DMatrix::zeros(rows, time_s.len());
        Self {
            path: path.into(),
            first_row: 2,
            row_stride: 1.0,
            x: zeros(STATE_DIM),
            dx: zeros(STATE_DIM),
            ddx: zeros(STATE_DIM),
            torque_nm: zeros(JOINT_DIM),
            feet: vec![[true; 4]; time_s.len()],
            body_wrench: None,
            is_walk: false,
            time_s,
        }
    }

    /// Other samples of the same rows: `samples` makes each matrix of this one's.
    pub(super) fn remade(
        &self,
        time_s: Vec<f64>,
        feet: Vec<ContactFlags>,
        samples: impl Fn(&DMatrix<f64>) -> DMatrix<f64>,
    ) -> Self {
        Self {
            path: self.path.clone(),
            first_row: self.first_row,
            row_stride: self.row_stride,
            time_s,
            x: samples(&self.x),
            dx: samples(&self.dx),
            ddx: samples(&self.ddx),
            torque_nm: samples(&self.torque_nm),
            feet,
            body_wrench: self.body_wrench.as_ref().map(samples),
            is_walk: self.is_walk,
        }
    }

    pub(super) fn set(&mut self, column: Column, values: impl Iterator<Item = f64>) {
        let n = self.len();
        let (matrix, row) = match column {
            Column::Time => return self.time_s = values.collect(),
            Column::Foot(i) => {
                let feet = self.feet.iter_mut().zip(values);
                return feet.for_each(|(feet, value)| feet[i] = value == 1.0);
            }
            Column::Position(i) => (&mut self.x, i),
            Column::Velocity(i) => (&mut self.dx, i),
            Column::Acceleration(i) => (&mut self.ddx, i),
            Column::Torque(i) => (&mut self.torque_nm, i),
            Column::Force(i) => {
                let empty = || DMatrix::zeros(BODY_DIM, n);
                (self.body_wrench.get_or_insert_with(empty), i)
            }
        };
        for (cell, value) in matrix.row_mut(row).iter_mut().zip(values) {
            *cell = value;
        }
    }

    pub(super) fn get(&self, column: Column, sample: usize) -> f64 {
        match column {
            Column::Time => self.time_s[sample],
            Column::Position(i) => self.x[(i, sample)],
            Column::Velocity(i) => self.dx[(i, sample)],
            Column::Acceleration(i) => self.ddx[(i, sample)],
            Column::Torque(i) => self.torque_nm[(i, sample)],
            Column::Force(i) => self.body_wrench.as_ref().map_or(0.0, |w| w[(i, sample)]),
            Column::Foot(i) => f64::from(u8::from(self.feet[sample][i])),
        }
    }

    pub fn len(&self) -> usize {
        self.time_s.len()
    }

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
    pub fn joints(&self, sample: usize) -> [f64; JOINT_DIM] {
        std::array::from_fn(|i| self.x[(i, sample)])
    }

    /// State of a sample, in rad and m.
    pub fn state(&self, sample: usize) -> [f64; STATE_DIM] {
        std::array::from_fn(|i| self.x[(i, sample)])
    }

    /// Joint torques of a sample, in N m.
    pub fn torque(&self, sample: usize) -> [f64; JOINT_DIM] {
        std::array::from_fn(|i| self.torque_nm[(i, sample)])
    }

    /// Accelerations, 18 x n: [`Self::ddx`] averaged over 20 ms within stretches of equal contact (a foot down, or
    /// none), so that noise and the spikes of landings do not become torques. For a walk they are averaged over 10 ms,
    /// 5 samples at 500 Hz, within stretches of the same feet: the spike of a touchdown belongs to the stance that it
    /// begins.
    fn smoothed_accelerations(&self) -> DMatrix<f64> {
        let (window_s, stretches) = match self.is_walk {
            true => (
                WALK_WINDOW_S,
                stretches(0..self.len(), |a, b| self.feet[a] == self.feet[b]),
            ),
            false => (
                ACCELERATION_WINDOW_S,
                self.contacts()
                    .into_iter()
                    .map(|(stretch, _)| stretch)
                    .collect(),
            ),
        };
        let half = match self.mean_step_s() {
            step if step > 0.0 => (0.5 * window_s / step).round() as usize,
            _ => 0,
        };
        let window = 2 * half.min(self.len()) + 1;
        let mut out = DMatrix::zeros(STATE_DIM, self.len());
        for stretch in stretches {
            let own = self.ddx.columns_range(stretch.clone()).into_owned();
            (out.columns_range_mut(stretch)).copy_from(&moving_average(&own, window));
        }
        out
    }

    /// Stretches of equal contact, and whether a foot is down in each.
    pub(crate) fn contacts(&self) -> Vec<(Range<usize>, bool)> {
        let down = |sample: usize| self.feet[sample].contains(&true);
        let all = stretches(0..self.len(), |a, b| down(a) == down(b)).into_iter();
        all.map(|stretch| (stretch.clone(), down(stretch.start)))
            .collect()
    }

    /// [`InputRule::losses`] of the joints, 12 x n, in N m.
    pub fn losses(&self, rule: &InputRule) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(JOINT_DIM, self.len());
        if rule.actuators().is_none() {
            return out;
        }
        let ddx = self.smoothed_accelerations();
        for (sample, mut column) in out.column_iter_mut().enumerate() {
            let of = |m: &DMatrix<f64>| std::array::from_fn(|i| m[(i, sample)]);
            let [x, dx, ddx] = [&self.x, &self.dx, &ddx].map(of);
            column.copy_from_slice(&rule.losses([&x, &dx, &ddx], self.feet[sample]));
        }
        out
    }

    /// Input `u = [tau; F; M]`, 18 x n, in N m and N (equation 23), by the rule of a model. `tau` are the torques at
    /// the links, recorded ones minus [`Segment::losses`]. `F` and `M` are the force and moment on the body by these
    /// torques and the contacts (equation 22); under the published rule the file's own, if it has them. Torques beyond
    /// a limit of the robot's motors, such as commanded ones, count as the limit. Near a singularity of a leg in
    /// contact its force is damped ([`Robot::damped_force_map`]).
    ///
    /// # Errors
    /// [`RecordingFault::Wrench`] with the row of an angle or torque that is not finite.
    pub fn input(&self, rule: &InputRule) -> Outcome<DMatrix<f64>> {
        let torque_nm = self.torque_within_limits(rule.robot());
        let mut out = DMatrix::zeros(STATE_DIM, self.len());
        let net = &torque_nm - self.losses(rule);
        out.rows_mut(0, JOINT_DIM).copy_from(&net);
        let recorded = self.body_wrench.as_ref().filter(|_| rule.is_published());
        for sample in 0..self.len() {
            let mut to = out.fixed_view_mut::<BODY_DIM, 1>(JOINT_DIM, sample);
            if let Some(recorded) = recorded
                && torque_nm.column(sample) == self.torque_nm.column(sample)
            {
                to.copy_from(&recorded.column(sample));
                continue;
            }
            let net = std::array::from_fn(|i| net[(i, sample)]);
            let wrench = rule.input_wrench(&self.state(sample), &net, self.feet[sample]);
            let refused = |e| RecordingFault::Wrench(Box::new(e)).at(&self.path, self.row(sample));
            to.copy_from(&wrench.map_err(refused)?);
        }
        Ok(out)
    }

    /// Torques, 12 x n, in N m, those beyond a limit of the motors as the limit.
    pub(crate) fn torque_within_limits(&self, robot: &Robot) -> DMatrix<f64> {
        let mut torque_nm = self.torque_nm.clone();
        for (mut row, limit) in torque_nm.row_iter_mut().zip(robot.torque_limit_nm()) {
            row.apply(|torque| {
                if torque.is_finite() {
                    *torque = torque.clamp(-limit, *limit);
                }
            });
        }
        torque_nm
    }

    /// The mirror image at the plane `y = 0` of a robot that is symmetric, see [`Robot::mirrored`].
    pub fn mirrored(&self, robot: &Robot) -> Segment {
        let feet = self.feet.iter();
        let feet = feet.map(|feet| std::array::from_fn(|foot| feet[foot ^ 1]));
        self.remade(self.time_s.clone(), feet.collect(), |m| {
            let first = if m.nrows() == BODY_DIM { JOINT_DIM } else { 0 };
            let rows = (0..m.nrows()).map(|i| {
                let (from, sign) = robot.mirrored(first + i);
                m.row(from - first) * sign
            });
            DMatrix::from_rows(&rows.collect::<Vec<_>>())
        })
    }

    /// The samples of a range as a segment of their own.
    pub fn slice(&self, range: Range<usize>) -> Segment {
        let (time_s, feet) = (&self.time_s[range.clone()], &self.feet[range.clone()]);
        Segment {
            first_row: self.row(range.start),
            ..self.remade(time_s.to_vec(), feet.to_vec(), |m| {
                m.columns(range.start, range.len()).into_owned()
            })
        }
    }
}

pub(super) const DERIVED_DDX: &str = "accelerations are differences of velocities";
const GAP_STEPS: f64 = 20.0; // a step this many times the one before it starts a new segment, as a jump back does
pub(super) const EPOCH_S: f64 = 1e7; // first times beyond it are since an epoch: times then count from them
const LARGEST_STEP_S: f64 = 0.1; // largest mean distance between samples: a jump lasts less than a second

/// The segments of all samples of a file, which get differences for accelerations that they do not have.
pub(super) fn divided(mut whole: Segment, has_acceleration: bool) -> Outcome<Vec<Segment>> {
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
            return Err(unexpected(found, expected).in_cell(&segment.path, row, "Time"));
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
        segment.is_walk = stride_s(std::iter::once(&*segment)).is_some();
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
