//! The losses (16) to (20) with the lift loss for networks, and their exact gradient.
//!
//! With the encoder's Jacobian `J` at each sample: `z = phi(x)`, `dz = J dx`, `ddz = J ddx + (dJ/dt) dx`,
//! `u_lat = pinv(J^T) u`; the decoder takes `(z, dz, Theta Xi)` to the decoded position and acceleration the same way.

use nalgebra::{DMatrix, DVector};

use super::layers::{Jacobians, Network, Tape};
use super::projection::InputProjections;
use crate::model::Activation;
use crate::train::features::{FeatureValues, Features};
use crate::train::joint::batch::Batch;
use crate::train::joint::loss::{LossWeights, Losses, l1_subgradient};
use crate::train::joint::multiply::{Columns, add_product, add_transposed};
use crate::train::joint::unroll::{Pulls, Unroll, Window};
use crate::train::random::Random;

/// What Adam moves, or gradients with respect to it.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkParameters {
    /// From framed states to latent coordinates.
    pub encoder: Network,
    /// From latent coordinates to framed states.
    pub decoder: Network,
    /// `library_dim x d` a phase.
    pub xi: Vec<DMatrix<f64>>,
}

impl NetworkParameters {
    /// A random start: see [`Network::random`]; Xi everywhere `xi`.
    pub fn random(
        (encoder, decoder): (&[usize], &[usize]),
        activation: Activation,
        (library_dim, phases, xi): (usize, usize, f64),
        random: &mut Random,
    ) -> Self {
        let latent_dim = decoder[0];
        Self {
            encoder: Network::random(encoder, activation, random),
            decoder: Network::random(decoder, activation, random),
            xi: vec![DMatrix::from_element(library_dim, latent_dim, xi); phases],
        }
    }

    fn zeros_like(&self) -> Self {
        Self {
            encoder: self.encoder.zeros_like(),
            decoder: self.decoder.zeros_like(),
            xi: self.xi.iter().map(|xi| xi.map(|_| 0.0)).collect(),
        }
    }

    fn clear(&mut self) {
        let maps = self.encoder.blocks_mut().chain(self.decoder.blocks_mut());
        maps.chain(self.xi.iter_mut().map(|xi| xi.as_mut_slice()))
            .for_each(|block| block.fill(0.0));
    }
}

/// Fixed affine maps around the networks, so that these see and give numbers of order one.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// State that enters the encoder and leaves the decoder as 0, 18.
    pub mean: DVector<f64>,
    /// What a unit of the decoder's output stands for, 18.
    pub spread: DVector<f64>,
    /// Factors before the encoder, 18: the inverse of the spread, 0 for masked coordinates.
    pub factors: DVector<f64>,
    /// What a unit of the encoder's output and of the decoder's input stands for.
    pub latent: f64,
}

impl Frame {
    /// No change of units; `mask` (18) is true for coordinates that the encoder may use.
    pub fn plain(mask: &[bool]) -> Self {
        let n = mask.len();
        Self {
            mean: DVector::zeros(n),
            spread: DVector::from_element(n, 1.0),
            factors: DVector::from_fn(n, |i, _| f64::from(mask[i])),
            latent: 1.0,
        }
    }

    /// `x`, `dx` and `ddx` of a batch, stacked, as the encoder takes them.
    pub fn enter(&self, batch: &Batch) -> DMatrix<f64> {
        let n = batch.len();
        let mut stack = DMatrix::zeros(3 * n, batch.x.ncols());
        stack.rows_mut(0, n).copy_from(&batch.x);
        stack.rows_mut(n, n).copy_from(&batch.dx);
        stack.rows_mut(2 * n, n).copy_from(&batch.ddx);
        for (i, mut column) in stack.column_iter_mut().enumerate() {
            column.rows_mut(0, n).add_scalar_mut(-self.mean[i]);
            column *= self.factors[i];
        }
        stack
    }

    /// The stacked Jacobians of the network as those of the map between `x` and `z`, or a gradient the other way.
    pub fn scale_jacobian(&self, rows: &mut DMatrix<f64>) {
        for (mut column, factor) in rows.column_iter_mut().zip(self.factors.iter()) {
            column *= self.latent * factor;
        }
    }
}

/// The loss over one library, with its scratch space.
pub struct NetworkLoss<'a> {
    features: &'a Features,
    weights: LossWeights,
    unroll: Unroll,
    coordinate_weights: DVector<f64>,
    frame: Frame,
    values: FeatureValues,
    encoder_tape: Tape,
    decoder_tape: Tape,
    gradient: NetworkParameters,
}

