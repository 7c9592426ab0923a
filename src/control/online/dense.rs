//! Small dense systems. C is made of this file.

/// Numbers of the precision that generated C has; times are `f64` in both.
pub(super) type Real = f64;

/// Most latent coordinates: an encoder of full rank has no more than the robot.
pub(super) const MOST_LATENT: usize = 18;
/// The same of their states, and of square matrices.
pub(super) const MOST_STATE: usize = 2 * MOST_LATENT;
pub(super) const MOST_SQUARE: usize = MOST_LATENT * MOST_LATENT;

/// Lower Cholesky factor of a row-major symmetric matrix in place of its lower triangle; false if it is not positive
/// definite.
pub(super) fn factorise(matrix: &mut [Real], dim: usize) -> bool {
    for i in 0..dim {
        for j in 0..=i {
            let mut entry: Real = matrix[i * dim + j];
            for k in 0..j {
                entry -= matrix[i * dim + k] * matrix[j * dim + k];
            }
            if i != j {
                matrix[i * dim + j] = entry / matrix[j * dim + j];
            } else if entry > 0.0 && entry.is_finite() {
                matrix[i * dim + i] = entry.sqrt();
            } else {
                return false;
            }
        }
    }
    true
}

/// `L⁻¹ b` in place of `b`.
pub(super) fn solve_lower(factor: &[Real], dim: usize, b: &mut [Real]) {
    for i in 0..dim {
        for k in 0..i {
            b[i] -= factor[i * dim + k] * b[k];
        }
        b[i] /= factor[i * dim + i];
    }
}

/// `L⁻ᵀ b` in place of `b`.
pub(super) fn solve_upper(factor: &[Real], dim: usize, b: &mut [Real]) {
    for i in (0..dim).rev() {
        for k in i + 1..dim {
            b[i] -= factor[k * dim + i] * b[k];
        }
        b[i] /= factor[i * dim + i];
    }
}

/// The first of these numbers that is infinite or undefined; `count` without one.
pub(super) fn first_undefined(values: &[Real], count: usize) -> usize {
    for i in 0..count {
        if !values[i].is_finite() {
            return i;
        }
    }
    count
}

/// The larger of two numbers; the second if the first is not one.
pub(super) fn greater(value: Real, other: Real) -> Real {
    if value > other { value } else { other }
}

/// The smaller of two numbers; the second if the first is not one.
pub(super) fn smaller(value: Real, other: Real) -> Real {
    if value < other { value } else { other }
}

/// `sum += factor values`.
pub(super) fn add_scaled(factor: Real, values: &[Real], dim: usize, sum: &mut [Real]) {
    let values = &values[..dim];
    let sum = &mut sum[..dim];
    for i in 0..dim {
        sum[i] += factor * values[i];
    }
}
