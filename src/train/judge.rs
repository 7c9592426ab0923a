//! Scores of candidate dynamics: the error of their rollouts on a set of jumps.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::dataset::Dataset;
use super::latent::Latent;
use super::rollout::{Candidate, Change, Window, predict, predict_changed, restarted, whole};

/// Samples between errors that coefficients are refined by.
const THINNED: usize = 5;
/// Samples of a part, of which there are several only for more recordings than fit into little memory.
const PART: usize = 32_768;
/// Kinds of windows: 0.1 s, and whole jumps.
const SHORT: usize = 0;
const LONG: usize = 1;

/// Samples to judge candidates on.
pub struct Judge<'a> {
    dataset: &'a Dataset,
    latent: &'a [Latent],
    windows: [Vec<Window>; 2],     // short and long
    parts: Vec<[Range<usize>; 2]>, // those of consecutive jumps
    inverse_std: Vec<f64>,
    rollout_weight: f64,
}

impl<'a> Judge<'a> {
    /// Judges on these jumps.
    pub fn new(dataset: &'a Dataset, latent: &'a [Latent], rollout_weight: f64) -> Self {
        Self::in_parts(dataset, latent, rollout_weight, PART)
    }

    fn in_parts(
        dataset: &'a Dataset,
        latent: &'a [Latent],
        rollout_weight: f64,
        samples: usize,
    ) -> Self {
        let d = latent.first().map_or(0, |first| first.z.nrows());
        let inverse_std = (0..d)
            .map(|row| 1.0 / row_std(latent, row).max(f64::MIN_POSITIVE))
            .collect();
        let windows = [restarted(dataset, 0.1), whole(dataset)];
        let of_jumps = |windows: &Vec<Window>, jumps: &Range<usize>| {
            let before = |jump| windows.partition_point(|window| window.jump < jump);
            before(jumps.start)..before(jumps.end)
        };
        let parts = parts_of(dataset, samples)
            .map(|jumps| windows.each_ref().map(|windows| of_jumps(windows, &jumps)));
        Self {
            parts: parts.collect(),
            dataset,
            latent,
            windows,
            inverse_std,
            rollout_weight,
        }
    }

    /// Score of a candidate, see [`Choice::score`](super::select::Choice::score); infinite if a rollout diverges.
    pub fn score(&self, candidate: Candidate<'_>) -> f64 {
        let short = self.error(candidate, SHORT);
        if !short.is_finite() || self.rollout_weight == 0.0 {
            return short;
        }
        short + self.rollout_weight * self.error(candidate, LONG)
    }

    /// Parts that [`Self::errors`] can be asked for, one by one so that few predictions are held at a time.
    pub fn parts(&self) -> Range<usize> {
        0..self.parts.len()
    }

    /// For the candidate with each of the `changes`, one at a time: errors of 0.1 s predictions and of whole jumps of a
    /// part in standard deviations, every [`THINNED`]th sample; none if a rollout diverges.
    pub fn errors(
        &self,
        candidate: Candidate<'_>,
        changes: &[Option<Change>],
        part: usize,
    ) -> Option<Vec<[DVector<f64>; 2]>> {
        let of_kind = |kind: usize| {
            let windows = &self.windows[kind][self.parts[part][kind].clone()];
            self.errors_over(candidate, changes, windows)
        };
        let (short, long) = (of_kind(SHORT), of_kind(LONG));
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

    fn error(&self, candidate: Candidate<'_>, kind: usize) -> f64 {
        let (mut square, mut count) = (0.0, 0);
        for part in &self.parts {
            let windows = &self.windows[kind][part[kind].clone()];
            let predictions = predict(candidate, self.dataset, self.latent, windows);
            for (window, prediction) in windows.iter().zip(&predictions) {
                let truth = self.latent[window.jump]
                    .z
                    .columns(window.start + 1, window.steps);
                for (row, scale) in self.inverse_std.iter().enumerate() {
                    square += (prediction.row(row) - truth.row(row)).norm_squared() * scale * scale;
                }
                count += prediction.len();
            }
        }
        let error = (square / count.max(1) as f64).sqrt();
        if error.is_finite() {
            error
        } else {
            f64::INFINITY
        }
    }
}

/// Consecutive jumps of at most so many samples, or of one jump.
fn parts_of(dataset: &Dataset, most: usize) -> impl Iterator<Item = Range<usize>> {
    let mut next = 0;
    std::iter::from_fn(move || {
        let start = next;
        let mut samples = 0;
        while let Some(jump) = dataset.jumps.get(next) {
            samples += jump.len();
            if next > start && samples > most {
                break;
            }
            next += 1;
        }
        (next > start).then_some(start..next)
    })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::oscillator;

    #[test]
    fn errors_in_parts_are_those_of_all_jumps_together() {
        let (dataset, latent) = oscillator::jumps(5);
        let (features, truth) = oscillator::known();
        let off: Vec<_> = truth.iter().map(|xi| xi.map(|c| 1.1 * c)).collect();
        let candidate = Candidate {
            features: &features,
            xi: &off,
        };
        let change = Some(Change {
            place: (0, 1, 0),
            by: 0.01,
        });
        let together = Judge::new(&dataset, &latent, 0.2);
        assert_eq!(together.parts(), 0..1);
        let all = together.errors(candidate, &[None, change], 0);
        let all = all.expect("no rollout diverges");
        assert_ne!(all[0], all[1]);
        for (samples, n_parts) in [(2 * dataset.jumps[0].len(), 3), (1, 5)] {
            let judge = Judge::in_parts(&dataset, &latent, 0.2, samples);
            assert_eq!(judge.parts(), 0..n_parts);
            let parts = judge.parts().map(|part| {
                let errors = judge.errors(candidate, &[None, change], part);
                errors.expect("no rollout diverges")
            });
            let parts: Vec<_> = parts.collect();
            for (moved, all) in all.iter().enumerate() {
                for (kind, all) in all.iter().enumerate() {
                    let found = parts.iter().flat_map(|part| part[moved][kind].iter());
                    assert!(found.eq(all.iter()), "{samples} samples, kind {kind}");
                }
            }
            let (score, whole) = (judge.score(candidate), together.score(candidate));
            assert!((score - whole).abs() < 1e-12 * whole, "{score} of {whole}");
        }
    }
}
