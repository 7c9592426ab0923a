//! The three transfer steps of section IV-D.
//!
//! Steps two and three move only the decoder or only Xi; of linear maps on losses that compute most of a batch once
//! ([`Maps::decoder_loss`](super::loss::Maps::decoder_loss), [`Maps::xi_loss`](super::loss::Maps::xi_loss)); the
//! iterates are those of the whole loss.

use std::collections::BTreeSet;

use super::batch::Batch;
use super::descent::{Adam, MaskedAdam, Schedule};
use super::loss::{DecoderLoss, JointLoss, Losses, XiLoss};
use super::parameters::Parameters;

/// Called after every epoch with its number, the losses and the active terms. Returns whether to go on.
pub(super) type Listener<'a> = dyn FnMut(usize, &Losses, usize) -> bool + 'a;

/// Encoder, decoder and Xi together; every batch moves the Xi of its phase. Returns the mean losses of the last epoch.
pub(super) fn train_together(
    parameters: &mut Parameters,
    batches: &[&Batch],
    loss: &mut JointLoss<'_>,
    schedule: &Schedule,
    listener: &mut Listener<'_>,
) -> Losses {
    let mut maps = optimisers(parameters.maps(), schedule);
    let phases: BTreeSet<usize> = batches.iter().map(|batch| batch.phase).collect();
    let mut coefficients: Vec<MaskedAdam> = (parameters.xi.iter())
        .map(|xi| MaskedAdam::new(xi, schedule))
        .collect();
    let mut mean = Losses::default();
    for epoch in 0..schedule.total() {
        for &phase in &phases {
            coefficients[phase].start_epoch(epoch, schedule, &mut parameters.xi[phase]);
        }
        loss.start_epoch(epoch, schedule);
        mean = Losses::default();
        for batch in batches {
            let losses = loss.evaluate(parameters, batch);
            mean = mean.plus(&losses, 1.0 / batches.len() as f64);
            let (gradient, phase) = (loss.gradient(), batch.phase);
            step(&mut maps, parameters.maps_mut(), gradient.maps());
            coefficients[phase].step(&mut parameters.xi[phase], &gradient.xi[phase]);
        }
        let active = phases.iter().map(|&phase| coefficients[phase].active());
        if !listener(epoch + 1, &mean, active.sum()) {
            break;
        }
    }
    mean
}

/// The decoder alone, on batches of all phases.
pub(super) fn train_decoder(
    parameters: &mut Parameters,
    batches: &[&Batch],
    loss: &mut JointLoss<'_>,
    schedule: &Schedule,
    listener: &mut Listener<'_>,
) {
    let part = |batch: &&Batch| loss.maps.decoder_loss(parameters, batch);
    let parts: Option<Vec<DecoderLoss>> = batches.iter().map(part).collect();
    loss.count_reconstruction_only();
    let mut optimisers = optimisers(parameters.decoder.blocks(), schedule);
    let mut gradient = parameters.decoder.clone();
    for epoch in 0..schedule.total() {
        let mut mean = Losses::default();
        for (index, batch) in batches.iter().enumerate() {
            let value = match &parts {
                Some(parts) => parts[index](&parameters.decoder, &mut gradient),
                None => {
                    let losses = loss.evaluate(parameters, batch);
                    gradient.clone_from(&loss.gradient().decoder);
                    losses.decoder
                }
            };
            mean.decoder += value / batches.len() as f64;
            step(
                &mut optimisers,
                parameters.decoder.blocks_mut(),
                gradient.blocks(),
            );
        }
        if !listener(epoch + 1, &mean, 0) {
            break;
        }
    }
}

/// Xi of one phase alone, on its batches, from the value that `parameters` has.
///
/// Where the loss has predictions over a window (41), the whole of it is evaluated.
pub(super) fn train_xi(
    parameters: &mut Parameters,
    phase: usize,
    batches: &[&Batch],
    loss: &mut JointLoss<'_>,
    schedule: &Schedule,
    listener: &mut Listener<'_>,
) {
    let xi_loss = |batch: &&Batch| loss.maps.xi_loss(parameters, batch, loss.features);
    let parts: Option<Vec<XiLoss>> = match loss.weights.bptt == 0.0 {
        true => batches.iter().map(xi_loss).collect(),
        false => None,
    };
    let mut masked = MaskedAdam::new(&parameters.xi[phase], schedule);
    for epoch in 0..schedule.total() {
        masked.start_epoch(epoch, schedule, &mut parameters.xi[phase]);
        let weights = loss.start_epoch(epoch, schedule);
        let mut mean = Losses::default();
        for (index, batch) in batches.iter().enumerate() {
            let (losses, gradient) = match &parts {
                Some(parts) => parts[index](&parameters.xi[phase], weights),
                None => {
                    let losses = loss.evaluate(parameters, batch);
                    (losses, loss.gradient().xi[phase].clone())
                }
            };
            mean = mean.plus(&losses, 1.0 / batches.len() as f64);
            masked.step(&mut parameters.xi[phase], &gradient);
        }
        if !listener(epoch + 1, &mean, masked.active()) {
            break;
        }
    }
}

fn optimisers<'a>(blocks: impl Iterator<Item = &'a [f64]>, schedule: &Schedule) -> Vec<Adam> {
    let rate = schedule.learning_rate;
    blocks.map(|block| Adam::new(block.len(), rate)).collect()
}

