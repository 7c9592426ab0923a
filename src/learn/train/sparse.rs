//! Sparse regression of the latent accelerations: which terms of the library stay, with which coefficients.
//!
//! What is known of the dynamics before any regression.

use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use serde::Serialize;

use super::dataset::Dataset;
use super::features::Features;
use super::metrics::BODY_Z;
use super::subspace::Frame;
use crate::robot::{FeetRule, GRAVITY_M_S2};

/// Least ridge on the normalised columns: far above rounding.
const LEAST_RIDGE: f64 = 1e-10;
/// Supports up to this size are solved anew after every elimination, larger ones by an update.
const RECOMPUTED: usize = 64;

/// Which terms are active, `library_dim x latent_dim`.
type Support = DMatrix<bool>;

/// Normal equations of `ddz = theta Xi` for one phase, columns normalised to unit root mean square.
///
/// Building it reads the samples once; every solve afterwards works on `library_dim x library_dim` matrices.
#[derive(Clone, Debug)]
pub(super) struct Regression {
    gram: DMatrix<f64>,        // p x p, normalised theta^T theta / n
    correlation: DMatrix<f64>, // p x d, normalised theta^T ddz / n
    theta_rms: DVector<f64>,
    target_rms: DVector<f64>,
    knowledge: Knowledge,
}

/// When a term of the library is dropped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pruning {
    /// Sequential thresholding: drop every term whose contribution `|xi| rms(term) / rms(ddz)` is below this, solve
    /// again, until none is.
    Threshold(f64),
    /// Backward elimination: drop the term that explains least, one at a time, while the share of the acceleration's
    /// energy left unexplained stays within this of the full library's.
    Elimination(f64),
}

impl Regression {
    /// Normal equations from samples: `theta` is `n x library_dim`, `target` is `n x latent_dim`; what is known is
    /// taken off the target.
    pub(super) fn new(theta: &DMatrix<f64>, target: &DMatrix<f64>, knowledge: Knowledge) -> Self {
        let n = theta.nrows().max(1) as f64;
        let unknown = target - theta * &knowledge.known;
        let theta_rms = column_rms(theta);
        let target_rms = column_rms(&unknown);
        let mut gram = theta.tr_mul(theta) / n;
        let mut correlation = theta.tr_mul(&unknown) / n;
        for (i, &scale) in theta_rms.iter().enumerate() {
            let factor = if scale > 0.0 { 1.0 / scale } else { 0.0 };
            gram.row_mut(i).scale_mut(factor);
            gram.column_mut(i).scale_mut(factor);
            correlation.row_mut(i).scale_mut(factor);
        }
        Self {
            gram,
            correlation,
            theta_rms,
            target_rms,
            knowledge,
        }
    }

    /// Coefficients `Xi` (`library_dim x latent_dim`) of the terms that are `allowed`, by ridge regression on the
    /// normalised columns, with each of the `prunings`.
    ///
    /// Contributions, not bare coefficients, decide (STLSQ of Brunton et al. 2016 otherwise), so that the units of a
    /// term do not matter. Eliminations drop terms in one and the same order, which is walked once for all of them.
    pub(super) fn fit_each(
        &self,
        ridge: f64,
        prunings: &[Pruning],
        allowed: &[bool],
    ) -> Vec<DMatrix<f64>> {
        let mut fits = vec![self.knowledge.known.clone(); prunings.len()];
        for column in (0..self.target_rms.len()).filter(|&column| self.target_rms[column] > 0.0) {
            let informative: Vec<usize> = (self.free_terms(column))
                .filter(|&i| self.theta_rms[i] > 0.0 && allowed[i])
                .collect();
            let losses: Vec<f64> = (prunings.iter())
                .filter_map(|pruning| match pruning {
                    Pruning::Elimination(loss) => Some(*loss),
                    Pruning::Threshold(_) => None,
                })
                .collect();
            let eliminated = self.eliminate(column, informative.clone(), ridge, &losses);
            let mut eliminated = eliminated.into_iter();
            let mut next = || eliminated.next().expect("invariant: one for every loss");
            for (pruning, xi) in prunings.iter().zip(&mut fits) {
                let support = match pruning {
                    Pruning::Threshold(least) => {
                        self.threshold(column, informative.clone(), ridge, *least)
                    }
                    Pruning::Elimination(_) => next(),
                };
                let solution = self.solve(column, &support, ridge);
                self.store(xi, column, &support, &solution);
            }
        }
        fits
    }

