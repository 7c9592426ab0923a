//! Places of the feet in the world, and how well those on the ground stay there. Also forces compared with weight and
//! acceleration, falling in flight, and hips' torques compared with the side of their feet.

use nalgebra::{Matrix3, Rotation3, Unit, UnitQuaternion, Vector3};
use serde::Serializer;

use super::*;
use crate::recording::foreign::angles_of_quaternions;
use crate::robot::{BODY_NAMES, BODY_Z, rotation};

type State = [f64; STATE_DIM];

const LEAST_STANCE_S: f64 = 0.05; // shortest stance that counts, s
const EDGE_S: f64 = 0.02; // uncounted time at both ends of a stance, touchdown and lift-off; at most an eighth of it
const FOOT_RADIUS_M: f64 = 0.022; // of the sphere that a foot rolls on: 0.02 to 0.023 on the robots in romc
const LEAST_SAMPLES: usize = 50; // fewest samples of feet on the ground for a metric

/// A way in which columns are easily recorded: words, body x and y exchanged, other signs, order of the quaternion.
pub(super) type Reading = (&'static str, bool, &'static [usize], Option<[usize; 4]>);

const BODY: usize = JOINT_DIM;
const AS_RECORDED: Reading = ("as recorded", false, &[], None);

const ABDUCTION: &str = "with hip abduction of the other sign";
const SIGNS: [Reading; 4] = [
    ("with roll of the other sign", false, &[BODY + 3], None),
    ("with pitch of the other sign", false, &[BODY + 4], None),
    ("with yaw of the other sign", false, &[BODY + 5], None),
    (ABDUCTION, false, &[0, 3, 6, 9], None),
];

const RIGHT_ANGLE: &str = "with body x and y turned by a right angle";
const BOTH: &str = "with body x and y of the other sign";
const XYZW: &str = "with the quaternion in the order xyzw instead of wxyz";
const WXYZ: &str = "with the quaternion in the order wxyz instead of xyzw";
/// Other readings of the body's position if its attitude is right, and of the attitude.
const PLACES: [Reading; 8] = [
    ("with body x of the other sign", false, &[BODY], None),
    ("with body y of the other sign", false, &[BODY + 1], None),
    ("with body x and y exchanged", true, &[], None),
    (BOTH, false, &[BODY, BODY + 1], None),
    (RIGHT_ANGLE, true, &[BODY + 1], None),
    (RIGHT_ANGLE, true, &[BODY], None),
    (XYZW, false, &[], Some([3, 0, 1, 2])),
    (WXYZ, false, &[], Some([1, 2, 3, 0])),
];

fn read_otherwise(x: &mut State, (_, exchanged, negated, elements): Reading) {
    if exchanged {
        x.swap(BODY, BODY + 1);
    }
    negated.iter().for_each(|&i| x[i] = -x[i]);
    if let Some(elements) = elements {
        let about =
            |axis: usize| UnitQuaternion::from_scaled_axis(Vector3::ith(axis, x[BODY + 3 + axis]));
        let read = about(2) * about(1) * about(0);
        let read = [read.w, read.i, read.j, read.k];
        let meant = DMatrix::from_iterator(4, 1, elements.map(|element| read[element]));
        x[BODY + 3..].copy_from_slice(angles_of_quaternions(&meant).as_slice());
    }
}

/// The other reading of the body's place or attitude under which feet stay best, m, and whether of the attitude.
pub(super) fn best_other_place(recording: &Recording, robot: &Robot) -> Option<(f64, Reading)> {
    let judged = PLACES.map(|reading| (Slip::read(recording, robot, reading).rms_m(), reading));
    best(judged.into_iter())
}

