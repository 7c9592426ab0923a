//! Refining coefficients by what their rollouts predict: Gauss-Newton on the errors of 0.1 s predictions and of whole
//! jumps, from the coefficients of a regression.
//!
//! A regression fits accelerations, each sample for itself, so nothing bounds what its errors add up to. Predictions of
//! whole jumps do: coefficients under which a phase, or the sequence of phases, runs away predict badly (the
//! prediction-error method, Ljung, System Identification, 2nd ed. 1999, section 7.2).
//!
//! Dropping terms that the rollouts of the training jumps do not miss.
//!
//! About coefficients that are refined the squared errors are a quadratic form of their changes. Dropping one sets its
//! change; the others take over what they can, and the form says what is lost (the optimal brain surgeon, Hassibi and
//! Stork, Second order derivatives for network pruning, NIPS 1992).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::growth::Growth;
use super::judge::Judge;
use super::progress::Monitor;
use super::rollout::{Change, Xi};
use super::sparse::{Knowledge, active_terms};

/// Weight of relative changes of the coefficients, against squared errors that start at 1 for both kinds of windows.
const PRIOR: f64 = 1e-3;
/// Relative step of the difference quotients.
const STEP: f64 = 1e-6;
const ATTEMPTS: usize = 6;
const TOGETHER: usize = 64;
/// Share of the squared errors that a step must lower them by to be followed by another.
const LEAST_GAIN: f64 = 2e-3;

/// Phase, term and latent coordinate of a coefficient.
pub(super) type CoefficientIndex = (usize, usize, usize);

/// Coefficients of all phases, `library_dim x latent_dim` each, and the score that judges them.
#[derive(Clone, Debug)]
pub(super) struct Coefficients {
    pub xi: Vec<Xi>,
    pub score: f64,
}

impl Coefficients {
    pub(super) fn active(&self) -> usize {
        self.xi.iter().map(active_terms).sum()
    }
}

/// Coefficients that may change, and their sizes, which changes are relative to.
#[derive(Clone)]
pub(super) struct FreeCoefficients {
    pub indices: Vec<CoefficientIndex>,
    pub scales: DVector<f64>,
}

impl FreeCoefficients {
    /// The free coefficients that are active in `xi`.
    pub(super) fn of(xi: &[Xi], knowledge: &[Knowledge]) -> Self {
        let mut indices = Vec::new();
        for (phase, (xi, knowledge)) in xi.iter().zip(knowledge).enumerate() {
            let active = |&i: &usize| xi[i] != 0.0 && knowledge.free[i];
            let places = (0..xi.len())
                .filter(active)
                .map(|i| xi.vector_to_matrix_index(i));
            indices.extend(places.map(|(term, column)| (phase, term, column)));
        }
        let scales = DVector::zeros(indices.len());
        let mut free = Self { indices, scales };
        free.scales = free.values(xi).abs();
        free
    }

    pub(super) fn values(&self, xi: &[Xi]) -> DVector<f64> {
        let values = self
            .indices
            .iter()
            .map(|&(phase, term, k)| xi[phase][(term, k)]);
        DVector::from_iterator(self.indices.len(), values)
    }

    /// Adds relative changes.
    pub(super) fn add(&self, xi: &mut [Xi], change: &DVector<f64>) {
        let changes = change.component_mul(&self.scales);
        for (&(phase, term, k), change) in self.indices.iter().zip(changes.iter()) {
            xi[phase][(term, k)] += change;
        }
    }
}

pub(super) struct Refiner<'a> {
    pub knowledge: &'a [Knowledge],
    pub growth: &'a Growth,
    pub training: &'a Judge<'a>,
    pub judge: &'a Judge<'a>,
}

/// The squared errors about some coefficients: `|r + J s|^2` for relative changes `s`.
pub(super) struct ErrorModel {
    squared_error: f64,
    pub gram: DMatrix<f64>,
    pub gradient: DVector<f64>,
}

impl ErrorModel {
    /// The factor of the form's matrix with the prior, and damped relative to each coefficient's own weight.
    pub(super) fn damped(&self, damping: f64) -> Option<Cholesky<f64, Dyn>> {
        let mut system = self.gram.clone();
        for i in 0..system.nrows() {
            system[(i, i)] += PRIOR + damping * self.gram[(i, i)];
        }
        system.cholesky()
    }
}

