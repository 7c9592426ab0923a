//! How good a model is, in numbers.
//!
//! Rollouts and recordings come in; fits (root mean square in SI units, coefficient of
//! determination) leave. Start with [`metrics`](Fit).

mod aslip;
mod coordinates;
mod metrics;

pub use aslip::{Aslip, AslipSums};
pub use coordinates::{CoordinateSums, PointwiseSums};
pub use metrics::{Fit, FitSums};
