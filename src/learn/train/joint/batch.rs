//! Batches of consecutive samples.

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
}

impl Batch {
    pub(super) fn samples(&self) -> usize {
        self.x.nrows()
    }

    /// Entries uniform in `-bound .. bound`, 2 ms apart.
    #[cfg(test)]
    pub(super) fn random(
        phase: usize,
        (samples, state_dim): (usize, usize),
        bound: f64,
        random: &mut crate::train::random::Random,
    ) -> Self {
        let mut block = || random.matrix(samples, state_dim, bound);
        let [x, dx, ddx, u] = std::array::from_fn(|_| block());
        let step_s = 0.002;
        Self {
            phase,
            x,
            dx,
            ddx,
            u,
            step_s,
        }
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
                out.push(Batch {
                    phase: span.phase,
                    x: cut(&x),
                    dx: cut(&dx),
                    ddx: cut(&ddx),
                    u: cut(&u),
                    step_s: samples.mean_step_s(),
                });
            }
        }
    }
    Ok(out)
}
