//! The optimal control problem for the structured [`solver`](crate::solver).
//!
//! The same numbers as [`transcribe`](super::transcribe) writes for clarabel, stage by stage and
//! without the zeros in between: unknowns are the scaled inputs `û_k`, the states `x̂_{k+1}` that follow
//! from them, and the slacks. A friction cone becomes the pyramid `|F_x|, |F_y| <= μ F_z / √2` inside it.

use std::fmt::Debug;

use super::problem::{StageRows, pairs};
use super::qp::Outcome;
use super::settings::MpcSettings;
use super::transcribe::{SLACK_PRICE, Stage as StageData, StepData};
use crate::solver::{
    self, Cost, Links, Pairs, Program, Report, RowMatrices, Settings, Shape, Stage,
};

/// Complementarity and violation of rows at which iterations end.
pub const TOLERANCE: f64 = 1e-9;
/// Gap between primal and dual cost, relative to the cost, at which they end as well.
pub const GAP: f64 = 1e-8;
/// Complementarity and violation of rows at which iterations end if torque rates are limited: their rows tie the
/// inputs of all stages together, so that each is as good as the worst.
pub const RATE_TOLERANCE: f64 = 1e-12;
/// How soft the rows of such a program are within a step, see [`Links`].
pub const RATE_SOFTNESS: f64 = 1e-8;
/// Rows of a friction pyramid.
pub(super) const PYRAMID_ROWS: usize = 4;
/// Most latent coordinates that the solver is compiled for.
pub const MAX_STRUCTURED_DIM: usize = 8;

/// The horizon's program for one latent dimension or another.
pub(super) trait StructuredProgram: Debug + Send {
    /// Moves the horizon on by a stage; the last has to be written then.
    fn shift(&mut self);

