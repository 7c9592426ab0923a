//! Faults of files of models trained elsewhere, and of the options given with them.

use std::io;

use thiserror::Error;

use crate::files::{Located, Place};
use crate::model::ModelError;
use crate::symbolic::ParseErrorKind;

/// A fault and its place: the file, a tensor with its use, a character of a text, or an option.
pub type ImportError = Located<ImportFault>;

/// What is wrong at a place.
#[derive(Debug, Error)]
pub enum ImportFault {
    /// The file system refused.
    #[error("cannot read the file")]
    Io(#[from] io::Error),
    /// The file, or one tensor of it, is larger than any model needs.
    #[error("found more than {max} {unit}, which no model needs")]
    TooLarge {
        /// The bound.
        max: u64,
        /// What is counted.
        unit: &'static str,
    },
    /// The container is damaged.
    #[error("not a usable {format} file: {found}")]
    Container {
        /// `safetensors` or `npz`.
        format: &'static str,
        /// The message of the container's reader.
        found: String,
    },
    /// Something else is there than what a model needs, or nothing.
    #[error("found {found}, expected {expected}")]
    Unexpected {
        /// What is there.
        found: Box<str>,
        /// What could be, or the option that settles it.
        expected: Box<str>,
    },
    /// The right side of an equation cannot be read.
    #[error(transparent)]
    Syntax(#[from] ParseErrorKind),
    /// The parts do not make a model; tensors are named as in the model file.
    #[error("not a usable model")]
    Model(#[source] Box<ModelError>),
}

impl ImportFault {
    /// `found` at a place, where `expected` should be.
    pub(super) fn at(
        file: &str,
        place: Place,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> ImportError {
        let (found, expected) = (found.into(), expected.into());
        Located::new(file, place, Self::Unexpected { found, expected })
    }

    /// An option that cannot be followed.
    pub(crate) fn option(
        option: &'static str,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> ImportError {
        Self::at("", Place::Option(option), found, expected)
    }

    /// Parts that do not make a model.
    pub(super) fn model(file: &str, source: impl Into<ModelError>) -> ImportError {
        let fault = ImportFault::Model(Box::new(source.into()));
        Located::new(file, Place::Whole, fault)
    }

    /// A file with more than `max` of `unit`.
    pub(super) fn too_large(file: &str, max: u64, unit: &'static str) -> ImportError {
        Located::new(file, Place::Whole, ImportFault::TooLarge { max, unit })
    }
}

/// A shape in words: `18 x 4`, `4 numbers`, `one number`.
pub(super) fn shape_text(shape: &[usize]) -> String {
    match shape {
        [] => "one number".to_owned(),
        [length] => format!("{length} numbers"),
        _ => {
            let dims: Vec<String> = shape.iter().map(usize::to_string).collect();
            dims.join(" x ")
        }
    }
}
