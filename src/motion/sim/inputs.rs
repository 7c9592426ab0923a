//! What the recorded inputs look like in each phase of a model.

use nalgebra::{DMatrix, DVector};

use super::error::SimError;
use super::latent::phases;
use crate::model::{InputStatistics, ReducedModel};
use crate::recording::Segment;

/// The model with the input statistics of recordings in the phases that they have samples of.
///
/// # Errors
/// As [`input_statistics`].
pub fn with_input_statistics(
    model: ReducedModel,
    segments: &[&Segment],
) -> Result<ReducedModel, SimError> {
    let statistics = input_statistics(&model, segments)?;
    let names: Vec<String> = model.phases().iter().map(|p| p.name.clone()).collect();
    let mut builder = model.into_builder();
    for (name, statistics) in names.into_iter().zip(statistics) {
        if let Some(statistics) = statistics {
            builder = builder.input_statistics(name, statistics);
        }
    }
    Ok(builder.build()?)
}

/// Mean and covariance of the recorded inputs `u = [tau; F; M]` (SI, by the model's rule) in each phase of a model; phases
/// without a sample have none.
///
/// # Errors
/// [`SimError::Model`] for a model without robot, [`SimError::Recording`] if the body wrench cannot
/// be computed, and if no feet of a segment are in a phase of the model.
pub fn input_statistics(
    model: &ReducedModel,
    segments: &[&Segment],
) -> Result<Vec<Option<InputStatistics>>, SimError> {
    let rule = model.input_rule()?;
    let mut of_phases = vec![Vec::new(); model.phases().len()];
    for segment in segments {
        let input = segment.input(&rule)?;
        for (sample, phase) in phases(model, segment)?.into_iter().enumerate() {
            of_phases[phase].push(input.column(sample).into_owned());
        }
    }
    let statistics = of_phases.iter().map(|samples: &Vec<DVector<f64>>| {
        let (first, n) = (samples.first()?, samples.len());
        let block = || std::iter::once(DMatrix::from_columns(samples));
        Some(InputStatistics::of_blocks(first.len(), n, block))
    });
    Ok(statistics.collect())
}
