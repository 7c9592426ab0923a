//! From learned maps to a model's numbers: latent basis, chosen dynamics, metrics of the fit.

use nalgebra::DMatrix;

use super::dataset::mean;
use super::error::TrainError;
use super::features::Features;
use super::joint::Losses;
use super::judge::Judge;
use super::latent::{EncodedSet, Latent, input_projection, lift_samples, mean_jacobian};
use super::metrics::{BODY_X, BODY_Z, PhaseTerms, SeedReport, SetMetrics, TrainReport, measure};
use super::progress::Monitor;
use super::rollout::{Candidate, Xi};
use super::select::{Choice, select};
use super::sparse::active_terms;
use super::subspace::{order_and_sign, varimax};
use super::task::Task;
use super::weak_form::check_terms;
use crate::model::{AffineMap, StateMap};
use crate::robot::Robot;

pub(super) struct Maps {
    pub encoder: StateMap,
    pub decoder: StateMap,
    /// `W_e`, of a nonlinear encoder the mean of its Jacobian over the training samples.
    pub weights: DMatrix<f64>,
    pub training: Vec<Latent>,
    pub validation: Vec<Latent>,
}

impl Maps {
    pub(super) fn training_set<'a>(&'a self, task: &'a Task<'_>) -> EncodedSet<'a> {
        EncodedSet::new(&task.training, &self.training)
    }

    /// The jumps that candidates are judged by: those of the training where there are no others.
    pub(super) fn judged_set<'a>(&'a self, task: &'a Task<'_>) -> EncodedSet<'a> {
        match self.validation.is_empty() {
            true => self.training_set(task),
            false => EncodedSet::new(&task.validation, &self.validation),
        }
    }
}

pub(super) struct Fitted {
    pub maps: Maps,
    pub xi: Vec<Xi>,
    /// The regression, if Xi was chosen among regressions, and how many were tried.
    pub choice: Option<(Choice, usize)>,
    /// What seeds are compared by, see [`SeedReport::score`].
    pub score: f64,
}

impl Fitted {
    fn measure(&self, features: &Features, set: EncodedSet<'_>) -> SetMetrics {
        let (xi, maps) = (&self.xi, [&self.maps.encoder, &self.maps.decoder]);
        measure(Candidate { features, xi }, maps, set)
    }
}

impl Task<'_> {
    /// The encoder of the rows that the frame holds and, in its canonical basis, of a space with orthonormal `basis`
    /// (`18 x (d - h)`); `b_e = -W_e mean(x)`.
    pub(super) fn encoder_over(&self, basis: &DMatrix<f64>) -> Result<AffineMap, TrainError> {
        let held = self.frame.held.column_iter();
        let learned = self.canonical_basis(basis).0;
        let rows: Vec<_> = held.chain(learned.column_iter()).collect();
        let weights = DMatrix::from_columns(&rows).transpose();
        let bias = -(&weights * mean(&self.training.states(None)));
        Ok(AffineMap::new("encoder", weights, bias)?)
    }

    /// `basis T` (`18 x d`) and the orthogonal `T` (`d x d`) for which its columns are simple in the sense of varimax,
    /// with body x and body z first and positive dominant entries.
    pub(super) fn canonical_basis(&self, basis: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
        let std = self.training.state_std();
        let loadings = |basis: &DMatrix<f64>| DMatrix::from_diagonal(&std) * basis;
        let mut basis = basis.clone();
        let mut turn = DMatrix::identity(basis.ncols(), basis.ncols());
        if self.options.encoder.rotate {
            turn = varimax(&loadings(&basis));
            basis *= &turn;
        }
        let (order, signs) = order_and_sign(&loadings(&basis), &[BODY_X, BODY_Z]);
        let arranged = |matrix: DMatrix<f64>| {
            let mut arranged = matrix.select_columns(&order);
            for (mut column, sign) in arranged.column_iter_mut().zip(&signs) {
                column *= *sign;
            }
            arranged
        };
        (arranged(basis), arranged(turn))
    }

    pub(super) fn encoded(&self, encoder: StateMap, decoder: StateMap) -> Maps {
        Maps {
            weights: mean_jacobian(&encoder, &self.training),
            training: Latent::of(&self.training, &encoder),
            validation: Latent::of(&self.validation, &encoder),
            encoder,
            decoder,
        }
    }

    /// Chosen dynamics for an encoder and its decoder.
    pub(super) fn fit_dynamics(
        &self,
        (encoder, decoder): (StateMap, StateMap),
        monitor: &mut Monitor<'_>,
    ) -> Result<Fitted, TrainError> {
        let maps = self.encoded(encoder, decoder);
        let (options, features) = (&self.options.regression, &self.features);
        let judge = Judge::new(features, maps.judged_set(self));
        let set = maps.training_set(self);
        check_terms(set, features, &self.library)?;
        let (xi, choice, candidates) = select(set, &self.knowledge, &judge, options, monitor)?;
        Ok(Fitted {
            maps,
            xi,
            score: choice.score,
            choice: Some((choice, candidates)),
        })
    }

    pub(super) fn seed_report(
        &self,
        fitted: &Fitted,
        seed: u64,
        losses: Option<Losses>,
    ) -> SeedReport {
        let std = self.training.state_std();
        let names = Robot::state_names();
        let rows = fitted.maps.weights.row_iter();
        SeedReport {
            seed,
            score: fitted.score,
            losses,
            active: fitted.xi.iter().map(active_terms).sum(),
            dominant: rows
                .map(|row| names[row.transpose().component_mul(&std).iamax()].clone())
                .collect(),
            judged: fitted.measure(&self.features, fitted.maps.judged_set(self)),
        }
    }

    /// The report of `fitted`; `judged` are its metrics on the jumps that candidates are judged by, kept only if there
    /// are validation jumps.
    pub(super) fn report(&self, fitted: &Fitted, judged: &SetMetrics) -> TrainReport {
        let names = Robot::state_names();
        let phases = self.training.phases.names().into_iter().zip(&fitted.xi);
        let (choice, candidates) = fitted.choice.clone().unzip();
        let validated = !self.validation.jumps.is_empty();
        let set = fitted.maps.training_set(self);
        TrainReport {
            encoded: self.active.iter().map(|&i| names[i].clone()).collect(),
            lift_loss: self.lift_loss(&fitted.maps.encoder, set),
            active_terms: phases
                .map(|(phase, xi)| PhaseTerms {
                    phase,
                    active: active_terms(xi),
                })
                .collect(),
            choice,
            candidates: candidates.unwrap_or(0),
            seeds: Vec::new(),
            support_overlap: None,
            deviations: Vec::new(),
            training: fitted.measure(&self.features, set),
            validation: validated.then(|| judged.clone()),
        }
    }

    /// Share of the training input's energy that the latent input cannot carry.
    fn lift_loss(&self, encoder: &StateMap, set: EncodedSet<'_>) -> f64 {
        if let Some(linear) = encoder.as_affine() {
            let (weights, input) = (linear.weights(), &self.moments.input);
            let carried = &input_projection(weights) * input * weights.transpose();
            return 1.0 - carried.trace() / input.trace().max(f64::MIN_POSITIVE);
        }
        let (mut missed, mut total) = (0.0, 0.0);
        for (jump, samples) in set.dataset.jumps.iter().zip(set.latent) {
            missed += (lift_samples(encoder, &jump.x, &samples.u_lat) - &jump.u).norm_squared();
            total += jump.u.norm_squared();
        }
        missed / total.max(f64::MIN_POSITIVE)
    }
}
