//! What runs at the robot: from a plant, its dynamics and a reference to commands.
//!
//! In: a [`Plant`] (plain numbers), [`LatentDynamics`], a reference, measurements. Out: commands.
//! Nothing here knows of models, programs or recordings: besides nalgebra and clarabel these files
//! import [`robot`](crate::robot) alone, because `romc compile --emit controller` emits this very
//! folder. Read `problem` first.

mod command;
mod controller;
mod curved;
mod dynamics;
mod error;
pub mod estimate;
mod fallback;
mod horizon;
pub mod interface;
mod layout;
pub(super) mod lift;
pub mod linearise;
mod plan;
mod plant;
pub mod problem;
mod prune;
mod qp;
mod reference;
mod settings;
mod sparse;
mod transcribe;

pub use command::{Command, Source, Status};
pub use controller::{Controller, Measurement};
pub use curved::CurvedMaps;
pub use dynamics::LatentDynamics;
pub use error::ControlError;
pub use lift::{ConsistentLift, Footing, LiftFailure};
pub use plan::Plan;
pub use plant::{Plant, PlantParts, PlantPhase};
pub use qp::{Cone, ConeProgram, Outcome, QpSettings, QpSolver, Residuals, SolverProfile};
pub use reference::{Reference, ReferenceSamples};
pub use settings::{
    Drift, FallbackSettings, Lift, Linearisation, MAX_HORIZON, MissingInput, MpcSettings,
    RowSelection,
};
pub use sparse::SparseColumns;
