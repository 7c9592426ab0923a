//! The optimal control problem and the rows of its constraints.
//!
//! At a control step at time `t` with measured latent state `x₀ = (z, dz)` the controller solves, over `N` stages of
//! length `h` with reference `(x_r, u_r)`,
//!
//! ```text
//! minimise   Σ_{k=1..N}   w_k/2 Σ_i [ (z_k,i − z_r,i)² + w_v (dz_k,i − dz_r,i)² ] / σ_i²
//!          + Σ_{k=0..N-1} w_u/2 (u_k − u_r,k)ᵀ S_p⁻¹ (u_k − u_r,k)
//!          + ρ Σ_{k=1..N} s_k
//! subject to x_{k+1} = F̄_k + A_k (x_k − x̄_k) + B_k (u_k − ū_k) + e_k          dynamics
//!            |T u_k + ℓ_k| ≤ τ_max                              torques of the motors
//!            |T (u_k − u_{k-1})| ≤ h r                          rate of the lifted torques, if asked for
//!            ‖(R F u_k)_{x,y}‖ ≤ μ (R F u_k)_z                  lifted body force in contact, if asked for
//!            q_min − s_k q_half ≤ D z_k + d ≤ q_max + s_k q_half,   s_k ≥ 0   decoded joints, k ≥ 1
//! ```
//!
//! - `σ_i` is the standard deviation of latent `i` over the reference, `w_v` the weight of velocities, `w_k = 1` but
//!   `w_N` the terminal weight.
//! - `S_p` is the covariance of the training inputs in the stage's phase, projected into latent coordinates. Where the
//!   training inputs hardly moved, the model knows least about an input's effect; a scalar weight would ignore that.
//! - `F̄, A, B` are the Runge-Kutta step of the stage's phase and its derivatives (`linearise.rs`) at
//!   `(x̄, ū)`: the reference or the last plan. `e_k` is zero if the model is the drift; otherwise `e_k = x_r,k+1 −
//!   F(x_r,k, u_r,k)`, so that the reference is itself a trajectory and the model answers for deviations only.
//! - Without a recorded input `u_r` is estimated from the reference's accelerations (`estimate`) or, if asked for, the
//!   phase's mean training input.
//! - `T` and `F` are the torque and force rows of `W_eᵀ / s_u`; `R` turns a force in the body's axes upright by the
//!   reference's roll and pitch, not one in the world's. `ℓ_k` are the joints' losses along the reference, zero without
//!   actuators. With the consistent lift torques are chosen afterwards within their limits: the rows of `T` are left
//!   out.
//! - `ρ` is an exact penalty: above the sum of the multipliers of a stage's joint rows it changes nothing where the
//!   limits can be kept. One `s_k` serves all joints of a stage. Joint limits are the rows that contradict the
//!   measurement, hence they alone are soft, from stage 1 on: `u = 0` satisfies all others but those of a torque rate.
//!
//! All is written in deviations over their scale, `x_k = x_r,k + σ x̂_k` and `u_k = u_r,k + C_p û_k` with `C_p C_pᵀ =
//! S_p`, and each row over its limit: the cost is a constant diagonal, the solver needs no scaling of its own.
//!
//! A row is superfluous if no point that satisfies the other rows violates it by more than a margin, which a linear
//! program decides: maximise `row · v` subject to the others, with the row itself relaxed so that the maximum exists. The
//! margin matters: left and right legs have nearly equal rows, each of which alone excludes a thin part of the
//! region that the other allows.

use nalgebra::{DMatrix, DVector};

use super::control_model::ControlModel;
use super::dense::Real;
use super::qp::{Cone, ConeProgram, QpSettings, QpSolver, sparse};
use super::reference::Reference;
use super::settings::{Lift, MpcSettings, RowSelection};
use super::stage::StageCost;
use super::trajectory::Trajectory;
use crate::robot::{GRAVITY_M_S2, JOINT_DIM, WrenchFrame};
use crate::solver::Outcome;

/// Price of a slack in the program; the whole cost is scaled to it. clarabel starts with all multipliers near one and
/// needs two iterations more if it has to bring them to 100.
const SLACK_PRICE: Real = 10.0;

/// Distance from the mean training input, in standard deviations, within which limits matter.
const INPUT_REACH: f64 = 10.0;

/// By how much the rows that are kept may let one that is left out be exceeded, relative to its limit or half range:
/// plans may be that far off, commands are clamped and are not.
pub(super) const ROW_MARGIN: Real = 0.02;

