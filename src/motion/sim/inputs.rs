//! What the recorded inputs look like in each phase of a model.

use nalgebra::{DMatrix, DVector};

use super::error::SimError;
use super::latent::phases;
use crate::model::{InputStatistics, ReducedModel};
use crate::recording::Segment;

/// The model with mean and covariance of the recorded inputs `u = [tau; F; M]` (SI, by the model's rule) in the phases
/// that the recordings have samples of.
///
/// # Errors
/// [`SimError::Model`] for a model without robot, [`SimError::Recording`] if the body wrench cannot
/// be computed, and if no feet of a segment are in a phase of the model.
pub fn with_input_statistics(
    model: ReducedModel,
    segments: &[&Segment],
) -> Result<ReducedModel, SimError> {
    let rule = model.input_rule()?;
    let names = model.phases().iter().map(|phase| phase.name.clone());
    let mut of_phases: Vec<(String, Vec<DVector<f64>>)> =
        names.map(|name| (name, Vec::new())).collect();
    for segment in segments {
        let input = segment.input(&rule)?;
        for (sample, phase) in phases(&model, segment)?.into_iter().enumerate() {
            of_phases[phase].1.push(input.column(sample).into_owned());
        }
    }
    let mut builder = model.into_builder();
    for (name, samples) in of_phases {
        if let Some(first) = samples.first() {
            let block = || std::iter::once(DMatrix::from_columns(&samples));
            let statistics = InputStatistics::of_blocks(first.len(), samples.len(), block);
            builder = builder.input_statistics(name, statistics);
        }
    }
    Ok(builder.build()?)
}
