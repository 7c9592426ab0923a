//! Selection of Xi: many candidates, judged by their rollouts on jumps that were not fitted.

use std::collections::BTreeSet;

use super::recipe::RecipePart;
use super::refine::{Coefficients, Refiner};
use super::sparse::Pruning;
use super::weak_form::windowed_samples;
use super::*;

/// Windows (samples) over which the dynamics are integrated before regression; 0 means the accelerations.
const WINDOWS: [usize; 3] = [0, 25, 50];
const SHORT_WINDOWS: [usize; 3] = [0, 10, 25]; // of joints that swing within a step
const RIDGES: [f64; 3] = [1e-4, 1e-3, 1e-2]; // on the normalised columns
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

const LEAST_GAIN: f64 = 0.005; // share of the score that a term must bring to be added
const ATTEMPTS: usize = 60; // terms tried in a round of adding
const ROUNDS: usize = 3; // of adding

type RankedTerm = (f64, usize, usize, usize); // share of the energy; phase, row, column of its term

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Choice {
    pub window: usize,
    pub ridge: f64,
    pub(crate) pruning: Pruning,
    /// Root mean square error, in standard deviations, of predictions over 0.1 s plus 0.2 times that of whole jumps.
    pub score: f64,
    pub active: usize,
}

/// The sparsest of all combinations of windows, ridges and prunings within the slack of the best by `judge`. Returns Xi
/// of every phase, how it was fitted, and the number of candidates. Once there is a best, errors are relative to its
/// own. If cancelled, the search ends as soon as a candidate is stable.
pub(super) fn select(
    set: EncodedSet<'_>,
    (knowledge, mirror): (&[Knowledge], &Mirror),
    judge: &Judge<'_>,
    options: &RegressionOptions,
    monitor: &mut Monitor<'_>,
) -> Result<(Vec<Xi>, Choice, usize)> {
    let features = judge.features;
    let lengths = match knowledge.iter().any(Knowledge::has_swings) {
        true => SHORT_WINDOWS,
        false => WINDOWS,
    };
    let regressions = &lengths.map(|window| {
        let phases = 0..knowledge.len();
        let of_phase = |(phase, knowledge): (usize, &Knowledge)| {
            let (theta, ddz) = windowed_samples(set, features, phase, window);
            Regression::new(&theta, &ddz, knowledge.clone())
        };
        let each = phases.zip(knowledge).map(of_phase).collect();
        (window, each)
    });
    let growth = &Growth::of_jumps(options.growth_per_s, set, features);
    let refiner = Refiner {
        knowledge,
        mirror,
        growth,
        training: judge,
        judge,
    };
    let windows = match options.has(RecipePart::Windows) {
        true => &regressions[..],
        false => &regressions[..1],
    };
    let mut tried = refiner.try_all(windows, monitor);
    let candidates = tried.len();
    let reference = best_of(&tried)?.now.xi.clone();
    let (mut training, mut relative) = (judge.over(set), judge.clone());
    if options.has(RecipePart::RelativeErrors) {
        for judge in [&mut training, &mut relative] {
            *judge = judge.relative_to(&reference);
        }
    }
    for trial in tried.iter_mut().filter(|trial| trial.is_stable()) {
        trial.score_by(&relative);
    }
    let limit = (1.0 + options.slack) * best_of(&tried)?.now.score;
    let refiner = Refiner {
        training: &training,
        judge: &relative,
        ..refiner
    };
    let mut refined = Vec::new();
    for mut trial in starts(tried, limit) {
        trial.hold(growth, mirror);
        trial.score_by(&relative);
        if options.has(RecipePart::Sweep) {
            refiner.sweep(&mut trial, limit, monitor);
        }
        trial.now = refiner.refine(trial.now, options.refinements, monitor);
        refined.push(trial);
    }
    let mut chosen = sparsest(refined, &refiner, options, monitor)?;
    mirror.copy(&mut chosen.now.xi);
    chosen.score_by(judge);
    let choice = Choice {
        window: chosen.window,
        ridge: chosen.ridge,
        pruning: chosen.pruning,
        score: chosen.now.score,
        active: chosen.now.active(),
    };
    Ok((chosen.now.xi, choice, candidates))
}

