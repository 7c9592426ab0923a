//! How accelerations change with what is changed about a trajectory of the prior.
//!
//! Over one interval between nodes of a jump, with `delta` the difference to the prior at the jump's own goal and a bar
//! the mean of both ends: `delta (dz_(k+1) - dz_k) / h = Xi^T (bar delta z, bar delta dz, bar delta u_lat)`, the very
//! equation that a plan is made of. Ridge on normalised columns. Shifting the robot forwards changes nothing: that
//! direction of `delta z` is left out.

use nalgebra::{DMatrix, DVector};

use super::Sampled;
use super::landmarks::PartNodes;
use crate::model::{FEATURE_DIM, GOAL_DIM, GoalRange, complement};

/// Ridge on the coefficients of the goal's numbers, which have unit variance; the constant is free.
const GOAL_RIDGE: f64 = 3.0;

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
        let ridge = DVector::from_fn(FEATURE_DIM, |k, _| if k == 0 { 0.0 } else { GOAL_RIDGE });
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

/// Ridge relative to the variance of each column.
const RIDGE: f64 = 1e-2;

pub(super) struct Deviations {
    /// `(3 d) x d`.
    pub xi: DMatrix<f64>,
    /// Standard deviation over the jumps of the mean residual, each jump left out of the fit.
    pub acceleration_std: DVector<f64>,
    /// Coefficient of determination of the accelerations' deviations from the prior, over all latent coordinates, each
    /// jump left out of prior and fit; 0 is what the prior alone explains.
    pub ddz_r2: f64,
}

/// Fits the deviations of one part; `translation` is the change of `z` by a shift forwards.
pub(super) fn fit_deviations(
    sampled: &[Sampled],
    goal: &[GoalRange; GOAL_DIM],
    part: usize,
    translation: &DVector<f64>,
) -> Deviations {
    let fit = Fit {
        goal,
        part,
        projector: complement(&DMatrix::from_columns(&[translation.column(0)])),
    };
    let all: Vec<&Sampled> = sampled.iter().collect();
    let d = translation.len();
    let mut square = DVector::zeros(d);
    let (mut unexplained, mut total) = (0.0, 0.0);
    for left_out in 0..sampled.len() {
        let mut others = all.clone();
        others.remove(left_out);
        let prior = fit.prior(&others);
        let xi = fit.xi(&prior, &others);
        let (variables, target) = fit.deviations(&prior, all[left_out]);
        total += target.norm_squared();
        let residual = target - variables * xi;
        unexplained += residual.norm_squared();
        let mean = residual.row_mean().transpose();
        square += mean.component_mul(&mean);
    }
    Deviations {
        xi: fit.xi(&fit.prior(&all), &all),
        acceleration_std: (square / sampled.len() as f64).map(f64::sqrt),
        ddz_r2: 1.0 - unexplained / f64::max(total, f64::MIN_POSITIVE),
    }
}

struct Fit<'a> {
    goal: &'a [GoalRange; GOAL_DIM],
    part: usize,
    projector: DMatrix<f64>,
}

impl Fit<'_> {
    /// Tables of `z`, `dz`, `u_lat` and of mean accelerations over the intervals.
    fn prior(&self, jumps: &[&Sampled]) -> [DMatrix<f64>; 4] {
        let regression = GoalRegression::of(jumps.iter().copied(), self.goal);
        let parts = || jumps.iter().map(|jump| &jump.parts[self.part]);
        let table = |pick: fn(&PartNodes) -> &DMatrix<f64>| regression.table(parts().map(pick));
        let ddz: Vec<_> = parts().map(accelerations).collect();
        [
            table(|nodes| &nodes.z),
            table(|nodes| &nodes.dz),
            table(|nodes| &nodes.u_lat),
            regression.table(&ddz),
        ]
    }

    /// Variables, one row per interval and `3 d` columns, and accelerations of a jump about a prior.
    fn deviations(
        &self,
        [z, dz, u_lat, ddz]: &[DMatrix<f64>; 4],
        jump: &Sampled,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let nodes = &jump.parts[self.part];
        let features = GoalRange::features(self.goal, &jump.goal);
        let at = |table: &DMatrix<f64>| {
            let d = table.ncols() / FEATURE_DIM;
            let blocks = features.iter().enumerate();
            let blocks = blocks.map(|(k, f)| table.columns(k * d, d) * *f);
            blocks.fold(DMatrix::zeros(table.nrows(), d), |sum, block| sum + block)
        };
        let d = nodes.z.ncols();
        let n = nodes.z.nrows() - 1;
        let mut variables = DMatrix::zeros(n, 3 * d);
        let position = (&nodes.z - at(z)) * &self.projector;
        let others = [&nodes.dz - at(dz), &nodes.u_lat - at(u_lat)];
        for (k, delta) in std::iter::once(position).chain(others).enumerate() {
            let mean = (delta.rows(0, n) + delta.rows(1, n)) * 0.5;
            variables.columns_mut(k * d, d).copy_from(&mean);
        }
        (variables, accelerations(nodes) - at(ddz))
    }

    fn xi(&self, prior: &[DMatrix<f64>; 4], jumps: &[&Sampled]) -> DMatrix<f64> {
        let d = self.projector.nrows();
        let (mut gram, mut product) = (DMatrix::zeros(3 * d, 3 * d), DMatrix::zeros(3 * d, d));
        for jump in jumps {
            let (variables, target) = self.deviations(prior, jump);
            gram += variables.tr_mul(&variables);
            product += variables.tr_mul(&target);
        }
        let scale = gram.diagonal().map(|square| square.sqrt());
        let largest = scale.amax().max(f64::MIN_POSITIVE);
        // A direction that never moves keeps a coefficient of zero.
        let inverse = scale.map(|s| if s > 1e-9 * largest { 1.0 / s } else { 0.0 });
        let inverse = DMatrix::from_diagonal(&inverse);
        let normalised = &inverse * gram * &inverse;
        let ridged = normalised + DMatrix::identity(3 * d, 3 * d) * RIDGE;
        let factor = ridged
            .cholesky()
            .expect("invariant: a Gram matrix and a ridge");
        let mut xi = &inverse * factor.solve(&(&inverse * product));
        let positions = &self.projector * xi.rows(0, d);
        xi.rows_mut(0, d).copy_from(&positions);
        xi
    }
}

/// Mean accelerations over the intervals, one row each.
fn accelerations(nodes: &PartNodes) -> DMatrix<f64> {
    let n = nodes.dz.nrows() - 1;
    (nodes.dz.rows(1, n) - nodes.dz.rows(0, n)) / nodes.step_s()
}
