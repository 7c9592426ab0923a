//! Refining coefficients by what their rollouts predict: Gauss-Newton on the errors of 0.1 s predictions and of whole
//! jumps, from the coefficients of a regression.
//!
//! A regression fits accelerations, each sample for itself, so nothing bounds what its errors add up to. Predictions
//! of whole jumps do: coefficients under which a phase, or the sequence of phases, runs away predict badly (the
//! prediction-error method, Ljung, System Identification, 2nd ed. 1999, section 7.2).

use nalgebra::{DMatrix, DVector};

use super::growth::Growth;
use super::judge::Judge;
use super::knowledge::Knowledge;
use super::progress::Watch;
use super::rollout::Change;
use super::sparse::active_terms;

/// Weight of relative changes of the coefficients, against squared errors that start at 1 for both kinds of windows.
pub(super) const PRIOR: f64 = 1e-3;
/// Relative step of the difference quotients.
const STEP: f64 = 1e-6;
/// Dampings tried in one step before it is given up.
const ATTEMPTS: usize = 6;
/// Coefficients whose rollouts are computed together.
const TOGETHER: usize = 64;
/// Share of the squared errors that a step must lower them by to be followed by another.
const LEAST_GAIN: f64 = 2e-3;

/// Phase, term and latent coordinate of a coefficient.
pub(super) type Place = (usize, usize, usize);

/// Coefficients of all phases, `library_dim x latent_dim` each, and the score that judges them.
#[derive(Clone, Debug)]
pub(super) struct Coefficients {
    pub xi: Vec<DMatrix<f64>>,
    pub score: f64,
}

impl Coefficients {
    pub(super) fn at(&self, (phase, term, column): Place) -> f64 {
        self.xi[phase][(term, column)]
    }

    /// Coefficients that are not zero.
    pub(super) fn active(&self) -> usize {
        self.xi.iter().map(active_terms).sum()
    }
}

/// What coefficients are refined by.
pub(super) struct Refiner<'a> {
    pub knowledge: &'a [Knowledge],
    /// What the coefficients keep to.
    pub growth: &'a Growth,
    /// Whose errors are lowered.
    pub training: &'a Judge<'a>,
    /// Which of the coefficients on the way are kept.
    pub judge: &'a Judge<'a>,
}

/// The squared errors about some coefficients: `|r + J s|^2` for relative changes `s`.
pub(super) struct Model {
    squared_error: f64,
    pub gram: DMatrix<f64>,
    pub gradient: DVector<f64>,
}

