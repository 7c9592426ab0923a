//! Sparse regression of the latent accelerations: which terms of the library stay, with which coefficients.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use serde::{Deserialize, Serialize};

/// Normal equations of `ddz = theta Xi` for one phase, columns normalised to unit root mean square.
///
/// Building it reads the samples once; every solve afterwards works on `library_dim x library_dim` matrices.
#[derive(Clone, Debug)]
pub struct Regression {
    gram: DMatrix<f64>,        // p x p, normalised theta^T theta / n
    correlation: DMatrix<f64>, // p x d, normalised theta^T ddz / n
    theta_rms: DVector<f64>,
    target_rms: DVector<f64>,
}

/// When a term of the library is dropped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pruning {
    /// Sequential thresholding: drop every term whose contribution `|xi| rms(term) / rms(ddz)` is below this, solve
    /// again, until none is.
    Threshold(f64),
    /// Backward elimination: drop the term that explains least, one at a time, while the share of the acceleration's
    /// energy left unexplained stays within this of the full library's.
    Elimination(f64),
}

impl Regression {
    /// Normal equations from samples: `theta` is `n x library_dim`, `target` is `n x latent_dim`.
    pub fn new(theta: &DMatrix<f64>, target: &DMatrix<f64>) -> Self {
        let n = theta.nrows().max(1) as f64;
        let theta_rms = column_rms(theta);
        let target_rms = column_rms(target);
        let mut gram = theta.tr_mul(theta) / n;
        let mut correlation = theta.tr_mul(target) / n;
        for (i, &scale) in theta_rms.iter().enumerate() {
            let factor = if scale > 0.0 { 1.0 / scale } else { 0.0 };
            gram.row_mut(i).scale_mut(factor);
            gram.column_mut(i).scale_mut(factor);
            correlation.row_mut(i).scale_mut(factor);
        }
        Self {
            gram,
            correlation,
            theta_rms,
            target_rms,
        }
    }

    /// Terms in the library.
    pub fn library_dim(&self) -> usize {
        self.gram.nrows()
    }

    /// Latent coordinates.
    pub fn latent_dim(&self) -> usize {
        self.correlation.ncols()
    }

    /// Coefficients `Xi` (`library_dim x latent_dim`) by ridge regression on the normalised columns, pruned.
    ///
    /// Contributions, not bare coefficients, decide (STLSQ of Brunton et al. 2016 otherwise), so that the units of a
    /// term do not matter.
    pub fn fit(&self, ridge: f64, pruning: Pruning) -> DMatrix<f64> {
        let mut xi = DMatrix::zeros(self.library_dim(), self.latent_dim());
        let informative: Vec<usize> = (0..self.library_dim())
            .filter(|&i| self.theta_rms[i] > 0.0)
            .collect();
        for column in 0..self.latent_dim() {
            if self.target_rms[column] == 0.0 {
                continue;
            }
            let (support, solution) = match pruning {
                Pruning::Threshold(least) => {
                    self.threshold(column, informative.clone(), ridge, least)
                }
                Pruning::Elimination(loss) => {
                    self.eliminate(column, informative.clone(), ridge, loss)
                }
            };
            self.store(&mut xi, column, &support, &solution);
        }
        xi
    }

    fn threshold(
        &self,
        column: usize,
        mut support: Vec<usize>,
        ridge: f64,
        least: f64,
    ) -> (Vec<usize>, DVector<f64>) {
        loop {
            let solution = self.solve(column, &support, ridge);
            let kept: Vec<usize> = support
                .iter()
                .zip(solution.iter())
                .filter(|(_, value)| value.abs() >= least * self.target_rms[column])
                .map(|(&i, _)| i)
                .collect();
            if kept.len() == support.len() {
                return (support, solution);
            }
            support = kept;
        }
    }

    fn eliminate(
        &self,
        column: usize,
        mut support: Vec<usize>,
        ridge: f64,
        loss: f64,
    ) -> (Vec<usize>, DVector<f64>) {
        let mut lost = 0.0;
        loop {
            let solution = self.solve(column, &support, ridge);
            let rises = self.rises(column, &support, &solution, ridge);
            let weakest = (0..support.len()).min_by(|&a, &b| rises[a].total_cmp(&rises[b]));
            match weakest {
                Some(j) if lost + rises[j] <= loss => {
                    lost += rises[j];
                    support.remove(j);
                }
                Some(_) | None => return (support, solution),
            }
        }
    }

    /// One column of Xi on a given support (`library_dim x latent_dim`, true where a term is active).
    pub fn fit_column(&self, column: usize, support: &DMatrix<bool>, ridge: f64) -> DVector<f64> {
        let rows: Vec<usize> = (0..self.library_dim())
            .filter(|&i| support[(i, column)])
            .collect();
        let solution = self.solve(column, &rows, ridge);
        let mut xi = DMatrix::zeros(self.library_dim(), self.latent_dim());
        self.store(&mut xi, column, &rows, &solution);
        xi.column(column).into_owned()
    }

