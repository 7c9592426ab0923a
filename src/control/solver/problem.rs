//! A quadratic program over the stages of a horizon.

use super::links::Links;
use super::scalar::Real;

/// One stage: its dynamics, where its rows stand, and the memory of the solver.
///
/// `NX` states and `NU` inputs; `a` and `b` are row-major.
#[derive(Debug, Clone, Copy)]
pub struct Stage<T, const NX: usize, const NU: usize> {
    /// State by the state before.
    pub a: [[T; NX]; NX],
    /// State by the input.
    pub b: [[T; NU]; NX],
    /// Constant part of the state.
    pub c: [T; NX],
    /// First of this stage's rows in [`RowMatrices::input`].
    pub input_rows: usize,
    /// First of this stage's rows in [`RowMatrices::soft`].
    pub soft_rows: usize,
    /// Input of the last solution.
    pub v: [T; NU],
    /// State at the stage's end in the last solution.
    pub x: [T; NX],
    /// Slack of the soft rows in the last solution.
    pub t: T,
    pub(super) gain: [[T; NX]; NU],
    pub(super) feed: [T; NU],
    /// `L D Lᵀ` of the input's Hessian: `L` below the diagonal, inverse of `D` on it.
    pub(super) factor: [[T; NU]; NU],
    pub(super) dv: [T; NU],
    pub(super) dx: [T; NX],
    pub(super) dt: T,
    /// `Σ w_j E_j` of the soft rows and the inverse of the slack's own curvature.
    pub(super) soft_pull: [T; NU],
    pub(super) soft_inverse: T,
    /// Input of the optimum without rows, of the last program.
    pub(super) plain: [T; NU],
}

impl<T: Real, const NX: usize, const NU: usize> Stage<T, NX, NU> {
    /// A stage of zeros.
    pub fn zeros() -> Self {
        let z = T::ZERO;
        Self {
            a: [[z; NX]; NX],
            b: [[z; NU]; NX],
            c: [z; NX],
            input_rows: 0,
            soft_rows: 0,
            v: [z; NU],
            x: [z; NX],
            t: z,
            gain: [[z; NX]; NU],
            feed: [z; NU],
            factor: [[z; NU]; NU],
            dv: [z; NU],
            dx: [z; NX],
            dt: z,
            soft_pull: [z; NU],
            soft_inverse: z,
            plain: [z; NU],
        }
    }
}

/// How many rows every stage has, in the order in which their bounds stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Shape {
    /// Rows on the input.
    pub input: usize,
    /// Rows on the first `NU` states at the stage's end, which share one slack.
    pub soft: usize,
    /// Rows that link the input to that of the stage before; their coefficients are in [`Links`].
    pub link: usize,
    /// Number of leading pairs of opposite rows on the input, the two sides of a limit: `row, −row`. The products and
    /// squares of each pair are computed once.
    pub pairs: usize,
}

impl Shape {
    /// Rows of a stage; a slack's own `t >= 0` follows its soft rows.
    pub fn rows(&self) -> usize {
        self.first_link() + self.link
    }

    pub(super) fn slack_row(&self) -> usize {
        self.input + self.soft
    }

    pub(super) fn first_link(&self) -> usize {
        let slack = if self.soft > 0 { 1 } else { 0 };
        self.input + self.soft + slack
    }

    /// Numbers that a stage's rows need of [`Program::rows`].
    pub fn memory(&self) -> usize {
        ROW_NUMBERS * self.rows()
    }
}

/// Numbers per row: bound, slack, multiplier, weight, target, residual, the change of slack and multiplier, and the
/// slack's inverse.
pub const ROW_NUMBERS: usize = 9;

/// Coefficients of the rows; stages may share them.
#[derive(Debug, Clone, Copy)]
pub struct RowMatrices<'a, T, const NU: usize> {
    /// `G` of `G v <= bound`.
    pub input: &'a [[T; NU]],
    /// `E` of `E x - t <= bound`.
    pub soft: &'a [[T; NU]],
}

/// The cost, the same at all stages but for the last one's states: `½ vᵀ R v + ½ xᵀ Q x + price t`.
#[derive(Debug, Clone, Copy)]
pub struct Cost<T, const NX: usize, const NU: usize> {
    /// Diagonal of `Q` before the last stage.
    pub state: [T; NX],
    /// Diagonal of `Q` at the last stage.
    pub terminal: [T; NX],
    /// Diagonal of `R`.
    pub input: [T; NU],
    /// Price of a slack.
    pub slack: T,
}

impl<T: Real, const NX: usize, const NU: usize> Cost<T, NX, NU> {
    pub(super) fn state_at(&self, stage: usize, horizon: usize) -> &[T; NX] {
        if stage + 1 == horizon {
            &self.terminal
        } else {
            &self.state
        }
    }
}

