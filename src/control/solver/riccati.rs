//! The linear-quadratic optimum over the stages: Riccati's recursion and its passes of vectors.
//!
//! With `V_k(x) = ½ xᵀ P_k x + p_kᵀ x` the cost from the end of stage `k - 1` on, a stage is eliminated by
//!
//! ```text
//! H = [ R + Bᵀ P B   Bᵀ P A ]        K = H_vv⁻¹ H_vx,   v = −K x − H_vv⁻¹ h
//!     [ Aᵀ P B       Aᵀ P A ]        P ← H_xx − H_xv K + Q
//! ```

use super::problem::Stage;
use super::rows::{part, part_mut};
use super::scalar::Real;

/// Most inputs, and the width of rows of `NU` numbers that are filled up with zeros: vectors of four then have no odd
/// ends.
pub(super) const WIDE: usize = 12;

/// Products of [`eliminate`], kept from stage to stage so that they need not be cleared.
pub(super) struct Products<T, const NX: usize, const NU: usize> {
    pa: [[T; NX]; NX],
    pb: [[T; WIDE]; NX],
    b: [[T; WIDE]; NX],
    /// `H_vv` before the stage's end is added to it; the lower triangle is read.
    pub(super) hvv: [[T; WIDE]; NU],
    /// The same of `H_vx`.
    pub(super) hvx: [[T; NX]; NU],
    z: [[T; NX]; NU],
}

impl<T: Real, const NX: usize, const NU: usize> Products<T, NX, NU> {
    #[inline(always)]
    pub(super) fn zeros() -> Self {
        Self {
            pa: [[T::ZERO; NX]; NX],
            pb: [[T::ZERO; WIDE]; NX],
            b: [[T::ZERO; WIDE]; NX],
            hvv: [[T::ZERO; WIDE]; NU],
            hvx: [[T::ZERO; NX]; NU],
            z: [[T::ZERO; NX]; NU],
        }
    }

    #[inline(always)]
    pub(super) fn clear_hessian(&mut self) {
        for i in 0..NU {
            self.hvv[i] = [T::ZERO; WIDE];
            self.hvx[i] = [T::ZERO; NX];
        }
    }

    /// `P = Aᵀ P A − Yᵀ Z` by its lower triangle, with `Y` in the place of `H_vx`.
    #[inline(always)]
    fn write_beginning(&self, a: &[[T; NX]; NX], p: &mut [[T; NX]; NX]) {
        if NX >= 4 {
            for i in (0..NX - NX % 4).step_by(4) {
                for j in (0..i + 4).step_by(8) {
                    if j + 8 <= i + 4 {
                        self.write_block::<8>(i, j, a, p);
                    } else {
                        self.write_block::<4>(i, j, a, p);
                    }
                }
            }
        }
        for i in NX - NX % 4..NX {
            let mut row = [T::ZERO; NX];
            for k in 0..NX {
                add_multiple(a[k][i], &self.pa[k], &mut row);
            }
            for k in 0..NU {
                subtract_multiple(self.hvx[k][i], &self.z[k], &mut row);
            }
            p[i] = row;
        }
        for i in 0..NX {
            for j in 0..i {
                p[j][i] = p[i][j];
            }
        }
    }

    /// `W` columns of four rows of `P`, from this row and column on: a block that stays in registers.
    #[inline(always)]
    fn write_block<const W: usize>(
        &self,
        i: usize,
        j: usize,
        a: &[[T; NX]; NX],
        p: &mut [[T; NX]; NX],
    ) {
        let mut block = [[T::ZERO; W]; 4];
        for k in 0..NX {
            let row: &[T; W] = part(&self.pa[k], j);
            for r in 0..4 {
                add_multiple(a[k][i + r], row, &mut block[r]);
            }
        }
        for k in 0..NU {
            let row: &[T; W] = part(&self.z[k], j);
            for r in 0..4 {
                subtract_multiple(self.hvx[k][i + r], row, &mut block[r]);
            }
        }
        for r in 0..4 {
            let row: &mut [T; W] = part_mut(&mut p[i + r], j);
            *row = block[r];
        }
    }
}

