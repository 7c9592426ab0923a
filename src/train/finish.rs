//! What every method does around its encoder: data sets, latent basis, decoder, chosen dynamics, figures.

use nalgebra::DMatrix;

use super::closed_form::Recordings;
use super::dataset::{Dataset, Quantity};
use super::error::TrainError;
use super::features::Features;
use super::joint::Losses;
use super::latent::{Latent, lift_samples, mean_jacobian};
use super::metrics::{Assessed, BODY_X, BODY_Z, measure};
use super::options::TrainOptions;
use super::progress::Watch;
use super::report::{PhaseTerms, SeedReport, TrainReport};
use super::rollout::Candidate;
use super::select::{Choice, Judge, select};
use super::sparse::active_terms;
use super::subspace::Moments;
use super::varimax::{order_and_sign, varimax};
use crate::model::{AffineMap, StateMap};
use crate::robot::Robot;

/// Training and validation jumps.
pub(super) struct Sets {
    pub training: Dataset,
    pub validation: Dataset,
}

/// Numbers of a model before they are put together.
pub(super) struct Fitted {
    pub encoder: StateMap,
    pub decoder: StateMap,
    /// `W_e`, of a nonlinear encoder the mean of its Jacobian over the training samples.
    pub weights: DMatrix<f64>,
    pub xi: Vec<DMatrix<f64>>,
    /// The regression, if Xi was chosen among regressions, and how many were tried.
    pub choice: Option<(Choice, usize)>,
}

impl Fitted {
    fn assessed<'a>(&'a self, features: &'a Features) -> Assessed<'a> {
        Assessed {
            candidate: Candidate {
                features,
                xi: &self.xi,
            },
            encoder: &self.encoder,
            decoder: &self.decoder,
        }
    }
}

impl Sets {
    /// Cuts the recordings into phases, checks options and samples.
    pub fn new(
        recordings: Recordings<'_>,
        robot: &Robot,
        options: &TrainOptions,
    ) -> Result<Self, TrainError> {
        options.check()?;
        let (scaling, smoothing) = (options.scaling.factors(), options.regression.smoothing);
        let read = |set| Dataset::new(set, robot, &options.phases, &scaling, smoothing);
        let training = read(recordings.training)?;
        training.check_for_training()?;
        Ok(Self {
            training,
            validation: read(recordings.validation)?,
        })
    }

    /// Moments of the training samples.
    pub fn moments(&self) -> Moments {
        let gather = |quantity| self.training.gather(quantity, None);
        Moments::new(&gather(Quantity::X), &gather(Quantity::U))
    }

    /// The jumps that candidates are judged by.
    pub fn judged(&self) -> &Dataset {
        if self.validation.jumps.is_empty() {
            &self.training
        } else {
            &self.validation
        }
    }

    /// The figures of what one seed came to.
    pub fn seed_report(
        &self,
        features: &Features,
        fitted: &Fitted,
        (seed, score): (u64, f64),
        losses: Option<Losses>,
    ) -> SeedReport {
        let std = self
            .training
            .gather(Quantity::X, None)
            .column_variance()
            .map(f64::sqrt);
        let names = Robot::state_names();
        let rows = fitted.weights.row_iter();
        SeedReport {
            seed,
            score,
            losses,
            active: fitted.xi.iter().map(active_terms).sum(),
            dominant: rows
                .map(|row| names[row.transpose().component_mul(&std).iamax()].clone())
                .collect(),
            judged: measure(fitted.assessed(features), self.judged()),
        }
    }

    /// Share of the training input's energy that the latent input cannot carry.
    fn lift_loss(&self, encoder: &StateMap) -> f64 {
        if let Some(linear) = encoder.as_affine() {
            return lift_loss(&self.moments(), linear.weights());
        }
        let latent = Latent::of(&self.training, encoder);
        let (mut missed, mut total) = (0.0, 0.0);
        for (jump, samples) in self.training.jumps.iter().zip(&latent) {
            missed += (lift_samples(encoder, &jump.x, &samples.u_lat) - &jump.u).norm_squared();
            total += jump.u.norm_squared();
        }
        missed / total.max(f64::MIN_POSITIVE)
    }

