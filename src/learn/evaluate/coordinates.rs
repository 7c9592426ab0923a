//! Rollouts against the recording, coordinate by coordinate, in SI units.

use nalgebra::DVector;

use super::metrics::{Fit, FitSums};
use crate::model::{ModelError, ReducedModel};
use crate::recording::Segment;
use crate::sim::{LatentSegment, Rollout};

/// Sums of residuals of every robot coordinate, over any number of rollouts.
#[derive(Debug, Clone, PartialEq)]
pub struct CoordinateSums {
    sums: Vec<FitSums>,
    by_phase: Vec<Vec<FitSums>>,
    pub windows: usize,
    /// Windows that diverged; their samples after that have no prediction and do not count.
    pub diverged: usize,
}

impl CoordinateSums {
    /// Sums for a model's coordinates, all empty.
    ///
    /// # Errors
    /// [`ModelError::Missing`] for a latent-only model.
    pub fn new(model: &ReducedModel) -> Result<Self, ModelError> {
        let state_dim = model.decoder_map()?.output_dim();
        Ok(Self {
            sums: vec![FitSums::default(); state_dim],
            by_phase: vec![vec![FitSums::default(); state_dim]; model.phases().len()],
            windows: 0,
            diverged: 0,
        })
    }

    /// Decodes a rollout of `segment`, encoded as `latent`, and adds its residuals.
    ///
    /// # Errors
    /// [`ModelError::Missing`] for a latent-only model.
    pub fn add_rollout(
        &mut self,
        model: &ReducedModel,
        segment: &Segment,
        latent: &LatentSegment,
        rollout: &Rollout,
    ) -> Result<(), ModelError> {
        for (sample, window, column) in rollout.predictions() {
            let x = model.decode(&window.z.column(column).into_owned())?;
            self.add(segment, sample, latent.phase[sample], &x);
        }
        self.windows += rollout.windows.len();
        self.diverged += (rollout.windows.iter())
            .filter(|window| window.diverged_at_s.is_some())
            .count();
        Ok(())
    }

    /// Adds the residuals of a robot that keeps the recorded velocity at the start of each window, over the samples that
    /// `rollout` predicts.
    pub(super) fn add_constant_velocity(
        &mut self,
        segment: &Segment,
        latent: &LatentSegment,
        rollout: &Rollout,
    ) {
        for (sample, window, _) in rollout.predictions() {
            let start = window.samples.start;
            let elapsed_s = segment.time_s[sample] - segment.time_s[start];
            let x = segment.x.column(start) + segment.dx.column(start) * elapsed_s;
            self.add(segment, sample, latent.phase[sample], &x);
        }
        self.windows += rollout.windows.len();
    }

    fn add(&mut self, segment: &Segment, sample: usize, phase: usize, x: &DVector<f64>) {
        let sums = self.sums.iter_mut().zip(&mut self.by_phase[phase]);
        let recorded = segment.x.column(sample);
        for (((sums, of_phase), &y), &y_hat) in sums.zip(recorded.iter()).zip(x) {
            sums.add(y, y_hat);
            of_phase.add(y, y_hat);
        }
    }

    /// Fit of each coordinate, in the order of the state; `None` before the first sample.
    pub fn fits(&self) -> Vec<Option<Fit>> {
        self.sums.iter().map(FitSums::fit).collect()
    }

    /// Fit of each coordinate over the samples of one phase.
    ///
    /// # Panics
    /// If the model has no such phase.
    pub fn phase_fits(&self, phase: usize) -> Vec<Option<Fit>> {
        self.by_phase[phase].iter().map(FitSums::fit).collect()
    }
}

/// How well the model's pieces do on one recorded segment, without integrating anything.
#[derive(Debug, Clone, PartialEq)]
pub struct PointwiseSums {
    /// Residuals of `decode(encode(x))`, all coordinates in scaled units (equation 16).
    pub decoder: FitSums,
    /// Residuals of predicted latent accelerations (equation 17), one a phase.
    pub acceleration: Vec<FitSums>,
}

impl PointwiseSums {
    pub fn new(model: &ReducedModel) -> Self {
        Self {
            decoder: FitSums::default(),
            acceleration: vec![FitSums::default(); model.phases().len()],
        }
    }

    /// Adds a segment.
    ///
    /// # Errors
    /// [`ModelError::Missing`] for a latent-only model.
    pub fn add(
        &mut self,
        model: &ReducedModel,
        segment: &Segment,
        latent: &LatentSegment,
    ) -> Result<(), ModelError> {
        let factors = model.state_factors()?;
        let mut accelerations =
            vec![vec![FitSums::default(); model.latent_dim()]; self.acceleration.len()];
        for sample in 0..latent.len() {
            let column = |matrix: &nalgebra::DMatrix<f64>| matrix.column(sample).into_owned();
            let (x, z) = (column(&segment.x), column(&latent.z));
            let scaled = x.component_mul(&factors);
            let decoded = model.decode(&z)?.component_mul(&factors);
            for (&y, &y_hat) in scaled.iter().zip(&decoded) {
                self.decoder.add(y, y_hat);
            }
            let phase = latent.phase[sample];
            let ddz = model.ddz(phase, &z, &column(&latent.dz), &column(&latent.u_lat))?;
            for (output, sums) in accelerations[phase].iter_mut().enumerate() {
                sums.add(latent.ddz[(output, sample)], ddz[output]);
            }
        }
        for (total, outputs) in self.acceleration.iter_mut().zip(&accelerations) {
            outputs
                .iter()
                .for_each(|sums| total.merge_keeping_means(sums));
        }
        Ok(())
    }
}
