//! Stages for the structured [`solver`](crate::solver).

use super::conic::{StageSolver, Start};
use super::dense::Real;
use super::error::ControlError;
use super::qp::QpSettings;
use super::stage::{Rows, StageCost, StageQp, StageShape};
use crate::solver::{Cost, Links, Outcome, Program, Report, RowMatrices, Settings, Shape, Stage};

/// Complementarity and violation of rows at which iterations end.
pub const TOLERANCE: f64 = 1e-9;
/// Gap between primal and dual cost, relative to the cost, at which they end as well.
const GAP: Real = 1e-8;
/// [`TOLERANCE`] with rows that link stages: they tie all together, each is as good as the worst.
pub const LINK_TOLERANCE: f64 = 1e-12;
/// How soft the rows of such a program are within a step, see [`Links`].
pub const LINK_SOFTNESS: f64 = 1e-8;
/// Most latent coordinates that the solver is compiled for.
pub const MAX_STRUCTURED_DIM: usize = 18;
/// The dimensions that it is compiled for, with wide vectors or rows that link stages; with narrow vectors the fewer.
const DIMENSIONS: [usize; 6] = [2, 4, 6, 8, 12, 18];
const FEWER_DIMENSIONS: [usize; 4] = [4, 8, 12, 18];

/// The solver of a horizon, or of a lift where there are no states; refused above [`MAX_STRUCTURED_DIM`] coordinates.
/// Dimensions between those compiled are filled up with inputs and states that nothing moves: same bits.
pub(super) fn structured(
    horizon: usize,
    shape: StageShape,
    cost: &StageCost,
    settings: QpSettings,
) -> Result<Box<dyn StageSolver>, ControlError> {
    let (is_linked, is_lift) = (shape.rows.link > 0, shape.states == 0);
    let settings = Settings {
        max_iterations: settings.max_iterations,
        tolerance: if is_linked { LINK_TOLERANCE } else { TOLERANCE },
        // Of a lift torques are at stake: the largest product alone decides.
        gap: if is_linked || is_lift { 0.0 } else { GAP },
        accepted_residual: settings.accepted_residual,
    };
    // Programs with links, which are rare, do with narrow vectors; of these fewer dimensions are compiled.
    let is_wide = has_avx2() && !is_linked;
    let compiled = match is_wide || is_linked {
        true => &DIMENSIONS[..],
        false => &FEWER_DIMENSIONS,
    };
    let fits = compiled.iter().find(|inputs| **inputs >= shape.inputs);
    let inputs = fits.copied().unwrap_or(usize::MAX);
    macro_rules! of_dimension {
        ($(($wide:literal, $linked:literal): $(($nx:literal, $nu:literal))*;)*) => {
            match (is_wide, is_linked, is_lift, inputs) {
                $($(($wide, $linked, is_lift, $nu) if is_lift == ($nx < $nu) => Ok(Box::new(
                    Structured::<$nx, $nu, $wide, $linked>::new(horizon, shape, cost, settings)
                )),)*)*
                _ => Err(ControlError::StructuredDim {
                    found: shape.inputs,
                    largest: MAX_STRUCTURED_DIM,
                }),
            }
        };
    }
    of_dimension! {
        (true, false): (4, 2) (8, 4) (12, 6) (16, 8) (24, 12) (36, 18) (1, 12);
        (false, false): (8, 4) (16, 8) (24, 12) (36, 18) (1, 12);
        (false, true): (4, 2) (8, 4) (12, 6) (16, 8) (24, 12) (36, 18);
    }
}

