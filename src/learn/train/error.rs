//! Errors of a training.

use thiserror::Error;

use super::*;
use crate::limits::OutOfRange;
use crate::recording::RecordingError;

#[derive(Debug, Error)]
pub enum TrainError {
    #[error("no training recording was given")]
    NoRecording,
    #[error("{found} motions cannot be divided into {expected} sets")]
    Split { found: usize, expected: usize },
    #[error(
        "{path}: {found} samples in a segment starting at row {row}, expected at least {expected}"
    )]
    TooFewSamples {
        path: PathBuf,
        /// First row of the segment (1 = header line).
        row: usize,
        found: usize,
        expected: usize,
    },
    #[error(
        "phase `{phase}` has {found} samples in the training recordings, expected at least {expected}: \
         record jumps in which {needed}"
    )]
    PhaseSamples {
        phase: String,
        found: usize,
        expected: usize,
        needed: &'static str,
    },
    #[error(
        "latent dimension {requested}, expected 1 to {active} (the rows that an encoder can have of the coordinates that move or are actuated; `--body all`, `--coordinates free` and `--mask-std 0` allow more)"
    )]
    LatentDim { requested: usize, active: usize },
    #[error("{option} is {found}, expected {expected}")]
    Option {
        option: &'static str,
        found: String,
        expected: &'static str,
    },
    #[error(transparent)]
    Range(#[from] OutOfRange),
    #[error(
        "all {candidates} candidate models diverge on the validation recordings: try another number of latent coordinates or more recordings"
    )]
    NoStableModel { candidates: usize },
    #[error(
        "{path}: term `{term}` is {found:e} at sample {sample} ({time_s} s) in phase `{phase}`, expected a finite number \
         below {limit:e}: leave it out, or scale or shift its argument"
    )]
    TermValue {
        path: PathBuf,
        term: String,
        phase: String,
        /// Of the jump, from 0.
        sample: usize,
        time_s: f64,
        found: f64,
        limit: f64,
    },
    #[error("the recordings change no equation of the model. {reasons}")]
    NothingToRefine { reasons: String },
    #[error("training was cancelled before the first complete model")]
    Cancelled,
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error("the trained model is refused")]
    Model(#[from] ModelError),
}
