//! What can keep a model from being trained.

use std::path::PathBuf;

use thiserror::Error;

use crate::limits::OutOfRange;
use crate::model::ModelError;
use crate::recording::RecordingError;
use crate::robot::RobotError;

/// Why training stopped without a model.
#[derive(Debug, Error)]
pub enum TrainError {
    /// No recording was given.
    #[error("no {set} recording was given")]
    NoRecording {
        /// `training` or `validation`.
        set: &'static str,
    },
    /// There are fewer jumps than sets to divide them into.
    #[error("{found} jumps cannot be divided into {expected} sets")]
    Split {
        /// Jumps in the recordings.
        found: usize,
        /// Sets with a share.
        expected: usize,
    },
    /// A recording is too short to learn from.
    #[error(
        "{path}: {found} samples in a segment starting at row {row}, expected at least {expected}"
    )]
    TooFewSamples {
        /// File.
        path: PathBuf,
        /// First row of the segment (1 = header line).
        row: usize,
        /// Samples found.
        found: usize,
        /// Samples needed.
        expected: usize,
    },
    /// A phase of the model has too few samples over all training recordings.
    #[error(
        "phase `{phase}` has {found} samples in the training recordings, expected at least {expected}: \
         record jumps in which {needed}"
    )]
    PhaseSamples {
        /// Name of the phase.
        phase: String,
        /// Samples found.
        found: usize,
        /// Samples needed.
        expected: usize,
        /// What the recordings would have to show.
        needed: &'static str,
    },
    /// More latent coordinates than the encoder may look at, or none.
    #[error(
        "latent dimension {requested}, expected 1 to {active} (the rows that an encoder can have of the coordinates that move or are actuated; `--coordinates free` and `--mask-std 0` allow more)"
    )]
    LatentDim {
        /// What was asked for.
        requested: usize,
        /// Coordinates that pass the mask.
        active: usize,
    },
    /// An option is outside its range.
    #[error("{option} is {found}, expected {expected}")]
    Option {
        /// Name of the option as on the command line.
        option: &'static str,
        /// Value given.
        found: String,
        /// Range.
        expected: &'static str,
    },
    /// A number is outside the range of its setting.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// Every candidate model left the range of finite numbers on the validation recordings.
    #[error(
        "all {candidates} candidate models diverge on the validation recordings: try another number of latent coordinates or more recordings"
    )]
    NoStableModel {
        /// Candidates tried.
        candidates: usize,
    },
    /// A candidate term has no usable value at a training sample.
    #[error(
        "{path}: term `{term}` is {found:e} at sample {sample} ({time_s} s) in phase `{phase}`, expected a finite number \
         below {limit:e}: leave it out, or scale or shift what is inside"
    )]
    TermValue {
        /// File.
        path: PathBuf,
        /// The term.
        term: String,
        /// Name of the phase.
        phase: String,
        /// Sample of the jump, from 0.
        sample: usize,
        /// Time of the sample in the recording.
        time_s: f64,
        /// Value of the term.
        found: f64,
        /// Magnitude above which squares overflow.
        limit: f64,
    },
    /// The training was cancelled before there was a model to keep.
    #[error("training was cancelled before the first complete model")]
    Cancelled,
    /// A recording could not be turned into inputs.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The robot refused.
    #[error(transparent)]
    Robot(#[from] RobotError),
    /// The trained numbers do not form a model.
    #[error("the trained model is refused")]
    Model(#[from] ModelError),
}
