//! Pseudo-inverses of encoders, `u_lat = pinv(W_e^T) u`, and projectors.

use nalgebra::DMatrix;

use super::error::{ModelError, check_finite};

/// An encoder has full row rank if its smallest singular value is above this share of the largest.
pub(crate) const RANK_TOLERANCE: f64 = 1e-10;

/// `pinv(W_e^T)`, `latent_dim x state_dim`, from the singular values of `W_e = U S V^T`:
/// `pinv(W_e^T) = U S^-1 V^T`.
///
/// # Errors
/// [`ModelError::Invalid`] with the name of the matrix, if its rows are (nearly) linearly dependent, so that latent
/// inputs have no unique lift.
pub(super) fn pinv_of_transpose(
    weights: &DMatrix<f64>,
    matrix: &str,
) -> Result<DMatrix<f64>, ModelError> {
    let dim = weights.nrows();
    let deficient = |smallest: f64, largest: f64| {
        let found = format!("singular values from {smallest:e} to {largest:e}");
        let expected =
            format!("full row rank {dim} (smallest above {RANK_TOLERANCE:e} times the largest)");
        ModelError::invalid(matrix, found, expected)
    };
    let largest_entry = weights.amax();
    if largest_entry == 0.0 {
        return Err(deficient(0.0, 0.0));
    }
    // Divided by the largest entry first, so that no intermediate product overflows.
    let normalised = weights / largest_entry;
    let max_iterations = 1_000 * weights.ncols();
    let svd = nalgebra::SVD::try_new(normalised, true, true, f64::EPSILON, max_iterations)
        .filter(|svd| svd.singular_values.iter().all(|value| value.is_finite()))
        .ok_or_else(|| ModelError::no_decomposition("encoder.weights"))?;
    let smallest = svd.singular_values.min();
    let largest = svd.singular_values.max();
    if smallest <= RANK_TOLERANCE * largest {
        return Err(deficient(smallest * largest_entry, largest * largest_entry));
    }
    let u = svd.u.expect("asked for the left singular vectors");
    let v_t = svd.v_t.expect("asked for the right singular vectors");
    let inverse = svd.singular_values.map(|value| 1.0 / value);
    let projection = u * DMatrix::from_diagonal(&inverse) * v_t / largest_entry;
    let projection = refined(projection, weights);
    check_finite("pinv(encoder.weights^T)", &projection)?;
    Ok(projection)
}

/// Removes what the iteration of the singular values left over, which can be 1e-10 even for well
/// conditioned matrices: a Newton step on `P W_e^T = I` squares the residual.
fn refined(projection: DMatrix<f64>, weights: &DMatrix<f64>) -> DMatrix<f64> {
    const NEGLIGIBLE: f64 = 1e-13;
    let dim = projection.nrows();
    let residual = DMatrix::identity(dim, dim) - &projection * weights.transpose();
    if residual.amax() <= NEGLIGIBLE {
        return projection;
    }
    let step = &residual * &projection;
    projection + step
}

/// The projector on what is orthogonal to the columns: `I` without columns that are zero.
pub fn complement(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let d = columns.nrows();
    let mut projector = DMatrix::identity(d, d);
    for column in columns.column_iter() {
        let direction = &projector * column;
        let square = direction.norm_squared();
        if square > f64::EPSILON * column.norm_squared() {
            projector -= &direction * direction.transpose() / square;
        }
    }
    projector
}
