//! Errors of a study.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// Why a study stopped.
#[derive(Debug, Error)]
pub enum StudyError {
    /// A range of dimensions or seeds that cannot be trained.
    #[error("{found}, expected {expected}")]
    Range {
        /// The request.
        found: String,
        /// The accepted range.
        expected: &'static str,
    },
    /// A folder holds another study.
    #[error(
        "{path}: belongs to another study ({difference} differ); choose another folder, or repeat the command that made it"
    )]
    OtherStudy {
        /// Its plan.
        path: PathBuf,
        /// Which part of the plan is not the same.
        difference: &'static str,
    },
    /// A file of a study does not hold what it should.
    #[error("{path}: {message}")]
    Broken {
        /// The file.
        path: PathBuf,
        /// The fault and its place.
        message: String,
    },
    /// Two parts computed the same training with different results.
    #[error("{first} and {second} are the same training with different results")]
    Contradiction {
        /// One file.
        first: PathBuf,
        /// The other.
        second: PathBuf,
    },
    /// The file system refused.
    #[error("{path}: cannot {action}")]
    File {
        /// File or folder.
        path: PathBuf,
        /// `read`, `write`, `make the folder`.
        action: &'static str,
        /// Why.
        source: io::Error,
    },
}
