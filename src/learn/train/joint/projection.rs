//! Latent inputs of a batch, forwards and backwards: `u_lat = pinv(J^T) u = (J J^T)^-1 J u` with the Jacobian `J` of
//! the encoder at every sample; directions that are nearly dependent are damped.

use nalgebra::DMatrix;

/// Added to the diagonal of `J J^T`; of the trace where that is not enough.
const DAMPING: f64 = 1e-12;
const SHARE_OF_TRACE: f64 = 1e-9;

#[derive(Clone, Debug)]
pub(super) struct InputProjections {
    /// `n x d`.
    pub u_lat: DMatrix<f64>,
    /// Sum over samples of `(J u) . u_lat`: the energy of the inputs that the latent inputs carry.
    pub carried: f64,
    inverses: Vec<DMatrix<f64>>, // of J J^T at each sample, d x d
}

impl InputProjections {
    /// Projects `u` (`n x 18`) by the Jacobians whose rows are stacked in `rows` (`(d n) x 18`).
    pub(super) fn new(rows: &DMatrix<f64>, u: &DMatrix<f64>) -> Self {
        let n = u.nrows();
        let d = rows.nrows() / n.max(1);
        let (mut u_lat, mut carried) = (DMatrix::zeros(n, d), 0.0);
        let inverses = (0..n).map(|sample| {
            let jacobian = rows.rows_with_step(sample, d, n - 1).into_owned();
            let inverse = inverse(&jacobian * jacobian.transpose());
            let onto = &jacobian * u.row(sample).transpose();
            let latent = &inverse * &onto;
            carried += onto.dot(&latent);
            u_lat.row_mut(sample).tr_copy_from(&latent);
            inverse
        });
        let inverses = inverses.collect();
        Self {
            u_lat,
            carried,
            inverses,
        }
    }

    /// Adjoint of the Jacobians (`(d n) x 18`), given the one of `u_lat` (`n x d`), plus `-lift` times the gradient of
    /// [`Self::carried`].
    ///
    /// With `w = (J J^T)^-1 adjoint`, `v = u_lat` and the rest `r = u - J^T v` it is `w r^T - v (J^T w)^T - 2 lift v
    /// r^T`.
    pub(super) fn adjoint(
        &self,
        rows: &DMatrix<f64>,
        u: &DMatrix<f64>,
        onto_u_lat: &DMatrix<f64>,
        lift: f64,
    ) -> DMatrix<f64> {
        let (n, d) = self.u_lat.shape();
        let mut onto = DMatrix::zeros(d * n, u.ncols());
        for (sample, inverse) in self.inverses.iter().enumerate() {
            let jacobian = rows.rows_with_step(sample, d, n - 1).into_owned();
            let v = self.u_lat.row(sample).transpose();
            let w = inverse * onto_u_lat.row(sample).transpose();
            let rest = u.row(sample) - v.transpose() * &jacobian;
            let own = (&w - &v * (2.0 * lift)) * rest - &v * (w.transpose() * &jacobian);
            onto.rows_with_step_mut(sample, d, n - 1).copy_from(&own);
        }
        onto
    }
}

/// Inverse of a damped Gram matrix; not a number where there is none.
fn inverse(gram: DMatrix<f64>) -> DMatrix<f64> {
    let d = gram.nrows();
    let damped = |damping: f64| (&gram + DMatrix::<f64>::identity(d, d) * damping).cholesky();
    let factor = damped(DAMPING).or_else(|| damped(SHARE_OF_TRACE * gram.trace()));
    factor.map_or_else(|| gram.map(|_| f64::NAN), |factor| factor.inverse())
}
