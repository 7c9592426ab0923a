//! One stage of the optimal control problem, in deviations from the reference divided by their scale.
//!
//! ```text
//! x̂⁺ = A x̂ + B v + c,   G v <= g,   E p̂⁺ − t <= e,   t >= 0,   L v − L⁻ v⁻ <= l + o⁻ − o,
//! k − K v ∈ second-order cones
//! ```
//!
//! `p̂⁺` are the positions among the states `x̂⁺`, `L⁻ v⁻` and `o⁻` belong to the stage before. Both solvers use stages
//! of this form: [`conic`](super::conic) makes clarabel's sparse matrices of them,
//! [`structured`](super::structured) solves them one after the other.

use super::dense::{MOST_LATENT, Real};
use super::linearise::StageModel;
use super::problem::{Row, StageRows, pairs};
use super::settings::Solver;
use crate::solver::Shape;

pub(super) const PYRAMID_ROWS: usize = 4;
pub(super) const CONE_ROWS: usize = 3;
/// Share of a friction cone's radius that the pyramid inside it has along an axis.
pub(super) const SQRT_HALF: Real = std::f64::consts::FRAC_1_SQRT_2;

/// Rows `entries v <= bounds`.
#[derive(Debug, Clone, Default)]
pub(super) struct Rows {
    /// Row-major.
    pub entries: Vec<f64>,
    pub bounds: Vec<f64>,
}

impl Rows {
    fn zeros(count: usize, width: usize) -> Self {
        let mut rows = Self::default();
        rows.resize(count, width);
        rows
    }

    pub(super) fn resize(&mut self, count: usize, width: usize) {
        self.entries.resize(count * width, 0.0);
        self.bounds.resize(count, 0.0);
    }
}

/// Numbers of states, inputs and rows, the same at all stages.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StageShape {
    pub states: usize,
    pub inputs: usize,
    /// Rows but for cones, with the pyramids in their place; of those on the input the most.
    pub rows: Shape,
    pub cones: usize,
}

impl StageShape {
    pub(super) fn of(latent_dim: usize, rows: &StageRows, solver: Solver) -> Self {
        let shape = Self {
            states: 2 * latent_dim,
            inputs: latent_dim,
            rows: Shape {
                input: rows.input.len(),
                soft: rows.soft.len(),
                link: rows.link.len(),
                pairs: pairs(&rows.input),
            },
            cones: 0,
        };
        shape.with_cones(rows.cones.len() / CONE_ROWS, solver)
    }

    /// With cones `‖(F_x, F_y)‖ <= μ F_z` or in their place the pyramids `|F_x|, |F_y| <= μ F_z / √2` inside them.
    pub(super) fn with_cones(mut self, count: usize, solver: Solver) -> Self {
        match solver {
            Solver::Clarabel => self.cones = count,
            Solver::Riccati => self.rows.input += PYRAMID_ROWS * count,
        }
        self
    }
}

/// The cost `½ vᵀ R v + ½ x̂⁺ᵀ Q x̂⁺ + price t`, the same at all stages but for the last one's states.
#[derive(Debug, Clone)]
pub(super) struct StageCost {
    /// Diagonal of `Q`.
    pub state: Vec<f64>,
    /// Factor on it at the last stage.
    pub terminal: f64,
    /// `R` is this multiple of the identity.
    pub input: f64,
    pub slack: f64,
}

/// Writes weights of squared deviations of positions and velocities in units of `deviation`: one, and of velocities
/// `weight` where these have the units of the positions.
pub(super) fn write_weights(deviation: &[Real], weight: Real, d: usize, weights: &mut [Real]) {
    for i in 0..d {
        let ratio = deviation[d + i] / deviation[i];
        weights[i] = 1.0;
        weights[d + i] = weight * (ratio * ratio);
    }
}

/// A stage's numbers; matrices are row-major.
#[derive(Debug, Clone)]
pub(super) struct StageQp {
    pub a: Vec<f64>,
    pub b: Vec<f64>,
    pub c: Vec<f64>,
    /// `G` and `g`.
    pub input: Rows,
    /// `E` and `e`.
    pub soft: Rows,
    /// `L` and `l`.
    pub link: Rows,
    /// `o`: the links' rows at the reference's input.
    pub link_at_reference: Vec<f64>,
    /// `K` and `k`, three rows per cone, its axis first.
    pub cones: Rows,
}

