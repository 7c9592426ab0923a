//! Plausibility: values in a recording that are physically impossible for the robot, with row and column. Samples are
//! removed only by [`without`], on request. Numbers that are not finite never get here, because reading rejects them.

use super::*;

const TORQUE_FACTOR: f64 = 1.1; // torque and speed over a joint's limit that are still accepted
const SPEED_FACTOR: f64 = 1.1;
/// Angle beyond a joint's limits that is still accepted, in rad.
pub const JOINT_MARGIN_RAD: f64 = 0.05;
/// Largest speed of the body along an axis, in m/s.
pub const BODY_SPEED_M_S: f64 = 10.0;
const BODY_RATE_RAD_S: f64 = 30.0; // largest rate of a body angle, in rad/s
const CONSISTENCY_SHARE: f64 = 0.3; // accepted disagreement of a rate with differences over that rate's 95th percentile
const VELOCITY_FLOOR: [f64; 3] = [1.0, 0.2, 0.5]; // floor of that disagreement: joints, body linear, body angular
const RATE_FLOOR: [f64; 3] = [100.0, 10.0, 50.0]; // the same for accelerations
const BODY_XY: Range<usize> = JOINT_DIM..JOINT_DIM + 2; // coordinates of the body along the floor
const CLIPPED_SAMPLES: usize = 5; // equal consecutive velocities at an extreme that count as clipped
const STEP_SHARE: f64 = 0.5; // departure of a time step from the median, as a share of it

/// A kind of fault in a run of samples; the `value` of a finding violates its `bound`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Implausible {
    Torque,
    JointAngle,
    Speed,
    Jump,
    Velocity, // `bound` is the nearer slope of the position; so for the acceleration
    Acceleration,
    Clipped,
    TimeStep,
    /// `value` is the span of thigh and calf (the knee's column) or the height of the hip over the foot (the
    /// flexion's), as in [`LegGeometry::spans`](crate::robot::LegGeometry::spans); `bound` is where damping begins.
    /// Such samples may be real: they are reported, and never removed.
    NearSingular,
}

impl Implausible {
    /// Whether samples with this finding are left out where implausible ones are.
    pub const fn can_be_left_out(self) -> bool {
        !matches!(self, Self::NearSingular)
    }

    pub const fn description(self) -> &'static str {
        match self {
            Self::Torque => "torque above the joint's limit",
            Self::JointAngle => "angle outside the joint's limits",
            Self::Speed => "speed above the possible one",
            Self::Jump => "position jumps faster than is possible",
            Self::Velocity => "velocity disagrees with differences of the position",
            Self::Acceleration => "acceleration disagrees with differences of the velocity",
            Self::Clipped => "velocity clips at an extreme",
            Self::TimeStep => "time step differs from the median",
            Self::NearSingular => "leg on the ground near a singularity, its force is damped",
        }
    }
}

/// A run of implausible samples in one column, with its first row in the file and that of its worst value.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    pub kind: Implausible,
    pub segment: usize,
    pub samples: Range<usize>,
    pub first_row: usize,
    pub worst_row: usize,
    pub column: String,
    pub value: f64,
    pub bound: f64,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "row {}", self.first_row)?;
        if self.samples.len() > 1 {
            write!(f, " and {} more", self.samples.len() - 1)?;
        }
        let (column, what) = (&self.column, self.kind.description());
        let (value, bound) = (self.value, self.bound);
        write!(
            f,
            ", column `{column}`: {what}: {value:.6} against {bound:.6}"
        )?;
        if self.worst_row != self.first_row {
            write!(f, " at row {}", self.worst_row)?;
        }
        Ok(())
    }
}

/// Everything implausible in a recording, in the order of its rows; neighbours with one fault are one finding.
pub fn check(recording: &Recording, robot: &Robot) -> Vec<Finding> {
    let mut out = Vec::new();
    for (index, segment) in recording.segments.iter().enumerate() {
        let found = &mut out;
        let mut scan = Scan {
            segment,
            index,
            found,
        };
        scan.limits(robot);
        scan.singularities(robot);
        scan.consistency();
        scan.clipping();
        scan.time_steps();
    }
    out.sort_by_key(|finding| (finding.segment, finding.first_row, finding.kind));
    out
}

