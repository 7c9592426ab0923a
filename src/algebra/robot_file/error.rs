//! Faults of robot files.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use std::io;

use thiserror::Error;

use crate::files::{Located, Place};
use crate::robot::RobotError;

/// A fault and its place in a robot file.
pub type RobotFileError = Located<RobotFileFault>;

/// What is wrong with a robot file.
#[derive(Debug, Error)]
pub enum RobotFileFault {
    /// Neither a known robot nor a file.
    #[error("{0}, or a file that ends in .toml or .urdf")]
    Unknown(RobotError),
    /// The file system refused.
    #[error("cannot read the file")]
    Read(#[source] io::Error),
    /// The file breaks the syntax of its format, or a key is unknown, missing or of another type.
    #[error("{0}")]
    Syntax(String),
    /// Something else is there than what a robot needs, or nothing.
    #[error("found {found}, expected {expected}")]
    Unexpected { found: String, expected: String },
}

impl RobotFileError {
    /// `found` at a named entry, where `expected` should be.
    pub(super) fn at(
        file: &str,
        entry: impl Into<Box<str>>,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        let (found, expected) = (found.into(), expected.into());
        let place = Place::Entry(entry.into());
        Located::new(file, place, RobotFileFault::Unexpected { found, expected })
    }
}