/// A program with the memory to solve it, all lent by the caller; `LINKED` if it has [`Links`].
#[derive(Debug)]
pub struct Program<'m, T, const NX: usize, const NU: usize, const LINKED: bool> {
    /// Stages of the horizon.
    pub stages: &'m mut [Stage<T, NX, NU>],
    /// [`Shape::memory`] numbers for each stage; bounds first, see [`Program::bounds_mut`].
    pub rows: &'m mut [T],
    /// Where the first stage of the horizon stands; the others follow, the slice being a ring.
    pub first: usize,
    /// Numbers of rows.
    pub shape: Shape,
    /// Coefficients of the rows.
    pub matrices: RowMatrices<'m, T, NU>,
    /// Rows that link the inputs of consecutive stages.
    pub links: Links<'m, T, NU, LINKED>,
    /// The cost.
    pub cost: Cost<T, NX, NU>,
}

impl<T: Real, const NX: usize, const NU: usize, const LINKED: bool> Program<'_, T, NX, NU, LINKED> {
    /// Where a stage of the horizon stands in the ring.
    #[inline(always)]
    pub fn at(&self, stage: usize) -> usize {
        let place = self.first + stage;
        if place < self.stages.len() {
            place
        } else {
            place - self.stages.len()
        }
    }

    /// Right-hand sides of a stage's rows: input, soft, link; the one of `t >= 0` in between is zero.
    pub fn bounds_mut(&mut self, stage: usize) -> &mut [T] {
        let first = self.at(stage) * self.shape.memory();
        &mut self.rows[first..][..self.shape.rows()]
    }

    /// Multipliers of a stage's rows in the last solution.
    pub fn multipliers(&self, stage: usize) -> &[T] {
        let rows = self.shape.rows();
        &self.rows[self.at(stage) * self.shape.memory() + 2 * rows..][..rows]
    }

    /// Moves the horizon on by one stage: the second becomes the first, and the first the last, whose data have to be
    /// written then. Inputs, slacks and multipliers stay as a guess at the next solution.
    pub fn shift(&mut self) {
        let rows = self.shape.rows();
        let memory = self.shape.memory();
        let last = self.at(self.stages.len() - 1);
        let fresh = self.first;
        if last != fresh {
            self.stages[fresh].v = self.stages[last].v;
            self.stages[fresh].t = self.stages[last].t;
            self.stages[fresh].plain = self.stages[last].plain;
            for i in 2 * rows..3 * rows {
                self.rows[fresh * memory + i] = self.rows[last * memory + i];
            }
            self.first = self.at(1);
        }
    }
}

/// Settings of a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings<T> {
    /// Cap on interior-point iterations.
    pub max_iterations: u32,
    /// Violation of rows and largest product of slack and multiplier at which the iterations end.
    pub tolerance: T,
    /// Sum of these products, in units of `Σ vᵀ R v + xᵀ Q x` or of one where that is less, at which the iterations end
    /// as well; zero for the largest product to decide.
    pub gap: T,
    /// Largest residual of the optimality conditions with which a point counts as solved.
    pub accepted_residual: T,
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The optimality conditions hold to the accepted residual.
    Solved,
    /// The iterations ended, but the residuals are too large.
    Inaccurate,
    /// The iteration cap was reached first.
    IterationCap,
    /// A Hessian is not positive definite, or a number is not finite.
    NumericalFailure,
    /// No point satisfies the constraints; of clarabel alone.
    Infeasible,
    /// The cost has no lower bound; of clarabel alone.
    Unbounded,
}

/// Residuals of the optimality conditions, each relative to the size of the terms it is made of (never less than one).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residuals<T> {
    /// Largest violation of a row or cone, or error of the dynamics.
    pub primal: T,
    /// Largest derivative of the Lagrangian by an unknown, or violation of the dual cone by a multiplier.
    pub dual: T,
    /// Gap between primal and dual cost.
    pub gap: T,
}

impl<T: Real> Residuals<T> {
    /// Whether all are numbers of at most `limit`.
    pub(crate) fn within(&self, limit: T) -> bool {
        self.primal <= limit && self.dual <= limit && self.gap <= limit
    }
}

impl Residuals<f64> {
    /// The largest of the three; infinite if any is not a number.
    pub fn worst(&self) -> f64 {
        let values = [self.primal, self.dual, self.gap];
        match values.iter().any(|value| value.is_nan()) {
            true => f64::INFINITY,
            false => values.into_iter().fold(0.0, f64::max),
        }
    }
}

/// The end of a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report<T> {
    /// How it ended.
    pub outcome: Outcome,
    /// Interior-point iterations: zero if no row was active.
    pub iterations: u32,
    /// Residuals of the point that was returned.
    pub residuals: Residuals<T>,
}
