//! Statistics of the inputs of the training recordings, and of the latent input given the latent state.

use nalgebra::{DMatrix, DVector};

use super::error::{ModelError, check_tensor};
use super::maps::complement;

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
    /// What the latent state says of the latent input, if it was learned.
    pub given_state: Option<InputGivenState>,
}

impl InputStatistics {
    /// Mean and covariance of `n` samples of `input_dim` inputs in the columns of blocks, SI; all zero without a sample.
    pub fn of_blocks<I>(input_dim: usize, n: usize, blocks: impl Fn() -> I) -> Self
    where
        I: Iterator<Item = DMatrix<f64>>,
    {
        let mut mean = DVector::zeros(input_dim);
        for block in blocks() {
            let columns = block.column_iter();
            columns.for_each(|column| mean.axpy(1.0 / n as f64, &column, 1.0));
        }
        let mut squares = DMatrix::zeros(input_dim, input_dim);
        for mut block in blocks() {
            (block.column_iter_mut()).for_each(|mut column| column -= &mean);
            squares.gemm(1.0, &block, &block.transpose(), 1.0);
        }
        let covariance = squares / n.max(1) as f64;
        Self {
            mean,
            covariance: symmetric(covariance),
            given_state: None,
        }
    }

    /// Mean and covariance of the latent input `u_lat = projection u`, scaled units.
    pub fn projected(&self, projection: &DMatrix<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let covariance = projection * &self.covariance * projection.transpose();
        (projection * &self.mean, covariance)
    }

    /// Complains unless mean and covariance are those of some distribution over `dim` inputs, and
    /// over `latent_dim` latent ones.
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

/// The matrix without the asymmetry of rounding.
fn symmetric(matrix: DMatrix<f64>) -> DMatrix<f64> {
    (&matrix + matrix.transpose()) * 0.5
}

fn check_covariance(tensor: &str, found: &DMatrix<f64>, dim: usize) -> Result<(), ModelError> {
    check_tensor(tensor, found, (dim, dim))?;
    check_symmetric(tensor, found)?;
    check_positive(tensor, found)
}

fn check_symmetric(tensor: &str, covariance: &DMatrix<f64>) -> Result<(), ModelError> {
    let bound = ROUNDING * covariance.amax();
    for row in 0..covariance.nrows() {
        for column in 0..row {
            let found = covariance[(row, column)];
            let expected = covariance[(column, row)];
            if (found - expected).abs() > bound {
                let place = format!("`{tensor}`[{row}][{column}]");
                let expected =
                    format!("{expected} as in [{column}][{row}] (a covariance is symmetric)");
                return Err(ModelError::invalid(place, found, expected));
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

/// Samples per number of a regression, below which it is left out.
const LEAST_SAMPLES: usize = 4;
/// Ridge relative to the variance of each coordinate.
const RIDGE: f64 = 1e-2;

/// The latent input of one phase given the latent state, `u_lat | z, dz ~ (mean [1; z; dz], covariance)`, and how far
/// the model's accelerations are off. Scaled units.
#[derive(Clone, Debug, PartialEq)]
pub struct InputGivenState {
    /// `latent_dim x (1 + 2 latent_dim)`.
    pub mean: DMatrix<f64>,
    /// `latent_dim x latent_dim`, symmetric positive semidefinite.
    pub covariance: DMatrix<f64>,
    /// Of `ddz - Xi^T Theta(z, dz, u_lat)` about zero, `latent_dim x latent_dim`.
    pub acceleration_error: DMatrix<f64>,
}

impl InputGivenState {
    /// Ridge regression of the inputs on the states of `n` samples, in rows of blocks: `[z, dz, u_lat]`, and what the
    /// model leaves of `ddz`. Shifts of `z` along the columns of `shifts` change no input, as where a robot is does
    /// not. None for fewer samples than say something.
    pub fn of_blocks<I>(n: usize, shifts: &DMatrix<f64>, blocks: impl Fn() -> I) -> Option<Self>
    where
        I: Iterator<Item = (DMatrix<f64>, DMatrix<f64>)>,
    {
        let d = shifts.nrows();
        if n < LEAST_SAMPLES * (1 + 2 * d) {
            return None;
        }
        let share = 1.0 / n as f64;
        let mut average = DVector::zeros(3 * d);
        for (variables, _) in blocks() {
            average += variables.row_sum().transpose() * share;
        }
        let (mut covariance, mut error) = (DMatrix::zeros(3 * d, 3 * d), DMatrix::zeros(d, d));
        for (mut variables, left) in blocks() {
            for mut row in variables.row_iter_mut() {
                row -= average.transpose();
            }
            covariance.gemm_tr(share, &variables, &variables, 1.0);
            error.gemm_tr(share, &left, &left, 1.0);
        }
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

    fn check(&self, place: &str, latent_dim: usize) -> Result<(), ModelError> {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Inputs `u = 2 + 3 z2 - dz1 + e`, where `e` is 1 and -1 in turn.
    fn samples(n: usize) -> (DMatrix<f64>, DMatrix<f64>) {
        let wave = |k: usize, rate: f64| (rate * k as f64).sin();
        let variables = DMatrix::from_fn(n, 6, |k, column| {
            let state = [wave(k, 0.9), wave(k, 1.7), wave(k, 2.3), wave(k, 2.9)];
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            match column {
                4 => 2.0 + 3.0 * state[1] - state[2] + sign,
                5 => 0.0,
                _ => state[column],
            }
        });
        (
            variables,
            DMatrix::from_fn(n, 2, |_, column| [0.5, 0.0][column]),
        )
    }

    #[test]
    fn states_explain_the_inputs_that_depend_on_them() {
        let n = 4000;
        let blocks = || std::iter::once(samples(n));
        let shifts = DMatrix::from_row_slice(2, 1, &[1.0, 0.0]);
        let given = InputGivenState::of_blocks(n, &shifts, blocks).expect("enough samples");
        let expected = [2.0, 0.0, 3.0, -1.0, 0.0];
        for (found, expected) in given.mean.row(0).iter().zip(expected) {
            assert!((found - expected).abs() < 0.05, "{}", given.mean);
        }
        assert_eq!(given.mean[(0, 1)], 0.0);
        assert!(given.mean.row(1).amax() < 1e-12);
        assert!(
            (given.covariance[(0, 0)] - 1.0).abs() < 0.05,
            "{}",
            given.covariance
        );
        assert!((given.acceleration_error[(0, 0)] - 0.25).abs() < 1e-12);
        given.check("statistics", 2).expect("consistent shapes");
    }

    #[test]
    fn blocks_do_not_matter_and_few_samples_say_nothing() {
        let (n, shifts) = (400, DMatrix::zeros(2, 0));
        let whole = InputGivenState::of_blocks(n, &shifts, || std::iter::once(samples(n)));
        let cut = || {
            let (variables, left) = samples(n);
            let part = |from: usize, count: usize| {
                let rows = |m: &DMatrix<f64>| m.rows(from, count).into_owned();
                (rows(&variables), rows(&left))
            };
            vec![part(0, 150), part(150, 250)].into_iter()
        };
        let cut = InputGivenState::of_blocks(n, &shifts, cut).expect("enough");
        assert!((whole.expect("enough").mean - cut.mean).amax() < 1e-9);
        assert!(InputGivenState::of_blocks(19, &shifts, || std::iter::once(samples(19))).is_none());
    }
}
