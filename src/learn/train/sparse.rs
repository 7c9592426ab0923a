//! Sparse regression of the latent accelerations.

use super::recipe::RecipePart;
use super::*;

const LEAST_RIDGE: f64 = 1e-10; // on the normalised columns: far above rounding
const CHANGE_RIDGE: f64 = 1e-2; // of changes from a prior
const RECOMPUTED: usize = 64; // up to this size, supports are solved anew after an elimination, larger ones updated

type Support = DMatrix<bool>; // active terms, library_dim x latent_dim

/// Normal equations of `ddz = theta Xi` for one phase, columns normalised to unit root mean square.
#[derive(Clone, Debug)]
pub(super) struct Regression {
    gram: DMatrix<f64>,        // p x p, normalised theta^T theta / n
    correlation: DMatrix<f64>, // p x d, normalised theta^T ddz / n
    theta_rms: DVector<f64>,
    target_rms: DVector<f64>,
    knowledge: Knowledge,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Pruning {
    /// Drop every term whose contribution `|xi| rms(term) / rms(ddz)` is below this, solve again, until none is.
    Threshold(f64),
    /// Drop the term that explains least, one at a time, while the share of the energy left unexplained stays within
    /// this of the full library's.
    Elimination(f64),
}

impl Regression {
    /// `theta` is `n x library_dim`, `target` is `n x latent_dim`; the known part is subtracted from the target.
    pub(super) fn new(theta: &DMatrix<f64>, target: &DMatrix<f64>, knowledge: Knowledge) -> Self {
        let n = theta.nrows().max(1) as f64;
        let unknown = target - theta * &knowledge.known;
        let theta_rms = column_rms(theta);
        let target_rms = column_rms(&unknown);
        let mut gram = theta.tr_mul(theta) / n;
        let mut correlation = theta.tr_mul(&unknown) / n;
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
            knowledge,
        }
    }

    /// Xi of the terms that are `allowed` or kept, by ridge regression with each of the `prunings`. Contributions, not
    /// bare coefficients, decide (otherwise STLSQ of Brunton et al. 2016). Eliminations share one path.
    pub(super) fn fit_each(
        &self,
        ridge: f64,
        prunings: &[Pruning],
        allowed: &[bool],
    ) -> Vec<DMatrix<f64>> {
        let mut fits = vec![self.knowledge.known.clone(); prunings.len()];
        for column in (0..self.target_rms.len()).filter(|&column| self.target_rms[column] > 0.0) {
            let informative: Vec<usize> = (self.free_terms(column))
                .filter(|&i| self.theta_rms[i] > 0.0)
                .filter(|&i| allowed[i] || self.knowledge.kept[(i, column)])
                .collect();
            if let Some(standing) = self.knowledge.standing(column) {
                let share = f64::from(self.knowledge.has(RecipePart::StillFeet));
                for xi in &mut fits {
                    let prior = standing.still(xi) * share;
                    let fitted = self.solve_near(column, &informative, &prior);
                    self.store(xi, column, &informative, &fitted);
                }
                continue;
            }
            let losses = prunings.iter().filter_map(|pruning| match pruning {
                Pruning::Elimination(loss) => Some(*loss),
                Pruning::Threshold(_) => None,
            });
            let losses: Vec<f64> = losses.collect();
            let mut eliminated = self
                .eliminate(column, informative.clone(), ridge, &losses)
                .into_iter();
            for (pruning, xi) in prunings.iter().zip(&mut fits) {
                let support = match pruning {
                    Pruning::Threshold(least) => {
                        self.threshold(column, informative.clone(), ridge, *least)
                    }
                    Pruning::Elimination(_) => eliminated.next().expect("one for every loss"),
                };
                let solution = self.solve(column, &support, ridge);
                self.store(xi, column, &support, &solution);
            }
        }
        fits
    }