impl Refiner<'_> {
    /// Lowers the errors that `training` measures in at most `steps` steps, and gives the coefficients that `judge`
    /// scores best on the way. Which terms are active does not change, but for those that would drive where they may
    /// only brake, nor do coefficients that are known.
    pub(super) fn refine(
        &self,
        start: Coefficients,
        steps: usize,
        monitor: &mut Monitor<'_>,
    ) -> Coefficients {
        let free = FreeCoefficients::of(&start.xi, self.knowledge);
        let Some(weights) = self.weights(&start.xi).filter(|_| !free.indices.is_empty()) else {
            return start;
        };
        monitor.stage("refining coefficients by rollouts", steps);
        self.descend(start, &free, weights, steps, monitor)
    }

    /// Levenberg-Marquardt on relative changes; the coefficients that `judge` scores best.
    fn descend(
        &self,
        start: Coefficients,
        free: &FreeCoefficients,
        weights: [f64; 2],
        steps: usize,
        monitor: &mut Monitor<'_>,
    ) -> Coefficients {
        let origin = free.values(&start.xi);
        let moved = |xi: &[Xi]| (free.values(xi) - &origin).component_div(&free.scales);
        let cost = |squared_error: f64, xi: &[Xi]| squared_error + PRIOR * moved(xi).norm_squared();
        let mut current = start.xi.clone();
        self.admit(&mut current, free, Clone::clone);
        let mut best = Coefficients {
            score: self.score(&current),
            xi: current.clone(),
        };
        let mut damping = 1e-3;
        for step in 0..steps {
            if monitor.cancelled() {
                break;
            }
            let Some(model) = self.model(&current, free, weights) else {
                break;
            };
            let before = cost(model.squared_error, &current);
            let gradient = &model.gradient + moved(&current) * PRIOR;
            let lower = (0..ATTEMPTS).find_map(|_| {
                let factor = model.damped(damping)?;
                let change = -factor.solve(&gradient);
                let mut trial = current.clone();
                free.add(&mut trial, &change);
                self.admit(&mut trial, free, |gradient| factor.solve(gradient));
                let squared_error = self.squared_error(&trial, weights);
                let after = squared_error.map_or(f64::INFINITY, |error| cost(error, &trial));
                damping *= if after < before { 0.1 } else { 10.0 };
                (after < before).then_some((trial, after))
            });
            let Some((trial, after)) = lower else { break };
            let score = self.score(&trial);
            monitor.done(step + 1, format!("score {score:.4}"));
            if score < best.score {
                let xi = trial.clone();
                best = Coefficients { xi, score };
            }
            current = trial;
            if after > (1.0 - LEAST_GAIN) * before {
                break;
            }
        }
        best
    }

    /// Moves coefficients to where they brake where they may only brake, and keep the bound on growth: the least, where
    /// `inverse` applies that of the matrix which weighs relative changes of the `free` coefficients.
    fn admit(
        &self,
        xi: &mut [Xi],
        free: &FreeCoefficients,
        inverse: impl Fn(&DVector<f64>) -> DVector<f64>,
    ) {
        self.growth.hold(xi, |gradient| {
            let change = inverse(&free.values(gradient).component_mul(&free.scales));
            let mut all: Vec<_> = gradient.iter().map(|each| each.map(|_| 0.0)).collect();
            free.add(&mut all, &change);
            all
        });
        self.brake(xi);
    }

    /// Coefficients that would drive where they may only brake, set to 0.
    pub(super) fn brake(&self, xi: &mut [Xi]) {
        for (knowledge, xi) in self.knowledge.iter().zip(xi) {
            knowledge.brake(xi);
        }
    }

    /// Score of coefficients, infinite if they grow faster than they may or diverge.
    pub(super) fn score(&self, xi: &[Xi]) -> f64 {
        self.score_within(xi, f64::MAX)
    }

    /// The same, or a number above `limit` if the score is.
    pub(super) fn score_within(&self, xi: &[Xi], limit: f64) -> f64 {
        match self.growth.admits(xi) {
            true => self.judge.score_within(xi, limit),
            false => f64::INFINITY,
        }
    }

    /// Errors of a part, weighted and stacked; none if a rollout diverges.
    fn residual(&self, xi: &[Xi], weights: [f64; 2], part: usize) -> Option<DVector<f64>> {
        Some(stacked(&self.training.errors(xi, part)?, weights))
    }

    /// Squared errors of all parts; none if a rollout diverges.
    fn squared_error(&self, xi: &[Xi], weights: [f64; 2]) -> Option<f64> {
        let of_part = |part| Some(self.residual(xi, weights, part)?.norm_squared());
        self.training.parts().map(of_part).sum()
    }

    /// Weights under which the squared errors of both kinds of windows are 1; none if a rollout diverges.
    pub(super) fn weights(&self, xi: &[Xi]) -> Option<[f64; 2]> {
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
        xi: &[Xi],
        free: &FreeCoefficients,
        weights: [f64; 2],
    ) -> Option<ErrorModel> {
        let n = free.indices.len();
        let mut model = ErrorModel {
            squared_error: 0.0,
            gram: DMatrix::zeros(n, n),
            gradient: DVector::zeros(n),
        };
        let steps = free.indices.iter().zip(free.scales.iter());
        let changes: Vec<Change> = steps
            .map(|(&place, scale)| Change {
                place,
                by: STEP * scale,
            })
            .collect();
        for part in self.training.parts() {
            let residual = self.residual(xi, weights, part)?;
            let mut sensitivity = DMatrix::zeros(residual.len(), n);
            for (group, changes) in changes.chunks(TOGETHER).enumerate() {
                let moved = self.training.errors_changed(xi, changes, part)?;
                for (column, moved) in (group * TOGETHER..).zip(&moved) {
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

/// Damping of the changes, relative to each coefficient's own weight.
const DAMPING: f64 = 1e-3;
/// Terms tried about the same coefficients before it is taken that none can be dropped.
const DROP_ATTEMPTS: usize = 8;
/// Terms dropped about the same coefficients, after which the form is computed anew.
const DROPPED_TOGETHER: usize = 4;

impl Refiner<'_> {
    /// Drops terms one at a time, those first that training misses least, while `judge` scores at most `limit`. What is
    /// known and what must be kept stay, and so do inputs: a controller needs what they do, whether or not the recorded
    /// ones differ enough for a prediction to miss them.
    pub(super) fn thin(
        &self,
        refined: Coefficients,
        limit: f64,
        monitor: &mut Monitor<'_>,
    ) -> Coefficients {
        let Some(weights) = self.weights(&refined.xi) else {
            return refined;
        };
        let mut thinned = refined;
        let free = |xi: &[Xi]| FreeCoefficients::of(xi, self.knowledge);
        let total = free(&thinned.xi).indices.len();
        monitor.stage("dropping terms that rollouts do not miss", total);
        while !monitor.cancelled() {
            let free = free(&thinned.xi);
            let before = free.indices.len();
            let model = self.model(&thinned.xi, &free, weights);
            let form = model.and_then(|model| QuadraticForm::new(&thinned, free, &model));
            let Some(mut form) = form else { break };
            let Some(fewer) = self.drop_about(&mut form, &thinned, limit) else {
                break;
            };
            thinned = fewer;
            monitor.done(total - before + 1, format!("score {:.4}", thinned.score));
        }
        thinned
    }

    /// The coefficients without the first terms that may go about them, at most [`DROPPED_TOGETHER`]; none if none may.
    fn drop_about(
        &self,
        form: &mut QuadraticForm,
        from: &Coefficients,
        limit: f64,
    ) -> Option<Coefficients> {
        let mut best = None;
        for _ in 0..DROPPED_TOGETHER {
            let found = self
                .order(form)
                .into_iter()
                .take(DROP_ATTEMPTS)
                .find_map(|i| {
                    let without = form.without(i);
                    let mut xi = without.xi(from);
                    self.brake(&mut xi);
                    let score = self.score_within(&xi, limit);
                    (score <= limit).then_some((without, Coefficients { xi, score }))
                });
            let Some((without, coefficients)) = found else {
                break;
            };
            *form = without;
            best = Some(coefficients);
        }
        best
    }

    fn order(&self, form: &QuadraticForm) -> Vec<usize> {
        let features = self.judge.features;
        let d = features.latent_dim();
        let inputs: Vec<_> = (2 * d..3 * d)
            .filter_map(|i| features.variable_term(i))
            .collect();
        let may_go = |(phase, term, column): CoefficientIndex| {
            !inputs.contains(&term) && !self.knowledge[phase].kept[(term, column)]
        };
        let mut order: Vec<usize> = (0..form.gone.len())
            .filter(|&i| !form.gone[i] && may_go(form.free.indices[i]))
            .collect();
        order.sort_by(|&a, &b| form.loss(a).total_cmp(&form.loss(b)));
        order
    }
}

/// The quadratic form about some coefficients, some of them dropped.
#[derive(Clone)]
struct QuadraticForm {
    free: FreeCoefficients,
    /// Relative changes that make the coefficients zero.
    to_zero: DVector<f64>,
    /// Where the form is lowest, with those that are gone at zero.
    lowest: DVector<f64>,
    /// Inverse of the form's matrix on those that are not gone.
    inverse: DMatrix<f64>,
    gone: Vec<bool>,
}

impl QuadraticForm {
    fn new(from: &Coefficients, free: FreeCoefficients, model: &ErrorModel) -> Option<Self> {
        let factor = model.damped(DAMPING)?;
        Some(Self {
            to_zero: -free.values(&from.xi).component_div(&free.scales),
            lowest: -factor.solve(&model.gradient),
            inverse: factor.inverse(),
            gone: vec![false; free.indices.len()],
            free,
        })
    }

    /// What the form rises by without a term, the others where it is lowest then.
    fn loss(&self, i: usize) -> f64 {
        (self.to_zero[i] - self.lowest[i]).powi(2) / self.inverse[(i, i)]
    }

    fn without(&self, i: usize) -> Self {
        let mut next = self.clone();
        let column = self.inverse.column(i) / self.inverse[(i, i)];
        next.lowest += &column * (self.to_zero[i] - self.lowest[i]);
        next.inverse -= &column * self.inverse.row(i);
        next.gone[i] = true;
        next
    }

    fn xi(&self, from: &Coefficients) -> Vec<Xi> {
        let mut xi = from.xi.clone();
        self.free.add(&mut xi, &self.lowest);
        let each = self.free.indices.iter().zip(&self.gone);
        for (&(phase, term, column), _) in each.filter(|(_, gone)| **gone) {
            xi[phase][(term, column)] = 0.0;
        }
        xi
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::oscillator;

    fn refined(xi: Vec<DMatrix<f64>>, knowledge: &[Knowledge]) -> (f64, Coefficients) {
        oscillator::with_refiner(Some(1.0), knowledge, |refiner, monitor| {
            let score = refiner.score(&xi);
            (
                score,
                refiner.refine(Coefficients { xi, score }, 20, monitor),
            )
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

    use crate::train::sparse::Knowledge;

    /// What is left of the known system with a few terms too many, the limit as a share of its score.
    fn left_of_too_many(limit: f64) -> Vec<DMatrix<f64>> {
        let (_, mut xi) = oscillator::known();
        let mut knowledge = [Knowledge::nothing(7, 2), Knowledge::nothing(7, 2)];
        knowledge[0].kept[(3, 0)] = true;
        (xi[0][(2, 0)], xi[0][(4, 0)], xi[0][(4, 1)]) = (0.3, 0.02, -0.05);
        (xi[0][(5, 1)], xi[1][(1, 0)]) = (0.01, 0.02);
        oscillator::with_refiner(None, &knowledge, |refiner, monitor| {
            let score = refiner.score(&xi);
            let thinned = refiner.thin(Coefficients { xi, score }, limit * score, monitor);
            assert!(thinned.score <= limit * score);
            thinned.xi
        })
    }

    #[test]
    fn terms_too_many_go_and_those_of_the_system_stay() {
        let (_, truth) = oscillator::known();
        let left = left_of_too_many(0.1);
        for (left, truth) in left.iter().zip(&truth) {
            for (place, (left, truth)) in left.iter().zip(truth.iter()).enumerate() {
                let is_input = place % 7 >= 5;
                assert!(*truth == 0.0 || (left - truth).abs() <= 0.05 * truth.abs());
                assert!(*truth != 0.0 || is_input || *left == 0.0, "{place}: {left}");
            }
        }
        assert_ne!(left[0][(5, 1)], 0.0); // an input
        let least = left_of_too_many(1e9)[0]
            .rows(0, 5)
            .map(|c| usize::from(c != 0.0));
        assert_eq!(least.sum(), 1); // which must be kept
    }
}
