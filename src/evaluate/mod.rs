//! How good a model is, in numbers.
//!
//! Rollouts and recordings come in; fits (root mean square in SI units, coefficient of
//! determination), template models under the same inputs, stability and the losses of the lift leave.
//! `docs/mathematics.md` defines each figure once. Start with `assessment.rs`, then
//! [`metrics`](Fit).

mod along_recording;
mod aslip;
mod assessment;
mod baseline;
mod control;
mod coordinates;
mod error;
mod lift;
mod linearised;
mod metrics;
mod torque;

pub use along_recording::{ReferenceInput, Run, StepRow, along_recording, lift_comparison};
pub use aslip::{Aslip, AslipRollout, AslipSums};
pub use assessment::{Assessment, SegmentRun};
pub use baseline::{Baseline, fit_aslip};
pub use control::{StepTimes, Summary};
pub use coordinates::{CoordinateSums, PointwiseSums};
pub use error::EvaluateError;
pub use lift::{LAMBDA, LiftSums, combined_loss};
pub use linearised::{LinearisedPhase, RANK_THRESHOLD, linearise_phases};
pub use metrics::{Fit, FitSums};
pub use torque::{ByContact, Comparison, is_plausible};
