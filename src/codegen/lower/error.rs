//! Why a model cannot be lowered.

use thiserror::Error;

use crate::ir::IrError;
use crate::model::ModelError;

/// Why a program could not be made from a model.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LowerError {
    /// The model lacks what the program needs, or has no such phase.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A coefficient is too large once folded with the numbers of its term.
    #[error("phase `{phase}`, output {output}: a folded coefficient is {value}")]
    NonFinite {
        /// Name of the phase.
        phase: String,
        /// Row of the equations, from 1.
        output: usize,
        /// What the coefficient became.
        value: f64,
    },
    /// The program breaks one of its promises.
    #[error(transparent)]
    Program(#[from] IrError),
}
