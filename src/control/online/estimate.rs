//! The input of a reference that comes without one, estimated from its accelerations.
//!
//! In each phase the model is `ddz = f(z, dz, u) + r`. Around an expected input `m`, with `B = ∂f/∂u` there, the
//! residual of the reference's own acceleration is
//!
//! ```text
//! y = ddz − f(z, dz, m) = B (u − m) + r,   u − m ~ (0, S),   r ~ (0, R)
//! ```
//!
//! and the best linear estimate of the input is
//!
//! ```text
//! û = m + S Bᵀ (B S Bᵀ + R)⁻¹ y.
//! ```
//!
//! [`InputGivenState`] has `m = M [1; z; dz]`, `S` and `R` of the training. In a phase without it, `m` and `S` are mean
//! and covariance of the training inputs. `R` is then the covariance of `y` over the reference minus `B S Bᵀ`, because
//! input and residual of a least-squares model are uncorrelated. Latent coordinates whose acceleration the model hardly
//! explains then hardly count.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::control_model::{ControlModel, ControlPhase};
use super::dense::{
    MOST_LATENT, MOST_SQUARE, Real, add_scaled, factorise, solve_lower, solve_upper,
};
use super::linearise::LatentDynamics;
use super::trajectory::Trajectory;

/// Smallest eigenvalue of the residual's covariance in units of the deviations of `y`.
const RESIDUAL_FLOOR: f64 = 0.03;

/// The latent input of one phase given the latent state, and how far the model's accelerations are off.
#[derive(Debug, Clone)]
pub struct InputGivenState {
    /// `M`, `latent_dim × (1 + 2 latent_dim)`.
    pub mean: DMatrix<f64>,
    /// `S`, `latent_dim` square.
    pub covariance: DMatrix<f64>,
    /// `R`, `latent_dim` square.
    pub acceleration_error: DMatrix<f64>,
}

struct Evidence {
    sample: usize,
    /// `y`.
    unexplained: Vec<f64>,
    /// `B`, row by row.
    gain: Vec<f64>,
}

/// Latent inputs, `latent_dim` a sample.
pub(super) fn estimate_input(
    plant: &ControlModel,
    dynamics: &mut dyn LatentDynamics,
    motion: &impl Trajectory,
) -> Vec<f64> {
    let d = plant.latent_dim();
    let mut input = vec![0.0; motion.count() * d];
    let mut evidence: Vec<Vec<Evidence>> = plant.phases().iter().map(|_| Vec::new()).collect();
    let known = |phase: &ControlPhase| phase.given_state.as_ref().map(|g| g.mean.transpose());
    let given: Vec<_> = plant.phases().iter().map(known).collect();
    let (mut ddz, mut entries) = (vec![0.0; d], vec![0.0; 3 * d * d]);
    let mut state = vec![0.0; 2 * d];
    for (sample, mean) in input.chunks_exact_mut(d).enumerate() {
        let phase = motion.phase(sample);
        motion.write_state(sample, &mut state);
        match &given[phase] {
            Some(given) => write_expected(given.as_slice(), &state, d, mean),
            None => mean.copy_from_slice(plant.phases()[phase].latent_mean.as_slice()),
        }
        let (z, dz) = state.split_at(d);
        let count = dynamics.accelerate(phase, z, dz, mean, &mut ddz, &mut entries);
        let (mut unexplained, mut gain) = (vec![0.0; d], vec![0.0; d * d]);
        dynamics.write_gain(phase, count, &entries, d, &mut gain);
        motion.write_acceleration(sample, &mut unexplained);
        add_scaled(-1.0, &ddz, d, &mut unexplained);
        evidence[phase].push(Evidence {
            sample,
            unexplained,
            gain,
        });
    }
    for (phase, evidence) in plant.phases().iter().zip(evidence) {
        add_estimates(phase, evidence, &mut input);
    }
    input
}

/// `S` and `R` of a phase; none if there are too few samples.
fn covariances(
    phase: &ControlPhase,
    evidence: &[Evidence],
) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    if let Some(given) = &phase.given_state {
        return Some((given.covariance.clone(), given.acceleration_error.clone()));
    }
    // A covariance of fewer samples than this does not determine the residual.
    if evidence.len() < 4 * phase.latent_mean.len() {
        return None;
    }
    let covariance = &phase.latent_root * phase.latent_root.transpose();
    let residual = residual_covariance(evidence, &covariance)?;
    Some((covariance, residual))
}