/// `P` of one stage's end to `P` of its beginning, without the costs there; gain and factor of the stage are
/// overwritten. False if the whole Hessian of the input is not positive definite.
#[inline(always)]
pub(super) fn eliminate<T: Real, const NX: usize, const NU: usize>(
    stage: &mut Stage<T, NX, NU>,
    p: &mut [[T; NX]; NX],
    products: &mut Products<T, NX, NU>,
) -> bool {
    for k in 0..NX {
        for j in 0..NU {
            products.b[k][j] = stage.b[k][j];
        }
    }
    // P A and P B, as P is symmetric; H_vx += Bᵀ P A and H_vv += Bᵀ P B.
    products.pa = [[T::ZERO; NX]; NX];
    products.pb = [[T::ZERO; WIDE]; NX];
    add_products::<T, NX, NU, NX, NX>(p, &stage.a, &products.b, &mut products.pa, &mut products.pb);
    add_products::<T, NX, NU, WIDE, NU>(
        &products.b,
        &products.pa,
        &products.pb,
        &mut products.hvx,
        &mut products.hvv,
    );
    if !factorise(&products.hvv, &mut stage.factor) {
        return false;
    }
    // Y = L⁻¹ H_vx, Z = D⁻¹ Y; P = H_xx − Yᵀ Z; K = L⁻ᵀ Z.
    solve_lower_rows(&stage.factor, &mut products.hvx);
    scale_rows(&stage.factor, &products.hvx, &mut products.z);
    products.write_beginning(&stage.a, p);
    solve_upper_rows(&stage.factor, &mut products.z);
    stage.gain = products.z;
    true
}

/// `out_x += leftᵀ x` and `out_v += leftᵀ v` of the first `M` columns of `left`.
#[inline(always)]
fn add_products<T: Real, const NX: usize, const NU: usize, const N: usize, const M: usize>(
    left: &[[T; N]; NX],
    x: &[[T; NX]; NX],
    v: &[[T; WIDE]; NX],
    out_x: &mut [[T; NX]; M],
    out_v: &mut [[T; WIDE]; M],
) {
    // Two rows at a time: each load of x and v serves both.
    for i in (0..M - M % 2).step_by(2) {
        let mut first_x = out_x[i];
        let mut second_x = out_x[i + 1];
        let mut first_v = out_v[i];
        let mut second_v = out_v[i + 1];
        for k in 0..NX {
            add_multiple(left[k][i], &x[k], &mut first_x);
            add_multiple(left[k][i + 1], &x[k], &mut second_x);
            add_wide::<T, NU>(left[k][i], &v[k], &mut first_v);
            add_wide::<T, NU>(left[k][i + 1], &v[k], &mut second_v);
        }
        out_x[i] = first_x;
        out_x[i + 1] = second_x;
        out_v[i] = first_v;
        out_v[i + 1] = second_v;
    }
    for i in M - M % 2..M {
        for k in 0..NX {
            add_multiple(left[k][i], &x[k], &mut out_x[i]);
            add_wide::<T, NU>(left[k][i], &v[k], &mut out_v[i]);
        }
    }
}

/// `L D Lᵀ` of a symmetric matrix, of which the lower triangle is read; false if it is not positive definite.
#[inline(always)]
fn factorise<T: Real, const NU: usize>(
    matrix: &[[T; WIDE]; NU],
    factor: &mut [[T; NU]; NU],
) -> bool {
    for j in 0..NU {
        let mut pivot = matrix[j][j];
        let mut scaled = [T::ZERO; NU];
        for k in 0..j {
            // The inverse of D is stored: L_jk D_k is the entry before its division.
            scaled[k] = factor[k][j];
            pivot = pivot - factor[j][k] * scaled[k];
        }
        if !(pivot > T::ZERO && pivot.is_finite_number()) {
            return false;
        }
        let inverse = T::ONE / pivot;
        factor[j][j] = inverse;
        for i in j + 1..NU {
            let mut entry = matrix[i][j];
            for k in 0..j {
                entry = entry - factor[i][k] * scaled[k];
            }
            factor[j][i] = entry;
            factor[i][j] = entry * inverse;
        }
    }
    true
}

/// `H_vv⁻¹ h` by a factor of [`factorise`], in the place of `h`.
#[inline(always)]
fn solve_factored<T: Real, const NU: usize>(factor: &[[T; NU]; NU], h: &mut [T; NU]) {
    for i in 1..NU {
        for k in 0..i {
            h[i] = h[i] - factor[i][k] * h[k];
        }
    }
    for i in 0..NU {
        h[i] = h[i] * factor[i][i];
    }
    for i in (0..NU).rev() {
        for k in i + 1..NU {
            h[i] = h[i] - factor[k][i] * h[k];
        }
    }
}

/// `M ← L⁻¹ M`.
#[inline(always)]
pub(super) fn solve_lower_rows<T: Real, const NU: usize, const N: usize>(
    factor: &[[T; NU]; NU],
    matrix: &mut [[T; N]; NU],
) {
    for i in 1..NU {
        for k in 0..i {
            let entry = factor[i][k];
            for j in 0..N {
                matrix[i][j] = matrix[i][j] - entry * matrix[k][j];
            }
        }
    }
}

