//! Choosing Xi: many candidates, judged by what their rollouts predict on jumps that were not fitted.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::dataset::Dataset;
use super::error::TrainError;
use super::features::Features;
use super::latent::Latent;
use super::options::RegressionOptions;
use super::progress::Watch;
use super::rollout::{Candidate, Window, predict, restarted, whole};
use super::sparse::{Pruning, Regression, active_terms};
use super::weak::windowed_samples;

/// How a candidate was fitted, and how it did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// Window of the regression in samples, 0 for accelerations.
    pub window: usize,
    /// Ridge.
    pub ridge: f64,
    /// Pruning.
    pub pruning: Pruning,
    /// Validation score: root mean square error of the latent state in standard deviations, of 0.1 s predictions
    /// plus `rollout_weight` times that of whole jumps.
    pub score: f64,
    /// Active terms over all phases.
    pub active: usize,
}

/// Xi of every phase, and the choice that made it.
#[derive(Clone, Debug)]
pub struct Selected {
    /// `library_dim x latent_dim` a phase.
    pub xi: Vec<DMatrix<f64>>,
    /// The settings chosen.
    pub choice: Choice,
    /// How many candidates were tried.
    pub candidates: usize,
}

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

    /// Score of a candidate, see [`Choice::score`]; infinite if a rollout diverges.
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

/// Fits all combinations of the options and takes, among those within the slack of the best, the sparsest.
///
/// # Errors
/// [`TrainError::NoStableModel`] if every candidate diverges, [`TrainError::Cancelled`] if cancelled before the first.
pub fn select(
    dataset: &Dataset,
    latent: &[Latent],
    features: &Features,
    judge: &Judge<'_>,
    options: &RegressionOptions,
    watch: &mut Watch<'_>,
) -> Result<Selected, TrainError> {
    let mut tried: Vec<(Vec<DMatrix<f64>>, Choice)> = Vec::new();
    let total = options.windows.len() * options.ridges.len() * options.prunings.len();
    watch.stage("fitting the dynamics", total);
    for &window in &options.windows {
        let regressions: Vec<Regression> = (0..dataset.phases.patterns.len())
            .map(|phase| {
                let (theta, target) = windowed_samples(dataset, latent, features, phase, window);
                Regression::new(&theta, &target)
            })
            .collect();
        for &ridge in &options.ridges {
            for &pruning in &options.prunings {
                if watch.cancelled() {
                    return best_of(tried, options.slack);
                }
                let xi: Vec<_> = regressions
                    .iter()
                    .map(|regression| regression.fit(ridge, pruning))
                    .collect();
                let score = judge.score(Candidate { features, xi: &xi });
                let active = xi.iter().map(active_terms).sum();
                watch.done(tried.len() + 1, format!("{active} terms, score {score:.4}"));
                tried.push((
                    xi,
                    Choice {
                        window,
                        ridge,
                        pruning,
                        score,
                        active,
                    },
                ));
            }
        }
    }
    best_of(tried, options.slack)
}

fn best_of(tried: Vec<(Vec<DMatrix<f64>>, Choice)>, slack: f64) -> Result<Selected, TrainError> {
    let candidates = tried.len();
    if candidates == 0 {
        return Err(TrainError::Cancelled);
    }
    let best = tried
        .iter()
        .map(|(_, choice)| choice.score)
        .fold(f64::INFINITY, f64::min);
    let (xi, choice) = tried
        .into_iter()
        .filter(|(_, choice)| choice.score.is_finite() && choice.score <= (1.0 + slack) * best)
        .min_by(|(_, a), (_, b)| a.active.cmp(&b.active).then(a.score.total_cmp(&b.score)))
        .ok_or(TrainError::NoStableModel { candidates })?;
    Ok(Selected {
        xi,
        choice,
        candidates,
    })
}

fn row_std(latent: &[Latent], row: usize) -> f64 {
    let n = latent
        .iter()
        .map(|samples| samples.z.ncols())
        .sum::<usize>()
        .max(1) as f64;
    let mean = latent
        .iter()
        .map(|samples| samples.z.row(row).sum())
        .sum::<f64>()
        / n;
    let square: f64 = latent
        .iter()
        .flat_map(|samples| {
            samples
                .z
                .row(row)
                .iter()
                .map(|z| (z - mean).powi(2))
                .collect::<Vec<_>>()
        })
        .sum();
    (square / n).sqrt()
}
