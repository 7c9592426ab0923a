//! Choosing Xi: many candidates, judged by what their rollouts predict on jumps that were not fitted.

use nalgebra::DMatrix;
use serde::Serialize;

use super::error::TrainError;
use super::features::Features;
use super::growth::Growth;
use super::judge::Judge;
use super::knowledge::Knowledge;
use super::latent::EncodedSet;
use super::options::RegressionOptions;
use super::progress::Watch;
use super::prune::Refined;
use super::refine::{Coefficients, Refiner};
use super::sparse::{Pruning, Regression, active_terms};
use super::weak_form::{check_terms, windowed_samples};

/// Windows (samples) over which the dynamics are integrated before regression; 0 means the accelerations.
const WINDOWS: [usize; 3] = [0, 25, 50];
/// Ridges on the normalised columns.
const RIDGES: [f64; 3] = [1e-4, 1e-3, 1e-2];
/// Prunings; eliminations share the walk that drops terms one by one.
const PRUNINGS: [Pruning; 10] = [
    Pruning::Elimination(1e-3),
    Pruning::Elimination(3e-3),
    Pruning::Elimination(1e-2),
    Pruning::Elimination(2e-2),
    Pruning::Elimination(3e-2),
    Pruning::Elimination(5e-2),
    Pruning::Threshold(0.0),
    Pruning::Threshold(0.03),
    Pruning::Threshold(0.1),
    Pruning::Threshold(0.2),
];
/// How many candidates are pruned further, a term at a time, while their score stays within the slack.
const SWEEPS: usize = 3;

/// How a candidate was fitted, and how it did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Choice {
    /// Window of the regression in samples, 0 for accelerations.
    pub window: usize,
    /// Ridge.
    pub ridge: f64,
    /// Pruning.
    pub pruning: Pruning,
    /// Validation score: root mean square error of the latent state in standard deviations, of 0.1 s predictions
    /// plus 0.2 times that of whole jumps.
    pub score: f64,
    /// Active terms over all phases.
    pub active: usize,
}

/// Xi of every phase, and the choice that made it.
#[derive(Clone, Debug)]
pub struct Selected {
    /// `library_dim x latent_dim` for each phase.
    pub xi: Vec<DMatrix<f64>>,
    /// The settings chosen.
    pub choice: Choice,
    /// How many candidates were tried.
    pub candidates: usize,
}

/// What the dynamics are fitted to.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    /// Jumps to fit.
    pub set: EncodedSet<'a>,
    /// The library.
    pub features: &'a Features,
    /// What is known of each phase.
    pub knowledge: &'a [Knowledge],
}

