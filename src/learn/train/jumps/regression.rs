//! Ridge regression over the goals of the jumps.

use nalgebra::{DMatrix, DVector};

use super::Sampled;
use crate::model::{FEATURE_DIM, GOAL_DIM, GoalRange};

/// Ridge on the coefficients of the goal's numbers, which have unit variance; the constant is free.
const RIDGE: f64 = 3.0;

/// The linear map from the values of all jumps to the coefficients of the features.
pub(super) struct GoalRegression {
    /// `FEATURE_DIM x jumps`.
    solution: DMatrix<f64>,
}

impl GoalRegression {
    pub(super) fn of<'a>(
        jumps: impl IntoIterator<Item = &'a Sampled>,
        goal: &[GoalRange; GOAL_DIM],
    ) -> Self {
        let features = |jump: &Sampled| GoalRange::features(goal, &jump.goal).to_vec().into();
        let columns: Vec<DVector<f64>> = jumps.into_iter().map(features).collect();
        let phi = DMatrix::from_columns(&columns);
        let ridge = DVector::from_fn(FEATURE_DIM, |k, _| if k == 0 { 0.0 } else { RIDGE });
        let gram = &phi * phi.transpose() + DMatrix::from_diagonal(&ridge);
        let factor = gram.cholesky().expect("invariant: a constant and a ridge");
        Self {
            solution: factor.solve(&phi),
        }
    }

    pub(super) fn numbers(&self, values: &[f64]) -> [f64; FEATURE_DIM] {
        let fitted = &self.solution * DVector::from_column_slice(values);
        std::array::from_fn(|k| fitted[k])
    }

    /// Coefficients of one table per jump, `n x d` each: `n x (FEATURE_DIM d)`.
    pub(super) fn table<'a>(
        &self,
        values: impl IntoIterator<Item = &'a DMatrix<f64>>,
    ) -> DMatrix<f64> {
        let values: Vec<_> = values.into_iter().collect();
        let (n, d) = values[0].shape();
        let mut table = DMatrix::zeros(n, FEATURE_DIM * d);
        for k in 0..FEATURE_DIM {
            let mut block = table.columns_mut(k * d, d);
            for (jump, value) in values.iter().enumerate() {
                block += *value * self.solution[(k, jump)];
            }
        }
        table
    }
}
