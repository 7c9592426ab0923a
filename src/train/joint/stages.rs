//! The three transfer steps of section IV-D.
//!
//! Steps two and three move only the decoder or only Xi. Their losses are then quadratic (but for the L1 term), so
//! every batch is reduced to its moments once and an iteration costs as much as a product of small matrices; the
//! iterates are those of the plain losses.

use nalgebra::{DMatrix, DVector};

use super::adam::Adam;
use super::batch::Batch;
use super::loss::{InputProjection, JointLoss, LossWeights, Losses, l1_subgradient};
use super::parameters::Parameters;
use super::schedule::{MaskedAdam, Schedule};
use crate::train::features::{FeatureValues, Features};

/// Told after every epoch: its number, the losses, the active terms. Answers whether to go on.
pub type Listener<'a> = dyn FnMut(usize, &Losses, usize) -> bool + 'a;

/// Encoder, decoder and Xi together, on batches of one phase.
///
/// `mask` (18) is true for coordinates that the encoder may use. Returns the mean losses of the last epoch.
pub fn train_together(
    parameters: &mut Parameters,
    batches: &[&Batch],
    loss: &mut JointLoss<'_>,
    weights: LossWeights,
    mask: &[bool],
    schedule: &Schedule,
    listener: &mut Listener<'_>,
) -> Losses {
    // The last block is Xi, which is masked.
    let [maps @ .., _] = parameters.blocks();
    let mut optimisers = maps.map(|block| Adam::new(block.len(), schedule.learning_rate));
    let mut masked = MaskedAdam::new(&parameters.xi, schedule);
    mask_rows(&mut parameters.encoder, mask);
    let mut last = Losses::default();
    for epoch in 0..schedule.total() {
        masked.start_epoch(epoch, schedule, &mut parameters.xi);
        loss.set_weights(schedule.weights_at(epoch, weights));
        let mut mean = Losses::default();
        for batch in batches {
            mean = mean.plus(
                &loss.evaluate(parameters, batch),
                1.0 / batches.len() as f64,
            );
            let gradient = loss.gradient();
            let ([maps @ .., _], [pulls @ .., _]) = (parameters.blocks_mut(), gradient.blocks());
            for ((optimiser, map), pull) in optimisers.iter_mut().zip(maps).zip(pulls) {
                optimiser.step(map, pull);
            }
            mask_rows(&mut parameters.encoder, mask);
            masked.step(&mut parameters.xi, &gradient.xi);
        }
        last = mean;
        if !listener(epoch + 1, &last, masked.active()) {
            break;
        }
    }
    last
}

/// The decoder alone, on batches of all phases.
pub fn train_decoder(
    parameters: &mut Parameters,
    batches: &[&Batch],
    schedule: &Schedule,
    listener: &mut Listener<'_>,
) {
    let (n, d) = parameters.encoder.shape();
    let moments: Vec<DecoderMoments> = batches
        .iter()
        .map(|batch| DecoderMoments::new(parameters, batch))
        .collect();
    let mut extended = parameters.decoder.clone().insert_row(d, 0.0);
    extended.set_row(d, &parameters.decoder_bias.transpose());
    let mut optimiser = Adam::new(extended.len(), schedule.learning_rate);
    let mut gradient = DMatrix::zeros(d + 1, n);
    for epoch in 0..schedule.total() {
        let mut mean = Losses::default();
        for moment in &moments {
            moment.own.mul_to(&extended, &mut gradient);
            let energy =
                extended.dot(&gradient) - 2.0 * extended.dot(&moment.shared) + moment.energy;
            mean.decoder += energy / (n * moments.len()) as f64;
            gradient -= &moment.shared;
            gradient *= 2.0 / n as f64;
            optimiser.step(extended.as_mut_slice(), gradient.as_slice());
        }
        if !listener(epoch + 1, &mean, 0) {
            break;
        }
    }
    parameters.decoder = extended.rows(0, d).into_owned();
    parameters.decoder_bias = extended.row(d).transpose();
}

