//! The one adapter to clarabel, the interior-point solver. A [`ConeProgram`] is
//!
//! ```text
//! minimise   ½ xᵀ P x + qᵀ x
//! subject to A x + s = b,   s ∈ K = K₁ × K₂ × …
//! ```
//!
//! with `K` a product of zero, nonnegative and second-order cones. A [`QpSolver`] is built once for a pattern of `P`
//! and `A`; afterwards only values change. An [`Outcome`] is `Solved` only if the returned point meets the optimality
//! conditions by [`QpSolver::residuals`], computed here from the problem's own data.

use clarabel::algebra::{CscMatrix, VectorMath};
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT,
};

use super::error::ControlError;
use crate::solver::{Outcome, Residuals};

/// One factor of the cone that holds the slack `s = b − A x`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cone {
    /// `s = 0`, this many rows.
    Zero(usize),
    /// `s ≥ 0`, this many rows.
    Nonnegative(usize),
    /// `s₀ ≥ ‖(s₁, s₂, …)‖₂`, this many rows.
    SecondOrder(usize),
}

impl Cone {
    /// Number of rows.
    pub fn dim(self) -> usize {
        match self {
            Cone::Zero(dim) | Cone::Nonnegative(dim) | Cone::SecondOrder(dim) => dim,
        }
    }
}

/// A matrix in compressed sparse columns.
pub(crate) type SparseColumns = CscMatrix<f64>;

/// The matrix of `(row, column, value)` within its size, in any order, also zeros; values of one place are added.
pub fn sparse(n_rows: usize, n_cols: usize, entries: &[(usize, usize, f64)]) -> SparseColumns {
    let mut entries = entries.to_vec();
    entries.sort_unstable_by_key(|&(row, col, _)| (col, row));
    let rows = entries.iter().map(|entry| entry.0).collect();
    let columns = entries.iter().map(|entry| entry.1).collect();
    let values = entries.iter().map(|entry| entry.2).collect();
    CscMatrix::new_from_triplets(n_rows, n_cols, rows, columns, values)
}

fn entries(matrix: &SparseColumns) -> impl Iterator<Item = (usize, usize, f64)> {
    let column = move |col| (matrix.colptr[col]..matrix.colptr[col + 1]).map(move |at| (col, at));
    let entries = (0..matrix.n).flat_map(column);
    entries.map(|(col, at)| (matrix.rowval[at], col, matrix.nzval[at]))
}

/// Position of an entry among the values, or none if the pattern lacks it.
pub(super) fn position(matrix: &SparseColumns, row: usize, col: usize) -> Option<usize> {
    let start = matrix.colptr[col];
    let rows = &matrix.rowval[start..matrix.colptr[col + 1]];
    Some(start + rows.binary_search(&row).ok()?)
}

/// A convex quadratic program over cones; see the module for its mathematics.
#[derive(Debug, Clone, PartialEq)]
pub struct ConeProgram {
    /// Upper triangle of the cost's quadratic part.
    pub p: SparseColumns,
    /// Linear part of the cost.
    pub q: Vec<f64>,
    /// Constraint matrix.
    pub a: SparseColumns,
    /// Right-hand side of the constraints.
    pub b: Vec<f64>,
    /// Cones of the rows, in order.
    pub cones: Vec<Cone>,
}

/// How clarabel is set up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolverProfile {
    /// For scaled problems solved over and over: no equilibration, no iterative refinement, no presolve.
    Tuned,
    /// For a problem that is solved once: the solver's scaling and refinement, to the given tolerance.
    Scaled,
    /// The solver's own defaults, without any settings of romc. Data updates may be refused.
    AsShipped,
}

/// Settings of a [`QpSolver`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QpSettings {
    /// Which of clarabel's settings are used.
    pub profile: SolverProfile,
    /// Cap on interior-point iterations: the deterministic deadline.
    pub max_iterations: u32,
    /// Feasibility and gap tolerance handed to the solver (not `AsShipped`).
    pub tolerance: f64,
    /// Largest relative residual with which a point counts as solved.
    pub accepted_residual: f64,
}

