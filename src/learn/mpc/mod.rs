//! The latent-space model-predictive controller: measured state in, joint torques out.
//!
//! In: a [`ReducedModel`](crate::model::ReducedModel) with encoder, decoder, robot and input statistics; a reference
//! trajectory; measurements. Out: a [`Command`] a control step, whose torques are within the robot's limits whatever
//! happened, and a [`Status`] that says what did.
//!
//! `of_model` takes from the model what the controller needs; `romc_control::online` is the controller itself, the
//! folder that is emitted for a robot. Read `online/problem` first, which states the optimal control problem. From
//! there one torque is made by `reference` (the trajectory, encoded), `horizon` (phases and linearised dynamics, with
//! `linearise`), `stage` (one stage, scaled), the solvers behind `engine` (`conic` and `qp` for clarabel,
//! `structured`), `controller` and `step` (plan to command), `fallback` (without a plan) and, if asked for, `lift`
//! (torques that the ground can answer). [`evaluate::along_recording()`](crate::evaluate::along_recording()) runs it
//! all on recorded jumps.

mod of_model;

pub use crate::online::*;
pub use of_model::{LIFTS, MpcError, SOLVERS, STEP_SLACK, control_model, controller};
