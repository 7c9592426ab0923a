//! The losses (16) to (20) with the lift loss and the window (41), and their exact gradient.

use nalgebra::DMatrix;
use serde::Serialize;

use super::batch::Batch;
use super::descent::Schedule;
use super::multiply::{Columns, add_transposed, product};
use super::network::Network;
use super::parameters::Parameters;
use super::unroll::{Adjoints, Unroll, Window};
use crate::train::features::{FeatureValues, Features};

/// Weights of the terms of the loss (equation 20).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LossWeights {
    /// Of the latent accelerations (17).
    pub ddz: f64,
    /// Of the accelerations in real space (18).
    pub ddx: f64,
    /// Of the mean absolute coefficient (19).
    pub l1: f64,
    /// Of the share of the input's energy that the latent input cannot carry.
    pub lift: f64,
    /// Of predictions over a window (41).
    pub bptt: f64,
}

impl Default for LossWeights {
    /// The author's weights; no lift loss, no window.
    fn default() -> Self {
        Self {
            ddz: 1e-4,
            ddx: 1e-6,
            l1: 1e-6,
            lift: 0.0,
            bptt: 0.0,
        }
    }
}

/// Values of the terms, unweighted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Losses {
    /// Mean square of `x - x_dec` (16), with coordinate weights if there are any.
    pub decoder: f64,
    /// Mean square of `ddz - ddz_pred` (17).
    pub ddz: f64,
    /// Mean square of `ddx - ddx_pred` (18).
    pub ddx: f64,
    /// Mean of `|Xi|` (19).
    pub l1: f64,
    /// `||u - W_e^T u_lat||^2 / ||u||^2`.
    pub lift: f64,
    /// Mean square of `z - z_pred` over a window (41); 0 unless it has a weight.
    pub bptt: f64,
}

impl Losses {
    pub fn total(&self, weights: &LossWeights) -> f64 {
        self.decoder
            + weights.ddz * self.ddz
            + weights.ddx * self.ddx
            + weights.l1 * self.l1
            + weights.lift * self.lift
            + weights.bptt * self.bptt
    }

