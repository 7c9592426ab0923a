//! Joints, legs, geometry and limits of quadrupeds.
//!
//! In: joint angles, torques and contact flags. Out: foot positions, leg Jacobians, the force and moment of the legs on
//! the body (equations 4 to 8, 22 and 23) and limits of commands. Read `joints` for names and order first, then `leg`
//! for one leg, `wrench` for all four and [`InputRule`] for the inputs of a model. `romc_model::robot_file` reads
//! robots from files; generated controllers contain these sources.
//!
//! ```
//! use romc::robot::{Leg, Robot};
//!
//! let go1 = romc::robot_file::by_name("go1")?;
//! let q = [0.0, 0.7, -1.4];
//! let foot = go1.geometry(Leg::FrontRight).foot_position(&q);
//! assert!((foot.x).abs() < 1e-12 && foot.y == -0.08 && foot.z < -0.3);
//!
//! // A leg that extends its knee (positive torque) pushes the body up.
//! let force = go1.foot_force_map(Leg::FrontRight, &q)?;
//! assert!(5.0 * force[(2, 2)] > 0.0);
//! # Ok::<(), romc::robot::RobotError>(())
//! ```

pub(crate) mod geometry;
pub(crate) mod input_rule;
pub(crate) mod joints;
pub(crate) mod leg;
pub(crate) mod links;
pub(crate) mod wrench;

mod error;

pub use error::RobotError;
pub use geometry::{LegGeometry, LegLinks, Robot};
pub use input_rule::{Actuators, DRY_SPEED_RAD_S, InputRule, WrenchFrame, joint_loss, rotation};
pub use joints::{
    BODY_DIM, BODY_NAMES, BODY_X, BODY_Z, ContactFlags, FOOT_DIM, GRAVITY_M_S2, JOINT_DIM,
    JOINT_NAMES, LEG_JOINT_DIM, Leg, STATE_DIM, YAW,
};
pub use leg::{LEAST_HEIGHT, LEAST_SPAN, LegShape, Posture, foot_height};
pub use links::{LegMoments, MovingLeg, Scalar, TrunkMotion};
pub use wrench::FeetRule;

#[cfg(feature = "serde")]
mod serialised;
pub mod sources;

mod phase;
pub use phase::PhasePattern;
