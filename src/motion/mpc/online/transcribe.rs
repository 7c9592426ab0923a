//! From the optimal control problem to the solver's matrices, whose pattern is fixed once.
//!
//! [`layout`](super::layout) says what stands where; [`Transcription::write`] overwrites values only,
//! through positions that were looked up at construction.

use nalgebra::DMatrix;

use super::control_model::ControlPhase;
use super::layout::Layout;
use super::linearise::StageModel;
use super::problem::{Row, StageRows};
use super::qp::{Cone, ConeProgram, dot};
use super::settings::MpcSettings;
use super::sparse::SparseColumns;
use crate::robot::JOINT_DIM;

/// Price of a slack in the program; the whole cost is scaled to it. The solver starts with all
/// multipliers near one and needs two iterations more if it has to bring them to 100.
pub const SLACK_PRICE: f64 = 10.0;

/// One stage as the transcription sees it, in latent units.
#[derive(Debug, Clone)]
pub struct Stage {
    /// Linearised dynamics.
    pub model: StageModel,
    /// `F̄ + A (x_r − x̄) + B (u_r − ū) + e − x_r⁺`: what is left of the dynamics at the reference.
    pub defect: Vec<f64>,
    /// Reference state at the stage's beginning, `2 latent_dim`.
    pub state: Vec<f64>,
    /// Reference input over the stage, `latent_dim`.
    pub input: Vec<f64>,
    /// Phase of the stage.
    pub phase: usize,
    /// What the joints take along the reference, N m.
    pub losses_nm: [f64; JOINT_DIM],
    /// Friction cone rows `(μ F_z, F_x, F_y) / weight`, `3 × latent_dim` row-major; zero in flight.
    pub force: Vec<f64>,
    /// Rows of this stage, as many as the program has, where they are not the same at all stages.
    pub rows: Option<StageRows>,
}

impl Stage {
    /// A stage of zeros.
    pub fn zeros(latent_dim: usize) -> Self {
        Self {
            model: StageModel::zeros(latent_dim),
            defect: vec![0.0; 2 * latent_dim],
            state: vec![0.0; 2 * latent_dim],
            input: vec![0.0; latent_dim],
            phase: 0,
            losses_nm: [0.0; JOINT_DIM],
            force: vec![0.0; 3 * latent_dim],
            rows: None,
        }
    }
}

/// What else a step needs to know.
#[derive(Debug, Clone, Copy)]
pub struct StepData<'a> {
    /// The stages of the horizon.
    pub stages: &'a [Stage],
    /// Reference positions at the end of the last stage, `latent_dim`.
    pub last_position: &'a [f64],
    /// Measured latent state, `2 latent_dim`.
    pub measured: &'a [f64],
    /// Latent input of the command before, `latent_dim`.
    pub last_input: &'a [f64],
    /// Scale `σ` of the states, `2 latent_dim`.
    pub deviation: &'a [f64],
    /// The model's phases, whose `latent_root` is the scale `C_p` of their inputs.
    pub phases: &'a [ControlPhase],
}

/// Positions of one stage's entries in the values of `A`.
#[derive(Debug, Clone)]
struct StagePositions {
    /// `B̂`, `2d × d` row-major.
    input: Vec<usize>,
    /// `Â`, `2d × 2d` row-major; empty at stage 0.
    state: Vec<usize>,
    /// Torque rows by `û_k`, row-major.
    torque: Vec<usize>,
    /// Rate rows by `û_k`, then by `û_{k-1}` (absent at stage 0).
    rate: Vec<usize>,
    rate_before: Vec<usize>,
    /// Joint rows by the positions of `x̂_{k+1}`.
    joint: Vec<usize>,
    /// Cone rows by `û_k`.
    force: Vec<usize>,
}

impl StagePositions {
    /// Takes [`Layout::blocks`], whose order is that of the fields.
    fn of(blocks: [Vec<(usize, usize)>; 7], a: &SparseColumns) -> Self {
        let [input, state, torque, rate, rate_before, joint, force] = blocks.map(|block| {
            let positions = block.into_iter().map(|(row, col)| a.position(row, col));
            positions
                .map(|position| position.expect("block belongs to the pattern"))
                .collect()
        });
        Self {
            input,
            state,
            torque,
            rate,
            rate_before,
            joint,
            force,
        }
    }
}