    /// Overwrites a stage, with the reference state at its end.
    fn write(&mut self, stage: usize, step: &StepData<'_>, end: &[f64]);

    /// Forgets the last solution.
    fn forget(&mut self);

    /// Computes the gains of all stages for the next [`StructuredProgram::solve`], unless the present gains are those of the stages.
    fn prepare(&mut self);

    /// Solves from the measurement; how it ended, and iterations.
    fn solve(&mut self, step: &StepData<'_>) -> (Outcome, u32);

    /// Scaled input of a stage, and scaled state at its end.
    fn stage(&self, stage: usize) -> (&[f64], &[f64]);
}

/// A program, or none for a latent dimension above [`MAX_STRUCTURED_DIM`]. An odd dimension is filled up to the next
/// even one with inputs and states that nothing moves, which changes no bit and halves what has to be compiled.
pub(super) fn structured_program(
    latent_dim: usize,
    rows: &StageRows,
    state_weights: &[f64],
    settings: &MpcSettings,
) -> Option<Box<dyn StructuredProgram>> {
    macro_rules! of_dimension {
        ($($dim:literal),*) => {
            match (latent_dim.next_multiple_of(2), rows.rate.is_empty()) {
                $(($dim, true) => Some(Box::new(
                    Horizon::<{ 2 * $dim }, $dim, false>::new(latent_dim, rows, state_weights, settings)
                )),)*
                $(($dim, false) => Some(Box::new(
                    Horizon::<{ 2 * $dim }, $dim, true>::new(latent_dim, rows, state_weights, settings)
                )),)*
                _ => None,
            }
        };
    }
    of_dimension!(2, 4, 6, 8)
}

/// Memory of a program; `NX` is twice `NU`, `LINKED` if torque rates are limited.
#[derive(Debug)]
struct Horizon<const NX: usize, const NU: usize, const LINKED: bool> {
    /// Inputs that the model has; what is beyond them, up to `NU`, and beyond twice as many states stays zero.
    latent_dim: usize,
    stages: Vec<Stage<f64, NX, NU>>,
    memory: Vec<f64>,
    /// Rows on the inputs, those of a stage one after the other; the same for the states.
    input_rows: Vec<[f64; NU]>,
    soft_rows: Vec<[f64; NU]>,
    /// Rows of the rates, and their products with the reference's input: place by place.
    rate_rows: Vec<[f64; NU]>,
    rate_at_reference: Vec<f64>,
    rate_gains: Vec<[[f64; NU]; NU]>,
    rows: StageRows,
    first: usize,
    shape: Shape,
    cost: Cost<f64, NX, NU>,
    settings: Settings<f64>,
    /// Whether the stages hold a solution, to start from.
    is_warm: bool,
    /// Whether the gains are those of the stages; solves with active rows overwrite them.
    has_gains: bool,
}

impl<const NX: usize, const NU: usize, const LINKED: bool> Horizon<NX, NU, LINKED> {
    fn new(
        latent_dim: usize,
        rows: &StageRows,
        state_weights: &[f64],
        settings: &MpcSettings,
    ) -> Self {
        let horizon = settings.horizon;
        let pyramid = rows.friction.as_ref().map_or(0, |_| PYRAMID_ROWS);
        let shape = Shape {
            input: rows.torque.len() + pyramid,
            soft: rows.joint.len(),
            link: rows.rate.len(),
            pairs: Pairs {
                input: pairs(&rows.torque),
                hard: 0,
            },
            ..Shape::default()
        };
        let scale = SLACK_PRICE / settings.joint_penalty;
        let mut state = [0.0; NX];
        for (entry, weight) in state.iter_mut().zip(state_weights) {
            *entry = scale * weight;
        }
        let stage = |index: usize| {
            let mut stage = Stage::zeros();
            stage.input_rows = index * shape.input;
            stage.soft_rows = index * shape.soft;
            stage
        };
        Self {
            latent_dim,
            stages: (0..horizon).map(stage).collect(),
            memory: vec![0.0; horizon * shape.memory()],
            input_rows: vec![[0.0; NU]; horizon * shape.input],
            soft_rows: vec![[0.0; NU]; horizon * shape.soft],
            rate_rows: vec![[0.0; NU]; horizon * shape.link],
            rate_at_reference: vec![0.0; horizon * shape.link],
            rate_gains: vec![[[0.0; NU]; NU]; if LINKED { horizon } else { 0 }],
            rows: rows.clone(),
            first: 0,
            shape,
            cost: Cost {
                state,
                terminal: state.map(|weight| settings.terminal_weight * weight),
                input: [scale * settings.input_weight; NU],
                slack: SLACK_PRICE,
            },
            settings: Settings {
                max_iterations: settings.qp.max_iterations,
                tolerance: if LINKED { RATE_TOLERANCE } else { TOLERANCE },
                gap: if LINKED { 0.0 } else { GAP },
                accepted_residual: settings.qp.accepted_residual,
            },
            is_warm: false,
            has_gains: false,
        }
    }

    fn program(&mut self) -> Program<'_, f64, NX, NU, LINKED> {
        Program {
            stages: &mut self.stages,
            rows: &mut self.memory,
            first: self.first,
            shape: self.shape,
            matrices: RowMatrices {
                input: &self.input_rows,
                soft: &self.soft_rows,
                hard: &[],
            },
            links: Links {
                rows: &self.rate_rows,
                gains: &mut self.rate_gains,
                softness: RATE_SOFTNESS,
            },
            cost: self.cost,
        }
    }

    fn place(&self, stage: usize) -> usize {
        (self.first + stage) % self.stages.len()
    }

    fn write_dynamics(&mut self, place: usize, data: &StageData, step: &StepData<'_>) {
        let (model, deviation) = (&data.model, step.deviation);
        let root = &step.phases[data.phase].latent_root;
        let stage = &mut self.stages[place];
        let dim = self.latent_dim;
        for row in 0..2 * dim {
            let scale = 1.0 / deviation[row];
            for col in 0..dim {
                let mut sum = 0.0;
                for k in col..dim {
                    sum += model.b[(row, k)] * root[(k, col)];
                }
                stage.b[row][col] = scale * sum;
            }
            for col in 0..2 * dim {
                stage.a[row][col] = scale * model.a[(row, col)] * deviation[col];
            }
            stage.c[row] = scale * data.defect[row];
        }
    }

    fn write_rows(&mut self, place: usize, data: &StageData, step: &StepData<'_>, end: &[f64]) {
        let (root, deviation) = (&step.phases[data.phase].latent_root, step.deviation);
        let own = data.rows.as_ref().unwrap_or(&self.rows);
        let dim = self.latent_dim;
        let (count, memory) = (self.shape.rows(), self.shape.memory());
        let bounds = &mut self.memory[place * memory..][..count];
        let matrix = &mut self.input_rows[place * self.shape.input..][..self.shape.input];
        for (number, row) in own.torque.iter().enumerate() {
            let (scaled, at_reference) = scaled(&row.row, root, &data.input);
            matrix[number] = scaled;
            bounds[number] = row.bound - row.per_loss * data.losses_nm[row.joint] - at_reference;
        }
        if self.rows.friction.is_some() {
            let pull = std::f64::consts::FRAC_1_SQRT_2;
            for side in 0..PYRAMID_ROWS {
                let (axis, sign) = (1 + side / 2, if side % 2 == 0 { 1.0 } else { -1.0 });
                let row: [f64; NU] = std::array::from_fn(|j| match j < dim {
                    true => sign * data.force[axis * dim + j] - pull * data.force[j],
                    false => 0.0,
                });
                let (scaled, at_reference) = scaled(&row[..dim], root, &data.input);
                let number = own.torque.len() + side;
                matrix[number] = scaled;
                // Without contact nothing is asked for.
                let is_free = row.iter().all(|entry| *entry == 0.0);
                bounds[number] = if is_free { 1.0 } else { -at_reference };
            }
        }
        let first = place * self.shape.link;
        for (number, row) in own.rate.iter().enumerate() {
            (
                self.rate_rows[first + number],
                self.rate_at_reference[first + number],
            ) = scaled(&row.row, root, &data.input);
        }
        let matrix = &mut self.soft_rows[place * self.shape.soft..][..self.shape.soft];
        let bounds = &mut bounds[self.shape.input..];
        for (number, row) in own.joint.iter().enumerate() {
            let mut at_reference = 0.0;
            for j in 0..dim {
                matrix[number][j] = row.row[j] * deviation[j];
                at_reference += row.row[j] * end[j];
            }
            bounds[number] = row.bound - at_reference;
        }
    }

    /// Bounds of the rates: those of a stage depend on the stage before, those of the first on the last command.
    fn write_rate_bounds(&mut self, first: &StageData, last_input: &[f64]) {
        let (count, memory, link) = (self.shape.rows(), self.shape.memory(), self.shape.link);
        let own = first.rows.as_ref().unwrap_or(&self.rows);
        for number in 0..link {
            let mut before = 0.0;
            for (entry, input) in own.rate[number].row.iter().zip(last_input) {
                before += entry * input;
            }
            for stage in 0..self.stages.len() {
                let place = self.place(stage);
                let at_reference = self.rate_at_reference[place * link + number];
                let bound = &mut self.memory[place * memory + count - link + number];
                *bound = self.rows.rate[number].bound - at_reference + before;
                before = at_reference;
            }
        }
    }
}

/// [`Program::prepare`] with the widest vectors that the processor has; the bits are the same with all. Programs
/// with rates, which are rare, make do with the narrowest: a copy less to compile.
pub fn prepare<const NX: usize, const NU: usize, const LINKED: bool>(
    program: &mut Program<'_, f64, NX, NU, LINKED>,
) -> bool {
    #[cfg(target_arch = "x86_64")]
    if !LINKED && is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has what this is compiled for.
        return unsafe { program.prepare_avx2() };
    }
    program.prepare()
}

