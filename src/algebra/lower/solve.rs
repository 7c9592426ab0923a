//! Least squares of small, known size as straight-line operations.

use super::number::{Number, Sheet};
use crate::ir::Unary;

/// `pinv(J^T) w = (J J^T)^-1 J w` for the `d x n` matrix with these rows, `d <= n`.
///
/// The normal equations by Cholesky, `J J^T = L L^T`; d is small, so all is unrolled. The error
/// grows with the square of J's condition number. If J has not full row rank a pivot is zero or
/// negative, and the result infinite or not a number.
pub(super) fn pinv_times<'b>(
    sheet: &'b Sheet<'b>,
    rows: &[Vec<Number<'b>>],
    w: &[Number<'b>],
) -> Vec<Number<'b>> {
    let dot =
        |a: &[Number<'b>], b: &[Number<'b>]| dot(a, b).unwrap_or_else(|| Number::known(sheet, 0.0));
    let d = rows.len();
    let mut lower: Vec<Vec<Number>> = Vec::with_capacity(d);
    let mut pivots: Vec<Number> = Vec::with_capacity(d);
    // L y = J w, along with the factorisation.
    let mut y: Vec<Number> = Vec::with_capacity(d);
    for i in 0..d {
        let mut row: Vec<Number> = Vec::with_capacity(i);
        for j in 0..i {
            let entry = minus_products(dot(&rows[i], &rows[j]), &row, &lower[j]);
            row.push(entry / pivots[j]);
        }
        let square = minus_products(dot(&rows[i], &rows[i]), &row, &row);
        let pivot = square.unary(Unary::Sqrt);
        let right = minus_products(dot(&rows[i], w), &row, &y);
        y.push(right / pivot);
        pivots.push(pivot);
        lower.push(row);
    }
    // L^T u = y, from the last unknown to the first.
    let mut solution = y;
    for i in (0..d).rev() {
        let column: Vec<Number> = (i + 1..d).map(|k| lower[k][i]).collect();
        let right = minus_products(solution[i], &column, &solution[i + 1..]);
        solution[i] = right / pivots[i];
    }
    solution
}

/// `a . b`; two chains, so that one does not wait for every sum of the other.
fn dot<'b>(a: &[Number<'b>], b: &[Number<'b>]) -> Option<Number<'b>> {
    let mut sums: [Option<Number>; 2] = [None; 2];
    for (k, (&a, &b)) in a.iter().zip(b).enumerate() {
        let product = a * b;
        sums[k % 2] = Some(sums[k % 2].map_or(product, |sum| sum + product));
    }
    let [even, odd] = sums;
    even.map(|even| odd.map_or(even, |odd| even + odd))
}

/// `start - a . b`.
fn minus_products<'b>(start: Number<'b>, a: &[Number<'b>], b: &[Number<'b>]) -> Number<'b> {
    let pairs = a.iter().zip(b);
    pairs.fold(start, |sum, (&a, &b)| sum - a * b)
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::ir::{Interpreter, ProgramBuilder};
    use crate::lower::number::{ids, numbers};

    fn solve(jacobian: &DMatrix<f64>, w: &DVector<f64>) -> DVector<f64> {
        let (d, n) = jacobian.shape();
        let mut builder = ProgramBuilder::new("solve");
        let entries = builder.input("jacobian", d * n);
        let w_values = builder.input("w", n);
        let sheet = &Sheet::new(&mut builder);
        let rows: Vec<Vec<Number>> = entries.chunks(n).map(|row| numbers(sheet, row)).collect();
        let solution = ids(&pinv_times(sheet, &rows, &numbers(sheet, &w_values)));
        builder.output("u", &solution);
        let program = builder.finish().expect("a valid program");
        let inputs = [jacobian.transpose().as_slice(), w.as_slice()].map(<[f64]>::to_vec);
        DVector::from_vec(Interpreter::new(&program).results(&inputs).remove(0))
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
