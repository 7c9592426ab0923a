//! The phases' linearisations at their mean point: stability and gain of the inputs.

use nalgebra::{Complex, DMatrix, Schur};

use crate::lower::CompiledModel;
use crate::sim::LatentSegment;

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
