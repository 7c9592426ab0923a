//! From a measured sample to the generalised input `u = [tau; F; M]`, the only definition. A model states the rule that
//! produced its inputs; training, simulation, control and generated code all follow it.
//!
//! `tau` are the torques at the links. They are the motor torques `t` minus the joint's losses,
//! `t - b dq - c tanh(dq / v) - I ddq` ([`Actuators`]): viscous friction, dry friction (smooth around standstill, `v` =
//! [`DRY_SPEED_RAD_S`]) and the rotor's inertia seen through the gear (armature). In [`WrenchFrame::Ground`] the
//! torques that carry and move the links of a leg whose foot is on the ground ([`MovingLeg`]) are also subtracted. `F`
//! and `M` follow through the feet in contact.

use nalgebra::{Matrix3, SMatrix, Vector6};

use super::error::RobotError;
use super::geometry::Robot;
use super::joints::{
    BODY_DIM, ContactFlags, FOOT_DIM, GRAVITY_M_S2, JOINT_DIM, LEG_JOINT_DIM, Leg, STATE_DIM,
};
use super::leg::{Real, turn_to_world, write_world_axes};
use super::links::{LegMoments, MovingLeg, TrunkMotion};

/// Axes of the force and moment in an input, and the treatment of feet on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum WrenchFrame {
    /// As published: axes parallel to the body's, the arm of each moment is the foot in its own hip frame.
    #[default]
    Body,
    /// The generalised forces of the body's recorded coordinates: the force in world axes, and the moments about the
    /// body's origin that do work on the rates of roll, pitch and yaw. `F . v + M . (d roll, d pitch, d yaw)` is the
    /// power of the feet on the body, as the input map `W_e^T u_lat` requires.
    World,
    /// As `World`, and feet only push. A foot in contact whose torques would need a downward force adds nothing, as at
    /// the end of a stance. For a leg on the ground, the torques that carry and move its links are subtracted. In the
    /// air the input accelerates rotors and links, so their inertia is no loss.
    Ground,
}

impl WrenchFrame {
    /// Every frame.
    pub const ALL: [Self; 3] = [Self::Body, Self::World, Self::Ground];

    /// The name in model files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Body => "body",
            Self::World => "world",
            Self::Ground => "ground",
        }
    }
}

impl std::str::FromStr for WrenchFrame {
    type Err = ();