    /// The figures of fitted numbers.
    pub fn report(&self, features: &Features, fitted: &Fitted, active: &[usize]) -> TrainReport {
        let assessed = fitted.assessed(features);
        let names = Robot::state_names();
        let phases = self.training.phases.names().into_iter().zip(&fitted.xi);
        let (choice, candidates) = fitted.choice.clone().unzip();
        let validated = !self.validation.jumps.is_empty();
        TrainReport {
            encoded: active.iter().map(|&i| names[i].clone()).collect(),
            lift_loss: self.lift_loss(&fitted.encoder),
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
            training: measure(assessed, &self.training),
            validation: validated.then(|| measure(assessed, &self.validation)),
        }
    }
}

/// Coordinates that the encoder may look at.
pub(super) fn active_coordinates(moments: &Moments, options: &TrainOptions) -> Vec<usize> {
    let least_std = options.encoder.least_std * options.scaling.state;
    moments.active_coordinates(least_std, options.encoder.least_input_share)
}

/// Complains about no latent coordinate, or more than the encoder may look at.
pub(super) fn check_latent_dim(options: &TrainOptions, active: &[usize]) -> Result<(), TrainError> {
    if options.latent_dim == 0 || options.latent_dim > active.len() {
        return Err(TrainError::LatentDim {
            requested: options.latent_dim,
            active: active.len(),
        });
    }
    Ok(())
}

/// The encoder over a space with orthonormal `basis` (`18 x d`): rotated by varimax, latents in a telling order,
/// `b_e = -W_e mean(x)`.
pub(super) fn encoder_over(
    training: &Dataset,
    basis: &DMatrix<f64>,
    options: &TrainOptions,
) -> Result<AffineMap, TrainError> {
    let x = training.gather(Quantity::X, None);
    let weights = canonical_basis(training, basis, options).0.transpose();
    let bias = -(&weights * x.column_mean());
    Ok(AffineMap::new("encoder", weights, bias)?)
}

/// `basis T` (`18 x d`) and the orthogonal `T` (`d x d`) for which its columns are simple in the sense of varimax, in a
/// telling order and with telling signs.
pub(super) fn canonical_basis(
    training: &Dataset,
    basis: &DMatrix<f64>,
    options: &TrainOptions,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let x = training.gather(Quantity::X, None);
    let std = x.column_variance().map(f64::sqrt);
    let loadings = |basis: &DMatrix<f64>| DMatrix::from_diagonal(&std) * basis;
    let mut basis = basis.clone();
    let mut turn = DMatrix::identity(basis.ncols(), basis.ncols());
    if options.encoder.rotate {
        turn = varimax(&loadings(&basis));
        basis *= &turn;
    }
    let (order, signs) = order_and_sign(&loadings(&basis), &[BODY_X, BODY_Z]);
    let named = |matrix: DMatrix<f64>| {
        let mut named = matrix.select_columns(&order);
        for (mut column, sign) in named.column_iter_mut().zip(&signs) {
            column *= *sign;
        }
        named
    };
    (named(basis), named(turn))
}

/// Chosen dynamics for an encoder and its decoder.
pub(super) fn fit_dynamics(
    sets: &Sets,
    features: &Features,
    (encoder, decoder): (StateMap, StateMap),
    options: &TrainOptions,
    watch: &mut Watch<'_>,
) -> Result<Fitted, TrainError> {
    let latent = Latent::of(&sets.training, &encoder);
    let judged = Latent::of(sets.judged(), &encoder);
    let judge = Judge::new(sets.judged(), &judged, options.regression.rollout_weight);
    let selected = select(
        &sets.training,
        &latent,
        features,
        &judge,
        &options.regression,
        watch,
    )?;
    let choice = Some((selected.choice, selected.candidates));
    Ok(Fitted {
        weights: mean_jacobian(&encoder, &sets.training.gather(Quantity::X, None)),
        encoder,
        decoder,
        xi: selected.xi,
        choice,
    })
}

/// Share of the training input's energy outside the encoder's row space.
fn lift_loss(moments: &Moments, weights: &DMatrix<f64>) -> f64 {
    let projection = super::latent::input_projection(weights);
    let carried = &projection * &moments.input * weights.transpose();
    1.0 - carried.trace() / moments.input.trace().max(f64::MIN_POSITIVE)
}
