//! Scores of candidate dynamics: the error of their rollouts on a set of jumps.

use super::dataset::Dataset;
use super::latent::Latent;
use super::rollout::{Candidate, Window, predict, restarted, whole};

/// Samples to judge candidates on.
pub struct Judge<'a> {
    dataset: &'a Dataset,
    latent: &'a [Latent],
    short: Vec<Window>,
    long: Vec<Window>,
    inverse_std: Vec<f64>,
    rollout_weight: f64,
}

impl<'a> Judge<'a> {
    /// Judges on these jumps.
    pub fn new(dataset: &'a Dataset, latent: &'a [Latent], rollout_weight: f64) -> Self {
        let d = latent.first().map_or(0, |first| first.z.nrows());
        let inverse_std = (0..d)
            .map(|row| 1.0 / row_std(latent, row).max(f64::MIN_POSITIVE))
            .collect();
        let (short, long) = (restarted(dataset, 0.1), whole(dataset));
        Self {
            dataset,
            latent,
            short,
            long,
            inverse_std,
            rollout_weight,
        }
    }

    /// Score of a candidate, see [`Choice::score`](super::select::Choice::score); infinite if a rollout diverges.
    pub fn score(&self, candidate: Candidate<'_>) -> f64 {
        let short = self.error(candidate, &self.short);
        if !short.is_finite() || self.rollout_weight == 0.0 {
            return short;
        }
        short + self.rollout_weight * self.error(candidate, &self.long)
    }

    fn error(&self, candidate: Candidate<'_>, windows: &[Window]) -> f64 {
        let predictions = predict(candidate, self.dataset, self.latent, windows);
        let (mut square, mut count) = (0.0, 0);
        for (window, prediction) in windows.iter().zip(&predictions) {
            let truth = self.latent[window.jump]
                .z
                .columns(window.start + 1, window.steps);
            for (row, scale) in self.inverse_std.iter().enumerate() {
                square += (prediction.row(row) - truth.row(row)).norm_squared() * scale * scale;
            }
            count += prediction.len();
        }
        let error = (square / count.max(1) as f64).sqrt();
        if error.is_finite() {
            error
        } else {
            f64::INFINITY
        }
    }
}

/// Standard deviation of a latent coordinate over all samples.
fn row_std(latent: &[Latent], row: usize) -> f64 {
    let rows = || latent.iter().map(|samples| samples.z.row(row));
    let n = rows().map(|z| z.len()).sum::<usize>().max(1) as f64;
    let mean = rows().map(|z| z.sum()).sum::<f64>() / n;
    let mut square = 0.0;
    rows().for_each(|row| row.iter().for_each(|z| square += (z - mean).powi(2)));
    (square / n).sqrt()
}