/// Of the best refined candidate, thinned, and all others within the slack, the one with fewest terms.
fn sparsest<'a>(
    mut refined: Vec<Trial<'a>>,
    refiner: &Refiner<'_>,
    options: &RegressionOptions,
    monitor: &mut Monitor<'_>,
) -> Result<Trial<'a>> {
    let candidates = refined.len();
    let best = best_of(&refined)?;
    let limit = (1.0 + options.slack) * best.now.score;
    if options.refinements > 0 && options.has(RecipePart::Thinning) {
        let mut thinned = best.clone();
        thinned.now = refiner.thin(thinned.now, limit, monitor);
        refined.push(thinned);
    }
    let all = refined.into_iter();
    let within = all.filter(|trial| trial.now.score <= limit);
    let sparsest = within.min_by_key(|trial| trial.now.active());
    sparsest.ok_or(TrainError::NoStableModel { candidates })
}

#[derive(Clone)]
struct Trial<'a> {
    now: Coefficients,
    regressions: &'a [Regression],
    ridge: f64,
    window: usize,
    pruning: Pruning,
}

impl Trial<'_> {
    fn is_stable(&self) -> bool {
        self.now.score.is_finite()
    }

    fn score_by(&mut self, judge: &Judge<'_>) {
        self.now.score = judge.score_within(&self.now.xi, f64::MAX);
    }

    /// Changes the coefficients until their growth keeps the bound, the least as the normal equations weigh it.
    fn hold(&mut self, growth: &Growth, mirror: &Mirror) {
        let before = self.now.xi.clone();
        growth.hold(&mut self.now.xi, |gradient| {
            let each = self.regressions.iter().zip(&before).zip(gradient);
            each.map(|((regression, xi), gradient)| regression.change(xi, gradient, self.ridge))
                .collect()
        });
        mirror.copy(&mut self.now.xi);
    }

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

type Regressions = [(usize, Vec<Regression>)]; // of every phase, for each of the windows

