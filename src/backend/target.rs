//! What backends have in common: the files they make and how they fail.

use super::typeset::{RobotTypesetError, UnknownSymbol};
use crate::lower::LowerError;
use crate::mpc::MpcError;

/// A file that a backend made, not yet on disk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EmittedFile {
    /// Path relative to the output folder, with `/` between its parts.
    pub path: String,
    /// What the file holds.
    pub contents: String,
}

impl EmittedFile {
    /// A file at `path` with `contents`.
    pub fn new(path: impl Into<String>, contents: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            contents: contents.into(),
        }
    }
}

/// Why a backend could not emit a model.
#[derive(Debug, thiserror::Error)]
pub enum EmitError {
    /// A variable has no symbol in print.
    #[error(transparent)]
    Symbol(#[from] UnknownSymbol),
    /// The model cannot be printed in robot coordinates.
    #[error(transparent)]
    Robot(#[from] RobotTypesetError),
    /// The model cannot be lowered.
    #[error(transparent)]
    Lower(#[from] LowerError),
    /// There is no such target.
    #[error("target `{found}`: expected one of {expected}")]
    UnknownTarget {
        /// The name given.
        found: String,
        /// The names that there are.
        expected: String,
    },
    /// A constant is beyond the largest single-precision number.
    #[error("`{function}` has the constant {value:e}, beyond what single precision holds (3.4e38)")]
    BeyondSingle {
        /// The function, without the model's name.
        function: String,
        /// The constant.
        value: f64,
    },
    /// The model lacks what a controller needs.
    #[error("the controller cannot be generated")]
    Control(#[from] MpcError),
    /// Encoder or decoder of a model for control are not affine.
    #[error(
        "model `{model}`: generated controllers take affine encoders and decoders, this one has \
         layers with an activation"
    )]
    Nonlinear {
        /// Name of the model.
        model: String,
    },
    /// A template failed to render.
    #[error("a template failed")]
    Template(#[from] askama::Error),
}
