//! Latent samples of a dataset under an encoder, and the decoder that fits them best.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixViewMut, DVector};

use super::dataset::{Dataset, Jump, Quantity};
use super::error::TrainError;
use crate::model::{AffineMap, ModelError, StateMap};

const FITS: &str = "invariant: a trained or checked map takes the robot's coordinates";

/// Latent samples of one jump; columns are samples, scaled units.
#[derive(Clone, Debug)]
pub struct Latent {
    /// `z = W_e x + b_e`, of a nonlinear encoder `E(x)`.
    pub z: DMatrix<f64>,
    /// `dz = W_e dx`, or `J dx` with the Jacobian at the sample.
    pub dz: DMatrix<f64>,
    /// `ddz = W_e ddx`, or `J ddx + dJ/dt dx`.
    pub ddz: DMatrix<f64>,
    /// `u_lat = pinv(W_e^T) u`, or `pinv(J^T) u`.
    pub u_lat: DMatrix<f64>,
}

impl Latent {
    /// Encodes every jump.
    pub fn of(dataset: &Dataset, encoder: &StateMap) -> Vec<Latent> {
        let Some(affine) = encoder.as_affine() else {
            let jumps = dataset.jumps.iter();
            return jumps.map(|jump| Self::along(jump, encoder)).collect();
        };
        let projection = input_projection(affine.weights());
        dataset
            .jumps
            .iter()
            .map(|jump| Self::of_jump(jump, affine, &projection))
            .collect()
    }

    /// Encodes a jump with the Jacobian at every sample.
    fn along(jump: &Jump, encoder: &StateMap) -> Self {
        let empty = DMatrix::zeros(encoder.output_dim(), jump.len());
        let mut latent = Self {
            z: empty.clone(),
            dz: empty.clone(),
            ddz: empty.clone(),
            u_lat: empty,
        };
        for sample in 0..jump.len() {
            let column = |matrix: &DMatrix<f64>| matrix.column(sample).into_owned();
            let (x, dx) = (column(&jump.x), column(&jump.dx));
            let derivatives = [
                encoder.apply(&x),
                encoder.apply_velocity(&x, &dx),
                encoder.apply_acceleration(&x, &dx, &column(&jump.ddx)),
            ];
            let into = [&mut latent.z, &mut latent.dz, &mut latent.ddz];
            for (matrix, value) in into.into_iter().zip(derivatives) {
                matrix.set_column(sample, &value.expect(FITS));
            }
            let projection = input_projection(&encoder.jacobian(&x).expect(FITS));
            let u_lat = projection * jump.u.column(sample);
            latent.u_lat.set_column(sample, &u_lat);
        }
        latent
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

    /// Jump and sample of a row of [`Self::regression_samples`], if there are so many.
    pub fn place_of_row(dataset: &Dataset, phase: usize, row: usize) -> Option<(&Jump, usize)> {
        let spans = dataset
            .jumps
            .iter()
            .flat_map(|jump| jump.spans.iter().map(move |span| (jump, span)));
        spans
            .filter(|(_, (index, _))| *index == phase)
            .flat_map(|(jump, (_, range))| range.clone().map(move |sample| (jump, sample)))
            .nth(row)
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

/// A map, linear or not, of samples in columns.
pub fn map_samples(map: &StateMap, samples: &DMatrix<f64>) -> DMatrix<f64> {
    if let Some(linear) = map.as_affine() {
        return affine(linear, samples);
    }
    let mut mapped = DMatrix::zeros(map.output_dim(), samples.ncols());
    for (mut column, sample) in mapped.column_iter_mut().zip(samples.column_iter()) {
        column.copy_from(&map.apply(&sample.into_owned()).expect(FITS));
    }
    mapped
}

/// Latent inputs of samples in columns lifted back: `J^T u_lat` with the encoder's Jacobian at the states `x`.
pub fn lift_samples(encoder: &StateMap, x: &DMatrix<f64>, u_lat: &DMatrix<f64>) -> DMatrix<f64> {
    if let Some(linear) = encoder.as_affine() {
        return linear.weights().tr_mul(u_lat);
    }
    let mut lifted = DMatrix::zeros(x.nrows(), x.ncols());
    for (sample, mut column) in lifted.column_iter_mut().enumerate() {
        let jacobian = encoder
            .jacobian(&x.column(sample).into_owned())
            .expect(FITS);
        column.copy_from(&jacobian.tr_mul(&u_lat.column(sample)));
    }
    lifted
}

/// `W_e`, of a nonlinear encoder the mean of its Jacobian over the samples in the columns of `x`.
pub fn mean_jacobian(encoder: &StateMap, x: &DMatrix<f64>) -> DMatrix<f64> {
    if let Some(linear) = encoder.as_affine() {
        return linear.weights().clone();
    }
    let (rows, columns) = encoder.shape();
    let sum = x
        .column_iter()
        .fold(DMatrix::zeros(rows, columns), |sum, x| {
            sum + encoder.jacobian(&x.into_owned()).expect(FITS)
        });
    sum / x.ncols().max(1) as f64
}

/// Decoder of least mean square error over all phases: `x ~ W_d z + b_d`.
///
/// # Errors
/// [`TrainError::Model`] if a weight is not finite.
pub fn least_squares_decoder(
    dataset: &Dataset,
    encoder: &StateMap,
) -> Result<AffineMap, TrainError> {
    let x = dataset.gather(Quantity::X, None);
    Ok(fit_affine(&x, &map_samples(encoder, &x))?)
}

/// The affine map of least square error from samples `z` to samples `x`, both in columns.
///
/// # Errors
/// [`ModelError::NonFinite`] if a weight is not finite.
pub fn fit_affine(x: &DMatrix<f64>, z: &DMatrix<f64>) -> Result<AffineMap, ModelError> {
    let (x_mean, z_mean) = (x.column_mean(), z.column_mean());
    let (x_centred, z_centred) = (centred(x, &x_mean), centred(z, &z_mean));
    let gram = &z_centred * z_centred.transpose();
    let floor = 1e-12 * gram.trace().max(f64::MIN_POSITIVE);
    let inverse = gram
        .pseudo_inverse(floor)
        .expect("the tolerance is positive");
    let weights = x_centred * z_centred.transpose() * inverse;
    let bias = x_mean - &weights * z_mean;
    AffineMap::new("decoder", weights, bias)
}

fn centred(samples: &DMatrix<f64>, mean: &DVector<f64>) -> DMatrix<f64> {
    let mut shifted = samples.clone();
    for mut column in shifted.column_iter_mut() {
        column -= mean;
    }
    shifted
}
