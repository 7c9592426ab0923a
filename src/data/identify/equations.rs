//! The linear equations between motion and torques at every sample of a segment. They use directions of trunk and legs
//! in the world: axes of the recorded body position, z up, attitudes roll, pitch, yaw with `R = Rz Ry Rx`. Velocities
//! of directions follow from the recorded rates. Accelerations are differences of velocities, also instead of recorded
//! ones, so that all have the same errors.
//!
//! With `m` the mass, `p` the trunk's origin, `e` directions of trunk and links (second derivatives `e''`) and `s_e`
//! their first moments, Newton's law for the whole robot is `p'' = -g e_z + 1/m (sum_k F_k - sum_e s_e e'')`. A foot on
//! the ground pushes with `F_k = -J_k^-T (tau_k - losses - Y_k pi + contact)`. `Y_k pi` are the torques that move the
//! leg's own links (first and second moments `pi`, linear). `contact` is the torque of a foot of radius `r` that rolls
//! with resistance `rho`. A leg in the air obeys `tau_k = losses + Y_k pi`, joint by joint. All unknowns enter
//! linearly. Torques are evaluated one delay later; the coefficient of a column of their rates is the error of that
//! delay.

use super::parameters::{CALF_FRONT, FOOT_RADIUS, ROLLING, THIGH_FRONT, TRUNK_FORWARD, TRUNK_UP};
use super::*;
use crate::recording::preprocess::differences;

pub(crate) const LEAST_MANIPULABILITY: f64 = 0.04;
const ROLLING_SPEED_RAD_S: f64 = 0.05;
pub(crate) const BODY_ROWS: usize = PARAMETER_DIM + 1;
pub(crate) const JOINT_ROWS: usize = 12;

/// The unknowns of a joint's equation, in the order of its rows; the left side follows.
pub(crate) fn joint_unknowns(kind: usize) -> [usize; JOINT_ROWS - 1] {
    let mut unknowns = [DELAY; JOINT_ROWS - 1];
    let losses = [VISCOUS + kind, DRY + kind, ARMATURE + kind];
    unknowns[..losses.len()].copy_from_slice(&losses);
    unknowns[losses.len()..][..OWN.len()].copy_from_slice(&OWN);
    unknowns
}

#[derive(Debug, Clone)]
pub(crate) struct SampleEquations {
    pub body: DMatrix<f64>, // axes x, y, z one below the other, [`BODY_ROWS`] each: the trunk's acceleration, m/s^2
    pub joints: DMatrix<f64>, // twelve joints one below the other, [`JOINT_ROWS`] each: torque, N m; hold in the air
    pub singular: Vec<bool>,
    pub clipped_torques: usize,
}

impl SampleEquations {
    /// Torques run `delay_s` ahead of the motion; `gravity_m_s2` is used only for the weight of the links of a leg.
    pub(crate) fn of(
        segment: &Segment,
        motion: &Motion,
        robot: &Robot,
        gravity_m_s2: f64,
        delay_s: f64,
    ) -> Self {
        let n = segment.len();
        let recorded = segment.torque_within_limits(robot);
        let pairs = recorded.iter().zip(segment.torque_nm.iter());
        let clipped_torques = pairs.filter(|(kept, all)| all.abs() > kept.abs()).count();
        let torque = delayed(&segment.time_s, &recorded, delay_s);
        let torque_rate = differences(&segment.time_s, &torque);
        let mut equations = Self {
            body: DMatrix::zeros(3 * BODY_ROWS, n),
            joints: DMatrix::zeros(JOINT_DIM * JOINT_ROWS, n),
            singular: vec![false; n],
            clipped_torques,
        };
        for sample in 0..n {
            let mut body = BodyEquation([[0.0; BODY_ROWS]; 3]);
            body.subtract(GRAVITY, &Vector3::z());
            body.subtract(TRUNK_FORWARD, &motion.trunk_axis(0, sample));
            body.subtract(TRUNK_UP, &motion.trunk_axis(2, sample));
            body.add(PARAMETER_DIM, motion.body(sample));
            for leg in Leg::ALL {
                let first = LEG_JOINT_DIM * leg.index();
                let of = |m: &DMatrix<f64>| m.fixed_view::<3, 1>(first, sample).into_owned();
                let state = LegSample {
                    frame: motion.legs[sample][leg.index()],
                    trunk_rate: motion.trunk_rate[sample],
                    rate: of(&segment.dx),
                    acceleration: of(&motion.coordinates),
                    torque: of(&torque),
                    torque_rate: of(&torque_rate),
                    own: motion.own_torques(leg, sample, gravity_m_s2),
                };
                for (moment, direction) in MOMENTS.into_iter().zip(&motion.leg(leg, sample)) {
                    body.subtract(moment, direction);
                }
                if segment.feet[sample][leg.index()] {
                    match &motion.force_maps[sample][leg.index()] {
                        Some(map) => body.add_foot(&state, map),
                        None => equations.singular[sample] = true,
                    }
                }
                for kind in 0..LEG_JOINT_DIM {
                    let row = (first + kind) * JOINT_ROWS;
                    let joints = &mut equations.joints;
                    (joints.fixed_view_mut::<JOINT_ROWS, 1>(row, sample))
                        .copy_from_slice(&state.joint(kind));
                }
            }
            let mut column = equations.body.column_mut(sample);
            column.copy_from_slice(body.0.as_flattened());
        }
        equations
    }
}

