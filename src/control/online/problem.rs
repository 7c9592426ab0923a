//! The optimal control problem and the rows of its constraints.
//!
//! At a control step at time `t` with measured latent state `x₀ = (z, dz)` the controller solves the following problem,
//! over `N` stages of length `h` with reference `(x_r, u_r)`:
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
//! - `σ_i` is the standard deviation of latent `i` over the reference, `w_v` the weight of velocities. `w_k` is 1,
//!   except the terminal weight `w_N`.
//! - `S_p` is the covariance of the training inputs in the stage's phase, projected into latent coordinates. In
//!   directions in which the training inputs hardly varied, the model is least certain about an input's effect. A
//!   scalar weight would ignore that.
//! - `F̄, A, B` are the Runge-Kutta step of the stage's phase and its derivatives (`linearise.rs`) at `(x̄, ū)`: the
//!   reference or the last plan. `e_k` is zero if the model is the drift. Otherwise `e_k = x_r,k+1 − F(x_r,k, u_r,k)`,
//!   so that the reference is itself a trajectory and the model predicts deviations only.
//! - Without a recorded input `u_r` is estimated from the reference's accelerations (`estimate`) or is the phase's mean
//!   training input, as the settings choose.
//! - `T` and `F` are the torque and force rows of `W_eᵀ / s_u`. `R` turns a force in the body's axes upright by the
//!   reference's roll and pitch; for a force in world axes it is the identity. `ℓ_k` are the joints' losses along the
//!   reference, zero without actuators. With the consistent lift the rows of `T` are omitted, because it chooses
//!   torques within their limits afterwards.
//! - `ρ` is an exact penalty: above the sum of the multipliers of a stage's joint rows it changes nothing if the limits
//!   can be satisfied. One `s_k` serves all joints of a stage. Only joint limits can contradict the measurement, so
//!   only they are soft, from stage 1 on. `u = 0` satisfies all other rows except those of a torque rate.
//!
//! All variables are deviations divided by their scale, `x_k = x_r,k + σ x̂_k` and `u_k = u_r,k + C_p û_k` with
//! `C_p C_pᵀ = S_p`, and each row is divided by its limit. The cost is therefore a constant diagonal, and the solver
//! needs no scaling of its own.
//!
//! A row is redundant if no point that satisfies the other rows violates it by more than a margin. A linear program
//! decides this: maximise `row · v` subject to the others, with the row itself relaxed so that the maximum exists. The
//! margin matters because left and right legs have nearly equal rows. Each of them alone excludes a thin part of the
//! region that the other allows.

use nalgebra::DVector;

use super::control_model::ControlModel;
use super::dense::Real;
use super::qp::{Cone, ConeProgram, QpSettings, QpSolver, sparse};
use super::reference::Reference;
use super::settings::{Lift, MpcSettings, RowSelection, Settings};
use super::stage::StageCost;
use super::trajectory::Trajectory;
use crate::robot::{GRAVITY_M_S2, JOINT_DIM, WrenchFrame};
use crate::solver::Outcome;

/// Price of a slack in the program; the whole cost is scaled to it. clarabel starts with all multipliers near one. It
/// needs two iterations more to increase them to 100.
const SLACK_PRICE: Real = 10.0;

/// Distance from the mean training input, in standard deviations, within which limits matter.
const INPUT_REACH: f64 = 10.0;

/// Largest violation of an omitted row that the kept rows may permit, relative to its limit or half range. Plans may
/// violate limits by this much; commands are clamped and do not.
pub(super) const ROW_MARGIN: Real = 0.02;

/// A kind of rows; rows, place in a stage and size are stated here alone, for both solvers and the controller in C.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowKind {
    /// `|T_i u_k + ℓ_k,i| ≤ τ_max,i`, in N m.
    TorqueLimit,
    /// `|T_i (u_k − u_{k-1})| ≤ h r`, in N m.
    TorqueRate,
    /// `q_min,i − s_k q_half,i ≤ D_i z_k + d_i ≤ q_max,i + s_k q_half,i`, in rad.
    JointLimit,
    /// `‖(R F u_k)_{x,y}‖ ≤ μ (R F u_k)_z` in contact, forces over the robot's weight.
    BodyFriction,
}

/// Where rows stand in a stage, see [`StageRows`].
enum RowPlace {
    Input,
    Link,
    Soft,
    Cone,
}

/// Returns the limit by which unit rows are divided, for cones the friction coefficient. Zero if the settings do not
/// request this kind.
fn row_size(kind: RowKind, settings: &Settings) -> Real {
    // The consistent lift enforces the torque limits by itself.
    if kind == RowKind::TorqueLimit && settings.lift != Lift::Consistent as i32 {
        return 1.0;
    }
    if kind == RowKind::TorqueRate {
        return settings.torque_rate_nm_s * settings.step_s as Real;
    }
    if kind == RowKind::JointLimit {
        return 1.0;
    }
    if kind == RowKind::BodyFriction {
        return settings.body_friction;
    }
    0.0
}