    fn threshold(
        &self,
        column: usize,
        mut support: Vec<usize>,
        ridge: f64,
        least: f64,
    ) -> Vec<usize> {
        loop {
            let (solution, before) = (self.solve(column, &support, ridge), support.len());
            let mut values = solution.iter();
            support.retain(|&i| {
                let weighs = |value: &f64| value.abs() >= least * self.target_rms[column];
                values.next().is_some_and(weighs) || self.knowledge.kept[(i, column)]
            });
            if support.len() == before {
                return support;
            }
        }
    }

    fn eliminate(
        &self,
        column: usize,
        support: Vec<usize>,
        ridge: f64,
        losses: &[f64],
    ) -> Vec<Vec<usize>> {
        let mut left = vec![None; losses.len()];
        let energy = self.energy(column);
        let mut fit = self.support_fit(column, support, ridge);
        let mut lost = 0.0;
        while left.contains(&None) {
            let weakest = (0..fit.support.len())
                .filter(|&j| !self.knowledge.kept[(fit.support[j], column)])
                .map(|j| (j, fit.rise(j) / energy))
                .min_by(|a, b| a.1.total_cmp(&b.1));
            for (left, loss) in left.iter_mut().zip(losses) {
                let stays = weakest.is_none_or(|(_, rise)| lost + rise > *loss);
                if left.is_none() && stays {
                    *left = Some(fit.support.clone());
                }
            }
            let Some((j, rise)) = weakest else { break };
            lost += rise;
            match fit.support.len() > RECOMPUTED {
                true => fit.remove(j),
                false => {
                    fit.support.remove(j);
                    fit = self.support_fit(column, fit.support, ridge);
                }
            }
        }
        left.into_iter().flatten().collect()
    }

    fn support_fit(&self, column: usize, support: Vec<usize>, ridge: f64) -> SupportFit {
        SupportFit {
            solution: self.solve(column, &support, ridge),
            inverse: self.ridged_gram(&support, ridge).inverse(),
            support,
        }
    }

    /// For every term that is not active in a column: its row, and the share of the acceleration's energy that is
    /// explained with it and not without.
    pub(super) fn gains(&self, column: usize, support: &Support, ridge: f64) -> Vec<(usize, f64)> {
        let energy = self.energy(column);
        let (inside, outside): (Vec<usize>, Vec<usize>) =
            (self.free_terms(column)).partition(|&i| support[(i, column)]);
        let fit = self.support_fit(column, inside, ridge);
        let outside = outside.into_iter().filter(|&i| self.theta_rms[i] > 0.0);
        outside
            .map(|i| {
                let shared = fit.support.iter().map(|&j| self.gram[(i, j)]);
                let shared = DVector::from_iterator(fit.support.len(), shared);
                let missing = self.correlation[(i, column)] - shared.dot(&fit.solution);
                let own = self.gram[(i, i)] + ridge.max(LEAST_RIDGE)
                    - shared.dot(&(&fit.inverse * &shared));
                (i, missing.powi(2) / own / energy)
            })
            .collect()
    }

    /// One column of Xi on a given support (`library_dim x latent_dim`, true where a term is active).
    pub(super) fn fit_column(&self, column: usize, support: &Support, ridge: f64) -> DVector<f64> {
        let rows = self.active_terms(column, support);
        let solution = self.solve(column, &rows, ridge);
        let mut xi = self.knowledge.known.clone();
        self.store(&mut xi, column, &rows, &solution);
        xi.column(column).into_owned()
    }

    /// What the active terms of `xi` would change by for this gradient: the inverse of the normal equations applied to
    /// it, column by column, each relative to the energy of its accelerations.
    pub(super) fn change(
        &self,
        xi: &DMatrix<f64>,
        gradient: &DMatrix<f64>,
        ridge: f64,
    ) -> DMatrix<f64> {
        let mut change = DMatrix::zeros(xi.nrows(), xi.ncols());
        for column in 0..xi.ncols() {
            let active = (self.free_terms(column))
                .filter(|&i| xi[(i, column)] != 0.0 && self.theta_rms[i] > 0.0);
            let support: Vec<usize> = active.collect();
            let normalised = support
                .iter()
                .map(|&i| gradient[(i, column)] / self.theta_rms[i]);
            let right = DVector::from_iterator(support.len(), normalised);
            let solution = self.ridged_gram(&support, ridge).solve(&right);
            self.store(&mut change, column, &support, &solution);
        }
        for (mut column, rms) in change.column_iter_mut().zip(self.target_rms.iter()) {
            column *= rms.powi(2);
        }
        change
    }