impl Default for QpSettings {
    fn default() -> Self {
        Self {
            profile: SolverProfile::Tuned,
            max_iterations: 40,
            tolerance: 1e-6,
            accepted_residual: 2e-5,
        }
    }
}

/// A solver that keeps its factorisation pattern and memory from solve to solve.
pub struct QpSolver {
    program: ConeProgram,
    solver: DefaultSolver<f64>,
    settings: QpSettings,
    residuals: Residuals<f64>,
    row_work: Vec<f64>,
    column_work: Vec<f64>,
}

impl std::fmt::Debug for QpSolver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("QpSolver")
            .field("variables", &self.program.q.len())
            .field("rows", &self.program.b.len())
            .field("settings", &self.settings)
            .finish_non_exhaustive()
    }
}

impl QpSolver {
    /// Builds a solver for the program's pattern; its values are the first data.
    pub fn new(program: ConeProgram, settings: QpSettings) -> Result<Self, ControlError> {
        let ConeProgram { p, q, a, b, cones } = &program;
        let cones: Vec<_> = cones.iter().map(|&cone| supported(cone)).collect();
        let solver = DefaultSolver::new(p, q, a, b, &cones, clarabel_settings(&settings));
        let refused = |reason: String| ControlError::Solver { reason };
        let solver = solver.map_err(|error| refused(error.to_string()))?;
        Ok(Self {
            row_work: vec![0.0; program.b.len()],
            column_work: vec![0.0; program.q.len()],
            residuals: Residuals {
                primal: f64::INFINITY,
                dual: f64::INFINITY,
                gap: f64::INFINITY,
            },
            program,
            solver,
            settings,
        })
    }

    /// The data of the next solve.
    pub fn program(&self) -> &ConeProgram {
        &self.program
    }

    /// The data of the next solve, to be overwritten: values only, sizes and patterns stay.
    pub fn program_mut(&mut self) -> &mut ConeProgram {
        &mut self.program
    }

    /// Solves the program with its present values.
    pub fn solve(&mut self) -> Outcome {
        let ConeProgram { p, q, a, b, .. } = &self.program;
        let values = [q, b, &p.nzval, &a.nzval];
        // An iterator of all positions would do without whole vectors, at the price of a division per entry inside
        // clarabel: whole-vector updates are copied as they are.
        let solver = &mut self.solver;
        let is_taken = values.iter().all(|values| values.is_finite())
            && solver.update_q(q).is_ok()
            && solver.update_b(b).is_ok()
            && solver.update_P(&p.nzval).is_ok()
            && solver.update_A(&a.nzval).is_ok();
        if !is_taken {
            return Outcome::NumericalFailure;
        }
        self.solver.solve();
        self.residuals = self.check();
        self.outcome()
    }

    /// The primal point `x` of the last solve.
    pub fn solution(&self) -> &[f64] {
        &self.solver.solution.x
    }

    /// The multipliers of the rows at the last solve.
    pub fn multipliers(&self) -> &[f64] {
        &self.solver.solution.z
    }

    /// Interior-point iterations of the last solve.
    pub fn iterations(&self) -> u32 {
        self.solver.solution.iterations
    }

    /// How well the last solution satisfies the optimality conditions.
    pub fn residuals(&self) -> Residuals<f64> {
        self.residuals
    }

    fn outcome(&self) -> Outcome {
        use SolverStatus::*;
        match self.solver.solution.status {
            Solved | AlmostSolved | InsufficientProgress => {
                match self.residuals.worst() <= self.settings.accepted_residual {
                    true => Outcome::Solved,
                    false => Outcome::Inaccurate,
                }
            }
            PrimalInfeasible | AlmostPrimalInfeasible => Outcome::Infeasible,
            DualInfeasible | AlmostDualInfeasible => Outcome::Unbounded,
            MaxIterations | MaxTime => Outcome::IterationCap,
            Unsolved | NumericalError | CallbackTerminated => Outcome::NumericalFailure,
        }
    }

