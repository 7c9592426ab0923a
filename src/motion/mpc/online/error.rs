//! Errors of setting up a controller.

use thiserror::Error;

use crate::robot::ContactFlags;

/// Why a controller could not be set up or given a reference.
///
/// Once it runs, a controller does not fail: each step's command carries a
/// [`Status`](super::Status).
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ControlError {
    /// A matrix or vector of the plant does not fit the others.
    #[error("plant: `{name}` is {found:?}, expected {expected:?} (rows, columns)")]
    Shape {
        /// Which one.
        name: &'static str,
        /// Its rows and columns.
        found: (usize, usize),
        /// The rows and columns that fit.
        expected: (usize, usize),
    },
    /// A setting is out of its range.
    #[error("setting `{name}` is {found}, expected {expected}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// Its value.
        found: f64,
        /// What it may be.
        expected: &'static str,
    },
    /// A reference has fewer samples than a trajectory needs.
    #[error("the reference has {found} samples, at least {expected} are needed")]
    ReferenceLen {
        /// Its samples.
        found: usize,
        /// The fewest possible.
        expected: usize,
    },
    /// The arrays of a reference do not fit together.
    #[error("reference `{name}` has {found} values, expected {expected}")]
    ReferenceShape {
        /// Which array.
        name: &'static str,
        /// Its length.
        found: usize,
        /// The length that the number of samples asks for.
        expected: usize,
    },
    /// A value of a reference is infinite or not a number.
    #[error("reference `{name}`, sample {sample}, coordinate {coordinate}: {found} is not finite")]
    ReferenceValue {
        /// Which array.
        name: &'static str,
        /// Sample, from zero.
        sample: usize,
        /// Coordinate, from zero.
        coordinate: usize,
        /// The value.
        found: f64,
    },
    /// The time of a reference does not increase.
    #[error(
        "reference time does not increase from sample {sample} ({before} s) to the next ({after} s)"
    )]
    ReferenceTime {
        /// The earlier sample, from zero.
        sample: usize,
        /// Its time, s.
        before: f64,
        /// The time of the next one, s.
        after: f64,
    },
    /// No phase of the model is selected by a foot pattern of the reference.
    #[error(
        "reference sample {sample}: no phase of the model has the feet {feet:?} (fr fl rr rl) in contact"
    )]
    ReferencePhase {
        /// Sample, from zero.
        sample: usize,
        /// Feet in contact there.
        feet: ContactFlags,
    },
    /// The structured solver is not compiled for a latent dimension.
    #[error("the Riccati solver takes up to {largest} latent coordinates, the model has {found}")]
    StructuredDim {
        /// The model's.
        found: usize,
        /// The most that it takes.
        largest: usize,
    },
    /// The conic solver refused the problem it was handed.
    #[error("the conic solver refused the problem: {reason}")]
    Solver {
        /// The solver's own words.
        reason: String,
    },
}
