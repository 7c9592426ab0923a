//! Figures of a controller's run along a recording: counts, times and torques; and those that depend on the dynamics,
//! compared with baselines.

use serde::Serialize;

use super::along_recording::{ReferenceInput, along_recording};
use super::assessment::EvaluateError;
use super::coordinates::Mean;
use super::prediction::{PredictionError, prediction_error, recorded_stages, uninformed};
use super::recovery::{Driver, Recovery, recovery};
use super::torque::{ByContact, Comparison};
use super::verdict::failure;
use crate::model::ReducedModel;
use crate::mpc::{
    Command, Controller, MAX_STRUCTURED_DIM, MpcSettings, STEP_SLACK, Solver, Status,
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
    /// Steps with a checked plan within all limits.
    pub solved: usize,
    /// Steps with a checked plan that leaves joint limits.
    pub softened: usize,
    /// Steps without a plan of their own.
    pub failed: usize,
    pub step_us: StepTimes,
    /// Wall times of the preparations between steps, which no command waits for:
    /// [`Controller::prepare`](crate::mpc::Controller::prepare).
    pub prepare_us: StepTimes,
    /// Agreement of commanded and recorded torques, see [`Comparison::r2`].
    pub torque_r2: ByContact,
    /// The same for torques that the lift alone makes of projected recorded inputs, at every sample; see
    /// [`lift_comparison`](super::lift_comparison).
    pub lift_r2: ByContact,
    /// Root mean square of commanded minus recorded torques over all steps and joints, N m.
    pub torque_rms_nm: Option<f64>,
    /// Root mean square over all steps, stages and latents of planned minus reference position, in standard deviations
    /// of the reference.
    pub tracking_rms: Option<f64>,
    pub limit_violations: usize,
    /// Steps that leave a friction cone by more than a thousandth of the weight; none if the controller constrains
    /// none.
    pub friction_violations: Option<usize>,
    /// Mean of `|F_lift − G τ| / |F_lift|` over the steps where it is defined.
    pub inconsistency: Option<f64>,
    /// Steps left out of the comparison of torques: the recording's are no torques of the robot.
    #[serde(rename = "implausible_steps")]
    pub implausible: usize,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    /// The counts; [`Self::summary`] fills in the rest.
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

    pub(super) fn summary(mut self) -> Summary {
        self.times_us.sort_by(f64::total_cmp);
        self.preparations_us.sort_by(f64::total_cmp);
        Summary {
            step_us: step_times(&self.times_us),
            prepare_us: step_times(&self.preparations_us),
            torque_r2: self.torque.r2(),
            lift_r2: self.lift.r2(),
            torque_rms_nm: self.torque.rms(),
            tracking_rms: self.tracking.get().map(f64::sqrt),
            inconsistency: self.inconsistency.get(),
            ..self.summary
        }
    }
}

/// Percentiles of sorted times: the smallest value that so many percent do not exceed.
fn step_times(sorted_us: &[f64]) -> StepTimes {
    let rank = |share: f64| {
        let rank = (share * sorted_us.len() as f64).ceil() as usize;
        sorted_us.get(rank.max(1) - 1).copied().unwrap_or(0.0)
    };
    StepTimes {
        p50: rank(0.5),
        p99: rank(0.99),
        max: sorted_us.last().copied().unwrap_or(0.0),
    }
}

/// A model and its baselines along one recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ControlMetrics {
    /// Predictions one stage ahead with the recorded input; none if no stage lies within one phase.
    pub prediction_rms: Option<PredictionError>,
    /// Agreement of commanded and recorded torques where the controller has to find the input itself.
    pub torque_r2: ByContact,
    /// Root mean square of commanded minus recorded torques of the same run, N m.
    pub torque_rms_nm: Option<f64>,
    /// Mean of `|F_lift - G tau| / |F_lift|` over the steps of the same run where it is defined.
    pub inconsistency: Option<f64>,
    /// Deviation of the body after pushes, m; none where the robot nowhere stands for long enough.
    pub recovery_rms_m: Option<f64>,
    /// Planned minus reference positions after the pushes, in standard deviations of the reference.
    pub tracking_rms: Option<f64>,
    pub baseline: Baselines,
    /// Share of the steps of the same run that have no plan of their own.
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
    /// The recorded torques after the pushes.
    pub replay: Pushed,
    /// A body that keeps its velocity.
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
    let pushed = |controller: &mut Controller, driver| recovery(controller, recording, driver);
    let feedback = pushed(&mut controller, Driver::Feedback)?;
    let off = |recovery: Recovery| Pushed {
        recovery_rms_m: recovery.rms_m(),
    };
    let mut metrics = ControlMetrics {
        prediction_rms: predicted(Some(model))?,
        torque_r2: run.torque_r2,
        torque_rms_nm: run.torque_rms_nm,
        inconsistency: run.inconsistency,
        recovery_rms_m: feedback.rms_m(),
        tracking_rms: feedback.tracking_rms(),
        unplanned_share: run.failed as f64 / run.steps as f64,
        baseline: Baselines {
            no_dynamics: NoDynamics {
                prediction_rms: predicted(Some(&blind))?,
                torque_r2: blind_run.torque_r2,
                torque_rms_nm: blind_run.torque_rms_nm,
                recovery_rms_m: pushed(&mut blind_controller, Driver::Feedback)?.rms_m(),
            },
            feedback_off: off(pushed(&mut controller, Driver::NoFeedback)?),
            replay: off(pushed(&mut controller, Driver::Replay)?),
            constant_velocity: ConstantVelocity {
                prediction_rms: predicted(None)?,
            },
        },
        failure: None,
    };
    metrics.failure = failure(&metrics);
    Ok(metrics)
}

/// The settings that a controller along these recordings has by default: recordings of fewer samples than a default
/// stage has are followed at the rate of the slowest.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn step_times_are_ranks_of_the_sorted_list() {
        let times: Vec<f64> = (1..=200).map(f64::from).collect();
        assert_eq!(
            step_times(&times),
            StepTimes {
                p50: 100.0,
                p99: 198.0,
                max: 200.0
            }
        );
        assert_eq!(step_times(&[]), StepTimes::default());
    }
}
