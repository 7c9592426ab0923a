//! From a measured sample to the generalised input `u = [tau; F; M]`, the one definition.
//!
//! `tau` are the torques at the links: the motor torques less what the joints take
//! ([`Actuators`]). `F` and `M` follow from them through the feet in contact, in one of two
//! frames ([`WrenchFrame`]). A model states which rule its inputs were made by; training,
//! simulation, control and generated code all follow it.

use nalgebra::{ArrayStorage, Matrix3, Rotation3, SMatrix, Vector6};

use super::actuators::Actuators;
use super::error::RobotError;
use super::joints::{BODY_DIM, ContactFlags, JOINT_DIM, STATE_DIM};
use super::registry::Robot;

/// Axes of the force and moment in an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum WrenchFrame {
    /// As published: axes parallel to the body's, the arm of each moment is the foot in its own hip
    /// frame.
    #[default]
    Body,
    /// The generalised forces of the body's recorded coordinates: the force in world axes, and the
    /// moments about the body's origin that do work on the rates of roll, pitch and yaw. Their sum
    /// `F . v + M . (d roll, d pitch, d yaw)` is the power of the feet on the body, which is what
    /// `W_e^T u_lat` stands for.
    World,
}

impl WrenchFrame {
    /// Both frames.
    pub const ALL: [Self; 2] = [Self::Body, Self::World];

    /// The name in model files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Body => "body",
            Self::World => "world",
        }
    }

    /// The frame of a name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|frame| frame.name() == name)
    }
}

/// How a sample of a robot becomes an input.
#[derive(Debug, Clone, PartialEq)]
pub struct InputRule {
    robot: &'static Robot,
    actuators: Option<Actuators>,
    frame: WrenchFrame,
}

impl InputRule {
    /// The rule of these actuators and this frame; without actuators torques count as they are.
    pub fn new(robot: &'static Robot, actuators: Option<Actuators>, frame: WrenchFrame) -> Self {
        Self {
            robot,
            actuators,
            frame,
        }
    }

    /// As published: motor torques, the wrench in the body's axes (equations 4 to 7, 22, 23).
    pub fn published(robot: &'static Robot) -> Self {
        Self::new(robot, None, WrenchFrame::Body)
    }

    /// Whether it is the published rule.
    pub fn is_published(&self) -> bool {
        self.actuators.is_none() && self.frame == WrenchFrame::Body
    }

    /// The robot.
    pub fn robot(&self) -> &'static Robot {
        self.robot
    }

    /// What the joints take; none if torques count as they are.
    pub fn actuators(&self) -> Option<&Actuators> {
        self.actuators.as_ref()
    }

    /// Axes of force and moment.
    pub fn wrench_frame(&self) -> WrenchFrame {
        self.frame
    }

    /// What the joints take at velocities `dq` (rad/s) and accelerations `ddq` (rad/s^2), in N m;
    /// zero without actuators.
    pub fn losses(&self, dq: &[f64; JOINT_DIM], ddq: &[f64; JOINT_DIM]) -> [f64; JOINT_DIM] {
        match &self.actuators {
            None => [0.0; JOINT_DIM],
            Some(actuators) => actuators.losses(dq, ddq),
        }
    }

    /// Force and moment on the body `[F; M]`, in N and N m, of the torques at the links `net` (N m)
    /// at a state `x` (joint angles and attitude count), by the feet in contact.
    ///
    /// Near a singularity of a leg its force is damped, see [`Robot::damped_force_map`].
    ///
    /// # Errors
    /// [`RobotError::NotFinite`] for NaN or infinite arguments of a leg in contact.
    pub fn wrench(
        &self,
        x: &[f64; STATE_DIM],
        net: &[f64; JOINT_DIM],
        contact: ContactFlags,
    ) -> Result<Vector6<f64>, RobotError> {
        let joints = x.first_chunk().expect("joints come first");
        let [.., roll, pitch, yaw] = *x;
        let wrench = (self.robot).wrench_by_arms(self.frame, joints, net, contact)?;
        Ok(match self.frame {
            WrenchFrame::Body => wrench,
            WrenchFrame::World => generalised([roll, pitch, yaw]) * wrench,
        })
    }

    /// The 6 x 12 matrix `G` of `[F; M] = G net` at a posture (rad), an attitude (roll, pitch, yaw,
    /// rad) and a contact; columns of legs in the air are zero.
    ///
    /// # Errors
    /// As [`InputRule::wrench`].
    pub fn wrench_map(
        &self,
        joints: &[f64; JOINT_DIM],
        attitude: [f64; 3],
        contact: ContactFlags,
    ) -> Result<SMatrix<f64, BODY_DIM, JOINT_DIM>, RobotError> {
        let map = self.robot.map_by_arms(self.frame, joints, contact)?;
        Ok(match self.frame {
            WrenchFrame::Body => map,
            WrenchFrame::World => product(&generalised(attitude), &map),
        })
    }
}

/// The product, to the bit as nalgebra has it, which calls a function out of line for each column and factor:
/// every entry is the sum of its products in their order.
fn product(
    left: &SMatrix<f64, BODY_DIM, BODY_DIM>,
    right: &SMatrix<f64, BODY_DIM, JOINT_DIM>,
) -> SMatrix<f64, BODY_DIM, JOINT_DIM> {
    let (left, right) = (&left.data.0, &right.data.0);
    let mut columns = [[0.0; BODY_DIM]; JOINT_DIM];
    for j in 0..JOINT_DIM {
        for i in 0..BODY_DIM {
            let mut sum = left[0][i] * right[j][0];
            for k in 1..BODY_DIM {
                sum += left[k][i] * right[j][k];
            }
            columns[j][i] = sum;
        }
    }
    SMatrix::from_data(ArrayStorage(columns))
}