impl Refiner<'_> {
    /// All combinations. If there are nonlinear terms to choose, also those without them, and the best of these grown
    /// by such terms, because rollouts of full libraries often diverge.
    fn try_all<'r>(
        &self,
        regressions: &'r Regressions,
        monitor: &mut Monitor<'_>,
    ) -> Vec<Trial<'r>> {
        let affine = &self.judge.features.affine;
        let keeps = |known: &Knowledge, term| known.kept.row(term).iter().any(|kept| *kept);
        let is_chosen = |term| !self.knowledge.iter().any(|known| keeps(known, term));
        let has_nonlinear = (0..affine.len()).any(|term| !affine[term] && is_chosen(term));
        // The affine terms are still to come where full libraries diverge.
        let enough =
            |tried: &[Trial<'_>]| any_stable(tried) || (has_nonlinear && !tried.is_empty());
        let mut tried = self.fit_all(regressions, &vec![true; affine.len()], enough, monitor);
        if has_nonlinear && !(monitor.cancelled() && any_stable(&tried)) {
            let tame = self.fit_all(regressions, affine, any_stable, monitor);
            let mut grown = best_of(&tame).ok().cloned();
            if let Some(grown) = &mut grown {
                self.grow(grown, monitor);
            }
            tried.extend(tame);
            tried.extend(grown);
        }
        tried
    }

    /// All combinations with the terms that are `allowed`; if cancelled, those until there are `enough`.
    fn fit_all<'r>(
        &self,
        regressions: &'r Regressions,
        allowed: &[bool],
        enough: impl Fn(&[Trial<'_>]) -> bool,
        monitor: &mut Monitor<'_>,
    ) -> Vec<Trial<'r>> {
        let mut tried = Vec::new();
        let has = |part| self.knowledge.iter().all(|known| known.has(part));
        let is_tried = |pruning: &Pruning| match pruning {
            Pruning::Elimination(_) => true,
            Pruning::Threshold(_) => has(RecipePart::Thresholds),
        };
        let prunings: Vec<_> = PRUNINGS.into_iter().filter(is_tried).collect();
        let combinations = regressions.len() * RIDGES.len() * prunings.len();
        monitor.stage("fitting the dynamics", combinations);
        for &(window, ref regressions) in regressions {
            for ridge in RIDGES {
                if monitor.cancelled() && enough(&tried) {
                    return tried;
                }
                let each = regressions.iter();
                let fits = each.map(|regression| regression.fit_each(ridge, &prunings, allowed));
                let fits: Vec<Vec<Xi>> = fits.collect();
                for (number, pruning) in prunings.iter().copied().enumerate() {
                    let mut xi: Vec<_> = fits.iter().map(|phase| phase[number].clone()).collect();
                    self.mirror.copy(&mut xi);
                    if tried.iter().any(|trial: &Trial<'_>| trial.now.xi == xi) {
                        monitor.step();
                        continue;
                    }
                    let score = self.judge.score_within(&xi, f64::MAX);
                    let mut trial = Trial {
                        now: Coefficients { xi, score },
                        regressions,
                        ridge,
                        window,
                        pruning,
                    };
                    if !trial.is_stable() {
                        trial.hold(self.growth, self.mirror);
                        trial.score_by(self.judge);
                    }
                    let (active, score) = (trial.now.active(), trial.now.score);
                    monitor.done(format!("{active} terms, score {score:.4}"));
                    tried.push(trial);
                }
            }
        }
        tried
    }

    /// Drops terms, the least useful to the regression first, as long as the score stays within `limit`.
    fn sweep(&self, trial: &mut Trial<'_>, limit: f64, monitor: &mut Monitor<'_>) {
        let mut order = trial.places(Regression::losses);
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        monitor.stage("dropping terms that predictions do not miss", order.len());
        for place in order {
            if monitor.cancelled() {
                return;
            }
            self.attempt(trial, place, false, limit);
            monitor.done(format!("score {:.4}", trial.now.score));
        }
    }

    /// Adds terms that explain most of the accelerations wherever the score falls by [`LEAST_GAIN`] or more.
    fn grow(&self, trial: &mut Trial<'_>, monitor: &mut Monitor<'_>) {
        monitor.stage("adding terms that predictions gain by", ROUNDS * ATTEMPTS);
        for _ in 0..ROUNDS {
            let before = trial.now.score;
            let mut order = trial.places(Regression::gains);
            order.sort_by(|a, b| b.0.total_cmp(&a.0));
            for place in order.into_iter().take(ATTEMPTS) {
                if monitor.cancelled() {
                    return;
                }
                self.attempt(trial, place, true, (1.0 - LEAST_GAIN) * trial.now.score);
                monitor.done(format!("score {:.4}", trial.now.score));
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
        let score = self.score_within(xi, limit);
        if score <= limit {
            trial.now.score = score;
        } else {
            xi[phase].set_column(column, &before);
        }
    }
}

fn any_stable(tried: &[Trial<'_>]) -> bool {
    tried.iter().any(Trial::is_stable)
}

fn best_of<'t, 'a>(tried: &'t [Trial<'a>]) -> Result<&'t Trial<'a>> {
    let best = (tried.iter().filter(|trial| trial.is_stable()))
        .min_by(|a, b| a.now.score.total_cmp(&b.now.score));
    best.ok_or(TrainError::NoStableModel {
        candidates: tried.len(),
    })
}

/// At most [`SWEEPS`]: the best of every window, then all others within the limit, best first.
fn starts<'a>(mut tried: Vec<Trial<'a>>, limit: f64) -> impl Iterator<Item = Trial<'a>> {
    tried.retain(|trial| trial.now.score <= limit);
    tried.sort_by(|a, b| a.now.score.total_cmp(&b.now.score));
    let mut seen = BTreeSet::new();
    let (first, later): (Vec<_>, Vec<_>) =
        (tried.into_iter()).partition(|trial| seen.insert(trial.window));
    first.into_iter().chain(later).take(SWEEPS)
}
