//! The shape of one leg: the usual one in its short formulas, or any chain of three joints.
//!
//! One robot: geometry, mass and limits.

use nalgebra::{Matrix3, Vector3};

use super::chain::{self, ChainLeg, PlanarLeg};
use super::input_rule::rotation;
use super::joints::{
    BODY_NAMES, FOOT_DIM, JOINT_DIM, JOINT_NAMES, LEG_JOINT_DIM, Leg, STATE_DIM, WRENCH_NAMES,
};

/// The shape of one leg. Both forms agree where both apply; the planar one has fewer operations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LegGeometry {
    /// Abduction about x, flexion and knee about y, links straight down.
    Planar(PlanarLeg),
    /// Any axes and links.
    Chain(ChainLeg),
}

/// Directions and lengths of a leg at its zero posture, in the body's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegLinks {
    /// Axis of the first joint.
    pub abduction: Vector3<f64>,
    /// Axis of the second and third joint.
    pub flexion: Vector3<f64>,
    /// From the first joint to the plane of the leg at its second joint, m.
    pub hip: Vector3<f64>,
    /// Along the thigh in the plane of the leg, m.
    pub thigh: Vector3<f64>,
    /// Along the calf in the plane of the leg, m.
    pub calf: Vector3<f64>,
}

/// Axes of a planar leg: x, y, y.
const USUAL_AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]];

impl LegGeometry {
    /// The simplest form of a chain.
    pub fn of_chain(chain: ChainLeg) -> Self {
        let [hip, thigh, calf] = chain.links;
        let is_usual = chain.axes == USUAL_AXES
            && (hip[0], hip[2]) == (0.0, 0.0)
            && (thigh[0], thigh[1]) == (0.0, 0.0)
            && calf[1] == 0.0
            && thigh[2] < 0.0
            && calf[2] < 0.0;
        match is_usual {
            false => LegGeometry::Chain(chain),
            true => LegGeometry::Planar(PlanarLeg {
                hip_m: hip[1],
                thigh_m: -thigh[2],
                calf_m: -calf[2],
                foot_forward_m: calf[0],
            }),
        }
    }

    /// The leg as a chain.
    pub fn chain(&self) -> ChainLeg {
        match self {
            LegGeometry::Chain(chain) => *chain,
            LegGeometry::Planar(leg) => ChainLeg {
                axes: USUAL_AXES,
                links: [
                    [0.0, leg.hip_m, 0.0],
                    [0.0, 0.0, -leg.thigh_m],
                    [leg.foot_forward_m, 0.0, -leg.calf_m],
                ],
            },
        }
    }

    /// Foot position from the first joint, in the body's axes, m, at joint angles `q` in rad.
    pub(crate) fn foot_position(&self, q: &[f64; 3]) -> Vector3<f64> {
        match self {
            LegGeometry::Planar(leg) => leg.foot_position(q),
            LegGeometry::Chain(leg) => leg.foot_position(q),
        }
    }

    /// Position of the third joint from the first, in the body's axes, m.
    pub fn knee_position(&self, q: &[f64; 3]) -> Vector3<f64> {
        match self {
            LegGeometry::Planar(leg) => PlanarLeg {
                calf_m: 0.0,
                foot_forward_m: 0.0,
                ..*leg
            }
            .foot_position(q),
            LegGeometry::Chain(leg) => {
                let [hip, thigh, _] = leg.links;
                let links = [hip, thigh, [0.0; 3]];
                ChainLeg { links, ..*leg }.foot_position(q)
            }
        }
    }

    /// Jacobian of `Self::foot_position`: `J[i][j] = d p_i / d q_j`, in m.
    pub fn foot_jacobian(&self, q: &[f64; 3]) -> Matrix3<f64> {
        match self {
            LegGeometry::Planar(leg) => leg.foot_jacobian(q),
            LegGeometry::Chain(leg) => leg.foot_jacobian(q),
        }
    }

    /// Lengths of thigh and calf, in m.
    pub fn lengths(&self) -> [f64; 2] {
        match self {
            LegGeometry::Planar(leg) => [leg.thigh_m, leg.calf_m],
            LegGeometry::Chain(leg) => leg.lengths(),
        }
    }

