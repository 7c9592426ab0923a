//! Nonlinear encoder and decoder in the loss, as networks.
//!
//! With the encoder's Jacobian `J` at each sample: `z = phi(x)`, `dz = J dx`, `ddz = J ddx + (dJ/dt) dx`,
//! `u_lat = pinv(J^T) u`; the decoder takes `(z, dz, Theta Xi)` to the decoded position and acceleration the same way.

use nalgebra::{DMatrix, DVector};

use super::batch::Batch;
use super::loss::{At, DecoderLoss, LossWeights, Losses, Maps, XiLoss, l1_subgradient};
use super::multiply::{Columns, add_transposed, product};
use super::network::{Jacobians, Tape};
use super::parameters::{Frame, Parameters};
use super::projection::InputProjections;
use crate::train::features::{FeatureValues, Features};

/// Networks in their frame, with the forward pass of the last batch.
pub struct NonlinearMaps {
    frame: Frame,
    coordinate_weights: DVector<f64>,
    encoder_tape: Tape,
    decoder_tape: Tape,
    encoded: Encoded,
    decoded: DMatrix<f64>, // adjoint of z, dz and the predicted ddz, 3n x d
}

/// A batch in latent coordinates.
#[derive(Default)]
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
        let mut rows = jacobians.rows.clone();
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

impl NonlinearMaps {
    /// Networks between the units of `frame`; `coordinate_weights` (18) weigh the coordinates in (16).
    pub fn new(coordinate_weights: DVector<f64>, frame: Frame) -> Self {
        Self {
            frame,
            coordinate_weights,
            encoder_tape: Tape::default(),
            decoder_tape: Tape::default(),
            encoded: Encoded::default(),
            decoded: DMatrix::zeros(0, 0),
        }
    }
}

impl Maps for NonlinearMaps {
    fn encode(&mut self, at: At<'_>) -> DMatrix<f64> {
        let tape = &mut self.encoder_tape;
        self.encoded = Encoded::new(at.parameters, at.batch, &self.frame, tape);
        self.encoded.variables()
    }

    fn residual(&self, at: At<'_>, predicted: &DMatrix<f64>) -> DMatrix<f64> {
        let n = at.batch.samples();
        predicted - self.encoded.stack.rows(2 * n, n)
    }

    fn decode(
        &mut self,
        at: At<'_>,
        predicted: &DMatrix<f64>,
        adjoint: &DMatrix<f64>,
        gradient: &mut Parameters,
    ) -> (f64, f64, DMatrix<f64>) {
        let (batch, decoder) = (at.batch, &at.parameters.decoder);
        let (n, state_dim) = batch.x.shape();
        let mut entering = self.encoded.stack.clone();
        entering.rows_mut(2 * n, n).copy_from(predicted);
        entering /= self.frame.latent;
        let mut leaving = decoder.forward(entering, n, &mut self.decoder_tape);
        let (mut reconstruction, mut ddx) = (0.0, 0.0);
        let share = 1.0 / (n * state_dim) as f64;
        for (i, mut column) in leaving.column_iter_mut().enumerate() {
            let (mean, spread) = (self.frame.mean[i], self.frame.spread[i]);
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
                *value = 2.0 * at.weights.ddx * share * spread * residual;
            }
        }
        let own = &mut gradient.decoder;
        let decoded = decoder.backward(&self.decoder_tape, leaving, &[], own);
        self.decoded = decoded / self.frame.latent;
        let onto_predicted = self.decoded.rows(2 * n, n) + adjoint;
        (reconstruction, ddx, onto_predicted)
    }

    fn encode_adjoint(
        &mut self,
        at: At<'_>,
        onto_ddz: &DMatrix<f64>,
        onto_variables: &DMatrix<f64>,
        gradient: &mut Parameters,
    ) -> f64 {
        let (batch, encoder) = (at.batch, &at.parameters.encoder);
        let (n, d) = onto_ddz.shape();
        let mut onto_stack = std::mem::take(&mut self.decoded);
        onto_stack.rows_mut(2 * n, n).copy_from(&-onto_ddz);
        for (block, start) in [(0, 0), (n, d)] {
            let mut rows = onto_stack.rows_mut(block, n);
            rows += onto_variables.columns(start, d);
        }
        let onto_inputs = onto_variables.columns(2 * d, d).into_owned();
        let total = batch.input_moment.trace().max(f64::MIN_POSITIVE);
        let encoded = &self.encoded;
        let (projections, lift) = (&encoded.projections, at.weights.lift / total);
        let mut onto_rows = projections.adjoint(&encoded.rows, &batch.u, &onto_inputs, lift);
        self.frame.scale_jacobian(&mut onto_rows);
        let (tape, own) = (&self.encoder_tape, &mut gradient.encoder);
        let at_affine = encoder.jacobian_adjoint(tape, &encoded.jacobians, &onto_rows, own);
        encoder.backward(tape, onto_stack * self.frame.latent, &at_affine, own);
        1.0 - projections.carried / total
    }

    fn decoder_loss<'a>(&'a self, parameters: &Parameters, batch: &'a Batch) -> DecoderLoss<'a> {
        let (n, frame) = (batch.samples(), &self.frame);
        let mut tape = Tape::default();
        let states = frame.enter(batch).rows(0, n).into_owned();
        let z = parameters.encoder.forward(states, n, &mut tape);
        Box::new(move |decoder, gradient| {
            gradient.clear();
            let mut leaving = decoder.forward(z.clone(), n, &mut tape);
            let (mut loss, share) = (0.0, 1.0 / leaving.len() as f64);
            for (i, mut column) in leaving.column_iter_mut().enumerate() {
                for (value, x) in column.iter_mut().zip(batch.x.column(i).iter()) {
                    let residual = frame.mean[i] + frame.spread[i] * *value - x;
                    loss += share * residual * residual;
                    *value = 2.0 * share * frame.spread[i] * residual;
                }
            }
            decoder.backward(&tape, leaving, &[], gradient);
            loss
        })
    }

    fn xi_loss(&self, parameters: &Parameters, batch: &Batch, features: &Features) -> XiLoss {
        let samples = XiSamples::new(parameters, batch, features, &self.frame);
        Box::new(move |xi, weights| samples.evaluate(xi, weights))
    }
}

