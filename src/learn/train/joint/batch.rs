//! Batches of consecutive samples.

use super::parameters::Frame;
use super::*;
use crate::recording::preprocess::{BATCH_ROWS, moving_average, prepare};
use crate::train::dataset::scaled;

/// Consecutive samples of one phase, rows are samples, scaled units.
pub(super) struct Batch {
    pub phase: usize,
    pub entering: DMatrix<f64>, // x, dx, ddx as they enter the encoder, 3n x 18
    pub x: DMatrix<f64>,
    pub ddx: DMatrix<f64>,
    pub u: DMatrix<f64>,
    pub step_s: f64,
}

impl Batch {
    pub(super) fn new(
        phase: usize,
        [x, dx, ddx, u]: [DMatrix<f64>; 4],
        step_s: f64,
        frame: &Frame,
    ) -> Self {
        Self {
            phase,
            entering: frame.enter([&x, &dx, &ddx]),
            x,
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
    frame: &Frame,
) -> Result<Vec<Batch>> {
    let mut out = Vec::new();
    let state = |columns| scaled(columns, &dataset.scaling.state).transpose();
    for recording in recordings {
        for (span, samples) in prepare(recording, &dataset.phases)? {
            let u = scaled(samples.input(&dataset.rule)?, &dataset.scaling.input).transpose();
            let ddx = state(moving_average(&samples.ddx, dataset.smoothing));
            let all = [state(samples.x.clone()), state(samples.dx.clone()), ddx, u];
            for start in (0..samples.len()).step_by(BATCH_ROWS) {
                let cut = all
                    .each_ref()
                    .map(|rows| rows.rows(start, BATCH_ROWS).into_owned());
                out.push(Batch::new(span.phase, cut, samples.mean_step_s(), frame));
            }
        }
    }
    Ok(out)
}
