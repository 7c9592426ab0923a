//! Latent inputs of a batch, forwards and backwards: `u_lat = pinv(J^T) u = (J J^T)^-1 J u` with the Jacobian `J` of
//! the encoder at every sample. The Gram matrices, as small as the latent space, are factored one by one; directions
//! that are nearly dependent are damped.

use nalgebra::DMatrix;

/// Added to the diagonal of `J J^T`.
const DAMPING: f64 = 1e-12;

#[derive(Clone, Debug)]
pub(super) struct InputProjections {
    /// `n x d`.
    pub u_lat: DMatrix<f64>,
    /// Sum over samples of `(J u) . u_lat`: the energy of the inputs that the latent inputs carry.
    pub carried: f64,
    factors: Vec<f64>, // Cholesky factors, d x d per sample, row-major
}

impl InputProjections {
    /// Projects `u` (`n x 18`) by the Jacobians whose rows are stacked in `rows` (`(d n) x 18`).
    pub(super) fn new(rows: &DMatrix<f64>, u: &DMatrix<f64>) -> Self {
        let n = u.nrows();
        let d = rows.nrows() / n.max(1);
        let mut u_lat = DMatrix::zeros(n, d);
        let mut grams = vec![DMatrix::zeros(n, 1); d * d];
        for (jacobian, input) in rows.column_iter().zip(u.column_iter()) {
            let (jacobian, input) = (jacobian.as_slice(), input.as_slice());
            for (i, row) in jacobian.chunks_exact(n).enumerate() {
                for (sum, (j, u)) in u_lat.column_mut(i).iter_mut().zip(row.iter().zip(input)) {
                    *sum += j * u;
                }
                for (k, other) in jacobian.chunks_exact(n).take(i + 1).enumerate() {
                    let gram = grams[i * d + k].as_mut_slice();
                    for (sum, (a, b)) in gram.iter_mut().zip(row.iter().zip(other)) {
                        *sum += a * b;
                    }
                }
            }
        }
        let (mut factors, mut carried) = (vec![0.0; n * d * d], 0.0);
        let mut right = vec![0.0; d];
        for (s, factor) in factors.chunks_exact_mut(d * d).enumerate() {
            for (entry, gram) in factor.iter_mut().zip(&grams) {
                *entry = gram[s];
            }
            factorise(factor, d);
            (0..d).for_each(|i| right[i] = u_lat[(s, i)]);
            solve(factor, &mut right);
            for (i, value) in right.iter().enumerate() {
                carried += u_lat[(s, i)] * value;
                u_lat[(s, i)] = *value;
            }
        }
        Self {
            u_lat,
            carried,
            factors,
        }
    }

    /// Adjoint of the Jacobians (`(d n) x 18`), given the one of `u_lat` (`n x d`), plus `-lift` times the gradient of
    /// [`Self::carried`].
    ///
    /// With `w = (J J^T)^-1 adjoint`, `v = u_lat` and the rest `r = u - J^T v` it is
    /// `w r^T - v (J^T w)^T - 2 lift v r^T`.
    pub(super) fn adjoint(
        &self,
        rows: &DMatrix<f64>,
        u: &DMatrix<f64>,
        onto_u_lat: &DMatrix<f64>,
        lift: f64,
    ) -> DMatrix<f64> {
        let (n, d) = self.u_lat.shape();
        let mut solved = onto_u_lat.clone();
        let mut right = vec![0.0; d];
        for (s, factor) in self.factors.chunks_exact(d * d).enumerate() {
            (0..d).for_each(|i| right[i] = onto_u_lat[(s, i)]);
            solve(factor, &mut right);
            (0..d).for_each(|i| solved[(s, i)] = right[i]);
        }
        let mut onto = DMatrix::zeros(d * n, u.ncols());
        let (mut rest, mut crossed) = (vec![0.0; n], vec![0.0; n]);
        for ((mut onto, row), input) in onto
            .column_iter_mut()
            .zip(rows.column_iter())
            .zip(u.column_iter())
        {
            rest.copy_from_slice(input.as_slice());
            crossed.fill(0.0);
            for (i, jacobian) in row.as_slice().chunks_exact(n).enumerate() {
                let (v, w) = (self.u_lat.column(i), solved.column(i));
                for s in 0..n {
                    rest[s] -= jacobian[s] * v[s];
                    crossed[s] += jacobian[s] * w[s];
                }
            }
            for (i, onto) in onto.as_mut_slice().chunks_exact_mut(n).enumerate() {
                let (v, w) = (self.u_lat.column(i), solved.column(i));
                for s in 0..n {
                    onto[s] = (w[s] - 2.0 * lift * v[s]) * rest[s] - v[s] * crossed[s];
                }
            }
        }
        onto
    }
}

/// Cholesky factor in place of a Gram matrix whose lower triangle is given, row-major; damped.
fn factorise(matrix: &mut [f64], d: usize) {
    for i in 0..d {
        matrix[i * d + i] += DAMPING;
        for k in 0..=i {
            let known: f64 = (0..k).map(|m| matrix[i * d + m] * matrix[k * d + m]).sum();
            let left = matrix[i * d + k] - known;
            matrix[i * d + k] = if i == k {
                left.max(DAMPING).sqrt()
            } else {
                left / matrix[k * d + k]
            };
        }
    }
}

/// Solves `L L^T x = right` in place.
fn solve(factor: &[f64], right: &mut [f64]) {
    let d = right.len();
    for i in 0..d {
        let known: f64 = (0..i).map(|k| factor[i * d + k] * right[k]).sum();
        right[i] = (right[i] - known) / factor[i * d + i];
    }
    for i in (0..d).rev() {
        let known: f64 = (i + 1..d).map(|k| factor[k * d + i] * right[k]).sum();
        right[i] = (right[i] - known) / factor[i * d + i];
    }
}
