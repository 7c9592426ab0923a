//! The three transfer steps of section IV-D for networks.
//!
//! As for linear maps, steps two and three move only the decoder or only Xi. Xi enters its loss quadratically (but for
//! the L1 term), with a Jacobian of the decoder at every sample, so that the networks are evaluated once.

use nalgebra::{DMatrix, DVector};

use super::layers::{Network, Tape};
use super::loss::{Frame, NetworkLoss, NetworkParameters, encode};
use crate::train::features::{FeatureValues, Features};
use crate::train::joint::adam::Adam;
use crate::train::joint::batch::Batch;
use crate::train::joint::loss::{LossWeights, Losses, l1_subgradient};
use crate::train::joint::multiply::{Columns, add_product, add_transposed};
use crate::train::joint::schedule::{MaskedAdam, Schedule};
use crate::train::joint::stages::Listener;

/// Encoder, decoder and Xi together; every batch moves the Xi of its phase.
///
/// Returns the mean losses of the last epoch.
pub fn train_together(
    parameters: &mut NetworkParameters,
    batches: &[&Batch],
    loss: &mut NetworkLoss<'_>,
    weights: LossWeights,
    schedule: &Schedule,
    listener: &mut Listener<'_>,
) -> Losses {
    let mut encoder = MapOptimiser::new(&parameters.encoder, schedule);
    let mut decoder = MapOptimiser::new(&parameters.decoder, schedule);
    let mut coefficients: Vec<MaskedAdam> = (parameters.xi.iter())
        .map(|xi| MaskedAdam::new(xi, schedule))
        .collect();
    let mut last = Losses::default();
    for epoch in 0..schedule.total() {
        for (masked, xi) in coefficients.iter_mut().zip(&mut parameters.xi) {
            masked.start_epoch(epoch, schedule, xi);
        }
        loss.set_weights(schedule.weights_at(epoch, weights));
        let mut mean = Losses::default();
        for batch in batches {
            let losses = loss.evaluate(parameters, batch);
            mean = mean.plus(&losses, 1.0 / batches.len() as f64);
            let gradient = loss.gradient();
            encoder.step(&mut parameters.encoder, &gradient.encoder);
            decoder.step(&mut parameters.decoder, &gradient.decoder);
            let phase = batch.phase;
            coefficients[phase].step(&mut parameters.xi[phase], &gradient.xi[phase]);
        }
        last = mean;
        let count = coefficients.iter().map(MaskedAdam::active);
        if !listener(epoch + 1, &last, count.sum()) {
            break;
        }
    }
    last
}

/// The decoder alone, on batches of all phases.
pub fn train_decoder(
    parameters: &mut NetworkParameters,
    batches: &[&Batch],
    frame: &Frame,
    schedule: &Schedule,
    listener: &mut Listener<'_>,
) {
    let mut tape = Tape::default();
    let entering: Vec<DMatrix<f64>> = (batches.iter())
        .map(|batch| {
            let states = frame.enter(batch).rows(0, batch.len()).into_owned();
            (parameters.encoder).forward(states, batch.len(), &mut tape)
        })
        .collect();
    let mut optimiser = MapOptimiser::new(&parameters.decoder, schedule);
    let mut gradient = parameters.decoder.zeros_like();
    for epoch in 0..schedule.total() {
        let mut mean = Losses::default();
        for (batch, z) in batches.iter().zip(&entering) {
            gradient.blocks_mut().for_each(|block| block.fill(0.0));
            let mut leaving = parameters
                .decoder
                .forward(z.clone(), batch.len(), &mut tape);
            let share = 1.0 / leaving.len() as f64;
            for (i, mut column) in leaving.column_iter_mut().enumerate() {
                for (value, x) in column.iter_mut().zip(batch.x.column(i).iter()) {
                    let miss = frame.mean[i] + frame.spread[i] * *value - x;
                    mean.decoder += share * miss * miss / batches.len() as f64;
                    *value = 2.0 * share * frame.spread[i] * miss;
                }
            }
            (parameters.decoder).backward(&tape, leaving, &[], &mut gradient);
            optimiser.step(&mut parameters.decoder, &gradient);
        }
        if !listener(epoch + 1, &mean, 0) {
            break;
        }
    }
}

