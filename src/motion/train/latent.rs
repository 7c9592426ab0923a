//! Latent samples of a dataset under an encoder, and the decoder that fits them best.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixViewMut, DVector};

use super::dataset::{Dataset, Jump, Quantity, Rates, block_widths, centred, mean, sum_product};
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
    ///
    /// # Errors
    /// As [`Dataset::for_each`].
    pub fn of(dataset: &Dataset, encoder: &StateMap) -> Result<Vec<Latent>, TrainError> {
        let linear = encoder
            .as_affine()
            .map(|affine| (affine, input_projection(affine.weights())));
        let mut all = Vec::with_capacity(dataset.jumps.len());
        dataset.for_each(|jump, rates| {
            all.push(match &linear {
                Some((encoder, projection)) => Self {
                    z: affine(encoder, &jump.x),
                    dz: encoder.weights() * &rates.dx,
                    ddz: encoder.weights() * &rates.ddx,
                    u_lat: projection * &jump.u,
                },
                None => Self::along(jump, rates, encoder),
            });
        })?;
        Ok(all)
    }

    /// Encodes a jump with the Jacobian at every sample.
    fn along(jump: &Jump, rates: &Rates, encoder: &StateMap) -> Self {
        let empty = DMatrix::zeros(encoder.output_dim(), jump.len());
        let mut latent = Self {
            z: empty.clone(),
            dz: empty.clone(),
            ddz: empty.clone(),
            u_lat: empty,
        };
        for sample in 0..jump.len() {
            let column = |matrix: &DMatrix<f64>| matrix.column(sample).into_owned();
            let (x, dx) = (column(&jump.x), column(&rates.dx));
            let mapped = encoder.apply_rates(&x, &dx, &column(&rates.ddx));
            let into = [&mut latent.z, &mut latent.dz, &mut latent.ddz];
            for (matrix, value) in into.into_iter().zip(mapped.expect(FITS)) {
                matrix.set_column(sample, &value);
            }
            let projection = input_projection(&encoder.jacobian(&x).expect(FITS));
            let u_lat = projection * jump.u.column(sample);
            latent.u_lat.set_column(sample, &u_lat);
        }
        latent
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

/// A dataset with its latent samples, one of each jump.
#[derive(Clone, Copy, Debug)]
pub struct EncodedSet<'a> {
    /// The jumps.
    pub dataset: &'a Dataset,
    /// Their latent samples.
    pub latent: &'a [Latent],
}

impl<'a> EncodedSet<'a> {
    /// These latent samples of a dataset.
    pub fn new(dataset: &'a Dataset, latent: &'a [Latent]) -> Self {
        Self { dataset, latent }
    }

    /// Number of latent coordinates, 0 without a jump.
    pub fn latent_dim(self) -> usize {
        self.latent.first().map_or(0, |first| first.z.nrows())
    }

    /// Blocks of the samples of one phase: `[z, dz, u_lat]`, `n x 3 latent_dim`, and `ddz^T`, `n x latent_dim`.
    pub fn regression_blocks(
        self,
        phase: usize,
    ) -> impl Iterator<Item = (DMatrix<f64>, DMatrix<f64>)> {
        let Self { dataset, latent } = self;
        let d = self.latent_dim();
        let spans = dataset.spans(Some(phase));
        let mut spans = spans
            .map(move |(jump, range)| (&latent[jump], range))
            .peekable();
        block_widths(dataset.samples(Some(phase))).map(move |width| {
            let (mut variables, mut target) =
                (DMatrix::zeros(width, 3 * d), DMatrix::zeros(width, d));
            let mut at = 0;
            while at < width {
                let (samples, range) = spans.peek_mut().expect("invariant: as many samples");
                let count = range.len().min(width - at);
                let part = range.start..range.start + count;
                samples.copy_variables(part.clone(), &mut variables.rows_mut(at, count));
                target
                    .rows_mut(at, count)
                    .tr_copy_from(&samples.ddz.columns_range(part));
                (range.start, at) = (range.start + count, at + count);
                if range.start == range.end {
                    spans.next();
                }
            }
            (variables, target)
        })
    }

    /// Jump and sample of a row of [`Self::regression_blocks`], if there are so many.
    pub fn place_of_row(self, phase: usize, row: usize) -> Option<(&'a Jump, usize)> {
        let spans = self.dataset.spans(Some(phase));
        let mut places = spans.flat_map(|(jump, range)| range.map(move |sample| (jump, sample)));
        let (jump, sample) = places.nth(row)?;
        Some((&self.dataset.jumps[jump], sample))
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
        let x = x.column(sample).into_owned();
        let jacobian = encoder.jacobian(&x).expect(FITS);
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
    let mut sum = DMatrix::zeros(rows, columns);
    for x in x.column_iter() {
        sum += encoder.jacobian(&x.into_owned()).expect(FITS);
    }
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
    let d = encoder.output_dim();
    let x_mean = dataset.mean(Quantity::X, None);
    let encoded = || {
        let blocks = dataset.blocks(Quantity::X, None);
        blocks.map(|x| (map_samples(encoder, &x), x))
    };
    let z_mean = mean(d, dataset.samples(None), encoded().map(|(z, _)| z));
    let mut gram = DMatrix::zeros(d, d);
    let mut cross = DMatrix::zeros(x_mean.len(), d);
    for (z, x) in encoded() {
        let (x, z) = (centred(x, &x_mean), centred(z, &z_mean));
        sum_product(&mut gram, &z, &z);
        sum_product(&mut cross, &x, &z);
    }
    Ok(solve_affine((&gram, &cross), x_mean, &z_mean)?)
}

/// The affine map of least square error from samples `z` to samples `x`, both in columns.
///
/// # Errors
/// [`ModelError::NonFinite`] if a weight is not finite.
pub fn fit_affine(x: &DMatrix<f64>, z: &DMatrix<f64>) -> Result<AffineMap, ModelError> {
    let (x_mean, z_mean) = (x.column_mean(), z.column_mean());
    let (x, z) = (centred(x.clone(), &x_mean), centred(z.clone(), &z_mean));
    let (gram, cross) = (&z * z.transpose(), x * z.transpose());
    solve_affine((&gram, &cross), x_mean, &z_mean)
}

/// The affine map from the sums of `z z^T` and `x z^T` about the means.
fn solve_affine(
    (gram, cross): (&DMatrix<f64>, &DMatrix<f64>),
    x_mean: DVector<f64>,
    z_mean: &DVector<f64>,
) -> Result<AffineMap, ModelError> {
    let floor = 1e-12 * gram.trace().max(f64::MIN_POSITIVE);
    let inverse = (gram.clone())
        .pseudo_inverse(floor)
        .expect("the tolerance is positive");
    let weights = cross * inverse;
    let bias = x_mean - &weights * z_mean;
    AffineMap::new("decoder", weights, bias)
}
