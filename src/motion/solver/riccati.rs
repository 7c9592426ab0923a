//! The linear-quadratic optimum over the stages: Riccati's recursion and its passes of vectors.
//!
//! With `V_k(x) = ½ xᵀ P_k x + p_kᵀ x` the cost from the end of stage `k - 1` on, a stage is eliminated by
//!
//! ```text
//! H = [ R + Bᵀ P B   Bᵀ P A ]        K = H_vv⁻¹ H_vx,   v = −K x − H_vv⁻¹ h
//!     [ Aᵀ P B       Aᵀ P A ]        P ← H_xx − H_xv K + Q
//! ```
//!
//! All loops have a fixed number of turns and a fixed order of additions: the generated C has the same.

use super::problem::Stage;
use super::rows::part;
use super::scalar::Real;

/// Most inputs, and the width of rows of `NU` numbers that are filled up with zeros: vectors of four
/// then have no odd ends.
pub(super) const WIDE: usize = 12;

/// `P` of one stage's end to `P` of its beginning, without the costs there; gain and factor of the
/// stage are overwritten. Of `hvv`, the input's own Hessian, the lower triangle is read. False if the
/// whole Hessian of the input is not positive definite. `H_vx` begins at what is there if `BEGUN`, else at zero.
#[inline(always)]
pub(super) fn eliminate<T: Real, const NX: usize, const NU: usize, const BEGUN: bool>(
    stage: &mut Stage<T, NX, NU>,
    p: &mut [[T; NX]; NX],
    mut hvv: [[T; WIDE]; NU],
    Products { pa, pb, b, hvx, z }: &mut Products<T, NX, NU>,
) -> bool {
    let a = &stage.a;
    let wide = NU.div_ceil(4) * 4;
    for k in 0..NX {
        for j in 0..NU {
            b[k][j] = stage.b[k][j];
        }
    }
    // Two rows at a time: what is read of A and B serves both.
    for i in (0..NX - NX % 2).step_by(2) {
        let (mut first_a, mut second_a) = ([T::ZERO; NX], [T::ZERO; NX]);
        let (mut first_b, mut second_b) = ([T::ZERO; WIDE], [T::ZERO; WIDE]);
        for k in 0..NX {
            add_multiple(p[i][k], &a[k], &mut first_a);
            add_multiple(p[i + 1][k], &a[k], &mut second_a);
            for j in 0..wide {
                first_b[j] += p[i][k] * b[k][j];
            }
            for j in 0..wide {
                second_b[j] += p[i + 1][k] * b[k][j];
            }
        }
        (pa[i], pa[i + 1]) = (first_a, second_a);
        (pb[i], pb[i + 1]) = (first_b, second_b);
    }
    for i in NX - NX % 2..NX {
        (pa[i], pb[i]) = ([T::ZERO; NX], [T::ZERO; WIDE]);
        for k in 0..NX {
            add_multiple(p[i][k], &a[k], &mut pa[i]);
            add_multiple(p[i][k], &b[k], &mut pb[i]);
        }
    }
    for i in (0..NU - NU % 2).step_by(2) {
        let (mut first_x, mut second_x) = match BEGUN {
            true => (hvx[i], hvx[i + 1]),
            false => ([T::ZERO; NX], [T::ZERO; NX]),
        };
        let (mut first_v, mut second_v) = (hvv[i], hvv[i + 1]);
        for k in 0..NX {
            add_multiple(b[k][i], &pa[k], &mut first_x);
            add_multiple(b[k][i + 1], &pa[k], &mut second_x);
            for j in 0..wide {
                first_v[j] += b[k][i] * pb[k][j];
            }
            for j in 0..wide {
                second_v[j] += b[k][i + 1] * pb[k][j];
            }
        }
        (hvx[i], hvx[i + 1]) = (first_x, second_x);
        (hvv[i], hvv[i + 1]) = (first_v, second_v);
    }
    for i in NU - NU % 2..NU {
        if !BEGUN {
            hvx[i] = [T::ZERO; NX];
        }
        for k in 0..NX {
            add_multiple(b[k][i], &pa[k], &mut hvx[i]);
            add_multiple(b[k][i], &pb[k], &mut hvv[i]);
        }
    }
    if !factorise(&hvv, &mut stage.factor) {
        return false;
    }
    // Y = L⁻¹ H_vx, Z = D⁻¹ Y; P = H_xx − Yᵀ Z; K = L⁻ᵀ Z.
    let factor = &stage.factor;
    let y = hvx;
    for i in 1..NU {
        for k in 0..i {
            let entry = factor[i][k];
            for j in 0..NX {
                y[i][j] = y[i][j] - entry * y[k][j];
            }
        }
    }
    for i in 0..NU {
        for j in 0..NX {
            z[i][j] = factor[i][i] * y[i][j];
        }
    }
    for i in (0..NX - NX % 4).step_by(4) {
        for j in (0..i + 4).step_by(8) {
            match j + 8 <= i + 4 {
                true => lower_block::<T, NX, NU, 8>((i, j), a, pa, y, z, p),
                false => lower_block::<T, NX, NU, 4>((i, j), a, pa, y, z, p),
            }
        }
    }
    for i in NX - NX % 4..NX {
        let mut row = [T::ZERO; NX];
        for k in 0..NX {
            add_multiple(a[k][i], &pa[k], &mut row);
        }
        for k in 0..NU {
            let entry = y[k][i];
            for j in 0..NX {
                row[j] = row[j] - entry * z[k][j];
            }
        }
        p[i] = row;
    }
    for i in 0..NX {
        for j in 0..i {
            p[j][i] = p[i][j];
        }
    }
    for i in (0..NU).rev() {
        for k in i + 1..NU {
            let entry = factor[k][i];
            for j in 0..NX {
                z[i][j] = z[i][j] - entry * z[k][j];
            }
        }
    }
    stage.gain = *z;
    true
}