/// Fits all combinations of windows, ridges and prunings and takes, among those within the slack of the best, the
/// sparsest.
///
/// The best by `judge` sets the scale: from there on errors are relative to its own.
///
/// # Errors
/// [`TrainError::TermValue`] for a term without a finite value at a sample,
/// [`TrainError::NoStableModel`] if every candidate diverges. If cancelled, the search ends as soon as one does not.
pub fn select(
    target: Target<'_>,
    judge: &Judge<'_>,
    options: &RegressionOptions,
    watch: &mut Watch<'_>,
) -> Result<Selected, TrainError> {
    let regressions = regressions(target)?;
    let growth = &Growth::of_jumps(options.growth_per_s, target.set, target.features);
    let attempt = Attempt {
        regressions: &regressions,
        growth,
        judge,
    };
    let mut tried = attempt.all(watch);
    let candidates = tried.len();
    let reference = best_of(&tried)?.xi.clone();
    let training = Judge::new(target.features, target.set).relative_to(&reference);
    let relative = judge.relative_to(&reference);
    for fitted in tried.iter_mut().filter(|fitted| fitted.is_stable()) {
        fitted.choice.score = relative.score(&fitted.xi);
    }
    let limit = (1.0 + options.slack) * best_of(&tried)?.choice.score;
    let refiner = Refiner {
        knowledge: target.knowledge,
        growth,
        training: &training,
        judge: &relative,
    };
    let mut refined = Vec::new();
    for start in starts(tried, limit) {
        let Fitted {
            mut xi,
            choice,
            window,
        } = start;
        hold(growth, &regressions[window], choice.ridge, &mut xi);
        let mut pruned = Refined {
            regressions: &regressions[window],
            ridge: choice.ridge,
            growth,
            judge: &relative,
            now: Coefficients {
                score: relative.score(&xi),
                xi,
            },
        };
        pruned.sweep(limit, watch);
        let end = refiner.refine(pruned.now, options.refinements, watch);
        refined.push(Fitted::of(end, &choice, window));
    }
    let best = best_of(&refined)?;
    let limit = (1.0 + options.slack) * best.choice.score;
    if options.refinements > 0 {
        let thinned = refiner.thin(best.coefficients(), limit, watch);
        let thinned = Fitted::of(thinned, &best.choice, best.window);
        refined.push(thinned);
    }
    let all = refined.into_iter();
    let within = all.filter(|fitted| fitted.choice.score <= limit);
    let sparsest = within.min_by_key(|fitted| fitted.choice.active);
    let Fitted { xi, mut choice, .. } = sparsest.ok_or(TrainError::NoStableModel { candidates })?;
    choice.score = judge.score(&xi);
    Ok(Selected {
        xi,
        choice,
        candidates,
    })
}

/// Changes the coefficients of regressions until their growth keeps the bound, the least as their normal equations weigh
/// it.
fn hold(growth: &Growth, regressions: &[Regression], ridge: f64, xi: &mut [DMatrix<f64>]) {
    let before = xi.to_vec();
    growth.hold(xi, |gradient| {
        let each = regressions.iter().zip(&before).zip(gradient);
        each.map(|((regression, xi), gradient)| regression.change(xi, gradient, ridge))
            .collect()
    });
}

/// For every window the regression of every phase.
fn regressions(target: Target<'_>) -> Result<[Vec<Regression>; WINDOWS.len()], TrainError> {
    let (set, features) = (target.set, target.features);
    check_terms(set, features)?;
    Ok(WINDOWS.map(|window| {
        let of_phase = |(phase, knowledge): (usize, &Knowledge)| {
            let (theta, ddz) = windowed_samples(set, features, phase, window);
            Regression::new(&theta, &ddz, knowledge.clone())
        };
        target.knowledge.iter().enumerate().map(of_phase).collect()
    }))
}

/// A candidate that was fitted and judged.
struct Fitted {
    xi: Vec<DMatrix<f64>>,
    choice: Choice,
    window: usize, // index into the windows
}

impl Fitted {
    /// Coefficients that began as a candidate's.
    fn of(Coefficients { xi, score }: Coefficients, began: &Choice, window: usize) -> Self {
        let choice = Choice {
            score,
            active: xi.iter().map(active_terms).sum(),
            ..began.clone()
        };
        Self { xi, choice, window }
    }

    /// Whether its rollouts stay finite.
    fn is_stable(&self) -> bool {
        self.choice.score.is_finite()
    }

    fn coefficients(&self) -> Coefficients {
        Coefficients {
            xi: self.xi.clone(),
            score: self.choice.score,
        }
    }
}

/// What candidates are fitted from and judged by.
struct Attempt<'a> {
    regressions: &'a [Vec<Regression>],
    growth: &'a Growth,
    judge: &'a Judge<'a>,
}