fn step<'a>(
    optimisers: &mut [Adam],
    blocks: impl Iterator<Item = &'a mut [f64]>,
    gradients: impl Iterator<Item = &'a [f64]>,
) {
    for ((optimiser, block), gradient) in optimisers.iter_mut().zip(blocks).zip(gradients) {
        optimiser.step(block, gradient);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::model::Activation;
    use crate::train::features::Features;
    use crate::train::joint::linear::{LinearMaps, mask_rows};
    use crate::train::joint::loss::{LossWeights, Maps};
    use crate::train::joint::nonlinear::NonlinearMaps;
    use crate::train::joint::parameters::Frame;
    use crate::train::joint::unroll::Unroll;
    use crate::train::oscillator::standard_library;
    use crate::train::random::Random;

    const WEIGHTS: LossWeights = LossWeights {
        ddz: 0.5,
        ddx: 0.3,
        l1: 0.01,
        lift: 0.2,
        bptt: 0.0,
    };
    const MASK: [bool; 6] = [true, true, false, true, true, true];

    /// Linear maps for the linear activation, else networks with a hidden layer; batches of two phases.
    fn setup(kind: Activation, features: &Features) -> (Vec<Batch>, Parameters, JointLoss<'_>) {
        let mut random = Random::new(21);
        let batch = |i: usize| {
            let blocks = std::array::from_fn(|_| random.matrix(40, 6, 0.5));
            Batch::new(i % 2, blocks, 0.002)
        };
        let batches = (0..4).map(batch).collect();
        let is_linear = kind == Activation::Linear;
        let widths: (&[usize], &[usize]) = match is_linear {
            true => (&[6, 2], &[2, 6]),
            false => (&[6, 5, 2], &[2, 5, 6]),
        };
        let shape = (features.library_dim(), 2, 0.1);
        let mut parameters = Parameters::random(widths, kind, shape, &mut Random::new(22));
        let uniform = DVector::from_element(6, 1.0);
        let maps: Box<dyn Maps> = if is_linear {
            mask_rows(&mut parameters.encoder.layers[0].weights, &MASK);
            Box::new(LinearMaps::new(uniform, MASK.to_vec()))
        } else {
            Box::new(NonlinearMaps::new(uniform, Frame::plain(&MASK)))
        };
        let loss = JointLoss::new(features, maps, (WEIGHTS, Unroll::default()), &parameters);
        (batches, parameters, loss)
    }

    #[test]
    fn xi_or_decoder_alone_moves_as_in_the_whole_loss() {
        let schedule = Schedule {
            epochs: 4,
            refinement: 0,
            threshold_every: 0,
            learning_rate: 1e-2,
            ..Schedule::default()
        };
        let features = Features::new(&standard_library(2, 1, true));
        let (batches, mut fast, mut loss) = setup(Activation::Linear, &features);
        let all: Vec<&Batch> = batches.iter().collect();
        let own: Vec<&Batch> = batches.iter().filter(|batch| batch.phase == 1).collect();
        let mut slow = fast.clone();
        let mut go = |_: usize, _: &Losses, _: usize| true;
        train_xi(&mut fast, 1, &own, &mut loss, &schedule, &mut go);
        let mut optimiser = Adam::new(slow.xi[1].len(), 1e-2);
        for batch in own.iter().cycle().take(4 * own.len()) {
            loss.evaluate(&slow, batch);
            let gradient = loss.gradient().xi[1].as_slice();
            optimiser.step(slow.xi[1].as_mut_slice(), gradient);
        }
        assert!((&fast.xi[1] - &slow.xi[1]).amax() < 1e-10);
        assert_eq!(fast.xi[0], slow.xi[0]);
        train_decoder(&mut fast, &all, &mut loss, &schedule, &mut go);
        let mut maps = optimisers(slow.decoder.blocks(), &schedule);
        for batch in batches.iter().cycle().take(4 * batches.len()) {
            loss.evaluate(&slow, batch); // counts what the step before left it to count
            let gradient = loss.gradient().decoder.blocks();
            step(&mut maps, slow.decoder.blocks_mut(), gradient);
        }
        for (fast, slow) in fast.decoder.blocks().zip(slow.decoder.blocks()) {
            assert!(fast.iter().zip(slow).all(|(a, b)| (a - b).abs() < 1e-10));
        }
    }

    #[test]
    fn training_together_lowers_the_loss_and_masks_coordinates_and_small_coefficients() {
        let schedule = Schedule {
            epochs: 40,
            refinement: 20,
            threshold: 0.09,
            threshold_every: 10,
            learning_rate: 1e-2,
        };
        let features = Features::new(&standard_library(2, 1, true));
        for kind in [Activation::Linear, Activation::Elu] {
            let (batches, mut parameters, mut loss) = setup(kind, &features);
            let all: Vec<&Batch> = batches.iter().collect();
            let masked = parameters.encoder.layers[0].weights.row(2).into_owned();
            let (mut history, mut counts) = (Vec::new(), Vec::new());
            let mut listen = |_: usize, losses: &Losses, active: usize| {
                history.push(losses.total(&WEIGHTS));
                counts.push(active);
                true
            };
            train_together(&mut parameters, &all, &mut loss, &schedule, &mut listen);
            assert!(history[59] < history[0], "{history:?}");
            assert_eq!(parameters.encoder.layers[0].weights.row(2), masked);
            assert!(counts[59] < counts[0] && counts.windows(2).all(|pair| pair[1] <= pair[0]));
            let left = |xi: &DMatrix<f64>| xi.iter().filter(|value| **value != 0.0).count();
            assert_eq!(parameters.xi.iter().map(left).sum::<usize>(), counts[59]);
        }
    }
}