/// The other order of legs or sign under which feet stay best in place against each other, and their slip, m.
pub(super) fn best_other_reading(recording: &Recording, robot: &Robot) -> Option<(f64, String)> {
    let of_segment = |segment| Stances::of(segment, robot, AS_RECORDED, &Leg::ALL);
    let all: Vec<Stances> = recording.segments.iter().map(of_segment).collect();
    let orders = orders().into_iter().filter(|order| *order != Leg::ALL);
    let of_orders = orders.map(|order| {
        let mut slip = Slip::default();
        all.iter()
            .for_each(|stances| stances.add_to(&mut slip, &order));
        let names = order.map(Leg::short_name).join(", ");
        let words = format!("with the joints of fr, fl, rr, rl read from {names}");
        (slip.relative_rms_m(), words)
    });
    let of_signs = SIGNS.map(|reading| {
        let slip = Slip::read(recording, robot, reading);
        (slip.relative_rms_m(), reading.0.to_owned())
    });
    best(of_orders.chain(of_signs))
}

fn best<T>(judged: impl Iterator<Item = (Option<f64>, T)>) -> Option<(f64, T)> {
    let finite =
        |(rms_m, reading): (Option<f64>, T)| Some((rms_m.filter(|m| m.is_finite())?, reading));
    let finite = judged.filter_map(finite);
    finite.min_by(|one, other| one.0.total_cmp(&other.0))
}

pub(super) fn orders() -> Vec<[Leg; FOOT_DIM]> {
    let digit = |code: usize, place: usize| Leg::ALL[code / FOOT_DIM.pow(place as u32) % FOOT_DIM];
    let codes = 0..FOOT_DIM.pow(FOOT_DIM as u32);
    let all = codes.map(|code| std::array::from_fn(|place| digit(code, place)));
    all.filter(|legs| Leg::ALL.iter().all(|leg| legs.contains(leg)))
        .collect()
}

/// Place of a leg's foot in the world, m, in a state `x`; with `rolled`, without the distance that the foot's sphere
/// has rolled.
pub(crate) fn foot_place(robot: &Robot, leg: Leg, x: &State, rolled: bool) -> Vector3<f64> {
    let place = robot.foot_in_world(leg, x);
    if !rolled {
        return place;
    }
    let first = 3 * leg.index();
    let [pitch, yaw] = [4, 5].map(|i| x[JOINT_DIM + i]);
    let inclination = pitch + x[first + 1] + x[first + 2];
    place - FOOT_RADIUS_M * inclination * Vector3::new(yaw.cos(), yaw.sin(), 0.0)
}

/// Squared distances of feet from their stance positions, of each foot and between feet, and their number.
#[derive(Default)]
pub(super) struct Slip {
    absolute: (f64, usize),
    relative: (f64, usize),
}

impl Slip {
    pub(crate) fn of(recording: &Recording, robot: &Robot) -> Self {
        Self::read(recording, robot, AS_RECORDED)
    }

    /// The same if the columns are read otherwise; orders of legs are not.
    fn read(recording: &Recording, robot: &Robot, reading: Reading) -> Self {
        let mut slip = Self::default();
        for segment in &recording.segments {
            Stances::of(segment, robot, reading, &[]).add_to(&mut slip, &Leg::ALL);
        }
        slip
    }

    /// Root mean square of places about the median of their stance, m; none for fewer than [`LEAST_SAMPLES`].
    pub(crate) fn rms_m(&self) -> Option<f64> {
        root_mean(self.absolute)
    }

    pub(crate) fn relative_rms_m(&self) -> Option<f64> {
        root_mean(self.relative)
    }
}

/// Geometric mean over the stances of the feet of how far each moves, a root mean square in m; none without stances. A
/// landing in which feet slide then weighs no more than a stance in which they stay.
pub(crate) fn foot_slip_m(segment: &Segment, robot: &Robot) -> Option<f64> {
    let all = stances(segment).into_iter().map(|(leg, samples)| {
        let place = |sample| foot_place(robot, leg, &segment.state(sample), true);
        let places: Vec<Vector3<f64>> = samples.map(place).collect();
        let stands = median_place(&places);
        let squares = places.iter().map(|place| (place - stands).norm_squared());
        squares.sum::<f64>() / places.len() as f64
    });
    let logarithms: Vec<f64> = all.map(|square| 0.5 * square.max(1e-12).ln()).collect();
    let sum: f64 = logarithms.iter().sum();
    (!logarithms.is_empty()).then(|| (sum / logarithms.len() as f64).exp())
}

