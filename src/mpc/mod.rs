//! The latent-space model-predictive controller.

mod error;
mod qp;
mod sparse;

pub use error::MpcError;
pub use qp::{Cone, ConeProgram, Outcome, QpSettings, QpSolver, Residuals, SolverProfile};
pub use sparse::SparseColumns;
