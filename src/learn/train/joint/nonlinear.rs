//! Nonlinear encoder and decoder in the loss, as networks.
//!
//! With the encoder's Jacobian `J` at each sample: `z = phi(x)`, `dz = J dx`, `ddz = J ddx + (dJ/dt) dx`,
//! `u_lat = pinv(J^T) u`; the decoder takes `(z, dz, Theta Xi)` to the decoded position and acceleration the same way.

use nalgebra::{DMatrix, DVector};

use super::batch::Batch;
use super::loss::{LossPoint, Maps};
use super::network::{Jacobians, Tape};
use super::parameters::{Frame, Parameters};
use super::projection::InputProjections;

/// Networks in their frame, with the forward pass of the last batch.
pub(super) struct NonlinearMaps {
    frame: Frame,
    coordinate_weights: DVector<f64>,
    encoder_tape: Tape,
    decoder_tape: Tape,
    encoded: Encoded,
    decoded: DMatrix<f64>, // adjoint of z, dz and the predicted ddz, 3n x d
}

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
    pub(super) fn new(coordinate_weights: DVector<f64>, frame: Frame) -> Self {
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
    fn encode(&mut self, at: LossPoint<'_>) -> DMatrix<f64> {
        let tape = &mut self.encoder_tape;
        self.encoded = Encoded::new(at.parameters, at.batch, &self.frame, tape);
        self.encoded.variables()
    }

    fn residual(&self, at: LossPoint<'_>, predicted: &DMatrix<f64>) -> DMatrix<f64> {
        let n = at.batch.samples();
        predicted - self.encoded.stack.rows(2 * n, n)
    }

    fn decode(
        &mut self,
        at: LossPoint<'_>,
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
        at: LossPoint<'_>,
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
}
