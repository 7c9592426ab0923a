//! Structured solver of quadratic programs over the stages of a horizon.
//!
//! ```text
//! minimise   Σ_k ½ v_kᵀ R v_k + ½ x_{k+1}ᵀ Q x_{k+1} + price t_k
//! subject to x_{k+1} = A_k x_k + B_k v_k + c_k,   x_0 given
//!            G_k v_k <= g_k,   E_k x_{k+1} − t_k <= e_k,   t_k >= 0
//!            L_k v_k − L_{k−1} v_{k−1} <= l_k,   L_0 v_0 <= l_0
//! ```
//!
//! In: a [`Program`], stages and rows in memory that the caller lends. Out: inputs, states and multipliers in that
//! memory, and a [`Report`]. First the linear-quadratic optimum, by gains that [`Program::prepare`] makes ahead; if it
//! keeps every row it is the optimum. Otherwise Mehrotra's interior point, of which each step is another Riccati
//! recursion, from the last solution or, where that proves far away, from a well-centred point. Iterations are bounded;
//! `Solved` means that the optimality conditions hold, computed from the program's own numbers.
//!
//! Nothing here needs `std` or allocates, and every sum has one order: C that `romc compile --emit controller-c` makes
//! has the same bits. Read `problem` first, then `solve`.
//!
//! ```
//! use romc::solver::{Cost, Links, Outcome, Program, RowMatrices, Settings, Shape, Stage};
//!
//! // A point mass that is pushed back to zero with a force of at most one, ten steps of 0.1 s.
//! let mut stages = [Stage::<f64, 2, 1>::zeros(); 10];
//! for stage in &mut stages {
//!     (stage.a, stage.b) = ([[1.0, 0.1], [0.0, 1.0]], [[0.005], [0.1]]);
//! }
//! let shape = Shape { input: 2, ..Shape::default() };
//! let mut rows = vec![0.0; 10 * shape.memory()];
//! let mut program = Program {
//!     stages: &mut stages,
//!     rows: &mut rows,
//!     first: 0,
//!     shape,
//!     matrices: RowMatrices { input: &[[1.0], [-1.0]], soft: &[] },
//!     links: Links::none(),
//!     cost: Cost { state: [1.0, 0.1], terminal: [10.0, 1.0], input: [0.01], slack: 0.0 },
//! };
//! for stage in 0..10 {
//!     program.bounds_mut(stage).copy_from_slice(&[1.0, 1.0]);
//! }
//! assert!(program.prepare());
//! let settings = Settings { max_iterations: 40, tolerance: 1e-9, gap: 1e-8, accepted_residual: 1e-6 };
//! let report = program.solve(&[1.0, 0.0], false, &settings);
//! assert_eq!(report.outcome, Outcome::Solved);
//! assert!((program.stages[0].v[0] + 1.0).abs() < 1e-8);
//! ```
// Written in the subset of Rust that `src/translate` makes C of: loops over indices, plain structs, no closures.
#![allow(
    clippy::needless_range_loop,
    clippy::assign_op_pattern,
    clippy::manual_div_ceil,
    clippy::neg_cmp_op_on_partial_ord,
    clippy::too_many_arguments
)]

mod interior;
mod links;
mod lower;
mod point;
mod problem;
#[allow(
    clippy::manual_memcpy,
    reason = "loops over indices, which C is made of"
)]
mod riccati;
mod rows;
mod scalar;
mod solve;

pub use links::Links;
pub use problem::{
    Cost, Outcome, Program, ROW_NUMBERS, Report, Residuals, RowMatrices, Settings, Shape, Stage,
};
pub use scalar::Real;