struct DecoderMoments {
    own: DMatrix<f64>,    // [z, 1]^T [z, 1] / n
    shared: DMatrix<f64>, // [z, 1]^T x / n
    energy: f64,
}

impl DecoderMoments {
    fn new(parameters: &Parameters, batch: &Batch) -> Self {
        let n = batch.len() as f64;
        let z = encode(parameters, batch).insert_column(parameters.encoder.ncols(), 1.0);
        Self {
            own: z.tr_mul(&z) / n,
            shared: z.tr_mul(&batch.x) / n,
            energy: batch.x.norm_squared() / n,
        }
    }
}

/// Xi alone, on batches of one phase; returns the coefficients and the mean losses of the last epoch.
pub fn train_xi(
    parameters: &Parameters,
    batches: &[&Batch],
    features: &Features,
    weights: LossWeights,
    schedule: &Schedule,
    start: DMatrix<f64>,
    listener: &mut Listener<'_>,
) -> (DMatrix<f64>, Losses) {
    let moments: Vec<XiMoments> = batches
        .iter()
        .map(|batch| XiMoments::new(parameters, batch, features))
        .collect();
    let decoder_gram = &parameters.decoder * parameters.decoder.transpose();
    let mut xi = start;
    let mut masked = MaskedAdam::new(&xi, schedule);
    let mut last = Losses::default();
    for epoch in 0..schedule.total() {
        masked.start_epoch(epoch, schedule, &mut xi);
        let weights = schedule.weights_at(epoch, weights);
        last = Losses::default();
        for moment in &moments {
            let (losses, gradient) = moment.evaluate(&xi, &decoder_gram, weights);
            last = last.plus(&losses, 1.0 / moments.len() as f64);
            masked.step(&mut xi, &gradient);
        }
        if !listener(epoch + 1, &last, masked.active()) {
            break;
        }
    }
    (xi, last)
}

/// Xi alone where the loss has predictions over a window (41), which no moments express; else as [`train_xi`].
pub fn train_xi_unrolled(
    start: &Parameters,
    batches: &[&Batch],
    loss: &mut JointLoss<'_>,
    weights: LossWeights,
    schedule: &Schedule,
    listener: &mut Listener<'_>,
) -> DMatrix<f64> {
    let mut parameters = start.clone();
    let mut masked = MaskedAdam::new(&parameters.xi, schedule);
    for epoch in 0..schedule.total() {
        masked.start_epoch(epoch, schedule, &mut parameters.xi);
        loss.set_weights(schedule.weights_at(epoch, weights));
        let mut mean = Losses::default();
        for batch in batches {
            let share = 1.0 / batches.len() as f64;
            mean = mean.plus(&loss.evaluate(&parameters, batch), share);
            masked.step(&mut parameters.xi, &loss.gradient().xi);
        }
        if !listener(epoch + 1, &mean, masked.active()) {
            break;
        }
    }
    parameters.xi
}

/// (17) and (18) of one batch as quadratic functions of Xi.
struct XiMoments {
    gram: DMatrix<f64>,   // theta^T theta
    latent: DMatrix<f64>, // theta^T ddz
    real: DMatrix<f64>,   // theta^T ddx W_d
    ddz_energy: f64,
    ddx_energy: f64,
    n: f64,
    state_dim: f64,
}

impl XiMoments {
    fn new(parameters: &Parameters, batch: &Batch, features: &Features) -> Self {
        let theta = theta(parameters, batch, features);
        let ddz = &batch.ddx * &parameters.encoder;
        Self {
            gram: theta.tr_mul(&theta),
            latent: theta.tr_mul(&ddz),
            real: theta.tr_mul(&(&batch.ddx * parameters.decoder.transpose())),
            ddz_energy: ddz.norm_squared(),
            ddx_energy: batch.ddx_energy,
            n: batch.len() as f64,
            state_dim: batch.x.ncols() as f64,
        }
    }

