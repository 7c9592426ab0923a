//! A recorded segment as the model sees it: latent states, latent inputs, phases.

use nalgebra::{DMatrix, DVector};

use crate::model::{InputStatistics, ModelError, ReducedModel};
use crate::recording::phases::{CHATTER_SAMPLES, PhasePattern};
use crate::recording::segment::between;
use crate::recording::{PhaseRule, RecordingError, Segment};

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// The model lacks a part, or a shape does not fit.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The recording cannot be turned into inputs.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

/// Latent samples of one recorded segment; every matrix is `latent_dim x n`, a column a sample.
///
/// The equations are those of a linear model; a nonlinear encoder's Jacobian at the sample's `x` takes the place of
/// `W_e`, and accelerations have the term `dJ/dt dx`.
#[derive(Debug, Clone, PartialEq)]
pub struct LatentSegment {
    pub time_s: Vec<f64>,
    /// Latent positions `z = W_e (s_x x) + b_e` (equation 9).
    pub z: DMatrix<f64>,
    /// Latent velocities `dz = W_e (s_x dx)` (equation 11).
    pub dz: DMatrix<f64>,
    /// Latent accelerations `ddz = W_e (s_x ddx)` (equation 12).
    pub ddz: DMatrix<f64>,
    /// Latent inputs `u_lat = pinv(W_e^T) (s_u u)` (equation 13).
    pub u_lat: DMatrix<f64>,
    /// Index of the phase of every sample, by spans of the recorded feet.
    pub phase: Vec<usize>,
}

impl LatentSegment {
    /// Encodes a segment.
    pub fn encode(model: &ReducedModel, segment: &Segment) -> Result<Self, SimError> {
        let input = segment.input(&model.input_rule()?)?;
        let samples = |map: &dyn Fn(usize) -> Result<DVector<f64>, SimError>| {
            let mut out = DMatrix::zeros(model.latent_dim(), segment.x.ncols());
            for (sample, mut to) in out.column_iter_mut().enumerate() {
                to.copy_from(&map(sample)?);
            }
            Ok::<_, SimError>(out)
        };
        let x = |k| segment.x.column(k).into_owned();
        let dx = |k| segment.dx.column(k).into_owned();
        let ddx = |k| segment.ddx.column(k).into_owned();
        let u = |k| input.column(k).into_owned();
        Ok(Self {
            time_s: segment.time_s.clone(),
            z: samples(&|k| Ok(model.encode(&x(k))?))?,
            dz: samples(&|k| Ok(model.encoder_jacobian(&x(k))? * dx(k)))?,
            ddz: samples(&|k| Ok(model.encode_acceleration(&x(k), &dx(k), &ddx(k))?))?,
            u_lat: samples(&|k| Ok(model.tangent(&x(k))?.project * u(k)))?,
            phase: phases(model, segment)?,
        })
    }

    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// Latent input at a time between samples, interpolated linearly; held outside the record.
    pub fn input_at(&self, time_s: f64, u_lat: &mut [f64]) {
        let (left, right, share) = between(&self.time_s, time_s);
        for (row, value) in u_lat.iter_mut().enumerate() {
            let (from, to) = (self.u_lat[(row, left)], self.u_lat[(row, right)]);
            *value = from + share * (to - from);
        }
    }
}

/// The phase of each sample by the spans of the model's phases ([`PhaseRule::spans`]): samples in transition, and
/// contact chatter, belong to a neighbouring span, as in training.
fn phases(model: &ReducedModel, segment: &Segment) -> Result<Vec<usize>, SimError> {
    let mut phases = vec![0; segment.len()];
    for span in phase_rule(model).spans(segment)? {
        phases[span.range].fill(span.phase);
    }
    Ok(phases)
}

/// The rule by which training and evaluation assign samples to the phases of a model.
pub(crate) fn phase_rule(model: &ReducedModel) -> PhaseRule {
    let patterns = model.phases().iter().map(|phase| PhasePattern {
        name: phase.name.clone(),
        feet: phase.feet.clone(),
    });
    PhaseRule::new(patterns.collect()).with_min_samples(CHATTER_SAMPLES)
}

/// The model with mean and covariance of the recorded inputs `u = [tau; F; M]` (SI, by the model's rule) in the phases
/// that the recordings have samples of.
pub fn with_input_statistics(
    model: ReducedModel,
    segments: &[&Segment],
) -> Result<ReducedModel, SimError> {
    let rule = model.input_rule()?;
    let mut of_phases = vec![Vec::new(); model.phases().len()];
    for segment in segments {
        let input = segment.input(&rule)?;
        for (sample, phase) in phases(&model, segment)?.into_iter().enumerate() {
            of_phases[phase].push(input.column(sample).into_owned());
        }
    }
    let mut builder = model.clone().into_builder();
    for (phase, samples) in model.phases().iter().zip(of_phases) {
        if !samples.is_empty() {
            let statistics = InputStatistics::of_samples(&DMatrix::from_columns(&samples));
            builder = builder.input_statistics(&phase.name, statistics);
        }
    }
    Ok(builder.build()?)
}
