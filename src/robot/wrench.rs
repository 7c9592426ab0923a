//! From joint torques to the force and moment on the body; rules on which feet are on the ground.
//!
//! Equation 4 with the sign of a reaction: the feet push the ground with `J^-T tau`, the ground pushes the body with
//! `F_k = -J_k^-T tau_k`. Forces are in axes parallel to the body's. The moment is `x_k x F_k` (the paper prints
//! `F_k x x_k`). Its arm is the foot in its own hip frame, as in the recordings the method was published with.

use std::fmt;

use nalgebra::Matrix3;

use super::error::RobotError;
use super::geometry::Robot;
use super::input_rule::WrenchFrame;
use super::joints::{BODY_DIM, ContactFlags, JOINT_DIM, Leg};
use super::leg::{SINGULAR_BOUND, add_wrench, turn_leg, write_wrench_map};

impl Robot {
    /// The matrix `-J^-T` that maps a leg's torques (N m: abduction, flexion, knee) to its force on the body (N,
    /// equation 4), at joint angles `q` in rad.
    ///
    /// # Errors
    /// [`RobotError::SingularLeg`] at full extension (see `SINGULAR_BOUND`), [`RobotError::NotFinite`].
    pub fn foot_force_map(&self, leg: Leg, q: &[f64; 3]) -> Result<Matrix3<f64>, RobotError> {
        self.require_finite(leg, "joint angle", q)?;
        let map = self.geometry(leg).force_map(q, true);
        map.ok_or_else(|| self.singular(leg, q))
    }

    /// As [`Robot::foot_force_map`], for any posture. Near a singularity (a stretched knee, or a foot at the height of
    /// its hip, where the abduction has no lever) small torques would cause arbitrarily large forces. Levers are
    /// therefore limited from below by [`LEAST_SPAN`](super::leg::LEAST_SPAN) thigh calf over the distance of the foot
    /// and by [`LEAST_HEIGHT`](super::leg::LEAST_HEIGHT) (thigh + calf), on a Go1 some 3 and 5 cm. Elsewhere the map is
    /// exact.
    pub fn damped_force_map(&self, leg: Leg, q: &[f64; 3]) -> Result<Matrix3<f64>, RobotError> {
        self.require_finite(leg, "joint angle", q)?;
        let map = self.geometry(leg).force_map(q, false);
        map.ok_or_else(|| self.singular(leg, q))
    }

    /// Force and moment on the body `[F_lin; F_ang]`, in N and N m (equations 5 to 7, 22). They are sums of `F_k` and
    /// of `x_k x F_k` over the feet in contact, in axes parallel to the body's, with the arms of a frame.
    pub(super) fn wrench_by_arms(
        &self,
        frame: WrenchFrame,
        joints: &[f64; JOINT_DIM],
        torque: &[f64; JOINT_DIM],
        contact: ContactFlags,
    ) -> Result<[f64; BODY_DIM], RobotError> {
        let mut wrench = [0.0; BODY_DIM];
        for leg in Leg::down(contact) {
            let (q, tau) = (leg.of_joints(joints), leg.of_joints(torque));
            self.require_finite(leg, "joint angle", &q)?;
            self.require_finite(leg, "torque", &tau)?;
            let shape = &self.geometry(leg).shape;
            if !add_wrench(shape, &self.arm_from(frame, leg), &q, &tau, &mut wrench) {
                return Err(self.singular(leg, &q));
            }
        }
        Ok(wrench)
    }

