//! Predictions one stage ahead, their no-dynamics baseline, and the phases' linearisations at their mean point.

use super::*;

/// Root mean squares of predicted minus recorded positions one stage ahead, both decoded from latent positions.
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
    /// Mean over the latent positions of this error as a share of another's.
    pub(super) fn share_of(&self, other: &Self) -> f64 {
        let shares = self.latent.iter().zip(&other.latent);
        shares.map(|(own, other)| own / other).sum::<f64>() / self.latent.len() as f64
    }
}

pub(super) struct RecordedStage {
    pub phase: usize,
    pub duration_s: f64,
    pub start: (DVector<f64>, DVector<f64>), // z, dz
    pub end: (DVector<f64>, DVector<f64>),
    pub input: DVector<f64>,
}

pub(super) fn recorded_stages(
    model: &ReducedModel,
    recording: &Recording,
    step_s: f64,
) -> Result<Vec<RecordedStage>> {
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
            if (latent.phase[first..=last].iter()).any(|other| *other != phase) {
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

pub(super) fn prediction_error(
    maps: &ReducedModel,
    dynamics: Option<&ReducedModel>,
    stages: &[RecordedStage],
) -> Result<Option<PredictionError>> {
    let mut compiled = dynamics.map(CompiledModel::new).transpose()?;
    let mut squares = DVector::zeros(maps.decoder_map()?.output_dim());
    let mut latent = DVector::zeros(maps.latent_dim());
    for stage in stages {
        let (mut z, mut dz) = stage.start.clone();
        let (u_lat, step_s) = (stage.input.as_slice(), stage.duration_s);
        match &mut compiled {
            None => z += &dz * step_s,
            Some(compiled) => {
                let (z, dz) = (z.as_mut_slice(), dz.as_mut_slice());
                compiled.rk4_step(stage.phase, z, dz, u_lat, step_s);
            }
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

/// A copy of a model with `ddz = g u_lat`, `g` of each phase the least-squares fit to these stages.
pub(super) fn uninformed(model: &ReducedModel, stages: &[RecordedStage]) -> Result<ReducedModel> {
    let d = model.latent_dim();
    let terms: Vec<String> = (1..=d).map(|latent| format!("u{latent}")).collect();
    let library = Library::from_terms(d, &terms).expect("invariant: inputs are terms");
    let mut phases = Vec::with_capacity(model.phases().len());
    let mut statistics = Vec::new();
    for (index, phase) in model.phases().iter().enumerate() {
        let of_phase = stages.iter().filter(|stage| stage.phase == index);
        let rate = |stage: &RecordedStage| (&stage.end.1 - &stage.start.1) / stage.duration_s;
        let samples: Vec<_> = of_phase.map(|stage| (rate(stage), &stage.input)).collect();
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
    let builder = model.clone().into_builder().library(library).phases(phases);
    Ok(builder.all_input_statistics(statistics).build()?)
}

fn error_covariance(samples: &[(DVector<f64>, &DVector<f64>)], gain: f64) -> DMatrix<f64> {
    let d = samples[0].0.len();
    let share = 1.0 / samples.len() as f64;
    (samples.iter()).fold(DMatrix::zeros(d, d), |sum, (ddz, input)| {
        let left = ddz - *input * gain;
        sum + &left * left.transpose() * share
    })
}

/// Share of the largest singular value below which a direction of the input counts as without effect.
const RANK_THRESHOLD: f64 = 0.01;

#[derive(Debug, Clone, PartialEq)]
pub struct LinearisedPhase {
    pub samples: usize,
    /// `d ddz / d (z, dz)`, `d x 2d`.
    pub rates: DMatrix<f64>,
    /// Eigenvalues of `A = [0 I; d ddz/dz  d ddz/d dz]`, in 1/s, by falling real part.
    pub eigenvalues: Vec<Complex<f64>>,
    /// Singular values of the input gain `B = d ddz / d u_lat`, falling.
    pub input_singular_values: Vec<f64>,
}

impl LinearisedPhase {
    pub fn growth_rate(&self) -> Option<f64> {
        self.eigenvalues.first().map(|value| value.re)
    }

    /// Ratio of the largest and the smallest singular value of the input gain; none where the smallest is 0.
    pub fn input_condition(&self) -> Option<f64> {
        let largest = self.input_singular_values.first()?;
        let smallest = self.input_singular_values.last()?;
        (*smallest > 0.0).then(|| largest / smallest)
    }

    pub fn input_effective_rank(&self) -> usize {
        let largest = self.input_singular_values.first().copied().unwrap_or(0.0);
        let counts = |value: &&f64| **value > 0.0 && **value >= RANK_THRESHOLD * largest;
        self.input_singular_values.iter().filter(counts).count()
    }
}

/// Each phase, linearised at the mean of its samples; none without samples, or if its Jacobian is not finite.
pub(crate) fn linearise_phases(
    model: &CompiledModel,
    segments: &[&LatentSegment],
) -> Vec<Option<LinearisedPhase>> {
    let mut model = model.clone();
    ((0..model.n_phases()).map(|phase| linearise_phase(&mut model, segments, phase))).collect()
}

fn linearise_phase(
    model: &mut CompiledModel,
    segments: &[&LatentSegment],
    phase: usize,
) -> Option<LinearisedPhase> {
    let d = model.latent_dim();
    let (mut mean, mut samples) = (vec![0.0; 3 * d], 0);
    for segment in segments {
        for sample in (0..segment.time_s.len()).filter(|&k| segment.phase[k] == phase) {
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
    let rates = jacobian.columns(0, 2 * d).into_owned();
    let mut eigenvalues = eigenvalues(state_matrix(&rates))?;
    eigenvalues.sort_by(|a, b| b.re.total_cmp(&a.re).then(b.im.total_cmp(&a.im)));
    let gain = jacobian.columns(2 * d, d).into_owned();
    let mut input_singular_values: Vec<f64> = gain.singular_values().iter().copied().collect();
    input_singular_values.sort_by(|a, b| b.total_cmp(a));
    Some(LinearisedPhase {
        samples,
        rates,
        eigenvalues,
        input_singular_values,
    })
}

pub(crate) fn state_matrix(jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    let d = jacobian.nrows();
    let mut state = DMatrix::zeros(2 * d, 2 * d);
    state.view_mut((0, d), (d, d)).fill_with_identity();
    state.rows_mut(d, d).copy_from(jacobian);
    state
}

/// None if an entry is not finite. Small entries count as 0 where the iteration does not converge otherwise.
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
    let mut shares = [f64::EPSILON, 1e-14, 1e-12, 1e-10].into_iter();
    let schur = shares.find_map(|share| Schur::try_new(matrix.clone(), share, iterations))?;
    let values = schur.complex_eigenvalues();
    Some(values.iter().map(|value| value * size).collect())
}
