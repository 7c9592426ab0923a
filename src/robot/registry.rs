//! The robots that romc knows: geometry, mass and limits of each.

use nalgebra::{Matrix3, Vector3};

use super::error::RobotError;
use super::joints::{
    BODY_NAMES, FOOT_DIM, JOINT_DIM, JOINT_NAMES, LEG_JOINT_DIM, Leg, STATE_DIM, WRENCH_NAMES,
};
use super::kinematics::LegGeometry;

/// A quadruped with three joints a leg: abduction, flexion, knee.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    pub(super) name: &'static str,
    pub(super) mass_kg: f64,
    pub(super) geometry: LegGeometry,
    pub(super) hip_position_m: [[f64; 3]; FOOT_DIM],
    pub(super) torque_limit_nm: [f64; JOINT_DIM],
    pub(super) joint_limit_rad: [(f64, f64); JOINT_DIM],
    pub(super) joint_speed_limit_rad_s: [f64; JOINT_DIM],
}

/// Every registered robot, by name.
static ROBOTS: [Robot; 3] = [GO1, GO2, A1];

/// Unitree Go1: link lengths, effort, speed and position limits of the maker's
/// URDF; the mass is that of body and legs together.
const GO1: Robot = Robot {
    name: "go1",
    mass_kg: 12.01,
    geometry: LegGeometry {
        hip_m: 0.08,
        thigh_m: 0.213,
        calf_m: 0.213,
        foot_forward_m: 0.0,
    },
    hip_position_m: hips(0.1881, 0.04675),
    torque_limit_nm: each_leg([23.7, 23.7, 35.55]),
    joint_limit_rad: each_leg([(-0.863, 0.863), (-0.686, 4.501), (-2.818, -0.888)]),
    joint_speed_limit_rad_s: each_leg([30.1, 30.1, 20.06]),
};

/// Unitree Go2: the maker's geometry and limits; its rear thighs swing further
/// back than the front ones.
const GO2: Robot = Robot {
    name: "go2",
    mass_kg: 15.21,
    geometry: LegGeometry {
        hip_m: 0.0955,
        thigh_m: 0.213,
        calf_m: 0.213,
        foot_forward_m: -0.002,
    },
    hip_position_m: hips(0.1934, 0.0465),
    torque_limit_nm: each_leg([23.7, 23.7, 45.43]),
    joint_limit_rad: front_and_rear(
        [
            degrees(-60.0, 60.0),
            degrees(-90.0, 200.0),
            degrees(-156.0, -48.0),
        ],
        [
            degrees(-60.0, 60.0),
            degrees(-30.0, 260.0),
            degrees(-156.0, -48.0),
        ],
    ),
    joint_speed_limit_rad_s: each_leg([30.1, 30.1, 15.7]),
};

/// Unitree A1: the maker's geometry, limits and sum of masses.
const A1: Robot = Robot {
    name: "a1",
    mass_kg: 12.78,
    geometry: LegGeometry {
        hip_m: 0.0838,
        thigh_m: 0.2,
        calf_m: 0.2,
        foot_forward_m: 0.0,
    },
    hip_position_m: hips(0.1805, 0.047),
    torque_limit_nm: each_leg([33.5; 3]),
    joint_limit_rad: each_leg([
        degrees(-46.0, 46.0),
        degrees(-60.0, 240.0),
        degrees(-154.5, -52.5),
    ]),
    joint_speed_limit_rad_s: each_leg([21.0; 3]),
};

/// The same three values for every leg.
const fn each_leg<T: Copy>(leg: [T; LEG_JOINT_DIM]) -> [T; JOINT_DIM] {
    front_and_rear(leg, leg)
}

/// Three values for each front leg and three for each rear leg.
const fn front_and_rear<T: Copy>(
    front: [T; LEG_JOINT_DIM],
    rear: [T; LEG_JOINT_DIM],
) -> [T; JOINT_DIM] {
    let ([a, b, c], [d, e, f]) = (front, rear);
    [a, b, c, a, b, c, d, e, f, d, e, f]
}

/// A range given in degrees, in rad.
const fn degrees(low: f64, high: f64) -> (f64, f64) {
    (low.to_radians(), high.to_radians())
}

/// Hips symmetric about the body's centre.
const fn hips(x: f64, y: f64) -> [[f64; 3]; FOOT_DIM] {
    [[x, -y, 0.0], [x, y, 0.0], [-x, -y, 0.0], [-x, y, 0.0]]
}

