//! Signs that a model and recordings do not belong together.

use super::coordinates::PointwiseSums;
use super::error::EvaluateError;
use super::metrics::FitSums;
use crate::model::ReducedModel;
use crate::recording::Recording;
use crate::recording::mismatch::notes;
use crate::sim::LatentSegment;

/// What speaks against using a model on these recordings: recordings that cannot be of its robot
/// ([`notes`]), and accelerations that it does not explain at all.
///
/// # Errors
/// [`EvaluateError::Model`] for a latent-only model, [`EvaluateError::Sim`] for samples that cannot be encoded.
pub fn remarks(
    model: &ReducedModel,
    recordings: &[Recording],
) -> Result<Vec<String>, EvaluateError> {
    let robot = model.robot()?;
    let mut pointwise = PointwiseSums::new(model);
    let segments = recordings.iter().flat_map(|recording| &recording.segments);
    for segment in segments {
        let latent = LatentSegment::encode(model, segment)?;
        pointwise.add(model, segment, &latent)?;
    }
    let of_recordings = recordings
        .iter()
        .flat_map(|recording| notes(recording, robot));
    Ok(of_recordings
        .chain(unexplained(model, &pointwise))
        .collect())
}

/// By how much `R^2` of a phase's accelerations may be below that of the training. Single jumps of another controller of
/// the same robot are up to 1.1 below.
const BELOW_TRAINING: f64 = 1.5;

/// Phases whose accelerations the mean would explain better, and clearly worse than those of the training are explained.
/// Flight is left out: accelerations hardly vary there, and any model is as far off as their mean.
fn unexplained(model: &ReducedModel, pointwise: &PointwiseSums) -> Vec<String> {
    let accelerations = pointwise.acceleration.iter().map(FitSums::r2);
    let phases = model.phases().iter().zip(accelerations).enumerate();
    let unlike = phases.filter_map(|(index, (phase, r2))| {
        let bound = training_r2(model, index).map_or(0.0, |r2| (r2 - BELOW_TRAINING).min(0.0));
        let r2 = r2?;
        (!phase.feet.matches([false; 4]) && r2 < bound).then(|| {
            format!(
                "in {} the model's latent accelerations have a larger error than their mean (R^2 {r2:.2}). Either its \
                 coefficients are wrong, or the recordings are of another robot, signs, axes or kind of motion than \
                 those of the training. Do not rely on predictions or torques there",
                phase.name
            )
        })
    });
    unlike.collect()
}

/// `R^2` of a phase's accelerations over the training, if the model file says it. Refinement by rollouts may have traded
/// it for predictions.
fn training_r2(model: &ReducedModel, phase: usize) -> Option<f64> {
    let training = model.provenance().get("report")?.get("training")?;
    training.get("ddz_r2")?.get(phase)?.as_f64()
}