    /// For every active term of a column: its row, and the share of the acceleration's energy lost without it.
    pub fn losses(&self, column: usize, support: &DMatrix<bool>, ridge: f64) -> Vec<(usize, f64)> {
        let rows: Vec<usize> = (0..self.library_dim())
            .filter(|&i| support[(i, column)])
            .collect();
        let solution = self.solve(column, &rows, ridge);
        let losses = self.rises(column, &rows, &solution, ridge);
        rows.into_iter().zip(losses).collect()
    }

    /// Removing term `j` raises the ridge objective by `c_j^2 / (G^-1)_jj`, with `c` the solution and `G` the ridged
    /// Gram matrix of the support; here as a share of the acceleration's energy.
    fn rises(
        &self,
        column: usize,
        support: &[usize],
        solution: &DVector<f64>,
        ridge: f64,
    ) -> Vec<f64> {
        let energy = self.target_rms[column].powi(2).max(f64::MIN_POSITIVE);
        let inverse = self.ridged_gram(support, ridge).inverse();
        (0..support.len())
            .map(|j| solution[j].powi(2) / inverse[(j, j)] / energy)
            .collect()
    }

    /// Ridge solution for the normalised columns in `support`.
    fn solve(&self, column: usize, support: &[usize], ridge: f64) -> DVector<f64> {
        let right = DVector::from_iterator(
            support.len(),
            support.iter().map(|&i| self.correlation[(i, column)]),
        );
        self.ridged_gram(support, ridge).solve(&right)
    }

    fn ridged_gram(&self, support: &[usize], ridge: f64) -> Cholesky<f64, Dyn> {
        let n = support.len();
        let gram = self.gram.select_rows(support).select_columns(support);
        // The normalised columns have unit diagonal, so this is far above rounding.
        let ridge = ridge.max(1e-10);
        (gram + DMatrix::identity(n, n) * ridge)
            .cholesky()
            .expect("a Gram matrix plus a ridge is positive definite")
    }

    fn store(
        &self,
        xi: &mut DMatrix<f64>,
        column: usize,
        support: &[usize],
        normalised: &DVector<f64>,
    ) {
        for (&row, &value) in support.iter().zip(normalised.iter()) {
            if self.theta_rms[row] > 0.0 {
                xi[(row, column)] = value / self.theta_rms[row];
            }
        }
    }
}

/// Entries of `xi` that are not zero.
pub fn active_terms(xi: &DMatrix<f64>) -> usize {
    xi.iter().filter(|value| **value != 0.0).count()
}

fn column_rms(matrix: &DMatrix<f64>) -> DVector<f64> {
    let n = matrix.nrows().max(1) as f64;
    DVector::from_iterator(
        matrix.ncols(),
        matrix
            .column_iter()
            .map(|column| (column.norm_squared() / n).sqrt()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples() -> (DMatrix<f64>, DMatrix<f64>) {
        let theta = DMatrix::from_fn(200, 4, |i, j| {
            let t = i as f64 / 20.0;
            [
                1.0,
                0.01 * t.sin(),
                100.0 * (1.7 * t).cos(),
                (0.3 * t).exp(),
            ][j]
        });
        let target = DMatrix::from_fn(200, 1, |i, _| {
            2.0 + 30.0 * theta[(i, 1)] + 0.001 * theta[(i, 2)].signum() * 1e-3
        });
        (theta, target)
    }

    #[test]
    fn fit_finds_the_terms_that_made_the_data_whatever_their_size() {
        let (theta, target) = samples();
        for pruning in [Pruning::Threshold(0.03), Pruning::Elimination(1e-6)] {
            let xi = Regression::new(&theta, &target).fit(0.0, pruning);
            assert_eq!(active_terms(&xi), 2, "{pruning:?}");
            assert!(
                (xi[(0, 0)] - 2.0).abs() < 1e-3 && (xi[(1, 0)] - 30.0).abs() < 0.05,
                "{pruning:?} {xi}"
            );
        }
    }

    #[test]
    fn elimination_of_everything_leaves_no_term() {
        let (theta, target) = samples();
        assert_eq!(
            active_terms(&Regression::new(&theta, &target).fit(1e-3, Pruning::Elimination(2.0))),
            0
        );
    }

    #[test]
    fn fit_column_keeps_the_given_support_only() {
        let (theta, target) = samples();
        let support = DMatrix::from_column_slice(4, 1, &[true, false, true, false]);
        let xi = Regression::new(&theta, &target).fit_column(0, &support, 1e-6);
        assert_eq!((xi[1], xi[3]), (0.0, 0.0));
        assert!((xi[0] - 2.0).abs() < 0.1);
    }

    #[test]
    fn fit_drops_every_term_of_a_coordinate_that_does_not_accelerate() {
        let (theta, _) = samples();
        let xi =
            Regression::new(&theta, &DMatrix::zeros(200, 1)).fit(1e-3, Pruning::Threshold(0.03));
        assert_eq!(active_terms(&xi), 0);
    }
}
