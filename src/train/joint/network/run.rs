//! One seed of a training of networks, and the model numbers it comes to.

use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{DMatrix, DVector};

use super::fold::{self, LatentBasis};
use super::loss::{Frame, NetworkLoss, NetworkParameters};
use super::stages::{train_decoder, train_together, train_xi};
use crate::model::{AffineMap, Layer, StateMap};
use crate::robot::STATE_DIM;
use crate::train::dataset::Quantity;
use crate::train::dynamics_fit::Fitted;
use crate::train::error::TrainError;
use crate::train::joint::batch::Batch;
use crate::train::joint::loss::{LossWeights, Losses};
use crate::train::latent::{fit_affine, map_samples, mean_jacobian};
use crate::train::options::{JointOptions, Transfer};
use crate::train::progress::Watch;
use crate::train::random::Random;
use crate::train::task::Task;

/// What all seeds share.
pub struct NetworkTask<'a> {
    /// Data, library and options.
    pub(in crate::train) task: &'a Task<'a>,
    /// Of the training recordings.
    pub(in crate::train) batches: &'a [Batch],
}

/// Networks and coefficients of one seed.
pub struct TrainedNetworks {
    parameters: NetworkParameters,
    frame: Frame,
}

impl NetworkTask<'_> {
    /// Trains one seed by the steps of section IV-D; `tell` is called after every epoch with the losses and the
    /// active terms.
    ///
    /// As published, the first step sees contact data only. Otherwise it sees whole jumps with one Xi a phase: a
    /// network says nothing about states that it was not trained on.
    pub fn learn(
        &self,
        seed: u64,
        weights: LossWeights,
        cancel: &AtomicBool,
        tell: &mut dyn FnMut(usize, &Losses, usize),
    ) -> (TrainedNetworks, Losses) {
        let JointOptions {
            schedule,
            unroll,
            transfer,
            ..
        } = &self.task.options.joint;
        let frame = self.frame();
        let mut parameters = self.start(seed);
        let coordinate_weights = self.task.options.encoder.coordinate_weights();
        let mut loss = NetworkLoss::new(
            &self.task.features,
            weights,
            coordinate_weights,
            frame.clone(),
            &parameters,
        )
        .with_unroll(*unroll);
        let mut listener = |epoch: usize, losses: &Losses, active: usize| {
            tell(epoch, losses, active);
            !cancel.load(Ordering::Relaxed)
        };
        let all: Vec<&Batch> = self.batches.iter().collect();
        let of_phase = |phase: usize| all.iter().copied().filter(move |b| b.phase == phase);
        let first: Vec<&Batch> = match transfer {
            Transfer::Published => of_phase(0).collect(),
            Transfer::Chosen => all.clone(),
        };
        let losses = train_together(
            &mut parameters,
            &first,
            &mut loss,
            weights,
            schedule,
            &mut listener,
        );
        let mut quiet = |_: usize, _: &Losses, _: usize| !cancel.load(Ordering::Relaxed);
        if *transfer == Transfer::Published {
            train_decoder(&mut parameters, &all, &frame, schedule, &mut quiet);
            for phase in 0..parameters.xi.len() {
                let own: Vec<&Batch> = of_phase(phase).collect();
                parameters.xi[phase].fill(self.task.options.joint.xi_start);
                train_xi(
                    &mut parameters,
                    phase,
                    &own,
                    &mut loss,
                    weights,
                    schedule,
                    &mut quiet,
                );
            }
        }
        (TrainedNetworks { parameters, frame }, losses)
    }

    /// Units in which the networks see the states: as they are, as published, or centred and in standard deviations.
    fn frame(&self) -> Frame {
        let mask: Vec<bool> = (0..STATE_DIM)
            .map(|i| self.task.active.contains(&i))
            .collect();
        let plain = Frame::plain(&mask);
        if self.task.options.joint.transfer == Transfer::Published {
            return plain;
        }
        let x = self.task.sets.training.gather(Quantity::X, None);
        let least = self.task.options.encoder.least_std * self.task.options.scaling.state;
        let spread: DVector<f64> = x
            .column_variance()
            .map(|variance| variance.sqrt().max(least).max(1e-6));
        let energy: f64 = self
            .task
            .active
            .iter()
            .map(|&i| spread[i] * spread[i])
            .sum();
        Frame {
            mean: x.column_mean(),
            factors: plain.factors.component_div(&spread),
            spread,
            latent: (energy / self.task.active.len().max(1) as f64).sqrt(),
        }
    }

    /// Where a seed starts.
    fn start(&self, seed: u64) -> NetworkParameters {
        let JointOptions { xi_start, maps, .. } = &self.task.options.joint;
        let d = self.task.options.latent_dim;
        let widths = |from: usize, hidden: &[usize], to: usize| {
            let mut widths = vec![from];
            widths.extend(hidden);
            widths.push(to);
            widths
        };
        let encoder = widths(STATE_DIM, &maps.encoder_layers, d);
        let decoder = widths(d, &maps.decoder_layers, STATE_DIM);
        let phases = self.task.sets.training.phases.patterns.len();
        NetworkParameters::random(
            (&encoder, &decoder),
            maps.activation,
            (self.task.features.library_dim(), phases, *xi_start),
            &mut Random::new(seed),
        )
    }

    /// The encoder before the first epoch.
    ///
    /// # Errors
    /// [`TrainError::Model`] if its numbers are not finite.
    pub fn starting_encoder(&self, seed: u64) -> Result<StateMap, TrainError> {
        let plain = LatentBasis::unchanged(self.task.options.latent_dim);
        let start = self.start(seed).encoder;
        Ok(fold::encoder(&start, &self.frame(), &plain)?)
    }

    /// The model numbers: as Adam left them, or with a telling latent basis, the decoder's last layer by least squares
    /// and Xi chosen among regressions.
    ///
    /// # Errors
    /// [`TrainError`]: numbers that are not finite, no stable model.
    pub(in crate::train) fn finish(
        &self,
        trained: &TrainedNetworks,
        watch: &mut Watch<'_>,
    ) -> Result<Fitted, TrainError> {
        let TrainedNetworks { parameters, frame } = trained;
        let plain = LatentBasis::unchanged(self.task.options.latent_dim);
        let encoder = fold::encoder(&parameters.encoder, frame, &plain)?;
        let x = self.task.sets.training.gather(Quantity::X, None);
        if self.task.options.joint.transfer == Transfer::Published {
            return Ok(Fitted {
                decoder: fold::decoder(&parameters.decoder, frame, &plain)?,
                weights: mean_jacobian(&encoder, &x),
                encoder,
                xi: parameters.xi.clone(),
                choice: None,
                training: None,
            });
        }
        let basis = self.basis(&encoder, &x);
        let encoder = fold::encoder(&parameters.encoder, frame, &basis)?;
        let decoder = fold::decoder(&parameters.decoder, frame, &basis)?;
        let decoder = with_fitted_last_layer(&decoder, &x, &map_samples(&encoder, &x))?;
        self.task.fit_dynamics((encoder, decoder), watch)
    }

    /// Mean combined loss over batches of all phases.
    pub fn published_score(&self, trained: &TrainedNetworks, judged: &[Batch]) -> f64 {
        let weights = self.task.options.joint.weights;
        let mut loss = NetworkLoss::new(
            &self.task.features,
            weights,
            self.task.options.encoder.coordinate_weights(),
            trained.frame.clone(),
            &trained.parameters,
        );
        let total: f64 = judged
            .iter()
            .map(|batch| loss.evaluate(&trained.parameters, batch).total(&weights))
            .sum();
        total / judged.len().max(1) as f64
    }

    /// The latent basis in which `J J^T` is the identity in the mean, rotated by varimax of the mean Jacobian, with
    /// the latents in a telling order and their mean at 0.
    fn basis(&self, encoder: &StateMap, x: &DMatrix<f64>) -> LatentBasis {
        let d = self.task.options.latent_dim;
        let gram = x.column_iter().fold(DMatrix::zeros(d, d), |sum, x| {
            let jacobian = encoder
                .jacobian(&x.into_owned())
                .expect("invariant: the encoder takes the robot's states");
            sum + &jacobian * jacobian.transpose()
        }) / x.ncols().max(1) as f64;
        // A basis without full rank is left as it is; the regression then says that no model is stable.
        let white = match gram.cholesky().and_then(|factor| factor.l().try_inverse()) {
            Some(inverse) => inverse,
            None => DMatrix::identity(d, d),
        };
        let mean = &white * mean_jacobian(encoder, x);
        let (_, rotation) = self.task.canonical_basis(&mean.transpose());
        let turn = rotation.transpose() * white;
        let back = match turn.clone().try_inverse() {
            Some(back) => back,
            None => return LatentBasis::unchanged(d),
        };
        let shift = -(&turn * map_samples(encoder, x).column_mean());
        LatentBasis { turn, back, shift }
    }
}

/// The decoder with its last layer, which is linear, of least square error from `z` to `x` (samples in columns).
fn with_fitted_last_layer(
    decoder: &StateMap,
    x: &DMatrix<f64>,
    z: &DMatrix<f64>,
) -> Result<StateMap, TrainError> {
    let mut layers: Vec<Layer> = decoder.layers().to_vec();
    let last = layers.pop().expect("invariant: a map has a layer");
    let hidden = match layers.is_empty() {
        true => z.clone(),
        false => map_samples(&StateMap::new("decoder", layers.clone())?, z),
    };
    let map: AffineMap = fit_affine(x, &hidden)?;
    layers.push(Layer { map, ..last });
    Ok(StateMap::new("decoder", layers)?)
}
