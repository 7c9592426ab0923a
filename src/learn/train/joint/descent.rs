//! Descent by Adam: the transfer steps of section IV-D, the optimiser, and the coefficients that sequential
//! thresholding leaves.

use std::collections::BTreeSet;

use super::loss::{Batch, JointLoss, LossWeights, Losses};
use super::parameters::Parameters;

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
    pub(super) fn total(&self) -> usize {
        self.epochs + self.refinement
    }

    /// The loss weights in an epoch: refinement has no L1 term.
    fn weights_at(&self, epoch: usize, weights: LossWeights) -> LossWeights {
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

/// What a transfer step moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Moved {
    /// Encoder, decoder and the Xi of the phases of the batches.
    All,
    /// The decoder, by (16) alone.
    Decoder,
    /// The Xi of the phases of the batches.
    Xi,
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
    let mut mean = Losses::default();
    for epoch in 0..schedule.total() {
        for &phase in phases.iter().filter(|_| schedule.thresholds_at(epoch)) {
            let xi = parameters.xi[phase].as_mut_slice();
            coefficients[phase].threshold(xi, schedule.threshold);
        }
        loss.current = match moved {
            Moved::Decoder => LossWeights::RECONSTRUCTION_ONLY,
            Moved::All | Moved::Xi => schedule.weights_at(epoch, loss.weights),
        };
        mean = Losses::default();
        for batch in batches {
            let losses = loss.evaluate(parameters, batch);
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
        let active = phases.iter().map(|&phase| coefficients[phase].active());
        if !listener(epoch + 1, &mean, active.sum()) {
            break;
        }
    }
    mean
}

/// The Adam optimiser (Kingma and Ba 2015) on one block of numbers, with the mask of sequential thresholding: what is
/// dropped once stays zero.
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

    /// Drops the values below `least` for good.
    fn threshold(&mut self, values: &mut [f64], least: f64) {
        for (value, kept) in values.iter_mut().zip(&mut self.kept) {
            *kept &= value.abs() >= least;
            *value = if *kept { *value } else { 0.0 };
        }
    }

    fn active(&self) -> usize {
        self.kept.iter().filter(|kept| **kept).count()
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

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::model::Activation;
    use crate::train::features::Features;
    use crate::train::joint::parameters::Frame;
    use crate::train::joint::unroll::Unroll;
    use crate::train::oscillator::standard_library;
    use crate::train::random::Random;

    #[test]
    fn training_lowers_the_loss_and_masks_small_coefficients_and_moves_nothing_else() {
        let schedule = Schedule {
            epochs: 40,
            refinement: 20,
            threshold: 0.09,
            threshold_every: 10,
            learning_rate: 1e-2,
        };
        let weights = LossWeights {
            ddz: 0.5,
            ddx: 0.3,
            l1: 0.01,
            lift: 0.2,
            bptt: 0.0,
        };
        let features = Features::new(&standard_library(2, 1, true));
        let mut random = Random::new(21);
        let batch = |i: usize| Batch::random(i % 2, (40, 6), 0.5, &mut random);
        let batches: Vec<Batch> = (0..4).map(batch).collect();
        let all: Vec<&Batch> = batches.iter().collect();
        let kinds = [Activation::Linear, Activation::Elu].into_iter();
        let moves = [Moved::All, Moved::Decoder, Moved::Xi];
        for (kind, moved) in kinds.flat_map(|kind| moves.map(|moved| (kind, moved))) {
            let widths: (&[usize], &[usize]) = (&[6, 5, 2], &[2, 5, 6]);
            let shape = (features.library_dim(), 2, 0.1);
            let mut parameters = Parameters::random(widths, kind, shape, &mut Random::new(22));
            let frame = Frame::plain(&[true, true, false, true, true, true]);
            let maps = (frame, DVector::from_element(6, 1.0));
            let mut loss =
                JointLoss::new(&features, maps, (weights, Unroll::default()), &parameters);
            let before = parameters.clone();
            let (mut history, mut counts) = (Vec::new(), Vec::new());
            let mut listen = |_: usize, losses: &Losses, active: usize| {
                history.push(losses.total(&weights));
                counts.push(active);
                true
            };
            descend(
                &mut parameters,
                moved,
                &all,
                &mut loss,
                &schedule,
                &mut listen,
            );
            assert!(history[59] < history[0], "{moved:?} {history:?}");
            let masked =
                |parameters: &Parameters| parameters.encoder.layers[0].weights.row(2).into_owned();
            assert_eq!(masked(&parameters), masked(&before));
            assert_eq!(parameters.encoder != before.encoder, moved == Moved::All);
            assert_eq!(parameters.decoder != before.decoder, moved != Moved::Xi);
            assert_eq!(parameters.xi != before.xi, moved != Moved::Decoder);
            if moved == Moved::All {
                assert!(counts[59] < counts[0] && counts.windows(2).all(|pair| pair[1] <= pair[0]));
                let left = |xi: &DMatrix<f64>| xi.iter().filter(|value| **value != 0.0).count();
                assert_eq!(parameters.xi.iter().map(left).sum::<usize>(), counts[59]);
            }
        }
    }
}
