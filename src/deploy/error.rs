//! How emission fails.

use crate::codegen::CodegenError;
use crate::lower::LowerError;
use crate::mpc::MpcError;
use crate::recording::RecordingError;
use crate::robot::RobotError;
use crate::typeset::TypesetError;

/// Why the files of a target could not be made from a model.
#[derive(Debug, thiserror::Error)]
pub enum EmitError {
    /// The equations cannot be printed.
    #[error(transparent)]
    Typeset(#[from] TypesetError),
    /// No code can be generated.
    #[error(transparent)]
    Codegen(#[from] CodegenError),
    /// The model cannot be lowered.
    #[error(transparent)]
    Lower(#[from] LowerError),
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
    /// A phase has the name of the controller's functions.
    #[error(
        "model `{model}`, phase `{phase}`: found the name that the controller's own functions have in C, \
         expected another"
    )]
    PhaseName {
        /// Name of the model.
        model: String,
        /// Name of the phase.
        phase: String,
    },
    /// The embedded jump cannot be read.
    #[error("the recorded jump of the example cannot be read")]
    Jump(#[from] RecordingError),
    /// The embedded jump has a posture without ground reaction forces.
    #[error("the recorded jump of the example has a posture without forces")]
    JumpInput(#[from] RobotError),
    /// A template failed to render.
    #[error("a template failed")]
    Template(#[from] askama::Error),
}