impl Refiner<'_> {
    /// Lowers the errors that `training` measures in at most `steps` steps, and gives the coefficients that `judge`
    /// scores best on the way. Which terms are active does not change, but for those that would drive where they may
    /// only brake, nor do coefficients that are known.
    pub fn refine(&self, start: Coefficients, steps: usize, watch: &mut Watch<'_>) -> Coefficients {
        let places = self.free_places(&start.xi);
        let Some(weights) = self.weights(&start.xi).filter(|_| !places.is_empty()) else {
            return start;
        };
        watch.stage("refining coefficients by rollouts", steps);
        self.descend(start, &places, weights, steps, watch)
    }

    /// Levenberg-Marquardt on relative changes; the coefficients that `judge` scores best.
    fn descend(
        &self,
        start: Coefficients,
        places: &[Place],
        weights: [f64; 2],
        steps: usize,
        watch: &mut Watch<'_>,
    ) -> Coefficients {
        let scales = relative(&start, places);
        let moved = |xi: &[DMatrix<f64>]| {
            let change =
                |(at, scale): (&Place, &f64)| (xi[at.0][(at.1, at.2)] - start.at(*at)) / scale;
            DVector::from_iterator(places.len(), places.iter().zip(&scales).map(change))
        };
        let cost = |squared_error: f64, xi: &[DMatrix<f64>]| {
            squared_error + PRIOR * moved(xi).norm_squared()
        };
        let mut current = start.xi.clone();
        self.admit(&mut current, (places, &scales), Clone::clone);
        let mut best = Coefficients {
            score: self.score(&current),
            xi: current.clone(),
        };
        let mut damping = 1e-3;
        for step in 0..steps {
            if watch.cancelled() {
                break;
            }
            let Some(model) = self.model(&current, places, &scales, weights) else {
                break;
            };
            let before = cost(model.squared_error, &current);
            let gradient = &model.gradient + moved(&current) * PRIOR;
            let lower = (0..ATTEMPTS).find_map(|_| {
                let mut system = model.gram.clone();
                for i in 0..places.len() {
                    system[(i, i)] += PRIOR + damping * model.gram[(i, i)];
                }
                let factor = system.cholesky()?;
                let change = -factor.solve(&gradient);
                let mut trial = current.clone();
                for ((at, scale), change) in places.iter().zip(&scales).zip(change.iter()) {
                    trial[at.0][(at.1, at.2)] += change * scale;
                }
                self.admit(&mut trial, (places, &scales), |gradient| {
                    factor.solve(gradient)
                });
                let squared_error = self.squared_error(&trial, weights);
                let after = squared_error.map_or(f64::INFINITY, |error| cost(error, &trial));
                damping *= if after < before { 0.1 } else { 10.0 };
                (after < before).then_some((trial, after))
            });
            let Some((trial, after)) = lower else {
                break;
            };
            let score = self.score(&trial);
            watch.done(step + 1, format!("score {score:.4}"));
            if score < best.score {
                best = Coefficients {
                    xi: trial.clone(),
                    score,
                };
            }
            current = trial;
            if after > (1.0 - LEAST_GAIN) * before {
                break;
            }
        }
        best
    }

    /// Moves coefficients to where they brake where they may only brake, and keep the bound on growth: the least, where
    /// `inverse` applies that of the matrix which weighs relative changes of the coefficients at `places`.
    fn admit(
        &self,
        xi: &mut [DMatrix<f64>],
        (places, scales): (&[Place], &[f64]),
        inverse: impl Fn(&DVector<f64>) -> DVector<f64>,
    ) {
        self.growth.hold(xi, |gradient| {
            let each = places.iter().zip(scales);
            let relative =
                each.map(|(&(phase, term, k), scale)| gradient[phase][(term, k)] * scale);
            let change = inverse(&DVector::from_iterator(places.len(), relative));
            let mut all: Vec<_> = gradient.iter().map(|each| each.map(|_| 0.0)).collect();
            for ((&(phase, term, k), scale), change) in places.iter().zip(scales).zip(&change) {
                all[phase][(term, k)] = change * scale;
            }
            all
        });
        self.brake(xi);
    }

    /// Coefficients that would drive where they may only brake, set to 0.
    pub(super) fn brake(&self, xi: &mut [DMatrix<f64>]) {
        for (knowledge, xi) in self.knowledge.iter().zip(xi) {
            knowledge.brake(xi);
        }
    }

    /// Score of coefficients, infinite if they grow faster than they may or diverge.
    pub(super) fn score(&self, xi: &[DMatrix<f64>]) -> f64 {
        self.score_within(xi, f64::MAX)
    }

    /// The same, or a number above `limit` if the score is.
    pub(super) fn score_within(&self, xi: &[DMatrix<f64>], limit: f64) -> f64 {
        match self.growth.admits(xi) {
            true => self.judge.score_within(xi, limit),
            false => f64::INFINITY,
        }
    }

    /// Errors of a part, weighted and stacked; none if a rollout diverges.
    fn residual(
        &self,
        xi: &[DMatrix<f64>],
        weights: [f64; 2],
        part: usize,
    ) -> Option<DVector<f64>> {
        Some(stacked(&self.training.errors(xi, part)?, weights))
    }

    /// Squared errors of all parts; none if a rollout diverges.
    fn squared_error(&self, xi: &[DMatrix<f64>], weights: [f64; 2]) -> Option<f64> {
        let of_part = |part| Some(self.residual(xi, weights, part)?.norm_squared());
        self.training.parts().map(of_part).sum()
    }

    /// Weights under which the squared errors of both kinds of windows are 1; none if a rollout diverges.
    pub(super) fn weights(&self, xi: &[DMatrix<f64>]) -> Option<[f64; 2]> {
        let mut squares = [0.0; 2];
        for part in self.training.parts() {
            let errors = self.training.errors(xi, part)?;
            for (square, errors) in squares.iter_mut().zip(&errors) {
                *square += errors.norm_squared();
            }
        }
        Some(squares.map(|square: f64| square.sqrt().max(f64::MIN_POSITIVE).recip()))
    }

    /// The squared errors about `xi`; none if a rollout diverges.
    pub(super) fn model(
        &self,
        xi: &[DMatrix<f64>],
        places: &[Place],
        scales: &[f64],
        weights: [f64; 2],
    ) -> Option<Model> {
        let mut model = Model {
            squared_error: 0.0,
            gram: DMatrix::zeros(places.len(), places.len()),
            gradient: DVector::zeros(places.len()),
        };
        for part in self.training.parts() {
            let residual = self.residual(xi, weights, part)?;
            let mut sensitivity = DMatrix::zeros(residual.len(), places.len());
            for first in (0..places.len()).step_by(TOGETHER) {
                let change = |(&place, scale): (&Place, &f64)| Change {
                    place,
                    by: STEP * scale,
                };
                let each = places.iter().zip(scales).skip(first).take(TOGETHER);
                let changes: Vec<_> = each.map(change).collect();
                let moved = self.training.errors_changed(xi, &changes, part)?;
                for (column, moved) in (first..).zip(&moved) {
                    let difference = stacked(moved, weights) - &residual;
                    sensitivity.set_column(column, &(difference / STEP));
                }
            }
            model.squared_error += residual.norm_squared();
            add_gram(&mut model.gram, &sensitivity);
            model.gradient += sensitivity.tr_mul(&residual);
        }
        Some(model)
    }

    /// Every coefficient that may change.
    pub(super) fn free_places(&self, xi: &[DMatrix<f64>]) -> Vec<Place> {
        let mut places = Vec::new();
        for (phase, (xi, knowledge)) in xi.iter().zip(self.knowledge).enumerate() {
            for column in 0..xi.ncols() {
                for row in 0..xi.nrows() {
                    if xi[(row, column)] != 0.0 && knowledge.free[(row, column)] {
                        places.push((phase, row, column));
                    }
                }
            }
        }
        places
    }
}