impl Robot {
    /// The robot registered under `name`, such as `go1`.
    ///
    /// # Errors
    /// [`RobotError::UnknownRobot`], which lists the known names.
    pub fn by_name(name: &str) -> Result<&'static Robot, RobotError> {
        ROBOTS
            .iter()
            .find(|robot| robot.name == name)
            .ok_or_else(|| RobotError::UnknownRobot {
                found: name.to_owned(),
                known: Self::known_names().join(", "),
            })
    }

    /// Names that [`Robot::by_name`] accepts.
    pub fn known_names() -> Vec<&'static str> {
        ROBOTS.iter().map(|robot| robot.name).collect()
    }

    /// Name in the registry.
    pub fn name(&self) -> &str {
        self.name
    }

    /// Mass of body and legs, in kg.
    pub fn mass_kg(&self) -> f64 {
        self.mass_kg
    }

    /// Link lengths of each leg.
    pub fn geometry(&self) -> &LegGeometry {
        &self.geometry
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

    /// Foot position of a leg in its hip frame, in m.
    pub fn foot_position(&self, leg: Leg, q: &[f64; 3]) -> Vector3<f64> {
        self.geometry.foot_position(leg, q)
    }

    /// Jacobian of [`Robot::foot_position`] by the leg's joint angles, in m.
    pub fn foot_jacobian(&self, leg: Leg, q: &[f64; 3]) -> Matrix3<f64> {
        self.geometry.foot_jacobian(leg, q)
    }

    /// Names of the state: joints `fr.hx` to `rl.kn`, then `body.x` to
    /// `body.yaw` (equation 1).
    pub fn state_names() -> [String; STATE_DIM] {
        joined(&JOINT_NAMES, &BODY_NAMES)
    }

    /// Units of the state: rad, with m for the body's position.
    pub fn state_units() -> [String; STATE_DIM] {
        joined(&["rad"; JOINT_DIM], &["m", "m", "m", "rad", "rad", "rad"])
    }

    /// Names of the input: joint torques under the joints' names, then
    /// `force.x` to `moment.z` (equation 23).
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_name_unknown_robot_lists_the_known_ones() {
        let error = Robot::by_name("spot").unwrap_err();
        let RobotError::UnknownRobot { found, known } = &error else {
            panic!("{error:?}");
        };
        assert_eq!(found, "spot");
        assert_eq!(known, &Robot::known_names().join(", "));
        assert!(error.to_string().contains("`spot`; known: go1"));
    }

    #[test]
    fn state_and_input_names_are_in_the_order_of_the_contract() {
        let state = Robot::state_names();
        assert_eq!((state[0].as_str(), state[11].as_str()), ("fr.hx", "rl.kn"));
        assert_eq!(
            (state[12].as_str(), state[17].as_str()),
            ("body.x", "body.yaw")
        );
        let input = Robot::input_names();
        assert_eq!(input[..12], state[..12]);
        assert_eq!(
            (input[12].as_str(), input[17].as_str()),
            ("force.x", "moment.z")
        );
        assert_eq!(Robot::state_units()[14], "m");
        assert_eq!(Robot::input_units()[14], "N");
        assert_eq!(Robot::input_units()[15], "N m");
    }

    #[test]
    fn registered_robots_stand_inside_their_limits_with_an_invertible_jacobian() {
        for name in Robot::known_names() {
            let robot = Robot::by_name(name).unwrap();
            for (joint, (low, high)) in robot.joint_limit_rad().iter().enumerate() {
                let stand = [0.0, 0.8, -1.5][joint % 3];
                assert!(*low < stand && stand < *high, "{name} joint {joint}");
            }
            assert!(robot.geometry().manipulability(&[0.0, 0.8, -1.5]) > 0.3);
            assert!(robot.torque_limit_nm().iter().all(|limit| *limit > 0.0));
        }
    }

    #[test]
    fn foot_positions_agree_with_a_physics_engine() {
        // Foot sphere minus hip body in MuJoCo's Go1 and Go2, trunk upright.
        let (front, rear) = ([0.31, 0.72, -1.43], [-0.2, 1.1, -2.0]);
        for (name, leg, q, expected) in [
            (
                "go1",
                Leg::FrontRight,
                front,
                [-0.001608342, 0.021940214, -0.330737735],
            ),
            (
                "go1",
                Leg::RearLeft,
                rear,
                [-0.022978536, 0.032906295, -0.240347313],
            ),
            (
                "go2",
                Leg::FrontRight,
                front,
                [-0.003125066, 0.007576739, -0.33670767],
            ),
            (
                "go2",
                Leg::RearLeft,
                rear,
                [-0.024221756, 0.047786081, -0.244962113],
            ),
        ] {
            let foot = Robot::by_name(name).unwrap().foot_position(leg, &q);
            let error = (foot - Vector3::from(expected)).norm();
            assert!(error < 2e-9, "{name} {leg}: {error:e}");
        }
    }

    #[test]
    fn hip_positions_lie_on_the_side_of_their_leg() {
        let go1 = Robot::by_name("go1").unwrap();
        for leg in Leg::ALL {
            let hip = go1.hip_position(leg);
            assert!(hip.y * leg.side() > 0.0);
            assert_eq!(hip.x > 0.0, leg.is_front());
        }
    }
}
