//! How typesetting fails.

use super::expression::UnknownSymbol;
use super::robot::RobotTypesetError;

/// Why the equations of a model could not be printed.
#[derive(Debug, thiserror::Error)]
pub enum TypesetError {
    /// A variable has no symbol in print.
    #[error(transparent)]
    Symbol(#[from] UnknownSymbol),
    /// The model cannot be printed in robot coordinates.
    #[error(transparent)]
    Robot(#[from] RobotTypesetError),
    /// A template failed to render.
    #[error("a template failed")]
    Template(#[from] askama::Error),
}