/// Errors of both kinds of windows, weighted, one below the other.
fn stacked(errors: &[DVector<f64>; 2], weights: [f64; 2]) -> DVector<f64> {
    let each = errors.iter().zip(weights);
    let values = each.flat_map(|(errors, weight)| errors.iter().map(move |e| e * weight));
    DVector::from_vec(values.collect())
}

/// Adds `A^T A`, whose halves are the same.
fn add_gram(gram: &mut DMatrix<f64>, a: &DMatrix<f64>) {
    for i in 0..a.ncols() {
        for j in 0..=i {
            let product = a.column(i).dot(&a.column(j));
            gram[(i, j)] += product;
            if i != j {
                gram[(j, i)] += product;
            }
        }
    }
}

/// Sizes of the coefficients, which relative changes are relative to.
pub(super) fn relative(coefficients: &Coefficients, places: &[Place]) -> Vec<f64> {
    places.iter().map(|&at| coefficients.at(at).abs()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::oscillator;

    fn refined(xi: Vec<DMatrix<f64>>, knowledge: &[Knowledge]) -> (f64, Coefficients) {
        oscillator::with_refiner(Some(1.0), knowledge, |refiner, watch| {
            let score = refiner.score(&xi);
            (score, refiner.refine(Coefficients { xi, score }, 20, watch))
        })
    }

    #[test]
    fn coefficients_that_are_off_are_brought_back_by_what_they_predict() {
        let (_, truth) = oscillator::known();
        let nothing = vec![Knowledge::nothing(7, 2); 2];
        let off: Vec<_> = truth.iter().map(|xi| xi.map(|c| 1.2 * c)).collect();
        let (before, found) = refined(off, &nothing);
        assert!(found.score < 0.05 * before, "{} of {before}", found.score);
        for (found, truth) in found.xi.iter().zip(&truth) {
            for (found, truth) in found.iter().zip(truth.iter()) {
                assert!(
                    (found - truth).abs() <= 0.1 * truth.abs(),
                    "{found} for {truth}"
                );
            }
        }
    }

    #[test]
    fn coefficients_that_may_only_brake_never_drive() {
        let (_, truth) = oscillator::known();
        let mut knowledge = vec![Knowledge::nothing(7, 2); 2];
        (knowledge[0].braking[(3, 0)], knowledge[1].braking[(0, 1)]) = (true, true);
        let mut start = truth.clone();
        start[0][(3, 0)] = 0.5; // truth is -3
        let (_, found) = refined(start, &knowledge);
        assert!(found.xi[0][(3, 0)] <= 0.0, "{}", found.xi[0]);
        let mut driven = vec![Knowledge::nothing(7, 2); 2];
        driven[0].braking[(6, 1)] = true; // truth is 8
        let (_, found) = refined(truth, &driven);
        assert_eq!(found.xi[0][(6, 1)], 0.0);
    }

    #[test]
    fn known_coefficients_stay_and_diverging_ones_are_left_alone() {
        let (_, truth) = oscillator::known();
        let mut knowledge = vec![Knowledge::nothing(7, 2); 2];
        knowledge[1].free.fill(false);
        let off: Vec<_> = truth.iter().map(|xi| xi.map(|c| 1.1 * c)).collect();
        let (_, found) = refined(off.clone(), &knowledge);
        assert_eq!(found.xi[1], off[1]);
        assert_ne!(found.xi[0], off[0]);
        let mut wild = off;
        wild[0][(1, 0)] = 1e7;
        let (before, same) = refined(wild.clone(), &knowledge);
        assert_eq!((same.xi, same.score), (wild, before));
    }
}
