//! What can go wrong in a rollout.

use crate::model::ModelError;
use crate::recording::RecordingError;

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// The model lacks a part, or a shape does not fit.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The recording cannot be turned into inputs.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}
