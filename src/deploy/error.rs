//! How emission fails.

use crate::codegen::CodegenError;
use crate::lower::LowerError;
use crate::mpc::MpcError;
use crate::recording::RecordingError;
use crate::robot::RobotError;
use crate::typeset::TypesetError;

/// Why the files of a target could not be made from a model.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each variant's message names its fields")]
pub enum EmitError {
    #[error(transparent)]
    Typeset(#[from] TypesetError),
    #[error(transparent)]
    Codegen(#[from] CodegenError),
    #[error(transparent)]
    Lower(#[from] LowerError),
    #[error("the controller cannot be generated")]
    Control(#[from] MpcError),
    #[error(
        "model `{model}`: generated controllers take affine encoders and decoders, this one has \
         layers with an activation"
    )]
    Nonlinear { model: String },
    #[error(
        "model `{model}`, phase `{phase}`: found the name that the controller's own functions have in C, \
         expected another"
    )]
    PhaseName { model: String, phase: String },
    #[error("the recorded jump of the example cannot be read")]
    Jump(#[from] RecordingError),
    #[error("the recorded jump of the example has a posture without forces")]
    JumpInput(#[from] RobotError),
    #[error("a template failed")]
    Template(#[from] askama::Error),
}
