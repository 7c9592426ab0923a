//! The input of a reference that comes without one, estimated from its accelerations.
//!
//! In each phase the model reads `ddz = f(z, dz, u) + r`. Around an expected input `m`, with `B = ∂f/∂u`
//! there, the reference's own acceleration leaves
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
//! [`InputGivenState`] has `m = M [1; z; dz]`, `S` and `R` of the training. A phase without it has its mean
//! training input and the covariance of these inputs, and `R` is estimated from the reference: input
//! and residual of a least-squares model are uncorrelated, so `Cov(y) = B S Bᵀ + R`, and `R` is what
//! `B S Bᵀ` leaves of the sample covariance (in units of the standard deviations of `y`, eigenvalues
//! not below `RESIDUAL_FLOOR`). Latents whose acceleration the model hardly explains then hardly count.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::control_model::{ControlModel, ControlPhase};
use super::dense::{factorise, solve_lower, solve_upper};
use super::linearise::LatentDynamics;

/// Half width of the window in which velocities are fitted by a straight line, s.
pub const HALF_WINDOW_S: f64 = 0.016 + 1e-9;
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

#[derive(Debug, Clone, Copy)]
pub(super) struct Motion<'a> {
    /// Time of each sample, s.
    pub time_s: &'a [f64],
    /// `(z, dz)` a sample.
    pub state: &'a [f64],
    /// Phase of each sample.
    pub phase: &'a [usize],
}

struct Evidence {
    sample: usize,
    /// `y`.
    unexplained: DVector<f64>,
    /// `B`.
    gain: DMatrix<f64>,
}

/// Latent inputs, `latent_dim` a sample.
pub(super) fn estimate_input(
    plant: &ControlModel,
    dynamics: &mut dyn LatentDynamics,
    motion: &Motion<'_>,
) -> Vec<f64> {
    let d = plant.latent_dim();
    let mut input = vec![0.0; motion.time_s.len() * d];
    let mut evidence: Vec<Vec<Evidence>> = plant.phases().iter().map(|_| Vec::new()).collect();
    let (mut ddz, mut jacobian) = (vec![0.0; d], DMatrix::zeros(d, 3 * d));
    for (sample, &phase) in motion.phase.iter().enumerate() {
        let state = &motion.state[sample * 2 * d..(sample + 1) * 2 * d];
        let mean = expected_input(&plant.phases()[phase], state);
        input[sample * d..(sample + 1) * d].copy_from_slice(mean.as_slice());
        let (z, dz) = state.split_at(d);
        dynamics.jacobian(phase, z, dz, mean.as_slice(), &mut ddz, &mut jacobian);
        let acceleration = acceleration(motion, d, sample);
        evidence[phase].push(Evidence {
            sample,
            unexplained: acceleration - DVector::from_column_slice(&ddz),
            gain: jacobian.columns(2 * d, d).into_owned(),
        });
    }
    for (phase, evidence) in plant.phases().iter().zip(&evidence) {
        add_estimates(phase, evidence, &mut input);
    }
    input
}

/// `m` at a state `(z, dz)`.
fn expected_input(phase: &ControlPhase, state: &[f64]) -> DVector<f64> {
    match &phase.given_state {
        None => phase.latent_mean.clone(),
        Some(given) => DVector::from_fn(given.mean.nrows(), |row, _| {
            let mut sum = given.mean[(row, 0)];
            for (col, value) in state.iter().enumerate() {
                sum += given.mean[(row, 1 + col)] * value;
            }
            sum
        }),
    }
}

/// `S` and `R` of a phase; none if there are too few samples to tell.
fn covariances(
    phase: &ControlPhase,
    evidence: &[Evidence],
) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    if let Some(given) = &phase.given_state {
        return Some((given.covariance.clone(), given.acceleration_error.clone()));
    }
    // A covariance of fewer samples than this says nothing about the residual.
    if evidence.len() < 4 * phase.latent_mean.len() {
        return None;
    }
    let covariance = &phase.latent_root * phase.latent_root.transpose();
    let residual = residual_covariance(evidence, &covariance)?;
    Some((covariance, residual))
}

