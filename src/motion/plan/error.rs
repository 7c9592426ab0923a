//! Why there is no plan.

use thiserror::Error;

use crate::lower::LowerError;
use crate::model::ModelError;
use crate::mpc::{ControlError, Outcome};
use crate::recording::RecordingError;

/// Why a jump could not be planned.
#[derive(Debug, Error)]
pub enum PlanError {
    /// A number of the goal or of the settings that no jump has.
    #[error("{what}: found {found}, expected {expected}")]
    Goal {
        /// The number.
        what: &'static str,
        /// Its value.
        found: f64,
        /// What could be.
        expected: String,
    },
    /// The convex programs have no solution from here on.
    #[error(
        "no plan for {distance_m} m with an apex of {apex_m} m: {outcome:?} in convex program {iteration}"
    )]
    Unsolved {
        /// The goal's distance, m.
        distance_m: f64,
        /// The goal's apex, m.
        apex_m: f64,
        /// How the solver ended.
        outcome: Outcome,
        /// Number of the program, from 1.
        iteration: usize,
    },
    /// The convex programs do not settle on a trajectory.
    #[error(
        "no plan for {distance_m} m with an apex of {apex_m} m: the equations are still off by \
         {defect:.1e} after {iterations} convex programs"
    )]
    NotConverged {
        /// The goal's distance, m.
        distance_m: f64,
        /// The goal's apex, m.
        apex_m: f64,
        /// Largest violation of an equation, in standard deviations of its coordinate.
        defect: f64,
        /// Programs solved.
        iterations: usize,
    },
    /// The model lacks what planning needs.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The equations of a phase do not compile.
    #[error(transparent)]
    Lower(#[from] LowerError),
    /// The solver refused a program.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// The planned motion makes no input.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}