/// Samples in latent coordinates, as a forward pass leaves them.
pub(super) struct Encoded {
    /// `z`, `dz`, `ddz`: `3n x d`.
    pub stack: DMatrix<f64>,
    /// `z`, `dz`, `u_lat`: `n x 3d`.
    pub variables: DMatrix<f64>,
    jacobians: Jacobians,
    rows: DMatrix<f64>, // of the Jacobians between x and z
    projections: InputProjections,
}

/// (9), (11), (12) and (13) at every sample.
pub(super) fn encode(
    parameters: &NetworkParameters,
    batch: &Batch,
    frame: &Frame,
    tape: &mut Tape,
) -> Encoded {
    let n = batch.len();
    let mut stack = (parameters.encoder).forward(frame.enter(batch), n, tape);
    stack *= frame.latent;
    let d = stack.ncols();
    let jacobians = parameters.encoder.jacobian(tape);
    let mut rows = jacobians.rows.clone();
    frame.scale_jacobian(&mut rows);
    let projections = InputProjections::new(&rows, &batch.u);
    let mut variables = DMatrix::zeros(n, 3 * d);
    for (start, block) in [(0, stack.rows(0, n)), (d, stack.rows(n, n))] {
        variables.columns_mut(start, d).copy_from(&block);
    }
    let mut inputs = variables.columns_mut(2 * d, d);
    inputs.copy_from(&projections.u_lat);
    Encoded {
        stack,
        variables,
        jacobians,
        rows,
        projections,
    }
}

impl<'a> NetworkLoss<'a> {
    /// The loss of networks like `parameters` with these weights; `coordinate_weights` (18) weigh the coordinates in
    /// (16).
    pub fn new(
        features: &'a Features,
        weights: LossWeights,
        coordinate_weights: DVector<f64>,
        frame: Frame,
        parameters: &NetworkParameters,
    ) -> Self {
        Self {
            features,
            weights,
            unroll: Unroll::default(),
            coordinate_weights,
            frame,
            values: FeatureValues::default(),
            encoder_tape: Tape::default(),
            decoder_tape: Tape::default(),
            gradient: parameters.zeros_like(),
        }
    }

    /// Sets the window of (41), which counts only with a weight.
    pub fn with_unroll(self, unroll: Unroll) -> Self {
        Self { unroll, ..self }
    }

    /// Changes the weights, as refinement does when it drops the L1 term.
    pub fn set_weights(&mut self, weights: LossWeights) {
        self.weights = weights;
    }

