//! The losses (16) to (20) with the lift loss, and their exact gradient.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::batch::Batch;
use super::multiply::{Columns, add_product, add_transposed, product_into};
use super::parameters::Parameters;
use super::unroll::{Pulls, Unroll, Window};
use crate::train::features::{FeatureValues, Features};

/// Weights of the terms of the loss (equation 20).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
    #[serde(default)]
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    #[serde(default)]
    pub bptt: f64,
}

impl Losses {
    /// The combined loss (20).
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

/// The loss over one library, with its scratch space.
pub struct JointLoss<'a> {
    features: &'a Features,
    weights: LossWeights,
    unroll: Unroll,
    coordinate_weights: DVector<f64>,
    values: FeatureValues,
    variables: DMatrix<f64>, // n x 3d: z, dz, u_lat
    pulled: DMatrix<f64>,    // their gradient
    gradient: Parameters,
}

impl<'a> JointLoss<'a> {
    /// The loss with these weights; `coordinate_weights` (18) weigh the coordinates in (16).
    pub fn new(
        features: &'a Features,
        weights: LossWeights,
        coordinate_weights: DVector<f64>,
    ) -> Self {
        let (n, d) = (coordinate_weights.len(), features.latent_dim());
        Self {
            features,
            weights,
            unroll: Unroll::default(),
            coordinate_weights,
            values: FeatureValues::default(),
            variables: DMatrix::zeros(0, 3 * d),
            pulled: DMatrix::zeros(0, 3 * d),
            gradient: Parameters::zeros(n, d, features.library_dim()),
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

    /// Gradient of the last [`Self::evaluate`].
    pub fn gradient(&self) -> &Parameters {
        &self.gradient
    }

    /// The losses on a batch; the gradient of their weighted sum is kept in [`Self::gradient`].
    pub fn evaluate(&mut self, parameters: &Parameters, batch: &Batch) -> Losses {
        self.gradient
            .blocks_mut()
            .into_iter()
            .for_each(|block| block.fill(0.0));
        let decoder = self.reconstruction(parameters, batch);
        let projection = InputProjection::new(&parameters.encoder);
        let lift = self.lift(parameters, batch, &projection);
        let (ddz, ddx, bptt) = self.dynamics(parameters, batch, &projection);
        let l1 = {
            let xi = &parameters.xi;
            let pull = self.weights.l1 * (1.0 / xi.len() as f64);
            l1_subgradient(xi, pull, &mut self.gradient.xi)
        };
        Losses {
            decoder,
            ddz,
            ddx,
            l1,
            lift,
            bptt,
        }
    }

    /// (16): with `E = [W_e^T; b_e]` and `M = E W_d^T + [0; b_d] - [I; 0]` it is `tr(M^T S M) / 18`, `S` the moment
    /// of `[x, 1]`. No matrix of samples is formed.
    fn reconstruction(&mut self, parameters: &Parameters, batch: &Batch) -> f64 {
        let Parameters {
            encoder,
            encoder_bias,
            decoder,
            decoder_bias,
            ..
        } = parameters;
        let (n, d) = encoder.shape();
        let mut extended = DMatrix::zeros(n + 1, d);
        extended.rows_mut(0, n).copy_from(encoder);
        extended.row_mut(n).tr_copy_from(encoder_bias);
        let mut pull = &batch.state_moment * &extended * decoder; // S M
        pull.ger(1.0, &batch.state_moment.column(n), decoder_bias, 1.0);
        pull -= batch.state_moment.columns(0, n);
        for (mut column, weight) in pull.column_iter_mut().zip(self.coordinate_weights.iter()) {
            column *= weight / n as f64;
        }
        let seen = extended.tr_mul(&pull);
        let loss = decoder.dot(&seen) + pull.row(n).tr_dot(decoder_bias)
            - (0..n).map(|i| pull[(i, i)]).sum::<f64>();
        let encoder_pull = &pull * decoder.transpose() * 2.0;
        self.gradient.encoder += encoder_pull.rows(0, n);
        self.gradient.encoder_bias += encoder_pull.row(n).transpose();
        self.gradient.decoder += seen * 2.0;
        self.gradient.decoder_bias += pull.row(n).transpose() * 2.0;
        loss
    }

    /// Share of the input's energy outside the row space: `1 - tr((V^T V)^-1 V^T S V) / tr S`, `V = W_e^T`.
    fn lift(
        &mut self,
        parameters: &Parameters,
        batch: &Batch,
        projection: &InputProjection,
    ) -> f64 {
        let total = batch.input_moment.trace().max(f64::MIN_POSITIVE);
        let seen = &batch.input_moment * &projection.weights; // S V A^-1
        let carried = parameters.encoder.tr_mul(&seen);
        if self.weights.lift != 0.0 {
            let outside = seen - &projection.weights * &carried;
            self.gradient.encoder += outside * (-2.0 * self.weights.lift / total);
        }
        1.0 - carried.trace() / total
    }

    /// (17), (18) and (41), backwards through the library, the encoder and the pseudo-inverse.
    fn dynamics(
        &mut self,
        parameters: &Parameters,
        batch: &Batch,
        projection: &InputProjection,
    ) -> (f64, f64, f64) {
        let (n, d) = (batch.len(), parameters.encoder.ncols());
        let state_dim = batch.x.ncols();
        if self.variables.nrows() != n {
            self.variables = DMatrix::zeros(n, 3 * d);
            self.pulled = DMatrix::zeros(n, 3 * d);
        }
        product_into(
            &mut self.variables,
            0,
            Columns::all(&batch.x),
            &parameters.encoder,
        );
        for (i, bias) in parameters.encoder_bias.iter().enumerate() {
            self.variables.column_mut(i).add_scalar_mut(*bias);
        }
        product_into(
            &mut self.variables,
            d,
            Columns::all(&batch.dx),
            &parameters.encoder,
        );
        product_into(
            &mut self.variables,
            2 * d,
            Columns::all(&batch.u),
            &projection.weights,
        );
        let theta = self.features.evaluate(&self.variables, &mut self.values);
        let mut predicted = DMatrix::zeros(n, d);
        add_product(&mut predicted, 1.0, &theta, &parameters.xi);

        let mut latent_miss = predicted.clone();
        add_product(&mut latent_miss, -1.0, &batch.ddx, &parameters.encoder);
        let ddz = latent_miss.norm_squared() / (n * d) as f64;
        latent_miss *= 2.0 * self.weights.ddz / (n * d) as f64;
        let (ddx_columns, missed) = (Columns::all(&batch.ddx), Columns::all(&latent_miss));
        add_transposed(&mut self.gradient.encoder, -1.0, ddx_columns, missed);

        // (18) over the moments of predictions and accelerations: no n x 18 matrix is formed.
        let scale = 2.0 * self.weights.ddx / (n * state_dim) as f64;
        let (mut shared, mut own) = (DMatrix::zeros(d, state_dim), DMatrix::zeros(d, d));
        let predictions = Columns::all(&predicted);
        add_transposed(&mut shared, 1.0, predictions, ddx_columns);
        add_transposed(&mut own, 1.0, predictions, predictions);
        let own_decoded = &own * &parameters.decoder;
        let energy = parameters.decoder.dot(&own_decoded) - 2.0 * parameters.decoder.dot(&shared);
        let ddx = (energy + batch.ddx_energy) / (n * state_dim) as f64;
        self.gradient.decoder += (own_decoded - shared) * scale;
        let mut pull = latent_miss;
        let transposed = parameters.decoder.transpose();
        add_product(
            &mut pull,
            scale,
            &predicted,
            &(&parameters.decoder * &transposed),
        );
        add_product(&mut pull, -scale, &batch.ddx, &transposed);

        let pulls = Columns::all(&pull);
        add_transposed(&mut self.gradient.xi, 1.0, Columns::all(&theta), pulls);
        let mut theta_pull = DMatrix::zeros(n, theta.ncols());
        add_product(&mut theta_pull, 1.0, &pull, &parameters.xi.transpose());
        self.pulled.fill(0.0);
        self.features
            .backward(&theta_pull, &mut self.values, &mut self.pulled);
        let bptt = self.predictions(parameters, batch);
        self.pull_through_encoder(parameters, batch, projection);
        (ddz, ddx, bptt)
    }

    /// (41), if it has a weight.
    fn predictions(&mut self, parameters: &Parameters, batch: &Batch) -> f64 {
        if self.weights.bptt == 0.0 {
            return 0.0;
        }
        let samples = Window {
            variables: &self.variables,
            xi: &parameters.xi,
            step_s: batch.step_s,
        };
        let mut pulls = Pulls {
            variables: &mut self.pulled,
            xi: &mut self.gradient.xi,
        };
        (self.unroll).evaluate(self.features, samples, self.weights.bptt, &mut pulls)
    }

    fn pull_through_encoder(
        &mut self,
        parameters: &Parameters,
        batch: &Batch,
        projection: &InputProjection,
    ) {
        let d = parameters.encoder.ncols();
        for (samples, start) in [(&batch.x, 0), (&batch.dx, d)] {
            let pulled = Columns::some(&self.pulled, start, d);
            add_transposed(
                &mut self.gradient.encoder,
                1.0,
                Columns::all(samples),
                pulled,
            );
        }
        for (i, column) in self.pulled.columns(0, d).column_iter().enumerate() {
            self.gradient.encoder_bias[i] += column.sum();
        }
        let mut input = DMatrix::zeros(batch.u.ncols(), d);
        let pulled = Columns::some(&self.pulled, 2 * d, d);
        add_transposed(&mut input, 1.0, Columns::all(&batch.u), pulled);
        self.gradient.encoder += projection.pull_back(&parameters.encoder, &input);
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

/// `pinv(W_e^T)^T = V (V^T V)^-1` for `V = W_e^T`: latent inputs of samples in rows are `u` times this.
pub struct InputProjection {
    weights: DMatrix<f64>,      // 18 x d
    inverse_gram: DMatrix<f64>, // d x d
}

impl InputProjection {
    /// The projection of an encoder; directions that are nearly dependent are damped by `1e-12`.
    pub fn new(encoder: &DMatrix<f64>) -> Self {
        let d = encoder.ncols();
        let gram = encoder.tr_mul(encoder) + DMatrix::identity(d, d) * 1e-12;
        let inverse_gram = match gram.clone().cholesky() {
            Some(factor) => factor.inverse(),
            None => gram
                .pseudo_inverse(1e-12)
                .expect("the tolerance is positive"),
        };
        Self {
            weights: encoder * &inverse_gram,
            inverse_gram,
        }
    }

    /// `V (V^T V)^-1`, `18 x d`.
    pub fn weights(&self) -> &DMatrix<f64> {
        &self.weights
    }

    /// Gradient with respect to `V`, given the one with respect to the projection.
    ///
    /// From `dQ = dV A^-1 - Q (dV^T V + V^T dV) A^-1`: with `K = G A^-1`, it is `K - V (Q^T K) - V (K^T Q)`.
    fn pull_back(&self, encoder: &DMatrix<f64>, gradient: &DMatrix<f64>) -> DMatrix<f64> {
        let k = gradient * &self.inverse_gram;
        let crossed = self.weights.tr_mul(&k);
        &k - encoder * (&crossed + crossed.transpose())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Library, StandardLibrary};
    use crate::train::random::Random;

    fn batch(random: &mut Random) -> Batch {
        let blocks = std::array::from_fn(|_| random.matrix(30, 7, 0.8));
        Batch::new(0, blocks, 0.002)
    }

    fn features() -> Features {
        Features::new(&Library::standard(3, StandardLibrary::default()).expect("small library"))
    }

    fn loss(features: &Features) -> JointLoss<'_> {
        let weights = LossWeights {
            ddz: 0.7,
            ddx: 0.4,
            l1: 0.3,
            lift: 0.9,
            bptt: 0.8,
        };
        let unroll = Unroll {
            window: 3,
            stride: 2,
            ..Unroll::default()
        };
        JointLoss::new(
            features,
            weights,
            DVector::from_fn(7, |i, _| 1.0 + i as f64),
        )
        .with_unroll(unroll)
    }

    #[test]
    fn gradient_agrees_with_finite_differences_in_every_block() {
        let mut random = Random::new(11);
        let (features, batch) = (features(), batch(&mut random));
        let mut loss = loss(&features);
        let mut parameters = Parameters::random(7, 3, features.library_dim(), 0.0, &mut random);
        for block in parameters.blocks_mut() {
            block
                .iter_mut()
                .for_each(|value| *value += 0.3 * random.signed());
        }
        loss.evaluate(&parameters, &batch);
        let gradient = loss.gradient().clone();
        let weights = loss.weights;
        for block in 0..5 {
            for entry in 0..parameters.blocks()[block].len() {
                let mut at = |step: f64| {
                    let mut moved = parameters.clone();
                    moved.blocks_mut()[block][entry] += step;
                    loss.evaluate(&moved, &batch).total(&weights)
                };
                let difference = (at(1e-5) - at(-1e-5)) / 2e-5;
                let exact = gradient.blocks()[block][entry];
                assert!(
                    (difference - exact).abs() < 1e-6 * exact.abs().max(1.0),
                    "{block} {entry}: {difference} {exact}"
                );
            }
        }
    }

    #[test]
    fn losses_equal_their_definitions() {
        let mut random = Random::new(12);
        let (features, batch) = (features(), batch(&mut random));
        let mut loss = loss(&features);
        loss.coordinate_weights.fill(1.0);
        let parameters = Parameters::random(7, 3, features.library_dim(), 0.2, &mut random);
        let losses = loss.evaluate(&parameters, &batch);
        let Parameters {
            encoder,
            decoder,
            xi,
            ..
        } = &parameters;
        let projection = encoder
            .clone()
            .pseudo_inverse(1e-12)
            .expect("positive")
            .transpose();
        let (z, u_lat) = (&batch.x * encoder, &batch.u * projection);
        let mut variables = DMatrix::zeros(30, 9);
        variables.columns_mut(0, 3).copy_from(&z);
        variables
            .columns_mut(3, 3)
            .copy_from(&(&batch.dx * encoder));
        variables.columns_mut(6, 3).copy_from(&u_lat);
        let predicted = features.evaluate(&variables, &mut FeatureValues::default()) * xi;
        let mean_square = |m: DMatrix<f64>| m.norm_squared() / m.len() as f64;
        let close = |found: f64, expected: f64| {
            assert!(
                (found - expected).abs() < 1e-9 * expected,
                "{found} {expected}"
            )
        };
        close(losses.decoder, mean_square(&batch.x - z * decoder));
        close(losses.ddz, mean_square(&batch.ddx * encoder - &predicted));
        close(losses.ddx, mean_square(&batch.ddx - &predicted * decoder));
        close(losses.l1, 0.2);
        let lifted = u_lat * encoder.transpose();
        close(
            losses.lift,
            (&batch.u - lifted).norm_squared() / batch.u.norm_squared(),
        );
    }
}
