//! Batches of consecutive samples, with what the losses need of them computed once.

use nalgebra::DMatrix;

use crate::recording::Recording;
use crate::recording::preprocess::{BATCH_ROWS, prepare};
use crate::recording::smoothing::moving_average;
use crate::train::dataset::{Dataset, scaled};
use crate::train::error::TrainError;

/// Consecutive samples of one phase, rows are samples, scaled units.
#[derive(Clone, Debug)]
pub(super) struct Batch {
    pub phase: usize,
    /// States, `n x 18`.
    pub x: DMatrix<f64>,
    /// Velocities, `n x 18`.
    pub dx: DMatrix<f64>,
    /// Accelerations, `n x 18`.
    pub ddx: DMatrix<f64>,
    /// Inputs, `n x 18`.
    pub u: DMatrix<f64>,
    pub step_s: f64,
    /// `[x, 1]^T [x, 1] / n`, `19 x 19`.
    pub state_moment: DMatrix<f64>,
    /// `u^T u`, `18 x 18`.
    pub input_moment: DMatrix<f64>,
    /// Sum of squares of `ddx`.
    pub ddx_energy: f64,
}

impl Batch {
    pub(super) fn new(phase: usize, [x, dx, ddx, u]: [DMatrix<f64>; 4], step_s: f64) -> Self {
        let n = x.nrows();
        let extended = x.clone().insert_column(x.ncols(), 1.0);
        Self {
            phase,
            state_moment: extended.tr_mul(&extended) / n as f64,
            input_moment: u.tr_mul(&u),
            ddx_energy: ddx.norm_squared(),
            x,
            dx,
            ddx,
            u,
            step_s,
        }
    }

    pub(super) fn samples(&self) -> usize {
        self.x.nrows()
    }
}

/// Batches of all phases of all recordings, in their order, with the phases, inputs, units and smoothing of `dataset`.
pub(super) fn batches(
    recordings: &[Recording],
    dataset: &Dataset,
) -> Result<Vec<Batch>, TrainError> {
    let mut out = Vec::new();
    let state = |columns| scaled(columns, &dataset.scaling.state).transpose();
    for recording in recordings {
        for (span, samples) in prepare(recording, &dataset.phases)? {
            let u = scaled(samples.input(&dataset.rule)?, &dataset.scaling.input).transpose();
            let (x, dx) = (state(samples.x.clone()), state(samples.dx.clone()));
            let ddx = state(moving_average(&samples.ddx, dataset.smoothing));
            for start in (0..samples.len()).step_by(BATCH_ROWS) {
                let cut = |all: &DMatrix<f64>| all.rows(start, BATCH_ROWS).into_owned();
                let blocks = [cut(&x), cut(&dx), cut(&ddx), cut(&u)];
                out.push(Batch::new(span.phase, blocks, samples.mean_step_s()));
            }
        }
    }
    Ok(out)
}