/// (17) and (18) of one batch as quadratic functions of the predicted `ddz`, so that the networks are evaluated once:
/// with the decoder's Jacobian `J_D` at every sample, the decoded acceleration is `J_D ddz + (dJ_D/dt) dz`.
struct XiSamples {
    theta: DMatrix<f64>,
    ddz: DMatrix<f64>,
    gram: Vec<DVector<f64>>, // J_D^T J_D of all samples, entry by entry, row-major
    cross: DMatrix<f64>,     // J_D^T (ddx - dJ_D/dt dz), n x d
    energy: f64,             // sum of squares of ddx - dJ_D/dt dz
    state_dim: usize,
}

impl XiSamples {
    fn new(parameters: &Parameters, batch: &Batch, features: &Features, frame: &Frame) -> Self {
        let (n, d, state_dim) = (batch.samples(), features.latent_dim(), batch.x.ncols());
        let mut tape = Tape::default();
        let encoded = Encoded::new(parameters, batch, frame, &mut tape);
        let theta = features.evaluate(&encoded.variables(), &mut FeatureValues::default());
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
            cross: DMatrix::zeros(n, d),
            energy: 0.0,
            state_dim,
        };
        for i in 0..state_dim {
            let rows = jacobians.rows(i * n, n) * (frame.spread[i] / frame.latent);
            let drift = leaving.view((2 * n, i), (n, 1)) * frame.spread[i];
            let rest = batch.ddx.column(i) - drift.column(0);
            samples.energy += rest.norm_squared();
            for a in 0..d {
                let mut cross = samples.cross.column_mut(a);
                cross += rows.column(a).component_mul(&rest);
                for b in 0..d {
                    samples.gram[a * d + b] += rows.column(a).component_mul(&rows.column(b));
                }
            }
        }
        samples
    }

    fn evaluate(&self, xi: &DMatrix<f64>, weights: LossWeights) -> (Losses, DMatrix<f64>) {
        let (n, d) = self.ddz.shape();
        let predicted = product(&self.theta, xi);
        let mut decoded = DMatrix::zeros(n, d);
        for a in 0..d {
            for b in 0..d {
                let mut column = decoded.column_mut(a);
                column += self.gram[a * d + b].component_mul(&predicted.column(b));
            }
        }
        let (latent_scale, real_scale) = (1.0 / (n * d) as f64, 1.0 / (n * self.state_dim) as f64);
        let residual = &predicted - &self.ddz;
        let square = predicted.dot(&decoded) - 2.0 * predicted.dot(&self.cross) + self.energy;
        let mut losses = Losses {
            ddz: latent_scale * residual.norm_squared(),
            ddx: real_scale * square,
            ..Losses::default()
        };
        let adjoint = residual * (2.0 * weights.ddz * latent_scale)
            + (decoded - &self.cross) * (2.0 * weights.ddx * real_scale);
        let mut gradient = DMatrix::zeros(xi.nrows(), d);
        let (theta, adjoint) = (Columns::all(&self.theta), Columns::all(&adjoint));
        add_transposed(&mut gradient, 1.0, theta, adjoint);
        losses.l1 = l1_subgradient(xi, weights.l1 / xi.len() as f64, &mut gradient);
        (losses, gradient)
    }
}
