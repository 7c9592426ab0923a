//! The losses (16) to (20) with the lift loss and the window (41) on batches of samples, and their exact gradient.
//!
//! With the encoder's Jacobian `J` at each sample: `z = phi(x)`, `dz = J dx`, `ddz = J ddx + (dJ/dt) dx`,
//! `u_lat = pinv(J^T) u`. In the same way the decoder maps `(z, dz, Theta Xi)` to the decoded position and
//! acceleration.

use super::network::{Jacobians, Tape, add_transposed};
use super::parameters::{Frame, InputProjections};
use super::unroll::Window;
use super::*;

/// Weights of the terms of the loss (equation 20).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LossWeights {
    pub ddz: f64,  // latent accelerations (17)
    pub ddx: f64,  // accelerations in real space (18)
    pub l1: f64,   // mean absolute coefficient (19)
    pub lift: f64, // share of the input's energy that the latent input cannot carry
    pub bptt: f64, // predictions over a window (41)
}

/// Values of the terms, unweighted; errors are mean squares.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Losses {
    pub decoder: f64, // x - x_dec (16), with coordinate weights if there are any
    pub ddz: f64,     // ddz - ddz_pred (17)
    pub ddx: f64,     // ddx - ddx_pred (18)
    pub l1: f64,      // mean of |Xi| (19)
    pub lift: f64,    // ||u - W_e^T u_lat||^2 / ||u||^2
    pub bptt: f64,    // z - z_pred over a window (41); 0 unless it has a weight
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

pub(super) struct Encoded {
    stack: DMatrix<f64>,  // z, dz, ddz: 3n x d
    jacobians: Jacobians, // between x and z
    projections: InputProjections,
    variables: DMatrix<f64>, // z, dz, u_lat: n x 3d
    theta: DMatrix<f64>,
}

/// Quantities of a batch that stay constant while the encoder does.
pub(super) enum Known {
    Encoded(Encoded),
    Quadratic(Quadratic),
}

/// A loss that is quadratic in a matrix `M`: its gradient is `gram M metric - cross`.
pub(super) struct Quadratic {
    gram: DMatrix<f64>,
    metric: DMatrix<f64>,
    cross: DMatrix<f64>,
}

impl Quadratic {
    fn gradient(&self, at: &DMatrix<f64>) -> DMatrix<f64> {
        product(&product(&self.gram, at), &self.metric) - &self.cross
    }
}

