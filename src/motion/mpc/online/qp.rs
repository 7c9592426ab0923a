//! The one adapter to clarabel, the interior-point solver.
//!
//! A [`ConeProgram`] is
//!
//! ```text
//! minimise   ½ xᵀ P x + qᵀ x
//! subject to A x + s = b,   s ∈ K = K₁ × K₂ × …
//! ```
//!
//! with `K` a product of zero, nonnegative and second-order cones. A [`QpSolver`] is built once
//! for a pattern of `P` and `A`; afterwards only values change. What a solve returns is a value,
//! [`Outcome`], and it is `Solved` only if the optimality conditions hold for the returned point
//! by [`QpSolver::residuals`], which is computed here from the problem's own data.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT,
};

use super::error::ControlError;

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

/// A matrix in compressed sparse columns, of which values change and the pattern does not.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseColumns(CscMatrix<f64>);

impl SparseColumns {
    /// The matrix of `(row, column, value)` in any order, each inside `n_rows` by `n_cols`, zeros among them; values of
    /// one place are added.
    pub fn new(n_rows: usize, n_cols: usize, entries: &[(usize, usize, f64)]) -> Self {
        let mut entries = entries.to_vec();
        entries.sort_unstable_by_key(|&(row, col, _)| (col, row));
        entries.dedup_by(|next, before| {
            let is_same = (next.0, next.1) == (before.0, before.1);
            before.2 += if is_same { next.2 } else { 0.0 };
            is_same
        });
        let mut colptr = vec![0; n_cols + 1];
        for &(row, col, _) in &entries {
            let is_inside = row < n_rows && col < n_cols;
            assert!(is_inside, "entry ({row}, {col}) lies inside the matrix");
            colptr[col + 1] += 1;
        }
        for col in 0..n_cols {
            colptr[col + 1] += colptr[col];
        }
        let rowval = entries.iter().map(|&(row, ..)| row).collect();
        let nzval = entries.iter().map(|&(.., value)| value).collect();
        Self(CscMatrix::new(n_rows, n_cols, colptr, rowval, nzval))
    }

    /// The matrix as the solver has it.
    pub fn csc(&self) -> &CscMatrix<f64> {
        &self.0
    }

    /// The stored values, column by column.
    pub fn values(&self) -> &[f64] {
        &self.0.nzval
    }

    /// The stored values, to be overwritten.
    pub(super) fn values_mut(&mut self) -> &mut [f64] {
        &mut self.0.nzval
    }

    /// Position of an entry among the values, or none if the pattern lacks it.
    pub(super) fn position(&self, row: usize, col: usize) -> Option<usize> {
        let start = self.0.colptr[col];
        let rows = &self.0.rowval[start..self.0.colptr[col + 1]];
        Some(start + rows.binary_search(&row).ok()?)
    }

    /// Overwrites an entry, which the pattern must hold.
    pub fn set(&mut self, row: usize, col: usize, value: f64) {
        let position = self.position(row, col);
        self.0.nzval[position.expect("entry belongs to the pattern")] = value;
    }

    /// Row and value of each entry of a column.
    fn column(&self, col: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.0.colptr[col]..self.0.colptr[col + 1];
        range.map(|entry| (self.0.rowval[entry], self.0.nzval[entry]))
    }

    /// `out += A x`.
    fn multiply_add(&self, x: &[f64], out: &mut [f64]) {
        for (col, factor) in x.iter().enumerate() {
            for (row, value) in self.column(col) {
                out[row] += value * factor;
            }
        }
    }

    /// `out += Aᵀ y`.
    fn transpose_multiply_add(&self, y: &[f64], out: &mut [f64]) {
        for (col, total) in out.iter_mut().enumerate() {
            let products = self.column(col).map(|(row, value)| value * y[row]);
            *total += products.fold(0.0, |sum, product| sum + product);
        }
    }

    /// `out += P x` for a symmetric `P` of which only the upper triangle is stored.
    pub fn symmetric_multiply_add(&self, x: &[f64], out: &mut [f64]) {
        for (col, factor) in x.iter().enumerate() {
            for (row, value) in self.column(col) {
                out[row] += value * factor;
                if row != col {
                    out[col] += value * x[row];
                }
            }
        }
    }
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
    /// For a problem whose rows and variables are already scaled and which is solved over and
    /// over: no equilibration, no iterative refinement, no presolve.
    Tuned,
    /// For a problem that is solved once: the solver's scaling and refinement, to the given tolerance.
    Scaled,
    /// The solver's own defaults: what a user gets who sets nothing. Data updates may be refused.
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

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The optimality conditions hold to the accepted residual.
    Solved,
    /// The solver stopped content or without progress, but the residuals are too large.
    Inaccurate,
    /// No point satisfies the constraints.
    Infeasible,
    /// The cost has no lower bound.
    Unbounded,
    /// The iteration cap was reached first.
    IterationCap,
    /// The factorisation broke down, or the result is not finite.
    NumericalFailure,
}

/// How far a point is from satisfying the optimality conditions, each relative to the size of the
/// terms it is made of (never less than one).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residuals {
    /// Distance of `b − A x` from its cone.
    pub primal: f64,
    /// `‖P x + q + Aᵀ y‖∞`, or the distance of the multipliers `y` from the dual cone if larger.
    pub dual: f64,
    /// `|xᵀ P x + qᵀ x + bᵀ y|`, the gap between primal and dual cost.
    pub gap: f64,
}

