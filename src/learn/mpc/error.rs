//! Errors of setting up a controller.

use std::path::PathBuf;

use thiserror::Error;

use crate::lower::LowerError;
use crate::model::ModelError;
use crate::online::ControlError;
use crate::recording::RecordingError;

/// Why a controller could not be built or given a reference.
///
/// Once it runs, a controller does not fail: each step's command carries a [`Status`](super::Status).
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "each variant's message names its fields")]
pub enum MpcError {
    #[error("the model cannot be used for control")]
    Model(#[from] ModelError),
    #[error("the model's dynamics cannot be compiled")]
    Lower(#[from] LowerError),
    #[error("the recording cannot be used for control")]
    Recording(#[from] RecordingError),
    #[error("the model's encoder takes {found} coordinates, the robot has {expected}")]
    StateDim { found: usize, expected: usize },
    #[error("input statistics of phase `{phase}`: the covariance cannot be factorised")]
    Statistics { phase: String },
    #[error("{}: a sample every {:.3} ms; found a step of {} s, expected at least as long (`romc mpc --step {}`)", path.display(), recorded_s * 1e3, found_s, (recorded_s * 1e4).ceil() / 1e4)]
    Step {
        path: PathBuf,
        found_s: f64,
        /// Time between samples, s.
        recorded_s: f64,
    },
    #[error("{}: {longest_s:.3} s without a gap, found a step of {found_s:.3e} s, expected a shorter one or a longer recording", path.display())]
    NoStep {
        path: PathBuf,
        found_s: f64,
        /// The recording's longest segment, s.
        longest_s: f64,
    },
    #[error(transparent)]
    Control(#[from] ControlError),
}
