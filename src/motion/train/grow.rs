//! Terms that are not affine, added one at a time where predictions gain by them.

use super::progress::Monitor;
use super::select::{Search, Trial};

/// Share of the score that a term must bring to be added.
const LEAST_GAIN: f64 = 0.005;
/// Terms tried in a round.
const ATTEMPTS: usize = 60;
const ROUNDS: usize = 3;

impl Search<'_> {
    /// Adds terms, those that explain most of the accelerations first, fitting their equation again, wherever the score
    /// falls by [`LEAST_GAIN`] or more. Goes round [`ROUNDS`] times, as terms explain less once others are there.
    pub fn grow(&self, trial: &mut Trial<'_>, monitor: &mut Monitor<'_>) {
        monitor.stage("adding terms that predictions gain by", ROUNDS * ATTEMPTS);
        for round in 0..ROUNDS {
            let before = trial.now.score;
            let candidates = by_gain(trial).into_iter().take(ATTEMPTS).enumerate();
            for (attempt, (_, phase, row, column)) in candidates {
                if monitor.cancelled() {
                    return;
                }
                self.attempt(trial, phase, row, column);
                let done = round * ATTEMPTS + attempt + 1;
                monitor.done(done, format!("score {:.4}", trial.now.score));
            }
            if trial.now.score == before {
                return;
            }
        }
    }

    /// Fits the equation of a term with it, and keeps that if the score falls by enough.
    fn attempt(&self, trial: &mut Trial<'_>, phase: usize, row: usize, column: usize) {
        let limit = (1.0 - LEAST_GAIN) * trial.now.score;
        let xi = &mut trial.now.xi;
        let mut support = xi[phase].map(|value| value != 0.0);
        support[(row, column)] = true;
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

/// The share of the energy that each term which is not active would explain, with its phase, row and column; the largest
/// first.
fn by_gain(trial: &Trial<'_>) -> Vec<(f64, usize, usize, usize)> {
    let mut terms = Vec::new();
    for (phase, regression) in trial.regressions.iter().enumerate() {
        let support = trial.now.xi[phase].map(|value| value != 0.0);
        for column in 0..support.ncols() {
            let gains = regression.gains(column, &support, trial.ridge);
            terms.extend((gains.into_iter()).map(|(row, share)| (share, phase, row, column)));
        }
    }
    terms.sort_by(|a, b| b.0.total_cmp(&a.0));
    terms
}
