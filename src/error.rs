//! One error for the whole library: each stage's own, told apart by variant.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use std::io;
use std::path::{Path, PathBuf};

use crate::equations::PhysicalError;
use crate::files::Place;
use crate::robot::RobotError;
use crate::robot_file::RobotFileError;
use crate::simplify::SimplifyError;
use crate::train::TrainError;

/// What can go wrong between a recording and a torque.
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
    Physical(#[from] crate::equations::PhysicalError),
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
    /// A plan that nothing should carry out.
    #[error("no plan to be trusted: {0} (--force writes it all the same)")]
    Distrusted(String),
    /// A file of settings that cannot be used; the message of its parser names line, key and what was expected.
    #[error("{path}: {message}", path = path.display())]
    Config { path: PathBuf, message: String },
    /// An MCAP file holds one stretch of time.
    #[error("found {0} segments, expected one for an MCAP file")]
    OneSegment(usize),
    /// The ending of an output says its format.
    #[error("{path}: found {found}, expected a name that ends in {expected}", path = path.display())]
    Ending {
        path: PathBuf,
        found: String,
        expected: String,
    },
    /// An output that would replace an input.
    #[error("{path}: the command reads this file{other}, and does not replace it; choose another name for the output", path = path.display(), other = other_name(path, input))]
    IsRead { path: PathBuf, input: PathBuf },
    /// A flag that the command would ignore.
    #[error("{flag} has no effect here; it needs {needs}")]
    Idle {
        flag: &'static str,
        needs: &'static str,
    },
    /// A map is guessed of one log at a time.
    #[error("found {0} files, expected one log to guess a map of")]
    OneLog(usize),
    /// An imported model that does not fit the recordings given with it.
    #[error("{file}: {fault}; --unchecked writes the model all the same", file = file.display())]
    Mismatch { file: PathBuf, fault: String },
    /// A file that romc would have to replace.
    #[error("{0}: already exists; pass --force to replace it, or choose another name")]
    Exists(PathBuf),
    /// An output that is no file.
    #[error("{0}: is a folder; expected the name of a file")]
    IsFolder(PathBuf),
    /// An output in a folder that is not there.
    #[error("{path}: there is no folder `{folder}`; make it first", path = path.display(), folder = folder.display())]
    NoFolder { path: PathBuf, folder: PathBuf },
    /// The file system refused an input.
    #[error("{path}: cannot read", path = path.display())]
    Read { path: PathBuf, source: io::Error },
    /// The file system refused an output.
    #[error("{path}: cannot write")]
    Write { path: PathBuf, source: io::Error },
}

impl Error {
    /// Whether an option had a value that it cannot have, as opposed to a run that failed.
    pub fn is_usage(&self) -> bool {
        match self {
            Self::Robot(error) => matches!(error, RobotError::UnknownRobot { .. }),
            Self::RobotFile(error) => error.file.is_empty(),
            Self::ModelFile(error) => matches!(error.place, Place::Option(_)),
            Self::Physical(error) => matches!(error, PhysicalError::LatentOnly { .. }),
            Self::Train(error) => matches!(error, TrainError::Option { .. }),
            Self::Simplify(error) => {
                matches!(error, SimplifyError::NoSamples | SimplifyError::Margin)
            }
            // Exit code 1 of `check` says that two files differ.
            Self::Rename(_)
            | Self::Name(_)
            | Self::Check(_)
            | Self::OneLog(_)
            | Self::Ending { .. }
            | Self::IsRead { .. }
            | Self::Idle { .. }
            | Self::OneSegment(_) => true,
            Self::Recording(_)
            | Self::Identify(_)
            | Self::Model(_)
            | Self::Emit(_)
            | Self::Typeset(_)
            | Self::Codegen(_)
            | Self::Folder(_)
            | Self::Lower(_)
            | Self::Sim(_)
            | Self::Study(_)
            | Self::Evaluate(_)
            | Self::Mpc(_)
            | Self::Plan(_)
            | Self::Distrusted(_)
            | Self::Config { .. }
            | Self::Mismatch { .. }
            | Self::Exists(_)
            | Self::IsFolder(_)
            | Self::NoFolder { .. }
            | Self::Read { .. }
            | Self::Write { .. } => false,
        }
    }
}

/// The name by which a file is read, where it is not the one by which it is written.
fn other_name(path: &Path, input: &Path) -> String {
    match path == input {
        true => String::new(),
        false => format!(" as {}", input.display()),
    }
}
