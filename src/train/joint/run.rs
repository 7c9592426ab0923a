//! A whole joint training: seeds in parallel, the best kept, figures and model.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};

use nalgebra::DMatrix;

use super::batch::{Batch, BatchOptions, batches};
use super::loss::{JointLoss, LossWeights, Losses};
use super::network::run::{NetworkTask, TrainedNetworks};
use super::parameters::Parameters;
use super::stages::{train_decoder, train_together, train_xi, train_xi_unrolled};
use crate::model::{AffineMap, ModelError};
use crate::robot::{Robot, STATE_DIM};
use crate::train::assemble::Origin;
use crate::train::data_sets::Recordings;
use crate::train::dataset::Quantity;
use crate::train::dynamics_fit::Fitted;
use crate::train::error::TrainError;
use crate::train::latent::{Latent, least_squares_decoder};
use crate::train::options::{JointOptions, TrainOptions, Transfer};
use crate::train::progress::Watch;
use crate::train::random::Random;
use crate::train::report::{SeedReport, Trained};
use crate::train::seeds::Seeds;
use crate::train::task::Task;
use crate::train::weak_form::check_terms;

/// Learns a model by Adam over encoder, decoder and Xi together (equations 9 to 20, steps of section IV-D).
///
/// Every seed is trained on its own, on as many threads as the options say; the one of least score is kept, and a
/// seed without a model (no stable dynamics, numbers that are not finite) is left out. A
/// cancelled training finishes with what the seeds begun have by then. Deterministic for a seed, on any number of
/// threads.
///
/// # Errors
/// [`TrainError`]: options out of range, too few samples, no stable model, cancelled before the first seed.
pub fn joint(
    recordings: Recordings<'_>,
    robot: &'static Robot,
    options: &TrainOptions,
    origin: &Origin,
    watch: &mut Watch<'_>,
) -> Result<Trained, TrainError> {
    let task = Task::new(recordings.clone(), robot, options)?;
    let scaling = options.scaling.factors();
    let batch_options = BatchOptions {
        phases: &options.phases,
        scaling: &scaling,
        rows: options.joint.batch_rows,
        smoothing: options.regression.smoothing,
    };
    let training = batches(&recordings.training, robot, &batch_options)?;
    let trainer = Trainer {
        task: &task,
        batches: &training,
    };
    let runs = trainer.run_seeds(watch);

    let validation = batches(&recordings.validation, robot, &batch_options)?;
    let judged = if validation.is_empty() {
        &training
    } else {
        &validation
    };
    let mut seeds = Seeds::default();
    for run in runs {
        let seed = run.seed;
        let outcome = trainer.finish(run, judged, watch);
        let outcome = outcome.map_err(|error| trainer.explained(error, seed));
        seeds.add(seed, outcome, watch)?;
    }
    seeds.into_model(task, robot, "joint", origin)
}

/// What all seeds share.
struct Trainer<'a> {
    task: &'a Task<'a>,
    batches: &'a [Batch],
}

/// What one seed has learned.
struct Run {
    seed: u64,
    learned: Learned,
    losses: Losses,
}

/// Linear and nonlinear maps are trained by code of their own: that of linear ones works on moments of the batches.
enum Learned {
    Linear(LinearMaps),
    Networks(TrainedNetworks),
}

/// Parameters of linear maps; with the published transfer Xi of every phase.
struct LinearMaps {
    parameters: Parameters,
    xi: Vec<DMatrix<f64>>,
}