/// Scales of a stage: its input by `C_p`, lower triangular, about the reference's input; states by their deviations.
#[derive(Debug, Clone, Copy)]
pub(super) struct StageScale<'a> {
    /// Column by column.
    pub root: &'a [f64],
    pub input: &'a [f64],
    pub deviation: &'a [f64],
}

impl StageQp {
    pub(super) fn zeros(shape: &StageShape) -> Self {
        let (nx, nu) = (shape.states, shape.inputs);
        Self {
            a: vec![0.0; nx * nx],
            b: vec![0.0; nx * nu],
            c: vec![0.0; nx],
            input: Rows::zeros(shape.rows.input, nu),
            soft: Rows::zeros(shape.rows.soft, nu),
            link: Rows::zeros(shape.rows.link, nu),
            link_at_reference: vec![0.0; shape.rows.link],
            cones: Rows::zeros(CONE_ROWS * shape.cones, nu),
        }
    }

    /// `σ⁻¹ A σ`, `σ⁻¹ B C_p` and `σ⁻¹ defect`.
    pub(super) fn write_dynamics(
        &mut self,
        model: &StageModel,
        defect: &[f64],
        scale: &StageScale<'_>,
    ) {
        let (root, deviation, d) = (scale.root, scale.deviation, scale.input.len());
        let (a, b, c) = (&mut self.a, &mut self.b, &mut self.c);
        scale_dynamics(&model.by, defect, root, deviation, d, a, b, c);
    }

    /// Rows but for cones; `end` is the reference state at the stage's end.
    pub(super) fn write_rows(
        &mut self,
        rows: &StageRows,
        losses_nm: &[f64],
        end: &[f64],
        scale: &StageScale<'_>,
    ) {
        let dim = scale.input.len();
        for (number, row) in rows.input.iter().enumerate() {
            let entries = &mut self.input.entries[number * dim..][..dim];
            let at_reference = scale.row(&row.row, entries);
            let bound = row.bound - row.per_loss * losses_nm[row.joint];
            self.input.bounds[number] = bound - at_reference;
        }
        for (number, row) in rows.link.iter().enumerate() {
            let entries = &mut self.link.entries[number * dim..][..dim];
            self.link_at_reference[number] = scale.row(&row.row, entries);
            self.link.bounds[number] = row.bound;
        }
        for (number, Row { row, bound, .. }) in rows.soft.iter().enumerate() {
            let mut at_reference = 0.0;
            for col in 0..dim {
                self.soft.entries[number * dim + col] = row[col] * scale.deviation[col];
                at_reference += row[col] * end[col];
            }
            self.soft.bounds[number] = bound - at_reference;
        }
    }

    /// A cone of the force with rows `(μ F_z, F_x, F_y)`, all zero without contact, as it is or, of `count`, among the
    /// last rows on the input. Without contact slacks are strictly inside.
    pub(super) fn write_cone(
        &mut self,
        (cone, count): (usize, usize),
        force: &[f64],
        scale: &StageScale<'_>,
    ) {
        let dim = scale.input.len();
        if self.cones.bounds.is_empty() {
            let first = self.input.bounds.len() - PYRAMID_ROWS * (count - cone);
            let rows = &mut self.input.entries[first * dim..];
            let bounds = &mut self.input.bounds[first..];
            return write_pyramid(force, scale.root, scale.input, dim, rows, bounds);
        }
        for number in 0..CONE_ROWS {
            let row = &mut self.cones.entries[(CONE_ROWS * cone + number) * dim..][..dim];
            let force_row = &force[number * dim..][..dim];
            let is_free = number == 0 && force.iter().all(|entry| *entry == 0.0);
            let at_reference = scale.row(force_row, row);
            row.iter_mut().for_each(|entry| *entry = -*entry);
            self.cones.bounds[CONE_ROWS * cone + number] = if is_free { 1.0 } else { at_reference };
        }
    }
}

impl StageScale<'_> {
    /// Writes `row C_p`; returns `row · input`.
    fn row(&self, row: &[f64], out: &mut [f64]) -> f64 {
        scale_row(row, self.root, self.input, self.input.len(), out)
    }
}

