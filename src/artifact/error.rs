//! What can be wrong with a model file.

use std::error::Error as _;
use std::io;
use std::path::PathBuf;

use thiserror::Error;

use super::manifest::SCHEMA;
use crate::model::ModelError;

/// Why a model file could not be read or written.
#[derive(Debug, Error)]
pub enum ArtifactError {
    /// The file system refused.
    #[error("{}: cannot {action} the model file", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// The system's answer.
        #[source]
        source: io::Error,
    },
    /// The file is larger than any model can be.
    #[error("{file}: found more than {max} bytes, which no model file needs")]
    TooLarge {
        /// The file.
        file: String,
        /// The bound.
        max: u64,
    },
    /// The file is no JSON, or a value has the wrong type, or a key is unknown, missing or double.
    #[error("{file}: at `{place}`, line {line}, column {column}: {message}")]
    Syntax {
        /// The file.
        file: String,
        /// Path inside the file, such as `encoder.weights[3][2]`.
        place: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Found and expected.
        message: String,
    },
    /// The file follows another schema.
    #[error("{file}: `schema`: found {found}, expected \"{SCHEMA}\"")]
    Schema {
        /// The file.
        file: String,
        /// What it says.
        found: String,
    },
    /// A row of a matrix has the wrong length.
    #[error("{file}: `{tensor}`[{row}]: found {found} numbers, expected {expected}")]
    RowLength {
        /// The file.
        file: String,
        /// Path of the matrix.
        tensor: String,
        /// Row, from 0.
        row: usize,
        /// Its length.
        found: usize,
        /// The length of the other rows, or which the model asks for.
        expected: usize,
    },
    /// The parts do not make a model.
    #[error("{file}: not a usable model")]
    Model {
        /// The file.
        file: String,
        /// What is wrong.
        #[source]
        source: Box<ModelError>,
    },
    /// There is a different file of that name.
    #[error("{}: a file of this name is there already", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
}

/// The error and all its causes in one line.
pub fn describe(error: &ArtifactError) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(source) = cause {
        text.push_str(": ");
        text.push_str(&source.to_string());
        cause = source.source();
    }
    text
}
