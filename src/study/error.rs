//! Errors of a study.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use std::io;
use std::path::PathBuf;

#[derive(Debug, thiserror::Error)]
pub enum StudyError {
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
    #[error("{first} and {second} are the same training with different results")]
    Contradiction { first: PathBuf, second: PathBuf },
    #[error("{path}: cannot {action}")]
    File {
        path: PathBuf,
        action: &'static str,
        source: io::Error,
    },
}