/// Where each number of a step goes.
#[derive(Debug, Clone)]
pub struct Transcription {
    layout: Layout,
    positions: Vec<StagePositions>,
}

impl Transcription {
    /// Lays out a problem; returns it with the program that its steps will fill.
    pub fn new(latent_dim: usize, horizon: usize, rows: StageRows) -> (Self, ConeProgram) {
        let layout = Layout::new(latent_dim, horizon, rows);
        let (n, m) = (layout.variables(), layout.row_count());
        let constants: Vec<_> = (0..horizon)
            .flat_map(|stage| layout.constants(stage))
            .collect();
        let blocks: Vec<_> = (0..horizon).map(|stage| layout.blocks(stage)).collect();
        let entries = blocks.iter().flatten().flatten().chain(&constants);
        let mut a = SparseColumns::from_pattern(m, n, &entries.copied().collect::<Vec<_>>());
        for &(row, col) in &constants {
            a.set(row, col, -1.0);
        }
        let positions = (blocks.into_iter()).map(|blocks| StagePositions::of(blocks, &a));
        let positions = positions.collect();
        let diagonal: Vec<(usize, usize)> = (0..n).map(|index| (index, index)).collect();
        let mut cones = vec![
            Cone::Zero(2 * latent_dim * horizon),
            Cone::Nonnegative(layout.inequality_dim() * horizon),
        ];
        if layout.rows.friction.is_some() {
            cones.extend(std::iter::repeat_n(Cone::SecondOrder(3), horizon));
        }
        cones.retain(|cone| cone.dim() > 0);
        let program = ConeProgram {
            p: SparseColumns::from_pattern(n, n, &diagonal),
            q: vec![0.0; n],
            a,
            b: vec![0.0; m],
            cones,
        };
        let transcription = Self { layout, positions };
        (transcription, program)
    }

    /// Writes the cost, which does not change from step to step; `state` are the weights of the scaled states,
    /// `2 latent_dim`.
    pub fn write_cost(&self, state: &[f64], settings: &MpcSettings, program: &mut ConeProgram) {
        let d = self.layout.latent_dim;
        let scale = SLACK_PRICE / settings.joint_penalty;
        for stage in 0..self.layout.horizon {
            let factor = match stage + 1 == self.layout.horizon {
                true => scale * settings.terminal_weight,
                false => scale,
            };
            let first = self.layout.input_column(stage);
            for input in first..first + d {
                program.p.set(input, input, scale * settings.input_weight);
            }
            let first = self.layout.state_column(stage);
            for (column, weight) in (first..first + 2 * d).zip(state) {
                program.p.set(column, column, factor * weight);
            }
            if self.layout.has_slack {
                program.q[self.layout.slack_column(stage)] = SLACK_PRICE;
            }
        }
    }

    /// Writes a step's values.
    pub fn write(&self, step: &StepData<'_>, program: &mut ConeProgram) {
        for index in 0..self.layout.horizon {
            self.write_dynamics(index, step, program);
            self.write_inputs(index, step, program);
            self.write_joints(index, step, program);
        }
    }

