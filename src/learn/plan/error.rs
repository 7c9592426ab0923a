//! Why there is no plan.

use thiserror::Error;

use crate::lower::LowerError;
use crate::model::ModelError;
use crate::mpc::{ControlError, Outcome};
use crate::recording::RecordingError;

#[derive(Debug, Error)]
pub enum PlanError {
    #[error("{what}: found {found}, expected {expected}")]
    Goal {
        what: &'static str,
        found: f64,
        expected: String,
    },
    #[error(
        "no plan for {distance_m} m with an apex of {apex_m} m: {outcome:?} in convex program {iteration}"
    )]
    Unsolved {
        distance_m: f64,
        apex_m: f64,
        outcome: Outcome,
        /// Number of the program, from 1.
        iteration: usize,
    },
    #[error(
        "no plan for {distance_m} m with an apex of {apex_m} m: the equations are still off by \
         {defect:.1e} after {iterations} convex programs"
    )]
    NotConverged {
        distance_m: f64,
        apex_m: f64,
        /// Largest violation of an equation, in standard deviations of its coordinate.
        defect: f64,
        iterations: usize,
    },
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Lower(#[from] LowerError),
    #[error(transparent)]
    Control(#[from] ControlError),
    #[error(transparent)]
    Recording(#[from] RecordingError),
}