/// The recording without the samples of these findings, and how many that leaves out; those of legs near a singularity
/// stay. Segments are divided where samples are missing; a remainder of a single sample goes too.
///
/// # Errors
/// [`RecordingFault::Unexpected`] if nothing remains.
pub fn without(recording: &Recording, findings: &[Finding]) -> Outcome<(Recording, usize)> {
    let mut segments = Vec::new();
    for (index, segment) in recording.segments.iter().enumerate() {
        let mut keep = vec![true; segment.len()];
        let is_own = |f: &&Finding| f.segment == index && f.kind.can_be_left_out();
        for finding in findings.iter().filter(is_own) {
            let end = finding.samples.end.min(keep.len());
            keep[finding.samples.start.min(end)..end].fill(false);
        }
        let runs = stretches(0..keep.len(), |a, b| keep[a] == keep[b]).into_iter();
        let kept = runs.filter(|range| keep[range.start] && range.len() >= 2);
        segments.extend(kept.map(|range| segment.slice(range)));
    }
    if segments.is_empty() {
        let row = recording.segments.first().map_or(1, |s| s.first_row);
        return Err(RecordingFault::too_short(0, 2).at(&recording.path, row));
    }
    let out = recording.with_segments(segments);
    let dropped = recording.sample_count() - out.sample_count();
    Ok((out, dropped))
}

struct Scan<'a> {
    segment: &'a Segment,
    index: usize,
    found: &'a mut Vec<Finding>,
}

pub(super) type Breach = Option<(f64, f64)>;

impl Scan<'_> {
    fn column(&mut self, kind: Implausible, column: Column, breach: impl Fn(usize) -> Breach) {
        let mut last_end = None;
        for sample in 0..self.segment.len() {
            let Some((value, bound)) = breach(sample) else {
                continue;
            };
            let row = self.segment.row(sample);
            match self.found.last_mut() {
                Some(open) if last_end == Some(sample) => {
                    open.samples.end = sample + 1;
                    if (value - bound).abs() > (open.value - open.bound).abs() {
                        (open.value, open.bound, open.worst_row) = (value, bound, row);
                    }
                }
                _ => self.found.push(Finding {
                    kind,
                    segment: self.index,
                    samples: sample..sample + 1,
                    first_row: row,
                    worst_row: row,
                    column: column.name(),
                    value,
                    bound,
                }),
            }
            last_end = Some(sample + 1);
        }
    }

    fn limits(&mut self, robot: &Robot) {
        let segment = self.segment;
        for i in 0..JOINT_DIM {
            let bound = robot.torque_limit_nm()[i] * TORQUE_FACTOR;
            self.column(Implausible::Torque, Column::Torque(i), |j| {
                outside(segment.torque_nm[(i, j)], -bound, bound)
            });
            let (low, high) = robot.joint_limit_rad()[i];
            let (low, high) = (low - JOINT_MARGIN_RAD, high + JOINT_MARGIN_RAD);
            self.column(Implausible::JointAngle, Column::Position(i), |j| {
                outside(segment.x[(i, j)], low, high)
            });
        }
        for i in 0..STATE_DIM {
            let bound = match group(i) {
                0 => robot.joint_speed_limit_rad_s[i] * SPEED_FACTOR,
                1 => BODY_SPEED_M_S,
                _ => BODY_RATE_RAD_S,
            };
            self.column(Implausible::Speed, Column::Velocity(i), |j| {
                outside(segment.dx[(i, j)], -bound, bound)
            });
            self.column(Implausible::Jump, Column::Position(i), |j| {
                let before = j.checked_sub(1)?;
                let rise = segment.x[(i, j)] - segment.x[(i, before)];
                let speed = rise / (segment.time_s[j] - segment.time_s[before]);
                outside(speed, -bound, bound)
            });
        }
    }

    fn singularities(&mut self, robot: &Robot) {
        let segment = self.segment;
        for leg in Leg::ALL {
            for (span, (joint, least)) in
                [(2, LEAST_SPAN), (1, LEAST_HEIGHT)].into_iter().enumerate()
            {
                let column = Column::Position(LEG_JOINT_DIM * leg.index() + joint);
                self.column(Implausible::NearSingular, column, |j| {
                    let q = leg.of_joints(&segment.joints(j));
                    let value = robot.geometry(leg).spans(&q)[span];
                    (segment.feet[j][leg.index()] && value < least).then_some((value, least))
                });
            }
        }
    }

    fn consistency(&mut self) {
        let time_s = &self.segment.time_s;
        for i in 0..STATE_DIM {
            let [x, dx, ddx] = [&self.segment.x, &self.segment.dx, &self.segment.ddx]
                .map(|matrix| Vec::from_iter(matrix.row(i).iter().copied()));
            let (of_dx, of_ddx) = (Column::Velocity(i), Column::Acceleration(i));
            for (kind, column, floor, values, rates) in [
                (Implausible::Velocity, of_dx, VELOCITY_FLOOR, &x, &dx),
                (Implausible::Acceleration, of_ddx, RATE_FLOOR, &dx, &ddx),
            ] {
                let slack = floor[group(i)]
                    + CONSISTENCY_SHARE * quantile(rates.iter().map(|v| v.abs()), 0.95)
                    + noise(time_s, values);
                self.column(kind, column, |j| disagrees(time_s, values, rates, j, slack));
            }
        }
    }

    fn clipping(&mut self) {
        let (segment, n) = (self.segment, self.segment.len());
        for i in 0..STATE_DIM {
            let extreme = segment.dx.row(i).amax();
            if extreme == 0.0 {
                continue;
            }
            // In flight nothing pushes the body forwards or sideways: a velocity that does not change is right there.
            let glides = |j: usize| BODY_XY.contains(&i) && segment.feet[j] == [false; 4];
            let at_extreme = |j: usize| segment.dx[(i, j)].abs() == extreme && !glides(j);
            let mut clipped = vec![false; n];
            for run in stretches(0..n, |a, b| at_extreme(a) == at_extreme(b)) {
                let is_long = run.len() >= CLIPPED_SAMPLES;
                clipped[run.clone()].fill(is_long && at_extreme(run.start));
            }
            self.column(Implausible::Clipped, Column::Velocity(i), |j| {
                clipped[j].then_some((segment.dx[(i, j)], extreme))
            });
        }
    }

    fn time_steps(&mut self) {
        let segment = self.segment;
        let median = median(segment.time_s.windows(2).map(|pair| pair[1] - pair[0]));
        self.column(Implausible::TimeStep, Column::Time, |j| {
            let step = segment.time_s[j] - segment.time_s[j.checked_sub(1)?];
            ((step - median).abs() > STEP_SHARE * median).then_some((step, median))
        });
    }
}