pub(super) struct JointLoss<'a> {
    pub weights: LossWeights,
    pub current: LossWeights, // in this epoch
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

    /// (9), (11), (12) and (13) at every sample.
    fn encode(&mut self, parameters: &Parameters, batch: &Batch) -> Encoded {
        let (encoder, tape) = (&parameters.encoder, &mut self.encoder_tape);
        let (n, d) = (batch.samples(), self.features.latent_dim);
        let stack = encoder.forward(&batch.entering, n, tape) * self.frame.latent;
        let mut jacobians = encoder.jacobian(tape);
        self.frame.scale_jacobian(&mut jacobians.rows);
        let projections = InputProjections::new(&jacobians.rows, &batch.u, d);
        let mut variables = DMatrix::zeros(n, 3 * d);
        (variables.columns_mut(0, d)).copy_from(&stack.rows(0, n));
        (variables.columns_mut(d, d)).copy_from(&stack.rows(n, n));
        (variables.columns_mut(2 * d, d)).copy_from(&projections.u_lat);
        Encoded {
            theta: self.features.evaluate(&variables, &mut self.values),
            stack,
            jacobians,
            projections,
            variables,
        }
    }

    pub(super) fn known(&mut self, parameters: &Parameters, batch: &Batch, moved: Moved) -> Known {
        let encoded = self.encode(parameters, batch);
        let [decoder] = &parameters.decoder.layers[..] else {
            return Known::Encoded(encoded);
        };
        if moved == Moved::Xi && self.weights.bptt != 0.0 {
            return Known::Encoded(encoded);
        }
        let (frame, (n, state_dim)) = (&self.frame, batch.x.shape());
        let share = 2.0 / (n * state_dim) as f64;
        let spread = DMatrix::from_diagonal(&frame.spread);
        let (left, metric, target) = match moved {
            Moved::Decoder => {
                let weights = DMatrix::from_diagonal(&(&self.coordinate_weights * share));
                let mut target = batch.x.clone();
                for (mut column, mean) in target.column_iter_mut().zip(&frame.mean) {
                    column.add_scalar_mut(-mean);
                }
                let z = encoded.stack.rows(0, n) / frame.latent;
                let left = z.insert_column(encoded.stack.ncols(), 1.0);
                let weighted = &spread * weights;
                (left, &spread * &weighted, target * weighted)
            }
            Moved::All | Moved::Xi => {
                let ddz = encoded.stack.rows(2 * n, n);
                let latent = 2.0 * self.weights.ddz / ddz.len() as f64;
                let real = share * self.weights.ddx;
                let decoded = &decoder.weights * spread / frame.latent;
                let metric = &decoded * decoded.transpose() * real;
                let metric = metric + DMatrix::identity(ddz.ncols(), ddz.ncols()) * latent;
                let target = ddz * latent + &batch.ddx * decoded.transpose() * real;
                (encoded.theta, metric, target)
            }
        };
        Known::Quadratic(Quadratic {
            gram: left.tr_mul(&left),
            cross: left.tr_mul(&target),
            metric,
        })
    }

    fn follow(&mut self, parameters: &Parameters, phase: usize, moved: Moved, of: &Quadratic) {
        if moved == Moved::Decoder {
            let layer = &parameters.decoder.layers[0];
            let last = layer.weights.nrows();
            let mut affine = layer.weights.clone().insert_row(last, 0.0);
            affine.row_mut(last).tr_copy_from(&layer.bias);
            let gradient = of.gradient(&affine);
            let own = &mut self.gradient.decoder.layers[0];
            own.weights.copy_from(&gradient.rows(0, last));
            own.bias.tr_copy_from(&gradient.row(last));
            return;
        }
        let xi = &parameters.xi[phase];
        self.gradient.xi[phase] = of.gradient(xi);
        let l1_scale = self.current.l1 / xi.len() as f64;
        l1_subgradient(xi, l1_scale, &mut self.gradient.xi[phase]);
    }

    /// The losses on a batch; the gradient of their weighted sum is stored in [`Self::gradient`]. If `known` is given,
    /// the gradient is that of the `moved` parameters only, and losses may be left out.
    pub(super) fn evaluate(
        &mut self,
        parameters: &Parameters,
        batch: &Batch,
        moved: Moved,
        known: Option<&Known>,
    ) -> Losses {
        let fresh;
        let encoded = match known {
            Some(Known::Quadratic(quadratic)) => {
                self.follow(parameters, batch.phase, moved, quadratic);
                return Losses::default();
            }
            Some(Known::Encoded(known)) => known,
            None => {
                fresh = self.encode(parameters, batch);
                &fresh
            }
        };
        self.gradient.clear();
        let weights = self.current;
        let (n, d) = (batch.samples(), self.features.latent_dim);
        if moved == Moved::Decoder {
            let positions = encoded.stack.rows(0, n).into_owned();
            self.decode(parameters, batch, positions);
            return Losses::default();
        }
        let xi = &parameters.xi[batch.phase];
        let predicted = product(&encoded.theta, xi);
        let mut residual = &predicted - encoded.stack.rows(2 * n, n);
        let ddz = residual.norm_squared() / (n * d) as f64;
        residual *= 2.0 * weights.ddz / (n * d) as f64;
        let mut entering = encoded.stack.clone();
        entering.rows_mut(2 * n, n).copy_from(&predicted);
        let (decoder, ddx, mut onto_stack) = self.decode(parameters, batch, entering);
        let adjoint = onto_stack.rows(2 * n, n) + &residual;
        onto_stack.rows_mut(2 * n, n).copy_from(&-residual);
        let (bptt, onto_variables) =
            self.library_adjoint(parameters, batch, moved, encoded, &adjoint);
        let total = batch.u.norm_squared().max(f64::MIN_POSITIVE);
        if moved == Moved::All {
            let onto = (onto_stack, &onto_variables);
            self.encoder_adjoint(parameters, batch, encoded, onto, weights.lift / total);
        }
        let l1_scale = weights.l1 * (1.0 / xi.len() as f64);
        let l1 = l1_subgradient(xi, l1_scale, &mut self.gradient.xi[batch.phase]);
        Losses {
            decoder,
            ddz,
            ddx,
            l1,
            lift: 1.0 - encoded.projections.carried / total,
            bptt,
        }
    }

    /// (16) and (18), and the adjoint of `entering`: `z`, `dz` and the predicted `ddz`, `3n x d`, or `z` alone.
    fn decode(
        &mut self,
        parameters: &Parameters,
        batch: &Batch,
        mut entering: DMatrix<f64>,
    ) -> (f64, f64, DMatrix<f64>) {
        let (frame, (n, state_dim)) = (&self.frame, batch.x.shape());
        entering /= frame.latent;
        let (map, tape) = (&parameters.decoder, &mut self.decoder_tape);
        let mut leaving = map.forward(&entering, n, tape);
        let (mut reconstruction, mut ddx) = (0.0, 0.0);
        let share = 1.0 / (n * state_dim) as f64;
        for (i, mut column) in leaving.column_iter_mut().enumerate() {
            let (mean, spread) = (frame.mean[i], frame.spread[i]);
            let weight = self.coordinate_weights[i] * share;
            let (values, rates) = column.as_mut_slice().split_at_mut(n);
            for (value, x) in values.iter_mut().zip(batch.x.column(i).as_slice()) {
                *value = mean + spread * *value - x;
            }
            reconstruction += weight * dot(values, values);
            let factor = 2.0 * weight * spread;
            values.iter_mut().for_each(|value| *value *= factor);
            let (velocities, accelerations) = rates.split_at_mut(rates.len() / 2);
            velocities.fill(0.0);
            for (value, target) in accelerations.iter_mut().zip(batch.ddx.column(i).as_slice()) {
                *value = spread * *value - target;
            }
            ddx += share * dot(accelerations, accelerations);
            let factor = 2.0 * self.current.ddx * share * spread;
            accelerations.iter_mut().for_each(|value| *value *= factor);
        }
        let at_first = map.backward((tape, &entering), leaving, &[], &mut self.gradient.decoder);
        let onto = product(&at_first, &map.layers[0].weights.transpose()) / frame.latent;
        (reconstruction, ddx, onto)
    }

    /// From the adjoint of the predicted `ddz` to those of Xi and, if they move, of the variables; (41), if it has a
    /// weight, adds its own.
    fn library_adjoint(
        &mut self,
        parameters: &Parameters,
        batch: &Batch,
        moved: Moved,
        encoded: &Encoded,
        adjoint: &DMatrix<f64>,
    ) -> (f64, DMatrix<f64>) {
        let (xi, variables) = (&parameters.xi[batch.phase], &encoded.variables);
        let onto_xi = &mut self.gradient.xi[batch.phase];
        add_transposed(onto_xi, &encoded.theta, adjoint);
        let mut onto_variables = DMatrix::zeros(variables.nrows(), variables.ncols());
        if moved == Moved::All {
            let onto_theta = product(adjoint, &xi.transpose());
            self.features
                .backward(&onto_theta, &mut self.values, &mut onto_variables);
        }
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
        let adjoints = [&mut onto_variables, onto_xi];
        let bptt = self.unroll.evaluate(samples, weight, adjoints);
        (bptt, onto_variables)
    }

    /// Adds the gradient by the encoder, from the adjoints of `z`, `dz`, `ddz` (`3n x d`) and of the variables
    /// (`n x 3d`), and the weight of the energy carried.
    fn encoder_adjoint(
        &mut self,
        parameters: &Parameters,
        batch: &Batch,
        encoded: &Encoded,
        (mut onto_stack, onto_variables): (DMatrix<f64>, &DMatrix<f64>),
        lift: f64,
    ) {
        let (n, d) = encoded.projections.u_lat.shape();
        for (block, start) in [(0, 0), (n, d)] {
            let mut rows = onto_stack.rows_mut(block, n);
            rows += onto_variables.columns(start, d);
        }
        let onto_inputs = onto_variables.columns(2 * d, d).into_owned();
        let (jacobians, projections) = (&encoded.jacobians, &encoded.projections);
        let mut onto_rows = projections.adjoint(&jacobians.rows, &batch.u, &onto_inputs, lift);
        self.frame.scale_jacobian(&mut onto_rows);
        let (encoder, tape) = (&parameters.encoder, &self.encoder_tape);
        let own = &mut self.gradient.encoder;
        let at_affine = encoder.jacobian_adjoint(tape, jacobians, onto_rows, own);
        let forward = (tape, &batch.entering);
        encoder.backward(forward, onto_stack * self.frame.latent, &at_affine, own);
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

#[cfg(test)]
#[path = "../../../../tests/units/learn_train_joint_loss.rs"]
mod tests;
