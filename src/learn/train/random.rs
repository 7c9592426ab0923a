//! Seeded random numbers: the same on every machine and in every release.

use chacha20::ChaCha8Rng;
use chacha20::rand_core::{Rng, SeedableRng};

use super::*;

#[derive(Debug)]
pub(super) struct Random(ChaCha8Rng);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Uniform in `-1 .. 1`.
    pub(super) fn signed(&mut self) -> f64 {
        2.0 * ((self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64) - 1.0
    }

    /// Uniform among the numbers below `count`, which is not 0.
    pub(super) fn below(&mut self, count: usize) -> usize {
        // The upper half of the product: no more than 2^-40 from uniform for counts under 2^24.
        ((u128::from(self.0.next_u64()) * count as u128) >> 64) as usize
    }

    pub(super) fn matrix(&mut self, n_rows: usize, n_columns: usize, bound: f64) -> DMatrix<f64> {
        DMatrix::from_fn(n_rows, n_columns, |_, _| bound * self.signed())
    }
}
