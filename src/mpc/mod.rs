//! The latent-space model-predictive controller: measured state in, joint torques out.
//!
//! In: a [`ReducedModel`](crate::model::ReducedModel) with encoder, decoder, robot and input
//! statistics; a reference trajectory; measurements. Out: a [`Command`] a control step, whose torques
//! are within the robot's limits whatever happened, and a [`Status`] that says what did.
//!
//! `of_model` takes from the model what the controller needs; `online` is the controller itself,
//! the folder that is emitted for a robot. Read `online/problem` first, which states the optimal
//! control problem. From there one torque is made by `reference` (what to follow, encoded), `horizon` (phases and linearised dynamics of the stages,
//! with `linearise`), `layout` and `transcribe` (the conic program), `qp` (clarabel, and the check of what it
//! returns), `controller` (plan to command; what to do without a plan) and, if asked for, `lift`
//! (torques that the ground can answer). [`along_recording()`] runs it all on recorded jumps.
//!
//! ```
//! use std::path::Path;
//! use romc::mpc::{Controller, MpcSettings, ReferenceInput, along_recording};
//!
//! let root = Path::new(env!("CARGO_MANIFEST_DIR"));
//! let model = romc::artifact::read(&root.join("models/go1-d4.json"))?;
//! let jump = romc::recording::read(&root.join("examples/recordings/go1/test_01.csv.gz"))?;
//! let mut controller = Controller::new(&model, MpcSettings::default())?;
//! let run = along_recording(&mut controller, &jump, ReferenceInput::Recorded, |_, _| {})?;
//! assert_eq!(run.summary.limit_violations, 0);
//! assert!(run.summary.torque_r2.contact > Some(0.85));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod along_recording;
mod error;
mod metrics;
mod of_model;
mod online;

pub use along_recording::{ReferenceInput, Run, StepRow, along_recording, lift_comparison};
pub use error::MpcError;
pub use metrics::{ByContact, Comparison, StepTimes, Summary};
pub use online::*;