/// [`Program::solve`] with the widest vectors that the processor has; the bits are the same with all.
pub fn solve<const NX: usize, const NU: usize, const LINKED: bool>(
    program: &mut Program<'_, f64, NX, NU, LINKED>,
    x0: &[f64; NX],
    is_warm: bool,
    settings: &Settings<f64>,
) -> Report<f64> {
    #[cfg(target_arch = "x86_64")]
    if !LINKED && is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has what this is compiled for.
        return unsafe { program.solve_avx2(x0, is_warm, settings) };
    }
    program.solve(x0, is_warm, settings)
}

/// How a solve ended, in the words that all solvers share.
pub(super) fn outcome_of(outcome: solver::Outcome) -> Outcome {
    match outcome {
        solver::Outcome::Solved => Outcome::Solved,
        solver::Outcome::Inaccurate => Outcome::Inaccurate,
        solver::Outcome::IterationCap => Outcome::IterationCap,
        solver::Outcome::NumericalFailure => Outcome::NumericalFailure,
    }
}

/// `row C` for a lower triangular `C`, and `row · input`.
fn scaled<const NU: usize>(
    row: &[f64],
    root: &nalgebra::DMatrix<f64>,
    input: &[f64],
) -> ([f64; NU], f64) {
    let mut out = [0.0; NU];
    let mut at_reference = 0.0;
    for col in 0..row.len() {
        for k in col..row.len() {
            out[col] += row[k] * root[(k, col)];
        }
        at_reference += row[col] * input[col];
    }
    (out, at_reference)
}

impl<const NX: usize, const NU: usize, const LINKED: bool> StructuredProgram
    for Horizon<NX, NU, LINKED>
{
    fn shift(&mut self) {
        let mut program = self.program();
        program.shift();
        self.first = program.first;
        self.has_gains = false;
    }

    fn write(&mut self, stage: usize, step: &StepData<'_>, end: &[f64]) {
        let (place, data) = (self.place(stage), &step.stages[stage]);
        self.write_dynamics(place, data, step);
        self.write_rows(place, data, step, end);
        self.has_gains = false;
    }

    fn forget(&mut self) {
        (self.is_warm, self.has_gains) = (false, false);
    }

    fn prepare(&mut self) {
        self.has_gains = self.has_gains || prepare(&mut self.program());
    }

    fn solve(&mut self, step: &StepData<'_>) -> (Outcome, u32) {
        if !self.has_gains {
            return (Outcome::NumericalFailure, 0);
        }
        let first = &step.stages[0];
        self.write_rate_bounds(first, step.last_input);
        let x0 = std::array::from_fn(|i| match i < 2 * self.latent_dim {
            true => (step.measured[i] - first.state[i]) / step.deviation[i],
            false => 0.0,
        });
        let (is_warm, settings) = (self.is_warm, self.settings);
        let report = solve(&mut self.program(), &x0, is_warm, &settings);
        let outcome = outcome_of(report.outcome);
        self.is_warm = outcome == Outcome::Solved;
        self.has_gains = report.iterations == 0;
        (outcome, report.iterations)
    }

    fn stage(&self, stage: usize) -> (&[f64], &[f64]) {
        let (stage, dim) = (&self.stages[self.place(stage)], self.latent_dim);
        (&stage.v[..dim], &stage.x[..2 * dim])
    }
}
