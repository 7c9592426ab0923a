//! Scores of candidate dynamics: the error of their rollouts on a set of jumps.

use super::rollout::predict_changed;
use super::*;

const ROLLOUT_WEIGHT: f64 = 0.2; // of whole-jump rollouts against predictions of 0.1 s
const THINNED: usize = 5; // samples between errors that coefficients are refined by
/// Jumps of a part: with all errors at once, their derivatives would fill the memory for sets of many jumps.
const JUMPS: usize = 64;
const TOGETHER: usize = 8; // windows whose changed predictions are computed at once
const LEAST_ERROR: f64 = 1e-3; // in standard deviations; others are relative to at least this
const SHORT: usize = 0; // windows of 0.1 s; LONG: whole jumps
const LONG: usize = 1;

/// A library, and samples to judge its coefficients on (`library_dim x latent_dim` a phase).
#[derive(Clone)]
pub(super) struct Judge<'a> {
    pub features: &'a Features,
    set: EncodedSet<'a>,
    windows: [Vec<Window>; 2], // short and long
    scales: [Vec<f64>; 2],     // factors on errors; one number for each coordinate that counts
}

impl<'a> Judge<'a> {
    /// Over whole jumps the first `long` coordinates count.
    pub(super) fn new(features: &'a Features, set: EncodedSet<'a>, long: usize) -> Self {
        let inverse_std = |count: usize| {
            let inverse = |row| 1.0 / row_std(set.latent, row).max(f64::MIN_POSITIVE);
            (0..count).map(inverse).collect()
        };
        Self {
            features,
            set,
            windows: [Restart::Every(0.1), Restart::Never].map(|every| windows(set.dataset, every)),
            scales: [set.latent_dim(), long].map(inverse_std),
        }
    }

    /// The same score of predictions on other jumps.
    pub(super) fn over(&self, set: EncodedSet<'a>) -> Self {
        Self::new(self.features, set, self.scales[LONG].len())
    }

    /// Judges by errors relative to those of `xi`: a tenth less counts alike for a body that jumps 0.5 m and a leg.
    pub(super) fn relative_to(&self, xi: &[Xi]) -> Self {
        let mut relative = self.clone();
        for kind in [SHORT, LONG] {
            let squares = self.mean_squares(xi, kind);
            for (scale, square) in relative.scales[kind].iter_mut().zip(&squares) {
                let error = square.sqrt().max(LEAST_ERROR / *scale);
                if error.is_finite() {
                    *scale = 1.0 / error;
                }
            }
        }
        relative
    }

    /// Score of coefficients, see [`Choice::score`](super::select::Choice::score), infinite if a rollout diverges; or a
    /// number above `limit` if it is: whole jumps are left out if 0.1 s are enough to know.
    pub(super) fn score_within(&self, xi: &[Xi], limit: f64) -> f64 {
        let short = self.error(xi, SHORT);
        if short > limit {
            return short;
        }
        short + ROLLOUT_WEIGHT * self.error(xi, LONG)
    }

    /// Parts that [`Self::errors`] can be asked for, one by one so that few predictions are held at a time.
    pub(super) fn parts(&self) -> Range<usize> {
        0..self.set.dataset.jumps.len().div_ceil(JUMPS)
    }

    /// Scaled errors of both kinds of windows of a part, every [`THINNED`]th sample; none if a rollout diverges.
    pub(super) fn errors(&self, xi: &[Xi], part: usize) -> Option<[DVector<f64>; 2]> {
        let errors = [SHORT, LONG].map(|kind| {
            let mut errors = Vec::new();
            for (window, prediction) in self.predictions(xi, part, kind) {
                self.add_errors(kind, window, &prediction, &mut errors);
            }
            DVector::from_vec(errors)
        });
        are_finite(&errors).then_some(errors)
    }