    /// The volume that bounds `|det J|`: thigh times calf times their sum.
    pub fn volume_m3(&self) -> f64 {
        chain::volume_m3(self.lengths())
    }

    /// `|det J| / volume`: 0 at full extension or with the foot on the axis of the first joint, at most about 1.
    pub fn manipulability(&self, q: &[f64; 3]) -> f64 {
        match self {
            LegGeometry::Planar(leg) => leg.manipulability(q),
            LegGeometry::Chain(leg) => leg.foot_jacobian(q).determinant().abs() / self.volume_m3(),
        }
    }

    /// Below which the area that thigh and calf span (m^2) and the height of the foot in the plane of the leg (m) are
    /// damped.
    pub fn least_levers(&self) -> [f64; 2] {
        chain::least_levers(self.lengths())
    }

    /// Span of thigh and calf over the product of their lengths, and height of the foot over the length of the
    /// stretched leg, as absolute values: what [`LEAST_SPAN`](super::chain::LEAST_SPAN) and
    /// [`LEAST_HEIGHT`](super::chain::LEAST_HEIGHT) are compared with.
    pub fn spans(&self, q: &[f64; 3]) -> [f64; 2] {
        let [area, lever] = match self {
            LegGeometry::Planar(leg) => leg.levers(q),
            LegGeometry::Chain(leg) => leg.levers(q),
        };
        let [thigh, calf] = self.lengths();
        [area.abs() / (thigh * calf), lever.abs() / (thigh + calf)]
    }

    /// `-J^-T` with levers that are never shorter than [`Self::least_levers`]; none where neither is that short.
    pub fn damped_force_map(&self, q: &[f64; 3]) -> Option<Matrix3<f64>> {
        match self {
            LegGeometry::Planar(leg) => leg.damped_force_map(q),
            LegGeometry::Chain(leg) => leg.damped_force_map(q),
        }
    }

    /// Directions and lengths at the zero posture. The foot's offset from a straight calf is left out of a planar leg.
    pub fn links(&self) -> LegLinks {
        let mut chain = self.chain();
        if let LegGeometry::Planar(_) = self {
            chain.links[2][0] = 0.0;
        }
        let [abduction, flexion, _] = chain.axes.map(Vector3::from);
        let [hip, thigh, calf] = chain.links.map(Vector3::from);
        let aside = flexion * (flexion.dot(&thigh) + flexion.dot(&calf));
        let in_plane = |link: Vector3<f64>| link - flexion * flexion.dot(&link);
        LegLinks {
            abduction,
            flexion,
            hip: hip + aside,
            thigh: in_plane(thigh),
            calf: in_plane(calf),
        }
    }
}

/// A quadruped with three joints per leg: abduction, flexion, knee.
///
/// `romc_model::robot_file` reads and checks robots; arrays are in the order of the state.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Name in model files and on the command line.
    pub name: &'static str,
    /// Mass of body and legs.
    pub mass_kg: f64,
    /// Shapes of the legs.
    pub legs: [LegGeometry; FOOT_DIM],
    /// Hips in the body's frame.
    pub hip_position_m: [[f64; 3]; FOOT_DIM],
    /// Its maker's names.
    pub joint_names: [&'static str; JOINT_DIM],
    /// Largest torques.
    pub torque_limit_nm: [f64; JOINT_DIM],
    /// Lowest and highest angles.
    pub joint_limit_rad: [(f64, f64); JOINT_DIM],
    /// Largest speeds.
    pub joint_speed_limit_rad_s: [f64; JOINT_DIM],
}

impl Robot {
    /// Its name, in model files and on the command line.
    pub fn name(&self) -> &str {
        self.name
    }

    /// Mass of body and legs, in kg.
    pub fn mass_kg(&self) -> f64 {
        self.mass_kg
    }

    /// Shape of a leg.
    pub fn geometry(&self, leg: Leg) -> &LegGeometry {
        &self.legs[leg.index()]
    }

    /// The maker's names of the joints.
    pub fn joint_names(&self) -> &[&'static str; JOINT_DIM] {
        &self.joint_names
    }