    /// For every active term of a column that may go: its row, and the share of the acceleration's energy lost without
    /// it.
    pub(super) fn losses(&self, column: usize, support: &Support, ridge: f64) -> Vec<(usize, f64)> {
        let energy = self.energy(column);
        let fit = self.support_fit(column, self.active_terms(column, support), ridge);
        let losses = (0..fit.support.len()).map(|j| fit.rise(j) / energy);
        (fit.support.iter().copied().zip(losses))
            .filter(|&(term, _)| !self.knowledge.kept[(term, column)])
            .collect()
    }

    /// Terms whose coefficient in a column is not known.
    fn free_terms(&self, column: usize) -> impl Iterator<Item = usize> {
        (0..self.theta_rms.len()).filter(move |&i| self.knowledge.free[(i, column)])
    }

    /// Those of them that are active in a support.
    fn active_terms(&self, column: usize, support: &Support) -> Vec<usize> {
        let free = self.free_terms(column);
        free.filter(|&i| support[(i, column)]).collect()
    }

    fn energy(&self, column: usize) -> f64 {
        self.target_rms[column].powi(2).max(f64::MIN_POSITIVE)
    }

    /// Ridge solution for the normalised columns in `support`.
    fn solve(&self, column: usize, support: &[usize], ridge: f64) -> DVector<f64> {
        let right = support.iter().map(|&i| self.correlation[(i, column)]);
        let right = DVector::from_iterator(support.len(), right);
        self.ridged_gram(support, ridge).solve(&right)
    }

    fn ridged_gram(&self, support: &[usize], ridge: f64) -> Cholesky<f64, Dyn> {
        let n = support.len();
        let gram = self.gram.select_rows(support).select_columns(support);
        // The normalised columns have unit diagonal, so this is far above rounding.
        let ridge = ridge.max(LEAST_RIDGE);
        (gram + DMatrix::identity(n, n) * ridge)
            .cholesky()
            .expect("a Gram matrix plus a ridge is positive definite")
    }

    fn store(
        &self,
        xi: &mut DMatrix<f64>,
        column: usize,
        support: &[usize],
        normalised: &DVector<f64>,
    ) {
        for (&row, &value) in support.iter().zip(normalised.iter()) {
            if self.theta_rms[row] > 0.0 {
                xi[(row, column)] = value / self.theta_rms[row];
            }
        }
    }
}

struct SupportFit {
    support: Vec<usize>,
    solution: DVector<f64>,
    inverse: DMatrix<f64>,
}

impl SupportFit {
    /// What the ridge objective gains without term `j`: `c_j^2 / (G^-1)_jj`, with `c` the solution and `G` the ridged
    /// Gram matrix.
    fn rise(&self, j: usize) -> f64 {
        self.solution[j].powi(2) / self.inverse[(j, j)]
    }

    /// The fit without term `j`: `c - P_j c_j / P_jj` and `P - P_j P_j^T / P_jj`, with `P` the inverse.
    fn remove(&mut self, j: usize) {
        let column = self.inverse.column(j) / self.inverse[(j, j)];
        let (own, at) = (self.solution[j], self.inverse[(j, j)]);
        self.solution.axpy(-own, &column, 1.0);
        self.inverse.ger(-at, &column, &column, 1.0);
        self.support.remove(j);
        self.solution = std::mem::take(&mut self.solution).remove_row(j);
        let inverse = std::mem::take(&mut self.inverse);
        self.inverse = inverse.remove_row(j).remove_column(j);
    }
}

pub(super) fn active_terms(xi: &DMatrix<f64>) -> usize {
    xi.iter().filter(|value| **value != 0.0).count()
}

fn column_rms(matrix: &DMatrix<f64>) -> DVector<f64> {
    let n = matrix.nrows().max(1) as f64;
    let columns = matrix.column_iter();
    let rms = columns.map(|column| (column.norm_squared() / n).sqrt());
    DVector::from_iterator(matrix.ncols(), rms)
}