/// A row `row · v ≤ bound` on latent inputs or latent positions.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The joint it belongs to.
    pub joint: usize,
    /// Coefficients, `latent_dim`.
    pub row: Vec<f64>,
    /// Right-hand side.
    pub bound: f64,
    /// What a loss of 1 N m in the joint takes from the right-hand side; zero but for torque limits.
    pub per_loss: f64,
}

/// The constraint rows that every stage has, decided once.
#[derive(Debug, Clone, PartialEq)]
pub struct StageRows {
    /// `± T_i u / τ_max,i ≤ 1`, those that can be active.
    pub torque: Vec<Row>,
    /// `± D_i z / q_half,i ≤ …`, those that can be active.
    pub joint: Vec<Row>,
    /// Torque rows of which the rate is limited, and by how much per stage; empty if it is not.
    pub rate: Vec<Row>,
    /// Friction of the body force, if it is constrained.
    pub(crate) friction: Option<BodyFriction>,
}

/// Rows of the body force that a latent input is lifted to.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BodyFriction {
    /// Friction coefficient.
    pub coefficient: f64,
    /// Force over the robot's weight along x, y and z of the model's frame, `3 × latent_dim` row-major.
    pub force: Vec<f64>,
    /// The model's frame.
    pub frame: WrenchFrame,
}

impl BodyFriction {
    fn new(plant: &ControlModel, coefficient: f64) -> Self {
        let weight = plant.robot().mass_kg() * GRAVITY_M_S2;
        let force = plant.lift.rows(JOINT_DIM, 3).transpose() / weight;
        Self {
            coefficient,
            force: force.as_slice().to_vec(),
            frame: plant.input_rule().wrench_frame(),
        }
    }

    /// Writes the cone's rows `(μ F_z, F_x, F_y)` of the force turned upright into `out`.
    pub(crate) fn turned(&self, attitude_rad: [f64; 2], out: &mut [f64]) {
        let rotation = to_upright(self.frame, attitude_rad);
        let (rotation, d) = (rotation.as_flattened(), self.force.len() / 3);
        turn_force(rotation, &self.force, self.coefficient, d, out);
    }
}

/// Writes the rows `(μ F_z, F_x, F_y)` of a force `3 × d` turned by a rotation; both row-major.
fn turn_force(rotation: &[Real], force: &[Real], coefficient: Real, d: usize, out: &mut [Real]) {
    for row in 0..3 {
        let turned = &rotation[3 * ((row + 2) % 3)..];
        for j in 0..d {
            let mut sum: Real = turned[0] * force[j];
            sum += turned[1] * force[d + j];
            sum += turned[2] * force[2 * d + j];
            out[row * d + j] = if row == 0 { coefficient * sum } else { sum };
        }
    }
}

impl StageRows {
    /// The rows for a model on its robot.
    ///
    /// Unless all are asked for, two kinds are left out: rows that the others imply to within 2 % of the limit, and
    /// torque rows that no input within `INPUT_REACH` standard deviations of the training inputs reaches in any phase.
    /// Plans may pass these limits, by 2 %, an input unlike any in training or large losses; clamped commands do not.
    pub fn new(plant: &ControlModel, settings: &MpcSettings) -> Self {
        Self::selected(plant, settings, row_selection(plant, settings))
    }

    fn selected(plant: &ControlModel, settings: &MpcSettings, selection: RowSelection) -> Self {
        let select = |rows: Vec<Row>| match selection {
            RowSelection::All => rows,
            RowSelection::Needed => needed_rows(rows, ROW_MARGIN),
        };
        let mut torque = match settings.lift {
            Lift::Consistent => Vec::new(),
            Lift::Transpose => torque_rows(plant),
        };
        if selection == RowSelection::Needed {
            torque.retain(|row| is_reachable(plant, row));
            torque = pairs_first(select(torque));
        }
        let mut rate = Vec::new();
        if let Some(limit) = settings.torque_rate_nm_s {
            // Which rows are needed does not depend on the rate: they are chosen for 1 N m a stage.
            rate = select(both_sides(plant, |_| 1.0, 0.0));
            for entry in rate.iter_mut().flat_map(|row| &mut row.row) {
                *entry /= limit * settings.step_s;
            }
        }
        let friction = settings.body_friction;
        Self {
            torque,
            rate,
            joint: select(joint_rows(plant)),
            friction: friction.map(|coefficient| BodyFriction::new(plant, coefficient)),
        }
    }
}

