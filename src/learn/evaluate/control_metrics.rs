//! Figures of a controller's run along a recording: counts, times and torques; and those that depend on the dynamics,
//! compared with baselines.

use serde::Serialize;

use super::along_recording::{ReferenceInput, along_recording};
use super::assessment::EvaluateError;
use super::coordinates::Mean;
use super::prediction::{PredictionError, prediction_error, recorded_stages, uninformed};
use super::recovery::{Driver, recovery};
use super::torque::{ByContact, Comparison};
use super::verdict::failure;
use crate::model::ReducedModel;
use crate::mpc::{
    Command, Controller, MAX_STRUCTURED_DIM, MpcError, MpcSettings, STEP_SLACK, Solver, Status,
};
use crate::recording::{Recording, Segment};

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct StepTimes {
    pub p50: f64,
    pub p99: f64,
    pub max: f64,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Summary {
    pub steps: usize,
    pub solved: usize,
    /// Steps with a checked plan that leaves joint limits.
    pub softened: usize,
    pub failed: usize,
    pub step_us: StepTimes,
    /// Of [`Controller::prepare`](crate::mpc::Controller::prepare), which no command waits for.
    pub prepare_us: StepTimes,
    pub torque_r2: ByContact,
    /// Of the lift alone, see [`lift_comparison`](super::lift_comparison).
    pub lift_r2: ByContact,
    pub torque_rms_nm: Option<f64>,
    /// Of planned minus reference positions, in standard deviations of the reference.
    pub tracking_rms: Option<f64>,
    pub limit_violations: usize,
    /// None if the controller constrains no friction cone.
    pub friction_violations: Option<usize>,
    /// Mean of `|F_lift − G τ| / |F_lift|` over the steps where it is defined.
    pub inconsistency: Option<f64>,
    #[serde(rename = "implausible_steps")]
    pub implausible: usize,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    pub(super) summary: Summary,
    times_us: Vec<f64>,
    pub(super) preparations_us: Vec<f64>,
    inconsistency: Mean,
    pub(super) torque: Comparison,
    pub(super) lift: Comparison,
    pub(super) tracking: Mean,
}

impl Tally {
    pub(super) fn count(&mut self, command: &Command) {
        let counts = &mut self.summary;
        counts.steps += 1;
        match command.status {
            Status::Softened => counts.softened += 1,
            status if status.has_plan() => counts.solved += 1,
            _ => counts.failed += 1,
        }
        self.times_us.push(command.solve_us);
        if let Some(value) = command.inconsistency {
            self.inconsistency.add(value);
        }
    }

    pub(super) fn summary(self) -> Summary {
        Summary {
            step_us: step_times(self.times_us),
            prepare_us: step_times(self.preparations_us),
            torque_r2: self.torque.r2(),
            lift_r2: self.lift.r2(),
            torque_rms_nm: self.torque.rms(),
            tracking_rms: self.tracking.root(),
            inconsistency: self.inconsistency.get(),
            ..self.summary
        }
    }
}

/// Percentiles: the smallest value that so many percent do not exceed.
fn step_times(mut times_us: Vec<f64>) -> StepTimes {
    times_us.sort_by(f64::total_cmp);
    let [p50, p99, max] = [0.5, 0.99, 1.0].map(|share| {
        let rank = (share * times_us.len() as f64).ceil() as usize;
        times_us.get(rank.max(1) - 1).copied().unwrap_or(0.0)
    });
    StepTimes { p50, p99, max }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ControlMetrics {
    /// Predictions one stage ahead with the recorded input; none if no stage lies within one phase.
    pub prediction_rms: Option<PredictionError>,
    /// Agreement of commanded and recorded torques where the controller has to find the input itself.
    pub torque_r2: ByContact,
    pub torque_rms_nm: Option<f64>,
    /// Mean of `|F_lift - G tau| / |F_lift|` over the steps of the same run where it is defined.
    pub inconsistency: Option<f64>,
    /// Deviation of the body after pushes, m; none where the robot nowhere stands for long enough.
    pub recovery_rms_m: Option<f64>,
    /// Planned minus reference positions after the pushes, in standard deviations of the reference.
    pub tracking_rms: Option<f64>,
    pub baseline: Baselines,
    pub unplanned_share: f64,
    /// The counted rows of the [verdict](super::Verdict) that fail along this recording, in words.
    pub failure: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Baselines {
    /// The same controller on a copy of the model with `ddz = g u_lat`, `g` fitted to this very recording.
    pub no_dynamics: NoDynamics,
    /// The same controller, given the recorded state after the pushes.
    pub feedback_off: Pushed,
    pub replay: Pushed,
    pub constant_velocity: ConstantVelocity,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoDynamics {
    pub prediction_rms: Option<PredictionError>,
    pub torque_r2: ByContact,
    pub torque_rms_nm: Option<f64>,
    pub recovery_rms_m: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pushed {
    pub recovery_rms_m: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConstantVelocity {
    pub prediction_rms: Option<PredictionError>,
}

/// Measures a model and its baselines along a recording.
///
/// Programs that the structured solver takes whole are solved by it whatever the settings say: the optimum is the same,
/// and some thirty times as many programs are solved here as along the recording alone.
///
/// # Errors
/// [`EvaluateError::Control`] as [`along_recording`], [`EvaluateError::Sim`] if the recording cannot be encoded.
pub fn control_metrics(
    model: &ReducedModel,
    recording: &Recording,
    mut settings: MpcSettings,
) -> Result<ControlMetrics, EvaluateError> {
    let has_links_or_cones =
        settings.torque_rate_nm_s.is_some() || settings.body_friction.is_some();
    if model.latent_dim() <= MAX_STRUCTURED_DIM && !has_links_or_cones {
        settings.solver = Solver::Riccati;
    }
    let stages = recorded_stages(model, recording, settings.step_s)?;
    let predicted = |dynamics: Option<&ReducedModel>| prediction_error(model, dynamics, &stages);
    let blind = uninformed(model, &stages)?;
    let mut controller = crate::mpc::controller(model, settings)?;
    let mut blind_controller = crate::mpc::controller(&blind, settings)?;
    let own_input = |controller: &mut Controller| {
        along_recording(controller, recording, ReferenceInput::None, |_, _| {})
    };
    let run = own_input(&mut controller)?.summary;
    let blind_run = own_input(&mut blind_controller)?.summary;
    let feedback = recovery(&mut controller, recording, Driver::Feedback)?;
    let pushed = |controller: &mut Controller, driver| {
        let recovery_rms_m = recovery(controller, recording, driver)?.deviations.root();
        Ok::<_, MpcError>(Pushed { recovery_rms_m })
    };
    let mut metrics = ControlMetrics {
        prediction_rms: predicted(Some(model))?,
        torque_r2: run.torque_r2,
        torque_rms_nm: run.torque_rms_nm,
        inconsistency: run.inconsistency,
        recovery_rms_m: feedback.deviations.root(),
        tracking_rms: feedback.planned.root(),
        unplanned_share: run.failed as f64 / run.steps as f64,
        baseline: Baselines {
            no_dynamics: NoDynamics {
                prediction_rms: predicted(Some(&blind))?,
                torque_r2: blind_run.torque_r2,
                torque_rms_nm: blind_run.torque_rms_nm,
                recovery_rms_m: pushed(&mut blind_controller, Driver::Feedback)?.recovery_rms_m,
            },
            feedback_off: pushed(&mut controller, Driver::NoFeedback)?,
            replay: pushed(&mut controller, Driver::Replay)?,
            constant_velocity: ConstantVelocity {
                prediction_rms: predicted(None)?,
            },
        },
        failure: None,
    };
    metrics.failure = failure(&metrics);
    Ok(metrics)
}

/// Default settings, but at the rate of the slowest recording where that has fewer samples than a default stage.
pub fn usual_settings(recordings: &[Recording]) -> MpcSettings {
    let default = MpcSettings::default();
    let segments = recordings.iter().flat_map(|recording| &recording.segments);
    let steps = segments.filter(|segment| segment.len() >= 2);
    let slowest_s = steps.map(Segment::mean_step_s).fold(0.0, f64::max);
    let is_slow = default.step_s < STEP_SLACK * slowest_s;
    MpcSettings {
        step_s: if is_slow { slowest_s } else { default.step_s },
        ..default
    }
}
