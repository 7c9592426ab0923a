//! Predictions one stage ahead: the recorded state and input in, where the robot is one control step later out; and the
//! no-dynamics baseline: the same maps, and latent inputs that accelerate their own coordinate.
//!
//! The phases' linearisations at their mean point: stability and gain of the inputs.

use nalgebra::{Complex, DMatrix, DVector, Schur};
use serde::Serialize;

use super::assessment::EvaluateError;
use crate::lower::CompiledModel;
use crate::model::{Library, Phase, ReducedModel};
use crate::recording::Recording;
use crate::robot::{BODY_Z, JOINT_DIM};
use crate::sim::LatentSegment;

/// Root mean squares of predicted minus recorded positions one stage ahead, in the robot's coordinates. What the
/// decoder alone loses does not count: both are decoded from latent positions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictionError {
    #[serde(rename = "body.x")]
    pub body_x_m: f64,
    #[serde(rename = "body.z")]
    pub body_z_m: f64,
    #[serde(rename = "body.pitch")]
    pub pitch_rad: f64,
    #[serde(rename = "joints")]
    pub joints_rad: f64,
    pub latent: Vec<f64>,
}

impl PredictionError {
    /// The mean over the latent positions of this error as a share of another's: below 1 if this one predicts better.
    ///
    /// These are what the dynamics predict. The robot's coordinates are made of them by the decoder: one for which no
    /// latent coordinate stands, such as pitch in a model of legs, can be off by much where it hardly moves.
    pub(super) fn share_of(&self, other: &Self) -> f64 {
        let shares = self.latent.iter().zip(&other.latent);
        shares.map(|(own, other)| own / other).sum::<f64>() / self.latent.len() as f64
    }
}

#[derive(Debug, Clone)]
pub(super) struct RecordedStage {
    pub phase: usize,
    pub duration_s: f64,
    /// `(z, dz)` at the beginning and at the end.
    pub start: (DVector<f64>, DVector<f64>),
    pub end: (DVector<f64>, DVector<f64>),
    pub input: DVector<f64>,
}

/// The stages of a recording that lie within one phase, one after the other.
pub(super) fn recorded_stages(
    model: &ReducedModel,
    recording: &Recording,
    step_s: f64,
) -> Result<Vec<RecordedStage>, EvaluateError> {
    let mut stages = Vec::new();
    for segment in &recording.segments {
        let latent = LatentSegment::encode(model, segment)?;
        let at = |sample: usize| {
            let column = |rows: &DMatrix<f64>| rows.column(sample).into_owned();
            (column(&latent.z), column(&latent.dz))
        };
        let samples = super::along_recording::control_samples(&latent.time_s, step_s);
        for pair in samples.windows(2) {
            let (first, last) = (pair[0], pair[1]);
            let phase = latent.phase[first];
            if latent.phase[first..=last]
                .iter()
                .any(|other| *other != phase)
            {
                continue;
            }
            let held = latent.u_lat.columns(first, last - first);
            stages.push(RecordedStage {
                phase,
                duration_s: latent.time_s[last] - latent.time_s[first],
                start: at(first),
                end: at(last),
                input: held.column_mean(),
            });
        }
    }
    Ok(stages)
}

/// The error of predictions over all stages, decoded by `maps`; none without stages. A stage's end is predicted from
/// its beginning by a model's dynamics with the input held at its mean, or, without a model, by a constant velocity.
pub(super) fn prediction_error(
    maps: &ReducedModel,
    dynamics: Option<&ReducedModel>,
    stages: &[RecordedStage],
) -> Result<Option<PredictionError>, EvaluateError> {
    let mut compiled = dynamics.map(CompiledModel::new).transpose()?;
    let mut squares = DVector::zeros(maps.decoder_map()?.output_dim());
    let mut latent = DVector::zeros(maps.latent_dim());
    for stage in stages {
        let (mut z, mut dz) = stage.start.clone();
        match &mut compiled {
            None => z += &dz * stage.duration_s,
            Some(compiled) => compiled.rk4_step(
                stage.phase,
                z.as_mut_slice(),
                dz.as_mut_slice(),
                stage.input.as_slice(),
                stage.duration_s,
            ),
        }
        let error = maps.decode(&z)? - maps.decode(&stage.end.0)?;
        squares += error.component_mul(&error);
        let error = z - &stage.end.0;
        latent += error.component_mul(&error);
    }
    let count = stages.len() as f64;
    let rms = |first: usize, rows: usize| {
        (squares.rows(first, rows).sum() / (count * rows as f64)).sqrt()
    };
    Ok((!stages.is_empty()).then(|| PredictionError {
        body_x_m: rms(JOINT_DIM, 1),
        body_z_m: rms(BODY_Z, 1),
        pitch_rad: rms(JOINT_DIM + 4, 1),
        joints_rad: rms(0, JOINT_DIM),
        latent: latent.iter().map(|sum| (sum / count).sqrt()).collect(),
    }))
}

/// A copy of a model with `ddz = g u_lat` for dynamics.
///
/// Encoder, decoder, robot and input statistics stay. The one number `g` of each phase is the least-squares fit to
/// these very stages, so that the copy has the right scale and nothing else: no gravity, no coupling of coordinates, no
/// effect of the state. How far its accelerations are off is its own.
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

/// Share of the largest singular value below which a direction of the input counts as without effect.
const RANK_THRESHOLD: f64 = 0.01;

