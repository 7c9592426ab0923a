//! Small dense systems with one order of operations, that of the controller in C: both have the same bits.
// Loops over indices have the order of operations of the C that repeats them.
#![allow(clippy::needless_range_loop)]

/// Lower Cholesky factor of a row-major symmetric matrix in place of its lower triangle; false if it
/// is not positive definite.
pub(super) fn factorise(matrix: &mut [f64], dim: usize) -> bool {
    for i in 0..dim {
        for j in 0..=i {
            let mut entry = matrix[i * dim + j];
            for k in 0..j {
                entry -= matrix[i * dim + k] * matrix[j * dim + k];
            }
            if i == j {
                if !(entry > 0.0 && entry.is_finite()) {
                    return false;
                }
                matrix[i * dim + i] = entry.sqrt();
            } else {
                matrix[i * dim + j] = entry / matrix[j * dim + j];
            }
        }
    }
    true
}

/// `L⁻¹ b` in place of `b`.
pub(super) fn solve_lower(factor: &[f64], dim: usize, b: &mut [f64]) {
    for i in 0..dim {
        for k in 0..i {
            b[i] -= factor[i * dim + k] * b[k];
        }
        b[i] /= factor[i * dim + i];
    }
}

/// `L⁻ᵀ b` in place of `b`.
pub(super) fn solve_upper(factor: &[f64], dim: usize, b: &mut [f64]) {
    for i in (0..dim).rev() {
        for k in i + 1..dim {
            b[i] -= factor[k * dim + i] * b[k];
        }
        b[i] /= factor[i * dim + i];
    }
}
