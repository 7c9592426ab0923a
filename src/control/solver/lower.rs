//! The lower triangle of a small symmetric matrix, in vectors of four numbers.

use super::riccati::{WIDE, add_multiple};
use super::scalar::Real;

/// Blocks of four columns: columns 0 to 3 of every row, columns 4 to 7 of the rows from the fourth on, columns 8 to 11
/// of those from the eighth on. Entries right of the diagonal are not read.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lower<T, const NU: usize> {
    blocks: [[[T; 4]; NU]; WIDE / 4],
}

impl<T: Real, const NU: usize> Lower<T, NU> {
    #[inline(always)]
    pub(super) fn zeros() -> Self {
        Self {
            blocks: [[[T::ZERO; 4]; NU]; WIDE / 4],
        }
    }

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

    /// Adds `Σ w row rowᵀ`, and to `sum` `Σ y row`, of `count` rows. The first `pairs` pairs of them are opposite rows.
    #[inline(always)]
    pub(super) fn add_rows(
        &mut self,
        w: &[T],
        y: &[T],
        rows: &[[T; NU]],
        pairs: usize,
        count: usize,
        sum: &mut [T; NU],
    ) {
        let w = &w[..count];
        let y = &y[..count];
        let rows = &rows[..count];
        // Local sums stay in registers.
        let mut local = *self;
        let mut local_sum = *sum;
        for pair in 0..pairs {
            let row = &rows[2 * pair];
            local.add_square(w[2 * pair] + w[2 * pair + 1], row);
            add_multiple(y[2 * pair] - y[2 * pair + 1], row, &mut local_sum);
        }
        for i in 2 * pairs..count {
            local.add_square(w[i], &rows[i]);
            add_multiple(y[i], &rows[i], &mut local_sum);
        }
        *self = local;
        *sum = local_sum;
    }

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

    /// Adds the symmetric matrix to the first block on the diagonal of another.
    #[inline(always)]
    pub(super) fn add_to<const NX: usize>(&self, matrix: &mut [[T; NX]; NX]) {
        for i in 0..NU {
            for j in 0..NU {
                let entry = if i < j {
                    self.entry(j, i)
                } else {
                    self.entry(i, j)
                };
                matrix[i][j] += entry;
            }
        }
    }
}
