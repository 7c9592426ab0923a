//! Scores of candidate dynamics: the error of their rollouts on a set of jumps.

use nalgebra::{DMatrix, DVector};

use super::dataset::Dataset;
use super::latent::Latent;
use super::rollout::{Candidate, Change, Window, predict, predict_changed, restarted, whole};

/// Samples between errors that coefficients are refined by.
const THINNED: usize = 5;

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

    /// For the candidate with each of the `changes`, one at a time: errors of 0.1 s predictions and of whole jumps in
    /// standard deviations, every [`THINNED`]th sample; none if a rollout diverges.
    pub fn errors(
        &self,
        candidate: Candidate<'_>,
        changes: &[Option<Change>],
    ) -> Option<Vec<[DVector<f64>; 2]>> {
        let of_kind = |windows| self.errors_over(candidate, changes, windows);
        let (short, long) = (of_kind(&self.short), of_kind(&self.long));
        let pairs = short
            .into_iter()
            .zip(long)
            .map(|(short, long)| [short, long]);
        let finite =
            |pair: &[DVector<f64>; 2]| pair.iter().flatten().all(|error| error.is_finite());
        pairs.map(|pair| finite(&pair).then_some(pair)).collect()
    }

    fn errors_over(
        &self,
        candidate: Candidate<'_>,
        changes: &[Option<Change>],
        windows: &[Window],
    ) -> Vec<DVector<f64>> {
        let each = changes
            .iter()
            .flat_map(|change| vec![*change; windows.len()]);
        let repeated = windows.repeat(changes.len());
        let changed: Vec<_> = each.collect();
        let predictions =
            predict_changed(candidate, &changed, self.dataset, self.latent, &repeated);
        let errors_of = |predictions: &[DMatrix<f64>]| {
            let mut errors = Vec::new();
            for (window, prediction) in windows.iter().zip(predictions) {
                let z = &self.latent[window.jump].z;
                for step in (THINNED - 1..window.steps).step_by(THINNED) {
                    for (row, scale) in self.inverse_std.iter().enumerate() {
                        let truth = z[(row, window.start + 1 + step)];
                        errors.push((prediction[(row, step)] - truth) * scale);
                    }
                }
            }
            DVector::from_vec(errors)
        };
        predictions.chunks(windows.len()).map(errors_of).collect()
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
