//! Errors of setting up a controller.

use thiserror::Error;

use crate::robot::ContactFlags;

/// Why a controller could not be set up or given a reference; samples and coordinates count from zero. Once it runs, it
/// does not fail: each step's command carries a [`Status`](super::Status).
#[derive(Debug, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "each variant's message names its fields")]
pub enum ControlError {
    #[error("plant: `{name}` is {found:?}, expected {expected:?} (rows, columns)")]
    Shape {
        name: &'static str,
        found: (usize, usize),
        expected: (usize, usize),
    },
    #[error("setting `{name}` is {found}, expected {expected}")]
    Setting {
        name: &'static str,
        found: f64,
        expected: &'static str,
    },
    #[error("the reference has {found} samples, at least {expected} are needed")]
    ReferenceLen { found: usize, expected: usize },
    #[error("reference `{name}` has {found} values, expected {expected}")]
    ReferenceShape {
        name: &'static str,
        found: usize,
        expected: usize,
    },
    #[error("reference `{name}`, sample {sample}, coordinate {coordinate}: {found} is not finite")]
    ReferenceValue {
        name: &'static str,
        sample: usize,
        coordinate: usize,
        found: f64,
    },
    #[error(
        "reference time does not increase from sample {sample} ({before} s) to the next ({after} s)"
    )]
    ReferenceTime {
        sample: usize,
        before: f64,
        after: f64,
    },
    #[error(
        "reference sample {sample}: no phase of the model has the feet {feet:?} (fr fl rr rl) in contact"
    )]
    ReferencePhase { sample: usize, feet: ContactFlags },
    #[error(
        "the Riccati solver supports up to {largest} latent coordinates, the model has {found}"
    )]
    StructuredDim { found: usize, largest: usize },
    #[error("the conic solver refused the problem: {reason}")]
    Solver { reason: String },
}