impl RowKind {
    /// All kinds; rows of one place stand in this order.
    pub const ALL: [Self; 4] = [
        Self::TorqueLimit,
        Self::TorqueRate,
        Self::JointLimit,
        Self::BodyFriction,
    ];

    fn place(self) -> RowPlace {
        match self {
            Self::TorqueLimit => RowPlace::Input,
            Self::TorqueRate => RowPlace::Link,
            Self::JointLimit => RowPlace::Soft,
            Self::BodyFriction => RowPlace::Cone,
        }
    }

    fn rows(self, plant: &ControlModel, size: f64, selection: RowSelection) -> Vec<Row> {
        let robot = plant.robot();
        let row = |(joint, sign): (usize, f64)| {
            let (entries, limit, bound, per_loss) = match self {
                Self::TorqueLimit => {
                    let limit = robot.torque_limit_nm()[joint];
                    (plant.lift.row(joint), limit, 1.0, sign / limit)
                }
                Self::TorqueRate => (plant.lift.row(joint), 1.0, 1.0, 0.0),
                Self::JointLimit => {
                    let (lower, upper) = robot.joint_limit_rad()[joint];
                    let half = 0.5 * (upper - lower);
                    let limit = if sign > 0.0 { upper } else { lower };
                    let bound = sign * (limit - plant.decoder_bias[joint]) / half;
                    (plant.decoder.row(joint), half, bound, 0.0)
                }
                Self::BodyFriction => {
                    let weight_n = robot.mass_kg() * GRAVITY_M_S2;
                    (plant.lift.row(JOINT_DIM + joint), weight_n, size, 0.0)
                }
            };
            Row {
                kind: self,
                joint,
                row: entries.iter().map(|e| sign * e / limit).collect(),
                bound,
                per_loss,
            }
        };
        if let RowPlace::Cone = self.place() {
            return (0..3).map(|axis| row((axis, 1.0))).collect();
        }
        let sides = (0..JOINT_DIM).flat_map(|joint| [(joint, 1.0), (joint, -1.0)]);
        let mut rows: Vec<Row> = sides.map(row).collect();
        rows.retain(|row| row.row.iter().any(|entry| *entry != 0.0));
        // Which rows are needed does not depend on the size.
        if selection == RowSelection::Needed {
            rows.retain(|row| self != Self::TorqueLimit || is_reachable(plant, row));
            rows = needed_rows(rows, ROW_MARGIN);
        }
        for entry in rows.iter_mut().flat_map(|row| &mut row.row) {
            *entry /= size;
        }
        rows
    }
}

/// Whether settings ask for rows that link stages, or for cones.
pub fn has_links_or_cones(settings: &MpcSettings) -> bool {
    let settings = Settings::from(settings);
    RowKind::ALL.into_iter().any(|kind| match kind.place() {
        RowPlace::Input | RowPlace::Soft => false,
        RowPlace::Link | RowPlace::Cone => row_size(kind, &settings) > 0.0,
    })
}

/// A row `row · v ≤ bound` on latent inputs or latent positions.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Its kind.
    pub kind: RowKind,
    /// The joint or axis it belongs to.
    pub joint: usize,
    /// Coefficients, `latent_dim`.
    pub row: Vec<f64>,
    /// Right-hand side; the coefficient of a cone.
    pub bound: f64,
    /// Decrease of the right-hand side per 1 N m of loss in the joint.
    pub per_loss: f64,
}

/// The constraint rows of every stage by their place in it, decided once: those that can be active.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StageRows {
    /// On the input; pairs of opposite rows first.
    pub input: Vec<Row>,
    /// On the difference of the input from that of the stage before.
    pub link: Vec<Row>,
    /// On the positions at the stage's end, softened by one slack.
    pub soft: Vec<Row>,
    /// Three per cone: force along x, y and z of the model's frame, to be turned upright, in contact.
    pub cones: Vec<Row>,
}

/// Writes the rows `(μ F_z, F_x, F_y)` of a force along x, y and z turned by a rotation, row-major.
pub(super) fn turn_force(
    rotation: &[Real],
    x: &[Real],
    y: &[Real],
    z: &[Real],
    coefficient: Real,
    d: usize,
    out: &mut [Real],
) {
    for row in 0..3 {
        let turned = &rotation[3 * ((row + 2) % 3)..];
        for j in 0..d {
            let mut sum: Real = turned[0] * x[j];
            sum += turned[1] * y[j];
            sum += turned[2] * z[j];
            out[row * d + j] = if row == 0 { coefficient * sum } else { sum };
        }
    }
}