    /// Sum of two sets of losses, for averages over batches.
    pub fn plus(&self, other: &Losses, share: f64) -> Losses {
        Losses {
            decoder: self.decoder + share * other.decoder,
            ddz: self.ddz + share * other.ddz,
            ddx: self.ddx + share * other.ddx,
            l1: self.l1 + share * other.l1,
            lift: self.lift + share * other.lift,
            bptt: self.bptt + share * other.bptt,
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct LossPoint<'a> {
    pub parameters: &'a Parameters,
    pub batch: &'a Batch,
    pub weights: LossWeights,
}

/// (16) of one batch as a function of the decoder; overwrites its gradient.
pub(super) type DecoderLoss = Box<dyn Fn(&Network, &mut Network) -> f64>;
/// (17) to (19) of one batch as functions of Xi, with their weighted gradient.
pub(super) type XiLoss = Box<dyn Fn(&DMatrix<f64>, LossWeights) -> (Losses, DMatrix<f64>)>;

/// Encoder and decoder inside the loss, with the adjoints of both.
///
/// One evaluation calls `encode`, `residual`, `decode` and `encode_adjoint` in this order on the same batch.
pub(super) trait Maps {
    /// `z`, `dz` and `u_lat` of all samples (9, 11, 13), `n x 3d`.
    fn encode(&mut self, at: LossPoint<'_>) -> DMatrix<f64>;

    /// `predicted - ddz` (12), `n x d`.
    fn residual(&self, at: LossPoint<'_>, predicted: &DMatrix<f64>) -> DMatrix<f64>;

    /// (16) and (18), and the adjoint of `predicted`: `adjoint`, which comes from (17), plus the one from (18).
    fn decode(
        &mut self,
        at: LossPoint<'_>,
        predicted: &DMatrix<f64>,
        adjoint: &DMatrix<f64>,
        gradient: &mut Parameters,
    ) -> (f64, f64, DMatrix<f64>);

    /// The lift loss; adds to the gradient what `onto_ddz` (`n x d`) and `onto_variables` (`n x 3d`), the adjoints of
    /// `-ddz` and of the variables, mean for the encoder.
    fn encode_adjoint(
        &mut self,
        at: LossPoint<'_>,
        onto_ddz: &DMatrix<f64>,
        onto_variables: &DMatrix<f64>,
        gradient: &mut Parameters,
    ) -> f64;

    /// The loss of the second step, in which the encoder stays, where less than the whole loss gives it.
    fn decoder_loss(&self, _: &Parameters, _: &Batch) -> Option<DecoderLoss> {
        None
    }

    /// The loss of the third step, in which both maps stay, where less than the whole loss gives it; without (41).
    fn xi_loss(&self, _: &Parameters, _: &Batch, _: &Features) -> Option<XiLoss> {
        None
    }
}

/// The loss over one library, with its scratch space.
pub(super) struct JointLoss<'a> {
    pub(super) features: &'a Features,
    pub(super) maps: Box<dyn Maps>,
    pub(super) weights: LossWeights,
    current: LossWeights,
    unroll: Unroll,
    values: FeatureValues,
    gradient: Parameters, // anything before the first evaluation
}

impl<'a> JointLoss<'a> {
    /// The loss of parameters of the shape of `parameters`; the window of (41) counts only with a weight.
    pub(super) fn new(
        features: &'a Features,
        maps: Box<dyn Maps>,
        (weights, unroll): (LossWeights, Unroll),
        parameters: &Parameters,
    ) -> Self {
        Self {
            features,
            maps,
            weights,
            current: weights,
            unroll,
            values: FeatureValues::default(),
            gradient: parameters.clone(),
        }
    }

    pub(super) fn start_epoch(&mut self, epoch: usize, schedule: &Schedule) -> LossWeights {
        self.current = schedule.weights_at(epoch, self.weights);
        self.current
    }

    /// Counts nothing but (16).
    pub(super) fn count_reconstruction_only(&mut self) {
        self.current = LossWeights {
            ddz: 0.0,
            ddx: 0.0,
            l1: 0.0,
            lift: 0.0,
            bptt: 0.0,
        };
    }

    /// Gradient of the last [`Self::evaluate`]; of Xi only the phase of that batch has one.
    pub(super) fn gradient(&self) -> &Parameters {
        &self.gradient
    }

    /// The losses on a batch; the gradient of their weighted sum is kept in [`Self::gradient`].
    pub(super) fn evaluate(&mut self, parameters: &Parameters, batch: &Batch) -> Losses {
        self.gradient.clear();
        let weights = self.current;
        let at = LossPoint {
            parameters,
            batch,
            weights,
        };
        let (n, d) = (batch.samples(), self.features.latent_dim());
        let xi = &parameters.xi[batch.phase];
        let variables = self.maps.encode(at);
        let theta = self.features.evaluate(&variables, &mut self.values);
        let predicted = product(&theta, xi);
        let mut residual = self.maps.residual(at, &predicted);
        let ddz = residual.norm_squared() / (n * d) as f64;
        residual *= 2.0 * weights.ddz / (n * d) as f64;
        let (decoder, ddx, adjoint) =
            (self.maps).decode(at, &predicted, &residual, &mut self.gradient);
        let (bptt, onto_variables) = self.library_adjoint(at, &variables, &theta, &adjoint);
        let lift = (self.maps).encode_adjoint(at, &residual, &onto_variables, &mut self.gradient);
        let l1_scale = weights.l1 * (1.0 / xi.len() as f64);
        let l1 = l1_subgradient(xi, l1_scale, &mut self.gradient.xi[batch.phase]);
        Losses {
            decoder,
            ddz,
            ddx,
            l1,
            lift,
            bptt,
        }
    }

    /// From the adjoint of the predicted `ddz` to those of Xi and `(z, dz, u_lat)`; (41), if it has a weight, is
    /// evaluated here and adds its own.
    fn library_adjoint(
        &mut self,
        at: LossPoint<'_>,
        variables: &DMatrix<f64>,
        theta: &DMatrix<f64>,
        adjoint: &DMatrix<f64>,
    ) -> (f64, DMatrix<f64>) {
        let xi = &at.parameters.xi[at.batch.phase];
        let onto_xi = &mut self.gradient.xi[at.batch.phase];
        add_transposed(onto_xi, 1.0, Columns::all(theta), Columns::all(adjoint));
        let onto_theta = product(adjoint, &xi.transpose());
        let mut onto_variables = DMatrix::zeros(variables.nrows(), variables.ncols());
        self.features
            .backward(&onto_theta, &mut self.values, &mut onto_variables);
        if at.weights.bptt == 0.0 {
            return (0.0, onto_variables);
        }
        let samples = Window {
            features: self.features,
            variables,
            xi,
            step_s: at.batch.step_s,
        };
        let mut adjoints = Adjoints {
            variables: &mut onto_variables,
            xi: onto_xi,
        };
        let bptt = (self.unroll).evaluate(samples, at.weights.bptt, &mut adjoints);
        (bptt, onto_variables)
    }
}

/// (19), the mean of the coefficients' magnitudes; adds `scale` times a subgradient of their sum.
pub(super) fn l1_subgradient(xi: &DMatrix<f64>, scale: f64, gradient: &mut DMatrix<f64>) -> f64 {
    if scale != 0.0 {
        for (g, value) in gradient.iter_mut().zip(xi.iter()) {
            *g += if *value == 0.0 {
                0.0
            } else {
                scale * value.signum()
            };
        }
    }
    xi.iter().map(|value| value.abs()).sum::<f64>() / xi.len() as f64
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;
    use crate::model::Activation;
    use crate::train::joint::linear::LinearMaps;
    use crate::train::joint::nonlinear::NonlinearMaps;
    use crate::train::joint::parameters::Frame;
    use crate::train::joint::unroll::Integrator;
    use crate::train::oscillator::standard_library;
    use crate::train::random::Random;

    const WEIGHTS: LossWeights = LossWeights {
        ddz: 0.7,
        ddx: 0.4,
        l1: 0.3,
        lift: 0.9,
        bptt: 0.8,
    };

    /// Library, batch of phase 1 of 2, and moved random parameters with layers of `widths`.
    fn setup(widths: (&[usize], &[usize]), phi: Activation) -> (Features, Batch, Parameters) {
        let features = Features::new(&standard_library(3, 1, true));
        let mut random = Random::new(11);
        let blocks = std::array::from_fn(|_| random.matrix(30, 7, 0.8));
        let shape = (features.library_dim(), 2, 0.1);
        let mut parameters = Parameters::random(widths, phi, shape, &mut random);
        let xi = parameters.xi[1].as_mut_slice().iter_mut();
        xi.for_each(|v| *v += 0.3 * random.signed());
        let maps = parameters.maps_mut().flatten();
        maps.for_each(|v| *v += 0.3 * random.signed());
        (features, Batch::new(1, blocks, 0.002), parameters)
    }

    fn linear(coordinate_weights: DVector<f64>) -> Box<dyn Maps> {
        Box::new(LinearMaps::new(coordinate_weights, vec![true; 7]))
    }

    fn coordinate_weights() -> DVector<f64> {
        DVector::from_fn(7, |i, _| 1.0 + i as f64)
    }

    fn loss<'a>(
        features: &'a Features,
        maps: Box<dyn Maps>,
        parameters: &Parameters,
        integrator: Integrator,
    ) -> JointLoss<'a> {
        let unroll = Unroll {
            window: 3,
            stride: 2,
            decay: 0.9,
            integrator,
        };
        JointLoss::new(features, maps, (WEIGHTS, unroll), parameters)
    }

    fn all(parameters: &mut Parameters) -> Vec<&mut [f64]> {
        let maps = (parameters.encoder.blocks_mut()).chain(parameters.decoder.blocks_mut());
        maps.chain(parameters.xi.iter_mut().map(|xi| xi.as_mut_slice()))
            .collect()
    }

    #[test]
    fn gradient_agrees_with_finite_differences_for_all_maps() {
        let mut random = Random::new(13);
        let spread = DVector::from_fn(7, |_, _| 1.0 + 0.4 * random.signed());
        let mut factors = spread.map(f64::recip);
        factors[4] = 0.0;
        let frame = Frame {
            mean: DVector::from_fn(7, |_, _| 0.3 * random.signed()),
            spread,
            factors,
            latent: 0.6,
        };
        let integrators = [Integrator::Rk2, Integrator::Rk4, Integrator::Euler];
        for (phi, integrator) in Activation::ALL
            .into_iter()
            .zip(integrators.into_iter().cycle())
        {
            if phi == Activation::Relu {
                continue; // its Jacobian jumps, and the loss on velocities with it
            }
            let is_linear = phi == Activation::Linear;
            let widths: (&[usize], &[usize]) = match is_linear {
                true => (&[7, 3], &[3, 7]),
                false => (&[7, 5, 4, 3], &[3, 4, 7]),
            };
            let (features, batch, parameters) = setup(widths, phi);
            let maps = match is_linear {
                true => linear(coordinate_weights()),
                false => Box::new(NonlinearMaps::new(coordinate_weights(), frame.clone())),
            };
            let mut loss = loss(&features, maps, &parameters, integrator);
            loss.evaluate(&parameters, &batch);
            let mut gradient = loss.gradient().clone();
            let masked = gradient.encoder.layers[0].weights.row(4).amax() == 0.0;
            assert!(gradient.xi[0].amax() == 0.0 && masked != is_linear);
            let count = all(&mut gradient).len();
            for block in 0..count {
                for entry in 0..all(&mut gradient)[block].len() {
                    let mut at = |step: f64| {
                        let mut moved = parameters.clone();
                        all(&mut moved)[block][entry] += step;
                        loss.evaluate(&moved, &batch).total(&WEIGHTS)
                    };
                    // Of fourth order: the losses are large, and a smaller step would drown in their rounding.
                    let (near, far) = (at(1e-5) - at(-1e-5), at(2e-5) - at(-2e-5));
                    let difference = (8.0 * near - far) / 12e-5;
                    let exact = all(&mut gradient)[block][entry];
                    assert!(
                        (difference - exact).abs() < 2e-6 * exact.abs().max(1.0),
                        "{phi} {block} {entry}: {difference} {exact}"
                    );
                }
            }
        }
    }

    #[test]
    fn losses_of_linear_maps_equal_their_definitions() {
        let (features, batch, mut parameters) = setup((&[7, 3], &[3, 7]), Activation::Linear);
        parameters.xi[1].fill(0.2);
        for map in [&mut parameters.encoder, &mut parameters.decoder] {
            map.layers[0].bias.fill(0.0);
        }
        let maps = linear(DVector::from_element(7, 1.0));
        let mut loss = loss(&features, maps, &parameters, Integrator::Rk2);
        let losses = loss.evaluate(&parameters, &batch);
        let encoder = &parameters.encoder.layers[0].weights;
        let decoder = &parameters.decoder.layers[0].weights;
        let inverse = encoder.clone().pseudo_inverse(1e-12).expect("positive");
        let (z, u_lat) = (&batch.x * encoder, &batch.u * inverse.transpose());
        let mut variables = z.clone().resize(30, 9, 0.0);
        (variables.columns_mut(3, 3)).copy_from(&(&batch.dx * encoder));
        variables.columns_mut(6, 3).copy_from(&u_lat);
        let theta = features.evaluate(&variables, &mut FeatureValues::default());
        let predicted = theta * &parameters.xi[1];
        let mean_square = |m: DMatrix<f64>| m.norm_squared() / m.len() as f64;
        let close = |found: f64, expected: f64| {
            let near = (found - expected).abs() < 1e-9 * expected;
            assert!(near, "{found} {expected}")
        };
        close(losses.decoder, mean_square(&batch.x - z * decoder));
        close(losses.ddz, mean_square(&batch.ddx * encoder - &predicted));
        close(losses.ddx, mean_square(&batch.ddx - &predicted * decoder));
        close(losses.l1, 0.2);
        let missed = &batch.u - u_lat * encoder.transpose();
        close(losses.lift, missed.norm_squared() / batch.u.norm_squared());
    }

    #[test]
    fn networks_of_one_linear_layer_have_the_losses_and_the_gradient_of_linear_maps() {
        let (features, batch, parameters) = setup((&[7, 3], &[3, 7]), Activation::Linear);
        let plain = Frame::plain(&[true; 7]);
        let networks = Box::new(NonlinearMaps::new(coordinate_weights(), plain));
        let mut found = loss(&features, networks, &parameters, Integrator::Rk2);
        let linear = linear(coordinate_weights());
        let mut expected = loss(&features, linear, &parameters, Integrator::Rk2);
        let losses = found.evaluate(&parameters, &batch);
        let reference = expected.evaluate(&parameters, &batch);
        let (a, b) = (losses.total(&WEIGHTS), reference.total(&WEIGHTS));
        assert!((a - b).abs() < 1e-9 * b && (losses.lift - reference.lift).abs() < 1e-9);
        let (mut found, mut expected) = (found.gradient().clone(), expected.gradient().clone());
        for (found, expected) in all(&mut found).into_iter().zip(all(&mut expected)) {
            let mut each = found.iter().zip(expected.iter());
            assert!(each.all(|(a, b)| (a - b).abs() < 1e-9 * b.abs().max(1.0)));
        }
    }
}
