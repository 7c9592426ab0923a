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
    // Two chains, so that one does not wait for every sum of the other.
    let dot = |a: &[Number<'b>], b: &[Number<'b>]| {
        let mut sums = [Number::known(sheet, 0.0); 2];
        for (k, (&a, &b)) in a.iter().zip(b).enumerate() {
            sums[k % 2] = sums[k % 2] + a * b;
        }
        sums[0] + sums[1]
    };
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

/// `start - a . b`.
fn minus_products<'b>(start: Number<'b>, a: &[Number<'b>], b: &[Number<'b>]) -> Number<'b> {
    let pairs = a.iter().zip(b);
    pairs.fold(start, |sum, (&a, &b)| sum - a * b)
}
