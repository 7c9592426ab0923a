//! The solver of a program over stages: clarabel, or the structured solver.

use std::fmt::Debug;

use super::conic::Conic;
use super::error::ControlError;
use super::qp::{QpSettings, QpSolver};
use super::settings::Solver;
use super::stage::{FrictionShape, StageCost, StageQp, StageShape};
use super::structured::{MAX_STRUCTURED_DIM, structured};
use crate::solver::Outcome;

#[derive(Debug, Clone, Default)]
pub(super) struct Start {
    /// The scaled state before the first stage.
    pub state: Vec<f64>,
    /// Rows of the rates at the input before the first stage.
    pub rate_before: Vec<f64>,
}

pub(super) trait StageSolver: Debug + Send {
    fn forget(&mut self) {}

    /// Computes ahead what does not depend on the start, after the horizon moved on by `shift` stages and those that
    /// `is_new` names were written.
    fn prepare(&mut self, _stages: &[StageQp], _shift: usize, _is_new: &[bool]) {}

    /// Solves the prepared program; how it ended, and iterations.
    fn solve(&mut self, stages: &[StageQp], start: &Start) -> (Outcome, u32);

    /// Input of a stage and state at its end in the solution, both scaled.
    fn stage(&self, stage: usize) -> (&[f64], &[f64]);

    /// clarabel, if it is what solves.
    fn conic(&self) -> Option<&QpSolver> {
        None
    }
}

impl Solver {
    pub(super) fn friction(self) -> FrictionShape {
        match self {
            Self::Clarabel => FrictionShape::Cone,
            Self::Riccati => FrictionShape::Pyramid,
        }
    }

    /// A solver for the program of a controller's horizon.
    pub(super) fn of_horizon(
        self,
        horizon: usize,
        shape: StageShape,
        cost: &StageCost,
        settings: QpSettings,
    ) -> Result<Box<dyn StageSolver>, ControlError> {
        match self {
            Self::Clarabel => Ok(Box::new(Conic::new(horizon, shape, cost, settings)?)),
            Self::Riccati => {
                let solver = structured(horizon, shape, cost, settings);
                solver.ok_or(ControlError::StructuredDim {
                    found: shape.inputs,
                    largest: MAX_STRUCTURED_DIM,
                })
            }
        }
    }
}