    fn from_str(name: &str) -> Result<Self, ()> {
        let known = Self::ALL.into_iter().find(|frame| frame.name() == name);
        known.ok_or(())
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

    /// Friction and rotor inertia of the joints; none if measured torques are used unchanged.
    pub fn actuators(&self) -> Option<&Actuators> {
        self.actuators.as_ref()
    }

    /// Axes of force and moment.
    pub fn wrench_frame(&self) -> WrenchFrame {
        self.frame
    }

    /// Moments of the legs, if the torques that carry and move their links are subtracted.
    pub fn legs(&self) -> Option<&LegMoments> {
        let known = self
            .actuators
            .as_ref()
            .and_then(|known| known.legs.as_ref());
        known.filter(|_| self.frame == WrenchFrame::Ground)
    }

    /// Whether the rotors' inertia counts as a loss, with a foot on the ground or without.
    pub fn inertia_is_loss(&self, is_grounded: bool) -> bool {
        is_grounded || self.frame != WrenchFrame::Ground
    }

    /// The part of the motors' torques that does not enter the input, N m: [`joint_loss`] of every joint plus
    /// [`Self::leg_torques`], at a state `x`, `dx` and `ddx` (rad, m, s). Zero without actuators.
    pub fn losses(
        &self,
        [x, dx, ddx]: [&[f64; STATE_DIM]; 3],
        feet: ContactFlags,
    ) -> [f64; JOINT_DIM] {
        let Some(actuators) = &self.actuators else {
            return [0.0; JOINT_DIM];
        };
        let is_loss = self.inertia_is_loss(feet.contains(&true));
        let inertia = if is_loss { 1.0 } else { 0.0 };
        let joints = |values: &[f64; STATE_DIM], factor: f64| {
            std::array::from_fn(|joint| values[joint] * factor)
        };
        let mut losses = actuators.losses(&joints(dx, 1.0), &joints(ddx, inertia));
        let own = self.leg_torques([x, dx, ddx], feet);
        losses
            .iter_mut()
            .zip(own)
            .for_each(|(loss, own)| *loss += own);
        losses
    }

    /// Torques that carry and move the links of the legs on the ground, N m. Zero for legs in the air, and under rules
    /// that do not subtract them.
    pub fn leg_torques(
        &self,
        [x, dx, ddx]: [&[f64; STATE_DIM]; 3],
        feet: ContactFlags,
    ) -> [f64; JOINT_DIM] {
        let mut torques = [0.0; JOINT_DIM];
        let Some(moments) = self.legs() else {
            return torques;
        };
        let three = |values: &[f64; STATE_DIM], first: usize| -> [f64; 3] {
            std::array::from_fn(|i| values[first + i])
        };
        let turns = |angles: [f64; 3]| [angles.map(f64::sin), angles.map(f64::cos)];
        let attitude = JOINT_DIM + 3;
        let mut lift = three(ddx, JOINT_DIM);
        lift[2] += GRAVITY_M_S2;
        let trunk = TrunkMotion::of(
            turns(three(x, attitude)),
            three(dx, attitude),
            three(ddx, attitude),
            lift,
        );
        for leg in Leg::down(feet) {
            let first = LEG_JOINT_DIM * leg.index();
            let geometry = self.robot.geometry(leg);
            let links = geometry.links();
            let [abduction, flexion, knee] = three(x, first);
            let moving = MovingLeg::of(self.robot, leg, &links, moments);
            let own = moving.torques(
                &trunk,
                turns([abduction, flexion, flexion + geometry.shape.knee * knee]),
                [three(dx, first), three(ddx, first)],
                |number| number,
            );
            torques[first..first + LEG_JOINT_DIM].copy_from_slice(&own);
        }
        torques
    }

    /// Force and moment on the body `[F; M]` in an input, in N and N m: [`Self::wrench`], in [`WrenchFrame::Ground`] of
    /// the feet that push.
    pub fn input_wrench(
        &self,
        x: &[f64; STATE_DIM],
        net: &[f64; JOINT_DIM],
        contact: ContactFlags,
    ) -> Result<Vector6<f64>, RobotError> {
        let mut pushing = contact;
        if self.frame == WrenchFrame::Ground {
            for leg in Leg::down(contact) {
                let mut alone = [false; FOOT_DIM];
                alone[leg.index()] = true;
                pushing[leg.index()] = self.wrench(x, net, alone)?[2] >= 0.0;
            }
        }
        self.wrench(x, net, pushing)
    }

    /// Force and moment on the body `[F; M]`, in N and N m, by the feet in contact, of the torques at the links `net`
    /// (N m). Of the state `x` only joint angles and attitude are used. Linear in `net`; damped as in
    /// [`Robot::damped_force_map`].
    pub fn wrench(
        &self,
        x: &[f64; STATE_DIM],
        net: &[f64; JOINT_DIM],
        contact: ContactFlags,
    ) -> Result<Vector6<f64>, RobotError> {
        let joints = x.first_chunk().expect("joints come first");
        let [.., roll, pitch, yaw] = *x;
        let mut wrench = (self.robot).wrench_by_arms(self.frame, joints, net, contact)?;
        if self.frame != WrenchFrame::Body {
            turn_to_world(&[roll, pitch, yaw], 1, &mut wrench);
        }
        Ok(wrench.into())
    }

    /// The 6 x 12 matrix `G` of `[F; M] = G net` at a posture (rad), an attitude (roll, pitch, yaw, rad) and a contact;
    /// columns of legs in the air are zero.
    pub fn wrench_map(
        &self,
        joints: &[f64; JOINT_DIM],
        attitude: [f64; 3],
        contact: ContactFlags,
    ) -> Result<SMatrix<f64, BODY_DIM, JOINT_DIM>, RobotError> {
        let mut map = self.robot.map_by_arms(self.frame, joints, contact)?;
        if self.frame != WrenchFrame::Body {
            turn_to_world(&attitude, JOINT_DIM, &mut map);
        }
        Ok(SMatrix::from_row_slice(&map))
    }
}

/// Rotation from the body's axes to the world's, `R_z(yaw) R_y(pitch) R_x(roll)`.
pub fn rotation(attitude: [f64; 3]) -> Matrix3<f64> {
    let [mut turned, mut rates] = [[[0.0; 3]; 3]; 2];
    write_world_axes(&attitude, &mut turned, &mut rates);
    Matrix3::from_fn(|row, column| turned[row][column])
}

/// Joint speed within which dry friction changes its sign, in rad/s.
pub const DRY_SPEED_RAD_S: Real = 0.05;

/// `b dq + c tanh(dq / v) + I ddq` of a joint with these `b`, `c` and `I`, N m, at `dq` (rad/s) and `ddq` (rad/s^2).
pub fn joint_loss(of: &[Real; 3], dq: Real, ddq: Real) -> Real {
    of[0] * dq + of[1] * (dq / DRY_SPEED_RAD_S).tanh() + of[2] * ddq
}

/// Losses of the twelve joints, in the order of [`JOINT_NAMES`](super::JOINT_NAMES), and the legs' own links.
#[derive(Debug, Clone, PartialEq)]
pub struct Actuators {
    /// Viscous friction `b`, in N m s/rad.
    pub viscous: [f64; JOINT_DIM],
    /// Dry friction `c`, in N m.
    pub dry: [f64; JOINT_DIM],
    /// Armature `I`, in kg m^2.
    pub armature: [f64; JOINT_DIM],
    /// Moments of the links of a leg, if they are known.
    pub legs: Option<LegMoments>,
}

impl Actuators {
    /// The same three values, of abduction, flexion and knee, for every leg.
    #[must_use]
    pub fn of_leg(viscous: [f64; 3], dry: [f64; 3], armature: [f64; 3]) -> Self {
        let each = |leg: [f64; 3]| std::array::from_fn(|i| leg[i % LEG_JOINT_DIM]);
        Self {
            viscous: each(viscous),
            dry: each(dry),
            armature: each(armature),
            legs: None,
        }
    }

    /// The three arrays with their names.
    #[must_use]
    pub fn named(&self) -> [(&'static str, &[f64; JOINT_DIM]); 3] {
        [
            ("viscous", &self.viscous),
            ("dry", &self.dry),
            ("armature", &self.armature),
        ]
    }

    /// The first value that is negative or not finite: its array's name, joint and value.
    #[must_use]
    pub fn unusable(&self) -> Option<(&'static str, usize, f64)> {
        self.named().into_iter().find_map(|(name, values)| {
            let joint = values.iter().position(|v| !(v.is_finite() && *v >= 0.0))?;
            Some((name, joint, values[joint]))
        })
    }

    /// [`joint_loss`] of every joint at velocities `dq` (rad/s) and accelerations `ddq` (rad/s^2).
    #[must_use]
    fn losses(&self, dq: &[f64; JOINT_DIM], ddq: &[f64; JOINT_DIM]) -> [f64; JOINT_DIM] {
        let of = |joint: usize| self.named().map(|(_, values)| values[joint]);
        std::array::from_fn(|i| joint_loss(&of(i), dq[i], ddq[i]))
    }
}
