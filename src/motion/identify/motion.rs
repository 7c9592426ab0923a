//! Directions of trunk and legs in the world along a segment, and their accelerations.
//!
//! World axes are those of the recorded body position: z up. Attitudes are roll, pitch, yaw with
//! `R = Rz Ry Rx`. Velocities of directions follow from the recorded rates; accelerations are
//! differences of velocities, those of the recording included, so that all carry the same errors.

use nalgebra::{DMatrix, Matrix3, Rotation3, Unit, Vector3};

use crate::recording::Segment;
use crate::recording::preprocess::differences;
use crate::robot::{JOINT_DIM, Leg, LegLinks, Robot};

/// Directions of one leg in the world, unit vectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegFrame {
    /// Axis of abduction.
    pub abduction: Vector3<f64>,
    /// From the axis of abduction to the plane of the leg.
    pub side: Vector3<f64>,
    /// From hip to knee.
    pub thigh: Vector3<f64>,
    /// From knee to foot.
    pub calf: Vector3<f64>,
    /// In front of the thigh.
    pub thigh_front: Vector3<f64>,
    /// In front of the calf.
    pub calf_front: Vector3<f64>,
    /// Axis of flexion and of the knee.
    pub flexion: Vector3<f64>,
}

/// Second derivatives of a leg's directions, 1/s^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegAcceleration {
    /// Of [`LegFrame::side`].
    pub side: Vector3<f64>,
    /// Of [`LegFrame::thigh`].
    pub thigh: Vector3<f64>,
    /// Of [`LegFrame::calf`].
    pub calf: Vector3<f64>,
    /// Of [`LegFrame::thigh_front`].
    pub thigh_front: Vector3<f64>,
    /// Of [`LegFrame::calf_front`].
    pub calf_front: Vector3<f64>,
}

/// Directions of a segment and all accelerations.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Trunk to world, one a sample.
    pub attitude: Vec<Matrix3<f64>>,
    /// Angular velocity of the trunk in the world, rad/s.
    pub trunk_rate: Vec<Vector3<f64>>,
    /// Legs in the order of [`Leg::ALL`].
    pub legs: Vec<[LegFrame; 4]>,
    /// Accelerations of the recorded coordinates, 18 x n, per s^2.
    pub coordinates: DMatrix<f64>,
    /// Of trunk axes (9 rows), then of each leg's five directions, 69 x n.
    directions: DMatrix<f64>,
}

/// Rows of the trunk's axes in [`Motion::directions`].
const TRUNK_ROWS: usize = 9;
/// Rows of a leg there.
const LEG_ROWS: usize = 15;

impl Motion {
    /// The motion of a robot's segment of at least two samples.
    pub fn of(segment: &Segment, robot: &Robot) -> Self {
        let links = Leg::ALL.map(|leg| robot.geometry(leg).links());
        let n = segment.len();
        let mut motion = Self {
            attitude: Vec::with_capacity(n),
            trunk_rate: Vec::with_capacity(n),
            legs: Vec::with_capacity(n),
            coordinates: differences(&segment.time_s, &segment.dx),
            directions: DMatrix::zeros(0, 0),
        };
        let mut rates = DMatrix::zeros(TRUNK_ROWS + 4 * LEG_ROWS, n);
        for sample in 0..n {
            let [roll, pitch, yaw] =
                std::array::from_fn(|i| segment.x[(JOINT_DIM + 3 + i, sample)]);
            let [droll, dpitch, dyaw] =
                std::array::from_fn(|i| segment.dx[(JOINT_DIM + 3 + i, sample)]);
            let heading = Rotation3::from_axis_angle(&Vector3::z_axis(), yaw);
            let inclined = heading * Rotation3::from_axis_angle(&Vector3::y_axis(), pitch);
            let trunk = inclined * Rotation3::from_axis_angle(&Vector3::x_axis(), roll);
            let attitude = trunk.into_inner();
            let rate = inclined * Vector3::x() * droll
                + heading * Vector3::y() * dpitch
                + Vector3::z() * dyaw;
            let mut put = |row: usize, velocity: Vector3<f64>| {
                rates
                    .fixed_view_mut::<3, 1>(row, sample)
                    .copy_from(&velocity);
            };
            for axis in 0..3 {
                put(3 * axis, rate.cross(&attitude.column(axis)));
            }
            let legs = Leg::ALL.map(|leg| {
                let q = leg.of_joints(&segment.joints(sample));
                let first = 3 * leg.index();
                let dq: [f64; 3] = std::array::from_fn(|i| segment.dx[(first + i, sample)]);
                let (frame, velocities) = leg_frame(&attitude, &rate, &links[leg.index()], &q, &dq);
                for (place, velocity) in velocities.into_iter().enumerate() {
                    put(TRUNK_ROWS + LEG_ROWS * leg.index() + 3 * place, velocity);
                }
                frame
            });
            motion.attitude.push(attitude);
            motion.trunk_rate.push(rate);
            motion.legs.push(legs);
        }
        motion.directions = differences(&segment.time_s, &rates);
        motion
    }