/// Adds `S Bᵀ (B S Bᵀ + R)⁻¹ y` to the inputs of one phase's samples.
fn add_estimates(phase: &ControlPhase, evidence: &[Evidence], input: &mut [f64]) {
    let d = phase.latent_mean.len();
    let Some((covariance, residual)) = covariances(phase, evidence) else {
        return;
    };
    for item in evidence {
        let found = correction(&item.gain, &covariance, &residual, &item.unexplained);
        let finite = |estimate: &Vec<f64>| estimate.iter().all(|value| value.is_finite());
        if let Some(estimate) = found.filter(finite) {
            for (input, estimate) in input[item.sample * d..].iter_mut().zip(&estimate) {
                *input += estimate;
            }
        }
    }
}

/// `S Bᵀ (B S Bᵀ + R)⁻¹ y`, or none if the sum in brackets is not positive definite. The order of operations is that of
/// the controller in C.
fn correction(
    gain: &DMatrix<f64>,
    covariance: &DMatrix<f64>,
    residual: &DMatrix<f64>,
    unexplained: &DVector<f64>,
) -> Option<Vec<f64>> {
    let d = unexplained.len();
    let mut spread = vec![0.0; d * d];
    let mut square = vec![0.0; d * d];
    for i in 0..d {
        for j in 0..d {
            for k in 0..d {
                spread[i * d + j] += gain[(i, k)] * covariance[(k, j)];
            }
        }
        for j in 0..=i {
            square[i * d + j] = residual[(i, j)];
            for k in 0..d {
                square[i * d + j] += spread[i * d + k] * gain[(j, k)];
            }
        }
    }
    if !factorise(&mut square, d) {
        return None;
    }
    let mut solved = unexplained.as_slice().to_vec();
    solve_lower(&square, d, &mut solved);
    solve_upper(&square, d, &mut solved);
    let mut estimate = vec![0.0; d];
    for i in 0..d {
        for j in 0..d {
            estimate[j] += spread[i * d + j] * solved[i];
        }
    }
    Some(estimate)
}

/// `R = Cov(y) − mean(B S Bᵀ)`, made positive definite; none if `y` is not finite.
fn residual_covariance(evidence: &[Evidence], input: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let d = input.nrows();
    let count = evidence.len() as f64;
    let unexplained = evidence.iter().map(|item| &item.unexplained);
    let mean = unexplained.sum::<DVector<f64>>() / count;
    let mut covariance = DMatrix::zeros(d, d);
    let mut explained = DMatrix::zeros(d, d);
    for Evidence {
        unexplained, gain, ..
    } in evidence
    {
        let off = unexplained - &mean;
        covariance += &off * off.transpose() / count;
        explained += gain * input * gain.transpose() / count;
    }
    // A latent that is explained exactly has no deviation of its own: any positive scale will do.
    let variance = |i: usize| f64::max(covariance[(i, i)], explained[(i, i)]);
    let deviation: Vec<f64> = (0..d)
        .map(|i| variance(i).sqrt().max(f64::MIN_POSITIVE))
        .collect();
    let relative = DMatrix::from_fn(d, d, |row, col| {
        (covariance[(row, col)] - explained[(row, col)]) / (deviation[row] * deviation[col])
    });
    if relative.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let mut eigen = SymmetricEigen::new(relative);
    let floor = |value: &mut f64| *value = value.max(RESIDUAL_FLOOR);
    eigen.eigenvalues.apply(floor);
    let floored = eigen.recompose();
    Some(DMatrix::from_fn(d, d, |row, col| {
        floored[(row, col)] * deviation[row] * deviation[col]
    }))
}

