//! Least squares of small, known size as straight-line operations.

use crate::ir::{ProgramBuilder, Unary, ValueId};

/// `pinv(J^T) w = (J J^T)^-1 J w` for the `d x n` matrix with these rows, `d <= n`.
///
/// The normal equations by Cholesky, `J J^T = L L^T`; d is small, so all is unrolled. The error
/// grows with the square of J's condition number. If J has not full row rank a pivot is zero or
/// negative, and the result infinite or not a number.
pub(super) fn pinv_times(
    builder: &mut ProgramBuilder,
    rows: &[Vec<ValueId>],
    w: &[ValueId],
) -> Vec<ValueId> {
    let d = rows.len();
    let mut lower: Vec<Vec<ValueId>> = Vec::with_capacity(d);
    let mut pivots: Vec<ValueId> = Vec::with_capacity(d);
    // L y = J w, along with the factorisation.
    let mut y: Vec<ValueId> = Vec::with_capacity(d);
    for i in 0..d {
        let mut row: Vec<ValueId> = Vec::with_capacity(i);
        for j in 0..i {
            let entry = dot(builder, &rows[i], &rows[j]);
            let entry = minus_products(builder, entry, &row, &lower[j]);
            row.push(builder.div(entry, pivots[j]));
        }
        let square = dot(builder, &rows[i], &rows[i]);
        let square = minus_products(builder, square, &row, &row);
        let pivot = builder.unary(Unary::Sqrt, square);
        let right = dot(builder, &rows[i], w);
        let right = minus_products(builder, right, &row, &y);
        y.push(builder.div(right, pivot));
        pivots.push(pivot);
        lower.push(row);
    }
    // L^T u = y, from the last unknown to the first.
    let mut solution = y;
    for i in (0..d).rev() {
        let column: Vec<ValueId> = (i + 1..d).map(|k| lower[k][i]).collect();
        let right = minus_products(builder, solution[i], &column, &solution[i + 1..]);
        solution[i] = builder.div(right, pivots[i]);
    }
    solution
}

/// `a . b`; two chains, so that one does not wait for every sum of the other.
fn dot(builder: &mut ProgramBuilder, a: &[ValueId], b: &[ValueId]) -> ValueId {
    let mut sums: [Option<ValueId>; 2] = [None; 2];
    for (k, (&a, &b)) in a.iter().zip(b).enumerate() {
        let product = builder.mul(a, b);
        sums[k % 2] = Some(match sums[k % 2] {
            None => product,
            Some(sum) => builder.add(sum, product),
        });
    }
    match sums {
        [Some(even), Some(odd)] => builder.add(even, odd),
        [Some(only), None] => only,
        [None, _] => builder.constant(0.0),
    }
}

/// `start - a . b`.
fn minus_products(
    builder: &mut ProgramBuilder,
    start: ValueId,
    a: &[ValueId],
    b: &[ValueId],
) -> ValueId {
    a.iter().zip(b).fold(start, |sum, (&a, &b)| {
        let product = builder.mul(a, b);
        builder.sub(sum, product)
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::ir::Interpreter;

    fn solve(jacobian: &DMatrix<f64>, w: &DVector<f64>) -> DVector<f64> {
        let (d, n) = jacobian.shape();
        let mut builder = ProgramBuilder::new("solve");
        let entries = builder.input("jacobian", d * n);
        let w_values = builder.input("w", n);
        let rows: Vec<Vec<ValueId>> = entries.chunks(n).map(<[ValueId]>::to_vec).collect();
        let solution = pinv_times(&mut builder, &rows, &w_values);
        builder.output("u", &solution);
        let program = builder.finish().expect("a valid program");
        let row_major = jacobian.transpose();
        let mut u = DVector::zeros(d);
        let inputs = [row_major.as_slice(), w.as_slice()];
        Interpreter::new(&program).run(&inputs, &mut [u.as_mut_slice()]);
        u
    }

    #[test]
    fn normal_equations_equal_the_pseudoinverse_of_any_shape() {
        for (d, n) in [(1, 1), (1, 4), (3, 3), (4, 18), (7, 18)] {
            let jacobian = DMatrix::from_fn(d, n, |i, j| {
                (1.0 + 2.1 * i as f64 + 0.7 * j as f64 + 0.9 * (i * j) as f64).sin()
            });
            let w = DVector::from_fn(n, |i, _| (0.3 + i as f64).cos());
            let inverse = jacobian.transpose().pseudo_inverse(1e-12);
            let expected = inverse.expect("a tolerance above zero") * &w;
            let found = solve(&jacobian, &w);
            assert!((&found - &expected).amax() < 1e-9, "{d} x {n}: {found}");
        }
    }

    #[test]
    fn dependent_rows_give_no_finite_number() {
        let jacobian = DMatrix::from_row_slice(2, 3, &[1.0, 2.0, 4.0, 2.0, 4.0, 8.0]);
        let found = solve(&jacobian, &DVector::from_row_slice(&[1.0, 0.5, 0.25]));
        assert!(found.iter().all(|value| !value.is_finite()), "{found}");
    }
}