/// Xi of one phase alone, on its batches, from what `parameters` has.
///
/// Where the loss has predictions over a window (41), the whole of it is evaluated instead.
pub fn train_xi(
    parameters: &mut NetworkParameters,
    phase: usize,
    batches: &[&Batch],
    loss: &mut NetworkLoss<'_>,
    weights: LossWeights,
    schedule: &Schedule,
    listener: &mut Listener<'_>,
) {
    let features = loss.features();
    let samples: Vec<XiSamples> = if weights.bptt == 0.0 {
        let samples = batches
            .iter()
            .map(|batch| XiSamples::new(parameters, batch, features, loss.frame()));
        samples.collect()
    } else {
        Vec::new()
    };
    let mut masked = MaskedAdam::new(&parameters.xi[phase], schedule);
    for epoch in 0..schedule.total() {
        masked.start_epoch(epoch, schedule, &mut parameters.xi[phase]);
        let weights = schedule.weights_at(epoch, weights);
        loss.set_weights(weights);
        let mut mean = Losses::default();
        for (index, batch) in batches.iter().enumerate() {
            let share = 1.0 / batches.len() as f64;
            let (losses, gradient) = match samples.get(index) {
                Some(samples) => samples.evaluate(&parameters.xi[phase], weights),
                None => {
                    let losses = loss.evaluate(parameters, batch);
                    (losses, loss.gradient().xi[phase].clone())
                }
            };
            mean = mean.plus(&losses, share);
            masked.step(&mut parameters.xi[phase], &gradient);
        }
        if !listener(epoch + 1, &mean, masked.active()) {
            break;
        }
    }
}

/// Adam on the blocks of a network.
struct MapOptimiser(Vec<Adam>);

impl MapOptimiser {
    fn new(network: &Network, schedule: &Schedule) -> Self {
        let blocks = network.blocks();
        Self(
            blocks
                .map(|block| Adam::new(block.len(), schedule.learning_rate))
                .collect(),
        )
    }

    fn step(&mut self, network: &mut Network, gradient: &Network) {
        let blocks = network.blocks_mut().zip(gradient.blocks());
        for (optimiser, (block, gradient)) in self.0.iter_mut().zip(blocks) {
            optimiser.step(block, gradient);
        }
    }
}

/// (17) and (18) of one batch as quadratic functions of the predicted `ddz`: with the decoder's Jacobian `J_D`, the
/// decoded acceleration is `J_D ddz + (dJ_D/dt) dz`.
struct XiSamples {
    theta: DMatrix<f64>,
    ddz: DMatrix<f64>,
    gram: Vec<DVector<f64>>, // J_D^T J_D of all samples, entry by entry, row-major
    shared: DMatrix<f64>,    // J_D^T (ddx - dJ_D/dt dz), n x d
    energy: f64,             // sum of squares of ddx - dJ_D/dt dz
    state_dim: usize,
}

impl XiSamples {
    fn new(
        parameters: &NetworkParameters,
        batch: &Batch,
        features: &Features,
        frame: &Frame,
    ) -> Self {
        let (n, d, state_dim) = (batch.len(), features.latent_dim(), batch.x.ncols());
        let mut tape = Tape::default();
        let encoded = encode(parameters, batch, frame, &mut tape);
        let theta = features.evaluate(&encoded.variables, &mut FeatureValues::default());
        let ddz = encoded.stack.rows(2 * n, n).into_owned();
        let mut entering = encoded.stack;
        entering.rows_mut(2 * n, n).fill(0.0);
        entering /= frame.latent;
        let leaving = parameters.decoder.forward(entering, n, &mut tape);
        let jacobians = parameters.decoder.jacobian(&tape).rows;
        let mut samples = Self {
            theta,
            ddz,
            gram: vec![DVector::zeros(n); d * d],
            shared: DMatrix::zeros(n, d),
            energy: 0.0,
            state_dim,
        };
        for i in 0..state_dim {
            let rows = jacobians.rows(i * n, n) * (frame.spread[i] / frame.latent);
            let drift = leaving.view((2 * n, i), (n, 1)) * frame.spread[i];
            let rest = batch.ddx.column(i) - drift.column(0);
            samples.energy += rest.norm_squared();
            for a in 0..d {
                let mut shared = samples.shared.column_mut(a);
                shared += rows.column(a).component_mul(&rest);
                for b in 0..d {
                    samples.gram[a * d + b] += rows.column(a).component_mul(&rows.column(b));
                }
            }
        }
        samples
    }

