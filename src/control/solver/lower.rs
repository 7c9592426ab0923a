//! The lower triangle of a small symmetric matrix, in vectors of four numbers.

use super::riccati::{WIDE, add_multiple};
use super::scalar::Real;

/// Blocks of four columns: columns 0 to 3 of every row, columns 4 to 7 of the rows from the fourth on, and columns 8 to
/// 11 of the rows from the eighth on; what stands right of the diagonal is not read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lower<T, const NU: usize> {
    blocks: [[[T; 4]; NU]; WIDE / 4],
}

impl<T: Real, const NU: usize> Lower<T, NU> {
    /// A matrix of zeros.
    #[inline(always)]
    pub(super) fn zeros() -> Self {
        const { assert!(NU <= WIDE) };
        Self {
            blocks: [[[T::ZERO; 4]; NU]; WIDE / 4],
        }
    }

    /// A diagonal matrix.
    #[inline(always)]
    pub(super) fn diagonal(entries: &[T; NU]) -> Self {
        let mut out: Lower<T, NU> = Lower::zeros();
        for i in 0..NU {
            out.blocks[i / 4][i][i % 4] = entries[i];
        }
        out
    }

    /// `M += w r rᵀ`.
    #[inline(always)]
    pub(super) fn add_square(&mut self, w: T, row: &[T; NU]) {
        let mut parts = [[T::ZERO; 4]; WIDE / 4];
        let mut factors = [T::ZERO; NU];
        for j in 0..NU {
            parts[j / 4][j % 4] = row[j];
            factors[j] = w * row[j];
        }
        for block in 0..WIDE / 4 {
            for i in 4 * block..NU {
                add_multiple(factors[i], &parts[block], &mut self.blocks[block][i]);
            }
        }
    }

    /// An entry on or below the diagonal.
    #[inline(always)]
    pub(super) fn entry(&self, i: usize, j: usize) -> T {
        self.blocks[j / 4][i][j % 4]
    }

    /// Writes the rows, of which only the entries up to the diagonal are those of the matrix.
    #[inline(always)]
    pub(super) fn write_rows(&self, out: &mut [[T; WIDE]; NU]) {
        for i in 0..NU {
            for j in 0..WIDE {
                out[i][j] = self.blocks[j / 4][i][j % 4];
            }
        }
    }

    /// Adds the symmetric matrix to a block on the diagonal of another, from this row on.
    #[inline(always)]
    pub(super) fn add_to<const NX: usize>(&self, first: usize, matrix: &mut [[T; NX]; NX]) {
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