    /// How a joint's angle on the left, mirrored, reads on the right: 1 where both turn alike in a mirrored motion (the
    /// usual flexions), -1 where they turn against each other (abductions about the same axis).
    pub fn mirror_sign(&self, joint: usize) -> f64 {
        let of_pair = |leg: Leg| self.geometry(leg).chain().axes[joint % LEG_JOINT_DIM];
        let (left, right) = match joint / LEG_JOINT_DIM < 2 {
            true => (of_pair(Leg::FrontLeft), of_pair(Leg::FrontRight)),
            false => (of_pair(Leg::RearLeft), of_pair(Leg::RearRight)),
        };
        // A turn's axis mirrored at the plane y = 0.
        let mirrored = [-left[0], left[1], -left[2]];
        let along: f64 = mirrored.iter().zip(&right).map(|(a, b)| a * b).sum();
        if along < 0.0 { -1.0 } else { 1.0 }
    }

    /// Origin of a leg's hip frame in the body frame, in m.
    pub fn hip_position(&self, leg: Leg) -> Vector3<f64> {
        Vector3::from(self.hip_position_m[leg.index()])
    }

    /// Largest torque of each joint, in N m, in the order of the state.
    pub fn torque_limit_nm(&self) -> &[f64; JOINT_DIM] {
        &self.torque_limit_nm
    }

    /// Lowest and highest angle of each joint, in rad.
    pub fn joint_limit_rad(&self) -> &[(f64, f64); JOINT_DIM] {
        &self.joint_limit_rad
    }

    /// Largest speed of each joint, in rad/s.
    pub fn joint_speed_limit_rad_s(&self) -> &[f64; JOINT_DIM] {
        &self.joint_speed_limit_rad_s
    }

    /// Foot position of a leg from its first joint, along the body's axes, in m.
    pub fn foot_position(&self, leg: Leg, q: &[f64; 3]) -> Vector3<f64> {
        self.geometry(leg).foot_position(q)
    }

    /// The same from the body's origin.
    pub fn foot_from_body(&self, leg: Leg, q: &[f64; 3]) -> Vector3<f64> {
        self.hip_position(leg) + self.foot_position(leg, q)
    }

    /// The same in the world, at a state `x` of the robot.
    pub fn foot_in_world(&self, leg: Leg, x: &[f64; STATE_DIM]) -> Vector3<f64> {
        let joints = x.first_chunk().expect("joints come first");
        let [.., x, y, z, roll, pitch, yaw] = *x;
        let foot = self.foot_from_body(leg, &leg.of_joints(joints));
        Vector3::new(x, y, z) + rotation([roll, pitch, yaw]) * foot
    }

    /// Jacobian of [`Robot::foot_position`] by the leg's joint angles, in m.
    pub fn foot_jacobian(&self, leg: Leg, q: &[f64; 3]) -> Matrix3<f64> {
        self.geometry(leg).foot_jacobian(q)
    }

    /// Names of the state: joints `fr.hx` to `rl.kn`, then `body.x` to `body.yaw` (equation 1).
    pub fn state_names() -> [String; STATE_DIM] {
        joined(&JOINT_NAMES, &BODY_NAMES)
    }

    /// Units of the state: rad, with m for the body's position.
    pub fn state_units() -> [String; STATE_DIM] {
        joined(&["rad"; JOINT_DIM], &["m", "m", "m", "rad", "rad", "rad"])
    }

    /// Names of the input: joint torques under the joints' names, then `force.x` to `moment.z` (equation 23).
    pub fn input_names() -> [String; STATE_DIM] {
        joined(&JOINT_NAMES, &WRENCH_NAMES)
    }

    /// Units of the input: N m, with N for the linear force.
    pub fn input_units() -> [String; STATE_DIM] {
        joined(&["N m"; JOINT_DIM], &["N", "N", "N", "N m", "N m", "N m"])
    }
}

fn joined(joints: &[&str; JOINT_DIM], body: &[&str; 6]) -> [String; STATE_DIM] {
    std::array::from_fn(|i| match i.checked_sub(JOINT_DIM) {
        None => joints[i].to_owned(),
        Some(j) => body[j].to_owned(),
    })
}