    fn evaluate(&self, xi: &DMatrix<f64>, weights: LossWeights) -> (Losses, DMatrix<f64>) {
        let (n, d) = self.ddz.shape();
        let mut predicted = DMatrix::zeros(n, d);
        add_product(&mut predicted, 1.0, &self.theta, xi);
        let mut own = DMatrix::zeros(n, d);
        for a in 0..d {
            for b in 0..d {
                let product = self.gram[a * d + b].component_mul(&predicted.column(b));
                let mut column = own.column_mut(a);
                column += product;
            }
        }
        let (latent_scale, real_scale) = (1.0 / (n * d) as f64, 1.0 / (n * self.state_dim) as f64);
        let miss = &predicted - &self.ddz;
        let mut losses = Losses {
            ddz: latent_scale * miss.norm_squared(),
            ddx: real_scale
                * (predicted.dot(&own) - 2.0 * predicted.dot(&self.shared) + self.energy),
            ..Losses::default()
        };
        let pull = miss * (2.0 * weights.ddz * latent_scale)
            + (own - &self.shared) * (2.0 * weights.ddx * real_scale);
        let mut gradient = DMatrix::zeros(xi.nrows(), d);
        let (theta, pull) = (Columns::all(&self.theta), Columns::all(&pull));
        add_transposed(&mut gradient, 1.0, theta, pull);
        losses.l1 = l1_subgradient(xi, weights.l1 / xi.len() as f64, &mut gradient);
        (losses, gradient)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Activation, Library, StandardLibrary};
    use crate::train::random::Random;

    const WEIGHTS: LossWeights = LossWeights {
        ddz: 0.5,
        ddx: 0.3,
        l1: 0.01,
        lift: 0.2,
        bptt: 0.0,
    };

    fn setup() -> (Features, Vec<Batch>, NetworkParameters) {
        let standard = StandardLibrary {
            degree: 1,
            trigonometric: true,
            inputs: true,
        };
        let features = Features::new(&Library::standard(2, standard).expect("small library"));
        let mut random = Random::new(21);
        let batch = |i: usize| {
            let blocks = std::array::from_fn(|_| random.matrix(40, 6, 0.5));
            Batch::new(i % 2, blocks, 0.002)
        };
        let batches = (0..4).map(batch).collect();
        let mut random = Random::new(22);
        let shape = (features.library_dim(), 2, 0.1);
        let widths: (&[usize], &[usize]) = (&[6, 5, 2], &[2, 5, 6]);
        let parameters = NetworkParameters::random(widths, Activation::Elu, shape, &mut random);
        (features, batches, parameters)
    }