    /// `û` of a stage in a solution, and `x̂⁺` at its end.
    pub fn stage<'a>(&self, index: usize, solution: &'a [f64]) -> (&'a [f64], &'a [f64]) {
        let d = self.layout.latent_dim;
        solution[self.layout.input_column(index)..][..3 * d].split_at(d)
    }

    /// `Â x̂_k + B̂ û_k − x̂_{k+1} = −σ⁻¹ defect`, with `x̂_0` on the right.
    fn write_dynamics(&self, index: usize, step: &StepData<'_>, program: &mut ConeProgram) {
        let (d, stage) = (self.layout.latent_dim, &step.stages[index]);
        let positions = &self.positions[index];
        let (root, deviation) = (&step.phases[stage.phase].latent_root, step.deviation);
        let values = program.a.values_mut();
        for row in 0..2 * d {
            let scale = 1.0 / deviation[row];
            for col in 0..d {
                let terms = (col..d).map(|k| stage.model.b[(row, k)] * root[(k, col)]);
                values[positions.input[row * d + col]] = scale * terms.sum::<f64>();
            }
            let mut right = -scale * stage.defect[row];
            for col in 0..2 * d {
                let entry = scale * stage.model.a[(row, col)];
                if index == 0 {
                    right -= entry * (step.measured[col] - stage.state[col]);
                } else {
                    values[positions.state[row * 2 * d + col]] = entry * deviation[col];
                }
            }
            program.b[self.layout.dynamics_row(index) + row] = right;
        }
    }

    /// Torque, rate and friction rows.
    fn write_inputs(&self, index: usize, step: &StepData<'_>, program: &mut ConeProgram) {
        let d = self.layout.latent_dim;
        let stage = &step.stages[index];
        let root = &step.phases[stage.phase].latent_root;
        let scale = (root, &stage.input[..]);
        let rows = stage.rows.as_ref().unwrap_or(&self.layout.rows);
        let values = program.a.values_mut();
        for (number, row) in rows.torque.iter().enumerate() {
            let positions = &self.positions[index].torque[number * d..][..d];
            let at_reference = place_row(&row.row, scale, 1.0, positions, values);
            let bound = row.bound - row.per_loss * stage.losses_nm[row.joint];
            program.b[self.layout.torque_row(index) + number] = bound - at_reference;
        }
        for (number, row) in rows.rate.iter().enumerate() {
            let positions = &self.positions[index].rate[number * d..][..d];
            let at_reference = place_row(&row.row, scale, 1.0, positions, values);
            let before = if index == 0 {
                dot(&row.row, step.last_input)
            } else {
                let earlier = &step.stages[index - 1];
                let rows = earlier.rows.as_ref().unwrap_or(&self.layout.rows);
                let (row, root) = (
                    &rows.rate[number].row,
                    &step.phases[earlier.phase].latent_root,
                );
                let positions = &self.positions[index].rate_before[number * d..][..d];
                place_row(row, (root, &earlier.input), -1.0, positions, values)
            };
            program.b[self.layout.rate_row(index) + number] = row.bound - at_reference + before;
        }
        if self.layout.rows.friction.is_some() {
            for number in 0..3 {
                let positions = &self.positions[index].force[number * d..][..d];
                let row = &stage.force[number * d..][..d];
                let at_reference = place_row(row, scale, -1.0, positions, values);
                // A stage without contact has the cone's axis as its slack: strictly inside.
                let is_free = number == 0 && stage.force.iter().all(|entry| *entry == 0.0);
                program.b[self.layout.force_row(index) + number] =
                    if is_free { 1.0 } else { at_reference };
            }
        }
    }

    /// `D_i σ ẑ − s ≤ bound − D_i z_r`, at the end of the stage.
    fn write_joints(&self, index: usize, step: &StepData<'_>, program: &mut ConeProgram) {
        let d = self.layout.latent_dim;
        let reference = match step.stages.get(index + 1) {
            Some(next) => &next.state[..d],
            None => step.last_position,
        };
        let rows = (step.stages[index].rows.as_ref()).unwrap_or(&self.layout.rows);
        for (number, Row { row, bound, .. }) in rows.joint.iter().enumerate() {
            let positions = &self.positions[index].joint[number * d..][..d];
            for (col, &position) in positions.iter().enumerate() {
                program.a.values_mut()[position] = row[col] * step.deviation[col];
            }
            program.b[self.layout.joint_row(index) + number] = bound - dot(row, reference);
        }
    }
}

/// Writes `sign row C` for a lower triangular `C` to its positions; returns `row · input`.
fn place_row(
    row: &[f64],
    (root, input): (&DMatrix<f64>, &[f64]),
    sign: f64,
    positions: &[usize],
    values: &mut [f64],
) -> f64 {
    for (col, &position) in positions.iter().enumerate() {
        let terms = (col..row.len()).map(|k| row[k] * root[(k, col)]);
        values[position] = sign * terms.sum::<f64>();
    }
    dot(row, input)
}
