//! Latent samples of a dataset under an encoder, and the decoder that fits them best.

use nalgebra::DMatrixViewMut;

use super::*;

const FITS: &str = "invariant: a trained or checked map accepts the robot's coordinates";

/// Latent samples of one jump; columns are samples, scaled units.
#[derive(Clone, Debug)]
pub(super) struct Latent {
    pub z: DMatrix<f64>,     // W_e x + b_e, of a nonlinear encoder E(x)
    pub dz: DMatrix<f64>,    // W_e dx, or J dx with the Jacobian at the sample
    pub ddz: DMatrix<f64>,   // W_e ddx, or J ddx + dJ/dt dx
    pub u_lat: DMatrix<f64>, // pinv(W_e^T) u, or pinv(J^T) u
}

impl Latent {
    pub(super) fn of(dataset: &Dataset, encoder: &StateMap) -> Vec<Latent> {
        let linear = encoder.as_affine().map(AffineMap::weights);
        let linear = linear.map(|weights| (weights, input_projection(weights)));
        let encoded = dataset.jumps.iter().map(|jump| match &linear {
            Some((weights, projection)) => Self {
                z: map_samples(encoder, &jump.x),
                dz: *weights * &jump.dx,
                ddz: *weights * &jump.ddx,
                u_lat: projection * &jump.u,
            },
            None => Self::along(jump, encoder),
        });
        encoded.collect()
    }

    fn along(jump: &Jump, encoder: &StateMap) -> Self {
        let empty = DMatrix::zeros(encoder.output_dim(), jump.samples());
        let mut latent = Self {
            z: empty.clone(),
            dz: empty.clone(),
            ddz: empty.clone(),
            u_lat: empty,
        };
        for sample in 0..jump.samples() {
            let column = |matrix: &DMatrix<f64>| matrix.column(sample).into_owned();
            let (x, dx) = (column(&jump.x), column(&jump.dx));
            let mapped = encoder.apply_rates(&x, &dx, &column(&jump.ddx));
            let [z, dz, ddz] = mapped.expect(FITS);
            latent.z.set_column(sample, &z);
            latent.dz.set_column(sample, &dz);
            latent.ddz.set_column(sample, &ddz);
            let projection = input_projection(&encoder.jacobian(&x).expect(FITS));
            (latent.u_lat).set_column(sample, &(projection * jump.u.column(sample)));
        }
        latent
    }

    /// `[z, dz, u_lat]` of some samples in rows.
    pub(super) fn variables(&self, range: Range<usize>) -> DMatrix<f64> {
        let n = range.len();
        let mut variables = DMatrix::zeros(n, 3 * self.z.nrows());
        self.copy_variables(range, &mut variables.rows_mut(0, n));
        variables
    }

    fn copy_variables(&self, range: Range<usize>, variables: &mut DMatrixViewMut<'_, f64>) {
        let d = self.z.nrows();
        for (block, source) in [&self.z, &self.dz, &self.u_lat].into_iter().enumerate() {
            variables
                .columns_mut(block * d, d)
                .tr_copy_from(&source.columns_range(range.clone()));
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct EncodedSet<'a> {
    pub dataset: &'a Dataset,
    pub latent: &'a [Latent],
}

impl<'a> EncodedSet<'a> {
    pub(super) fn new(dataset: &'a Dataset, latent: &'a [Latent]) -> Self {
        Self { dataset, latent }
    }

    pub(super) fn latent_dim(self) -> usize {
        self.latent.first().map_or(0, |first| first.z.nrows())
    }

    /// The samples of one phase: `[z, dz, u_lat]`, `n x 3 latent_dim`, and `ddz^T`, `n x latent_dim`.
    pub(super) fn regression_samples(self, phase: usize) -> (DMatrix<f64>, DMatrix<f64>) {
        let (n, d) = (self.dataset.samples(Some(phase)), self.latent_dim());
        let (mut variables, mut target) = (DMatrix::zeros(n, 3 * d), DMatrix::zeros(n, d));
        let mut at = 0;
        for (jump, range) in self.dataset.spans(Some(phase)) {
            let (samples, count) = (&self.latent[jump], range.len());
            samples.copy_variables(range.clone(), &mut variables.rows_mut(at, count));
            let mut rows = target.rows_mut(at, count);
            rows.tr_copy_from(&samples.ddz.columns_range(range));
            at += count;
        }
        (variables, target)
    }
}

/// `pinv(W_e^T) = (W_e W_e^T)^-1 W_e` of an encoder of full row rank, `latent_dim x input_dim`.
pub(super) fn input_projection(weights: &DMatrix<f64>) -> DMatrix<f64> {
    let gram = weights * weights.transpose();
    match gram.cholesky() {
        Some(factor) => factor.solve(weights),
        None => (weights.transpose().pseudo_inverse(1e-12)).expect("the tolerance is positive"),
    }
}

pub(super) fn map_samples(map: &StateMap, samples: &DMatrix<f64>) -> DMatrix<f64> {
    if let Some(linear) = map.as_affine() {
        let mut mapped = linear.weights() * samples;
        let columns = mapped.column_iter_mut();
        columns.for_each(|mut column| column += linear.bias());
        return mapped;
    }
    let mut mapped = DMatrix::zeros(map.output_dim(), samples.ncols());
    for (mut column, sample) in mapped.column_iter_mut().zip(samples.column_iter()) {
        column.copy_from(&map.apply(&sample.into_owned()).expect(FITS));
    }
    mapped
}

/// Latent inputs of samples in columns lifted back: `J^T u_lat` with the encoder's Jacobian at the states `x`.
pub(super) fn lift_samples(
    encoder: &StateMap,
    x: &DMatrix<f64>,
    u_lat: &DMatrix<f64>,
) -> DMatrix<f64> {
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

pub(super) fn mean_jacobian(encoder: &StateMap, dataset: &Dataset) -> DMatrix<f64> {
    if let Some(linear) = encoder.as_affine() {
        return linear.weights().clone();
    }
    let (rows, columns) = (encoder.output_dim(), encoder.input_dim());
    let mut sum = DMatrix::zeros(rows, columns);
    let states = dataset.states(None);
    for x in states.column_iter() {
        sum += encoder.jacobian(&x.into_owned()).expect(FITS);
    }
    sum / states.ncols().max(1) as f64
}

/// Decoder `x ~ W_d z + b_d` of least mean square error, with `z` the encoded samples after the `hidden` layers.
pub(super) fn least_squares_decoder(
    dataset: &Dataset,
    encoder: &StateMap,
    hidden: Option<&StateMap>,
) -> Result<AffineMap> {
    let x = dataset.states(None);
    let z = map_samples(encoder, &x);
    let z = hidden.map_or_else(|| z.clone(), |hidden| map_samples(hidden, &z));
    let (x_mean, z_mean) = (mean(&x), mean(&z));
    let (x, z) = (centred(&x, &x_mean), centred(&z, &z_mean));
    let (gram, cross) = (&z * z.transpose(), &x * z.transpose());
    let floor = 1e-12 * gram.trace().max(f64::MIN_POSITIVE);
    let weights = cross
        * gram
            .pseudo_inverse(floor)
            .expect("the tolerance is positive");
    let bias = x_mean - &weights * z_mean;
    Ok(AffineMap::new("decoder", weights, bias)?)
}