/// `L D Lᵀ` of a symmetric matrix, of which the lower triangle is read; false if it is not positive
/// definite.
#[inline(always)]
fn factorise<T: Real, const NU: usize>(
    matrix: &[[T; WIDE]; NU],
    factor: &mut [[T; NU]; NU],
) -> bool {
    for j in 0..NU {
        let mut pivot = matrix[j][j];
        let mut scaled = [T::ZERO; NU];
        for k in 0..j {
            // The inverse of D is what is kept: L_jk D_k is the entry before its division.
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

/// `H_vv⁻¹ h` by a factor of [`factorise`].
#[inline(always)]
pub(super) fn solve_factored<T: Real, const NU: usize>(
    factor: &[[T; NU]; NU],
    mut h: [T; NU],
) -> [T; NU] {
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
    h
}

/// `out += factor row`.
#[inline(always)]
pub(super) fn add_multiple<T: Real, const N: usize>(factor: T, row: &[T; N], out: &mut [T; N]) {
    for j in 0..N {
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

/// `out + M x`, each row summed in the order of its entries.
#[inline(always)]
pub(super) fn plus_product<T: Real, const ROWS: usize, const COLS: usize>(
    matrix: &[[T; COLS]; ROWS],
    x: &[T; COLS],
    mut out: [T; ROWS],
) -> [T; ROWS] {
    for i in 0..ROWS {
        let mut sum = out[i];
        for j in 0..COLS {
            sum += matrix[i][j] * x[j];
        }
        out[i] = sum;
    }
    out
}

/// Gradient pass of one stage: from `p` at its end, with the cost's gradient there added already, to
/// `p` at its beginning; the stage's constant part of the input is overwritten. Returns the whole gradient by the
/// input.
#[inline(always)]
pub(super) fn pull<T: Real, const NX: usize, const NU: usize>(
    stage: &mut Stage<T, NX, NU>,
    p: &mut [T; NX],
    mut h: [T; NU],
) -> [T; NU] {
    add_transposed(&stage.b, p, &mut h);
    stage.feed = solve_factored(&stage.factor, h);
    let mut next = [T::ZERO; NX];
    add_transposed(&stage.a, p, &mut next);
    for k in 0..NU {
        for j in 0..NX {
            next[j] = next[j] - stage.gain[k][j] * h[k];
        }
    }
    *p = next;
    h
}

/// Input of a stage from the state at its beginning: `−feed − K x`.
#[inline(always)]
pub(super) fn answer<T: Real, const NX: usize, const NU: usize>(
    stage: &Stage<T, NX, NU>,
    x: &[T; NX],
) -> [T; NU] {
    let mut v = [T::ZERO; NU];
    for i in 0..NU {
        let mut sum = stage.feed[i];
        for j in 0..NX {
            sum += stage.gain[i][j] * x[j];
        }
        v[i] = -sum;
    }
    v
}

/// `out + M x` for a matrix given by its columns: each row is summed in the order of its entries.
#[inline(always)]
pub(super) fn plus_columns<T: Real, const ROWS: usize, const COLS: usize>(
    columns: &[[T; ROWS]; COLS],
    x: &[T; COLS],
    mut out: [T; ROWS],
) -> [T; ROWS] {
    for j in 0..COLS {
        add_multiple(x[j], &columns[j], &mut out);
    }
    out
}

/// `W` columns of four rows of `P`, from this row and column on: a block that stays in registers.
#[inline(always)]
fn lower_block<T: Real, const NX: usize, const NU: usize, const W: usize>(
    (i, j): (usize, usize),
    a: &[[T; NX]; NX],
    pa: &[[T; NX]; NX],
    y: &[[T; NX]; NU],
    z: &[[T; NX]; NU],
    p: &mut [[T; NX]; NX],
) {
    let mut block = [[T::ZERO; W]; 4];
    for k in 0..NX {
        let row = part(&pa[k], j);
        for r in 0..4 {
            add_multiple(a[k][i + r], row, &mut block[r]);
        }
    }
    for k in 0..NU {
        let row: &[T; W] = part(&z[k], j);
        for r in 0..4 {
            for c in 0..W {
                block[r][c] = block[r][c] - y[k][i + r] * row[c];
            }
        }
    }
    for r in 0..4 {
        p[i + r][j..][..W].copy_from_slice(&block[r]);
    }
}

/// Products of [`eliminate`], kept from stage to stage so that they need not be cleared.
pub(super) struct Products<T, const NX: usize, const NU: usize> {
    pa: [[T; NX]; NX],
    pb: [[T; WIDE]; NX],
    b: [[T; WIDE]; NX],
    pub hvx: [[T; NX]; NU],
    z: [[T; NX]; NU],
}

impl<T: Real, const NX: usize, const NU: usize> Products<T, NX, NU> {
    /// Zeros.
    #[inline(always)]
    pub fn new() -> Self {
        let z = T::ZERO;
        Self {
            pa: [[z; NX]; NX],
            pb: [[z; WIDE]; NX],
            b: [[z; WIDE]; NX],
            hvx: [[z; NX]; NU],
            z: [[z; NX]; NU],
        }
    }
}
