//! Training without descent over the dynamics: encoder, decoder and Xi one after the other, in about a second.

use nalgebra::{DMatrix, DVector};

use super::assemble::{Origin, Parts, assemble};
use super::dataset::{Dataset, Quantity};
use super::error::TrainError;
use super::features::Features;
use super::latent::{Latent, least_squares_decoder};
use super::metrics::{Assessed, BODY_X, BODY_Z, measure};
use super::options::{LibraryChoice, TrainOptions};
use super::progress::Watch;
use super::report::{PhaseTerms, TrainReport, Trained};
use super::rollout::Candidate;
use super::select::{Judge, Selected, select};
use super::sparse::active_terms;
use super::subspace::{Moments, Subspace, SubspaceOptions, find_subspace};
use super::varimax::{name_columns, varimax};
use crate::model::{AffineMap, Library};
use crate::recording::Recording;
use crate::robot::{Robot, STATE_DIM};

/// Recordings to learn from and to choose by.
#[derive(Clone, Copy, Debug)]
pub struct Recordings<'a> {
    /// Fitted.
    pub training: &'a [Recording],
    /// Used to choose between candidates; without any, the training recordings are.
    pub validation: &'a [Recording],
}

/// Learns a model: encoder by its row space, decoder by least squares, Xi by sparse regression.
///
/// The encoder's rows span the space of least reconstruction error and lift loss ([`find_subspace`]), rotated by
/// varimax; its bias puts the mean of the training states at `z = 0`. The decoder is the least-squares one over all
/// phases. Xi is chosen a phase among many regressions by rollouts ([`select`]). Deterministic.
///
/// # Errors
/// [`TrainError`]: options out of range, too few samples, too many latent coordinates, no stable model.
pub fn closed_form(
    recordings: Recordings<'_>,
    robot: &'static Robot,
    options: &TrainOptions,
    origin: &Origin,
    watch: &mut Watch<'_>,
) -> Result<Trained, TrainError> {
    options.check()?;
    let scaling = options.scaling.factors();
    let read = |set| {
        Dataset::new(
            set,
            robot,
            &options.phases,
            &scaling,
            options.regression.smoothing,
        )
    };
    let training = read(recordings.training)?;
    training.check_for_training()?;
    let validation = read(recordings.validation)?;
    watch.stage("searching the latent space", 1);
    let (active, subspace) = latent_space(&training, options)?;
    let library = library(options)?;
    let features = Features::new(&library);
    let encoder = encoder(&training, &subspace, options)?;
    let decoder = least_squares_decoder(&training, &encoder)?;

    let latent = Latent::of(&training, &encoder);
    let judged = if validation.jumps.is_empty() {
        &training
    } else {
        &validation
    };
    let judged_latent = Latent::of(judged, &encoder);
    let judge = Judge::new(judged, &judged_latent, options.regression.rollout_weight);
    let Selected {
        xi,
        choice,
        candidates,
    } = select(
        &training,
        &latent,
        &features,
        &judge,
        &options.regression,
        watch,
    )?;

    let assessed = Assessed {
        candidate: Candidate {
            features: &features,
            xi: &xi,
        },
        encoder: &encoder,
        decoder: &decoder,
    };
    let names = Robot::state_names();
    let report = TrainReport {
        encoded: active.iter().map(|&i| names[i].clone()).collect(),
        lift_loss: subspace.lift_loss,
        active_terms: phase_terms(&training, &xi),
        choice,
        candidates,
        training: measure(assessed, &training),
        validation: (!validation.jumps.is_empty()).then(|| measure(assessed, &validation)),
    };
    let parts = Parts {
        library,
        encoder,
        decoder,
        xi,
    };
    let model = assemble(
        parts,
        &training,
        robot,
        options,
        "closed-form",
        origin,
        &report,
    )?;
    Ok(Trained { model, report })
}

fn library(options: &TrainOptions) -> Result<Library, TrainError> {
    let library = match &options.library {
        LibraryChoice::Standard(standard) => Library::standard(options.latent_dim, *standard),
        LibraryChoice::Terms(terms) => Library::from_terms(options.latent_dim, terms),
    };
    library.map_err(|error| TrainError::Model(error.into()))
}

/// Coordinates the encoder may look at, and the best space over them.
fn latent_space(
    training: &Dataset,
    options: &TrainOptions,
) -> Result<(Vec<usize>, Subspace), TrainError> {
    let moments = Moments::new(
        &training.gather(Quantity::X, None),
        &training.gather(Quantity::U, None),
    );
    let encoder = &options.encoder;
    let active = moments.active_coordinates(
        encoder.least_std * options.scaling.state,
        encoder.least_input_share,
    );
    let is_body_position = |i: usize| (BODY_X..=BODY_Z).contains(&i);
    let subspace_options = SubspaceOptions {
        lift_weight: encoder.lift_weight,
        coordinate_weights: DVector::from_fn(STATE_DIM, |i, _| {
            if is_body_position(i) {
                encoder.body_weight
            } else {
                1.0
            }
        }),
        iterations: 2000,
        restarts: encoder.restarts,
        seed: options.seed,
    };
    let subspace = find_subspace(&moments, &active, options.latent_dim, &subspace_options)?;
    Ok((active, subspace))
}

/// The encoder over a space: rotated, latents in a telling order, `b_e = -W_e mean(x)`.
fn encoder(
    training: &Dataset,
    subspace: &Subspace,
    options: &TrainOptions,
) -> Result<AffineMap, TrainError> {
    let x = training.gather(Quantity::X, None);
    let std = x.column_variance().map(f64::sqrt);
    let loadings = |basis: &DMatrix<f64>| DMatrix::from_diagonal(&std) * basis;
    let mut basis = subspace.basis.clone();
    if options.encoder.rotate {
        basis *= varimax(&loadings(&basis));
    }
    let (order, signs) = name_columns(&loadings(&basis), &[BODY_X, BODY_Z]);
    let mut weights = basis.select_columns(&order).transpose();
    for (mut row, sign) in weights.row_iter_mut().zip(signs) {
        row *= sign;
    }
    let bias = -(&weights * x.column_mean());
    Ok(AffineMap::new("encoder", weights, bias)?)
}

fn phase_terms(dataset: &Dataset, xi: &[DMatrix<f64>]) -> Vec<PhaseTerms> {
    let names = dataset.phases.names();
    names
        .into_iter()
        .zip(xi)
        .map(|(phase, xi)| PhaseTerms {
            phase,
            active: active_terms(xi),
        })
        .collect()
}