/// Sample, leg, leg whose columns are read, place of the foot about the median of the stance, m.
struct Stances(Vec<(usize, Leg, Leg, Vector3<f64>)>);

impl Stances {
    /// In a reading of the columns; each leg is read from its own columns and from those of `others`.
    fn of(segment: &Segment, robot: &Robot, reading: Reading, others: &[Leg]) -> Self {
        let mut moved = Vec::new();
        for (leg, samples) in stances(segment) {
            let others = others.iter().copied().filter(|other| *other != leg);
            for from in std::iter::once(leg).chain(others) {
                let place = |sample: usize| {
                    let mut x = segment.state(sample);
                    read_otherwise(&mut x, reading);
                    let q = from.of_joints(&std::array::from_fn(|joint| x[joint]));
                    x[3 * leg.index()..][..3].copy_from_slice(&q);
                    foot_place(robot, leg, &x, true)
                };
                let places: Vec<Vector3<f64>> = samples.clone().map(place).collect();
                let stands = median_place(&places);
                let about = samples.clone().zip(places);
                moved.extend(about.map(|(sample, place)| (sample, leg, from, place - stands)));
            }
        }
        moved.sort_by_key(|(sample, ..)| *sample);
        Self(moved)
    }

    fn add_to(&self, slip: &mut Slip, order: &[Leg; FOOT_DIM]) {
        let mut standing = Vec::with_capacity(FOOT_DIM);
        for feet in self.0.chunk_by(|one, other| one.0 == other.0) {
            standing.clear();
            let chosen = (feet.iter()).filter(|(_, leg, from, _)| order[leg.index()] == *from);
            standing.extend(chosen.map(|(.., place)| *place));
            let common = standing.iter().sum::<Vector3<f64>>() / standing.len() as f64;
            for place in &standing {
                slip.absolute.0 += place.norm_squared();
                slip.absolute.1 += 1;
                if standing.len() > 1 {
                    slip.relative.0 += (place - common).norm_squared();
                    slip.relative.1 += 1;
                }
            }
        }
    }
}

pub(crate) fn median_place(places: &[Vector3<f64>]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| median(places.iter().map(|place| place[axis])))
}

fn root_mean((sum, count): (f64, usize)) -> Option<f64> {
    (count >= LEAST_SAMPLES).then(|| (sum / count as f64).sqrt())
}

/// Each foot's times on the ground without their edges.
pub(crate) fn stances(segment: &Segment) -> Vec<(Leg, Range<usize>)> {
    let step_s = segment.mean_step_s();
    if step_s <= 0.0 {
        return Vec::new();
    }
    let samples_in = |time_s: f64| (time_s / step_s).round() as usize;
    let mut out = Vec::new();
    for leg in Leg::ALL {
        let down = |sample: usize| segment.feet[sample][leg.index()];
        for stretch in stretches(0..segment.len(), |a, b| down(a) == down(b)) {
            let count = stretch.len();
            if down(stretch.start) && count >= samples_in(LEAST_STANCE_S).max(2) {
                let edge = samples_in(EDGE_S).min(count / 8);
                out.push((leg, stretch.start + edge..stretch.end - edge));
            }
        }
    }
    out
}

const LEAST_S: f64 = 0.04; // shortest flight, and shortest time on the ground in all, that counts, s
const LEAST_FORCE: f64 = 0.02; // of a foot whose hip's torque is compared with it, as a share of the weight

/// Metrics of forces and accelerations of a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Balance {
    /// Mean vertical acceleration in flight, upwards, m/s^2.
    pub fall_m_s2: Option<f64>,
    /// The same by the heights alone, the median over the flights.
    #[serde(skip)]
    pub fall_by_height_m_s2: Option<f64>,
    /// Impulse of the feet over the impulse for the robot's weight and change of velocity.
    pub weight_share: Option<f64>,
    /// Slope of each hip's torque over its lever times the force along the leg; 1 for a force in the leg's plane.
    pub hip_share: [Option<f64>; FOOT_DIM],
    /// Largest median difference of the body's acceleration and the slope of its velocity, m/s^2, after its axis.
    #[serde(serialize_with = "without_axis")]
    pub acceleration_offset_m_s2: Option<(&'static str, f64)>,
}

