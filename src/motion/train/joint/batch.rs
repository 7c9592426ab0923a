//! Batches of consecutive samples, with what the losses need of them computed once.

use nalgebra::{DMatrix, DVector};

use crate::recording::preprocess::prepare;
use crate::recording::{PhaseRule, Source};
use crate::robot::InputRule;
use crate::train::dataset::Scaling;
use crate::train::error::TrainError;
use crate::train::smooth::moving_average;

/// Consecutive samples of one phase, rows are samples, scaled units.
#[derive(Clone, Debug)]
pub struct Batch {
    /// Phase of all its samples.
    pub phase: usize,
    /// States, `n x 18`.
    pub x: DMatrix<f64>,
    /// Velocities, `n x 18`.
    pub dx: DMatrix<f64>,
    /// Accelerations, `n x 18`.
    pub ddx: DMatrix<f64>,
    /// Inputs, `n x 18`.
    pub u: DMatrix<f64>,
    /// Time between samples.
    pub step_s: f64,
    /// `[x, 1]^T [x, 1] / n`, `19 x 19`.
    pub state_moment: DMatrix<f64>,
    /// `u^T u`, `18 x 18`.
    pub input_moment: DMatrix<f64>,
    /// Sum of squares of `ddx`.
    pub ddx_energy: f64,
}

impl Batch {
    /// A batch of samples in rows.
    pub fn new(phase: usize, [x, dx, ddx, u]: [DMatrix<f64>; 4], step_s: f64) -> Self {
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

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.x.nrows()
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }
}

/// How recordings become batches.
#[derive(Clone, Debug)]
pub struct BatchOptions<'a> {
    /// Which foot patterns form which phase.
    pub phases: &'a PhaseRule,
    /// Factors from SI to scaled units.
    pub scaling: &'a Scaling,
    /// Rows of a batch; every phase of a jump is resampled to a multiple (section IV-C4).
    pub rows: usize,
    /// Window of the moving average over accelerations, 1 for none.
    pub smoothing: usize,
}

/// Batches of all phases of all recordings, in their order.
///
/// # Errors
/// [`TrainError::Recording`] for what cannot be resampled or turned into inputs.
pub fn batches(
    recordings: &Source<'_>,
    rule: &InputRule,
    options: &BatchOptions<'_>,
) -> Result<Vec<Batch>, TrainError> {
    let mut out = Vec::new();
    recordings.for_each(|recording| {
        for part in prepare(recording, options.phases, options.rows)? {
            let samples = &part.samples;
            let u = rows(&samples.input(rule)?, &options.scaling.input);
            let x = rows(&samples.x, &options.scaling.state);
            let dx = rows(&samples.dx, &options.scaling.state);
            let smooth = moving_average(&samples.ddx, options.smoothing);
            let ddx = rows(&smooth, &options.scaling.state);
            for start in (0..samples.len()).step_by(options.rows) {
                let cut = |all: &DMatrix<f64>| all.rows(start, options.rows).into_owned();
                let blocks = [cut(&x), cut(&dx), cut(&ddx), cut(&u)];
                out.push(Batch::new(part.span.phase, blocks, samples.mean_step_s()));
            }
        }
        Ok::<_, TrainError>(())
    })?;
    Ok(out)
}

/// Samples as rows, every coordinate times its factor.
fn rows(columns: &DMatrix<f64>, factors: &DVector<f64>) -> DMatrix<f64> {
    let mut transposed = columns.transpose();
    for (mut column, factor) in transposed.column_iter_mut().zip(factors.iter()) {
        column *= *factor;
    }
    transposed
}
