//! Sparse matrices whose pattern is fixed once and whose values change every step.

/// A matrix in compressed sparse columns.
///
/// The pattern (which entries exist, zeros among them) never changes after construction; the
/// values do. Within a column the row indices ascend.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseColumns {
    n_rows: usize,
    n_cols: usize,
    column_start: Vec<usize>,
    row_index: Vec<usize>,
    values: Vec<f64>,
}

impl SparseColumns {
    /// A matrix of the given pattern, all values zero; entries named twice exist once.
    ///
    /// `entries` are `(row, column)` pairs in any order, each inside `n_rows` by `n_cols`.
    pub fn from_pattern(n_rows: usize, n_cols: usize, entries: &[(usize, usize)]) -> Self {
        let mut by_column: Vec<(usize, usize)> =
            entries.iter().map(|&(row, col)| (col, row)).collect();
        by_column.sort_unstable();
        by_column.dedup();
        let mut column_start = vec![0; n_cols + 1];
        for &(col, row) in &by_column {
            assert!(
                row < n_rows && col < n_cols,
                "entry ({row}, {col}) lies inside the matrix"
            );
            column_start[col + 1] += 1;
        }
        for col in 0..n_cols {
            column_start[col + 1] += column_start[col];
        }
        let row_index: Vec<usize> = by_column.iter().map(|&(_, row)| row).collect();
        let values = vec![0.0; row_index.len()];
        Self {
            n_rows,
            n_cols,
            column_start,
            row_index,
            values,
        }
    }

    /// Number of rows.
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Number of columns.
    pub fn n_cols(&self) -> usize {
        self.n_cols
    }

    /// Where each column's entries begin in [`Self::values`]; one more entry than columns.
    pub fn column_start(&self) -> &[usize] {
        &self.column_start
    }

    /// The row of every stored entry.
    pub fn row_index(&self) -> &[usize] {
        &self.row_index
    }

    /// The stored values, column by column.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The stored values as the vector that solvers take without copying.
    pub(super) fn values_vec(&self) -> &Vec<f64> {
        &self.values
    }

    /// The stored values, to be overwritten.
    pub fn values_mut(&mut self) -> &mut [f64] {
        &mut self.values
    }

    /// Position of entry `(row, col)` in [`Self::values`], or none if the pattern lacks it.
    pub fn position(&self, row: usize, col: usize) -> Option<usize> {
        let range = self.column_start[col]..self.column_start[col + 1];
        let found = self.row_index[range.clone()].binary_search(&row).ok()?;
        Some(range.start + found)
    }

    /// Overwrites entry `(row, col)`, which the pattern must hold.
    pub fn set(&mut self, row: usize, col: usize, value: f64) {
        let position = self
            .position(row, col)
            .expect("entry belongs to the pattern");
        self.values[position] = value;
    }

    /// `out += A x`.
    pub fn multiply_add(&self, x: &[f64], out: &mut [f64]) {
        for (col, factor) in x.iter().enumerate() {
            for entry in self.column_start[col]..self.column_start[col + 1] {
                out[self.row_index[entry]] += self.values[entry] * factor;
            }
        }
    }

    /// `out += Aᵀ y`.
    pub fn transpose_multiply_add(&self, y: &[f64], out: &mut [f64]) {
        for (col, total) in out.iter_mut().enumerate() {
            let mut sum = 0.0;
            for entry in self.column_start[col]..self.column_start[col + 1] {
                sum += self.values[entry] * y[self.row_index[entry]];
            }
            *total += sum;
        }
    }

    /// `out += P x` for a symmetric `P` of which only the upper triangle is stored.
    pub fn symmetric_multiply_add(&self, x: &[f64], out: &mut [f64]) {
        for col in 0..self.n_cols {
            for entry in self.column_start[col]..self.column_start[col + 1] {
                let row = self.row_index[entry];
                out[row] += self.values[entry] * x[col];
                if row != col {
                    out[col] += self.values[entry] * x[row];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_match_the_dense_matrices() {
        let mut matrix = SparseColumns::from_pattern(2, 3, &[(0, 0), (1, 0), (1, 2)]);
        matrix.values_mut().copy_from_slice(&[2.0, -1.0, 5.0]);
        let (mut forward, mut backward) = ([1.0, 0.0], [0.0; 3]);
        matrix.multiply_add(&[3.0, 100.0, 2.0], &mut forward);
        matrix.transpose_multiply_add(&[1.0, 2.0], &mut backward);
        assert_eq!((forward, backward), ([7.0, 7.0], [0.0, 0.0, 10.0]));

        let mut upper = SparseColumns::from_pattern(2, 2, &[(0, 0), (0, 1), (1, 1)]);
        upper.values_mut().copy_from_slice(&[2.0, 3.0, 4.0]);
        let mut symmetric = [0.0; 2];
        upper.symmetric_multiply_add(&[1.0, 10.0], &mut symmetric);
        assert_eq!(symmetric, [32.0, 43.0]);
    }

    #[test]
    fn pattern_with_repeated_entries_stores_each_once_in_column_order() {
        let mut matrix = SparseColumns::from_pattern(2, 3, &[(1, 2), (0, 0), (1, 0), (0, 0)]);
        matrix.set(0, 0, 2.0);
        matrix.set(1, 0, -1.0);
        matrix.set(1, 2, 5.0);
        assert_eq!(matrix.column_start(), [0, 2, 2, 3]);
        assert_eq!(matrix.row_index(), [0, 1, 1]);
        assert_eq!(matrix.values(), [2.0, -1.0, 5.0]);
        assert_eq!(matrix.position(0, 1), None);
    }
}