/// Memory of a program of at most `NX` states and `NU` inputs: `WIDE` with AVX2, `LINKED` with rows that link stages.
#[derive(Debug)]
pub(super) struct Structured<const NX: usize, const NU: usize, const WIDE: bool, const LINKED: bool>
{
    /// States and inputs of the stages; entries beyond them stay zero.
    states: usize,
    inputs: usize,
    stages: Vec<Stage<f64, NX, NU>>,
    memory: Vec<f64>,
    /// Rows on the inputs, on the states and of the links, those of a stage one after the other.
    input_rows: Vec<[f64; NU]>,
    soft_rows: Vec<[f64; NU]>,
    link_rows: Vec<[f64; NU]>,
    link_gains: Vec<[[f64; NU]; NU]>,
    first: usize,
    shape: Shape,
    cost: Cost<f64, NX, NU>,
    settings: Settings<f64>,
    /// Whether the stages hold a solution, to start from.
    is_warm: bool,
    /// Whether the gains are those of the stages; solves with active rows overwrite them.
    has_gains: bool,
}

impl<const NX: usize, const NU: usize, const WIDE: bool, const LINKED: bool>
    Structured<NX, NU, WIDE, LINKED>
{
    pub(super) fn new(
        horizon: usize,
        of: StageShape,
        cost: &StageCost,
        settings: Settings<f64>,
    ) -> Self {
        let shape = of.rows;
        let mut state = [0.0; NX];
        state[..of.states].copy_from_slice(&cost.state);
        let stage = |index: usize| {
            let mut stage = Stage::zeros();
            stage.input_rows = index * shape.input;
            stage.soft_rows = index * shape.soft;
            stage
        };
        Self {
            states: of.states,
            inputs: of.inputs,
            stages: (0..horizon).map(stage).collect(),
            memory: vec![0.0; horizon * shape.memory()],
            input_rows: vec![[0.0; NU]; horizon * shape.input],
            soft_rows: vec![[0.0; NU]; horizon * shape.soft],
            link_rows: vec![[0.0; NU]; horizon * shape.link],
            link_gains: vec![[[0.0; NU]; NU]; if shape.link > 0 { horizon } else { 0 }],
            first: 0,
            shape,
            cost: Cost {
                state,
                terminal: state.map(|weight| cost.terminal * weight),
                input: [cost.input; NU],
                slack: cost.slack,
            },
            settings,
            is_warm: false,
            has_gains: false,
        }
    }

    fn program(&mut self) -> Program<'_, f64, NX, NU, LINKED> {
        let memory = self.stages.len() * self.shape.memory();
        Program {
            stages: &mut self.stages,
            rows: &mut self.memory[..memory],
            first: self.first,
            shape: self.shape,
            matrices: RowMatrices {
                input: &self.input_rows,
                soft: &self.soft_rows,
            },
            links: Links {
                rows: &self.link_rows,
                gains: &mut self.link_gains,
                softness: LINK_SOFTNESS,
            },
            cost: self.cost,
        }
    }

    fn place(&self, stage: usize) -> usize {
        (self.first + stage) % self.stages.len()
    }

    /// The number of rows on the input may change where there is a single stage.
    fn write(&mut self, place: usize, qp: &StageQp) {
        let (nx, nu) = (self.states, self.inputs);
        self.shape.input = qp.input.bounds.len();
        let stage = &mut self.stages[place];
        for row in 0..nx {
            stage.a[row][..nx].copy_from_slice(&qp.a[row * nx..][..nx]);
            stage.b[row][..nu].copy_from_slice(&qp.b[row * nu..][..nu]);
            stage.c[row] = qp.c[row];
        }
        let shape = &self.shape;
        let bounds = &mut self.memory[place * shape.memory()..][..shape.input + shape.soft];
        let (of_inputs, of_states) = bounds.split_at_mut(shape.input);
        of_inputs.copy_from_slice(&qp.input.bounds);
        of_states.copy_from_slice(&qp.soft.bounds);
        for (matrix, count, rows) in [
            (&mut self.input_rows, shape.input, &qp.input),
            (&mut self.soft_rows, shape.soft, &qp.soft),
            (&mut self.link_rows, shape.link, &qp.link),
        ] {
            write_rows(&mut matrix[place * count..][..count], rows, nu);
        }
    }

    /// Bounds of the links: those of a stage depend on the stage before.
    fn write_link_bounds(&mut self, stages: &[StageQp], start: &Start) {
        let (count, memory) = (self.shape.rows(), self.shape.memory());
        let mut before = &start.link_before[..];
        for (index, stage) in stages.iter().enumerate() {
            let first = self.place(index) * memory + count - self.shape.link;
            for row in 0..self.shape.link {
                self.memory[first + row] =
                    stage.link.bounds[row] - stage.link_at_reference[row] + before[row];
            }
            before = &stage.link_at_reference;
        }
    }
}

