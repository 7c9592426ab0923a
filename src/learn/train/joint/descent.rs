//! Descent by Adam: epochs of a transfer step, the optimiser, and the coefficients that sequential thresholding leaves.

use nalgebra::DMatrix;

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
    pub(super) fn new(xi: &DMatrix<f64>, schedule: &Schedule) -> Self {
        Self {
            optimiser: Adam::new(xi.len(), schedule.learning_rate),
            support: xi.map(|_| true),
        }
    }

    /// Masks what has become small, in epochs that the schedule has for it.
    pub(super) fn start_epoch(&mut self, epoch: usize, schedule: &Schedule, xi: &mut DMatrix<f64>) {
        if schedule.thresholds_at(epoch) {
            for (value, kept) in xi.iter().zip(self.support.iter_mut()) {
                *kept &= value.abs() >= schedule.threshold;
            }
            self.apply(xi);
        }
    }

    pub(super) fn step(&mut self, xi: &mut DMatrix<f64>, gradient: &DMatrix<f64>) {
        self.optimiser.step(xi.as_mut_slice(), gradient.as_slice());
        self.apply(xi);
    }

    pub(super) fn active(&self) -> usize {
        self.support.iter().filter(|kept| **kept).count()
    }

    fn apply(&self, xi: &mut DMatrix<f64>) {
        xi.iter_mut()
            .zip(self.support.iter())
            .filter(|(_, kept)| !**kept)
            .for_each(|(value, _)| *value = 0.0);
    }
}

/// The Adam optimiser (Kingma and Ba 2015) on one block of numbers.
#[derive(Clone, Debug)]
pub(super) struct Adam {
    learning_rate: f64,
    mean: Vec<f64>,
    square: Vec<f64>,
    steps: i32,
}

const BETA_MEAN: f64 = 0.9;
const BETA_SQUARE: f64 = 0.999;
/// The value of TensorFlow, which the published models were trained with.
const EPSILON: f64 = 1e-7;

impl Adam {
    pub(super) fn new(len: usize, learning_rate: f64) -> Self {
        Self {
            learning_rate,
            mean: vec![0.0; len],
            square: vec![0.0; len],
            steps: 0,
        }
    }

    pub(super) fn step(&mut self, values: &mut [f64], gradient: &[f64]) {
        self.steps = self.steps.saturating_add(1);
        let mean_correction = 1.0 - BETA_MEAN.powi(self.steps);
        let square_correction = 1.0 - BETA_SQUARE.powi(self.steps);
        let rate = self.learning_rate * square_correction.sqrt() / mean_correction;
        let epsilon = EPSILON * square_correction.sqrt();
        let moments = self.mean.iter_mut().zip(&mut self.square);
        for ((value, g), (mean, square)) in values.iter_mut().zip(gradient).zip(moments) {
            *mean += (1.0 - BETA_MEAN) * (g - *mean);
            *square += (1.0 - BETA_SQUARE) * (g * g - *square);
            *value -= rate * *mean / (square.sqrt() + epsilon);
        }
    }
}
