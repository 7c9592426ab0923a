//! What the latent state says of the latent input.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::error::{ModelError, check_tensor};
use super::listed;
use super::maps::complement;
use super::statistics::{check_covariance, symmetric};

/// Samples per number of a regression, below which it is left out.
const LEAST_SAMPLES: usize = 4;
/// Ridge relative to the variance of each coordinate.
const RIDGE: f64 = 1e-2;

/// The latent input of one phase given the latent state, `u_lat | z, dz ~ (mean [1; z; dz], covariance)`, and how far
/// the model's accelerations are off. Scaled units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputGivenState {
    /// `latent_dim x (1 + 2 latent_dim)`.
    #[serde(with = "listed")]
    pub mean: DMatrix<f64>,
    /// `latent_dim x latent_dim`, symmetric positive semidefinite.
    #[serde(with = "listed")]
    pub covariance: DMatrix<f64>,
    /// Of `ddz - Xi^T Theta(z, dz, u_lat)` about zero, `latent_dim x latent_dim`.
    #[serde(with = "listed")]
    pub acceleration_error: DMatrix<f64>,
}

impl InputGivenState {
    /// Ridge regression of the inputs on the states of samples in rows: `[z, dz, u_lat]`, and what the model leaves of
    /// `ddz`. Shifts of `z` along the columns of `shifts` change no input, as where a robot is does not. None for fewer
    /// samples than say something.
    pub fn of_samples(
        shifts: &DMatrix<f64>,
        mut variables: DMatrix<f64>,
        left: &DMatrix<f64>,
    ) -> Option<Self> {
        let (d, n) = (shifts.nrows(), variables.nrows());
        if n < LEAST_SAMPLES * (1 + 2 * d) {
            return None;
        }
        let share = 1.0 / n as f64;
        let average = variables.row_sum().transpose() * share;
        for mut row in variables.row_iter_mut() {
            row -= average.transpose();
        }
        let (mut covariance, mut error) = (DMatrix::zeros(3 * d, 3 * d), DMatrix::zeros(d, d));
        covariance.gemm_tr(share, &variables, &variables, 1.0);
        error.gemm_tr(share, left, left, 1.0);
        // States without their shifts.
        let mut still = DMatrix::identity(2 * d, 2 * d);
        still
            .view_mut((0, 0), (d, d))
            .copy_from(&complement(shifts));
        let state = &still * covariance.view((0, 0), (2 * d, 2 * d)) * &still;
        let input = covariance.view((2 * d, 2 * d), (d, d));
        let both = covariance.view((2 * d, 0), (d, 2 * d)) * &still;
        let gain = ridge(&state, &both)? * still;
        let explained = &gain * both.transpose();
        let left = input - &explained - explained.transpose() + &gain * &state * gain.transpose();
        let bias = average.rows(2 * d, d) - &gain * average.rows(0, 2 * d);
        let mut mean = DMatrix::zeros(d, 1 + 2 * d);
        mean.set_column(0, &bias);
        mean.columns_mut(1, 2 * d).copy_from(&gain);
        Some(Self {
            mean,
            covariance: symmetric(left),
            acceleration_error: symmetric(error),
        })
    }

    pub(super) fn check(&self, place: &str, latent_dim: usize) -> Result<(), ModelError> {
        let (mean, shape) = (format!("{place}.mean"), (latent_dim, 1 + 2 * latent_dim));
        check_tensor(&mean, &self.mean, shape)?;
        for (key, matrix) in [
            ("covariance", &self.covariance),
            ("acceleration_error", &self.acceleration_error),
        ] {
            check_covariance(&format!("{place}.{key}"), matrix, latent_dim)?;
        }
        Ok(())
    }
}

/// `both (state + ridge)^-1` with the ridge relative to each variance; none if that has no factor.
fn ridge(state: &DMatrix<f64>, both: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let variance = state.diagonal();
    let floor = f64::EPSILON * variance.amax();
    // A coordinate that never moves says nothing.
    let inverse = variance.map(|v| if v > floor { 1.0 / v.sqrt() } else { 0.0 });
    let inverse = DMatrix::from_diagonal(&inverse);
    let normalised =
        &inverse * state * &inverse + DMatrix::identity(state.nrows(), state.nrows()) * RIDGE;
    let solved = normalised.cholesky()?.solve(&(&inverse * both.transpose()));
    Some((inverse * solved).transpose())
}