#[derive(Default)]
struct Sums {
    flight: (f64, f64),           // change of velocity and time in flight
    ground: (f64, f64, f64),      // impulse of the feet, impulse that is needed, time
    hips: [(f64, f64); FOOT_DIM], // products of torque and lever, squares of the lever
}

impl Balance {
    /// Over all segments of a recording; torques beyond the robot's limits count as the limits.
    pub fn of(recording: &Recording, robot: &Robot) -> Self {
        let mut sums = Sums::default();
        let mut falls = Vec::new();
        for segment in &recording.segments {
            sums.add(segment, robot);
            falls.extend(falls_of(segment));
        }
        let (dv, flight_s) = sums.flight;
        let (impulse, needed, ground_s) = sums.ground;
        let share = |(product, square): (f64, f64)| (square > 0.0).then(|| product / square);
        Self {
            fall_m_s2: (flight_s >= LEAST_S).then(|| dv / flight_s),
            fall_by_height_m_s2: (!falls.is_empty()).then(|| median(falls.into_iter())),
            weight_share: (ground_s >= LEAST_S && needed > 0.0).then(|| impulse / needed),
            hip_share: sums.hips.map(share),
            acceleration_offset_m_s2: acceleration_offset(recording),
        }
    }
}

impl Sums {
    fn add(&mut self, segment: &Segment, robot: &Robot) {
        let samples = 0..segment.len();
        let upwards = samples.map(|sample| self.add_forces(segment, robot, sample).z);
        let upwards: Vec<f64> = upwards.collect();
        let time_s = &segment.time_s;
        for (run, is_grounded) in segment.contacts() {
            let (start, end) = (run.start, run.end - 1);
            let dv = segment.dx[(BODY_Z, end)] - segment.dx[(BODY_Z, start)];
            let impulse = |s| 0.5 * (time_s[s + 1] - time_s[s]) * (upwards[s] + upwards[s + 1]);
            let time_s = time_s[end] - time_s[start];
            if is_grounded {
                self.ground.0 += (start..end).map(impulse).sum::<f64>();
                self.ground.1 += weight_n(robot.mass_kg()) * time_s + robot.mass_kg() * dv;
                self.ground.2 += time_s;
            } else if time_s >= LEAST_S {
                self.flight.0 += dv;
                self.flight.1 += time_s;
            }
        }
    }

    /// Adds a sample's hips, and returns the force of its feet on the body in the world, N.
    fn add_forces(&mut self, segment: &Segment, robot: &Robot, sample: usize) -> Vector3<f64> {
        let (joints, torque) = (segment.joints(sample), segment.torque(sample));
        let limits = robot.torque_limit_nm();
        let torque = std::array::from_fn(|i| torque[i].clamp(-limits[i], limits[i]));
        let mut sum = Vector3::zeros();
        for leg in Leg::ALL {
            let q = leg.of_joints(&joints);
            let tau = leg.of_joints(&torque);
            let map = robot.damped_force_map(leg, &q).ok();
            let Some(map) = map.filter(|_| segment.feet[sample][leg.index()]) else {
                continue;
            };
            let force = map * Vector3::from(tau);
            sum += force;
            let lever = hip_torque(robot, leg, &q, &force);
            let hip_m = robot.geometry(leg).links().hip.norm();
            let least = LEAST_FORCE * weight_n(robot.mass_kg()) * hip_m;
            if lever.abs() > least {
                let (product, square) = &mut self.hips[leg.index()];
                *product += tau[0] * lever;
                *square += lever * lever;
            }
        }
        let [roll, pitch, yaw] = std::array::from_fn(|i| segment.x[(JOINT_DIM + 3 + i, sample)]);
        rotation([roll, pitch, yaw]) * sum
    }
}

const CARRYING_S: f64 = 0.04; // window over which forces are compared with the required ones, s
const CARRIED: f64 = 0.25; // share of it below which torques do not carry the robot
const NEEDED: f64 = 1.0; // share of the weight from which a window needs forces

