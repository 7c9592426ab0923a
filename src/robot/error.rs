//! Errors of robots: unknown names, joint angles, singular legs.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use thiserror::Error;

use super::joints::Leg;

#[derive(Debug, Clone, PartialEq, Error)]
pub enum RobotError {
    #[error("unknown robot `{found}`; known: {known}")]
    UnknownRobot { found: String, known: String },
    /// So close to full extension (or the foot to the hip abduction's axis) that torques determine no foot force.
    #[error(
        "{robot}: leg {leg} is singular at hx {:.4}, hy {:.4}, kn {:.4} rad: \
         normalised determinant {determinant:.2e}, expected at least {bound:.0e}; \
         are the joint angles in rad?",
        joints_rad[0], joints_rad[1], joints_rad[2]
    )]
    SingularLeg {
        robot: String,
        leg: Leg,
        joints_rad: [f64; 3],
        /// `|det J|` over the product of its link lengths.
        determinant: f64,
        bound: f64,
    },
    #[error("{robot}: leg {leg} has the {quantity} {found}, expected a finite number")]
    NotFinite {
        robot: String,
        leg: Leg,
        quantity: &'static str,
        found: f64,
    },
}
