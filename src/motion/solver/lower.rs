//! The lower triangle of a small symmetric matrix, in vectors of four numbers.

use super::riccati::WIDE;
use super::scalar::Real;

/// Columns 0 to 3 of every row, columns 4 to 7 of the rows from the fourth on, and columns 8 to 11 of the
/// rows from the eighth on; what stands right of the diagonal is not read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lower<T, const N: usize> {
    first: [[T; 4]; N],
    second: [[T; 4]; N],
    third: [[T; 4]; N],
}

impl<T: Real, const N: usize> Lower<T, N> {
    /// A matrix of zeros.
    #[inline(always)]
    pub fn zeros() -> Self {
        const { assert!(N <= WIDE) };
        Self {
            first: [[T::ZERO; 4]; N],
            second: [[T::ZERO; 4]; N],
            third: [[T::ZERO; 4]; N],
        }
    }

    /// A diagonal matrix.
    #[inline(always)]
    pub fn diagonal(entries: &[T; N]) -> Self {
        let mut out = Self::zeros();
        for i in 0..N {
            match i / 4 {
                0 => out.first[i][i] = entries[i],
                1 => out.second[i][i - 4] = entries[i],
                _ => out.third[i][i - 8] = entries[i],
            }
        }
        out
    }

    /// `M += w r rᵀ`.
    #[inline(always)]
    pub fn add_square(&mut self, w: T, row: &[T; N]) {
        let mut parts = [[T::ZERO; 4]; WIDE / 4];
        for j in 0..N {
            parts[j / 4][j % 4] = row[j];
        }
        for i in 0..N {
            let factor = w * row[i];
            for j in 0..4 {
                self.first[i][j] += factor * parts[0][j];
            }
            if i >= 4 {
                for j in 0..4 {
                    self.second[i][j] += factor * parts[1][j];
                }
            }
            if i >= 8 {
                for j in 0..4 {
                    self.third[i][j] += factor * parts[2][j];
                }
            }
        }
    }

    /// The entry of the symmetric matrix.
    #[inline(always)]
    fn entry(&self, i: usize, j: usize) -> T {
        let (i, j) = if i < j { (j, i) } else { (i, j) };
        match j / 4 {
            0 => self.first[i][j],
            1 => self.second[i][j - 4],
            _ => self.third[i][j - 8],
        }
    }

    /// The rows, of which only the entries up to the diagonal are those of the matrix.
    #[inline(always)]
    pub fn rows(&self) -> [[T; WIDE]; N] {
        let mut out = [[T::ZERO; WIDE]; N];
        for i in 0..N {
            for j in 0..4 {
                out[i][j] = self.first[i][j];
                out[i][4 + j] = self.second[i][j];
                out[i][8 + j] = self.third[i][j];
            }
        }
        out
    }

    /// Adds the symmetric matrix to a block on the diagonal of another, from this row on.
    #[inline(always)]
    pub fn add_to<const NX: usize>(&self, first: usize, matrix: &mut [[T; NX]; NX]) {
        for i in 0..N {
            for j in 0..N {
                matrix[first + i][first + j] += self.entry(i, j);
            }
        }
    }
}
