//! The stages as one program over cones, for clarabel, and the choice between it and the structured solver. Unknowns
//! are, by stage, the input, the state that it leads to and a slack for soft rows. Rows are the dynamics of all stages
//! (zero cone), then rows on the input, links, soft rows and `t >= 0` stage by stage (nonnegative), then the
//! cones. The pattern is laid out once; a step overwrites values.

use std::fmt::Debug;

use super::error::ControlError;
use super::qp::{Cone, ConeProgram, QpSettings, QpSolver, position, sparse};
use super::settings::Solver;
use super::stage::{CONE_ROWS, StageCost, StageQp, StageShape};
use super::structured::structured;
use crate::solver::Outcome;

#[derive(Debug)]
pub(super) struct Conic {
    layout: Layout,
    /// Positions of the entries of `A` in its values, in the order of [`Layout::entries`].
    positions: Vec<usize>,
    solver: QpSolver,
}

impl Conic {
    pub(super) fn new(
        horizon: usize,
        shape: StageShape,
        cost: &StageCost,
        settings: QpSettings,
    ) -> Result<Self, ControlError> {
        let layout = Layout { shape, horizon };
        let stages = vec![StageQp::zeros(&shape); horizon];
        let mut entries = Vec::new();
        layout.entries(&stages, |row, col, value| entries.push((row, col, value)));
        let (rows, unknowns) = (layout.cone_row(horizon), horizon * layout.width());
        let a = sparse(rows, unknowns, &entries);
        let find = |&(row, col, _): &(usize, usize, f64)| position(&a, row, col);
        let positions = entries.iter().map(find).collect::<Option<_>>();
        let mut cones = vec![
            Cone::Zero(horizon * shape.states),
            Cone::Nonnegative(horizon * layout.inequalities()),
        ];
        cones.extend(vec![Cone::SecondOrder(CONE_ROWS); horizon * shape.cones]);
        cones.retain(|cone| cone.dim() > 0);
        let (p, q) = layout.cost(cost);
        let program = ConeProgram {
            p: sparse(unknowns, unknowns, &p),
            q,
            a,
            b: vec![0.0; rows],
            cones,
        };
        Ok(Self {
            layout,
            positions: positions.expect("every entry belongs to the pattern"),
            solver: QpSolver::new(program, settings)?,
        })
    }
}

impl StageSolver for Conic {
    fn solve(&mut self, stages: &[StageQp], start: &Start) -> (Outcome, u32) {
        let program = self.solver.program_mut();
        let values = &mut program.a.nzval;
        let mut positions = self.positions.iter();
        self.layout.entries(stages, |_, _, value| {
            if let Some(&position) = positions.next() {
                values[position] = value;
            }
        });
        self.layout.write_bounds(stages, start, &mut program.b);
        (self.solver.solve(), self.solver.iterations())
    }

    fn stage(&self, stage: usize) -> (&[f64], &[f64]) {
        let StageShape { states, inputs, .. } = self.layout.shape;
        let first = stage * self.layout.width();
        self.solver.solution()[first..][..inputs + states].split_at(inputs)
    }

    fn conic(&self) -> Option<&QpSolver> {
        Some(&self.solver)
    }
}

/// Which unknown and which row stands where.
#[derive(Debug, Clone, Copy)]
struct Layout {
    shape: StageShape,
    horizon: usize,
}

impl Layout {
    fn width(&self) -> usize {
        self.shape.inputs + self.shape.states + self.slacks()
    }

    fn slacks(&self) -> usize {
        usize::from(self.shape.rows.soft > 0)
    }

    fn inequalities(&self) -> usize {
        self.shape.rows.rows()
    }

    fn input_row(&self, stage: usize) -> usize {
        self.horizon * self.shape.states + stage * self.inequalities()
    }

    fn cone_row(&self, stage: usize) -> usize {
        self.input_row(self.horizon) + stage * CONE_ROWS * self.shape.cones
    }

