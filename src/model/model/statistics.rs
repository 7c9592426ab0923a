//! Statistics of the training inputs, and the distribution of the latent input given the latent state.

use super::*;

/// Largest relative asymmetry and most negative eigenvalue that count as rounding.
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
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub given_state: Option<InputGivenState>,
}

impl InputStatistics {
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

    pub fn projected(&self, projection: &DMatrix<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let covariance = projection * &self.covariance * projection.transpose();
        (projection * &self.mean, covariance)
    }

    pub(super) fn check(&self, phase: &str, dim: usize, latent_dim: usize) -> Result<()> {
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

pub(super) fn check_covariance(tensor: &str, found: &DMatrix<f64>, dim: usize) -> Result<()> {
    check_tensor(tensor, found, (dim, dim))?;
    check_symmetric(tensor, found)?;
    check_positive(tensor, found)
}

fn check_symmetric(tensor: &str, covariance: &DMatrix<f64>) -> Result<()> {
    let bound = ROUNDING * covariance.amax();
    for (row, column) in (0..covariance.nrows()).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let [found, mirror] = [(row, column), (column, row)].map(|at| covariance[at]);
        let place = format!("`{tensor}`[{row}][{column}]");
        let expected = format!("{mirror} as in [{column}][{row}] (a covariance is symmetric)");
        check((found - mirror).abs() <= bound, &place, || found, expected)?;
    }
    Ok(())
}

fn check_positive(tensor: &str, covariance: &DMatrix<f64>) -> Result<()> {
    let largest_entry = covariance.amax();
    if largest_entry == 0.0 {
        return Ok(());
    }
    // Divided by the largest entry first: no intermediate product overflows.
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

const LEAST_SAMPLES: usize = 4;
const RIDGE: f64 = 1e-2;

/// `u_lat | z, dz ~ (mean [1; z; dz], covariance)` of one phase, and the errors of the model's accelerations. Scaled.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputGivenState {
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
    /// Ridge regression on samples in rows, `[z, dz, u_lat]`; `left` is the residual of `ddz`. Shifts of `z` along the
    /// columns of `shifts` change no input. None if there are too few samples.
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
        (still.view_mut((0, 0), (d, d))).copy_from(&complement(shifts));
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

    pub(super) fn check(&self, place: &str, latent_dim: usize) -> Result<()> {
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
    // A coordinate that never moves has no influence.
    let inverse = variance.map(|v| if v > floor { 1.0 / v.sqrt() } else { 0.0 });
    let inverse = DMatrix::from_diagonal(&inverse);
    let normalised =
        &inverse * state * &inverse + DMatrix::identity(state.nrows(), state.nrows()) * RIDGE;
    let solved = normalised.cholesky()?.solve(&(&inverse * both.transpose()));
    Some((inverse * solved).transpose())
}
