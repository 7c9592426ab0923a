//! Epochs of a transfer step, and the coefficients that sequential thresholding leaves.

use nalgebra::DMatrix;

use super::adam::Adam;
use super::loss::LossWeights;

#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    /// Epochs with the L1 term and thresholding.
    pub epochs: usize,
    /// Epochs of refinement: no L1 term, no thresholding, the mask stays.
    pub refinement: usize,
    /// Coefficients below this are masked for good.
    pub threshold: f64,
    /// Epochs between two thresholdings.
    pub threshold_every: usize,
    pub learning_rate: f64,
}

impl Default for Schedule {
    fn default() -> Self {
        Self {
            epochs: 501,
            refinement: 101,
            threshold: 0.01,
            threshold_every: 100,
            learning_rate: 1e-3,
        }
    }
}

impl Schedule {
    pub fn total(&self) -> usize {
        self.epochs + self.refinement
    }

    /// The loss weights in an epoch: refinement has no L1 term.
    pub(super) fn weights_at(&self, epoch: usize, weights: LossWeights) -> LossWeights {
        let refining = epoch >= self.epochs;
        LossWeights {
            l1: if refining { 0.0 } else { weights.l1 },
            ..weights
        }
    }

    fn thresholds_at(&self, epoch: usize) -> bool {
        epoch > 0
            && epoch < self.epochs
            && self.threshold_every > 0
            && epoch.is_multiple_of(self.threshold_every)
    }
}

/// Adam on the coefficients of a phase, with the mask of sequential thresholding: what is dropped once stays
/// zero.
pub(super) struct MaskedAdam {
    optimiser: Adam,
    support: DMatrix<bool>,
}

impl MaskedAdam {
    pub fn new(xi: &DMatrix<f64>, schedule: &Schedule) -> Self {
        Self {
            optimiser: Adam::new(xi.len(), schedule.learning_rate),
            support: xi.map(|_| true),
        }
    }

    /// Masks what has become small, in epochs that the schedule has for it.
    pub fn start_epoch(&mut self, epoch: usize, schedule: &Schedule, xi: &mut DMatrix<f64>) {
        if schedule.thresholds_at(epoch) {
            for (value, kept) in xi.iter().zip(self.support.iter_mut()) {
                *kept &= value.abs() >= schedule.threshold;
            }
            self.apply(xi);
        }
    }

    pub fn step(&mut self, xi: &mut DMatrix<f64>, gradient: &DMatrix<f64>) {
        self.optimiser.step(xi.as_mut_slice(), gradient.as_slice());
        self.apply(xi);
    }

    pub fn active(&self) -> usize {
        self.support.iter().filter(|kept| **kept).count()
    }

    fn apply(&self, xi: &mut DMatrix<f64>) {
        xi.iter_mut()
            .zip(self.support.iter())
            .filter(|(_, kept)| !**kept)
            .for_each(|(value, _)| *value = 0.0);
    }
}