    /// Passes row, column and value of all entries of `A` to `put`.
    fn entries(&self, stages: &[StageQp], mut put: impl FnMut(usize, usize, f64)) {
        let (nx, nu) = (self.shape.states, self.shape.inputs);
        let mut block = |row: usize, col: usize, width: usize, sign: f64, values: &[f64]| {
            for (number, value) in values.iter().enumerate() {
                put(row + number / width, col + number % width, sign * value);
            }
        };
        for (k, stage) in stages.iter().enumerate() {
            let (input, dynamics) = (k * self.width(), k * nx);
            let (state, slack) = (input + nu, input + nu + nx);
            block(dynamics, input, nu, 1.0, &stage.b);
            for i in 0..nx {
                block(dynamics + i, state + i, 1, -1.0, &[1.0]);
            }
            let link = self.input_row(k) + self.shape.rows.input;
            if k > 0 {
                let before = input - self.width();
                block(dynamics, before + nu, nx, 1.0, &stage.a);
                block(link, before, nu, -1.0, &stages[k - 1].link.entries);
            }
            block(self.input_row(k), input, nu, 1.0, &stage.input.entries);
            block(link, input, nu, 1.0, &stage.link.entries);
            let soft = link + self.shape.rows.link;
            block(soft, state, nu, 1.0, &stage.soft.entries);
            if self.slacks() > 0 {
                for row in soft..=soft + self.shape.rows.soft {
                    block(row, slack, 1, -1.0, &[1.0]);
                }
            }
            block(self.cone_row(k), input, nu, 1.0, &stage.cones.entries);
        }
    }

    /// Right-hand sides; the state that the first stage starts from is on the right of its dynamics.
    fn write_bounds(&self, stages: &[StageQp], start: &Start, b: &mut [f64]) {
        let nx = self.shape.states;
        let mut before = &start.link_before[..];
        for (k, stage) in stages.iter().enumerate() {
            for row in 0..nx {
                let mut right = -stage.c[row];
                if k == 0 {
                    for col in 0..nx {
                        right -= stage.a[row * nx + col] * start.state[col];
                    }
                }
                b[k * nx + row] = right;
            }
            let mut next = self.input_row(k);
            let mut push = |value: f64| {
                b[next] = value;
                next += 1;
            };
            stage.input.bounds.iter().copied().for_each(&mut push);
            for row in 0..self.shape.rows.link {
                push(stage.link.bounds[row] - stage.link_at_reference[row] + before[row]);
            }
            stage.soft.bounds.iter().copied().for_each(&mut push);
            before = &stage.link_at_reference;
            let cones = &stage.cones.bounds;
            b[self.cone_row(k)..][..cones.len()].copy_from_slice(cones);
        }
    }

    /// Entries of `P`, its whole diagonal, and `q`.
    fn cost(&self, cost: &StageCost) -> (Vec<(usize, usize, f64)>, Vec<f64>) {
        let (mut diagonal, mut q) = (Vec::new(), Vec::new());
        for stage in 0..self.horizon {
            let is_last = stage + 1 == self.horizon;
            let factor = if is_last { cost.terminal } else { 1.0 };
            diagonal.extend(vec![cost.input; self.shape.inputs]);
            diagonal.extend(cost.state.iter().map(|weight| factor * weight));
            diagonal.extend(vec![0.0; self.slacks()]);
            q.extend(vec![0.0; self.shape.inputs + self.shape.states]);
            q.extend(vec![cost.slack; self.slacks()]);
        }
        let entries = diagonal.into_iter().enumerate();
        (entries.map(|(at, value)| (at, at, value)).collect(), q)
    }
}

#[derive(Debug, Clone, Default)]
pub(super) struct Start {
    /// The scaled state before the first stage.
    pub state: Vec<f64>,
    /// Rows of the links at the input before the first stage.
    pub link_before: Vec<f64>,
}

pub(super) trait StageSolver: Debug + Send {
    fn forget(&mut self) {}

    /// Computes in advance everything that does not depend on the start, for stages moved by `shift` and for new
    /// stages.
    fn prepare(&mut self, _stages: &[StageQp], _shift: usize, _is_new: &[bool]) {}

    /// Solves the prepared program; how it ended, and iterations.
    fn solve(&mut self, stages: &[StageQp], start: &Start) -> (Outcome, u32);

    /// Input of a stage and state at its end in the solution, both scaled.
    fn stage(&self, stage: usize) -> (&[f64], &[f64]);

    fn conic(&self) -> Option<&QpSolver> {
        None
    }
}

impl Solver {
    pub(super) fn of_horizon(
        self,
        horizon: usize,
        shape: StageShape,
        cost: &StageCost,
        settings: QpSettings,
    ) -> Result<Box<dyn StageSolver>, ControlError> {
        match self {
            Self::Clarabel => Ok(Box::new(Conic::new(horizon, shape, cost, settings)?)),
            Self::Riccati => structured(horizon, shape, cost, settings),
        }
    }
}