/// 0 for a joint, 1 for the body's position, 2 for its angles.
fn group(coordinate: usize) -> usize {
    match coordinate.checked_sub(JOINT_DIM) {
        None => 0,
        Some(body) => 1 + body / 3,
    }
}

/// The value and the bound that it breaks; none within the bounds, or for no number.
pub(super) fn outside(value: f64, low: f64, high: f64) -> Breach {
    if value < low {
        Some((value, low))
    } else {
        (value > high).then_some((value, high))
    }
}

/// The value below which a share of the values lies; 0 if there are none.
pub(super) fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    let place = (sorted.len().saturating_sub(1) as f64 * share) as usize;
    sorted.get(place).copied().unwrap_or(0.0)
}

fn slope(time_s: &[f64], values: &[f64], j: usize) -> f64 {
    (values[j] - values[j - 1]) / (time_s[j] - time_s[j - 1])
}

/// Three times the median change of slope from step to step: the difference between a rate and a slope due to noise.
fn noise(time_s: &[f64], values: &[f64]) -> f64 {
    let change = |j: usize| (slope(time_s, values, j + 1) - slope(time_s, values, j)).abs();
    3.0 * quantile((1..values.len().saturating_sub(1)).map(change), 0.5)
}

/// A rate lies between the slopes of the values before and after it unless it turns within the steps.
fn disagrees(time_s: &[f64], values: &[f64], rates: &[f64], j: usize, slack: f64) -> Breach {
    if j == 0 || j + 1 >= rates.len() {
        return None;
    }
    let (left, right) = (slope(time_s, values, j), slope(time_s, values, j + 1));
    let (low, high) = (left.min(right), left.max(right));
    outside(rates[j], low - slack, high + slack).map(|_| (rates[j], rates[j].clamp(low, high)))
}