    /// The 6 x 12 matrix `G` of `[F_lin; F_ang] = G tau`, row by row; zero columns for legs in the air.
    pub(super) fn map_by_arms(
        &self,
        frame: WrenchFrame,
        joints: &[f64; JOINT_DIM],
        contact: ContactFlags,
    ) -> Result<[f64; BODY_DIM * JOINT_DIM], RobotError> {
        let mut map = [0.0; BODY_DIM * JOINT_DIM];
        for leg in Leg::down(contact) {
            let q = leg.of_joints(joints);
            self.require_finite(leg, "joint angle", &q)?;
            let (shape, columns) = (&self.geometry(leg).shape, &mut map[3 * leg.index()..]);
            if !write_wrench_map(shape, &self.arm_from(frame, leg), &q, columns) {
                return Err(self.singular(leg, &q));
            }
        }
        Ok(map)
    }

    /// From where the arms of moments are, in the frame of the hip.
    fn arm_from(&self, frame: WrenchFrame, leg: Leg) -> [f64; 3] {
        match frame {
            WrenchFrame::Body => [0.0; 3],
            WrenchFrame::World | WrenchFrame::Ground => self.hip_position_m[leg.index()],
        }
    }

    /// Turns every foot about the body's origin by `-turn_rad` of pitch, at most 0.3 rad, to first order in the joint
    /// angles (rad). A leg whose foot cannot be moved stays as it is.
    pub fn turn_legs(&self, turn_rad: f64, joints_rad: &mut [f64; JOINT_DIM]) {
        for leg in Leg::ALL {
            let (shape, hip) = (&self.geometry(leg).shape, &self.hip_position_m[leg.index()]);
            turn_leg(shape, hip, turn_rad, &mut joints_rad[3 * leg.index()..]);
        }
    }

    fn singular(&self, leg: Leg, q: &[f64; 3]) -> RobotError {
        RobotError::SingularLeg {
            robot: self.name.to_owned(),
            leg,
            joints_rad: *q,
            determinant: self.geometry(leg).manipulability(q),
            bound: SINGULAR_BOUND,
        }
    }

    fn require_finite(
        &self,
        leg: Leg,
        quantity: &'static str,
        values: &[f64; 3],
    ) -> Result<(), RobotError> {
        match values.iter().find(|value| !value.is_finite()) {
            None => Ok(()),
            Some(found) => Err(RobotError::NotFinite {
                robot: self.name.to_owned(),
                leg,
                quantity,
                found: *found,
            }),
        }
    }
}

/// Which foot patterns select a phase.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FeetRule {
    /// At least one foot in contact.
    Any,
    /// No foot in contact.
    None,
    /// Exactly one of these patterns (order fr, fl, rr, rl).
    Patterns(Vec<ContactFlags>),
}

const N_PATTERNS: usize = 16;

impl fmt::Display for FeetRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let patterns = match self {
            FeetRule::Any => return f.write_str("any"),
            FeetRule::None => return f.write_str("none"),
            FeetRule::Patterns(_) if self.is_always() => return f.write_str("always"),
            FeetRule::Patterns(patterns) => patterns,
        };
        let digits = |feet: &ContactFlags| feet.map(|down| if down { "1" } else { "0" }).concat();
        f.write_str(&patterns.iter().map(digits).collect::<Vec<_>>().join(","))
    }
}

impl FeetRule {
    /// The rule of a phase that holds for any feet: all patterns.
    pub fn always() -> Self {
        FeetRule::Patterns(Self::all_patterns().collect())
    }

    /// From no foot to four feet.
    pub fn all_patterns() -> impl Iterator<Item = ContactFlags> {
        (0..N_PATTERNS).map(|code| std::array::from_fn(|foot| (code >> foot) & 1 == 1))
    }

    /// Whether it is the rule of all patterns, each in it once.
    pub fn is_always(&self) -> bool {
        matches!(self, FeetRule::Patterns(patterns) if patterns.len() == N_PATTERNS)
    }

    /// Whether the rule names this pattern.
    pub fn matches(&self, feet: ContactFlags) -> bool {
        match self {
            FeetRule::Any => feet.contains(&true),
            FeetRule::None => !feet.contains(&true),
            FeetRule::Patterns(patterns) => patterns.contains(&feet),
        }
    }
}
