//! Rows that link the inputs of consecutive stages, `L_k v_k − L_{k−1} v_{k−1} <= bound`.
//!
//! The recursion then goes over the state and the input before it: with `w` the weights of a stage's links and `V(x,
//! v_before) = ½ xᵀ P x + v_beforeᵀ M x + ½ v_beforeᵀ N v_before + …`,
//!
//! ```text
//! H_vv = R + L_kᵀ w L_k + Bᵀ P B + M B + (M B)ᵀ + N,   H_vx = Bᵀ P A + M A,   C = −L_kᵀ w L_{k−1}
//! v = −K x − K_before v_before − H_vv⁻¹ h,              K_before = H_vv⁻¹ C
//! M ← −Cᵀ K,   N ← L_{k−1}ᵀ w L_{k−1} − Cᵀ K_before
//! ```
//!
//! `N` is the difference of two matrices of the weights' size, and near the optimum the weight of an active row grows
//! without bound, so that only rounding would remain of `N`. Rows of a linked program are therefore softened. The
//! equation of a row is `row · dv + ds − softness dy = −residual`, its weight `y / (s + softness y)` at most
//! `1 / softness`. A step then leaves a residual of `softness dy` in a row. It vanishes with the steps, so the optimum
//! is that of the original rows.

use super::lower::Lower;
use super::problem::{Program, Stage};
use super::riccati::{
    Products, add_multiple, scale_rows, solve_lower_rows, solve_upper_rows, subtract_multiple,
};
use super::scalar::Real;

/// Rows that link inputs, and memory for their gains.
#[derive(Debug)]
pub struct Links<'m, T, const NU: usize, const LINKED: bool> {
    /// `L`: `Shape::link` rows for each place of the ring of stages.
    pub rows: &'m [[T; NU]],
    /// Memory of the solver, one for each place.
    pub gains: &'m mut [[[T; NU]; NU]],
    /// How much a multiplier's change moves its row in one step.
    pub softness: T,
}

impl<T: Real, const NU: usize> Links<'_, T, NU, false> {
    /// No rows of the kind.
    pub fn none() -> Self {
        Self {
            rows: &[],
            gains: &mut [],
            softness: T::ZERO,
        }
    }
}

/// Cost of the input before a stage, from the stage on, but for a constant.
pub(super) struct Before<T, const NX: usize, const NU: usize> {
    /// `M`, by the state.
    by_state: [[T; NX]; NU],
    /// `N`, of which the lower triangle is written.
    square: [[T; NU]; NU],
    linear: [T; NU],
}

impl<T: Real, const NX: usize, const NU: usize> Before<T, NX, NU> {
    #[inline(always)]
    pub(super) fn zeros() -> Self {
        Self {
            by_state: [[T::ZERO; NX]; NU],
            square: [[T::ZERO; NU]; NU],
            linear: [T::ZERO; NU],
        }
    }

    /// Adds this cost of a stage's input to its gradient and to the beginnings of its Hessians.
    #[inline(always)]
    pub(super) fn add_to(
        &self,
        stage: &Stage<T, NX, NU>,
        by_v: &mut [T; NU],
        products: &mut Products<T, NX, NU>,
    ) {
        let mut product = [[T::ZERO; NU]; NU];
        for i in 0..NU {
            for j in 0..NX {
                add_multiple(self.by_state[i][j], &stage.a[j], &mut products.hvx[i]);
                add_multiple(self.by_state[i][j], &stage.b[j], &mut product[i]);
            }
        }
        for i in 0..NU {
            by_v[i] += self.linear[i];
            for j in 0..=i {
                products.hvv[i][j] += self.square[i][j] + (product[i][j] + product[j][i]);
            }
        }
    }

    /// Becomes the cost of the input before a stage that was eliminated. It uses weights and multipliers of the stage's
    /// `count` links, their rows of both stages, and the gradient `h` by the stage's own input. Writes the gain.
    #[inline(always)]
    pub(super) fn write(
        &mut self,
        stage: &Stage<T, NX, NU>,
        gain: &mut [[T; NU]; NU],
        w: &[T],
        y: &[T],
        own: &[[T; NU]],
        earlier: &[[T; NU]],
        count: usize,
        h: &[T; NU],
    ) {
        let mut square: Lower<T, NU> = Lower::zeros();
        let mut cross = [[T::ZERO; NU]; NU];
        for row in 0..count {
            square.add_square(w[row], &earlier[row]);
            for i in 0..NU {
                add_multiple(-(w[row] * own[row][i]), &earlier[row], &mut cross[i]);
            }
        }
        for j in 0..NU {
            self.by_state[j] = [T::ZERO; NX];
            for i in 0..NU {
                add_multiple(-cross[i][j], &stage.gain[i], &mut self.by_state[j]);
            }
        }
        // Y = L⁻¹ C, Z = D⁻¹ Y; N = … − Yᵀ Z; K_before = L⁻ᵀ Z.
        solve_lower_rows(&stage.factor, &mut cross);
        scale_rows(&stage.factor, &cross, gain);
        for i in 0..NU {
            for j in 0..=i {
                let mut entry = square.entry(i, j);
                for k in 0..NU {
                    entry = entry - cross[k][i] * gain[k][j];
                }
                self.square[i][j] = entry;
            }
        }
        solve_upper_rows(&stage.factor, gain);
        pull_before(y, earlier, count, &mut self.linear);
        take_answer(gain, h, &mut self.linear);
    }
}

/// Share of `count` links with multipliers `y` in the gradient by the input before their stage.
#[inline(always)]
pub(super) fn pull_before<T: Real, const NU: usize>(
    y: &[T],
    earlier: &[[T; NU]],
    count: usize,
    by_before: &mut [T; NU],
) {
    let mut sum = [T::ZERO; NU];
    for row in 0..count {
        add_multiple(-y[row], &earlier[row], &mut sum);
    }
    *by_before = sum;
}

/// Subtracts the response of a stage's input from the gradient by the input before: `− K_beforeᵀ h`.
#[inline(always)]
pub(super) fn take_answer<T: Real, const NU: usize>(
    gain: &[[T; NU]; NU],
    h: &[T; NU],
    by_before: &mut [T; NU],
) {
    for i in 0..NU {
        subtract_multiple(h[i], &gain[i], by_before);
    }
}

/// Adds the response to the input before a stage to the stage's own input: `− K_before v_before`.
#[inline(always)]
pub(super) fn answer_before<T: Real, const NU: usize>(
    gain: &[[T; NU]; NU],
    before: &[T; NU],
    v: &mut [T; NU],
) {
    for i in 0..NU {
        for j in 0..NU {
            v[i] = v[i] - gain[i][j] * before[j];
        }
    }
}

impl<'m, T: Real, const NX: usize, const NU: usize, const LINKED: bool>
    Program<'m, T, NX, NU, LINKED>
{
    #[inline(always)]
    pub(super) fn is_linked(&self) -> bool {
        LINKED
    }

    #[inline(always)]
    pub(super) fn link_rows(&self, k: usize) -> &'m [[T; NU]] {
        &self.links.rows[self.at(k) * self.shape.link..][..self.shape.link]
    }
}
