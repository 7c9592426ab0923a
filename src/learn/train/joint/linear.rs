//! Linear encoder and decoder in the loss, on moments of the batches where sums over samples allow it.

use nalgebra::{DMatrix, DVector};

use super::batch::Batch;
use super::loss::{DecoderLoss, LossPoint, LossWeights, Losses, Maps, XiLoss, l1_subgradient};
use super::multiply::{Columns, add_product, add_transposed, product_into};
use super::network::Dense;
use super::parameters::Parameters;
use super::projection::InputProjection;
use crate::train::features::{FeatureValues, Features};

/// `z = x W_e^T + b_e^T` and `x = z W_d^T + b_d^T` for samples in rows.
pub(super) struct LinearMaps {
    coordinate_weights: DVector<f64>,
    mask: Vec<bool>,
    projection: InputProjection, // of the last encoder
}

impl LinearMaps {
    /// `coordinate_weights` (18) weigh the coordinates in (16), `mask` (18) is true for those that the encoder may
    /// use; the weights of the others get no gradient.
    pub(super) fn new(coordinate_weights: DVector<f64>, mask: Vec<bool>) -> Self {
        Self {
            coordinate_weights,
            mask,
            projection: InputProjection::default(),
        }
    }

    /// (16): with `E = [W_e^T; b_e]` and `M = E W_d^T + [0; b_d] - [I; 0]` it is `tr(M^T S M) / 18`, `S` the moment
    /// of `[x, 1]`. No matrix of samples is formed.
    fn reconstruction(&self, at: LossPoint<'_>, gradient: &mut Parameters) -> f64 {
        let (encoder, decoder) = layers(at.parameters);
        let moment = &at.batch.state_moment;
        let (n, d) = encoder.weights.shape();
        let mut extended = DMatrix::zeros(n + 1, d);
        extended.rows_mut(0, n).copy_from(&encoder.weights);
        extended.row_mut(n).tr_copy_from(&encoder.bias);
        let mut adjoint = moment * &extended * &decoder.weights; // S M
        adjoint.ger(1.0, &moment.column(n), &decoder.bias, 1.0);
        adjoint -= moment.columns(0, n);
        for (mut column, weight) in (adjoint.column_iter_mut()).zip(self.coordinate_weights.iter())
        {
            column *= weight / n as f64;
        }
        let seen = extended.tr_mul(&adjoint);
        let loss = decoder.weights.dot(&seen) + adjoint.row(n).tr_dot(&decoder.bias)
            - (0..n).map(|i| adjoint[(i, i)]).sum::<f64>();
        let onto_encoder = &adjoint * decoder.weights.transpose() * 2.0;
        let own = &mut gradient.encoder.layers[0];
        own.weights += onto_encoder.rows(0, n);
        own.bias += onto_encoder.row(n).transpose();
        let own = &mut gradient.decoder.layers[0];
        own.weights += seen * 2.0;
        own.bias += adjoint.row(n).transpose() * 2.0;
        loss
    }

    /// Share of the input's energy outside the row space: `1 - tr((V^T V)^-1 V^T S V) / tr S`, `V = W_e^T`.
    fn lift(&self, at: LossPoint<'_>, gradient: &mut Parameters) -> f64 {
        let moment = &at.batch.input_moment;
        let total = moment.trace().max(f64::MIN_POSITIVE);
        let seen = moment * &self.projection.weights; // S V A^-1
        let carried = layers(at.parameters).0.weights.tr_mul(&seen);
        if at.weights.lift != 0.0 {
            let outside = seen - &self.projection.weights * &carried;
            gradient.encoder.layers[0].weights += outside * (-2.0 * at.weights.lift / total);
        }
        1.0 - carried.trace() / total
    }
}

impl Maps for LinearMaps {
    fn encode(&mut self, at: LossPoint<'_>) -> DMatrix<f64> {
        let (encoder, batch) = (layers(at.parameters).0, at.batch);
        let d = encoder.bias.len();
        self.projection = InputProjection::new(&encoder.weights);
        let mut variables = DMatrix::zeros(batch.samples(), 3 * d);
        let blocks = [
            (&batch.x, &encoder.weights),
            (&batch.dx, &encoder.weights),
            (&batch.u, &self.projection.weights),
        ];
        for (index, (samples, weights)) in blocks.into_iter().enumerate() {
            product_into(&mut variables, index * d, Columns::all(samples), weights);
        }
        add_to_rows(&mut variables, &encoder.bias);
        variables
    }

