//! Dropping terms that the rollouts of the training jumps do not miss.
//!
//! About coefficients that are refined the squared errors are a quadratic form of their changes. Dropping one sets its
//! change; the others take over what they can, and the form says what is lost (the optimal brain surgeon, Hassibi and
//! Stork, Second order derivatives for network pruning, NIPS 1992).

use nalgebra::{DMatrix, DVector};

use super::progress::Monitor;
use super::refine::{CoefficientIndex, Coefficients, ErrorModel, FreeCoefficients, Refiner};
use super::rollout::Xi;

/// Damping of the changes, relative to each coefficient's own weight.
const DAMPING: f64 = 1e-3;
/// Terms tried about the same coefficients before it is taken that none can be dropped.
const ATTEMPTS: usize = 8;
/// Terms dropped about the same coefficients, after which the form is computed anew.
const TOGETHER: usize = 4;

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

    /// The coefficients without the first terms that may go about them, at most [`TOGETHER`]; none if none may.
    fn drop_about(
        &self,
        form: &mut QuadraticForm,
        from: &Coefficients,
        limit: f64,
    ) -> Option<Coefficients> {
        let mut best = None;
        for _ in 0..TOGETHER {
            let found = self.order(form).into_iter().take(ATTEMPTS).find_map(|i| {
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
    use crate::train::knowledge::Knowledge;
    use crate::train::oscillator;

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