struct BodyEquation([[f64; BODY_ROWS]; 3]);

impl BodyEquation {
    fn add(&mut self, unknown: usize, vector: Vector3<f64>) {
        for axis in 0..3 {
            self.0[axis][unknown] += vector[axis];
        }
    }

    fn subtract(&mut self, unknown: usize, vector: &Vector3<f64>) {
        for axis in 0..3 {
            self.0[axis][unknown] -= vector[axis];
        }
    }

    fn add_foot(&mut self, state: &LegSample, map: &Matrix3<f64>) {
        let force = map * state.torque;
        self.add(INVERSE_MASS, force);
        self.subtract(DELAY, &(map * state.torque_rate));
        for kind in 0..LEG_JOINT_DIM {
            let (rate, joint) = (state.rate[kind], map.column(kind));
            self.subtract(VISCOUS + kind, &(joint * rate));
            self.subtract(DRY + kind, &(joint * (rate / DRY_SPEED_RAD_S).tanh()));
            self.subtract(ARMATURE + kind, &(joint * state.acceleration[kind]));
        }
        for (unknown, torque) in OWN.into_iter().zip(&state.own) {
            self.subtract(unknown, &(map * torque));
        }
        let below = (-Vector3::z()).cross(&force); // the force acts below the centre of the foot, and the foot rolls
        self.add(FOOT_RADIUS, map * state.about_joints(&below));
        let mut rolling = state.calf_rate();
        rolling.z = 0.0;
        let speed = rolling.norm().hypot(ROLLING_SPEED_RAD_S);
        let resistance = -force.z.max(0.0) / speed * rolling;
        self.add(ROLLING, map * state.about_joints(&resistance));
    }
}

const MOMENTS: [usize; 5] = [LEG_SIDE, THIGH, CALF, THIGH_FRONT, CALF_FRONT]; // in the order of [`Directions`]

const OWN: [usize; 7] = [
    LEG_SIDE,
    THIGH,
    THIGH_SECOND,
    CALF,
    CALF_SECOND,
    THIGH_FRONT,
    CALF_FRONT,
];

struct LegSample {
    frame: LegFrame,
    trunk_rate: Vector3<f64>,
    rate: Vector3<f64>,
    acceleration: Vector3<f64>,
    torque: Vector3<f64>,
    torque_rate: Vector3<f64>,
    own: [Vector3<f64>; OWN.len()], // torques per unit of each unknown of [`OWN`]
}

impl LegSample {
    fn about_joints(&self, moment: &Vector3<f64>) -> Vector3<f64> {
        let flexion = self.frame.flexion.dot(moment);
        Vector3::new(self.frame.abduction.dot(moment), flexion, flexion)
    }

    fn calf_rate(&self) -> Vector3<f64> {
        self.trunk_rate
            + self.frame.abduction * self.rate[0]
            + self.frame.flexion * (self.rate[1] + self.rate[2])
    }

    fn joint(&self, kind: usize) -> [f64; JOINT_ROWS] {
        let rate = self.rate[kind];
        let dry = (rate / DRY_SPEED_RAD_S).tanh();
        let mut out = [0.0; JOINT_ROWS];
        out[..3].copy_from_slice(&[rate, dry, self.acceleration[kind]]);
        out[3..][..OWN.len()].copy_from_slice(&self.own.map(|torque| torque[kind]));
        out[JOINT_ROWS - 2..].copy_from_slice(&[self.torque_rate[kind], self.torque[kind]]);
        out
    }
}

/// Per unit of each of [`OWN`]: a mass at `s` from a point that accelerates by `a` needs the moment `s x (a + s'')`. Of
/// the acceleration of the hip and the second derivatives of the leg's directions.
fn own_torques(
    frame: &LegFrame,
    links: &LegLinks,
    hip: Vector3<f64>,
    [side2, thigh2, calf2, thigh_front2, calf_front2]: &Directions,
) -> [Vector3<f64>; OWN.len()] {
    let [side_m, thigh_m] = [links.hip.norm(), links.thigh.norm()];
    let [to_side, to_knee, to_foot, thigh_front, calf_front] = &frame.directions;
    let plane = hip + side_m * side2;
    let knee = plane + thigh_m * thigh2;
    let abduction = frame.abduction;
    let (side, thigh) = (side_m * to_side, thigh_m * to_knee);
    // Moments about the joint of flexion and about the knee of a first moment along `direction`.
    let torques = |flexion: Vector3<f64>, knee: Vector3<f64>, force: Vector3<f64>| {
        Vector3::new(
            abduction.dot(&(flexion + side.cross(&force))),
            frame.flexion.dot(&flexion),
            frame.flexion.dot(&knee),
        )
    };
    let none = Vector3::zeros();
    let on_thigh = |direction: &Vector3<f64>, second: Vector3<f64>| {
        torques(direction.cross(&plane), none, second)
    };
    let on_calf = |direction: &Vector3<f64>, second: Vector3<f64>| {
        let about_knee = direction.cross(&knee);
        torques(about_knee + thigh.cross(&second), about_knee, second)
    };
    let thigh_turn = to_knee.cross(thigh2);
    let calf_turn = to_foot.cross(calf2);
    [
        Vector3::new(abduction.dot(&to_side.cross(&plane)), 0.0, 0.0),
        on_thigh(to_knee, *thigh2),
        torques(thigh_turn, none, none),
        on_calf(to_foot, *calf2),
        torques(calf_turn, calf_turn, none),
        on_thigh(thigh_front, *thigh_front2),
        on_calf(calf_front, *calf_front2),
    ]
}