/// One phase, linearised at the mean of the recorded `(z, dz, u_lat)` of that phase.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearisedPhase {
    pub samples: usize,
    /// Eigenvalues of `A = [0 I; d ddz/dz  d ddz/d dz]`, in 1/s, by falling real part.
    pub eigenvalues: Vec<Complex<f64>>,
    /// Singular values of the input gain `B = d ddz / d u_lat`, falling.
    pub input_singular_values: Vec<f64>,
}

impl LinearisedPhase {
    /// Largest real part of the eigenvalues, in 1/s: small deviations grow as `exp(a t)`.
    pub fn growth_rate(&self) -> Option<f64> {
        self.eigenvalues.first().map(|value| value.re)
    }

    /// Ratio of the largest and the smallest singular value of the input gain; none where the smallest is 0.
    pub fn input_condition(&self) -> Option<f64> {
        let largest = self.input_singular_values.first()?;
        let smallest = self.input_singular_values.last()?;
        (*smallest > 0.0).then(|| largest / smallest)
    }

    /// Number of singular values of the input gain above 1 % of the largest.
    pub fn input_effective_rank(&self) -> usize {
        let largest = self.input_singular_values.first().copied().unwrap_or(0.0);
        let counts = |value: &&f64| **value > 0.0 && **value >= RANK_THRESHOLD * largest;
        self.input_singular_values.iter().filter(counts).count()
    }
}

/// Each phase of a model, linearised at its mean over the recorded samples; none for a phase that no sample is in, or
/// whose Jacobian there is not finite.
pub fn linearise_phases(
    model: &CompiledModel,
    segments: &[&LatentSegment],
) -> Vec<Option<LinearisedPhase>> {
    let mut model = model.clone();
    (0..model.n_phases())
        .map(|phase| linearise_phase(&mut model, segments, phase))
        .collect()
}

fn linearise_phase(
    model: &mut CompiledModel,
    segments: &[&LatentSegment],
    phase: usize,
) -> Option<LinearisedPhase> {
    let d = model.latent_dim();
    let (mut mean, mut samples) = (vec![0.0; 3 * d], 0);
    for segment in segments {
        for sample in (0..segment.len()).filter(|&k| segment.phase[k] == phase) {
            let values = [&segment.z, &segment.dz, &segment.u_lat];
            for (index, total) in mean.iter_mut().enumerate() {
                *total += values[index / d][(index % d, sample)];
            }
            samples += 1;
        }
    }
    if samples == 0 {
        return None;
    }
    mean.iter_mut().for_each(|total| *total /= samples as f64);
    let (mut ddz, mut jacobian) = (vec![0.0; d], DMatrix::zeros(d, 3 * d));
    let (z, rest) = mean.split_at(d);
    let (dz, u_lat) = rest.split_at(d);
    model.jacobian(phase, z, dz, u_lat, &mut ddz, &mut jacobian);
    if jacobian.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let mut eigenvalues = eigenvalues(state_matrix(&jacobian.columns(0, 2 * d).into_owned()))?;
    eigenvalues.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
    let gain = jacobian.columns(2 * d, d).into_owned();
    let mut input_singular_values: Vec<f64> = gain.singular_values().iter().copied().collect();
    input_singular_values.sort_by(|a, b| b.total_cmp(a));
    Some(LinearisedPhase {
        samples,
        eigenvalues,
        input_singular_values,
    })
}

/// `[0 I; J]`, the matrix of the state `(z, dz)` whose `ddz` has the Jacobian `J` (`d x 2d`).
pub(crate) fn state_matrix(jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    let d = jacobian.nrows();
    let mut state = DMatrix::zeros(2 * d, 2 * d);
    state.view_mut((0, d), (d, d)).fill_with_identity();
    state.rows_mut(d, d).copy_from(jacobian);
    state
}

/// Eigenvalues of a square matrix; none if one of its entries is not finite, or if they cannot be computed.
///
/// Entries of very different size, such as stiff joints beside ones, can keep the iteration from converging: entries
/// below ever larger shares of their neighbours count as 0 until it does.
pub fn eigenvalues(matrix: DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    if matrix.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let size = matrix.amax();
    if size == 0.0 {
        return Some(vec![Complex::default(); matrix.nrows()]);
    }
    let matrix = matrix / size;
    let iterations = 100 * matrix.nrows().max(1);
    let schur = [f64::EPSILON, 1e-14, 1e-12, 1e-10]
        .iter()
        .find_map(|share| Schur::try_new(matrix.clone(), *share, iterations))?;
    let values = schur.complex_eigenvalues();
    Some(values.iter().map(|value| value * size).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::shipped_model;

    #[test]
    fn pitch_without_a_latent_coordinate_does_not_make_right_predictions_fail() {
        let model = shipped_model("go1-d6");
        let jump = crate::evaluate::shipped("go1-other/jump_04");
        let stages = recorded_stages(&model, &jump, 0.01).expect("of its robot");
        let error = |dynamics| {
            let error = prediction_error(&model, dynamics, &stages);
            error.expect("complete").expect("stages")
        };
        let own = error(Some(&model));
        let constant = error(None);
        assert!(own.pitch_rad > 2.0 * constant.pitch_rad, "{own:?}");
        assert_eq!(own.latent.len(), 6);
        let share = own.share_of(&constant);
        assert!(share < 0.7, "{share}: {own:?} {constant:?}");
    }
}
