//! Latent inputs of a batch, forwards and backwards: `u_lat = pinv(J^T) u = (J J^T)^-1 J u` with the Jacobian `J` of
//! the encoder at every sample; directions that are nearly dependent are damped.

use std::borrow::Cow;
use std::ops::Range;

use nalgebra::DMatrix;

use super::network::{add_transposed, product};

/// Added to the diagonal of `J J^T`; of the trace where that is not enough.
const DAMPING: f64 = 1e-12;
const SHARE_OF_TRACE: f64 = 1e-9;

#[derive(Clone, Debug)]
pub(super) struct InputProjections {
    /// `n x d`.
    pub u_lat: DMatrix<f64>,
    /// Sum over samples of `(J u) . u_lat`: the energy of the inputs that the latent inputs carry.
    pub carried: f64,
    inverses: Vec<DMatrix<f64>>, // of J J^T for each Jacobian, d x d
}

impl InputProjections {
    /// Projects `u` (`n x 18`) by the Jacobians whose rows are stacked in `rows`: one for each sample, `(d n) x 18`, or one
    /// for all.
    pub(super) fn new(rows: &DMatrix<f64>, u: &DMatrix<f64>, d: usize) -> Self {
        let (mut u_lat, mut carried) = (DMatrix::zeros(u.nrows(), d), 0.0);
        let count = rows.nrows() / d;
        let inverses = (0..count).map(|index| {
            let (jacobian, samples) = (jacobian(rows, index, d), samples(u.nrows(), count, index));
            let inverse = inverse(&jacobian * jacobian.transpose());
            let onto = product(&part(u, &samples), &jacobian.transpose());
            let latent = product(&onto, &inverse);
            carried += onto.dot(&latent);
            u_lat.rows_range_mut(samples).copy_from(&latent);
            inverse
        });
        let inverses = inverses.collect();
        Self {
            u_lat,
            carried,
            inverses,
        }
    }

    /// Adjoint of the Jacobians, stacked as `rows`, given the one of `u_lat` (`n x d`), plus `-lift` times the gradient of
    /// [`Self::carried`].
    ///
    /// With `w = (J J^T)^-1 adjoint`, `v = u_lat` and the rest `r = u - J^T v` it is the sum over the samples of a
    /// Jacobian of `w r^T - v (J^T w)^T - 2 lift v r^T`.
    pub(super) fn adjoint(
        &self,
        rows: &DMatrix<f64>,
        u: &DMatrix<f64>,
        onto_u_lat: &DMatrix<f64>,
        lift: f64,
    ) -> DMatrix<f64> {
        let (n, d) = self.u_lat.shape();
        let count = self.inverses.len();
        let mut onto = DMatrix::zeros(rows.nrows(), rows.ncols());
        for (index, inverse) in self.inverses.iter().enumerate() {
            let (jacobian, samples) = (jacobian(rows, index, d), samples(n, count, index));
            let v = part(&self.u_lat, &samples);
            let w = product(&part(onto_u_lat, &samples), inverse);
            let rest = part(u, &samples).as_ref() - product(&v, &jacobian);
            let mut own = DMatrix::zeros(d, rows.ncols());
            add_transposed(&mut own, &(&w - v.as_ref() * (2.0 * lift)), &rest);
            add_transposed(&mut own, &-v.as_ref(), &product(&w, &jacobian));
            onto.rows_with_step_mut(index, d, count - 1).copy_from(&own);
        }
        onto
    }
}

/// The Jacobian of one sample, `d x 18`.
fn jacobian(rows: &DMatrix<f64>, index: usize, d: usize) -> DMatrix<f64> {
    let count = rows.nrows() / d;
    rows.rows_with_step(index, d, count - 1).into_owned()
}

/// Samples that a Jacobian belongs to: its own, or all `n` if it is the only one.
fn samples(n: usize, count: usize, index: usize) -> Range<usize> {
    match count {
        1 => 0..n,
        _ => index..index + 1,
    }
}

/// Rows of a matrix, which are copied unless they are all.
fn part<'m>(matrix: &'m DMatrix<f64>, samples: &Range<usize>) -> Cow<'m, DMatrix<f64>> {
    match samples.len() == matrix.nrows() {
        true => Cow::Borrowed(matrix),
        false => Cow::Owned(matrix.rows_range(samples.clone()).into_owned()),
    }
}

/// Inverse of a damped Gram matrix; not a number where there is none.
fn inverse(gram: DMatrix<f64>) -> DMatrix<f64> {
    let d = gram.nrows();
    let damped = |damping: f64| (&gram + DMatrix::<f64>::identity(d, d) * damping).cholesky();
    let factor = damped(DAMPING).or_else(|| damped(SHARE_OF_TRACE * gram.trace()));
    factor.map_or_else(|| gram.map(|_| f64::NAN), |factor| factor.inverse())
}