impl StageRows {
    /// The rows for a model on its robot.
    ///
    /// By default two kinds are omitted. The first are rows that the others imply to within 2 % of the limit. The
    /// second are torque rows that no input within `INPUT_REACH` standard deviations of the training inputs reaches in
    /// any phase. Plans may exceed these limits by 2 %, with an input unlike any in training, or with large losses.
    /// Clamped commands do not.
    pub fn new(plant: &ControlModel, settings: &MpcSettings) -> Self {
        Self::of_settings(plant, settings, row_selection(plant, settings))
    }

    /// All rows for sizes of one, for settings that are chosen when a controller runs.
    pub fn of_all_kinds(plant: &ControlModel) -> Self {
        let selection = row_selection(plant, &MpcSettings::default());
        Self::sized(plant, selection, |_| 1.0)
    }

    fn of_settings(plant: &ControlModel, of: &MpcSettings, selection: RowSelection) -> Self {
        let settings = Settings::from(of);
        Self::sized(plant, selection, |kind| row_size(kind, &settings))
    }

    fn sized(plant: &ControlModel, selection: RowSelection, size: impl Fn(RowKind) -> f64) -> Self {
        let mut rows = Self::default();
        for kind in RowKind::ALL {
            let of_place = match kind.place() {
                RowPlace::Input => &mut rows.input,
                RowPlace::Link => &mut rows.link,
                RowPlace::Soft => &mut rows.soft,
                RowPlace::Cone => &mut rows.cones,
            };
            let size = size(kind);
            if size > 0.0 {
                of_place.extend(kind.rows(plant, size, selection));
            }
        }
        // Both sides of a limit first, side by side; else the order stays.
        let all = rows.input.clone();
        (rows.input).sort_by_cached_key(|row| !all.iter().any(|other| other.is_opposite(row)));
        rows
    }

    /// The same rows with the maps of `plant`, those at a stage's reference; none if a row vanishes there.
    pub(super) fn with_maps_of(&self, plant: &ControlModel, of: &MpcSettings) -> Option<Self> {
        let rows = Self::of_settings(plant, of, RowSelection::All);
        let shape = |rows: &Self| [rows.input.len(), rows.link.len(), rows.soft.len()];
        (shape(&rows) == shape(self)).then_some(rows)
    }

    /// The same without the soft rows that no state within `STATE_REACH` of the reference's own standard deviations of
    /// some state of it reaches. Limits are soft and commanded positions clamped: all that is given up is that a plan
    /// from far away bends around limits that its reference is nowhere near.
    pub(crate) fn near(mut self, reference: &Reference) -> Self {
        let deviation = reference.deviation();
        (self.soft).retain(|row| reference.comes_near(&row.row, row.bound, deviation));
        self
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
        (self.kind, self.joint) == (other.kind, other.joint)
            && self.row.iter().copied().eq(opposite)
    }
}

/// Rows of maps that depend on the state are all kept: which of them matter depends on it too.
pub(super) fn row_selection(plant: &ControlModel, settings: &MpcSettings) -> RowSelection {
    match plant.is_nonlinear() {
        true => RowSelection::All,
        false => settings.rows,
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

/// Rotation that turns a lifted force upright: none is needed for one in world axes.
pub fn to_upright(frame: WrenchFrame, attitude: [f64; 2]) -> [[f64; 3]; 3] {
    let mut rotation = [[0.0; 3]; 3];
    match frame {
        WrenchFrame::Body => write_upright(&attitude, &mut rotation),
        WrenchFrame::World | WrenchFrame::Ground => write_upright(&[0.0; 2], &mut rotation),
    }
    rotation
}

/// Writes the rotation `R_y(pitch) R_x(roll)` from the body frame to an upright frame with the same heading.
fn write_upright(attitude: &[Real], rotation: &mut [[Real; 3]; 3]) {
    let sr = attitude[0].sin();
    let cr = attitude[0].cos();
    let sp = attitude[1].sin();
    let cp = attitude[1].cos();
    let rows: [[Real; 3]; 3] = [
        [cp, sp * sr, sp * cr],
        [0.0, cr, -sr],
        [-sp, cp * sr, cp * cr],
    ];
    *rotation = rows;
}

/// The rows without those that follow from the others to within `margin`, in the same order. Rows are tested from the
/// last to the first, so the first of two equal rows stays. Dropped rows that the remaining ones no longer imply are
/// restored at the end. A row also stays if its linear program is not solved reliably.
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

/// Whether the rows kept, other than `index`, imply it to within `margin`.
fn is_implied(rows: &[Row], is_kept: &[bool], index: usize, margin: f64) -> bool {
    let sizes = rows[index].row.iter().map(|entry| entry.abs());
    let relaxation = sizes.fold(0.0, f64::max).max(1.0) + margin;
    let others = (0..rows.len()).filter(|&other| is_kept[other] && other != index);
    let mut others: Vec<&Row> = others.map(|other| &rows[other]).collect();
    others.push(&rows[index]);
    // The solver's own tolerance must not decide.
    let most = rows[index].bound + margin.max(1e-6 * relaxation);
    maximum(&others, relaxation).is_some_and(|maximum| maximum <= most)
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
