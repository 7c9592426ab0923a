//! The same code for vector units of 256 bits: sums keep their order and products are not contracted, so
//! that the bits are those of [`Program::prepare`] and [`Program::solve`].

use super::problem::{Program, Report, Settings};
use super::scalar::Real;

impl<T: Real, const NX: usize, const NU: usize, const LINKED: bool> Program<'_, T, NX, NU, LINKED> {
    /// [`Program::prepare`] on a processor with AVX2.
    ///
    /// # Safety
    /// The processor must have AVX2.
    #[target_feature(enable = "avx2")]
    pub fn prepare_avx2(&mut self) -> bool {
        self.prepare()
    }

    /// [`Program::solve`] on a processor with AVX2.
    ///
    /// # Safety
    /// The processor must have AVX2.
    #[target_feature(enable = "avx2")]
    pub fn solve_avx2(&mut self, x0: &[T; NX], is_warm: bool, settings: &Settings<T>) -> Report<T> {
        self.solve(x0, is_warm, settings)
    }
}
