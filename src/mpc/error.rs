//! What can go wrong before a controller runs.

use thiserror::Error;

/// Why a controller could not be built or given a reference.
///
/// Once it runs, a controller does not fail: each step's command carries a
/// [`Status`](super::Status).
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MpcError {
    /// The conic solver refused the problem it was handed.
    #[error("the conic solver refused the problem: {reason}")]
    Solver {
        /// The solver's own words.
        reason: String,
    },
}
