//! Training without descent over the dynamics: encoder, decoder and Xi one after the other, in seconds.

use super::latent::least_squares_decoder;
use super::seeds::{Outcome, Seeds};
use super::subspace::find_subspace;
use super::*;

/// Learns a model: encoder by its row space (`subspace`), decoder by least squares, Xi by sparse regression, chosen
/// among many by rollouts (`select`).
pub(super) fn closed_form(
    recordings: Recordings<'_>,
    robot: &'static Robot,
    options: &TrainOptions,
    origin: &Origin,
    monitor: &mut Monitor<'_>,
) -> Result<Trained> {
    let maps = &options.joint.maps;
    if !maps.is_linear() {
        return Err(TrainError::Option {
            option: "encoder-layers or decoder-layers",
            found: format!("{:?} and {:?}", maps.encoder_layers, maps.decoder_layers),
            expected: "none with the closed form, which learns linear maps; use `--method joint`",
        });
    }
    let task = Task::new(recordings, robot, options)?;
    let mut seeds = Seeds::default();
    for seed in options.seeds() {
        if monitor.cancelled() {
            break;
        }
        seeds.add(seed, fit(&task, seed, monitor), monitor)?;
    }
    seeds.into_model(task, "closed-form", origin)
}

fn fit(task: &Task<'_>, seed: u64, monitor: &mut Monitor<'_>) -> Outcome {
    let options = task.options;
    monitor.stage("searching the latent space", None);
    let (frame, d) = (&task.frame, options.latent_dim);
    let basis = find_subspace(&task.moments, frame, d, &options.encoder, seed);
    let encoder = task.encoder_over(&basis)?.into();
    let decoder = least_squares_decoder(&task.training, &encoder, None)?.into();
    let fitted = task.fit_dynamics((encoder, decoder), monitor)?;
    let report = task.seed_report(&fitted, seed, None);
    Ok((report, fitted))
}