pub(super) fn stage_cost(state_weights: &[f64], settings: &MpcSettings) -> StageCost {
    let scale = SLACK_PRICE / settings.joint_penalty;
    StageCost {
        state: state_weights.iter().map(|weight| scale * weight).collect(),
        terminal: settings.terminal_weight,
        input: scale * settings.input_weight,
        slack: SLACK_PRICE,
    }
}

/// The rows with both sides of a limit first, side by side; else the order stays.
fn pairs_first(rows: Vec<Row>) -> Vec<Row> {
    let is_paired = |row: &&Row| rows.iter().any(|other| other.is_opposite(row));
    let (paired, single): (Vec<_>, Vec<_>) = rows.iter().partition(is_paired);
    paired.into_iter().chain(single).cloned().collect()
}

/// How many pairs of opposite rows come first.
pub fn pairs(rows: &[Row]) -> usize {
    let (twos, _) = rows.as_chunks::<2>();
    (twos.iter())
        .take_while(|[row, other]| row.is_opposite(other))
        .count()
}

impl Row {
    fn is_opposite(&self, other: &Row) -> bool {
        let opposite = other.row.iter().map(|entry| -entry);
        self.joint == other.joint && self.row.iter().copied().eq(opposite)
    }
}

/// Rows of maps that depend on the state are all kept: which of them matter depends on it too.
pub(super) fn row_selection(plant: &ControlModel, settings: &MpcSettings) -> RowSelection {
    match plant.is_nonlinear() {
        true => RowSelection::All,
        false => settings.rows,
    }
}

impl StageRows {
    /// The same rows with the maps of `plant`, those at a stage's reference; none if a row vanishes there.
    pub(super) fn with_maps_of(&self, plant: &ControlModel, of: &MpcSettings) -> Option<Self> {
        let rows = Self::selected(plant, of, RowSelection::All);
        let shape = |rows: &Self| (rows.torque.len(), rows.rate.len(), rows.joint.len());
        (shape(&rows) == shape(self)).then_some(rows)
    }

    /// The same without the joint rows that no state within `STATE_REACH` of the reference's own standard deviations of
    /// some state of it reaches. Limits are soft and commanded positions clamped: all that is given up is that a plan
    /// from far away bends around limits that its reference is nowhere near.
    pub(crate) fn near(mut self, reference: &Reference) -> Self {
        let deviation = reference.deviation();
        (self.joint).retain(|row| reference.comes_near(&row.row, row.bound, deviation));
        self
    }
}

/// Whether an input within `INPUT_REACH` deviations reaches a row's bound in some phase: `row · m + reach ‖Cᵀ row‖`.
fn is_reachable(plant: &ControlModel, row: &Row) -> bool {
    let direction = DVector::from_column_slice(&row.row);
    plant.phases().iter().any(|phase| {
        let spread = phase.latent_root.tr_mul(&direction).norm();
        direction.dot(&phase.latent_mean) + INPUT_REACH * spread >= row.bound
    })
}

/// Both sides of every torque limit; joints that the lift does not reach have none.
fn torque_rows(plant: &ControlModel) -> Vec<Row> {
    let limits = plant.robot().torque_limit_nm();
    both_sides(plant, |joint| limits[joint], 1.0)
}

/// Both sides of a limit (N m) on the torque of each joint, from which losses take `loss_share`.
fn both_sides(plant: &ControlModel, limit: impl Fn(usize) -> f64, loss_share: f64) -> Vec<Row> {
    rows_of(&plant.lift, |joint, sign| {
        (limit(joint), 1.0, loss_share * sign / limit(joint))
    })
}

/// Both sides of every joint limit, divided by half the joint's range.
fn joint_rows(plant: &ControlModel) -> Vec<Row> {
    let limits = plant.robot().joint_limit_rad();
    rows_of(&plant.decoder, |joint, sign| {
        let (lower, upper) = limits[joint];
        let half = 0.5 * (upper - lower);
        let limit = if sign > 0.0 { upper } else { lower };
        (half, sign * (limit - plant.decoder_bias[joint]) / half, 0.0)
    })
}