/// Rows that a frame holds: the centre of mass forwards and upwards.
const HELD: usize = 2;

/// Coefficients of one phase that are known, those that a regression may choose, and those that it must keep.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Knowledge {
    /// `library_dim x latent_dim`, zero where nothing is known.
    pub known: DMatrix<f64>,
    /// Whether a coefficient is free, `library_dim x latent_dim`.
    pub free: DMatrix<bool>,
    /// Whether a free coefficient stays whatever it explains, `library_dim x latent_dim`.
    pub kept: DMatrix<bool>,
    /// Whether a free coefficient is at most 0 once it is refined, `library_dim x latent_dim`.
    pub braking: DMatrix<bool>,
}

impl Knowledge {
    pub(super) fn nothing(library_dim: usize, latent_dim: usize) -> Self {
        Self {
            known: DMatrix::zeros(library_dim, latent_dim),
            free: DMatrix::from_element(library_dim, latent_dim, true),
            kept: DMatrix::from_element(library_dim, latent_dim, false),
            braking: DMatrix::from_element(library_dim, latent_dim, false),
        }
    }

    /// Coefficients that would drive where they may only brake, set to 0.
    pub(super) fn brake(&self, xi: &mut DMatrix<f64>) {
        for (coefficient, braking) in xi.iter_mut().zip(self.braking.iter()) {
            if *braking && *coefficient > 0.0 {
                *coefficient = 0.0;
            }
        }
    }