/// Rotation from the body's axes to the world's, `R_z(yaw) R_y(pitch) R_x(roll)`.
pub fn rotation([roll, pitch, yaw]: [f64; 3]) -> Matrix3<f64> {
    Rotation3::from_euler_angles(roll, pitch, yaw).into_inner()
}

/// From force and moment about the body's origin in the body's axes to the generalised forces of
/// position and of roll, pitch and yaw: `[R F; E^T M]` with the angular velocity
/// `E (d roll, d pitch, d yaw)` in the body's axes.
fn generalised(attitude: [f64; 3]) -> SMatrix<f64, BODY_DIM, BODY_DIM> {
    let [(s_r, c_r), (s_p, c_p)] = [attitude[0].sin_cos(), attitude[1].sin_cos()];
    let rates = Matrix3::new(1.0, 0.0, 0.0, 0.0, c_r, -s_r, -s_p, c_p * s_r, c_p * c_r);
    let mut map = SMatrix::<f64, BODY_DIM, BODY_DIM>::zeros();
    map.fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&rotation(attitude));
    map.fixed_view_mut::<3, 3>(3, 3).copy_from(&rates);
    map
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{SVector, Vector3};

    use crate::robot::joints::{LEG_JOINT_DIM, Leg};

    const CONTACTS: [ContactFlags; 3] = [
        [true; 4],
        [false, false, true, true],
        [true, false, false, true],
    ];

    fn rule(name: &str) -> InputRule {
        InputRule::new(Robot::by_name(name).unwrap(), None, WrenchFrame::World)
    }

    fn state() -> [f64; STATE_DIM] {
        std::array::from_fn(|i| match i {
            0..JOINT_DIM => [0.1, 0.8, -1.5][i % 3] + 0.02 * i as f64,
            12..=14 => 0.3 * i as f64 - 3.0,
            15 => 0.3,
            16 => -0.9,
            _ => 0.7,
        })
    }

    fn torques() -> [f64; JOINT_DIM] {
        std::array::from_fn(|i| 3.0 - 0.7 * i as f64 + 0.2 * (i * i) as f64)
    }

    #[test]
    fn world_wrench_does_the_work_of_the_feet_on_the_bodys_coordinates() {
        // Virtual work: F_k . d(foot k)/dx_i over the feet in contact is -tau_i for a joint of a leg
        // in contact, and the generalised force for a coordinate of the body.
        for name in Robot::known_names() {
            let rule = rule(name);
            let (x, tau) = (state(), torques());
            for contact in CONTACTS {
                let wrench = rule.wrench(&x, &tau, contact).unwrap();
                let joints = std::array::from_fn(|i| x[i]);
                let turn = rotation([x[15], x[16], x[17]]);
                let legs = Leg::down(contact);
                let forces: Vec<(Leg, Vector3<f64>)> = legs
                    .map(|leg| {
                        let (q, tau) = (leg.of_joints(&joints), leg.of_joints(&tau));
                        (leg, turn * rule.robot().foot_force(leg, &q, &tau).unwrap())
                    })
                    .collect();
                for i in 0..STATE_DIM {
                    let step = 1e-6;
                    let (mut lower, mut upper) = (x, x);
                    lower[i] -= step;
                    upper[i] += step;
                    let work: f64 = (forces.iter())
                        .map(|(leg, force)| {
                            let foot = |x| rule.robot().foot_in_world(*leg, x);
                            force.dot(&(foot(&upper) - foot(&lower))) / (2.0 * step)
                        })
                        .sum();
                    let expected = match i {
                        0..JOINT_DIM if contact[i / LEG_JOINT_DIM] => -tau[i],
                        0..JOINT_DIM => 0.0,
                        _ => wrench[i - JOINT_DIM],
                    };
                    assert!(
                        (work - expected).abs() < 1e-6 * wrench.norm(),
                        "{name} {contact:?} {i}: {work} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn wrench_is_the_wrench_map_times_torques_in_both_frames() {
        let (x, tau) = (state(), torques());
        for frame in WrenchFrame::ALL {
            let rule = InputRule::new(Robot::by_name("go2").unwrap(), None, frame);
            for contact in CONTACTS {
                let joints = std::array::from_fn(|i| x[i]);
                let map = rule.wrench_map(&joints, [x[15], x[16], x[17]], contact);
                let product = map.unwrap() * SVector::<f64, JOINT_DIM>::from(tau);
                let wrench = rule.wrench(&x, &tau, contact).unwrap();
                assert!(
                    (wrench - product).norm() < 1e-12 * wrench.norm(),
                    "{frame:?}"
                );
            }
        }
    }

    #[test]
    fn world_and_body_force_agree_for_a_level_robot_that_looks_along_x() {
        let mut x = state();
        x[15..].fill(0.0);
        let world = rule("go1").wrench(&x, &torques(), [true; 4]).unwrap();
        let body = InputRule::published(Robot::by_name("go1").unwrap());
        let body = body.wrench(&x, &torques(), [true; 4]).unwrap();
        assert!((world - body).rows(0, 3).norm() < 1e-12 * body.norm());
        // The arms differ: about the body's origin a front foot that pushes up pitches it back.
        assert!((world - body).rows(3, 3).norm() > 1.0);
    }

    #[test]
    fn names_of_frames_are_read_back() {
        for frame in WrenchFrame::ALL {
            assert_eq!(WrenchFrame::by_name(frame.name()), Some(frame));
        }
        assert_eq!(WrenchFrame::by_name("World"), None);
    }
}
