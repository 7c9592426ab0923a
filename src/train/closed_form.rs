//! Training without descent over the dynamics: encoder, decoder and Xi one after the other, in about a second.

use super::assemble::{Origin, Parts, assemble};
use super::error::TrainError;
use super::features::Features;
use super::finish::{
    Fitted, Sets, active_coordinates, check_latent_dim, encoder_over, fit_dynamics,
};
use super::latent::least_squares_decoder;
use super::options::TrainOptions;
use super::progress::Watch;
use super::report::{SeedReport, Trained};
use super::seeds::{Best, Seeds};
use super::subspace::{Moments, SubspaceOptions, find_subspace};
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
/// finishes with the seeds begun by then; seeds without a stable model are left out. Deterministic.
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
    let task = Task {
        sets: &sets,
        moments: &moments,
        features: &features,
        active: &active,
        options,
    };
    let mut seeds = Seeds::default();
    for seed in options.seeds() {
        if watch.cancelled() {
            break;
        }
        let outcome = task.fit(seed, watch);
        seeds.add(seed, outcome, watch)?;
    }
    let Best {
        fitted,
        reports,
        overlap,
    } = seeds.best(&library, &moments.state)?;
    let mut report = sets.report(&features, &fitted, &active);
    if reports.len() > 1 {
        (report.seeds, report.support_overlap) = (reports, overlap);
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

/// What all seeds share.
struct Task<'a> {
    sets: &'a Sets,
    moments: &'a Moments,
    features: &'a Features,
    active: &'a [usize],
    options: &'a TrainOptions,
}

impl Task<'_> {
    /// The numbers of one seed, and what it is compared by.
    fn fit(&self, seed: u64, watch: &mut Watch<'_>) -> Result<(SeedReport, Fitted), TrainError> {
        let (sets, options) = (self.sets, self.options);
        watch.stage("searching the latent space", 1);
        let search = SubspaceOptions {
            lift_weight: options.encoder.lift_weight,
            coordinate_weights: options.encoder.coordinate_weights(),
            iterations: 2000,
            restarts: options.encoder.restarts,
            seed,
        };
        let subspace = find_subspace(self.moments, self.active, options.latent_dim, &search)?;
        let encoder = encoder_over(&sets.training, &subspace.basis, options)?.into();
        let decoder = least_squares_decoder(&sets.training, &encoder)?.into();
        let fitted = fit_dynamics(sets, self.features, (encoder, decoder), options, watch)?;
        let score = fitted
            .choice
            .as_ref()
            .map_or(f64::INFINITY, |(choice, _)| choice.score);
        let report = sets.seed_report(self.features, &fitted, (seed, score), None);
        Ok((report, fitted))
    }
}