    fn threshold(
        &self,
        column: usize,
        mut support: Vec<usize>,
        ridge: f64,
        least: f64,
    ) -> Vec<usize> {
        loop {
            let (solution, before) = (self.solve(column, &support, ridge), support.len());
            let mut values = solution.iter();
            support.retain(|&i| {
                let weighs = |value: &f64| value.abs() >= least * self.target_rms[column];
                values.next().is_some_and(weighs) || self.knowledge.kept[(i, column)]
            });
            if support.len() == before {
                return support;
            }
        }
    }

    fn eliminate(
        &self,
        column: usize,
        support: Vec<usize>,
        ridge: f64,
        losses: &[f64],
    ) -> Vec<Vec<usize>> {
        let mut left = vec![None; losses.len()];
        let energy = self.energy(column);
        let mut fit = self.support_fit(column, support, ridge);
        let mut lost = 0.0;
        while left.contains(&None) {
            let weakest = (0..fit.support.len())
                .filter(|&j| !self.knowledge.kept[(fit.support[j], column)])
                .map(|j| (j, fit.rise(j) / energy))
                .min_by(|a, b| a.1.total_cmp(&b.1));
            for (left, loss) in left.iter_mut().zip(losses) {
                let stays = weakest.is_none_or(|(_, rise)| lost + rise > *loss);
                if left.is_none() && stays {
                    *left = Some(fit.support.clone());
                }
            }
            let Some((j, rise)) = weakest else { break };
            lost += rise;
            match fit.support.len() > RECOMPUTED {
                true => fit.remove(j),
                false => {
                    fit.support.remove(j);
                    fit = self.support_fit(column, fit.support, ridge);
                }
            }
        }
        left.into_iter().flatten().collect()
    }

    fn support_fit(&self, column: usize, support: Vec<usize>, ridge: f64) -> SupportFit {
        SupportFit {
            solution: self.solve(column, &support, ridge),
            inverse: self.ridged_gram(&support, ridge).inverse(),
            support,
        }
    }

    /// The terms that are not active in a column, and the share of the energy that each would explain.
    pub(super) fn gains(&self, column: usize, support: &Support, ridge: f64) -> Vec<(usize, f64)> {
        let energy = self.energy(column);
        let (inside, outside): (Vec<usize>, Vec<usize>) =
            (self.free_terms(column)).partition(|&i| support[(i, column)]);
        let fit = self.support_fit(column, inside, ridge);
        let outside = outside.into_iter().filter(|&i| self.theta_rms[i] > 0.0);
        outside
            .map(|i| {
                let shared = fit.support.iter().map(|&j| self.gram[(i, j)]);
                let shared = DVector::from_iterator(fit.support.len(), shared);
                let missing = self.correlation[(i, column)] - shared.dot(&fit.solution);
                let own = self.gram[(i, i)] + ridge.max(LEAST_RIDGE)
                    - shared.dot(&(&fit.inverse * &shared));
                (i, missing.powi(2) / own / energy)
            })
            .collect()
    }

    pub(super) fn fit_column(&self, column: usize, support: &Support, ridge: f64) -> DVector<f64> {
        let rows = self.active_terms(column, support);
        let solution = self.solve(column, &rows, ridge);
        let mut xi = self.knowledge.known.clone();
        self.store(&mut xi, column, &rows, &solution);
        xi.column(column).into_owned()
    }

    /// The inverse of the normal equations times a gradient, each column relative to the energy of its accelerations.
    pub(super) fn change(
        &self,
        xi: &DMatrix<f64>,
        gradient: &DMatrix<f64>,
        ridge: f64,
    ) -> DMatrix<f64> {
        let mut change = DMatrix::zeros(xi.nrows(), xi.ncols());
        for column in 0..xi.ncols() {
            let mut support = self.active_terms(column, &xi.map(|value| value != 0.0));
            support.retain(|&i| self.theta_rms[i] > 0.0);
            let normalised = support.iter();
            let normalised = normalised.map(|&i| gradient[(i, column)] / self.theta_rms[i]);
            let right = DVector::from_iterator(support.len(), normalised);
            let solution = self.ridged_gram(&support, ridge).solve(&right);
            self.store(&mut change, column, &support, &solution);
            change
                .column_mut(column)
                .scale_mut(self.target_rms[column].powi(2));
        }
        change
    }

