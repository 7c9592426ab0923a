//! Errors of a study.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use std::io;
use std::path::PathBuf;

#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// A range of dimensions or seeds that cannot be trained.
    #[error("{found}, expected {expected}")]
    Range {
        found: String,
        expected: &'static str,
    },
    #[error(transparent)]
    Seeds(#[from] crate::limits::OutOfRange),
    #[error(
        "{path}: belongs to another study ({difference} differ); choose another folder, or repeat the command that made it"
    )]
    OtherStudy {
        path: PathBuf,
        difference: &'static str,
    },
    #[error("{path}: {message}")]
    Broken { path: PathBuf, message: String },
    /// Two parts computed the same training with different results.
    #[error("{first} and {second} are the same training with different results")]
    Contradiction { first: PathBuf, second: PathBuf },
    /// The file system refused to `read`, `write` or `make the folder`.
    #[error("{path}: cannot {action}")]
    File {
        path: PathBuf,
        action: &'static str,
        source: io::Error,
    },
}
