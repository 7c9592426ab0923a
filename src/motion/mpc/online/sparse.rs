//! Sparse matrices whose pattern is fixed once and whose values change every step.

use super::qp::CscMatrix;

/// A matrix in compressed sparse columns.
///
/// The pattern (which entries exist, zeros among them) never changes after construction; the
/// values do. Within a column the row indices ascend.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseColumns(CscMatrix<f64>);

impl SparseColumns {
    /// A matrix of the given pattern, all values zero; entries named twice exist once.
    ///
    /// `entries` are `(row, column)` pairs in any order, each inside `n_rows` by `n_cols`.
    pub fn from_pattern(n_rows: usize, n_cols: usize, entries: &[(usize, usize)]) -> Self {
        for &(row, col) in entries {
            assert!(
                row < n_rows && col < n_cols,
                "entry ({row}, {col}) lies inside the matrix"
            );
        }
        let (rows, columns) = entries.iter().copied().unzip();
        let zeros = vec![0.0; entries.len()];
        Self(CscMatrix::new_from_triplets(
            n_rows, n_cols, rows, columns, zeros,
        ))
    }

    /// The matrix as the solver has it.
    pub fn csc(&self) -> &CscMatrix<f64> {
        &self.0
    }

    /// The stored values, column by column.
    pub fn values(&self) -> &[f64] {
        &self.0.nzval
    }

    /// The stored values, to be overwritten.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.0.nzval
    }

    /// Position of entry `(row, col)` in [`Self::values`], or none if the pattern lacks it.
    pub fn position(&self, row: usize, col: usize) -> Option<usize> {
        let range = self.0.colptr[col]..self.0.colptr[col + 1];
        let found = self.0.rowval[range.clone()].binary_search(&row).ok()?;
        Some(range.start + found)
    }

    /// Overwrites entry `(row, col)`, which the pattern must hold.
    pub fn set(&mut self, row: usize, col: usize, value: f64) {
        let position = self.position(row, col);
        self.0.nzval[position.expect("entry belongs to the pattern")] = value;
    }

    /// Row and value of each entry of a column.
    fn column(&self, col: usize) -> impl Iterator<Item = (usize, f64)> {
        let range = self.0.colptr[col]..self.0.colptr[col + 1];
        range.map(|entry| (self.0.rowval[entry], self.0.nzval[entry]))
    }

    /// `out += A x`.
    pub fn multiply_add(&self, x: &[f64], out: &mut [f64]) {
        for (col, factor) in x.iter().enumerate() {
            for (row, value) in self.column(col) {
                out[row] += value * factor;
            }
        }
    }

    /// `out += Aᵀ y`.
    pub fn transpose_multiply_add(&self, y: &[f64], out: &mut [f64]) {
        for (col, total) in out.iter_mut().enumerate() {
            let products = self.column(col).map(|(row, value)| value * y[row]);
            *total += products.fold(0.0, |sum, product| sum + product);
        }
    }

    /// `out += P x` for a symmetric `P` of which only the upper triangle is stored.
    pub fn symmetric_multiply_add(&self, x: &[f64], out: &mut [f64]) {
        for (col, factor) in x.iter().enumerate() {
            for (row, value) in self.column(col) {
                out[row] += value * factor;
                if row != col {
                    out[col] += value * x[row];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_named_twice_exist_once_and_add_up_by_position() {
        let entries = [(1, 2), (0, 0), (1, 0), (0, 0)];
        let mut matrix = SparseColumns::from_pattern(2, 3, &entries);
        for ((row, col), value) in entries.into_iter().zip([5.0, 2.0, -1.0, 0.5]) {
            let position = matrix.position(row, col).expect("an entry");
            matrix.values_mut()[position] += value;
        }
        assert_eq!(matrix.csc().colptr, [0, 2, 2, 3]);
        assert_eq!(matrix.csc().rowval, [0, 1, 1]);
        assert_eq!(matrix.values(), [2.5, -1.0, 5.0]);
        assert_eq!(matrix.position(0, 1), None);
    }
}