fn write_rows<const NU: usize>(matrix: &mut [[f64; NU]], rows: &Rows, width: usize) {
    for (number, row) in matrix.iter_mut().enumerate() {
        row[..width].copy_from_slice(&rows.entries[number * width..][..width]);
    }
}

impl<const NX: usize, const NU: usize, const WIDE: bool, const LINKED: bool> StageSolver
    for Structured<NX, NU, WIDE, LINKED>
{
    fn forget(&mut self) {
        (self.is_warm, self.has_gains) = (false, false);
    }

    fn prepare(&mut self, stages: &[StageQp], shift: usize, is_new: &[bool]) {
        for _ in 0..shift {
            let mut program = self.program();
            program.shift();
            self.first = program.first;
            self.has_gains = false;
        }
        for index in (0..stages.len()).filter(|&index| is_new[index]) {
            self.write(self.place(index), &stages[index]);
            self.has_gains = false;
        }
        self.has_gains = self.has_gains || prepare::<WIDE, NX, NU, LINKED>(&mut self.program());
    }

    fn solve(&mut self, stages: &[StageQp], start: &Start) -> (Outcome, u32) {
        if !self.has_gains {
            return (Outcome::NumericalFailure, 0);
        }
        self.write_link_bounds(stages, start);
        let mut x0 = [0.0; NX];
        x0[..self.states].copy_from_slice(&start.state);
        let (is_warm, settings) = (self.is_warm, self.settings);
        let report = solve::<WIDE, NX, NU, LINKED>(&mut self.program(), &x0, is_warm, &settings);
        self.is_warm = report.outcome == Outcome::Solved;
        self.has_gains = report.iterations == 0;
        (report.outcome, report.iterations)
    }

    fn stage(&self, stage: usize) -> (&[f64], &[f64]) {
        let stage = &self.stages[self.place(stage)];
        (&stage.v[..self.inputs], &stage.x[..self.states])
    }
}

/// Whether the processor has vectors of 256 bits.
pub(crate) fn has_avx2() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        is_x86_feature_detected!("avx2")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        false
    }
}

/// [`Program::prepare`], `WIDE` with AVX2, which the processor must have; the bits are the same.
pub fn prepare<const WIDE: bool, const NX: usize, const NU: usize, const LINKED: bool>(
    program: &mut Program<'_, f64, NX, NU, LINKED>,
) -> bool {
    #[cfg(target_arch = "x86_64")]
    if WIDE {
        assert!(has_avx2());
        // SAFETY: the processor supports the compiled instructions.
        return unsafe { program.prepare_avx2() };
    }
    program.prepare()
}

/// [`Program::solve`] in the same way.
pub fn solve<const WIDE: bool, const NX: usize, const NU: usize, const LINKED: bool>(
    program: &mut Program<'_, f64, NX, NU, LINKED>,
    x0: &[f64; NX],
    is_warm: bool,
    settings: &Settings<f64>,
) -> Report<f64> {
    #[cfg(target_arch = "x86_64")]
    if WIDE {
        assert!(has_avx2());
        // SAFETY: the processor supports the compiled instructions.
        return unsafe { program.solve_avx2(x0, is_warm, settings) };
    }
    program.solve(x0, is_warm, settings)
}