/// `out = D⁻¹ M`.
#[inline(always)]
pub(super) fn scale_rows<T: Real, const NU: usize, const N: usize>(
    factor: &[[T; NU]; NU],
    matrix: &[[T; N]; NU],
    out: &mut [[T; N]; NU],
) {
    for i in 0..NU {
        for j in 0..N {
            out[i][j] = factor[i][i] * matrix[i][j];
        }
    }
}

/// `M ← L⁻ᵀ M`.
#[inline(always)]
pub(super) fn solve_upper_rows<T: Real, const NU: usize, const N: usize>(
    factor: &[[T; NU]; NU],
    matrix: &mut [[T; N]; NU],
) {
    for i in (0..NU).rev() {
        for k in i + 1..NU {
            let entry = factor[k][i];
            for j in 0..N {
                matrix[i][j] = matrix[i][j] - entry * matrix[k][j];
            }
        }
    }
}

/// `out += factor row`.
#[inline(always)]
pub(super) fn add_multiple<T: Real, const N: usize>(factor: T, row: &[T; N], out: &mut [T; N]) {
    for j in 0..N {
        out[j] += factor * row[j];
    }
}

/// `out −= factor row`.
#[inline(always)]
pub(super) fn subtract_multiple<T: Real, const N: usize>(
    factor: T,
    row: &[T; N],
    out: &mut [T; N],
) {
    for j in 0..N {
        out[j] = out[j] - factor * row[j];
    }
}

/// `out += factor row` of rows of `NU` numbers and zeros.
#[inline(always)]
fn add_wide<T: Real, const NU: usize>(factor: T, row: &[T; WIDE], out: &mut [T; WIDE]) {
    for j in 0..(NU + 3) / 4 * 4 {
        out[j] += factor * row[j];
    }
}

/// `out += Mᵀ y`.
#[inline(always)]
pub(super) fn add_transposed<T: Real, const ROWS: usize, const COLS: usize>(
    matrix: &[[T; COLS]; ROWS],
    y: &[T; ROWS],
    out: &mut [T; COLS],
) {
    for k in 0..ROWS {
        add_multiple(y[k], &matrix[k], out);
    }
}

/// `out += M x`, each row summed in the order of its entries; four rows at a time, as their sums do not wait for each
/// other.
#[inline(always)]
pub(super) fn add_product<T: Real, const ROWS: usize, const COLS: usize>(
    matrix: &[[T; COLS]; ROWS],
    x: &[T; COLS],
    out: &mut [T; ROWS],
) {
    for i in (0..ROWS - ROWS % 4).step_by(4) {
        let mut sums = [T::ZERO; 4];
        for r in 0..4 {
            sums[r] = out[i + r];
        }
        for j in 0..COLS {
            for r in 0..4 {
                sums[r] += matrix[i + r][j] * x[j];
            }
        }
        for r in 0..4 {
            out[i + r] = sums[r];
        }
    }
    for i in ROWS - ROWS % 4..ROWS {
        let mut sum = out[i];
        for j in 0..COLS {
            sum += matrix[i][j] * x[j];
        }
        out[i] = sum;
    }
}

impl<T: Real, const NX: usize, const NU: usize> Stage<T, NX, NU> {
    /// State at the stage's end: `A x + B v + c`.
    #[inline(always)]
    pub(super) fn end(&self, x: &[T; NX], v: &[T; NU], end: &mut [T; NX]) {
        let mut sum = self.c;
        add_product(&self.a, x, &mut sum);
        add_product(&self.b, v, &mut sum);
        *end = sum;
    }

    /// Gradient pass from the stage's end to its beginning. On input `p` is the gradient at the end, including the
    /// cost's own, and `h` the gradient by the input. On output `p` is the gradient at the beginning and `h` the whole
    /// gradient by the input. Overwrites the constant part of the input.
    #[inline(always)]
    pub(super) fn pull(&mut self, p: &mut [T; NX], h: &mut [T; NU]) {
        add_transposed(&self.b, p, h);
        let mut feed = *h;
        solve_factored(&self.factor, &mut feed);
        self.feed = feed;
        let mut next = [T::ZERO; NX];
        add_transposed(&self.a, p, &mut next);
        for k in 0..NU {
            for j in 0..NX {
                next[j] = next[j] - self.gain[k][j] * h[k];
            }
        }
        *p = next;
    }

    /// Input from the state at the stage's beginning: `−feed − K x`.
    #[inline(always)]
    pub(super) fn answer(&self, x: &[T; NX], v: &mut [T; NU]) {
        let mut sum = self.feed;
        add_product(&self.gain, x, &mut sum);
        for i in 0..NU {
            v[i] = -sum[i];
        }
    }
}