    /// The library.
    pub fn features(&self) -> &'a Features {
        self.features
    }

    /// The maps around the networks.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// Gradient of the last [`Self::evaluate`]; of Xi only the phase of that batch has one.
    pub fn gradient(&self) -> &NetworkParameters {
        &self.gradient
    }

    /// The losses on a batch; the gradient of their weighted sum is kept in [`Self::gradient`].
    pub fn evaluate(&mut self, parameters: &NetworkParameters, batch: &Batch) -> Losses {
        self.gradient.clear();
        let (n, d) = (batch.len(), self.features.latent_dim());
        let xi = &parameters.xi[batch.phase];
        let encoded = encode(parameters, batch, &self.frame, &mut self.encoder_tape);
        let theta = self.features.evaluate(&encoded.variables, &mut self.values);
        let mut predicted = DMatrix::zeros(n, d);
        add_product(&mut predicted, 1.0, &theta, xi);
        let (decoder, ddx, mut pull) = self.decode(parameters, batch, &encoded, &predicted);

        let mut miss = predicted - encoded.stack.rows(2 * n, n);
        let ddz = miss.norm_squared() / (n * d) as f64;
        miss *= 2.0 * self.weights.ddz / (n * d) as f64;
        let onto_predicted = pull.rows(2 * n, n) + &miss;
        pull.rows_mut(2 * n, n).copy_from(&-miss); // from here on with respect to ddz
        let (bptt, pulled) =
            self.pull_through_library(batch, &encoded, (xi, &theta), &onto_predicted);
        let pull_xi = self.weights.l1 * (1.0 / xi.len() as f64);
        let l1 = l1_subgradient(xi, pull_xi, &mut self.gradient.xi[batch.phase]);
        for (block, start) in [(0, 0), (n, d)] {
            let mut rows = pull.rows_mut(block, n);
            rows += pulled.columns(start, d);
        }
        let onto_inputs = pulled.columns(2 * d, d).into_owned();
        let lift = self.pull_through_encoder(parameters, batch, &encoded, pull, &onto_inputs);
        Losses {
            decoder,
            ddz,
            ddx,
            l1,
            lift,
            bptt,
        }
    }

    /// (16) and (18), with the gradient with respect to `z`, `dz` and the predicted `ddz` (`3n x d`).
    fn decode(
        &mut self,
        parameters: &NetworkParameters,
        batch: &Batch,
        encoded: &Encoded,
        predicted: &DMatrix<f64>,
    ) -> (f64, f64, DMatrix<f64>) {
        let (n, state_dim) = batch.x.shape();
        let mut entering = encoded.stack.clone();
        entering.rows_mut(2 * n, n).copy_from(predicted);
        entering /= self.frame.latent;
        let mut leaving = (parameters.decoder).forward(entering, n, &mut self.decoder_tape);
        let (mut decoder, mut ddx) = (0.0, 0.0);
        let share = 1.0 / (n * state_dim) as f64;
        for (i, mut column) in leaving.column_iter_mut().enumerate() {
            let (mean, spread) = (self.frame.mean[i], self.frame.spread[i]);
            let weight = self.coordinate_weights[i] * share;
            let (values, rates) = column.as_mut_slice().split_at_mut(n);
            for (value, x) in values.iter_mut().zip(batch.x.column(i).iter()) {
                let miss = mean + spread * *value - x;
                decoder += weight * miss * miss;
                *value = 2.0 * weight * spread * miss;
            }
            let (velocities, accelerations) = rates.split_at_mut(n);
            velocities.fill(0.0);
            for (value, target) in accelerations.iter_mut().zip(batch.ddx.column(i).iter()) {
                let miss = spread * *value - target;
                ddx += share * miss * miss;
                *value = 2.0 * self.weights.ddx * share * spread * miss;
            }
        }
        let gradient = &mut self.gradient.decoder;
        let pull = (parameters.decoder).backward(&self.decoder_tape, leaving, &[], gradient);
        (decoder, ddx, pull / self.frame.latent)
    }

    /// From the gradient with respect to the predicted `ddz` to those with respect to Xi and `(z, dz, u_lat)`; (41),
    /// if it has a weight, is evaluated here and adds its own.
    fn pull_through_library(
        &mut self,
        batch: &Batch,
        encoded: &Encoded,
        (xi, theta): (&DMatrix<f64>, &DMatrix<f64>),
        pull: &DMatrix<f64>,
    ) -> (f64, DMatrix<f64>) {
        let n = batch.len();
        let own = &mut self.gradient.xi[batch.phase];
        add_transposed(own, 1.0, Columns::all(theta), Columns::all(pull));
        let mut theta_pull = DMatrix::zeros(n, theta.ncols());
        add_product(&mut theta_pull, 1.0, pull, &xi.transpose());
        let mut pulled = DMatrix::zeros(n, encoded.variables.ncols());
        self.features
            .backward(&theta_pull, &mut self.values, &mut pulled);
        if self.weights.bptt == 0.0 {
            return (0.0, pulled);
        }
        let samples = Window {
            variables: &encoded.variables,
            xi,
            step_s: batch.step_s,
        };
        let mut pulls = Pulls {
            variables: &mut pulled,
            xi: own,
        };
        let weight = self.weights.bptt;
        let bptt = (self.unroll).evaluate(self.features, samples, weight, &mut pulls);
        (bptt, pulled)
    }

    /// The way back from `(z, dz, ddz)` (`3n x d`) and `u_lat` (`n x d`); returns the lift loss.
    fn pull_through_encoder(
        &mut self,
        parameters: &NetworkParameters,
        batch: &Batch,
        encoded: &Encoded,
        pull: DMatrix<f64>,
        onto_inputs: &DMatrix<f64>,
    ) -> f64 {
        let total = batch.input_moment.trace().max(f64::MIN_POSITIVE);
        let lift = self.weights.lift / total;
        let mut onto_rows =
            (encoded.projections).pull_back(&encoded.rows, &batch.u, onto_inputs, lift);
        self.frame.scale_jacobian(&mut onto_rows);
        let gradient = &mut self.gradient.encoder;
        let tape = &self.encoder_tape;
        let network = &parameters.encoder;
        let at_affine = network.pull_back_jacobian(tape, &encoded.jacobians, &onto_rows, gradient);
        network.backward(tape, pull * self.frame.latent, &at_affine, gradient);
        1.0 - encoded.projections.carried / total
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Library, StandardLibrary};
    use crate::train::joint::loss::JointLoss;
    use crate::train::joint::parameters::Parameters;

    const WEIGHTS: LossWeights = LossWeights {
        ddz: 0.7,
        ddx: 0.4,
        l1: 0.3,
        lift: 0.9,
        bptt: 0.8,
    };

    fn batch(random: &mut Random) -> Batch {
        let blocks = std::array::from_fn(|_| random.matrix(30, 7, 0.8));
        Batch::new(1, blocks, 0.002)
    }

    fn features() -> Features {
        Features::new(&Library::standard(3, StandardLibrary::default()).expect("small library"))
    }

    fn coordinate_weights() -> DVector<f64> {
        DVector::from_fn(7, |i, _| 1.0 + i as f64)
    }

    fn unroll() -> Unroll {
        Unroll {
            window: 3,
            stride: 2,
            ..Unroll::default()
        }
    }

    fn frame(random: &mut Random) -> Frame {
        let spread = DVector::from_fn(7, |_, _| 1.0 + 0.4 * random.signed());
        let mut factors = spread.map(f64::recip);
        factors[4] = 0.0;
        Frame {
            mean: DVector::from_fn(7, |_, _| 0.3 * random.signed()),
            spread,
            factors,
            latent: 0.6,
        }
    }

    #[test]
    fn gradient_agrees_with_finite_differences_for_every_activation() {
        let mut random = Random::new(11);
        let (features, batch) = (features(), batch(&mut random));
        let widths: (&[usize], &[usize]) = (&[7, 5, 4, 3], &[3, 4, 7]);
        for phi in [Activation::Elu, Activation::Tanh, Activation::Sigmoid] {
            let shape = (features.library_dim(), 2, 0.1);
            let mut parameters = NetworkParameters::random(widths, phi, shape, &mut random);
            let move_by = |block: &mut [f64], random: &mut Random| {
                block.iter_mut().for_each(|v| *v += 0.3 * random.signed());
            };
            (parameters.encoder.blocks_mut()).for_each(|block| move_by(block, &mut random));
            (parameters.decoder.blocks_mut()).for_each(|block| move_by(block, &mut random));
            move_by(parameters.xi[1].as_mut_slice(), &mut random);
            let frame = frame(&mut random);
            let mut loss =
                NetworkLoss::new(&features, WEIGHTS, coordinate_weights(), frame, &parameters)
                    .with_unroll(unroll());
            loss.evaluate(&parameters, &batch);
            let mut gradient = loss.gradient().clone();
            assert!(
                gradient.xi[0].amax() == 0.0
                    && gradient.encoder.layers[0].weights.row(4).amax() == 0.0
            );
            let count = all(&mut gradient).len();
            for block in 0..count {
                for entry in 0..all(&mut gradient)[block].len() {
                    let mut at = |step: f64| {
                        let mut moved = parameters.clone();
                        all(&mut moved)[block][entry] += step;
                        loss.evaluate(&moved, &batch).total(&WEIGHTS)
                    };
                    let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
                    let exact = all(&mut gradient)[block][entry];
                    assert!(
                        (difference - exact).abs() < 2e-6 * exact.abs().max(1.0),
                        "{phi} {block} {entry}: {difference} {exact}"
                    );
                }
            }
        }
    }

    fn all(parameters: &mut NetworkParameters) -> Vec<&mut [f64]> {
        let maps = (parameters.encoder.blocks_mut()).chain(parameters.decoder.blocks_mut());
        maps.chain(parameters.xi.iter_mut().map(|xi| xi.as_mut_slice()))
            .collect()
    }

    #[test]
    fn single_linear_layers_have_the_losses_and_the_gradient_of_the_linear_loss() {
        let mut random = Random::new(12);
        let (features, batch) = (features(), batch(&mut random));
        let linear = Parameters::random(7, 3, features.library_dim(), 0.2, &mut random);
        let shape = (features.library_dim(), 2, 0.2);
        let widths: (&[usize], &[usize]) = (&[7, 3], &[3, 7]);
        let phi = Activation::Linear;
        let mut parameters = NetworkParameters::random(widths, phi, shape, &mut random);
        parameters.encoder.layers[0].weights = linear.encoder.clone();
        parameters.decoder.layers[0].weights = linear.decoder.clone();
        let plain = Frame::plain(&[true; 7]);
        let mut found =
            NetworkLoss::new(&features, WEIGHTS, coordinate_weights(), plain, &parameters)
                .with_unroll(unroll());
        let mut expected =
            JointLoss::new(&features, WEIGHTS, coordinate_weights()).with_unroll(unroll());
        let losses = found.evaluate(&parameters, &batch);
        let reference = expected.evaluate(&linear, &batch);
        let (a, b) = (losses.total(&WEIGHTS), reference.total(&WEIGHTS));
        assert!((a - b).abs() < 1e-9 * b && (losses.lift - reference.lift).abs() < 1e-9);
        let (found, expected) = (found.gradient(), expected.gradient());
        let near = |a: &[f64], b: &[f64]| {
            a.iter()
                .zip(b)
                .all(|(a, b)| (a - b).abs() < 1e-9 * b.abs().max(1.0))
        };
        let maps = found.encoder.blocks().chain(found.decoder.blocks());
        let each = maps.chain([found.xi[1].as_slice()]).zip(expected.blocks());
        each.for_each(|(a, b)| assert!(near(a, b)));
    }
}
