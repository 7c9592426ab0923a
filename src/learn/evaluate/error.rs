//! How an evaluation fails.

use crate::lower::LowerError;
use crate::model::ModelError;
use crate::mpc::MpcError;
use crate::recording::RecordingError;
use crate::sim::SimError;

#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Lower(#[from] LowerError),
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(transparent)]
    Sim(#[from] SimError),
    #[error(transparent)]
    Control(#[from] MpcError),
}
