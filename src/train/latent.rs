//! Latent samples of a dataset under an encoder, and the decoder that fits them best.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixViewMut, DVector};

use super::dataset::{Dataset, Jump, Quantity};
use super::error::TrainError;
use crate::model::{AffineMap, ModelError};

/// Latent samples of one jump; columns are samples, scaled units.
#[derive(Clone, Debug)]
pub struct Latent {
    /// `z = W_e x + b_e`.
    pub z: DMatrix<f64>,
    /// `dz = W_e dx`.
    pub dz: DMatrix<f64>,
    /// `ddz = W_e ddx`.
    pub ddz: DMatrix<f64>,
    /// `u_lat = pinv(W_e^T) u`.
    pub u_lat: DMatrix<f64>,
}

impl Latent {
    /// Encodes every jump.
    pub fn of(dataset: &Dataset, encoder: &AffineMap) -> Vec<Latent> {
        let projection = input_projection(encoder.weights());
        dataset
            .jumps
            .iter()
            .map(|jump| Self::of_jump(jump, encoder, &projection))
            .collect()
    }

    fn of_jump(jump: &Jump, encoder: &AffineMap, projection: &DMatrix<f64>) -> Self {
        Self {
            z: affine(encoder, &jump.x),
            dz: encoder.weights() * &jump.dx,
            ddz: encoder.weights() * &jump.ddx,
            u_lat: projection * &jump.u,
        }
    }

    /// `[z, dz, u_lat]` of the samples of one phase, `n x 3 latent_dim`, and `ddz^T`, `n x latent_dim`.
    pub fn regression_samples(
        dataset: &Dataset,
        latent: &[Latent],
        phase: usize,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let d = latent.first().map_or(0, |first| first.z.nrows());
        let n = dataset.samples(Some(phase));
        let (mut variables, mut target) = (DMatrix::zeros(n, 3 * d), DMatrix::zeros(n, d));
        let mut at = 0;
        for (jump, samples) in dataset.jumps.iter().zip(latent) {
            for (_, range) in jump.spans.iter().filter(|(index, _)| *index == phase) {
                let count = range.len();
                samples.copy_variables(range.clone(), &mut variables.rows_mut(at, count));
                target
                    .rows_mut(at, count)
                    .tr_copy_from(&samples.ddz.columns_range(range.clone()));
                at += count;
            }
        }
        (variables, target)
    }

    /// Writes `[z, dz, u_lat]` of some samples into the rows of `variables`.
    pub fn copy_variables(&self, range: Range<usize>, variables: &mut DMatrixViewMut<'_, f64>) {
        let d = self.z.nrows();
        for (block, source) in [&self.z, &self.dz, &self.u_lat].into_iter().enumerate() {
            variables
                .columns_mut(block * d, d)
                .tr_copy_from(&source.columns_range(range.clone()));
        }
    }
}

/// `pinv(W_e^T) = (W_e W_e^T)^-1 W_e` of an encoder of full row rank, `latent_dim x input_dim`.
pub fn input_projection(weights: &DMatrix<f64>) -> DMatrix<f64> {
    let gram = weights * weights.transpose();
    match gram.cholesky() {
        Some(factor) => factor.solve(weights),
        None => weights
            .transpose()
            .pseudo_inverse(1e-12)
            .expect("the tolerance is positive"),
    }
}

/// `W x + b` for samples in columns.
pub fn affine(map: &AffineMap, samples: &DMatrix<f64>) -> DMatrix<f64> {
    let mut mapped = map.weights() * samples;
    for mut column in mapped.column_iter_mut() {
        column += map.bias();
    }
    mapped
}

/// Decoder of least mean square error over all phases: `x ~ W_d z + b_d`.
///
/// # Errors
/// [`TrainError::Model`] if a weight is not finite.
pub fn least_squares_decoder(
    dataset: &Dataset,
    encoder: &AffineMap,
) -> Result<AffineMap, TrainError> {
    let x = dataset.gather(Quantity::X, None);
    let z = affine(encoder, &x);
    let (x_mean, z_mean) = (x.column_mean(), z.column_mean());
    let (x_centred, z_centred) = (centred(&x, &x_mean), centred(&z, &z_mean));
    let gram = &z_centred * z_centred.transpose();
    let floor = 1e-12 * gram.trace().max(f64::MIN_POSITIVE);
    let inverse = gram
        .pseudo_inverse(floor)
        .expect("the tolerance is positive");
    let weights = x_centred * z_centred.transpose() * inverse;
    let bias = x_mean - &weights * z_mean;
    Ok(decoder_from(weights, bias)?)
}

fn decoder_from(weights: DMatrix<f64>, bias: DVector<f64>) -> Result<AffineMap, ModelError> {
    AffineMap::new("decoder", weights, bias)
}

fn centred(samples: &DMatrix<f64>, mean: &DVector<f64>) -> DMatrix<f64> {
    let mut shifted = samples.clone();
    for mut column in shifted.column_iter_mut() {
        column -= mean;
    }
    shifted
}
