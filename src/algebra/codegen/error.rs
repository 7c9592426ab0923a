//! How code generation fails.

use crate::lower::LowerError;

/// Why no code could be generated from a model.
#[derive(Debug, thiserror::Error)]
pub enum CodegenError {
    /// The model cannot be lowered.
    #[error(transparent)]
    Lower(#[from] LowerError),
    /// A constant is beyond the largest single-precision number.
    #[error(
        "`{function}` has the constant {value:e}, beyond what single precision holds (3.4e38); use `--precision f64`"
    )]
    BeyondSingle {
        /// The function, without the model's name.
        function: String,
        /// The constant.
        value: f64,
    },
    /// A template failed to render.
    #[error("a template failed")]
    Template(#[from] askama::Error),
}
