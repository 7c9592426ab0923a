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

    /// Every entry of `A` that may be nonzero, as (row, column).
    pub fn pattern(&self) -> Vec<(usize, usize)> {
        let (d, rows) = (self.latent_dim, &self.rows);
        let [torques, rates, joints] = [&rows.torque, &rows.rate, &rows.joint].map(Vec::len);
        let mut entries = Vec::new();
        for stage in 0..self.horizon {
            let (input, state) = (self.input_column(stage), self.state_column(stage));
            let (dynamics, rate) = (self.dynamics_row(stage), self.rate_row(stage));
            entries.extend(block(dynamics, 2 * d, input, d));
            entries.extend((0..2 * d).map(|index| (dynamics + index, state + index)));
            if stage > 0 {
                let (input, state) = (self.input_column(stage - 1), self.state_column(stage - 1));
                entries.extend(block(dynamics, 2 * d, state, 2 * d));
                entries.extend(block(rate, rates, input, d));
            }
            entries.extend(block(self.torque_row(stage), torques, input, d));
            entries.extend(block(rate, rates, input, d));
            entries.extend(block(self.joint_row(stage), joints, state, d));
            if self.has_slack {
                let slack = self.slack_column(stage);
                let slacked = self.joint_row(stage)..=self.slack_row(stage);
                entries.extend(slacked.map(|row| (row, slack)));
            }
            if self.rows.friction.is_some() {
                entries.extend(block(self.force_row(stage), 3, input, d));
            }
        }
        entries
    }
}

/// The entries of a dense block.
pub fn block(
    row: usize,
    n_rows: usize,
    col: usize,
    n_cols: usize,
) -> impl Iterator<Item = (usize, usize)> {
    (row..row + n_rows).flat_map(move |row| (col..col + n_cols).map(move |col| (row, col)))
}
