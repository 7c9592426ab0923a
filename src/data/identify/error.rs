//! Errors of identification and of its file.

#![allow(missing_docs, reason = "each variant's message names its fields")]

use thiserror::Error;

use crate::files::Located;
use crate::recording::RecordingError;

/// Why recordings do not say what the robot is, or a file does not.
#[derive(Debug, Error)]
pub enum IdentifyError {
    /// A recording cannot be read or filtered.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Too little of the recordings has feet on the ground and is not close to an impact.
    #[error(
        "{recordings} recordings: found {found} samples with feet on the ground that are 20 ms \
         away from a change of feet and from a singular leg, expected at least {expected}"
    )]
    Contact {
        recordings: usize,
        found: usize,
        expected: usize,
    },
    /// The feet do not move enough for the joints' losses to have a direction.
    #[error(
        "{recordings} recordings: found {found} windows of 30 ms in which the legs move, expected \
         at least {expected}; a robot that stands still does not show its losses"
    )]
    Still {
        recordings: usize,
        found: usize,
        expected: usize,
    },
    /// The feet's forces do not explain the trunk's acceleration by any mass.
    #[error(
        "the trunk's acceleration does not follow the feet's forces: found {inverse:.3e} as \
         1/mass, expected about {expected:.3e} 1/kg; are signs, units and order of the \
         torques those of `{robot}`?"
    )]
    Mass {
        inverse: f64,
        expected: f64,
        robot: String,
    },
    /// A recording contradicts physics or the other recordings.
    #[error(
        "{recording}: {found}; expected recordings of one robot with its torques: leave this one out, or use it alone"
    )]
    Contradiction { recording: String, found: String },
    /// A file of an identification cannot be used.
    #[error(transparent)]
    File(#[from] Located<IdentifyFault>),
}

/// What is wrong at a place of a file.
#[derive(Debug, Error)]
pub enum IdentifyFault {
    /// The file system refused it.
    #[error("cannot read")]
    Read(#[source] std::io::Error),
    /// It is not TOML, or not with the keys of an identification.
    #[error("{0}")]
    Syntax(String),
    /// A value that no robot has.
    #[error("found {found}, expected {expected}")]
    Value { found: f64, expected: &'static str },
}
