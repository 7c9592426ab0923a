//! A model that knows nothing: the same maps, and latent inputs that accelerate their own coordinate.

use nalgebra::{DMatrix, DVector};

use super::error::EvaluateError;
use super::prediction::RecordedStage;
use crate::model::{Library, Phase, ReducedModel};

/// A copy of a model with `ddz = g u_lat` for dynamics.
///
/// Encoder, decoder, robot and input statistics stay. The one number `g` of each phase is the least-squares fit to these
/// very stages, so that the copy has the right scale and nothing else: no gravity, no coupling of coordinates, no
/// effect of the state. How far its accelerations are off is its own.
///
/// # Errors
/// [`EvaluateError::Model`] if the copy is not a model.
pub(super) fn uninformed(
    model: &ReducedModel,
    stages: &[RecordedStage],
) -> Result<ReducedModel, EvaluateError> {
    let d = model.latent_dim();
    let terms: Vec<String> = (1..=d).map(|latent| format!("u{latent}")).collect();
    let library = Library::from_terms(d, &terms).expect("invariant: inputs are terms");
    let mut phases = Vec::with_capacity(model.phases().len());
    let mut statistics = Vec::new();
    for (index, phase) in model.phases().iter().enumerate() {
        let samples: Vec<(DVector<f64>, &DVector<f64>)> = stages
            .iter()
            .filter(|stage| stage.phase == index)
            .map(|stage| {
                let ddz = (&stage.end.1 - &stage.start.1) / stage.duration_s;
                (ddz, &stage.input)
            })
            .collect();
        let product: f64 = samples.iter().map(|(ddz, input)| ddz.dot(input)).sum();
        let square: f64 = samples.iter().map(|(_, input)| input.norm_squared()).sum();
        let gain = if square > 0.0 { product / square } else { 0.0 };
        phases.push(Phase {
            xi: DMatrix::identity(d, d) * gain,
            ..phase.clone()
        });
        let mut own = model.input_statistics(index)?.clone();
        if let (Some(given), false) = (&mut own.given_state, samples.is_empty()) {
            given.acceleration_error = error_covariance(&samples, gain);
        }
        statistics.push((phase.name.clone(), own));
    }
    let builder = model.clone().into_builder().library(library);
    Ok(builder
        .phases(phases)
        .all_input_statistics(statistics)
        .build()?)
}

/// Covariance of `ddz - g u_lat` about zero.
fn error_covariance(samples: &[(DVector<f64>, &DVector<f64>)], gain: f64) -> DMatrix<f64> {
    let d = samples[0].0.len();
    let share = 1.0 / samples.len() as f64;
    samples
        .iter()
        .fold(DMatrix::zeros(d, d), |sum, (ddz, input)| {
            let left = ddz - *input * gain;
            sum + &left * left.transpose() * share
        })
}
