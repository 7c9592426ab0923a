//! Legs in flight, turned against the body's error of pitch.
//!
//! Nothing holds the pitch of a body in the air. Legs that are where the reference has them from the body put the feet
//! elsewhere from the ground: on a body that has turned 0.1 rad too far forwards, some 3 cm too far back. With the hip
//! `h`, the foot `p(q)` from it and the error `e` of pitch, a leg is commanded
//!
//! ```text
//! q + J(q)^-1 (R_y(-s e) - 1) (h + p(q))
//! ```
//!
//! which turns the foot about the body's origin by the share `s` of the error, to first order in the joints.

use super::control_model::ControlModel;
use super::dense::Real;
use crate::robot::{JOINT_DIM, Leg};

/// Most that legs are turned, rad.
const MOST_TURN_RAD: Real = 0.3;

impl ControlModel {
    /// Joint angles, rad, with every foot turned about the body's origin by `-turn_rad` of pitch. A leg whose foot
    /// cannot be moved stays as it is.
    pub(super) fn turned_legs(
        &self,
        joints_rad: &[f64; JOINT_DIM],
        turn_rad: f64,
    ) -> [f64; JOINT_DIM] {
        let mut turned = *joints_rad;
        let (sine, cosine) = turn_rad.clamp(-MOST_TURN_RAD, MOST_TURN_RAD).sin_cos();
        let robot = self.robot();
        for leg in Leg::ALL {
            let q = leg.of_joints(joints_rad);
            let Ok(map) = robot.damped_force_map(leg, &q) else {
                continue;
            };
            let foot = robot.foot_from_body(leg, &q);
            let forward = (cosine - 1.0) * foot.x - sine * foot.z;
            let up = sine * foot.x + (cosine - 1.0) * foot.z;
            for joint in 0..3 {
                // The map is -J^-T.
                turned[3 * leg.index() + joint] -= map[(0, joint)] * forward + map[(2, joint)] * up;
            }
        }
        turned
    }
}
