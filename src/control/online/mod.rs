//! The controller proper: from maps, dynamics and a reference to commands.
//!
//! In: a [`ControlModel`] (plain numbers), [`LatentDynamics`], a reference, measurements. Out: commands. Nothing here
//! depends on models, programs or recordings: these files import only nalgebra, clarabel, [`robot`](crate::robot) and
//! [`solver`](crate::solver), because `romc compile --emit controller` emits this folder unchanged. `src/translate`
//! generates the C code from its functions on plain slices (`trajectory`, and parts of other files). Read `problem`
//! first.

// Loops over indices are translated to C.
#![allow(
    clippy::assign_op_pattern,
    clippy::manual_clamp,
    clippy::manual_memcpy,
    clippy::manual_range_contains,
    clippy::needless_range_loop,
    clippy::too_many_arguments,
    clippy::unnecessary_cast
)]
mod choices;
mod command;
mod conic;
mod contacts;
mod control_model;
mod controller;
mod dense;
mod effectiveness;
mod error;
pub(crate) mod estimate;
mod horizon;
pub mod interface;
mod lift;
mod lift_program;
pub(crate) mod linearise;
mod machine;
mod plan;
pub mod problem;
mod qp;
mod reference;
mod routine;
mod settings;
mod stage;
mod step;
pub mod structured;
mod supervisor;
mod trajectory;
mod walk;
mod walker;

pub use crate::solver::{Outcome, Residuals};
pub use command::{Command, Source, Status};
pub use control_model::{ControlModel, ControlPhase, NonlinearMaps};
pub use controller::{Controller, Measurement};
pub use error::ControlError;
pub use estimate::InputGivenState;
pub use lift::{ConsistentLift, LiftFailure, StanceState, foot_forces, torque_deviation};
pub use linearise::LatentDynamics;
pub use machine::Machine;
pub use plan::Plan;
pub use qp::{Cone, ConeProgram, QpSettings, QpSolver, SolverProfile, sparse};
pub use reference::{Reference, ReferenceSamples};
pub use routine::{Mode, Timing};
pub use settings::{
    AfterEnd, Drift, Drives, FallbackSettings, Legs, Lift, Linearisation, MissingInput,
    MpcSettings, RowSelection, Solver,
};
pub use supervisor::Bounds;
pub use trajectory::NO_PHASE;
pub use walk::Strides;
pub use walker::{Gait, WINDOW as WALK_WINDOW};
