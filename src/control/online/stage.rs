//! One stage of the optimal control problem, in deviations from the reference divided by their scale.
//!
//! ```text
//! x̂⁺ = A x̂ + B v + c,   G v <= g,   E p̂⁺ − t <= e,   t >= 0,   L v − L⁻ v⁻ <= l + o⁻ − o,   k − K v ∈ second-order cones
//! ```
//!
//! `p̂⁺` are the positions among the states `x̂⁺`, `L⁻ v⁻` and `o⁻` belong to the stage before. Both solvers take stages as
//! they are: [`conic`](super::conic) makes clarabel's sparse matrices of them, [`structured`](super::structured)
//! solves them one after the other.

use nalgebra::DMatrix;

use super::linearise::StageModel;
use super::problem::{Row, StageRows, pairs};

/// Rows of a friction pyramid.
pub(super) const PYRAMID_ROWS: usize = 4;
/// Rows of a friction cone.
pub(super) const CONE_ROWS: usize = 3;

/// How the friction cone `‖(F_x, F_y)‖ <= μ F_z` is stated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FrictionShape {
    /// As it is.
    Cone,
    /// By the pyramid `|F_x|, |F_y| <= μ F_z / √2` inside it.
    Pyramid,
}

/// Rows `entries v <= bounds`.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    /// Row-major.
    pub entries: Vec<f64>,
    pub bounds: Vec<f64>,
}

impl Rows {
    fn zeros(count: usize, width: usize) -> Self {
        Self {
            entries: vec![0.0; count * width],
            bounds: vec![0.0; count],
        }
    }

    pub(super) fn clear(&mut self) {
        self.entries.clear();
        self.bounds.clear();
    }

    pub(super) fn push(&mut self, row: &[f64], bound: f64) {
        self.entries.extend_from_slice(row);
        self.bounds.push(bound);
    }
}

/// Numbers of states, inputs and rows, the same at all stages.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct StageShape {
    pub states: usize,
    pub inputs: usize,
    /// Most rows on the input.
    pub input_rows: usize,
    /// How many pairs of opposite rows come first among them.
    pub pairs: usize,
    pub soft_rows: usize,
    pub rate_rows: usize,
    pub cones: usize,
}

impl StageShape {
    /// That of a controller's stages.
    pub(super) fn of(latent_dim: usize, rows: &StageRows, friction: FrictionShape) -> Self {
        let forces = usize::from(rows.friction.is_some());
        let (pyramids, cones) = match friction {
            FrictionShape::Cone => (0, forces),
            FrictionShape::Pyramid => (forces, 0),
        };
        Self {
            states: 2 * latent_dim,
            inputs: latent_dim,
            input_rows: rows.torque.len() + PYRAMID_ROWS * pyramids,
            pairs: pairs(&rows.torque),
            soft_rows: rows.joint.len(),
            rate_rows: rows.rate.len(),
            cones,
        }
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
    pub rate: Rows,
    /// `o`: the rates' rows at the reference's input.
    pub rate_at_reference: Vec<f64>,
    /// `K` and `k`, three rows per cone, its axis first.
    pub cones: Rows,
}

/// What a stage is scaled by: its input by `C_p`, lower triangular, about the reference's input; states by their
/// deviations.
#[derive(Debug, Clone, Copy)]
pub(super) struct StageScale<'a> {
    pub root: &'a DMatrix<f64>,
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
            input: Rows::zeros(shape.input_rows, nu),
            soft: Rows::zeros(shape.soft_rows, nu),
            rate: Rows::zeros(shape.rate_rows, nu),
            rate_at_reference: vec![0.0; shape.rate_rows],
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
        let dim = scale.input.len();
        for row in 0..2 * dim {
            let factor = 1.0 / scale.deviation[row];
            for col in 0..dim {
                let mut sum = 0.0;
                for k in col..dim {
                    sum += model.b(row, k) * scale.root[(k, col)];
                }
                self.b[row * dim + col] = factor * sum;
            }
            for col in 0..2 * dim {
                self.a[row * 2 * dim + col] = factor * model.a(row, col) * scale.deviation[col];
            }
            self.c[row] = factor * defect[row];
        }
    }

    /// Rows of torques, rates and joints; `end` is the reference state at the stage's end.
    pub(super) fn write_rows(
        &mut self,
        rows: &StageRows,
        losses_nm: &[f64],
        end: &[f64],
        scale: &StageScale<'_>,
    ) {
        let dim = scale.input.len();
        for (number, row) in rows.torque.iter().enumerate() {
            let entries = &mut self.input.entries[number * dim..][..dim];
            entries.copy_from_slice(&row.row);
            let at_reference = scale_row(entries, scale);
            let bound = row.bound - row.per_loss * losses_nm[row.joint];
            self.input.bounds[number] = bound - at_reference;
        }
        for (number, row) in rows.rate.iter().enumerate() {
            let entries = &mut self.rate.entries[number * dim..][..dim];
            entries.copy_from_slice(&row.row);
            self.rate_at_reference[number] = scale_row(entries, scale);
            self.rate.bounds[number] = row.bound;
        }
        for (number, Row { row, bound, .. }) in rows.joint.iter().enumerate() {
            let mut at_reference = 0.0;
            for col in 0..dim {
                self.soft.entries[number * dim + col] = row[col] * scale.deviation[col];
                at_reference += row[col] * end[col];
            }
            self.soft.bounds[number] = bound - at_reference;
        }
    }

    /// Friction of the force with rows `(μ F_z, F_x, F_y)`, all zero without contact, as a cone or as the last rows on the
    /// input. Without contact slacks are strictly inside.
    pub(super) fn write_friction(&mut self, force: &[f64], scale: &StageScale<'_>) {
        let dim = scale.input.len();
        for (number, bound) in self.cones.bounds.iter_mut().enumerate() {
            let row = &mut self.cones.entries[number * dim..][..dim];
            for col in 0..dim {
                row[col] = -force[number * dim + col];
            }
            let is_free = number == 0 && force.iter().all(|entry| *entry == 0.0);
            let at_reference = -scale_row(row, scale);
            *bound = if is_free { 1.0 } else { at_reference };
        }
        if !self.cones.bounds.is_empty() {
            return;
        }
        let share = std::f64::consts::FRAC_1_SQRT_2;
        let first = self.input.bounds.len() - PYRAMID_ROWS;
        for side in 0..PYRAMID_ROWS {
            let (axis, sign) = (1 + side / 2, if side % 2 == 0 { 1.0 } else { -1.0 });
            let row = &mut self.input.entries[(first + side) * dim..][..dim];
            for col in 0..dim {
                row[col] = sign * force[axis * dim + col] - share * force[col];
            }
            let is_free = row.iter().all(|entry| *entry == 0.0);
            let at_reference = scale_row(row, scale);
            self.input.bounds[first + side] = if is_free { 1.0 } else { -at_reference };
        }
    }
}

/// `row C_p` in place of the row; returns `row · input`.
fn scale_row(row: &mut [f64], scale: &StageScale<'_>) -> f64 {
    let mut at_reference = 0.0;
    for col in 0..row.len() {
        at_reference += row[col] * scale.input[col];
        let mut sum = 0.0;
        for k in col..row.len() {
            sum += row[k] * scale.root[(k, col)];
        }
        row[col] = sum;
    }
    at_reference
}
