//! The transfer steps of section IV-D: descent by Adam with sequential thresholding.

use std::collections::BTreeSet;

use super::*;

#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    /// Epochs with the L1 term and thresholding.
    pub epochs: usize,
    /// Epochs of refinement: no L1 term, no thresholding, the mask stays.
    pub refinement: usize,
    /// Coefficients below this are masked for good.
    pub threshold: f64,
    pub threshold_every: usize,
    pub learning_rate: f64,
}

impl Schedule {
    fn thresholds_at(&self, epoch: usize) -> bool {
        epoch > 0
            && epoch < self.epochs
            && self.threshold_every > 0
            && epoch.is_multiple_of(self.threshold_every)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Moved {
    All,     // encoder, decoder and the Xi of the phases of the batches
    Decoder, // by (16) alone
    Xi,      // of the phases of the batches
}

/// Called after every epoch with its number, the losses and the active terms. Returns whether to go on.
pub(super) type Listener<'a> = dyn FnMut(usize, &Losses, usize) -> bool + 'a;

/// One transfer step. Returns the mean losses of the last epoch.
pub(super) fn descend(
    parameters: &mut Parameters,
    moved: Moved,
    batches: &[&Batch],
    loss: &mut JointLoss<'_>,
    schedule: &Schedule,
    listener: &mut Listener<'_>,
) -> Losses {
    let fixed = match moved {
        Moved::All => 0,
        Moved::Decoder => parameters.encoder.blocks().count(),
        Moved::Xi => parameters.maps().count(),
    };
    let adam = |block: &[f64]| Adam::new(block.len(), schedule.learning_rate);
    let mut maps: Vec<Adam> = parameters.maps().skip(fixed).map(adam).collect();
    let coefficients = parameters.xi.iter().map(|xi| adam(xi.as_slice()));
    let mut coefficients: Vec<Adam> = coefficients.collect();
    let phases: BTreeSet<usize> = match moved {
        Moved::Decoder => BTreeSet::new(),
        Moved::All | Moved::Xi => batches.iter().map(|batch| batch.phase).collect(),
    };
    // The encoder stays in the later steps.
    let known =
        |batch: &&Batch| (moved != Moved::All).then(|| loss.known(parameters, batch, moved));
    let known: Vec<_> = batches.iter().map(known).collect();
    loss.current = loss.weights;
    let mut mean = Losses::default();
    for epoch in 0..schedule.epochs + schedule.refinement {
        for &phase in phases.iter().filter(|_| schedule.thresholds_at(epoch)) {
            let xi = parameters.xi[phase].as_mut_slice();
            coefficients[phase].threshold(xi, schedule.threshold);
        }
        if epoch >= schedule.epochs {
            loss.current.l1 = 0.0;
        }
        mean = Losses::default();
        for (batch, known) in batches.iter().zip(&known) {
            let losses = loss.evaluate(parameters, batch, moved, known.as_ref());
            mean = mean.plus(&losses, 1.0 / batches.len() as f64);
            let (gradient, phase) = (&loss.gradient, batch.phase);
            let blocks = parameters.maps_mut().zip(gradient.maps()).skip(fixed);
            for (optimiser, (block, gradient)) in maps.iter_mut().zip(blocks) {
                optimiser.step(block, gradient);
            }
            if phases.contains(&phase) {
                let xi = parameters.xi[phase].as_mut_slice();
                coefficients[phase].step(xi, gradient.xi[phase].as_slice());
            }
        }
        let kept = phases.iter().flat_map(|&phase| &coefficients[phase].kept);
        if !listener(epoch + 1, &mean, kept.filter(|kept| **kept).count()) {
            break;
        }
    }
    mean
}

/// Adam (Kingma and Ba 2015) on one block of numbers; coefficients dropped by thresholding stay zero.
struct Adam {
    learning_rate: f64,
    mean: Vec<f64>,
    square: Vec<f64>,
    kept: Vec<bool>,
    steps: i32,
}

const BETA_MEAN: f64 = 0.9;
const BETA_SQUARE: f64 = 0.999;
/// The value of TensorFlow, which the published models were trained with.
const EPSILON: f64 = 1e-7;

impl Adam {
    fn new(len: usize, learning_rate: f64) -> Self {
        Self {
            learning_rate,
            mean: vec![0.0; len],
            square: vec![0.0; len],
            kept: vec![true; len],
            steps: 0,
        }
    }

    fn threshold(&mut self, values: &mut [f64], least: f64) {
        for (value, kept) in values.iter_mut().zip(&mut self.kept) {
            *kept &= value.abs() >= least;
            *value = if *kept { *value } else { 0.0 };
        }
    }

    fn step(&mut self, values: &mut [f64], gradient: &[f64]) {
        self.steps = self.steps.saturating_add(1);
        let mean_correction = 1.0 - BETA_MEAN.powi(self.steps);
        let square_correction = 1.0 - BETA_SQUARE.powi(self.steps);
        let rate = self.learning_rate * square_correction.sqrt() / mean_correction;
        let epsilon = EPSILON * square_correction.sqrt();
        let moments = self.mean.iter_mut().zip(&mut self.square);
        let each = values.iter_mut().zip(gradient).zip(moments.zip(&self.kept));
        for ((value, g), ((mean, square), kept)) in each {
            *mean += (1.0 - BETA_MEAN) * (g - *mean);
            *square += (1.0 - BETA_SQUARE) * (g * g - *square);
            let moved = *value - rate * *mean / (square.sqrt() + epsilon);
            *value = if *kept { moved } else { 0.0 };
        }
    }
}