    fn loss<'a>(features: &'a Features, parameters: &NetworkParameters) -> NetworkLoss<'a> {
        let frame = Frame::plain(&[true, true, false, true, true, true]);
        let weights = DVector::from_element(6, 1.0);
        NetworkLoss::new(features, WEIGHTS, weights, frame, parameters)
    }

    fn short(epochs: usize) -> Schedule {
        Schedule {
            epochs,
            refinement: 0,
            threshold_every: 0,
            learning_rate: 1e-2,
            ..Schedule::default()
        }
    }

    #[test]
    fn training_together_lowers_the_loss_and_keeps_masked_coordinates_out() {
        let (features, batches, mut parameters) = setup();
        let all: Vec<&Batch> = batches.iter().collect();
        let mut loss = loss(&features, &parameters);
        let start = parameters.encoder.layers[0].weights.row(2).into_owned();
        let mut history = Vec::new();
        let mut listen = |_: usize, losses: &Losses, _: usize| {
            history.push(losses.total(&WEIGHTS));
            true
        };
        train_together(
            &mut parameters,
            &all,
            &mut loss,
            WEIGHTS,
            &short(60),
            &mut listen,
        );
        assert!(history[59] < 0.7 * history[0], "{history:?}");
        // The frame passes nothing of the masked coordinate on, so that nothing pulls at its weights.
        assert_eq!(parameters.encoder.layers[0].weights.row(2), start);
    }

    #[test]
    fn xi_from_samples_moves_as_xi_in_the_full_loss() {
        let (features, batches, mut parameters) = setup();
        let own: Vec<&Batch> = batches.iter().filter(|batch| batch.phase == 1).collect();
        let mut whole = loss(&features, &parameters);
        let mut slow = parameters.clone();
        let mut go = |_: usize, _: &Losses, _: usize| true;
        let schedule = short(4);
        train_xi(
            &mut parameters,
            1,
            &own,
            &mut whole,
            WEIGHTS,
            &schedule,
            &mut go,
        );
        let mut optimiser = Adam::new(slow.xi[1].len(), 1e-2);
        for _ in 0..4 {
            for batch in &own {
                whole.evaluate(&slow, batch);
                let gradient = whole.gradient().xi[1].as_slice().to_vec();
                optimiser.step(slow.xi[1].as_mut_slice(), &gradient);
            }
        }
        assert!((&parameters.xi[1] - &slow.xi[1]).amax() < 1e-10);
        assert_eq!(parameters.xi[0], slow.xi[0]);
    }

    #[test]
    fn decoder_alone_moves_as_the_decoder_in_the_full_loss() {
        let (features, batches, mut parameters) = setup();
        let all: Vec<&Batch> = batches.iter().collect();
        let only_decoder = LossWeights {
            ddz: 0.0,
            ddx: 0.0,
            l1: 0.0,
            lift: 0.0,
            bptt: 0.0,
        };
        let mut whole = loss(&features, &parameters);
        whole.set_weights(only_decoder);
        let mut slow = parameters.clone();
        let (schedule, frame) = (short(5), whole.frame().clone());
        train_decoder(&mut parameters, &all, &frame, &schedule, &mut |_, _, _| {
            true
        });
        let mut optimiser = MapOptimiser::new(&slow.decoder, &schedule);
        for _ in 0..5 {
            for batch in &batches {
                whole.evaluate(&slow, batch);
                optimiser.step(&mut slow.decoder, &whole.gradient().decoder);
            }
        }
        let pairs = parameters.decoder.blocks().zip(slow.decoder.blocks());
        for (fast, slow) in pairs {
            assert!(fast.iter().zip(slow).all(|(a, b)| (a - b).abs() < 1e-10));
        }
    }

    #[test]
    fn thresholding_masks_small_coefficients_of_every_phase_for_good() {
        let (features, batches, mut parameters) = setup();
        let all: Vec<&Batch> = batches.iter().collect();
        let mut loss = loss(&features, &parameters);
        let schedule = Schedule {
            epochs: 30,
            refinement: 20,
            threshold: 0.09,
            threshold_every: 10,
            learning_rate: 1e-2,
        };
        let mut counts = Vec::new();
        let mut listen = |_: usize, _: &Losses, active: usize| {
            counts.push(active);
            true
        };
        train_together(
            &mut parameters,
            &all,
            &mut loss,
            WEIGHTS,
            &schedule,
            &mut listen,
        );
        assert!(counts[49] < counts[0] && counts.windows(2).all(|pair| pair[1] <= pair[0]));
        let left = |xi: &DMatrix<f64>| xi.iter().filter(|value| **value != 0.0).count();
        assert_eq!(parameters.xi.iter().map(left).sum::<usize>(), counts[49]);
    }
}
