//! The latent-space model-predictive controller: measured state in, joint torques out.
//!
//! In: a [`ReducedModel`](crate::model::ReducedModel) with encoder, decoder, robot and input statistics; a reference
//! trajectory; measurements. Out: a [`Command`] per control step, whose torques are always within the robot's limits,
//! and a [`Status`].
//!
//! `of_model` extracts the data that the controller needs. `romc_control::online` is the controller, the folder that is
//! emitted for a robot. Read `online/problem` first (the optimal control problem), then `reference` (the trajectory,
//! encoded), `horizon` (phases and linearised dynamics, with `linearise`) and `stage` (one stage, scaled). The solvers
//! follow (`conic` and `qp` for clarabel, `structured`), then `controller`, `step` (plan to command) and `lift`
//! (torques consistent with ground forces). [`evaluate::along_recording()`](crate::evaluate::along_recording()) runs it
//! on recorded jumps.

mod of_model;
mod strides;

pub use crate::online::*;
pub use of_model::{
    LIFTS, MpcError, SOLVERS, STEP_SLACK, control_model, controller, words_of_setting,
};
pub use strides::{settings_for, walk_settings, walk_strides};
