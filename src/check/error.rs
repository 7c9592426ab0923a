//! Why two files could not be compared.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::import::ImportError;
use crate::symbolic::ParseError;

/// What is wrong with a file that is to be compared.
#[derive(Debug, Error)]
pub enum CheckError {
    #[error("{}: cannot read the file", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error(
        "{file}: found {found}, expected a model (.json), equations as text (.txt), or LaTeX (.tex, .md)"
    )]
    Kind { file: String, found: String },
    #[error(transparent)]
    File(#[from] ImportError),
    /// An equation that is too large once its numbers are kept as they are written.
    #[error("{file}:{line}: not a usable equation")]
    Expression {
        file: String,
        /// Line of its left side; 0 in a model.
        line: usize,
        source: ParseError,
    },
    #[error("{}: {message}", path.display())]
    Domain { path: PathBuf, message: String },
}
