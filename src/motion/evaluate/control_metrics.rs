//! What a run along a recording says of the model: figures that a wrong model changes, beside baselines.

use serde::Serialize;

use super::along_recording::{ReferenceInput, along_recording};
use super::error::EvaluateError;
use super::prediction::{PredictionError, prediction_error, recorded_stages, uninformed};
use super::recovery::{Driver, Recovery, recovery};
use super::torque::ByContact;
use crate::model::ReducedModel;
use crate::mpc::{Controller, MAX_STRUCTURED_DIM, MpcSettings, Solver};
use crate::recording::Recording;

/// Share of a baseline's error from which a model is no better than it.
const NO_BETTER: f64 = 0.98;

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
    /// The same figures of others.
    pub baseline: Baselines,
    /// Why the model has failed here, if it has.
    pub failure: Option<String>,
}

/// What a model is compared with.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Baselines {
    /// The same controller on a copy of the model with `ddz = g u_lat`, `g` fitted to this very recording.
    pub knows_nothing: KnowsNothing,
    /// The same controller, given the recorded state after the pushes.
    pub feedback_off: Pushed,
    /// The recorded torques after the pushes.
    pub replay: Pushed,
    /// A body that keeps its velocity.
    pub constant_velocity: ConstantVelocity,
}

/// Figures of the model that knows nothing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KnowsNothing {
    /// See [`ControlMetrics::prediction_rms`].
    pub prediction_rms: Option<PredictionError>,
    /// See [`ControlMetrics::torque_r2`].
    pub torque_r2: ByContact,
    /// See [`ControlMetrics::torque_rms_nm`].
    pub torque_rms_nm: Option<f64>,
    /// See [`ControlMetrics::recovery_rms_m`].
    pub recovery_rms_m: Option<f64>,
}

/// Figures of a baseline that only differs after pushes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pushed {
    /// See [`ControlMetrics::recovery_rms_m`].
    pub recovery_rms_m: Option<f64>,
}

/// Figures of a baseline that only predicts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConstantVelocity {
    /// See [`ControlMetrics::prediction_rms`].
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
    let mut controller = Controller::new(model, settings)?;
    let mut blind_controller = Controller::new(&blind, settings)?;
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
        baseline: Baselines {
            knows_nothing: KnowsNothing {
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

/// Why the model has failed: its predictions or its feedback are no better than those of a baseline.
fn failure(metrics: &ControlMetrics) -> Option<String> {
    let baseline = &metrics.baseline;
    let constant = &baseline.constant_velocity.prediction_rms;
    let blind = &baseline.knows_nothing.prediction_rms;
    let mut reasons = Vec::new();
    for (name, other) in [
        ("a constant velocity", constant),
        ("a model that knows nothing", blind),
    ] {
        if let (Some(own), Some(other)) = (&metrics.prediction_rms, other) {
            let share = own.share_of(other);
            if share.is_nan() || share > NO_BETTER {
                reasons.push(format!(
                    "it predicts one stage ahead with {share:.2} of the error of {name}"
                ));
            }
        }
    }
    if let (Some(own), Some(off)) = (metrics.recovery_rms_m, baseline.feedback_off.recovery_rms_m)
        && own > NO_BETTER * off
    {
        reasons.push(format!(
            "after a push its feedback leaves {:.1} mm, no feedback {:.1} mm",
            1e3 * own,
            1e3 * off
        ));
    }
    (!reasons.is_empty()).then(|| format!("the model has failed: {}", reasons.join("; ")))
}