impl Residuals {
    /// The largest of the three; infinite if any is not a number.
    pub fn worst(&self) -> f64 {
        let values = [self.primal, self.dual, self.gap];
        if values.iter().any(|value| value.is_nan()) {
            return f64::INFINITY;
        }
        values.into_iter().fold(0.0, f64::max)
    }
}

/// A solver that keeps its factorisation pattern and memory from solve to solve.
pub struct QpSolver {
    program: ConeProgram,
    solver: DefaultSolver<f64>,
    settings: QpSettings,
    residuals: Residuals,
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
    ///
    /// # Errors
    /// [`ControlError::Solver`] if the sizes of the program's parts disagree or clarabel refuses it.
    pub fn new(program: ConeProgram, settings: QpSettings) -> Result<Self, ControlError> {
        let cones: Vec<SupportedConeT<f64>> =
            program.cones.iter().map(|&cone| supported(cone)).collect();
        let solver = DefaultSolver::new(
            program.p.csc(),
            &program.q,
            program.a.csc(),
            &program.b,
            &cones,
            clarabel_settings(&settings),
        )
        .map_err(|error| ControlError::Solver {
            reason: error.to_string(),
        })?;
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
        if !self.data_is_finite() {
            return Outcome::NumericalFailure;
        }
        // An iterator of all positions would do without whole vectors, at the price of a division per
        // entry inside clarabel: whole-vector updates are copied as they are.
        let (program, solver) = (&self.program, &mut self.solver);
        let updated = solver.update_q(&program.q).is_ok()
            && solver.update_b(&program.b).is_ok()
            && solver.update_P(&program.p.csc().nzval).is_ok()
            && solver.update_A(&program.a.csc().nzval).is_ok();
        if !updated {
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
    pub fn residuals(&self) -> Residuals {
        self.residuals
    }

    fn data_is_finite(&self) -> bool {
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        finite(&self.program.q)
            && finite(&self.program.b)
            && finite(self.program.p.values())
            && finite(self.program.a.values())
    }

    fn outcome(&self) -> Outcome {
        let accurate = self.residuals.worst() <= self.settings.accepted_residual;
        match self.solver.solution.status {
            SolverStatus::Solved
            | SolverStatus::AlmostSolved
            | SolverStatus::InsufficientProgress => match accurate {
                true => Outcome::Solved,
                false => Outcome::Inaccurate,
            },
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
                Outcome::Infeasible
            }
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => Outcome::Unbounded,
            SolverStatus::MaxIterations | SolverStatus::MaxTime => Outcome::IterationCap,
            SolverStatus::Unsolved
            | SolverStatus::NumericalError
            | SolverStatus::CallbackTerminated => Outcome::NumericalFailure,
        }
    }

    /// The optimality conditions at the returned point, from the program's data alone.
    fn check(&mut self) -> Residuals {
        let (x, y) = (&self.solver.solution.x, &self.solver.solution.z);
        let program = &self.program;

        self.row_work.fill(0.0);
        program.a.multiply_add(x, &mut self.row_work);
        let ax_size = norm_inf(&self.row_work);
        for (slack, b) in self.row_work.iter_mut().zip(&program.b) {
            *slack = b - *slack;
        }
        let primal = cone_violation(&program.cones, &self.row_work, Side::Primal)
            / ax_size.max(norm_inf(&program.b)).max(1.0);

        self.column_work.fill(0.0);
        program.p.symmetric_multiply_add(x, &mut self.column_work);
        let px_size = norm_inf(&self.column_work);
        let xpx = dot(x, &self.column_work);
        for (gradient, q) in self.column_work.iter_mut().zip(&program.q) {
            *gradient += q;
        }
        program.a.transpose_multiply_add(y, &mut self.column_work);
        let dual_size = px_size.max(norm_inf(&program.q)).max(norm_inf(y)).max(1.0);
        let dual = norm_inf(&self.column_work).max(cone_violation(&program.cones, y, Side::Dual))
            / dual_size;

        let (qx, by) = (dot(&program.q, x), dot(&program.b, y));
        let (primal_cost, dual_cost) = (0.5 * xpx + qx, -0.5 * xpx - by);
        let gap = (primal_cost - dual_cost).abs() / primal_cost.abs().min(dual_cost.abs()).max(1.0);
        Residuals { primal, dual, gap }
    }
}

/// Which of the two cones a vector is measured against.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Primal,
    Dual,
}

/// Largest violation of any cone; not a number if any entry is not.
fn cone_violation(cones: &[Cone], values: &[f64], side: Side) -> f64 {
    let mut worst = 0.0_f64;
    let mut start = 0;
    for &cone in cones {
        let part = &values[start..start + cone.dim()];
        start += cone.dim();
        let violation = match (cone, side) {
            (Cone::Zero(_), Side::Primal) => norm_inf(part),
            (Cone::Zero(_), Side::Dual) => 0.0,
            (Cone::Nonnegative(_), _) => {
                part.iter().fold(0.0, |worst, &value| larger(worst, -value))
            }
            (Cone::SecondOrder(_), _) => match part.split_first() {
                Some((head, tail)) => dot(tail, tail).sqrt() - head,
                None => 0.0,
            },
        };
        worst = larger(worst, violation);
    }
    worst
}

/// The larger of two numbers, or not a number if either is (unlike `f64::max`).
fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

fn norm_inf(values: &[f64]) -> f64 {
    let sizes = values.iter().map(|value| value.abs());
    sizes.fold(0.0, larger)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
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