/// Each joint's row of a matrix over `of`'s first value, with both signs, bound and loss share; no rows of zeros.
fn rows_of(matrix: &DMatrix<f64>, of: impl Fn(usize, f64) -> (f64, f64, f64)) -> Vec<Row> {
    let sides = (0..JOINT_DIM).flat_map(|joint| [1.0, -1.0].map(|sign| (joint, sign)));
    let rows = sides.map(|(joint, sign)| {
        let (size, bound, per_loss) = of(joint, sign);
        Row {
            joint,
            row: matrix.row(joint).iter().map(|e| sign * e / size).collect(),
            bound,
            per_loss,
        }
    });
    rows.filter(|row| row.row.iter().any(|entry| *entry != 0.0))
        .collect()
}

/// Rotation that turns a lifted force upright: none is needed for one in world axes.
pub fn to_upright(frame: WrenchFrame, attitude: [f64; 2]) -> [[f64; 3]; 3] {
    match frame {
        WrenchFrame::Body => upright(attitude),
        WrenchFrame::World => upright([0.0; 2]),
    }
}

/// Rotation from the body frame to an upright frame with the same heading, `R_y(pitch) R_x(roll)`, row-major.
pub(crate) fn upright(attitude: [f64; 2]) -> [[f64; 3]; 3] {
    let ((sin_roll, cos_roll), (sin_pitch, cos_pitch)) =
        (attitude[0].sin_cos(), attitude[1].sin_cos());
    [
        [cos_pitch, sin_pitch * sin_roll, sin_pitch * cos_roll],
        [0.0, cos_roll, -sin_roll],
        [-sin_pitch, cos_pitch * sin_roll, cos_pitch * cos_roll],
    ]
}

/// The rows without those that follow from the others to within `margin`, in the same order: tried from the last to the
/// first, so of two equal rows the first stays. Dropped rows that those left no longer imply come back at the end; a
/// row also stays whenever its linear program is not solved beyond doubt.
pub fn needed_rows(rows: Vec<Row>, margin: f64) -> Vec<Row> {
    let mut is_kept = vec![true; rows.len()];
    for index in (0..rows.len()).rev() {
        is_kept[index] = !is_implied(&rows, &is_kept, index, margin);
    }
    // Each round brings at least one row back, so this ends.
    let is_missing = |is_kept: &[bool], index: usize| {
        !is_kept[index] && !is_implied(&rows, is_kept, index, margin)
    };
    while let Some(index) = (0..rows.len()).find(|&index| is_missing(&is_kept, index)) {
        is_kept[index] = true;
    }
    let rows = rows.into_iter().zip(is_kept);
    rows.filter_map(|(row, is_kept)| is_kept.then_some(row))
        .collect()
}

/// Whether the rows kept besides `index` imply it to within `margin`.
fn is_implied(rows: &[Row], is_kept: &[bool], index: usize, margin: f64) -> bool {
    let sizes = rows[index].row.iter().map(|entry| entry.abs());
    let relaxation = sizes.fold(0.0, f64::max).max(1.0) + margin;
    let others = (0..rows.len()).filter(|&other| is_kept[other] && other != index);
    let mut others: Vec<&Row> = others.map(|other| &rows[other]).collect();
    others.push(&rows[index]);
    match maximum(&others, relaxation) {
        // The solver's own tolerance must not decide.
        Some(maximum) => maximum <= rows[index].bound + margin.max(1e-6 * relaxation),
        None => false,
    }
}

/// `max row · v` for the last row subject to all rows, that one relaxed.
fn maximum(rows: &[&Row], relaxation: f64) -> Option<f64> {
    let last = rows.last()?;
    let dim = last.row.len();
    let mut entries = Vec::with_capacity(rows.len() * dim);
    for (number, row) in rows.iter().enumerate() {
        let values = row.row.iter().enumerate();
        entries.extend(values.map(|(col, &value)| (number, col, value)));
    }
    let mut b: Vec<f64> = rows.iter().map(|row| row.bound).collect();
    b[rows.len() - 1] += relaxation;
    let program = ConeProgram {
        p: sparse(dim, dim, &[]),
        q: last.row.iter().map(|entry| -entry).collect(),
        a: sparse(rows.len(), dim, &entries),
        b,
        cones: vec![Cone::Nonnegative(rows.len())],
    };
    let settings = QpSettings {
        tolerance: 1e-9,
        max_iterations: 100,
        ..QpSettings::default()
    };
    let mut solver = QpSolver::new(program, settings).ok()?;
    if solver.solve() != Outcome::Solved {
        return None;
    }
    let terms = last.row.iter().zip(solver.solution());
    Some(terms.map(|(row, value)| row * value).sum())
}
