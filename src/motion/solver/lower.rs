//! The lower triangle of a small symmetric matrix, in vectors of four numbers.

use super::riccati::{WIDE, add_multiple};
use super::scalar::Real;

/// Columns 0 to 3 of every row, columns 4 to 7 of the rows from the fourth on, and columns 8 to 11 of the
/// rows from the eighth on; what stands right of the diagonal is not read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lower<T, const NU: usize> {
    first: [[T; 4]; NU],
    second: [[T; 4]; NU],
    third: [[T; 4]; NU],
}

impl<T: Real, const NU: usize> Lower<T, NU> {
    /// A matrix of zeros.
    #[inline(always)]
    pub fn zeros() -> Self {
        const { assert!(NU <= WIDE) };
        Self {
            first: [[T::ZERO; 4]; NU],
            second: [[T::ZERO; 4]; NU],
            third: [[T::ZERO; 4]; NU],
        }
    }

    /// A diagonal matrix.
    #[inline(always)]
    pub fn diagonal(entries: &[T; NU]) -> Self {
        let mut out: Lower<T, NU> = Lower::zeros();
        for i in 0..NU {
            if i < 4 {
                out.first[i][i] = entries[i];
            } else if i < 8 {
                out.second[i][i - 4] = entries[i];
            } else {
                out.third[i][i - 8] = entries[i];
            }
        }
        out
    }

    /// `M += w r rᵀ`.
    #[inline(always)]
    pub fn add_square(&mut self, w: T, row: &[T; NU]) {
        let mut parts = [[T::ZERO; 4]; WIDE / 4];
        for j in 0..NU {
            parts[j / 4][j % 4] = row[j];
        }
        for i in 0..NU {
            let factor = w * row[i];
            add_multiple(factor, &parts[0], &mut self.first[i]);
            if i >= 4 {
                add_multiple(factor, &parts[1], &mut self.second[i]);
            }
            if i >= 8 {
                add_multiple(factor, &parts[2], &mut self.third[i]);
            }
        }
    }

    /// An entry on or below the diagonal.
    #[inline(always)]
    pub fn entry(&self, i: usize, j: usize) -> T {
        if j < 4 {
            self.first[i][j]
        } else if j < 8 {
            self.second[i][j - 4]
        } else {
            self.third[i][j - 8]
        }
    }

    /// Writes the rows, of which only the entries up to the diagonal are those of the matrix.
    #[inline(always)]
    pub fn write_rows(&self, out: &mut [[T; WIDE]; NU]) {
        for i in 0..NU {
            for j in 0..4 {
                out[i][j] = self.first[i][j];
                out[i][4 + j] = self.second[i][j];
                out[i][8 + j] = self.third[i][j];
            }
        }
    }

    /// Adds the symmetric matrix to a block on the diagonal of another, from this row on.
    #[inline(always)]
    pub fn add_to<const NX: usize>(&self, first: usize, matrix: &mut [[T; NX]; NX]) {
        for i in 0..NU {
            for j in 0..NU {
                let entry = if i < j {
                    self.entry(j, i)
                } else {
                    self.entry(i, j)
                };
                matrix[first + i][first + j] += entry;
            }
        }
    }
}
