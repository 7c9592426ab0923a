//! Training without descent over the dynamics: encoder, decoder and Xi one after the other, in about a second.

use super::assemble::{Origin, Parts, assemble};
use super::error::TrainError;
use super::features::Features;
use super::finish::{
    Fitted, Sets, active_coordinates, check_latent_dim, encoder_over, fit_dynamics,
};
use super::latent::least_squares_decoder;
use super::options::TrainOptions;
use super::overlap::support_overlap;
use super::progress::Watch;
use super::report::{SeedReport, Trained};
use super::subspace::{SubspaceOptions, find_subspace};
use crate::recording::Recording;
use crate::robot::Robot;

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
/// phases. Xi is chosen a phase among many regressions by rollouts ([`select`](super::select)). A cancelled training
/// finishes with the seeds begun by then. Deterministic.
///
/// # Errors
/// [`TrainError`]: options out of range, too few samples, too many latent coordinates, no stable model, cancelled
/// before the first seed.
pub fn closed_form(
    recordings: Recordings<'_>,
    robot: &'static Robot,
    options: &TrainOptions,
    origin: &Origin,
    watch: &mut Watch<'_>,
) -> Result<Trained, TrainError> {
    let maps = &options.joint.maps;
    if !maps.is_linear() {
        return Err(TrainError::Option {
            option: "encoder-layers or decoder-layers",
            found: format!("{:?} and {:?}", maps.encoder_layers, maps.decoder_layers),
            expected: "none with the closed form, which learns linear maps; take `--method joint`",
        });
    }
    let sets = Sets::new(recordings, robot, options)?;
    let moments = sets.moments();
    let active = active_coordinates(&moments, options);
    check_latent_dim(options, &active)?;
    let library = options.library()?;
    let features = Features::new(&library);
    let mut tried = Vec::new();
    for seed in options.seeds() {
        if watch.cancelled() {
            break;
        }
        watch.stage("searching the latent space", 1);
        let search = SubspaceOptions {
            lift_weight: options.encoder.lift_weight,
            coordinate_weights: options.encoder.coordinate_weights(),
            iterations: 2000,
            restarts: options.encoder.restarts,
            seed,
        };
        let subspace = find_subspace(&moments, &active, options.latent_dim, &search)?;
        let encoder = encoder_over(&sets.training, &subspace.basis, options)?.into();
        let decoder = least_squares_decoder(&sets.training, &encoder)?.into();
        let fitted = fit_dynamics(&sets, &features, (encoder, decoder), options, watch)?;
        let score = fitted
            .choice
            .as_ref()
            .map_or(f64::INFINITY, |(choice, _)| choice.score);
        tried.push((
            sets.seed_report(&features, &fitted, (seed, score), None),
            fitted,
        ));
    }
    if tried.is_empty() {
        return Err(TrainError::Cancelled);
    }
    let fits: Vec<&Fitted> = tried.iter().map(|(_, fitted)| fitted).collect();
    let overlap = support_overlap(&library, &fits, &moments.state);
    tried.sort_by(|(a, _), (b, _)| a.score.total_cmp(&b.score));
    let (seeds, mut fits): (Vec<SeedReport>, Vec<Fitted>) = tried.into_iter().unzip();
    let fitted = fits.swap_remove(0);
    let mut report = sets.report(&features, &fitted, &active);
    if seeds.len() > 1 {
        (report.seeds, report.support_overlap) = (seeds, overlap);
    }
    let parts = Parts {
        library,
        encoder: fitted.encoder,
        decoder: fitted.decoder,
        xi: fitted.xi,
    };
    let model = assemble(
        parts,
        &sets.training,
        robot,
        options,
        "closed-form",
        origin,
        &report,
    )?;
    Ok(Trained { model, report })
}
