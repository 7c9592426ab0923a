//! What can go wrong in a rollout.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use crate::model::ModelError;
use crate::recording::RecordingError;

/// Errors of simulation.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// The model lacks a part, or a shape does not fit.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The recording cannot be turned into inputs.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// No phase of the model covers a recorded foot pattern.
    #[error(
        "{segment}, row {row}: no phase of `{model}` covers the foot pattern {found:?} (fr fl rr rl)"
    )]
    NoPhase {
        model: String,
        segment: String,
        row: usize,
        found: [bool; 4],
    },
}
