//! Forces against weight and acceleration, falling in flight, hips' torques against the side they hold.

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use serde::{Serialize, Serializer};

use super::weight_n;
use crate::recording::preprocess::{differences, median};
use crate::recording::{Recording, Segment};
use crate::robot::input_rule::rotation;
use crate::robot::{BODY_NAMES, BODY_Z, FOOT_DIM, JOINT_DIM, Leg, Robot};

const HEIGHT: usize = BODY_Z;
/// Shortest flight, and shortest time on the ground in all, that counts, s.
const LEAST_S: f64 = 0.04;
/// Least force of a foot that counts where a hip's torque is compared with it, as a share of the weight.
const LEAST_FORCE: f64 = 0.02;

/// What forces and accelerations of a recording come to.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Balance {
    /// Mean vertical acceleration in flight, upwards, m/s^2.
    pub fall_m_s2: Option<f64>,
    /// The same by the heights alone, the median over the flights.
    #[serde(skip)]
    pub fall_by_height_m_s2: Option<f64>,
    /// Impulse of the feet over what the robot's weight and change of velocity need.
    pub weight_share: Option<f64>,
    /// Slope of each hip's abduction torque over its lever times the force along the leg; 1 for a force in the plane of
    /// the leg.
    pub hip_share: [Option<f64>; FOOT_DIM],
    /// Largest median difference of the body's acceleration and the slope of its velocity, m/s^2, after its axis.
    #[serde(serialize_with = "without_axis")]
    pub acceleration_offset_m_s2: Option<(&'static str, f64)>,
}

#[derive(Debug, Clone, Copy, Default)]
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
        Self {
            fall_m_s2: (flight_s >= LEAST_S).then(|| dv / flight_s),
            fall_by_height_m_s2: (!falls.is_empty()).then(|| median(falls.into_iter())),
            weight_share: (ground_s >= LEAST_S && needed > 0.0).then(|| impulse / needed),
            hip_share: (sums.hips)
                .map(|(product, square)| (square > 0.0).then(|| product / square)),
            acceleration_offset_m_s2: acceleration_offset(recording),
        }
    }
}

impl Sums {
    fn add(&mut self, segment: &Segment, robot: &Robot) {
        let samples = 0..segment.len();
        let forces = samples.map(|sample| self.add_forces(segment, robot, sample));
        let forces: Vec<Vector3<f64>> = forces.collect();
        for (run, is_grounded) in segment.contacts() {
            let (start, end) = (run.start, run.end - 1);
            let time_s = segment.time_s[end] - segment.time_s[start];
            let dv = segment.dx[(HEIGHT, end)] - segment.dx[(HEIGHT, start)];
            if is_grounded {
                let between = (start..end).map(|s| {
                    let step_s = segment.time_s[s + 1] - segment.time_s[s];
                    0.5 * step_s * (forces[s].z + forces[s + 1].z)
                });
                self.ground.0 += between.sum::<f64>();
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

/// Torque of a hip's abduction that holds the part of a foot's force (body axes, N) in the plane of the leg: its lever
/// is the distance of the plane from the axis of abduction.
pub(in crate::recording) fn hip_torque(
    robot: &Robot,
    leg: Leg,
    q: &[f64; 3],
    force: &Vector3<f64>,
) -> f64 {
    let links = robot.geometry(leg).links();
    let axis = Unit::new_normalize(links.abduction);
    let normal = Rotation3::from_axis_angle(&axis, q[0]) * links.flexion;
    let in_plane = force - normal * normal.dot(force);
    -robot.foot_jacobian(leg, q).column(0).dot(&in_plane)
}

/// Vertical acceleration of each flight by a parabola through its heights.
fn falls_of(segment: &Segment) -> Vec<f64> {
    let flights = (segment.contacts().into_iter()).filter(|(_, is_grounded)| !is_grounded);
    let fall = |(run, _): (std::ops::Range<usize>, bool)| {
        let middle = 0.5 * (segment.time_s[run.start] + segment.time_s[run.end - 1]);
        let length = segment.time_s[run.end - 1] - segment.time_s[run.start];
        let (mut matrix, mut side) = (Matrix3::zeros(), Vector3::zeros());
        for sample in run {
            let t = segment.time_s[sample] - middle;
            let powers = Vector3::new(1.0, t, 0.5 * t * t);
            matrix += powers * powers.transpose();
            side += powers * segment.x[(HEIGHT, sample)];
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
    let slopes = segments.map(|segment| differences(&segment.time_s, &segment.dx));
    let slopes: Vec<_> = slopes.collect();
    let of_axis = |axis: usize| {
        let row = JOINT_DIM + axis;
        let pairs = recording.segments.iter().zip(&slopes);
        median(pairs.flat_map(|(segment, slopes)| {
            (0..segment.len()).map(move |s| segment.ddx[(row, s)] - slopes[(row, s)])
        }))
    };
    (0..3)
        .map(|axis| (BODY_NAMES[axis], of_axis(axis)))
        .max_by(|one, other| one.1.abs().total_cmp(&other.1.abs()))
}