fn delayed(time_s: &[f64], rows: &DMatrix<f64>, delay_s: f64) -> DMatrix<f64> {
    let mut out = rows.clone();
    for (sample, time) in time_s.iter().enumerate() {
        let (left, right, share) = between(time_s, time - delay_s);
        let value = rows.column(left) * (1.0 - share) + rows.column(right) * share;
        out.set_column(sample, &value);
    }
    out
}

/// Sideways from the axis of abduction, hip to knee, knee to foot, in front of thigh and calf; or their derivatives.
pub(crate) type Directions = [Vector3<f64>; 5];

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LegFrame {
    pub abduction: Vector3<f64>,
    pub flexion: Vector3<f64>,
    pub directions: Directions,
}

#[derive(Debug, Clone)]
pub(crate) struct Motion {
    pub attitude: Vec<Matrix3<f64>>, // rotation from trunk to world at each sample
    pub trunk_rate: Vec<Vector3<f64>>, // angular velocity of the trunk in the world, rad/s
    pub(crate) legs: Vec<[LegFrame; 4]>,
    /// From the torques of each leg to its force in the world; none near a singular posture and for legs in the air.
    force_maps: Vec<[Option<Matrix3<f64>>; 4]>,
    /// Torques of the links of each leg per unit of each of [`OWN`]: without gravity, and by a gravity of 1 m/s^2.
    own: Vec<[[[Vector3<f64>; OWN.len()]; 2]; 4]>,
    pub coordinates: DMatrix<f64>, // accelerations of the recorded coordinates, 18 x n, per s^2
    directions: DMatrix<f64>, // of trunk axes (9 rows), then of each leg's five directions, 69 x n
}

const TRUNK_ROWS: usize = 9;
const LEG_ROWS: usize = 15; // rows of a leg there

impl Motion {
    pub(crate) fn of(segment: &Segment, robot: &Robot) -> Self {
        let links = Leg::ALL.map(|leg| robot.geometry(leg).links());
        let n = segment.len();
        let mut motion = Self {
            attitude: Vec::with_capacity(n),
            trunk_rate: Vec::with_capacity(n),
            legs: Vec::with_capacity(n),
            force_maps: Vec::with_capacity(n),
            own: Vec::with_capacity(n),
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
            let force_map = |leg: Leg| {
                let q = leg.of_joints(&segment.joints(sample));
                let is_regular = segment.feet[sample][leg.index()]
                    && robot.geometry(leg).manipulability(&q) >= LEAST_MANIPULABILITY;
                let map = is_regular.then(|| robot.foot_force_map(leg, &q).ok());
                map.flatten().map(|map| attitude * map)
            };
            motion.force_maps.push(Leg::ALL.map(force_map));
            motion.attitude.push(attitude);
            motion.trunk_rate.push(rate);
            motion.legs.push(legs);
        }
        motion.directions = differences(&segment.time_s, &rates);
        for sample in 0..n {
            let own = Leg::ALL.map(|leg| {
                let (frame, links) = (&motion.legs[sample][leg.index()], &links[leg.index()]);
                let hip = robot.hip_position(leg);
                let turned = (0..3).map(|axis| hip[axis] * motion.trunk_axis(axis, sample));
                let hip = motion.body(sample) + turned.sum::<Vector3<f64>>();
                let still = [Vector3::zeros(); 5];
                [(hip, motion.leg(leg, sample)), (Vector3::z(), still)]
                    .map(|(hip, directions)| own_torques(frame, links, hip, &directions))
            });
            motion.own.push(own);
        }
        motion
    }

    fn own_torques(&self, leg: Leg, sample: usize, gravity_m_s2: f64) -> [Vector3<f64>; OWN.len()] {
        let [without, by_gravity] = &self.own[sample][leg.index()];
        std::array::from_fn(|i| without[i] + gravity_m_s2 * by_gravity[i])
    }

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
    // A hip link without a length has no direction.
    let [along_hip, along_thigh, along_calf] = [links.hip, links.thigh, links.calf]
        .map(|link| link.try_normalize(0.0).unwrap_or_default());
    // The body's front, for both directions of a leg's axis: the four legs share the moments in front of their links.
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
