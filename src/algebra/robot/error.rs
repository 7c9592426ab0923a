//! Errors of robots: unknown names, joint angles, singular legs.

use thiserror::Error;

use super::joints::Leg;

/// Faults of the robot stage.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum RobotError {
    /// No robot of that name is registered.
    #[error("unknown robot `{found}`; known: {known}")]
    UnknownRobot {
        /// The name asked for.
        found: String,
        /// The registered names, separated by commas.
        known: String,
    },
    /// The leg is so close to full extension (or its foot so close to the axis
    /// of hip abduction) that torques do not determine a foot force.
    #[error(
        "{robot}: leg {leg} is singular at hx {:.4}, hy {:.4}, kn {:.4} rad: \
         normalised determinant {determinant:.2e}, expected at least {bound:.0e}; \
         are the joint angles in rad?",
        joints_rad[0], joints_rad[1], joints_rad[2]
    )]
    SingularLeg {
        /// The robot's name.
        robot: String,
        /// The leg.
        leg: Leg,
        /// Its joint angles: abduction, flexion, knee.
        joints_rad: [f64; 3],
        /// `|det J|` over the product of its link lengths.
        determinant: f64,
        /// The smallest value accepted.
        bound: f64,
    },
    /// A joint angle or torque of a leg in contact is NaN or infinite.
    #[error("{robot}: leg {leg} has the {quantity} {found}, expected a finite number")]
    NotFinite {
        /// The robot's name.
        robot: String,
        /// The leg.
        leg: Leg,
        /// `joint angle` or `torque`.
        quantity: &'static str,
        /// The value.
        found: f64,
    },
}
