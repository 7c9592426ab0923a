//! Training without descent over the dynamics: encoder, decoder and Xi one after the other, in about a second.

use super::assemble::{Origin, Parts, assemble};
use super::error::TrainError;
use super::features::Features;
use super::finish::{Sets, active_coordinates, encoder_over, fit_dynamics};
use super::options::TrainOptions;
use super::progress::Watch;
use super::report::Trained;
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
/// phases. Xi is chosen a phase among many regressions by rollouts ([`select`](super::select)). Deterministic.
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
    let sets = Sets::new(recordings, robot, options)?;
    watch.stage("searching the latent space", 1);
    let moments = sets.moments();
    let active = active_coordinates(&moments, options);
    let search = SubspaceOptions {
        lift_weight: options.encoder.lift_weight,
        coordinate_weights: options.encoder.coordinate_weights(),
        iterations: 2000,
        restarts: options.encoder.restarts,
        seed: options.seed,
    };
    let subspace = find_subspace(&moments, &active, options.latent_dim, &search)?;
    let library = options.library()?;
    let features = Features::new(&library);
    let encoder = encoder_over(&sets.training, &subspace.basis, options)?;
    let fitted = fit_dynamics(&sets, &features, encoder, options, watch)?;
    let report = sets.report(&features, &fitted, &active);
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