    fn residual(&self, at: LossPoint<'_>, predicted: &DMatrix<f64>) -> DMatrix<f64> {
        let mut residual = predicted.clone();
        let encoder = &layers(at.parameters).0.weights;
        add_product(&mut residual, -1.0, &at.batch.ddx, encoder);
        residual
    }

    /// (18) comes from the moments of predictions and accelerations: no `n x 18` matrix is formed.
    fn decode(
        &mut self,
        at: LossPoint<'_>,
        predicted: &DMatrix<f64>,
        adjoint: &DMatrix<f64>,
        gradient: &mut Parameters,
    ) -> (f64, f64, DMatrix<f64>) {
        let reconstruction = self.reconstruction(at, gradient);
        let (batch, decoder) = (at.batch, &layers(at.parameters).1.weights);
        let (d, state_dim) = decoder.shape();
        let n_values = (batch.samples() * state_dim) as f64;
        let scale = 2.0 * at.weights.ddx / n_values;
        let (mut cross, mut gram) = (DMatrix::zeros(d, state_dim), DMatrix::zeros(d, d));
        let predictions = Columns::all(predicted);
        add_transposed(&mut cross, 1.0, predictions, Columns::all(&batch.ddx));
        add_transposed(&mut gram, 1.0, predictions, predictions);
        let decoded = &gram * decoder;
        let energy = decoder.dot(&decoded) - 2.0 * decoder.dot(&cross);
        let ddx = (energy + batch.ddx_energy) / n_values;
        gradient.decoder.layers[0].weights += (decoded - cross) * scale;
        let (mut adjoint, transposed) = (adjoint.clone(), decoder.transpose());
        add_product(&mut adjoint, scale, predicted, &(decoder * &transposed));
        add_product(&mut adjoint, -scale, &batch.ddx, &transposed);
        (reconstruction, ddx, adjoint)
    }

    fn encode_adjoint(
        &mut self,
        at: LossPoint<'_>,
        onto_ddz: &DMatrix<f64>,
        onto_variables: &DMatrix<f64>,
        gradient: &mut Parameters,
    ) -> f64 {
        let lift = self.lift(at, gradient);
        let (batch, encoder) = (at.batch, &layers(at.parameters).0.weights);
        let d = encoder.ncols();
        let own = &mut gradient.encoder.layers[0];
        let block = |index: usize| Columns::some(onto_variables, index * d, d);
        let onto_ddz = Columns::all(onto_ddz);
        add_transposed(&mut own.weights, -1.0, Columns::all(&batch.ddx), onto_ddz);
        add_transposed(&mut own.weights, 1.0, Columns::all(&batch.x), block(0));
        add_transposed(&mut own.weights, 1.0, Columns::all(&batch.dx), block(1));
        for (bias, column) in (own.bias.iter_mut()).zip(onto_variables.column_iter()) {
            *bias += column.sum();
        }
        let mut onto_projection = DMatrix::zeros(batch.u.ncols(), d);
        add_transposed(&mut onto_projection, 1.0, Columns::all(&batch.u), block(2));
        own.weights += self.projection.adjoint(encoder, &onto_projection);
        mask_rows(&mut own.weights, &self.mask);
        lift
    }

