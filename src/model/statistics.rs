//! What the inputs of the training recordings looked like.

use nalgebra::{DMatrix, DVector};

use super::error::{ModelError, check_finite, check_shape};

/// Largest asymmetry, and most negative eigenvalue, that count as rounding: relative to the
/// largest entry, and to the largest eigenvalue.
const ROUNDING: f64 = 1e-9;

/// Mean and covariance of the generalised input `u = [torques; F_lin; F_ang]` in one phase, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct InputStatistics {
    /// `input_dim`.
    pub mean: DVector<f64>,
    /// `input_dim x input_dim`, symmetric positive semidefinite.
    pub covariance: DMatrix<f64>,
}

/// Mean and covariance of the latent input `u_lat` in one phase, scaled units.
#[derive(Clone, Debug, PartialEq)]
pub struct LatentInputStatistics {
    /// `latent_dim`.
    pub mean: DVector<f64>,
    /// `latent_dim x latent_dim`, symmetric positive semidefinite.
    pub covariance: DMatrix<f64>,
}

impl InputStatistics {
    /// Mean and covariance of samples, `input_dim x n`, SI; all zero without a sample.
    pub fn of_samples(u: &DMatrix<f64>) -> Self {
        if u.ncols() == 0 {
            let n = u.nrows();
            return Self {
                mean: DVector::zeros(n),
                covariance: DMatrix::zeros(n, n),
            };
        }
        let mean: DVector<f64> = u.column_mean();
        let mut deviations = u.clone();
        for mut column in deviations.column_iter_mut() {
            column -= &mean;
        }
        let covariance = &deviations * deviations.transpose() / u.ncols() as f64;
        let covariance = (&covariance + covariance.transpose()) * 0.5;
        Self { mean, covariance }
    }

    /// Complains unless mean and covariance are those of some distribution over `dim` inputs.
    pub(super) fn check(&self, phase: &str, dim: usize) -> Result<(), ModelError> {
        let mean = format!("input_statistics.{phase}.mean");
        check_shape(&mean, self.mean.shape(), (dim, 1))?;
        check_finite(&mean, &self.mean)?;
        let tensor = format!("input_statistics.{phase}.covariance");
        check_shape(&tensor, self.covariance.shape(), (dim, dim))?;
        check_finite(&tensor, &self.covariance)?;
        check_symmetric(&tensor, &self.covariance)?;
        check_positive(&tensor, &self.covariance)
    }
}

fn check_symmetric(tensor: &str, covariance: &DMatrix<f64>) -> Result<(), ModelError> {
    let bound = ROUNDING * covariance.amax();
    for row in 0..covariance.nrows() {
        for column in 0..row {
            let found = covariance[(row, column)];
            let expected = covariance[(column, row)];
            if (found - expected).abs() > bound {
                return Err(ModelError::NotSymmetric {
                    tensor: tensor.to_owned(),
                    row,
                    column,
                    found,
                    expected,
                });
            }
        }
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
        .ok_or_else(|| ModelError::Decomposition {
            tensor: tensor.to_owned(),
        })?;
    let smallest = eigen.eigenvalues.min();
    let bound = -ROUNDING * eigen.eigenvalues.max();
    if smallest < bound.min(-f64::EPSILON) {
        return Err(ModelError::NotPositive {
            tensor: tensor.to_owned(),
            smallest: smallest * largest_entry,
            bound: bound * largest_entry,
        });
    }
    Ok(())
}
