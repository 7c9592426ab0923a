//! How good a model is, in numbers.
//!
//! Rollouts and recordings come in; fits (root mean square in SI units, coefficient of
//! determination), template models under the same inputs, stability and the losses of the lift leave.
//! `docs/mathematics.md` defines each figure once. Start with `assessment.rs`, then
//! [`metrics`](Fit).

mod aslip;
mod assessment;
mod baseline;
mod coordinates;
mod lift;
mod linearised;
mod metrics;

pub use aslip::{Aslip, AslipRollout, AslipSums};
pub use assessment::{Assessment, SegmentRun};
pub use baseline::{Baseline, Template, fit_aslip};
pub use coordinates::{CoordinateSums, PointwiseSums};
pub use lift::{LAMBDA, LiftSums, combined_loss};
pub use linearised::{LinearisedPhase, RANK_THRESHOLD, linearise_phases};
pub use metrics::{Fit, FitSums};