    /// What is known of each phase in a frame that holds the centre of mass as `z1` (forwards) and `z2` (upwards),
    /// nothing in any other.
    ///
    /// The floor is the same everywhere, so no term depends on `z1`. Forces move a centre of mass and losses brake it,
    /// wherever it and the legs are (Newton's second law): no term of `ddz1` and `ddz2` depends on a position, and each
    /// keeps its own velocity, with a coefficient of at most 0. With feet on the ground `ddz2` depends on its own force
    /// and velocity alone, and keeps its constant: gravity, less what the ground carries of the legs' weight, which
    /// forces that come from torques leave out. In flight `ddz1 = 0`, `ddz2 = -g`, and there are no forces that any
    /// term could depend on. An input acts on its own coordinate.
    pub(super) fn of_phases(training: &Dataset, features: &Features, frame: &Frame) -> Vec<Self> {
        let (p, d) = (features.library_dim(), features.latent_dim());
        let each = training.phases.patterns.iter();
        if frame.held.ncols() < HELD {
            return each.map(|_| Self::nothing(p, d)).collect();
        }
        let gravity = -GRAVITY_M_S2 * training.scaling.state[BODY_Z];
        let (upwards, force_upwards) = (d + 1, 2 * d + 1);
        let one = features.constant_term();
        // Coefficients in some columns of the terms that depend on certain variables are not free.
        let fix =
            |knowledge: &mut Self, columns: Range<usize>, is_meant: &dyn Fn(usize) -> bool| {
                for variable in (0..3 * d).filter(|&i| is_meant(i)) {
                    for term in (0..p).filter(|&term| features.depends_on(term, variable)) {
                        let mut row = knowledge.free.row_mut(term);
                        row.columns_range_mut(columns.clone()).fill(false);
                    }
                }
            };
        each.map(|phase| {
            let mut knowledge = Self::nothing(p, d);
            fix(&mut knowledge, 0..d, &|i| i == 0);
            fix(&mut knowledge, 0..HELD, &|i| i < d);
            if phase.feet == FeetRule::None {
                fix(&mut knowledge, 0..d, &|i| {
                    (2 * d..2 * d + HELD).contains(&i)
                });
                knowledge.free.column_mut(0).fill(false);
                if let Some(one) = one {
                    knowledge.known[(one, 1)] = gravity;
                    knowledge.free.column_mut(1).fill(false);
                }
            } else {
                fix(&mut knowledge, 1..2, &|i| {
                    i != upwards && i != force_upwards
                });
                if let Some(one) = one {
                    knowledge.kept[(one, 1)] = true;
                }
            }
            for k in 0..d {
                if let Some(term) = features.variable_term(2 * d + k) {
                    knowledge.kept[(term, k)] = knowledge.free[(term, k)];
                }
            }
            for k in 0..HELD {
                if let Some(term) = features.variable_term(d + k) {
                    knowledge.kept[(term, k)] = knowledge.free[(term, k)];
                    knowledge.braking[(term, k)] = knowledge.free[(term, k)];
                }
            }
            knowledge
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::random::Random;

    impl Regression {
        pub(in crate::train) fn fit(&self, ridge: f64, pruning: Pruning) -> DMatrix<f64> {
            let all = vec![true; self.theta_rms.len()];
            self.fit_each(ridge, &[pruning], &all).remove(0)
        }
    }

    fn unconstrained(theta: &DMatrix<f64>, target: &DMatrix<f64>) -> Regression {
        let nothing = Knowledge::nothing(theta.ncols(), target.ncols());
        Regression::new(theta, target, nothing)
    }

    fn samples() -> (DMatrix<f64>, DMatrix<f64>) {
        let theta = DMatrix::from_fn(200, 4, |i, j| {
            let t = i as f64 / 20.0;
            [
                1.0,
                0.01 * t.sin(),
                100.0 * (1.7 * t).cos(),
                (0.3 * t).exp(),
            ][j]
        });
        let target = DMatrix::from_fn(200, 1, |i, _| {
            2.0 + 30.0 * theta[(i, 1)] + 0.001 * theta[(i, 2)].signum() * 1e-3
        });
        (theta, target)
    }

    #[test]
    fn fit_finds_the_terms_that_made_the_data_whatever_their_size() {
        let (theta, target) = samples();
        for pruning in [Pruning::Threshold(0.03), Pruning::Elimination(1e-6)] {
            let xi = unconstrained(&theta, &target).fit(0.0, pruning);
            assert_eq!(active_terms(&xi), 2, "{pruning:?}");
            let close = (xi[(0, 0)] - 2.0).abs() < 1e-3 && (xi[(1, 0)] - 30.0).abs() < 0.05;
            assert!(close, "{pruning:?} {xi}");
        }
    }

    #[test]
    fn eliminations_of_many_terms_at_once_are_those_one_by_one() {
        let mut random = Random::new(5);
        let theta = random.matrix(400, 90, 1.0);
        let weights = DMatrix::from_fn(90, 1, |i, _| if i % 9 == 0 { 1.0 + i as f64 } else { 0.5 });
        let target = &theta * weights + random.matrix(400, 1, 3.0);
        let regression = unconstrained(&theta, &target);
        let losses = [0.3, 1e-4, 0.02];
        let all: Vec<usize> = (0..90).collect();
        let found = regression.eliminate(0, all.clone(), 1e-3, &losses);
        for (found, loss) in found.iter().zip(losses) {
            let (mut support, mut lost) = (all.clone(), 0.0);
            loop {
                let fit = regression.support_fit(0, support.clone(), 1e-3);
                let energy = regression.target_rms[0].powi(2);
                let weakest = (0..support.len())
                    .map(|j| (j, fit.rise(j) / energy))
                    .min_by(|a, b| a.1.total_cmp(&b.1));
                match weakest {
                    Some((j, rise)) if lost + rise <= loss => {
                        lost += rise;
                        support.remove(j);
                    }
                    Some(_) | None => break,
                }
            }
            assert_eq!(*found, support, "{loss}");
        }
        assert!(found[0].len() < found[2].len() && found[2].len() < found[1].len());
    }

    #[test]
    fn gains_of_terms_are_what_a_fit_with_them_explains_more() {
        let mut random = Random::new(6);
        let (theta, target) = (random.matrix(100, 5, 1.0), random.matrix(100, 1, 1.0));
        let regression = unconstrained(&theta, &target);
        let mut support = DMatrix::from_column_slice(5, 1, &[true, false, true, false, false]);
        let gains = regression.gains(0, &support, 1e-2);
        assert!(gains.iter().map(|(row, _)| *row).eq([1, 3, 4]));
        // Taking a term out again loses what it gave.
        support[(3, 0)] = true;
        let losses = regression.losses(0, &support, 1e-2);
        let (_, loss) = losses[2]; // of rows 0, 2 and 3
        assert!((gains[1].1 - loss).abs() < 1e-12);
    }

    #[test]
    fn no_term_is_left_of_an_elimination_of_everything_or_without_accelerations() {
        let (theta, target) = samples();
        let all = unconstrained(&theta, &target).fit(1e-3, Pruning::Elimination(2.0));
        let still = unconstrained(&theta, &(target * 0.0)).fit(1e-3, Pruning::Threshold(0.03));
        assert_eq!((active_terms(&all), active_terms(&still)), (0, 0));
    }

    use crate::robot::STATE_DIM;
    use crate::train::oscillator;
    use crate::train::sparse::{Pruning, Regression};

    #[test]
    fn centre_of_mass_is_moved_by_forces_alone_and_in_flight_by_none() {
        let (dataset, _) = oscillator::jumps(1);
        let features = Features::new(&oscillator::standard_library(3, 2, true));
        let frame = Frame {
            held: DMatrix::zeros(STATE_DIM, HELD),
            free: DMatrix::zeros(STATE_DIM, 1),
        };
        let [contact, flight] = &Knowledge::of_phases(&dataset, &features, &frame)[..] else {
            panic!("two phases");
        };
        let term = |variable| features.variable_term(variable).expect("a linear library");
        let (z2, z3, dz2, u1, u2, u3) = (term(1), term(2), term(4), term(6), term(7), term(8));
        let one = features.constant_term().expect("a standard library");
        let gravity = -GRAVITY_M_S2 * dataset.scaling.state[BODY_Z];
        assert_eq!(flight.known[(one, 1)], gravity);
        assert!(contact.known[(one, 1)] == 0.0 && contact.kept[(one, 1)]);
        for phase in [contact, flight] {
            assert!(phase.free.row(term(0)).iter().all(|free| !free));
            assert!(!phase.free[(z2, 0)] && !phase.free[(z3, 1)]);
            assert!(phase.free[(z2, 2)] && phase.free[(z3, 2)] && phase.kept[(u3, 2)]);
        }
        assert!(contact.free[(u1, 2)] && contact.free[(u2, 0)] && contact.free[(dz2, 0)]);
        let affine = features.affine_terms();
        let upwards: Vec<usize> = (0..affine.len())
            .filter(|&term| contact.free[(term, 1)] && affine[term])
            .collect();
        assert_eq!(upwards, [one, dz2, u2]);
        assert!(contact.kept[(u2, 1)] && contact.kept[(dz2, 1)] && !contact.kept[(dz2, 0)]);
        assert!(
            contact.braking[(dz2, 1)] && !contact.braking[(u2, 1)] && !flight.braking[(dz2, 1)]
        );
        assert!(!flight.free[(u1, 2)] && !flight.free[(u2, 2)]);
        assert!(!flight.free.columns(0, HELD).iter().any(|free| *free));
        let nothing = Knowledge::of_phases(&dataset, &features, &Frame::plain(&[0, 1, 2]));
        assert_eq!(nothing[0], Knowledge::nothing(features.library_dim(), 3));
    }

    #[test]
    fn regression_keeps_what_is_known_and_never_takes_what_is_not_free() {
        let theta = DMatrix::from_fn(60, 7, |i, j| match j {
            0 => 1.0,
            _ => ((1 + i) as f64 * (0.3 + 0.17 * j as f64)).sin(),
        });
        let mut truth = DMatrix::zeros(7, 2);
        (truth[(0, 1)], truth[(5, 0)], truth[(6, 1)], truth[(1, 0)]) = (-0.9, 2.0, 3.0, 1.0);
        let mut knowledge = Knowledge::nothing(7, 2);
        knowledge.known[(0, 1)] = -0.981;
        knowledge.free[(0, 1)] = false;
        knowledge.free[(1, 0)] = false;
        knowledge.kept[(6, 0)] = true; // explains nothing
        let regression = Regression::new(&theta, &(&theta * &truth), knowledge);
        for pruning in [Pruning::Threshold(0.05), Pruning::Elimination(0.02)] {
            let xi = regression.fit(1e-6, pruning);
            assert_eq!((xi[(0, 1)], xi[(1, 0)]), (-0.981, 0.0));
            assert!(xi[(6, 0)] != 0.0 && (xi[(6, 1)] - 3.0).abs() < 0.2, "{xi}");
            let support = xi.map(|value| value != 0.0);
            assert_eq!(regression.fit_column(1, &support, 1e-6)[0], -0.981);
            let may_go = regression.losses(0, &support, 1e-6);
            assert!(may_go.iter().all(|(term, _)| *term != 6 && *term != 1));
        }
    }
}
