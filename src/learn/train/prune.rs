//! Refining by rollouts: terms that a prediction does not miss are dropped, terms that it gains by are added.

use nalgebra::DMatrix;

use super::progress::Monitor;
use super::select::{Search, Trial};
use super::sparse::Regression;

/// Share of the score that a term must bring to be added.
const LEAST_GAIN: f64 = 0.005;
/// Terms tried in a round of adding.
const ATTEMPTS: usize = 60;
/// Rounds of adding.
const ROUNDS: usize = 3;

/// A share of the energy, and the phase, row and column of the term that it belongs to.
type RankedTerm = (f64, usize, usize, usize);

impl Search<'_> {
    /// Drops terms, the least useful to the regression first, fitting the rest of their equation again, as long as
    /// the score stays within `limit`. One attempt a term.
    pub(super) fn sweep(&self, trial: &mut Trial<'_>, limit: f64, monitor: &mut Monitor<'_>) {
        let mut order = trial.places(Regression::losses);
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        monitor.stage("dropping terms that predictions do not miss", order.len());
        for (attempt, place) in order.into_iter().enumerate() {
            if monitor.cancelled() {
                return;
            }
            self.attempt(trial, place, false, limit);
            monitor.done(attempt + 1, format!("score {:.4}", trial.now.score));
        }
    }

    /// Adds terms, those that explain most of the accelerations first, fitting their equation again, wherever the score
    /// falls by [`LEAST_GAIN`] or more. Goes round [`ROUNDS`] times, as terms explain less once others are there.
    pub(super) fn grow(&self, trial: &mut Trial<'_>, monitor: &mut Monitor<'_>) {
        monitor.stage("adding terms that predictions gain by", ROUNDS * ATTEMPTS);
        for round in 0..ROUNDS {
            let before = trial.now.score;
            let mut order = trial.places(Regression::gains);
            order.sort_by(|a, b| b.0.total_cmp(&a.0));
            for (attempt, place) in order.into_iter().take(ATTEMPTS).enumerate() {
                if monitor.cancelled() {
                    return;
                }
                self.attempt(trial, place, true, (1.0 - LEAST_GAIN) * trial.now.score);
                let done = round * ATTEMPTS + attempt + 1;
                monitor.done(done, format!("score {:.4}", trial.now.score));
            }
            if trial.now.score == before {
                return;
            }
        }
    }

    /// Fits the equation of a term with or without it, and keeps that if the score is at most `limit`.
    fn attempt(
        &self,
        trial: &mut Trial<'_>,
        (_, phase, row, column): RankedTerm,
        active: bool,
        limit: f64,
    ) {
        let xi = &mut trial.now.xi;
        let mut support = xi[phase].map(|value| value != 0.0);
        support[(row, column)] = active;
        let tried = trial.regressions[phase].fit_column(column, &support, trial.ridge);
        let before = xi[phase].column(column).into_owned();
        xi[phase].set_column(column, &tried);
        let score = self.judge.score_within(xi, limit);
        if score <= limit && self.growth.admits(xi) {
            trial.now.score = score;
        } else {
            xi[phase].set_column(column, &before);
        }
    }
}

impl Trial<'_> {
    /// What `shares` gives for each column of every phase.
    fn places(
        &self,
        shares: fn(&Regression, usize, &DMatrix<bool>, f64) -> Vec<(usize, f64)>,
    ) -> Vec<RankedTerm> {
        let mut places = Vec::new();
        for (phase, regression) in self.regressions.iter().enumerate() {
            let support = self.now.xi[phase].map(|value| value != 0.0);
            for column in 0..support.ncols() {
                let found = shares(regression, column, &support, self.ridge).into_iter();
                places.extend(found.map(|(row, share)| (share, phase, row, column)));
            }
        }
        places
    }
}