    fn evaluate(
        &self,
        xi: &DMatrix<f64>,
        decoder_gram: &DMatrix<f64>,
        weights: LossWeights,
    ) -> (Losses, DMatrix<f64>) {
        let latent_scale = 1.0 / (self.n * xi.ncols() as f64);
        let real_scale = 1.0 / (self.n * self.state_dim);
        let own = &self.gram * xi;
        let decoded = &own * decoder_gram;
        let mut losses = Losses {
            ddz: latent_scale * (xi.dot(&own) - 2.0 * xi.dot(&self.latent) + self.ddz_energy),
            ddx: real_scale * (xi.dot(&decoded) - 2.0 * xi.dot(&self.real) + self.ddx_energy),
            ..Losses::default()
        };
        let mut gradient = (own - &self.latent) * (2.0 * weights.ddz * latent_scale);
        gradient += (decoded - &self.real) * (2.0 * weights.ddx * real_scale);
        losses.l1 = l1_subgradient(xi, weights.l1 / xi.len() as f64, &mut gradient);
        (losses, gradient)
    }
}

/// `z` of a batch, rows are samples.
fn encode(parameters: &Parameters, batch: &Batch) -> DMatrix<f64> {
    let mut z = &batch.x * &parameters.encoder;
    add_to_rows(&mut z, &parameters.encoder_bias);
    z
}

/// The library on a batch, `n x library_dim`.
fn theta(parameters: &Parameters, batch: &Batch, features: &Features) -> DMatrix<f64> {
    let d = parameters.encoder.ncols();
    let mut variables = DMatrix::zeros(batch.len(), 3 * d);
    variables
        .columns_mut(0, d)
        .copy_from(&encode(parameters, batch));
    variables
        .columns_mut(d, d)
        .copy_from(&(&batch.dx * &parameters.encoder));
    let projection = InputProjection::new(&parameters.encoder);
    variables
        .columns_mut(2 * d, d)
        .copy_from(&(&batch.u * projection.weights()));
    features.evaluate(&variables, &mut FeatureValues::default())
}

fn add_to_rows(matrix: &mut DMatrix<f64>, row: &DVector<f64>) {
    for (mut column, value) in matrix.column_iter_mut().zip(row.iter()) {
        column.add_scalar_mut(*value);
    }
}