/// Slope of the straight line through the velocities around a sample, within its phase.
fn acceleration(motion: &Motion<'_>, latent_dim: usize, sample: usize) -> DVector<f64> {
    let time_s = motion.time_s;
    let belongs = |other: usize| {
        motion.phase[other] == motion.phase[sample]
            && (time_s[other] - time_s[sample]).abs() <= HALF_WINDOW_S
    };
    let before = (0..sample).rev().take_while(|&other| belongs(other));
    let after = (sample + 1..time_s.len()).take_while(|&other| belongs(other));
    let mut first = before.last().unwrap_or(sample);
    let mut last = after.last().unwrap_or(sample);
    if first == last {
        // A lone sample of its phase: its neighbours are all there is.
        first = first.saturating_sub(1);
        last = (last + 1).min(time_s.len() - 1);
    }
    // Sums in the order in which the controller in C has them.
    let mut mean_s = 0.0;
    for other in first..=last {
        mean_s += time_s[other];
    }
    mean_s /= (last - first + 1) as f64;
    let (mut spread, mut slope) = (0.0, DVector::zeros(latent_dim));
    for other in first..=last {
        let off_s = time_s[other] - mean_s;
        spread += off_s * off_s;
        for latent in 0..latent_dim {
            slope[latent] += off_s * motion.state[(2 * other + 1) * latent_dim + latent];
        }
    }
    slope / spread
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_of_a_parabola_is_its_derivative_inside_and_stops_at_the_phases_edge() {
        let time_s: Vec<f64> = (0..40).map(|sample| 0.002 * sample as f64).collect();
        let phase: Vec<usize> = (0..40).map(|sample| usize::from(sample >= 20)).collect();
        // dz = t² before the edge, 5 after it.
        let state: Vec<f64> = (0..40)
            .flat_map(|k| [0.0, if k < 20 { time_s[k] * time_s[k] } else { 5.0 }])
            .collect();
        let motion = Motion {
            time_s: &time_s,
            state: &state,
            phase: &phase,
        };
        assert!((acceleration(&motion, 1, 10)[0] - 0.04).abs() < 1e-12);
        // One-sided at the edge: the slope at the middle of the eight samples before it.
        assert!((acceleration(&motion, 1, 19)[0] - (time_s[19] + time_s[11])).abs() < 1e-12);
        assert!(acceleration(&motion, 1, 20)[0].abs() < 1e-9);
    }

    #[test]
    fn states_set_what_is_expected_and_accelerations_correct_it() {
        let number = |value: f64| DMatrix::from_element(1, 1, value);
        let phase = ControlPhase {
            name: "contact".to_owned(),
            is_grounded: true,
            latent_mean: DVector::from_element(1, 7.0),
            latent_root: number(3.0),
            given_state: Some(InputGivenState {
                mean: DMatrix::from_row_slice(1, 3, &[0.5, 1.0, -2.0]),
                covariance: number(0.5),
                acceleration_error: number(2.0),
            }),
            torque_mean: nalgebra::zero(),
            torque_precision: nalgebra::one(),
        };
        // M [1; z; dz] = 0.5 + 3 - 2 at z = 3, dz = 1.
        let mut input = expected_input(&phase, &[3.0, 1.0]).as_slice().to_vec();
        assert_eq!(input, [1.5]);
        // y = 6 with B = 2: S B / (B S B + R) y = 0.5 * 2 / (2 + 2) * 6.
        let evidence = [Evidence {
            sample: 0,
            unexplained: DVector::from_element(1, 6.0),
            gain: number(2.0),
        }];
        add_estimates(&phase, &evidence, &mut input);
        assert!((input[0] - 3.0).abs() < 1e-12, "{input:?}");
    }

    #[test]
    fn residual_covariance_is_what_the_input_leaves() {
        // y = B u + r with B = 2, Var u = 1, Var r = 0.25, sampled on a symmetric grid.
        let evidence =
            [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]].map(|[u, r]| Evidence {
                sample: 0,
                unexplained: DVector::from_element(1, 2.0 * u + 0.5 * r),
                gain: DMatrix::from_element(1, 1, 2.0),
            });
        let residual = residual_covariance(&evidence, &DMatrix::identity(1, 1)).expect("finite");
        assert!((residual[(0, 0)] - 0.25).abs() < 1e-12, "{residual}");
    }
}
