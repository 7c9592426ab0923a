//! The losses (16) to (20) with the lift loss and the window (41), and their exact gradient.
//!
//! With the encoder's Jacobian `J` at each sample: `z = phi(x)`, `dz = J dx`, `ddz = J ddx + (dJ/dt) dx`, `u_lat =
//! pinv(J^T) u`; the decoder takes `(z, dz, Theta Xi)` to the decoded position and acceleration the same way.
//!
//! Batches of consecutive samples.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::network::{Jacobians, Tape, add_transposed, product};
use super::parameters::{Frame, InputProjections, Parameters};
use super::unroll::{Adjoints, Unroll, Window};
use crate::recording::Recording;
use crate::recording::preprocess::{BATCH_ROWS, moving_average, prepare};
use crate::train::dataset::{Dataset, scaled};
use crate::train::error::TrainError;
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

impl LossWeights {
    pub(super) const RECONSTRUCTION_ONLY: Self = Self {
        ddz: 0.0,
        ddx: 0.0,
        l1: 0.0,
        lift: 0.0,
        bptt: 0.0,
    };
}

impl Default for LossWeights {
    /// The author's weights; no lift loss, no window.
    fn default() -> Self {
        Self {
            ddz: 1e-4,
            ddx: 1e-6,
            l1: 1e-6,
            ..Self::RECONSTRUCTION_ONLY
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
    pub(super) fn total(&self, weights: &LossWeights) -> f64 {
        self.decoder
            + weights.ddz * self.ddz
            + weights.ddx * self.ddx
            + weights.l1 * self.l1
            + weights.lift * self.lift
            + weights.bptt * self.bptt
    }

    /// Sum of two sets of losses, for averages over batches.
    pub(super) fn plus(&self, other: &Losses, share: f64) -> Losses {
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

/// A batch in latent coordinates.
struct Encoded {
    stack: DMatrix<f64>, // z, dz, ddz: 3n x d
    jacobians: Jacobians,
    rows: DMatrix<f64>, // of the Jacobians between x and z
    projections: InputProjections,
}

impl Encoded {
    /// (9), (11), (12) and (13) at every sample.
    fn new(parameters: &Parameters, batch: &Batch, frame: &Frame, tape: &mut Tape) -> Self {
        let mut stack = (parameters.encoder).forward(frame.enter(batch), batch.samples(), tape);
        stack *= frame.latent;
        let jacobians = parameters.encoder.jacobian(tape);
        let mut rows = jacobians.at_samples(batch.samples(), stack.ncols());
        frame.scale_jacobian(&mut rows);
        Self {
            projections: InputProjections::new(&rows, &batch.u),
            stack,
            jacobians,
            rows,
        }
    }

    /// `z`, `dz`, `u_lat`: `n x 3d`.
    fn variables(&self) -> DMatrix<f64> {
        let (n, d) = self.projections.u_lat.shape();
        let mut variables = DMatrix::zeros(n, 3 * d);
        for (start, block) in [(0, self.stack.rows(0, n)), (d, self.stack.rows(n, n))] {
            variables.columns_mut(start, d).copy_from(&block);
        }
        let mut inputs = variables.columns_mut(2 * d, d);
        inputs.copy_from(&self.projections.u_lat);
        variables
    }
}

/// The loss over one library, with its scratch space.
pub(super) struct JointLoss<'a> {
    pub weights: LossWeights,
    /// The weights that count in this epoch.
    pub current: LossWeights,
    /// Gradient of the last evaluation; of Xi only the phase of that batch has one.
    pub gradient: Parameters,
    features: &'a Features,
    frame: Frame,
    coordinate_weights: DVector<f64>, // in (16), 18
    unroll: Unroll,
    values: FeatureValues,
    encoder_tape: Tape,
    decoder_tape: Tape,
}

impl<'a> JointLoss<'a> {
    /// The loss of parameters of the shape of `parameters`; the window of (41) counts only with a weight.
    pub(super) fn new(
        features: &'a Features,
        (frame, coordinate_weights): (Frame, DVector<f64>),
        (weights, unroll): (LossWeights, Unroll),
        parameters: &Parameters,
    ) -> Self {
        Self {
            weights,
            current: weights,
            gradient: parameters.clone(),
            features,
            frame,
            coordinate_weights,
            unroll,
            values: FeatureValues::default(),
            encoder_tape: Tape::default(),
            decoder_tape: Tape::default(),
        }
    }

    /// The losses on a batch; the gradient of their weighted sum is kept in [`Self::gradient`].
    pub(super) fn evaluate(&mut self, parameters: &Parameters, batch: &Batch) -> Losses {
        self.gradient.clear();
        let weights = self.current;
        let (n, d) = (batch.samples(), self.features.latent_dim());
        let xi = &parameters.xi[batch.phase];
        let encoded = Encoded::new(parameters, batch, &self.frame, &mut self.encoder_tape);
        let variables = encoded.variables();
        let theta = self.features.evaluate(&variables, &mut self.values);
        let predicted = product(&theta, xi);
        let mut residual = &predicted - encoded.stack.rows(2 * n, n);
        let ddz = residual.norm_squared() / (n * d) as f64;
        residual *= 2.0 * weights.ddz / (n * d) as f64;
        let (decoder, ddx, mut onto_stack) =
            self.decode(parameters, batch, &encoded.stack, &predicted);
        let adjoint = onto_stack.rows(2 * n, n) + &residual;
        onto_stack.rows_mut(2 * n, n).copy_from(&-residual);
        let (bptt, onto_variables) =
            self.library_adjoint(parameters, batch, &variables, &theta, &adjoint);
        let lift = self.encoder_adjoint(parameters, batch, &encoded, onto_stack, &onto_variables);
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

    /// (16) and (18), and the adjoint of `z`, `dz` and the predicted `ddz`, `3n x d`.
    fn decode(
        &mut self,
        parameters: &Parameters,
        batch: &Batch,
        stack: &DMatrix<f64>,
        predicted: &DMatrix<f64>,
    ) -> (f64, f64, DMatrix<f64>) {
        let (frame, (n, state_dim)) = (&self.frame, batch.x.shape());
        let mut entering = stack.clone();
        entering.rows_mut(2 * n, n).copy_from(predicted);
        entering /= frame.latent;
        let mut leaving = (parameters.decoder).forward(entering, n, &mut self.decoder_tape);
        let (mut reconstruction, mut ddx) = (0.0, 0.0);
        let share = 1.0 / (n * state_dim) as f64;
        for (i, mut column) in leaving.column_iter_mut().enumerate() {
            let (mean, spread) = (frame.mean[i], frame.spread[i]);
            let weight = self.coordinate_weights[i] * share;
            let (values, rates) = column.as_mut_slice().split_at_mut(n);
            for (value, x) in values.iter_mut().zip(batch.x.column(i).iter()) {
                let residual = mean + spread * *value - x;
                reconstruction += weight * residual * residual;
                *value = 2.0 * weight * spread * residual;
            }
            let (velocities, accelerations) = rates.split_at_mut(n);
            velocities.fill(0.0);
            for (value, target) in accelerations.iter_mut().zip(batch.ddx.column(i).iter()) {
                let residual = spread * *value - target;
                ddx += share * residual * residual;
                *value = 2.0 * self.current.ddx * share * spread * residual;
            }
        }
        let own = &mut self.gradient.decoder;
        let at_first = (parameters.decoder).backward(&self.decoder_tape, leaving, &[], own);
        let onto_stack = parameters.decoder.onto_input(&at_first) / frame.latent;
        (reconstruction, ddx, onto_stack)
    }

    /// From the adjoint of the predicted `ddz` to those of Xi and `(z, dz, u_lat)`; (41), if it has a weight, is
    /// evaluated here and adds its own.
    fn library_adjoint(
        &mut self,
        parameters: &Parameters,
        batch: &Batch,
        variables: &DMatrix<f64>,
        theta: &DMatrix<f64>,
        adjoint: &DMatrix<f64>,
    ) -> (f64, DMatrix<f64>) {
        let xi = &parameters.xi[batch.phase];
        let onto_xi = &mut self.gradient.xi[batch.phase];
        add_transposed(onto_xi, theta, adjoint);
        let onto_theta = product(adjoint, &xi.transpose());
        let mut onto_variables = DMatrix::zeros(variables.nrows(), variables.ncols());
        self.features
            .backward(&onto_theta, &mut self.values, &mut onto_variables);
        let weight = self.current.bptt;
        if weight == 0.0 {
            return (0.0, onto_variables);
        }
        let samples = Window {
            features: self.features,
            variables,
            xi,
            step_s: batch.step_s,
        };
        let mut adjoints = Adjoints {
            variables: &mut onto_variables,
            xi: onto_xi,
        };
        let bptt = self.unroll.evaluate(samples, weight, &mut adjoints);
        (bptt, onto_variables)
    }

    /// The lift loss; adds to the gradient what the adjoints of `z`, `dz`, `ddz` (`3n x d`) and of the variables (`n x
    /// 3d`) mean for the encoder.
    fn encoder_adjoint(
        &mut self,
        parameters: &Parameters,
        batch: &Batch,
        encoded: &Encoded,
        mut onto_stack: DMatrix<f64>,
        onto_variables: &DMatrix<f64>,
    ) -> f64 {
        let (n, d) = encoded.projections.u_lat.shape();
        for (block, start) in [(0, 0), (n, d)] {
            let mut rows = onto_stack.rows_mut(block, n);
            rows += onto_variables.columns(start, d);
        }
        let onto_inputs = onto_variables.columns(2 * d, d).into_owned();
        let total = batch.u.norm_squared().max(f64::MIN_POSITIVE);
        let (projections, lift) = (&encoded.projections, self.current.lift / total);
        let mut onto_rows = projections.adjoint(&encoded.rows, &batch.u, &onto_inputs, lift);
        self.frame.scale_jacobian(&mut onto_rows);
        let (encoder, tape) = (&parameters.encoder, &self.encoder_tape);
        let own = &mut self.gradient.encoder;
        let onto_jacobians = encoded.jacobians.of_samples(&onto_rows, n);
        let at_affine = encoder.jacobian_adjoint(tape, &encoded.jacobians, &onto_jacobians, own);
        encoder.backward(tape, onto_stack * self.frame.latent, &at_affine, own);
        1.0 - projections.carried / total
    }
}

/// (19), the mean of the coefficients' magnitudes; adds `scale` times a subgradient of their sum.
fn l1_subgradient(xi: &DMatrix<f64>, scale: f64, gradient: &mut DMatrix<f64>) -> f64 {
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

/// Consecutive samples of one phase, rows are samples, scaled units.
#[derive(Clone, Debug)]
pub(super) struct Batch {
    pub phase: usize,
    /// States, `n x 18`.
    pub x: DMatrix<f64>,
    /// Velocities, `n x 18`.
    pub dx: DMatrix<f64>,
    /// Accelerations, `n x 18`.
    pub ddx: DMatrix<f64>,
    /// Inputs, `n x 18`.
    pub u: DMatrix<f64>,
    pub step_s: f64,
}

impl Batch {
    pub(super) fn samples(&self) -> usize {
        self.x.nrows()
    }

    /// Entries uniform in `-bound .. bound`, 2 ms apart.
    #[cfg(test)]
    pub(super) fn random(
        phase: usize,
        (samples, state_dim): (usize, usize),
        bound: f64,
        random: &mut crate::train::random::Random,
    ) -> Self {
        let mut block = || random.matrix(samples, state_dim, bound);
        let [x, dx, ddx, u] = std::array::from_fn(|_| block());
        let step_s = 0.002;
        Self {
            phase,
            x,
            dx,
            ddx,
            u,
            step_s,
        }
    }
}

/// Batches of all phases of all recordings, in their order, with the phases, inputs, units and smoothing of `dataset`.
pub(super) fn batches(
    recordings: &[Recording],
    dataset: &Dataset,
) -> Result<Vec<Batch>, TrainError> {
    let mut out = Vec::new();
    let state = |columns| scaled(columns, &dataset.scaling.state).transpose();
    for recording in recordings {
        for (span, samples) in prepare(recording, &dataset.phases)? {
            let u = scaled(samples.input(&dataset.rule)?, &dataset.scaling.input).transpose();
            let (x, dx) = (state(samples.x.clone()), state(samples.dx.clone()));
            let ddx = state(moving_average(&samples.ddx, dataset.smoothing));
            for start in (0..samples.len()).step_by(BATCH_ROWS) {
                let cut = |all: &DMatrix<f64>| all.rows(start, BATCH_ROWS).into_owned();
                out.push(Batch {
                    phase: span.phase,
                    x: cut(&x),
                    dx: cut(&dx),
                    ddx: cut(&ddx),
                    u: cut(&u),
                    step_s: samples.mean_step_s(),
                });
            }
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Activation;
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
        let batch = Batch::random(1, (30, 7), 0.8, &mut random);
        let shape = (features.library_dim(), 2, 0.1);
        let mut parameters = Parameters::random(widths, phi, shape, &mut random);
        let xi = parameters.xi[1].as_mut_slice().iter_mut();
        xi.for_each(|v| *v += 0.3 * random.signed());
        let maps = parameters.maps_mut().flatten();
        maps.for_each(|v| *v += 0.3 * random.signed());
        (features, batch, parameters)
    }

    fn loss<'a>(
        features: &'a Features,
        maps: (Frame, DVector<f64>),
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
            let widths: (&[usize], &[usize]) = match phi {
                Activation::Linear => (&[7, 3], &[3, 7]),
                _ => (&[7, 5, 4, 3], &[3, 4, 7]),
            };
            let (features, batch, parameters) = setup(widths, phi);
            let weights = DVector::from_fn(7, |i, _| 1.0 + i as f64);
            let mut loss = loss(&features, (frame.clone(), weights), &parameters, integrator);
            loss.evaluate(&parameters, &batch);
            let mut gradient = loss.gradient.clone();
            let masked = gradient.encoder.layers[0].weights.row(4).amax() == 0.0;
            assert!(gradient.xi[0].amax() == 0.0 && masked);
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
        let maps = (Frame::plain(&[true; 7]), DVector::from_element(7, 1.0));
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
}