impl Attempt<'_> {
    /// Every combination of windows, ridges and prunings; where the library has terms that are not affine, also those without them, and
    /// the best of these grown by such terms: rollouts of full libraries diverge more often than not.
    fn all(&self, watch: &mut Watch<'_>) -> Vec<Fitted> {
        let affine = self.judge.features.affine_terms();
        let has_nonlinear = affine.contains(&false);
        // The affine terms are still to come where full libraries diverge.
        let enough = |tried: &[Fitted]| any_stable(tried) || (has_nonlinear && !tried.is_empty());
        let mut tried = self.fit_all(&vec![true; affine.len()], enough, watch);
        if has_nonlinear && !(watch.cancelled() && any_stable(&tried)) {
            let tame = self.fit_all(&affine, any_stable, watch);
            let grown = self.grown(&tame, watch);
            tried.extend(tame);
            tried.extend(grown);
        }
        tried
    }

    /// Every combination of windows, ridges and prunings with the terms that are `allowed`; if cancelled, those until there are
    /// `enough`.
    fn fit_all(
        &self,
        allowed: &[bool],
        enough: impl Fn(&[Fitted]) -> bool,
        watch: &mut Watch<'_>,
    ) -> Vec<Fitted> {
        let mut tried = Vec::new();
        let steps = WINDOWS.len() * RIDGES.len() * PRUNINGS.len();
        watch.stage("fitting the dynamics", steps);
        for (window, phases) in self.regressions.iter().enumerate() {
            for ridge in RIDGES {
                if watch.cancelled() && enough(&tried) {
                    return tried;
                }
                let each = phases.iter();
                let fits = each.map(|regression| regression.fit_each(ridge, &PRUNINGS, allowed));
                let fits: Vec<Vec<DMatrix<f64>>> = fits.collect();
                for (number, pruning) in PRUNINGS.into_iter().enumerate() {
                    let mut xi: Vec<_> = fits.iter().map(|phase| phase[number].clone()).collect();
                    let mut score = self.judge.score(&xi);
                    if score.is_infinite() {
                        hold(self.growth, phases, ridge, &mut xi);
                        score = self.judge.score(&xi);
                    }
                    let active = xi.iter().map(active_terms).sum();
                    watch.done(tried.len() + 1, format!("{active} terms, score {score:.4}"));
                    let choice = Choice {
                        window: WINDOWS[window],
                        ridge,
                        pruning,
                        score,
                        active,
                    };
                    tried.push(Fitted { xi, choice, window });
                }
            }
        }
        tried
    }

    /// The best of these with terms added that its predictions gain by; none if they all diverge.
    fn grown(&self, tame: &[Fitted], watch: &mut Watch<'_>) -> Option<Fitted> {
        let best = best_of(tame).ok()?;
        let mut refined = Refined {
            regressions: &self.regressions[best.window],
            ridge: best.choice.ridge,
            growth: self.growth,
            judge: self.judge,
            now: best.coefficients(),
        };
        refined.grow(watch);
        Some(Fitted::of(refined.now, &best.choice, best.window))
    }
}

/// Whether the rollouts of a candidate stay finite.
fn any_stable(tried: &[Fitted]) -> bool {
    tried.iter().any(Fitted::is_stable)
}

/// The candidate with the best score.
fn best_of(tried: &[Fitted]) -> Result<&Fitted, TrainError> {
    let best = (tried.iter().filter(|fitted| fitted.is_stable()))
        .min_by(|a, b| a.choice.score.total_cmp(&b.choice.score));
    best.ok_or(TrainError::NoStableModel {
        candidates: tried.len(),
    })
}

/// Candidates to prune and refine, at most [`SWEEPS`]: of every window the one with the best score, then all others
/// within the limit, best first.
fn starts(mut tried: Vec<Fitted>, limit: f64) -> impl Iterator<Item = Fitted> {
    tried.retain(|fitted| fitted.choice.score <= limit);
    tried.sort_by(|a, b| a.choice.score.total_cmp(&b.choice.score));
    let mut seen = [false; WINDOWS.len()];
    let ranked = tried.into_iter().map(|fitted| {
        let is_later = std::mem::replace(&mut seen[fitted.window], true);
        (is_later, fitted)
    });
    let mut ranked: Vec<(bool, Fitted)> = ranked.collect();
    ranked.sort_by_key(|(is_later, _)| *is_later);
    let first = ranked.into_iter().take(SWEEPS);
    first.map(|(_, fitted)| fitted)
}