    /// The active terms of a column that may go, and the share of the energy lost without each.
    pub(super) fn losses(&self, column: usize, support: &Support, ridge: f64) -> Vec<(usize, f64)> {
        let energy = self.energy(column);
        let fit = self.support_fit(column, self.active_terms(column, support), ridge);
        let losses = (0..fit.support.len()).map(|j| fit.rise(j) / energy);
        (fit.support.iter().copied().zip(losses))
            .filter(|&(term, _)| !self.knowledge.kept[(term, column)])
            .collect()
    }

    fn free_terms(&self, column: usize) -> impl Iterator<Item = usize> {
        (0..self.theta_rms.len()).filter(move |&i| self.knowledge.free[(i, column)])
    }

    fn active_terms(&self, column: usize, support: &Support) -> Vec<usize> {
        let free = self.free_terms(column);
        free.filter(|&i| support[(i, column)]).collect()
    }

    fn energy(&self, column: usize) -> f64 {
        self.target_rms[column].powi(2).max(f64::MIN_POSITIVE)
    }

    fn solve(&self, column: usize, support: &[usize], ridge: f64) -> DVector<f64> {
        let right = support.iter().map(|&i| self.correlation[(i, column)]);
        let right = DVector::from_iterator(support.len(), right);
        self.ridged_gram(support, ridge).solve(&right)
    }

    /// Ridge regression of a column's change from `prior`; no term is dropped.
    fn solve_near(&self, column: usize, support: &[usize], prior: &DVector<f64>) -> DVector<f64> {
        let prior = support.iter().map(|&i| prior[i] * self.theta_rms[i]);
        let prior = DVector::from_iterator(support.len(), prior);
        let right = support.iter().map(|&i| self.correlation[(i, column)]);
        let right = DVector::from_iterator(support.len(), right)
            - self.gram.select_rows(support).select_columns(support) * &prior;
        prior + self.ridged_gram(support, CHANGE_RIDGE).solve(&right)
    }

    fn ridged_gram(&self, support: &[usize], ridge: f64) -> Cholesky<f64, Dyn> {
        let n = support.len();
        let gram = self.gram.select_rows(support).select_columns(support);
        let ridge = ridge.max(LEAST_RIDGE);
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

struct SupportFit {
    support: Vec<usize>,
    solution: DVector<f64>,
    inverse: DMatrix<f64>,
}

impl SupportFit {
    /// Increase of the ridge objective without term `j`: `c_j^2 / P_jj`, with `c` the solution and `P` the inverse.
    fn rise(&self, j: usize) -> f64 {
        self.solution[j].powi(2) / self.inverse[(j, j)]
    }

    /// The fit without term `j`: `c - P_j c_j / P_jj` and `P - P_j P_j^T / P_jj`.
    fn remove(&mut self, j: usize) {
        let column = self.inverse.column(j) / self.inverse[(j, j)];
        let (own, at) = (self.solution[j], self.inverse[(j, j)]);
        self.solution.axpy(-own, &column, 1.0);
        self.inverse.ger(-at, &column, &column, 1.0);
        self.support.remove(j);
        self.solution = std::mem::take(&mut self.solution).remove_row(j);
        let inverse = std::mem::take(&mut self.inverse);
        self.inverse = inverse.remove_row(j).remove_column(j);
    }
}

pub(super) fn active_terms(xi: &DMatrix<f64>) -> usize {
    xi.iter().filter(|value| **value != 0.0).count()
}

fn column_rms(matrix: &DMatrix<f64>) -> DVector<f64> {
    let n = matrix.nrows().max(1) as f64;
    let columns = matrix.column_iter();
    let rms = columns.map(|column| (column.norm_squared() / n).sqrt());
    DVector::from_iterator(matrix.ncols(), rms)
}

#[cfg(test)]
#[path = "../../../tests/units/learn_train_sparse.rs"]
mod tests;