    pub(super) fn errors_changed(
        &self,
        xi: &[Xi],
        changes: &[Change],
        part: usize,
    ) -> Option<Vec<[DVector<f64>; 2]>> {
        let features = self.features;
        let candidate = Candidate { features, xi };
        let of_kind = |kind: usize| {
            let mut errors = vec![Vec::new(); changes.len()];
            for windows in self.windows_of(part, kind).chunks(TOGETHER) {
                let predictions = predict_changed(candidate, changes, self.set, windows);
                for (window, predictions) in windows.iter().zip(&predictions) {
                    for (errors, prediction) in errors.iter_mut().zip(predictions) {
                        self.add_errors(kind, window, prediction, errors);
                    }
                }
            }
            errors.into_iter().map(DVector::from_vec)
        };
        let pairs = of_kind(SHORT).zip(of_kind(LONG));
        let finite = |errors: [DVector<f64>; 2]| are_finite(&errors).then_some(errors);
        pairs.map(|(short, long)| finite([short, long])).collect()
    }

    fn predictions(
        &self,
        xi: &[Xi],
        part: usize,
        kind: usize,
    ) -> impl Iterator<Item = (&Window, DMatrix<f64>)> {
        let (windows, features) = (self.windows_of(part, kind), self.features);
        let predictions = predict(Candidate { features, xi }, self.set, &plain(windows));
        windows.iter().zip(predictions)
    }

    fn windows_of(&self, part: usize, kind: usize) -> &[Window] {
        let windows = &self.windows[kind];
        let before = |jump| windows.partition_point(|window| window.jump < jump);
        &windows[before(part * JUMPS)..before((part + 1) * JUMPS)]
    }

    fn add_errors(
        &self,
        kind: usize,
        window: &Window,
        prediction: &DMatrix<f64>,
        errors: &mut Vec<f64>,
    ) {
        let z = &self.set.latent[window.jump].z;
        for step in (THINNED - 1..window.steps).step_by(THINNED) {
            for (row, scale) in self.scales[kind].iter().enumerate() {
                let truth = z[(row, window.start + 1 + step)];
                errors.push((prediction[(row, step)] - truth) * scale);
            }
        }
    }

    /// Root mean square of the scaled errors; infinite if a rollout diverges.
    fn error(&self, xi: &[Xi], kind: usize) -> f64 {
        let squares = self.mean_squares(xi, kind);
        let scaled = squares.iter().zip(&self.scales[kind]);
        let sum: f64 = scaled.map(|(square, scale)| square * scale * scale).sum();
        let error = (sum / squares.len().max(1) as f64).sqrt();
        if error.is_finite() {
            error
        } else {
            f64::INFINITY
        }
    }

    fn mean_squares(&self, xi: &[Xi], kind: usize) -> Vec<f64> {
        let (mut squares, mut count) = (vec![0.0; self.scales[kind].len()], 0);
        for part in self.parts() {
            for (window, prediction) in self.predictions(xi, part, kind) {
                let z = &self.set.latent[window.jump].z;
                let truth = z.columns(window.start + 1, window.steps);
                for (row, square) in squares.iter_mut().enumerate() {
                    *square += (prediction.row(row) - truth.row(row)).norm_squared();
                }
                count += window.steps;
            }
        }
        let means = squares.iter().map(|square| square / count.max(1) as f64);
        means.collect()
    }
}

fn are_finite(errors: &[DVector<f64>; 2]) -> bool {
    errors.iter().flatten().all(|error| error.is_finite())
}

fn row_std(latent: &[Latent], row: usize) -> f64 {
    let rows = || latent.iter().map(|samples| samples.z.row(row));
    let n = rows().map(|z| z.len()).sum::<usize>().max(1) as f64;
    let mean = rows().map(|z| z.sum()).sum::<f64>() / n;
    let mut square = 0.0;
    rows().for_each(|row| row.iter().for_each(|z| square += (z - mean).powi(2)));
    (square / n).sqrt()
}
