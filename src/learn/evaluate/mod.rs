//! Figures of a model's quality.
//!
//! In: rollouts and recordings. Out: fits (root mean square in SI units, coefficient of determination), template models
//! under the same inputs, stability, the losses of the lift and a [`Verdict`]. `docs/reference/metrics.md` defines each
//! figure once. Start with `assessment`, then [`coordinates`](Fit).

mod along_recording;
mod aslip;
mod assessment;
mod coefficient_trials;
mod control_metrics;
mod coordinates;
#[cfg(test)]
#[path = "../../../tests/evaluate/figures.rs"]
mod figures;
mod horizons;
mod invariance;
mod prediction;
mod round_trip;
mod stride;
mod verdict;

pub use along_recording::{ReferenceInput, Run, StepRow, along_recording};
pub use aslip::{Aslip, AslipSums, Baseline};
pub use assessment::{Assessment, EvaluateError, Horizon, SegmentRun, remarks};
pub use control_metrics::{ControlMetrics, Summary, control_metrics, usual_settings};
pub(crate) use coordinates::is_plausible;
pub use coordinates::{
    ByContact, Comparison, CoordinateSums, Fit, FitSums, LAMBDA, PointwiseSums, combined_loss,
};
pub use invariance::{Invariance, PhaseInvariance};
pub use prediction::{LinearisedPhase, PredictionError, eigenvalues};
pub(crate) use prediction::{linearise_phases, state_matrix};
pub use round_trip::RoundTrip;
pub use stride::StrideGrowth;
pub(crate) use stride::{transition, usual_stride};
pub use verdict::{Bound, Verdict, VerdictRow, verdict, verdict_by_default, with_unit};

use coordinates::Mean;
use nalgebra::{
    Complex, DMatrix, DVector, Rotation3, SVector, Schur, SymmetricEigen, Vector2, Vector3,
};
use serde::Serialize;

use crate::lower::{CompiledModel, LowerError};
use crate::model::{
    CoordinateOrder, JumpPart, Library, LibraryChoice, LibraryOrder, MassCentre, ModelError, Phase,
    ReducedModel, StateMap,
};
use crate::mpc::{
    Command, Controller, Lift, Measurement, MpcError, MpcSettings, ReferenceSamples, STEP_SLACK,
    Solver, StanceState, Status, foot_forces,
};
use crate::recording::{
    CHATTER_SAMPLES, PhaseRule, Recording, RecordingError, Segment, Stance, between, stretches,
    stride_s,
};
use crate::robot::{
    BODY_DIM, BODY_X, BODY_Z, ContactFlags, GRAVITY_M_S2, InputRule, JOINT_DIM, Leg, Robot,
    STATE_DIM, WrenchFrame, rotation,
};
use crate::sim::{
    LatentSegment, Restart, Rollout, SimError, integrate_stretches, restart_windows, rollout,
    rollout_over,
};

type Result<T, E = EvaluateError> = std::result::Result<T, E>;
