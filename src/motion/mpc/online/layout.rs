//! Which unknown and which row of the solver's program stands where.
//!
//! Unknowns of stage `k`, one stage after the other: the input `û_k`, the state `x̂_{k+1}` it leads
//! to and, if any joint row is left, its slack `s_{k+1}`. Rows: the dynamics of all stages (zero
//! cone), then torque, rate, joint and slack rows stage by stage (nonnegative), then one
//! second-order cone a stage if friction of the body force is constrained.

use super::problem::StageRows;

/// Columns of the unknowns and numbers of the rows.
#[derive(Debug, Clone)]
pub struct Layout {
    /// Latent dimension `d`.
    pub latent_dim: usize,
    /// Number of stages.
    pub horizon: usize,
    /// Rows of each stage.
    pub rows: StageRows,
    /// Whether stages have a slack.
    pub has_slack: bool,
}

impl Layout {
    /// The layout of a problem.
    pub fn new(latent_dim: usize, horizon: usize, rows: StageRows) -> Self {
        Self {
            latent_dim,
            horizon,
            has_slack: !rows.joint.is_empty(),
            rows,
        }
    }

    /// Unknowns of one stage.
    pub fn stage_width(&self) -> usize {
        3 * self.latent_dim + usize::from(self.has_slack)
    }

    /// Unknowns of all stages.
    pub fn variables(&self) -> usize {
        self.horizon * self.stage_width()
    }

    /// First column of `û_stage`.
    pub fn input_column(&self, stage: usize) -> usize {
        stage * self.stage_width()
    }

    /// First column of `x̂_{stage+1}`.
    pub fn state_column(&self, stage: usize) -> usize {
        self.input_column(stage) + self.latent_dim
    }

    /// Column of `s_{stage+1}`.
    pub fn slack_column(&self, stage: usize) -> usize {
        self.input_column(stage) + 3 * self.latent_dim
    }

    /// Nonnegative rows of one stage.
    pub fn inequality_dim(&self) -> usize {
        self.rows.torque.len()
            + self.rows.rate.len()
            + self.rows.joint.len()
            + usize::from(self.has_slack)
    }

    /// First row of a stage's dynamics.
    pub fn dynamics_row(&self, stage: usize) -> usize {
        stage * 2 * self.latent_dim
    }

    /// First torque row of a stage.
    pub fn torque_row(&self, stage: usize) -> usize {
        2 * self.latent_dim * self.horizon + stage * self.inequality_dim()
    }

    /// First rate row of a stage.
    pub fn rate_row(&self, stage: usize) -> usize {
        self.torque_row(stage) + self.rows.torque.len()
    }

    /// First joint row of a stage.
    pub fn joint_row(&self, stage: usize) -> usize {
        self.rate_row(stage) + self.rows.rate.len()
    }

    /// Row that keeps a stage's slack nonnegative.
    pub fn slack_row(&self, stage: usize) -> usize {
        self.joint_row(stage) + self.rows.joint.len()
    }

    /// First row of a stage's friction cone.
    pub fn force_row(&self, stage: usize) -> usize {
        self.torque_row(self.horizon) + 3 * stage
    }

    /// Rows of all stages.
    pub fn row_count(&self) -> usize {
        self.force_row(self.rows.friction.as_ref().map_or(0, |_| self.horizon))
    }

    /// The dense blocks of a stage, row by row: dynamics by its input and by the state before; torque
    /// rows by the input; rate rows by the input and by the one before; joint rows by the state; cone rows
    /// by the input. What is by the stage before is empty for the first.
    pub fn blocks(&self, stage: usize) -> [Vec<(usize, usize)>; 7] {
        let (d, rows) = (self.latent_dim, &self.rows);
        let [torques, rates, joints] = [&rows.torque, &rows.rate, &rows.joint].map(Vec::len);
        let forces = rows.friction.as_ref().map_or(0, |_| 3);
        let (input, dynamics) = (self.input_column(stage), self.dynamics_row(stage));
        let rate = self.rate_row(stage);
        let [by_state, by_input_before] = match stage.checked_sub(1) {
            None => [Vec::new(), Vec::new()],
            Some(before) => [
                block(dynamics, 2 * d, self.state_column(before), 2 * d),
                block(rate, rates, self.input_column(before), d),
            ],
        };
        // In the order of the fields of `StagePositions`.
        [
            block(dynamics, 2 * d, input, d),
            by_state,
            block(self.torque_row(stage), torques, input, d),
            block(rate, rates, input, d),
            by_input_before,
            block(self.joint_row(stage), joints, self.state_column(stage), d),
            block(self.force_row(stage), forces, input, d),
        ]
    }

    /// Entries that are -1 at all times: the state that a stage leads to, and its slack.
    pub fn constants(&self, stage: usize) -> Vec<(usize, usize)> {
        let (row, column) = (self.dynamics_row(stage), self.state_column(stage));
        let states = (0..2 * self.latent_dim).map(|index| (row + index, column + index));
        let slacked = self.joint_row(stage)..=self.slack_row(stage);
        let slacks = slacked.filter(|_| self.has_slack);
        states
            .chain(slacks.map(|row| (row, self.slack_column(stage))))
            .collect()
    }
}

/// The entries of a dense block.
fn block(row: usize, n_rows: usize, col: usize, n_cols: usize) -> Vec<(usize, usize)> {
    let columns = col..col + n_cols;
    let rows = (row..row + n_rows).flat_map(|row| columns.clone().map(move |col| (row, col)));
    rows.collect()
}
