//! How an evaluation fails.

use crate::lower::LowerError;
use crate::model::ModelError;
use crate::mpc::MpcError;
use crate::recording::RecordingError;
use crate::sim::SimError;

/// Why a model could not be evaluated on recordings.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// The model lacks a part, such as its encoder or robot.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The model's programs cannot be made.
    #[error(transparent)]
    Lower(#[from] LowerError),
    /// A recording's inputs cannot be computed.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A rollout cannot be integrated.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The controller cannot run.
    #[error(transparent)]
    Control(#[from] MpcError),
}
