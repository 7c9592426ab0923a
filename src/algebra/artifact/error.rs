//! Faults of model files.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use std::error::Error;
use std::io;

use super::manifest::{SCHEMA, SCHEMA_2};
use crate::files::{Located, Place};
use crate::model::ModelError;
use crate::robot_file::RobotFileError;

/// A fault and its place in a model file.
pub type ArtifactError = Located<ArtifactFault>;

/// Why a model file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ArtifactFault {
    /// The file system refused.
    #[error("cannot {action} the model file")]
    Io {
        action: &'static str,
        source: io::Error,
    },
    /// The file is larger than this bound in bytes, and so than any model.
    #[error("found more than {0} bytes, which no model file needs")]
    TooLarge(u64),
    /// The file is no JSON, or a value has the wrong type, or a key is unknown, missing or double.
    #[error("at `{place}`, line {line}, column {column}: {message}")]
    Syntax {
        /// Path inside the file, such as `encoder.weights[3][2]`.
        place: String,
        line: usize,
        column: usize,
        message: String,
    },
    /// A file that another tool wrote.
    #[error("found {what}, expected a model file of romc: {remedy}")]
    Foreign { what: &'static str, remedy: String },
    /// The file follows another schema.
    #[error("`schema`: found {0}, expected \"{SCHEMA}\" or \"{SCHEMA_2}\"")]
    Schema(String),
    /// A key that the file's schema does not have.
    #[error("`{0}`: found in a file of \"{SCHEMA}\", expected only from \"{SCHEMA_2}\" on")]
    LaterKey(&'static str),
    /// A row of a matrix has the wrong length.
    #[error("found {found} numbers, expected {expected}")]
    RowLength { found: usize, expected: usize },
    /// The robot that the file describes is none.
    #[error("{0}")]
    Robot(RobotFileError),
    /// The parts do not make a model.
    #[error("not a usable model")]
    Model(#[source] Box<ModelError>),
    /// There is a different file of that name.
    #[error("a file of this name is there already")]
    Exists,
}

impl ArtifactFault {
    /// The fault of a file as a whole.
    pub(super) fn of(self, file: &str) -> ArtifactError {
        Located::new(file, Place::Whole, self)
    }
}

/// Parts that do not make a model.
pub(super) fn refused(file: &str, source: impl Into<ModelError>) -> ArtifactError {
    ArtifactFault::Model(Box::new(source.into())).of(file)
}

/// An error and all its causes in one line.
pub fn describe(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(source) = cause {
        text.push_str(": ");
        text.push_str(&source.to_string());
        cause = source.source();
    }
    text
}
