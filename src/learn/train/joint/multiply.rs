//! Products of batch matrices with small ones, with the vector units of the machine.
//!
//! A batch is a hundred rows and a product a microsecond: too short for general kernels, which pack their operands
//! first. All matrices are column-major and their columns contiguous, so that every loop here runs down columns.

use nalgebra::DMatrix;

use crate::train::vectors::vectorised;

const LANES: usize = 16;

#[derive(Clone, Copy)]
pub(super) struct Columns<'a> {
    values: &'a [f64],
    rows: usize,
}

impl<'a> Columns<'a> {
    pub(super) fn all(matrix: &'a DMatrix<f64>) -> Self {
        Self {
            values: matrix.as_slice(),
            rows: matrix.nrows(),
        }
    }

    pub(super) fn some(matrix: &'a DMatrix<f64>, start: usize, count: usize) -> Self {
        let rows = matrix.nrows();
        Self {
            values: &matrix.as_slice()[rows * start..rows * (start + count)],
            rows,
        }
    }

    fn count(self) -> usize {
        self.values.len() / self.rows.max(1)
    }
}

/// Columns `start..` of `out`, as many as `b` has, become `a b`.
pub(super) fn product_into(out: &mut DMatrix<f64>, start: usize, a: Columns<'_>, b: &DMatrix<f64>) {
    let rows = a.rows;
    let out = &mut out.as_mut_slice()[rows * start..rows * (start + b.ncols())];
    out.fill(0.0);
    add_columns(out, 1.0, a, b);
}

/// `a b`.
pub(super) fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut product = DMatrix::zeros(a.nrows(), b.ncols());
    add_product(&mut product, 1.0, a, b);
    product
}

/// `out += scale a b`.
pub(super) fn add_product(out: &mut DMatrix<f64>, scale: f64, a: &DMatrix<f64>, b: &DMatrix<f64>) {
    add_columns(out.as_mut_slice(), scale, Columns::all(a), b);
}

/// `out += scale a^T b`.
pub(super) fn add_transposed(out: &mut DMatrix<f64>, scale: f64, a: Columns<'_>, b: Columns<'_>) {
    add_dots(out.as_mut_slice(), scale, a, b);
}

vectorised! {
    fn add_columns(out: &mut [f64], scale: f64, a: Columns<'_>, b: &DMatrix<f64>) {
        assert_eq!((a.count(), out.len()), (b.nrows(), a.rows * b.ncols()));
        let each = b.as_slice().chunks_exact(b.nrows());
        for (out, factors) in out.chunks_exact_mut(a.rows).zip(each) {
            let mut pairs = factors.chunks_exact(2);
            let mut columns = a.values.chunks_exact(2 * a.rows);
            for (factor, columns) in pairs.by_ref().zip(columns.by_ref()) {
                let (first, second) = columns.split_at(a.rows);
                let (p, q) = (scale * factor[0], scale * factor[1]);
                for ((o, x), y) in out.iter_mut().zip(first).zip(second) {
                    *o += p * x + q * y;
                }
            }
            for factor in pairs.remainder() {
                let p = scale * factor;
                for (o, x) in out.iter_mut().zip(columns.remainder()) {
                    *o += p * x;
                }
            }
        }
    }
}

vectorised! {
    fn add_dots(out: &mut [f64], scale: f64, a: Columns<'_>, b: Columns<'_>) {
        assert_eq!((out.len(), a.rows), (a.count() * b.count(), b.rows));
        let mut entries = out.iter_mut();
        for right in b.values.chunks_exact(b.rows) {
            for (left, entry) in a.values.chunks_exact(a.rows).zip(entries.by_ref()) {
                *entry += scale * dot(left, right);
            }
        }
    }
}

#[inline(always)]
fn dot(left: &[f64], right: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (a, b) = (left.chunks_exact(LANES), right.chunks_exact(LANES));
    let rest: f64 = a
        .remainder()
        .iter()
        .zip(b.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (a, b) in a.zip(b) {
        for ((sum, x), y) in sums.iter_mut().zip(a).zip(b) {
            *sum += x * y;
        }
    }
    rest + sums.iter().sum::<f64>()
}
