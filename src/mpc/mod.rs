//! The latent-space model-predictive controller: measured state in, joint torques out.
//!
//! In: a [`ReducedModel`](crate::model::ReducedModel) with encoder, decoder, robot and input
//! statistics; a reference trajectory; measurements. Out: a [`Command`] a control step, whose torques
//! are within the robot's limits whatever happened, and a [`Status`] that says what did.
//!
//! Read `problem` first, which states the optimal control problem. From there one torque is made by
//! `reference` (what to follow, encoded), `horizon` (phases and linearised dynamics of the stages,
//! with `linearise`), `transcribe` (the conic program), `qp` (clarabel, and the check of what it
//! returns), `controller` (plan to command; what to do without a plan) and, if asked for, `lift`
//! (torques that the ground can answer). [`along_recording`] runs it all on recorded jumps.
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
mod command;
mod controller;
mod error;
pub mod estimate;
mod horizon;
mod lift;
pub mod linearise;
mod metrics;
mod plan;
mod plant;
pub mod problem;
mod prune;
mod qp;
mod reference;
mod settings;
mod sparse;
mod transcribe;

pub use along_recording::{ReferenceInput, Run, StepRow, along_recording, lift_comparison};
pub use command::{Command, Source, Status};
pub use controller::{Controller, Measurement};
pub use error::MpcError;
pub use lift::{ConsistentLift, Footing, LiftFailure};
pub use metrics::{ByContact, Comparison, StepTimes, Summary};
pub use plan::Plan;
pub use plant::{Plant, PlantPhase};
pub use qp::{Cone, ConeProgram, Outcome, QpSettings, QpSolver, Residuals, SolverProfile};
pub use reference::{Reference, ReferenceSamples};
pub use settings::{
    Drift, FallbackSettings, Lift, Linearisation, MAX_HORIZON, MissingInput, MpcSettings,
    RowSelection,
};
pub use sparse::SparseColumns;