fn mask_rows(encoder: &mut DMatrix<f64>, mask: &[bool]) {
    for (mut row, _) in encoder.row_iter_mut().zip(mask).filter(|(_, used)| !**used) {
        row.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Library, StandardLibrary};
    use crate::train::random::Random;

    fn setup() -> (Features, Vec<Batch>, Parameters) {
        let standard = StandardLibrary {
            degree: 1,
            trigonometric: true,
            inputs: true,
        };
        let features = Features::new(&Library::standard(2, standard).expect("small library"));
        let mut random = Random::new(21);
        let batches = (0..3)
            .map(|_| Batch::new(0, std::array::from_fn(|_| random.matrix(40, 6, 0.5)), 0.002))
            .collect();
        let parameters = Parameters::random(6, 2, features.library_dim(), 0.1, &mut random);
        (features, batches, parameters)
    }

    fn short(epochs: usize) -> Schedule {
        Schedule {
            epochs,
            refinement: 0,
            threshold_every: 0,
            learning_rate: 1e-2,
            ..Schedule::default()
        }
    }

    #[test]
    fn xi_from_moments_moves_as_xi_in_the_full_loss() {
        let (features, batches, parameters) = setup();
        let all: Vec<&Batch> = batches.iter().collect();
        let weights = LossWeights {
            ddz: 0.5,
            ddx: 0.3,
            l1: 0.01,
            lift: 0.0,
            bptt: 0.0,
        };
        let mut go = |_: usize, _: &Losses, _: usize| true;
        let (fast, _) = train_xi(
            &parameters,
            &all,
            &features,
            weights,
            &short(4),
            parameters.xi.clone(),
            &mut go,
        );
        let mut slow = parameters.clone();
        let mut loss = JointLoss::new(&features, weights, DVector::from_element(6, 1.0));
        let mut optimiser = Adam::new(slow.xi.len(), 1e-2);
        for _ in 0..4 {
            for batch in &batches {
                loss.evaluate(&slow, batch);
                optimiser.step(slow.xi.as_mut_slice(), loss.gradient().xi.as_slice());
            }
        }
        assert!((fast - slow.xi).amax() < 1e-10);
    }

    #[test]
    fn decoder_from_moments_moves_as_the_decoder_in_the_full_loss() {
        let (features, batches, parameters) = setup();
        let all: Vec<&Batch> = batches.iter().collect();
        let mut fast = parameters.clone();
        train_decoder(&mut fast, &all, &short(5), &mut |_, _, _| true);
        let mut slow = parameters.clone();
        let weights = LossWeights {
            ddz: 0.0,
            ddx: 0.0,
            l1: 0.0,
            lift: 0.0,
            bptt: 0.0,
        };
        let mut loss = JointLoss::new(&features, weights, DVector::from_element(6, 1.0));
        let (mut first, mut second) = (Adam::new(slow.decoder.len(), 1e-2), Adam::new(6, 1e-2));
        for _ in 0..5 {
            for batch in &batches {
                loss.evaluate(&slow, batch);
                first.step(
                    slow.decoder.as_mut_slice(),
                    loss.gradient().decoder.as_slice(),
                );
                second.step(
                    slow.decoder_bias.as_mut_slice(),
                    loss.gradient().decoder_bias.as_slice(),
                );
            }
        }
        assert!((fast.decoder - slow.decoder).amax() < 1e-10);
        assert!((fast.decoder_bias - slow.decoder_bias).amax() < 1e-10);
    }

    #[test]
    fn training_together_lowers_the_loss_and_keeps_masked_coordinates_out() {
        let (features, batches, mut parameters) = setup();
        let all: Vec<&Batch> = batches.iter().collect();
        let weights = LossWeights::default();
        let mut loss = JointLoss::new(&features, weights, DVector::from_element(6, 1.0));
        let mut history = Vec::new();
        let mask = [true, true, false, true, true, true];
        let mut listen = |_: usize, losses: &Losses, _: usize| {
            history.push(losses.total(&weights));
            true
        };
        train_together(
            &mut parameters,
            &all,
            &mut loss,
            weights,
            &mask,
            &short(60),
            &mut listen,
        );
        assert!(history[59] < 0.7 * history[0], "{history:?}");
        assert_eq!(parameters.encoder.row(2).amax(), 0.0);
    }

    #[test]
    fn thresholding_masks_small_coefficients_for_good() {
        let (features, batches, parameters) = setup();
        let all: Vec<&Batch> = batches.iter().collect();
        let schedule = Schedule {
            epochs: 30,
            refinement: 20,
            threshold: 0.09,
            threshold_every: 10,
            learning_rate: 1e-2,
        };
        let mut counts = Vec::new();
        let mut listen = |_: usize, _: &Losses, active: usize| {
            counts.push(active);
            true
        };
        let weights = LossWeights {
            ddz: 1.0,
            ..LossWeights::default()
        };
        let (xi, _) = train_xi(
            &parameters,
            &all,
            &features,
            weights,
            &schedule,
            parameters.xi.clone(),
            &mut listen,
        );
        assert!(
            counts[49] < counts[0] && counts.windows(2).all(|pair| pair[1] <= pair[0]),
            "{counts:?}"
        );
        assert_eq!(xi.iter().filter(|value| **value != 0.0).count(), counts[49]);
    }
}