/// Writes `σ⁻¹ A σ`, `σ⁻¹ B C_p` and `σ⁻¹ defect` of derivatives `(A B)`, `2d × 3d`; all row-major but `C_p`, lower
/// triangular, column by column.
fn scale_dynamics(
    by: &[Real],
    defect: &[Real],
    root: &[Real],
    deviation: &[Real],
    d: usize,
    a: &mut [Real],
    b: &mut [Real],
    c: &mut [Real],
) {
    for i in 0..2 * d {
        let factor = 1.0 / deviation[i];
        c[i] = factor * defect[i];
        let row = &by[3 * i * d..];
        for j in 0..d {
            let mut sum: Real = 0.0;
            for k in j..d {
                sum += row[2 * d + k] * root[j * d + k];
            }
            b[i * d + j] = factor * sum;
        }
        for j in 0..2 * d {
            a[2 * i * d + j] = factor * row[j] * deviation[j];
        }
    }
}

/// Writes `row C_p`; returns `row · input`.
fn scale_row(row: &[Real], root: &[Real], input: &[Real], d: usize, out: &mut [Real]) -> Real {
    let mut at_reference: Real = 0.0;
    for j in 0..d {
        let mut sum: Real = 0.0;
        for k in j..d {
            sum += row[k] * root[j * d + k];
        }
        out[j] = sum;
        at_reference += row[j] * input[j];
    }
    at_reference
}

/// Writes the friction pyramid of a force with rows `(μ F_z, F_x, F_y)`, all zero without contact, where slacks are
/// strictly inside.
fn write_pyramid(
    force: &[Real],
    root: &[Real],
    input: &[Real],
    d: usize,
    rows: &mut [Real],
    bounds: &mut [Real],
) {
    let mut row: [Real; MOST_LATENT] = [0.0; MOST_LATENT];
    for side in 0..4 {
        let axis = (1 + side / 2) * d;
        let sign: Real = if side % 2 == 0 { 1.0 } else { -1.0 };
        let mut is_free = true;
        for j in 0..d {
            row[j] = sign * force[axis + j] - SQRT_HALF * force[j];
            is_free = is_free && row[j] == 0.0;
        }
        let at_reference = scale_row(&row, root, input, d, &mut rows[side * d..]);
        bounds[side] = if is_free { 1.0 } else { -at_reference };
    }
}

/// Writes a stage's latent input `u_r + C_p v` and the latent state at its end `x_r + σ x` of a solution.
pub(super) fn unscale(
    root: &[Real],
    deviation: &[Real],
    d: usize,
    v: &[Real],
    x: &[Real],
    input: &mut [Real],
    end: &mut [Real],
) {
    for i in 0..d {
        let mut sum: Real = 0.0;
        for j in 0..=i {
            sum += root[j * d + i] * v[j];
        }
        input[i] += sum;
    }
    for i in 0..2 * d {
        end[i] += deviation[i] * x[i];
    }
}

/// Computes the defect for a reference that is itself a trajectory. It is zero when linearised about the reference.
/// Otherwise the defect of `nominal`, the model's step from the reference, is subtracted.
pub(super) fn trust_reference(
    is_about_plan: bool,
    nominal: &[Real],
    end: &[Real],
    d: usize,
    defect: &mut [Real],
) {
    for i in 0..2 * d {
        let left = defect[i] + (end[i] - nominal[i]);
        defect[i] = if is_about_plan { left } else { 0.0 };
    }
}

/// Residual of the dynamics at a reference `(state, input)` that goes to `end`, by a step `next` with derivatives `(A
/// B)` at `(x, u)`: `next + A (state − x) + B (input − u) − end`.
pub(super) fn write_defect(
    next: &[Real],
    by: &[Real],
    x: &[Real],
    u: &[Real],
    state: &[Real],
    input: &[Real],
    end: &[Real],
    d: usize,
    defect: &mut [Real],
) {
    for i in 0..2 * d {
        let row = &by[3 * i * d..];
        let mut sum: Real = next[i] - end[i];
        for j in 0..2 * d {
            sum += row[j] * (state[j] - x[j]);
        }
        for j in 0..d {
            sum += row[2 * d + j] * (input[j] - u[j]);
        }
        defect[i] = sum;
    }
}
