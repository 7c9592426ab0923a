//! Statistics of the inputs of the training recordings.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::error::{ModelError, check, check_tensor};
use super::given_state::InputGivenState;
use super::listed;

/// Largest asymmetry, and most negative eigenvalue, that count as rounding: relative to the largest entry, and to the
/// largest eigenvalue.
const ROUNDING: f64 = 1e-9;

/// Mean and covariance of the generalised input `u = [torques; F_lin; F_ang]` in one phase, SI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputStatistics {
    #[serde(with = "listed")]
    pub mean: DVector<f64>,
    /// `input_dim x input_dim`, symmetric positive semidefinite.
    #[serde(with = "listed")]
    pub covariance: DMatrix<f64>,
    /// What the latent state says of the latent input, if it was learned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub given_state: Option<InputGivenState>,
}

impl InputStatistics {
    /// Mean and covariance of SI inputs in columns; all zero without a sample.
    pub fn of_samples(samples: &DMatrix<f64>) -> Self {
        let n = samples.ncols().max(1) as f64;
        let mut mean = DVector::zeros(samples.nrows());
        (samples.column_iter()).for_each(|column| mean.axpy(1.0 / n, &column, 1.0));
        let mut deviations = samples.clone();
        (deviations.column_iter_mut()).for_each(|mut column| column -= &mean);
        Self {
            covariance: symmetric(&deviations * deviations.transpose() / n),
            mean,
            given_state: None,
        }
    }

    /// Mean and covariance of the latent input `u_lat = projection u`, scaled units.
    pub fn projected(&self, projection: &DMatrix<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let covariance = projection * &self.covariance * projection.transpose();
        (projection * &self.mean, covariance)
    }

    /// Complains unless mean and covariance are those of some distribution over `dim` inputs, and over `latent_dim`
    /// latent ones.
    pub(super) fn check(
        &self,
        phase: &str,
        dim: usize,
        latent_dim: usize,
    ) -> Result<(), ModelError> {
        let place = format!("input_statistics.{phase}");
        check_tensor(&format!("{place}.mean"), &self.mean, (dim, 1))?;
        check_covariance(&format!("{place}.covariance"), &self.covariance, dim)?;
        match &self.given_state {
            None => Ok(()),
            Some(given) => given.check(&format!("{place}.given_state"), latent_dim),
        }
    }
}

pub(super) fn symmetric(matrix: DMatrix<f64>) -> DMatrix<f64> {
    (&matrix + matrix.transpose()) * 0.5
}

pub(super) fn check_covariance(
    tensor: &str,
    found: &DMatrix<f64>,
    dim: usize,
) -> Result<(), ModelError> {
    check_tensor(tensor, found, (dim, dim))?;
    check_symmetric(tensor, found)?;
    check_positive(tensor, found)
}

fn check_symmetric(tensor: &str, covariance: &DMatrix<f64>) -> Result<(), ModelError> {
    let bound = ROUNDING * covariance.amax();
    for (row, column) in (0..covariance.nrows()).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let [found, mirror] = [(row, column), (column, row)].map(|at| covariance[at]);
        let place = format!("`{tensor}`[{row}][{column}]");
        let expected = format!("{mirror} as in [{column}][{row}] (a covariance is symmetric)");
        check((found - mirror).abs() <= bound, &place, || found, expected)?;
    }
    Ok(())
}

fn check_positive(tensor: &str, covariance: &DMatrix<f64>) -> Result<(), ModelError> {
    let largest_entry = covariance.amax();
    if largest_entry == 0.0 {
        return Ok(());
    }
    // Divided by the largest entry first, so that no intermediate product overflows.
    let normalised = covariance / largest_entry;
    let max_iterations = 1_000 * covariance.nrows();
    let eigen = nalgebra::SymmetricEigen::try_new(normalised, f64::EPSILON, max_iterations)
        .filter(|eigen| eigen.eigenvalues.iter().all(|value| value.is_finite()))
        .ok_or_else(|| ModelError::no_decomposition(tensor))?;
    let smallest = eigen.eigenvalues.min();
    let bound = -ROUNDING * eigen.eigenvalues.max();
    if smallest < bound.min(-f64::EPSILON) {
        let (smallest, bound) = (smallest * largest_entry, bound * largest_entry);
        let found = format!("the eigenvalue {smallest:e}");
        let expected = format!("none below {bound:e} (a covariance is positive semidefinite)");
        return Err(ModelError::invalid(format!("`{tensor}`"), found, expected));
    }
    Ok(())
}