    fn check(&mut self) -> Residuals<f64> {
        let (x, y) = (&self.solver.solution.x, &self.solver.solution.z);
        let ConeProgram { p, q, a, b, cones } = &self.program;
        let (slack, gradient) = (&mut self.row_work, &mut self.column_work);

        slack.fill(0.0);
        entries(a).for_each(|(row, col, value)| slack[row] += value * x[col]);
        let primal_size = slack.norm_inf().max(b.norm_inf()).max(1.0);
        slack.axpby(1.0, b, -1.0);
        let primal = cone_violation(cones, slack, false) / primal_size;

        gradient.fill(0.0);
        entries(p).for_each(|(row, col, value)| {
            gradient[row] += value * x[col];
            if row != col {
                gradient[col] += value * x[row];
            }
        });
        let sizes = [gradient.norm_inf(), q.norm_inf(), y.norm_inf()];
        let dual_size = sizes.into_iter().fold(1.0, f64::max);
        let xpx = x.dot(gradient);
        gradient.axpby(1.0, q, 1.0);
        entries(a).for_each(|(row, col, value)| gradient[col] += value * y[row]);
        let dual = gradient.norm_inf().max(cone_violation(cones, y, true)) / dual_size;

        let (qx, by) = (q.dot(x), b.dot(y));
        let (primal_cost, dual_cost) = (0.5 * xpx + qx, -0.5 * xpx - by);
        let gap = (primal_cost - dual_cost).abs() / primal_cost.abs().min(dual_cost.abs()).max(1.0);
        Residuals { primal, dual, gap }
    }
}

/// Largest violation of any cone, of the dual ones if those of the multipliers; not a number if any entry is not.
fn cone_violation(cones: &[Cone], values: &[f64], is_dual: bool) -> f64 {
    let mut worst = 0.0_f64;
    let mut rest = values;
    for &cone in cones {
        let part = rest.split_off(..cone.dim()).expect("rows of all cones");
        let violation = match (cone, part) {
            (Cone::Zero(_), _) if is_dual => 0.0,
            (Cone::Zero(_), _) => part.norm_inf(),
            (Cone::Nonnegative(_), _) => {
                part.iter().fold(0.0, |worst, value| larger(worst, -value))
            }
            (Cone::SecondOrder(_), [head, tail @ ..]) => tail.norm() - head,
            (Cone::SecondOrder(_), []) => 0.0,
        };
        worst = larger(worst, violation);
    }
    worst
}

/// The larger of two numbers, or not a number if either is (unlike `f64::max`).
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

fn supported(cone: Cone) -> SupportedConeT<f64> {
    match cone {
        Cone::Zero(dim) => SupportedConeT::ZeroConeT(dim),
        Cone::Nonnegative(dim) => SupportedConeT::NonnegativeConeT(dim),
        Cone::SecondOrder(dim) => SupportedConeT::SecondOrderConeT(dim),
    }
}

fn clarabel_settings(settings: &QpSettings) -> DefaultSettings<f64> {
    let mut builder = DefaultSettingsBuilder::<f64>::default();
    builder
        .verbose(false)
        .max_iter(settings.max_iterations)
        .direct_solve_method("qdldl".to_string());
    if settings.profile != SolverProfile::AsShipped {
        builder
            .tol_feas(settings.tolerance)
            .tol_gap_abs(settings.tolerance)
            .tol_gap_rel(settings.tolerance);
    }
    if settings.profile == SolverProfile::Tuned {
        builder
            .presolve_enable(false)
            .input_sparse_dropzeros(false)
            .equilibrate_enable(false)
            .iterative_refinement_enable(false);
    }
    builder.build().expect("every setting has a legal value")
}
