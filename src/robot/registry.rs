//! One robot: geometry, mass and limits.

use nalgebra::{Matrix3, Vector3};

use super::geometry::LegGeometry;
use super::input_rule::rotation;
use super::joints::{
    BODY_NAMES, FOOT_DIM, JOINT_DIM, JOINT_NAMES, LEG_JOINT_DIM, Leg, STATE_DIM, WRENCH_NAMES,
};

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
