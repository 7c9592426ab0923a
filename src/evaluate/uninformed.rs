//! A model that knows nothing: the same maps, and latent inputs that accelerate their own coordinate.

use nalgebra::DMatrix;

use super::error::EvaluateError;
use super::prediction::RecordedStage;
use crate::model::{Library, Phase, ReducedModel};

/// A copy of a model with `ddz = g u_lat` for dynamics.
///
/// Encoder, decoder, robot and input statistics stay. The one number `g` of each phase is the least-squares fit to these
/// very stages, so that the copy has the right scale and nothing else: no gravity, no coupling of coordinates, no
/// effect of the state.
///
/// # Errors
/// [`EvaluateError::Model`] if the copy is not a model.
pub(super) fn uninformed(
    model: &ReducedModel,
    stages: &[RecordedStage],
) -> Result<ReducedModel, EvaluateError> {
    let d = model.latent_dim();
    let terms: Vec<String> = (1..=d).map(|latent| format!("u{latent}")).collect();
    let phases: Vec<Phase> = (model.phases().iter().enumerate())
        .map(|(index, phase)| {
            let (mut product, mut square) = (0.0, 0.0);
            for stage in stages.iter().filter(|stage| stage.phase == index) {
                let ddz = (&stage.end.1 - &stage.start.1) / stage.duration_s;
                product += ddz.dot(&stage.input);
                square += stage.input.norm_squared();
            }
            let gain = if square > 0.0 { product / square } else { 0.0 };
            Phase {
                xi: DMatrix::identity(d, d) * gain,
                ..phase.clone()
            }
        })
        .collect();
    let library = Library::from_terms(d, &terms).expect("invariant: inputs are terms");
    let builder = model.clone().into_builder();
    Ok(builder.library(library).phases(phases).build()?)
}