/// Times, s, of a segment in which feet are on the ground and forces by the torques are less than [`CARRIED`] of the
/// force for weight and change of velocity.
pub(super) fn uncarried(segment: &Segment, robot: &Robot) -> Vec<Range<f64>> {
    let (time_s, n) = (&segment.time_s, segment.len());
    let (weight, mass) = (weight_n(robot.mass_kg()), robot.mass_kg());
    let mut sums = Sums::default();
    let upwards = (0..n).map(|sample| sums.add_forces(segment, robot, sample).z);
    let mut impulse = vec![0.0];
    for (pair, h) in upwards
        .collect::<Vec<_>>()
        .windows(2)
        .zip(time_s.windows(2))
    {
        let last = impulse[impulse.len() - 1];
        impulse.push(last + 0.5 * (h[1] - h[0]) * (pair[0] + pair[1]));
    }
    let mut out: Vec<Range<f64>> = Vec::new();
    for (stretch, _) in segment.contacts().into_iter().filter(|(_, down)| *down) {
        for start in stretch.clone() {
            let end = time_s.partition_point(|time| *time < time_s[start] + CARRYING_S - 1e-9);
            if end >= stretch.end {
                break;
            }
            let duration_s = time_s[end] - time_s[start];
            let dv = segment.dx[(BODY_Z, end)] - segment.dx[(BODY_Z, start)];
            let needed = weight * duration_s + mass * dv;
            let is_needed = needed > NEEDED * weight * duration_s;
            if !is_needed || impulse[end] - impulse[start] >= CARRIED * needed {
                continue;
            }
            match out.last_mut() {
                Some(open) if open.end >= time_s[start] => open.end = time_s[end],
                _ => out.push(time_s[start]..time_s[end]),
            }
        }
    }
    out
}

/// Torque of a hip's abduction that holds the part of a foot's force (body axes, N) in the plane of the leg.
pub(crate) fn hip_torque(robot: &Robot, leg: Leg, q: &[f64; 3], force: &Vector3<f64>) -> f64 {
    let links = robot.geometry(leg).links();
    let axis = Unit::new_normalize(links.abduction);
    let normal = Rotation3::from_axis_angle(&axis, q[0]) * links.flexion;
    let in_plane = force - normal * normal.dot(force);
    -robot
        .geometry(leg)
        .foot_jacobian(q)
        .column(0)
        .dot(&in_plane)
}

/// Vertical acceleration of each flight by a parabola through its heights.
pub(crate) fn falls_of(segment: &Segment) -> Vec<f64> {
    let flights = (segment.contacts().into_iter()).filter(|(_, is_grounded)| !is_grounded);
    let fall = |(run, _): (Range<usize>, bool)| {
        let (start, end) = (segment.time_s[run.start], segment.time_s[run.end - 1]);
        let (middle, length) = (0.5 * (start + end), end - start);
        let (mut matrix, mut side) = (Matrix3::zeros(), Vector3::zeros());
        for sample in run {
            let t = segment.time_s[sample] - middle;
            let powers = Vector3::new(1.0, t, 0.5 * t * t);
            matrix += powers * powers.transpose();
            side += powers * segment.x[(BODY_Z, sample)];
        }
        let solved = (length >= LEAST_S).then(|| matrix.lu().solve(&side));
        solved.flatten().map(|solution| solution[2])
    };
    flights.filter_map(fall).collect()
}

fn without_axis<S: Serializer>(offset: &Option<(&str, f64)>, out: S) -> Result<S::Ok, S::Error> {
    offset.map(|(_, value)| value).serialize(out)
}

fn acceleration_offset(recording: &Recording) -> Option<(&'static str, f64)> {
    let segments = recording.segments.iter();
    let off = segments.map(|segment| &segment.ddx - differences(&segment.time_s, &segment.dx));
    let off: Vec<DMatrix<f64>> = off.collect();
    let of_axis = |axis: usize| {
        let rows = off.iter().map(|off| off.row(JOINT_DIM + axis));
        let values = rows.flat_map(|row| row.into_iter().copied());
        (BODY_NAMES[axis], median(values))
    };
    let axes = (0..3).map(of_axis);
    axes.max_by(|one, other| one.1.abs().total_cmp(&other.1.abs()))
}
