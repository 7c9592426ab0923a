//! One error for the whole library: the errors of all stages as variants.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use std::io;
use std::path::{Path, PathBuf};

use crate::equations::PhysicalError;
use crate::files::Place;
use crate::robot::RobotError;
use crate::robot_file::RobotFileError;
use crate::simplify::SimplifyError;
use crate::train::TrainError;

/// Errors of all stages, from a recording to a torque.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    #[error(transparent)]
    Robot(#[from] RobotError),
    #[error(transparent)]
    RobotFile(#[from] RobotFileError),
    #[error(transparent)]
    Recording(#[from] crate::recording::RecordingError),
    #[error(transparent)]
    Model(#[from] crate::model::ModelError),
    /// A model file, or one of a model trained elsewhere.
    #[error(transparent)]
    ModelFile(#[from] crate::artifact::ArtifactError),
    #[error(transparent)]
    Identify(#[from] crate::identify::IdentifyError),
    #[error(transparent)]
    Check(#[from] crate::check::CheckError),
    #[error(transparent)]
    Name(#[from] crate::import::NameError),
    #[error(transparent)]
    Train(#[from] TrainError),
    #[error(transparent)]
    Emit(#[from] crate::deploy::EmitError),
    #[error(transparent)]
    Typeset(#[from] crate::typeset::TypesetError),
    #[error(transparent)]
    Codegen(#[from] crate::codegen::CodegenError),
    #[error(transparent)]
    Rename(#[from] crate::typeset::RenameError),
    #[error(transparent)]
    Folder(#[from] crate::files::FolderError),
    #[error(transparent)]
    Lower(#[from] crate::lower::LowerError),
    #[error(transparent)]
    Sim(#[from] crate::sim::SimError),
    #[error(transparent)]
    Physical(#[from] PhysicalError),
    #[error(transparent)]
    Evaluate(#[from] crate::evaluate::EvaluateError),
    #[error(transparent)]
    Simplify(#[from] SimplifyError),
    #[error(transparent)]
    Study(#[from] crate::study::StudyError),
    #[error(transparent)]
    Mpc(#[from] crate::mpc::MpcError),
    #[error(transparent)]
    Plan(#[from] crate::plan::PlanError),
    #[error("plan refused: {0} (--force writes it anyway)")]
    Distrusted(String),
    /// A file that cannot be used or written as the command line asks.
    #[error("{path}: {message}", path = path.display())]
    Config { path: PathBuf, message: String },
    /// An output whose name the command does not accept.
    #[error("{path}: {message}", path = path.display())]
    Output { path: PathBuf, message: String },
    #[error("found {found}, expected one {expected}")]
    NotOne {
        found: String,
        expected: &'static str,
    },
    #[error("{flag} has no effect here; it needs {needs}")]
    Idle {
        flag: &'static str,
        needs: &'static str,
    },
    /// An imported model that does not fit the recordings given with it.
    #[error("{file}: {fault}; --unchecked writes the model all the same", file = file.display())]
    Mismatch { file: PathBuf, fault: String },
    #[error("{0}: already exists; pass --force to replace it, or choose another name")]
    Exists(PathBuf),
    #[error("{path}: cannot read", path = path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("{path}: cannot write")]
    Write { path: PathBuf, source: io::Error },
}

impl Error {
    pub(crate) fn refused(path: &Path, message: impl Into<String>) -> Self {
        let (path, message) = (path.to_owned(), message.into());
        Self::Config { path, message }
    }

    /// Whether an option had a value that it cannot have, as opposed to a run that failed.
    pub(crate) fn is_usage(&self) -> bool {
        match self {
            Self::Robot(error) => matches!(error, RobotError::UnknownRobot { .. }),
            Self::RobotFile(error) => error.file.is_empty(),
            Self::ModelFile(error) => matches!(error.place, Place::Option(_)),
            Self::Physical(error) => matches!(error, PhysicalError::LatentOnly { .. }),
            Self::Train(error) => matches!(error, TrainError::Option { .. }),
            Self::Simplify(error) => {
                matches!(error, SimplifyError::NoSamples | SimplifyError::Margin)
            }
            // Exit code 1 of `check` means that two files differ.
            Self::Check(_) | Self::Rename(_) | Self::Name(_) => true,
            Self::Output { .. } | Self::NotOne { .. } | Self::Idle { .. } => true,
            Self::Recording(_) | Self::Model(_) | Self::Identify(_) | Self::Emit(_) => false,
            Self::Typeset(_) | Self::Codegen(_) | Self::Folder(_) | Self::Lower(_) => false,
            Self::Sim(_) | Self::Evaluate(_) | Self::Study(_) | Self::Mpc(_) | Self::Plan(_) => {
                false
            }
            Self::Distrusted(_) | Self::Config { .. } | Self::Mismatch { .. } => false,
            Self::Exists(_) | Self::Read { .. } | Self::Write { .. } => false,
        }
    }
}
