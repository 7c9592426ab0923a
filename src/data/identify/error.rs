//! Errors of identification and of its file.

use thiserror::Error;

use crate::files::{Fault, Located};
use crate::recording::RecordingError;

/// Why recordings do not say what the robot is, or a file does not.
#[derive(Debug, Error)]
pub enum IdentifyError {
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(
        "{recordings} recordings: found {found} samples with feet on the ground that are 20 ms \
         away from a change of feet and from a singular leg, expected at least {expected}"
    )]
    Contact {
        recordings: usize,
        found: usize,
        expected: usize,
    },
    #[error(
        "{recordings} recordings: found {found} windows of 30 ms in which the legs move, expected \
         at least {expected}; a robot that stands still does not show its losses"
    )]
    Still {
        recordings: usize,
        found: usize,
        expected: usize,
    },
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
    #[error(
        "{recording}: {found}; expected recordings of one robot with its torques: leave this one out, or use it alone"
    )]
    Contradiction { recording: String, found: String },
    #[error(transparent)]
    File(#[from] Located<Fault>),
}
