//! Rotation of the latent basis: the same space, described by as few coordinates a latent as possible.

use nalgebra::DMatrix;

/// Orthogonal `latent_dim x latent_dim` matrix `T` for which `loadings * T` is simplest in the varimax sense.
///
/// `loadings` is `state_dim x latent_dim` (here `diag(std) Q`); the sum over columns of the variance of the squared
/// entries is increased by planar rotations until none moves a pair by more than `1e-12` rad
/// (Kaiser 1958, The varimax criterion for analytic rotation in factor analysis, without row normalisation).
pub(super) fn varimax(loadings: &DMatrix<f64>) -> DMatrix<f64> {
    let n_columns = loadings.ncols();
    let n_rows = loadings.nrows() as f64;
    let mut rotated = loadings.clone();
    let mut rotation = DMatrix::identity(n_columns, n_columns);
    for _ in 0..200 {
        let mut largest: f64 = 0.0;
        for a in 0..n_columns {
            for b in a + 1..n_columns {
                let angle = best_angle(&rotated, a, b, n_rows);
                if angle.abs() > 1e-12 {
                    turn(&mut rotated, a, b, angle);
                    turn(&mut rotation, a, b, angle);
                    largest = largest.max(angle.abs());
                }
            }
        }
        if largest <= 1e-12 {
            break;
        }
    }
    rotation
}

/// Columns reordered by decreasing weight on the coordinates in `order_by`, each with a positive dominant entry.
///
/// The first coordinate of `order_by` takes the column that weighs it most, then the next one, so that a reader
/// meets body x as z1 and body z as z2 whenever the space holds them.
pub(super) fn order_and_sign(
    loadings: &DMatrix<f64>,
    order_by: &[usize],
) -> (Vec<usize>, Vec<f64>) {
    let weight = |column: usize| loadings.column(column).norm_squared();
    let mut left: Vec<usize> = (0..loadings.ncols()).collect();
    let mut order = Vec::with_capacity(left.len());
    for &coordinate in order_by {
        let share = |column: usize| loadings[(coordinate, column)].powi(2) / weight(column);
        let heaviest = (0..left.len()).max_by(|&a, &b| share(left[a]).total_cmp(&share(left[b])));
        if let Some(position) = heaviest.filter(|&position| share(left[position]) > 0.5) {
            order.push(left.remove(position));
        }
    }
    // Stable: equals stay in their order.
    left.sort_by(|&a, &b| weight(b).total_cmp(&weight(a)));
    order.extend(left);
    let columns = order.iter().map(|&column| loadings.column(column));
    let signs = columns.map(|column| column[column.iamax()].signum());
    let signs = signs.collect();
    (order, signs)
}

fn best_angle(loadings: &DMatrix<f64>, a: usize, b: usize, n_rows: f64) -> f64 {
    let (mut sum_u, mut sum_v, mut sum_uv, mut sum_difference) = (0.0, 0.0, 0.0, 0.0);
    for row in 0..loadings.nrows() {
        let (x, y) = (loadings[(row, a)], loadings[(row, b)]);
        let (u, v) = (x * x - y * y, 2.0 * x * y);
        sum_u += u;
        sum_v += v;
        sum_uv += 2.0 * u * v;
        sum_difference += u * u - v * v;
    }
    let numerator = sum_uv - 2.0 * sum_u * sum_v / n_rows;
    let denominator = sum_difference - (sum_u * sum_u - sum_v * sum_v) / n_rows;
    if numerator == 0.0 && denominator >= 0.0 {
        0.0
    } else {
        numerator.atan2(denominator) / 4.0
    }
}

fn turn(matrix: &mut DMatrix<f64>, a: usize, b: usize, angle: f64) {
    let (sine, cosine) = angle.sin_cos();
    for row in 0..matrix.nrows() {
        let (x, y) = (matrix[(row, a)], matrix[(row, b)]);
        matrix[(row, a)] = cosine * x + sine * y;
        matrix[(row, b)] = cosine * y - sine * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn varimax_undoes_a_rotation_of_a_simple_structure() {
        let simple =
            DMatrix::from_row_slice(5, 2, &[1.0, 0.0, 0.9, 0.0, 0.0, 1.2, 0.0, 0.8, 0.0, 0.5]);
        let mut mixed = simple.clone();
        turn(&mut mixed, 0, 1, 0.4);
        let found = &mixed * varimax(&mixed);
        for row in 0..5 {
            assert!(
                found[(row, 0)].abs().min(found[(row, 1)].abs()) < 1e-9,
                "{found}"
            );
        }
    }
}