    /// Quadratic in the decoder: the batch enters by moments that are computed once.
    fn decoder_loss(&self, parameters: &Parameters, batch: &Batch) -> Option<DecoderLoss> {
        let (n, d) = layers(parameters).0.weights.shape();
        let count = batch.samples() as f64;
        let z = encode(parameters, batch).insert_column(d, 1.0);
        let gram = z.tr_mul(&z) / count;
        let cross = z.tr_mul(&batch.x) / count;
        let energy = batch.x.norm_squared() / count;
        Some(Box::new(move |decoder, gradient| {
            let decoder = &decoder.layers[0];
            let mut extended = decoder.weights.clone().insert_row(d, 0.0);
            extended.row_mut(d).tr_copy_from(&decoder.bias);
            let mut adjoint = &gram * &extended;
            let square = extended.dot(&adjoint) - 2.0 * extended.dot(&cross) + energy;
            adjoint -= &cross;
            adjoint *= 2.0 / n as f64;
            let own = &mut gradient.layers[0];
            own.weights.copy_from(&adjoint.rows(0, d));
            own.bias.tr_copy_from(&adjoint.row(d));
            square / n as f64
        }))
    }

    /// Quadratic in Xi: the batch enters by moments that are computed once.
    fn xi_loss(
        &self,
        parameters: &Parameters,
        batch: &Batch,
        features: &Features,
    ) -> Option<XiLoss> {
        let (encoder, decoder) = layers(parameters);
        let theta = theta(parameters, batch, features);
        let ddz = &batch.ddx * &encoder.weights;
        let gram = theta.tr_mul(&theta);
        let latent = theta.tr_mul(&ddz);
        let real = theta.tr_mul(&(&batch.ddx * decoder.weights.transpose()));
        let decoder_gram = &decoder.weights * decoder.weights.transpose();
        let (ddz_energy, ddx_energy) = (ddz.norm_squared(), batch.ddx_energy);
        let (n, state_dim) = (batch.samples() as f64, batch.x.ncols() as f64);
        Some(Box::new(move |xi: &DMatrix<f64>, weights: LossWeights| {
            let latent_scale = 1.0 / (n * xi.ncols() as f64);
            let real_scale = 1.0 / (n * state_dim);
            let product = &gram * xi;
            let decoded = &product * &decoder_gram;
            let mut losses = Losses {
                ddz: latent_scale * (xi.dot(&product) - 2.0 * xi.dot(&latent) + ddz_energy),
                ddx: real_scale * (xi.dot(&decoded) - 2.0 * xi.dot(&real) + ddx_energy),
                ..Losses::default()
            };
            let mut gradient = (product - &latent) * (2.0 * weights.ddz * latent_scale);
            gradient += (decoded - &real) * (2.0 * weights.ddx * real_scale);
            losses.l1 = l1_subgradient(xi, weights.l1 / xi.len() as f64, &mut gradient);
            (losses, gradient)
        }))
    }
}

/// Sets the rows of `encoder` (18 x d) for which `mask` is false to zero.
pub(super) fn mask_rows(encoder: &mut DMatrix<f64>, mask: &[bool]) {
    for (mut row, _) in encoder.row_iter_mut().zip(mask).filter(|(_, used)| !**used) {
        row.fill(0.0);
    }
}

fn layers(parameters: &Parameters) -> (&Dense, &Dense) {
    (&parameters.encoder.layers[0], &parameters.decoder.layers[0])
}

/// `z` of a batch, rows are samples.
fn encode(parameters: &Parameters, batch: &Batch) -> DMatrix<f64> {
    let encoder = layers(parameters).0;
    let mut z = &batch.x * &encoder.weights;
    add_to_rows(&mut z, &encoder.bias);
    z
}

/// The library on a batch, `n x library_dim`.
fn theta(parameters: &Parameters, batch: &Batch, features: &Features) -> DMatrix<f64> {
    let encoder = &layers(parameters).0.weights;
    let (n, d) = (batch.samples(), encoder.ncols());
    let projection = InputProjection::new(encoder);
    let mut variables = encode(parameters, batch).resize(n, 3 * d, 0.0);
    (variables.columns_mut(d, d)).copy_from(&(&batch.dx * encoder));
    (variables.columns_mut(2 * d, d)).copy_from(&(&batch.u * &projection.weights));
    features.evaluate(&variables, &mut FeatureValues::default())
}

/// Adds `row` to every row of the leading columns.
fn add_to_rows(matrix: &mut DMatrix<f64>, row: &DVector<f64>) {
    for (mut column, value) in matrix.column_iter_mut().zip(row.iter()) {
        column.add_scalar_mut(*value);
    }
}