/// Adds `S Bᵀ (B S Bᵀ + R)⁻¹ y` to the inputs of one phase's samples.
fn add_estimates(phase: &ControlPhase, evidence: Vec<Evidence>, input: &mut [f64]) {
    let d = phase.latent_mean.len();
    let Some((covariance, residual)) = covariances(phase, &evidence) else {
        return;
    };
    let rows = [covariance, residual].map(|matrix| matrix.transpose());
    let [covariance, residual] = rows.each_ref().map(|matrix| matrix.as_slice());
    for mut item in evidence {
        let (left, input) = (&mut item.unexplained, &mut input[item.sample * d..]);
        add_correction(&item.gain, covariance, residual, d, left, input);
    }
}

/// Writes `m = M [1; z; dz]`.
fn write_expected(given: &[Real], state: &[Real], d: usize, input: &mut [Real]) {
    for i in 0..d {
        let row = &given[i * (1 + 2 * d)..];
        input[i] = row[0];
        for k in 0..2 * d {
            input[i] += row[1 + k] * state[k];
        }
    }
}

/// Adds `S Bᵀ (B S Bᵀ + R)⁻¹ y` to an input, unless the sum in brackets is not positive definite. Matrices are
/// row-major; `y` is overwritten.
fn add_correction(
    gain: &[Real],
    covariance: &[Real],
    residual: &[Real],
    d: usize,
    unexplained: &mut [Real],
    input: &mut [Real],
) {
    let mut spread: [Real; MOST_SQUARE] = [0.0; MOST_SQUARE];
    let mut square: [Real; MOST_SQUARE] = [0.0; MOST_SQUARE];
    let mut estimate: [Real; MOST_LATENT] = [0.0; MOST_LATENT];
    for i in 0..d {
        for j in 0..d {
            for k in 0..d {
                spread[i * d + j] += gain[i * d + k] * covariance[k * d + j];
            }
        }
        for j in 0..=i {
            square[i * d + j] = residual[i * d + j];
            for k in 0..d {
                square[i * d + j] += spread[i * d + k] * gain[j * d + k];
            }
        }
    }
    if !factorise(&mut square, d) {
        return;
    }
    solve_lower(&square, d, unexplained);
    solve_upper(&square, d, unexplained);
    let mut is_finite = true;
    for j in 0..d {
        for i in 0..d {
            estimate[j] += spread[i * d + j] * unexplained[i];
        }
        is_finite = is_finite && estimate[j].is_finite();
    }
    if is_finite {
        add_scaled(1.0, &estimate, d, input);
    }
}

/// `R = Cov(y) − mean(B S Bᵀ)`, made positive definite; none if `y` is not finite.
fn residual_covariance(evidence: &[Evidence], input: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let d = input.nrows();
    let count = evidence.len() as f64;
    let unexplained = |item: &Evidence| DVector::from_column_slice(&item.unexplained);
    let mean = evidence.iter().map(unexplained).sum::<DVector<f64>>() / count;
    let mut covariance = DMatrix::zeros(d, d);
    let mut explained = DMatrix::zeros(d, d);
    for item in evidence {
        let gain = &DMatrix::from_row_slice(d, d, &item.gain);
        let off = unexplained(item) - &mean;
        covariance += &off * off.transpose() / count;
        explained += gain * input * gain.transpose() / count;
    }
    // A latent that is explained exactly has no deviation of its own: any positive scale will do.
    let variance = |i| f64::max(covariance[(i, i)], explained[(i, i)]);
    let deviation = DVector::from_fn(d, |i, _| variance(i).sqrt().max(f64::MIN_POSITIVE));
    let scale = &deviation * deviation.transpose();
    let relative = (covariance - explained).component_div(&scale);
    if relative.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let mut eigen = SymmetricEigen::new(relative);
    (eigen.eigenvalues).apply(|value| *value = value.max(RESIDUAL_FLOOR));
    let floored = eigen.recompose();
    Some(DMatrix::from_fn(d, d, |row, col| {
        floored[(row, col)] * deviation[row] * deviation[col]
    }))
}
