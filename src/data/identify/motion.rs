//! Directions of trunk and legs in the world along a segment, and their accelerations.
//!
//! World axes are those of the recorded body position: z up. Attitudes are roll, pitch, yaw with `R = Rz Ry Rx`.
//! Velocities of directions follow from the recorded rates; accelerations are differences of velocities, those of the
//! recording included, so that all carry the same errors.

use nalgebra::{DMatrix, Matrix3, Rotation3, Unit, Vector3};

use crate::recording::Segment;
use crate::recording::preprocess::differences;
use crate::robot::{JOINT_DIM, Leg, LegLinks, Robot};

/// Directions of a leg in the world, or their derivatives: from the axis of abduction to the plane of the leg (side),
/// from hip to knee (thigh), from knee to foot (calf), in front of the thigh, in front of the calf. The equations'
/// moments of a leg have this order.
pub(crate) type Directions = [Vector3<f64>; 5];

/// Axes and directions of one leg in the world, unit vectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegFrame {
    /// Axis of abduction.
    pub abduction: Vector3<f64>,
    /// Axis of flexion and of the knee.
    pub flexion: Vector3<f64>,
    /// Where its parts are.
    pub directions: Directions,
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
const LEG_ROWS: usize = 15; // rows of a leg there

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
            let of = |m: &DMatrix<f64>| std::array::from_fn(|i| m[(JOINT_DIM + 3 + i, sample)]);
            let [roll, pitch, yaw] = of(&segment.x);
            let [droll, dpitch, dyaw] = of(&segment.dx);
            let heading = Rotation3::from_axis_angle(&Vector3::z_axis(), yaw);
            let inclined = heading * Rotation3::from_axis_angle(&Vector3::y_axis(), pitch);
            let trunk = inclined * Rotation3::from_axis_angle(&Vector3::x_axis(), roll);
            let attitude = trunk.into_inner();
            let rate = inclined * Vector3::x() * droll
                + heading * Vector3::y() * dpitch
                + Vector3::z() * dyaw;
            let mut put = |row: usize, velocity: Vector3<f64>| {
                (rates.fixed_view_mut::<3, 1>(row, sample)).copy_from(&velocity);
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
    pub(crate) fn body(&self, sample: usize) -> Vector3<f64> {
        let rows = self.coordinates.fixed_view::<3, 1>(JOINT_DIM, sample);
        rows.into_owned()
    }

    pub(crate) fn trunk_axis(&self, axis: usize, sample: usize) -> Vector3<f64> {
        self.direction(3 * axis, sample)
    }

    /// Second derivatives of a leg's directions, 1/s^2.
    pub(crate) fn leg(&self, leg: Leg, sample: usize) -> Directions {
        let first = TRUNK_ROWS + LEG_ROWS * leg.index();
        let of = |row| self.direction(first + row, sample);
        [of(0), of(3), of(6), of(9), of(12)]
    }

    #[inline]
    fn direction(&self, row: usize, sample: usize) -> Vector3<f64> {
        self.directions.fixed_view::<3, 1>(row, sample).into_owned()
    }
}

fn leg_frame(
    attitude: &Matrix3<f64>,
    rate: &Vector3<f64>,
    links: &LegLinks,
    q: &[f64; 3],
    dq: &[f64; 3],
) -> (LegFrame, Directions) {
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
        flexion: hip * links.flexion,
        directions: [
            hip * along_hip,
            thigh * along_thigh,
            calf * along_calf,
            thigh * along_thigh.cross(&to_the_left),
            calf * along_calf.cross(&to_the_left),
        ],
    };
    let hip_rate = rate + frame.abduction * dq[0];
    let thigh_rate = hip_rate + frame.flexion * dq[1];
    let calf_rate = thigh_rate + frame.flexion * dq[2];
    let rates = [hip_rate, thigh_rate, calf_rate, thigh_rate, calf_rate];
    let velocities = std::array::from_fn(|i| rates[i].cross(&frame.directions[i]));
    (frame, velocities)
}
