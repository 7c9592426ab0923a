//! Pruning by rollouts: terms that a prediction does not miss are dropped.

use nalgebra::DMatrix;

use super::features::Features;
use super::progress::Watch;
use super::rollout::Candidate;
use super::select::Judge;
use super::sparse::Regression;

/// Coefficients of all phases with the regressions that can fit them again.
pub(super) struct Pruned<'a> {
    /// One a phase.
    pub regressions: &'a [Regression],
    /// Ridge of every fit.
    pub ridge: f64,
    /// `library_dim x latent_dim` a phase.
    pub xi: Vec<DMatrix<f64>>,
    /// Score of `xi`.
    pub score: f64,
}

impl Pruned<'_> {
    /// Drops terms, the least useful to the regression first, fitting the rest of their equation again, as long as
    /// the score stays within `limit`. One attempt a term.
    pub fn sweep(
        &mut self,
        features: &Features,
        judge: &Judge<'_>,
        limit: f64,
        watch: &mut Watch<'_>,
    ) {
        let mut order = self.terms_by_use();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        watch.stage("dropping terms that predictions do not miss", order.len());
        for (attempt, (_, phase, row, column)) in order.into_iter().enumerate() {
            if watch.cancelled() {
                return;
            }
            let mut support = self.xi[phase].map(|value| value != 0.0);
            support[(row, column)] = false;
            let fitted = self.regressions[phase].fit_column(column, &support, self.ridge);
            let before = self.xi[phase].column(column).into_owned();
            self.xi[phase].set_column(column, &fitted);
            let score = judge.score(Candidate {
                features,
                xi: &self.xi,
            });
            if score <= limit {
                self.score = score;
            } else {
                self.xi[phase].set_column(column, &before);
            }
            watch.done(attempt + 1, format!("score {:.4}", self.score));
        }
    }

    /// Active terms as (share of the energy that is lost without it, phase, row, column).
    fn terms_by_use(&self) -> Vec<(f64, usize, usize, usize)> {
        let mut terms = Vec::new();
        for (phase, regression) in self.regressions.iter().enumerate() {
            let support = self.xi[phase].map(|value| value != 0.0);
            for column in 0..support.ncols() {
                for (row, loss) in regression.losses(column, &support, self.ridge) {
                    terms.push((loss, phase, row, column));
                }
            }
        }
        terms
    }
}