impl Trainer<'_> {
    /// Trains all seeds on the threads of the options, in rounds, none of which begins after a cancellation; results
    /// are in the order of the seeds.
    fn run_seeds(&self, watch: &mut Watch<'_>) -> Vec<Run> {
        let JointOptions {
            threads,
            ref schedule,
            ..
        } = self.task.options.joint;
        let seeds = self.task.options.seeds();
        watch.stage(
            "training encoder, decoder and dynamics",
            seeds.len() * schedule.total(),
        );
        let cancel = watch.cancel_flag();
        let mut runs = Vec::new();
        for (round, group) in seeds.chunks(threads.max(1)).enumerate() {
            if watch.cancelled() {
                break;
            }
            let done_before = round * threads.max(1) * schedule.total();
            let (sender, receiver) = channel();
            std::thread::scope(|scope| {
                let workers: Vec<_> = group
                    .iter()
                    .map(|&seed| {
                        let sender = sender.clone();
                        scope.spawn(move || self.run_seed(seed, cancel, &sender))
                    })
                    .collect();
                drop(sender);
                for (done, text) in receiver.iter().enumerate() {
                    watch.done(done_before + done + 1, text);
                }
                runs.extend(
                    workers
                        .into_iter()
                        .map(|worker| worker.join().expect("a seed does not panic")),
                );
            });
        }
        runs
    }

    fn run_seed(&self, seed: u64, cancel: &AtomicBool, news: &Sender<String>) -> Run {
        let options = &self.task.options.joint;
        let weights = LossWeights {
            lift: self.task.options.encoder.lift_weight,
            ..options.weights
        };
        let mut tell = |epoch: usize, losses: &Losses, active: usize| {
            // Nobody listens any more if the training is being dropped; that ends soon by itself.
            let _ = news.send(format!(
                "seed {seed} epoch {epoch}: loss {:.3e}, decoder {:.3e}, {active} terms",
                losses.total(&weights),
                losses.decoder
            ));
        };
        let (learned, losses) = if options.maps.is_linear() {
            let (maps, losses) = self.learn_linear(seed, weights, cancel, &mut tell);
            (Learned::Linear(maps), losses)
        } else {
            let (maps, losses) = self.networks().learn(seed, weights, cancel, &mut tell);
            (Learned::Networks(maps), losses)
        };
        Run {
            seed,
            learned,
            losses,
        }
    }

    fn networks(&self) -> NetworkTask<'_> {
        NetworkTask {
            task: self.task,
            batches: self.batches,
        }
    }

    fn learn_linear(
        &self,
        seed: u64,
        weights: LossWeights,
        cancel: &AtomicBool,
        tell: &mut dyn FnMut(usize, &Losses, usize),
    ) -> (LinearMaps, Losses) {
        let options = &self.task.options.joint;
        let contact: Vec<&Batch> = self
            .batches
            .iter()
            .filter(|batch| batch.phase == 0)
            .collect();
        let mut parameters = self.start(seed);
        let coordinate_weights = self.task.options.encoder.coordinate_weights();
        let mut loss = JointLoss::new(&self.task.features, weights, coordinate_weights)
            .with_unroll(options.unroll);
        let mask: Vec<bool> = (0..STATE_DIM)
            .map(|i| self.task.active.contains(&i))
            .collect();
        let mut listener = |epoch: usize, losses: &Losses, active: usize| {
            tell(epoch, losses, active);
            !cancel.load(Ordering::Relaxed)
        };
        let losses = train_together(
            &mut parameters,
            &contact,
            &mut loss,
            weights,
            &mask,
            &options.schedule,
            &mut listener,
        );
        let mut maps = LinearMaps {
            parameters,
            xi: Vec::new(),
        };
        if options.transfer == Transfer::Published {
            self.transfer(&mut maps, weights, cancel);
        }
        (maps, losses)
    }

    /// Where a seed starts: random maps, `b_e = 0` as published or `-W_e mean(x)`.
    fn start(&self, seed: u64) -> Parameters {
        let JointOptions {
            xi_start, transfer, ..
        } = self.task.options.joint;
        let mut random = Random::new(seed);
        let (d, p) = (
            self.task.options.latent_dim,
            self.task.features.library_dim(),
        );
        let mut parameters = Parameters::random(STATE_DIM, d, p, xi_start, &mut random);
        if transfer == Transfer::Chosen {
            let mean = self
                .task
                .sets
                .training
                .gather(Quantity::X, Some(0))
                .column_mean();
            parameters.encoder_bias = -(parameters.encoder.tr_mul(&mean));
            parameters.decoder_bias = mean;
        }
        parameters
    }

    /// Steps two and three as published.
    fn transfer(&self, run: &mut LinearMaps, weights: LossWeights, cancel: &AtomicBool) {
        let schedule = &self.task.options.joint.schedule;
        let mut listener = |_: usize, _: &Losses, _: usize| !cancel.load(Ordering::Relaxed);
        let all: Vec<&Batch> = self.batches.iter().collect();
        train_decoder(&mut run.parameters, &all, schedule, &mut listener);
        for phase in 0..self.task.sets.training.phases.patterns.len() {
            let own: Vec<&Batch> = self
                .batches
                .iter()
                .filter(|batch| batch.phase == phase)
                .collect();
            let start = DMatrix::from_element(
                self.task.features.library_dim(),
                self.task.options.latent_dim,
                self.task.options.joint.xi_start,
            );
            let xi = if weights.bptt == 0.0 {
                train_xi(
                    &run.parameters,
                    &own,
                    &self.task.features,
                    weights,
                    schedule,
                    start,
                    &mut listener,
                )
                .0
            } else {
                let coordinate_weights = self.task.options.encoder.coordinate_weights();
                let mut loss = JointLoss::new(&self.task.features, weights, coordinate_weights)
                    .with_unroll(self.task.options.joint.unroll);
                let parameters = Parameters {
                    xi: start,
                    ..run.parameters.clone()
                };
                train_xi_unrolled(
                    &parameters,
                    &own,
                    &mut loss,
                    weights,
                    schedule,
                    &mut listener,
                )
            };
            run.xi.push(xi);
        }
    }

    /// The model numbers of a run, and what it is compared by.
    fn finish(
        &self,
        run: Run,
        judged: &[Batch],
        watch: &mut Watch<'_>,
    ) -> Result<(SeedReport, Fitted), TrainError> {
        let fitted = match &run.learned {
            Learned::Linear(maps) => self.finish_linear(maps, watch)?,
            Learned::Networks(maps) => self.networks().finish(maps, watch)?,
        };
        let score = match (self.task.options.joint.transfer, &run.learned) {
            (Transfer::Chosen, _) => fitted.score(),
            (Transfer::Published, Learned::Linear(maps)) => self.published_score(maps, judged),
            (Transfer::Published, Learned::Networks(maps)) => {
                self.networks().published_score(maps, judged)
            }
        };
        let seed = (run.seed, score);
        let report = self.task.seed_report(&fitted, seed, Some(run.losses))?;
        Ok((report, fitted))
    }

    /// Of a descent that left the finite numbers the term that made it do so, if one has no value where it began.
    fn explained(&self, error: TrainError, seed: u64) -> TrainError {
        if !matches!(error, TrainError::Model(ModelError::NonFinite { .. })) {
            return error;
        }
        let terms_at_start = || {
            let encoder = match self.task.options.joint.maps.is_linear() {
                true => {
                    let mut start = self.start(seed);
                    let masked = (0..STATE_DIM).filter(|i| !self.task.active.contains(i));
                    masked.for_each(|i| start.encoder.row_mut(i).fill(0.0));
                    AffineMap::new("encoder", start.encoder.transpose(), start.encoder_bias)?.into()
                }
                false => self.networks().starting_encoder(seed)?,
            };
            let latent = Latent::of(&self.task.sets.training, &encoder)?;
            check_terms(&self.task.sets.training, &latent, &self.task.features)
        };
        terms_at_start().err().unwrap_or(error)
    }

    fn finish_linear(
        &self,
        maps: &LinearMaps,
        watch: &mut Watch<'_>,
    ) -> Result<Fitted, TrainError> {
        match self.task.options.joint.transfer {
            Transfer::Published => published(maps),
            Transfer::Chosen => {
                let basis = maps.parameters.encoder.clone().qr().q();
                let encoder = self.task.encoder_over(&basis)?.into();
                let decoder = least_squares_decoder(&self.task.sets.training, &encoder)?.into();
                self.task.fit_dynamics((encoder, decoder), watch)
            }
        }
    }

    /// Mean combined loss over batches of all phases.
    fn published_score(&self, run: &LinearMaps, judged: &[Batch]) -> f64 {
        let weights = self.task.options.joint.weights;
        let mut loss = JointLoss::new(
            &self.task.features,
            weights,
            self.task.options.encoder.coordinate_weights(),
        );
        let mut parameters = run.parameters.clone();
        let mut total = 0.0;
        for batch in judged {
            parameters.xi.copy_from(&run.xi[batch.phase]);
            total += loss.evaluate(&parameters, batch).total(&weights);
        }
        total / judged.len().max(1) as f64
    }
}

/// The numbers as Adam left them.
fn published(run: &LinearMaps) -> Result<Fitted, TrainError> {
    let Parameters {
        encoder,
        encoder_bias,
        decoder,
        decoder_bias,
        ..
    } = &run.parameters;
    Ok(Fitted {
        weights: encoder.transpose(),
        encoder: AffineMap::new("encoder", encoder.transpose(), encoder_bias.clone())?.into(),
        decoder: AffineMap::new("decoder", decoder.transpose(), decoder_bias.clone())?.into(),
        xi: run.xi.clone(),
        choice: None,
        training: None,
    })
}
