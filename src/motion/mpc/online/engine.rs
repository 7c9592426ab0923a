//! What solves the program of a step: clarabel, or the structured solver.

use super::error::ControlError;
use super::horizon::Horizon;
use super::problem::StageRows;
use super::qp::{Outcome, QpSolver};
use super::settings::{MpcSettings, Solver};
use super::structured::{MAX_STRUCTURED_DIM, StructuredProgram, structured_program};
use super::transcribe::{StepData, Transcription};

/// A solver with the program of the present horizon.
#[derive(Debug)]
pub(super) enum Engine {
    /// The conic program as a whole.
    Conic {
        transcription: Transcription,
        solver: Box<QpSolver>,
    },
    /// Stage by stage.
    Structured(Box<dyn StructuredProgram>),
}

impl Engine {
    /// A solver for a problem with these rows and weights of the scaled states, `2 latent_dim`.
    ///
    /// # Errors
    /// [`ControlError::Solver`] if clarabel refuses the problem, [`ControlError::Setting`] if the
    /// structured solver is not compiled for the latent dimension.
    pub(super) fn new(
        latent_dim: usize,
        rows: &StageRows,
        state_weights: &[f64],
        settings: &MpcSettings,
    ) -> Result<Self, ControlError> {
        match settings.solver {
            Solver::Clarabel => {
                let (transcription, mut program) =
                    Transcription::new(latent_dim, settings.horizon, rows.clone());
                transcription.write_cost(state_weights, settings, &mut program);
                let solver = Box::new(QpSolver::new(program, settings.qp)?);
                Ok(Self::Conic {
                    transcription,
                    solver,
                })
            }
            Solver::Riccati => {
                let program = structured_program(latent_dim, rows, state_weights, settings);
                let program = program.ok_or(ControlError::StructuredDim {
                    found: latent_dim,
                    largest: MAX_STRUCTURED_DIM,
                })?;
                Ok(Self::Structured(program))
            }
        }
    }

    /// clarabel, if it is what solves.
    pub(super) fn conic(&self) -> Option<&QpSolver> {
        match self {
            Self::Conic { solver, .. } => Some(solver),
            Self::Structured(_) => None,
        }
    }

    /// Forgets the last solution.
    pub(super) fn forget(&mut self) {
        if let Self::Structured(program) = self {
            program.forget();
        }
    }

    /// Takes over what the horizon's last preparation changed, as far as it does not depend on the
    /// measurement.
    pub(super) fn prepare(&mut self, step: &StepData<'_>, horizon: &Horizon) {
        let Self::Structured(program) = self else {
            return;
        };
        for _ in 0..horizon.shift() {
            program.shift();
        }
        let new = horizon.is_new();
        for index in (0..new.len()).filter(|&index| new[index]) {
            program.write(index, step, horizon.end(index));
        }
        program.prepare();
    }

    /// Solves the prepared program from the measurement; how it ended, and iterations.
    pub(super) fn solve(&mut self, step: &StepData<'_>) -> (Outcome, u32) {
        match self {
            Self::Conic {
                transcription,
                solver,
            } => {
                transcription.write(step, solver.program_mut());
                (solver.solve(), solver.iterations())
            }
            Self::Structured(program) => program.solve(step),
        }
    }

    /// Writes what a stage has in the solution: its latent input `u_r + C_p û` and the latent state at
    /// its end `x_r⁺ + σ x̂⁺`, with `reference` the reference state there.
    pub(super) fn write(
        &self,
        index: usize,
        step: &StepData<'_>,
        reference: &[f64],
        (input, end): (&mut [f64], &mut [f64]),
    ) {
        let (scaled_input, scaled_end) = match self {
            Self::Conic {
                transcription,
                solver,
            } => transcription.stage(index, solver.solution()),
            Self::Structured(program) => program.stage(index),
        };
        let stage = &step.stages[index];
        let root = &step.phases[stage.phase].latent_root;
        for (row, out) in input.iter_mut().enumerate() {
            let mut sum = 0.0;
            for (col, scaled) in scaled_input[..=row].iter().enumerate() {
                sum += root[(row, col)] * scaled;
            }
            *out = stage.input[row] + sum;
        }
        for (row, out) in end.iter_mut().enumerate() {
            *out = reference[row] + step.deviation[row] * scaled_end[row];
        }
    }
}