    /// Acceleration of the trunk's origin, m/s^2.
    pub fn body(&self, sample: usize) -> Vector3<f64> {
        self.coordinates
            .fixed_view::<3, 1>(JOINT_DIM, sample)
            .into_owned()
    }

    /// Second derivative of a trunk axis (0 x, 1 y, 2 z), 1/s^2.
    pub fn trunk_axis(&self, axis: usize, sample: usize) -> Vector3<f64> {
        self.directions
            .fixed_view::<3, 1>(3 * axis, sample)
            .into_owned()
    }

    /// Second derivatives of a leg's directions.
    pub fn leg(&self, leg: Leg, sample: usize) -> LegAcceleration {
        let first = TRUNK_ROWS + LEG_ROWS * leg.index();
        let of = |place: usize| {
            self.directions
                .fixed_view::<3, 1>(first + 3 * place, sample)
                .into_owned()
        };
        LegAcceleration {
            side: of(0),
            thigh: of(1),
            calf: of(2),
            thigh_front: of(3),
            calf_front: of(4),
        }
    }
}

/// A leg's directions, and the velocities of those that [`LegAcceleration`] has, in its order.
fn leg_frame(
    attitude: &Matrix3<f64>,
    rate: &Vector3<f64>,
    links: &LegLinks,
    q: &[f64; 3],
    dq: &[f64; 3],
) -> (LegFrame, [Vector3<f64>; 5]) {
    let turn =
        |axis, angle| Rotation3::from_axis_angle(&Unit::new_unchecked(axis), angle).into_inner();
    let hip = attitude * turn(links.abduction, q[0]);
    let thigh = hip * turn(links.flexion, q[1]);
    let calf = thigh * turn(links.flexion, q[2]);
    let [along_hip, along_thigh, along_calf] = [links.hip, links.thigh, links.calf]
        .map(|link| link.try_normalize(0.0).unwrap_or_default());
    // The body's front, whichever way the axis of a leg turns: the four legs share what is in front of their links.
    let to_the_left = links.flexion * links.flexion.y.signum();
    let frame = LegFrame {
        abduction: attitude * links.abduction,
        side: hip * along_hip,
        thigh: thigh * along_thigh,
        calf: calf * along_calf,
        thigh_front: thigh * along_thigh.cross(&to_the_left),
        calf_front: calf * along_calf.cross(&to_the_left),
        flexion: hip * links.flexion,
    };
    let hip_rate = rate + frame.abduction * dq[0];
    let thigh_rate = hip_rate + frame.flexion * dq[1];
    let calf_rate = thigh_rate + frame.flexion * dq[2];
    let velocities = [
        hip_rate.cross(&frame.side),
        thigh_rate.cross(&frame.thigh),
        calf_rate.cross(&frame.calf),
        thigh_rate.cross(&frame.thigh_front),
        calf_rate.cross(&frame.calf_front),
    ];
    (frame, velocities)
}
