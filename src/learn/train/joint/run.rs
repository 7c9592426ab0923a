//! A whole joint training: seeds in parallel, the best kept.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};

use super::batch::batches;
use super::descent::{Listener, descend};
use super::parameters::{Frame, LatentBasis, folded};
use super::*;
use crate::train::latent::{least_squares_decoder, map_samples, mean_jacobian};
use crate::train::seeds::{Outcome, Seeds};
use crate::train::task::Fitted;
use crate::train::weak_form::check_terms;

/// Learns a model by Adam over encoder, decoder and Xi together (equations 9 to 20, steps of section IV-D).
///
/// The seed of least score is kept, those without a model are left out. Deterministic, on any number of threads.
pub(crate) fn joint(
    recordings: Recordings<'_>,
    robot: &'static Robot,
    options: &TrainOptions,
    origin: &Origin,
    monitor: &mut Monitor<'_>,
) -> Result<Trained> {
    let task = Task::new(recordings, robot, options)?;
    let frame = frame(&task);
    let cut = |set| batches(set, &task.training, &frame);
    let training = cut(recordings.training)?;
    let trainer = Trainer {
        task: &task,
        batches: &training,
        frame: &frame,
    };
    let runs = trainer.run_seeds(monitor);

    let validation = cut(recordings.validation)?;
    let judged = if validation.is_empty() {
        &training
    } else {
        &validation
    };
    let mut seeds = Seeds::default();
    for run in runs {
        let seed = run.seed;
        let outcome = trainer.finish(run, judged, monitor);
        let outcome = outcome.map_err(|error| trainer.explained(error, seed));
        seeds.add(seed, outcome, monitor)?;
    }
    seeds.into_model(task, "joint", origin)
}

/// For linear maps and as published the units of the samples, else centred and in standard deviations.
fn frame(task: &Task<'_>) -> Frame {
    let factors = DVector::from_fn(STATE_DIM, |i, _| f64::from(task.active.contains(&i)));
    let options = task.options;
    if options.joint.maps.is_linear() || options.joint.transfer == Transfer::Published {
        return Frame {
            mean: DVector::zeros(STATE_DIM),
            spread: DVector::from_element(STATE_DIM, 1.0),
            factors,
            latent: 1.0,
        };
    }
    let x = task.training.states(None);
    let least = options.encoder.least_std * options.scaling.state;
    let spread = (x.column_variance()).map(|variance: f64| variance.sqrt().max(least).max(1e-6));
    let energy: f64 = task.active.iter().map(|&i| spread[i] * spread[i]).sum();
    Frame {
        mean: x.column_mean(),
        factors: factors.component_div(&spread),
        spread,
        latent: (energy / task.active.len().max(1) as f64).sqrt(),
    }
}

struct Trainer<'a> {
    task: &'a Task<'a>,
    batches: &'a [Batch],
    frame: &'a Frame,
}

struct Run {
    seed: u64,
    parameters: Parameters,
    losses: Losses,
}

impl Trainer<'_> {
    /// Trains all seeds, in rounds of as many as there are threads, none of which begins after a cancellation.
    fn run_seeds(&self, monitor: &mut Monitor<'_>) -> Vec<Run> {
        let options = &self.task.options.joint;
        let (seeds, cancel) = (self.task.options.seeds(), monitor.cancel);
        let steps = if self.is_published() {
            2 + self.task.training.phases.patterns.len()
        } else {
            1
        };
        let epochs = steps * (options.schedule.epochs + options.schedule.refinement);
        monitor.stage(
            "training encoder, decoder and dynamics",
            seeds.len() * epochs,
        );
        let mut runs = Vec::new();
        for group in seeds.chunks(options.threads.max(1)) {
            if monitor.cancelled() {
                break;
            }
            let (sender, receiver) = channel();
            std::thread::scope(|scope| {
                let started = group.iter().map(|&seed| {
                    let sender = sender.clone();
                    scope.spawn(move || self.run_seed(seed, cancel, &sender))
                });
                let workers: Vec<_> = started.collect();
                drop(sender);
                receiver.iter().for_each(|text| match text {
                    Some(text) => monitor.done(text),
                    None => monitor.step(),
                });
                for worker in workers {
                    runs.push(worker.join().expect("a seed does not panic"));
                }
            });
        }
        runs
    }

    fn run_seed(&self, seed: u64, cancel: &AtomicBool, news: &Sender<Option<String>>) -> Run {
        let options = &self.task.options.joint;
        let (schedule, published) = (&options.schedule, self.is_published());
        let weights = LossWeights {
            lift: self.task.options.encoder.lift_weight,
            ..options.weights
        };
        let mut parameters = self.start(seed);
        let mut loss = self.loss(weights, &parameters);
        let mut listener = |epoch: usize, losses: &Losses, active: usize| {
            // Nobody listens any more if the training is being dropped; that ends soon by itself.
            let _ = news.send(Some(format!(
                "seed {seed} epoch {epoch}: loss {:.3e}, decoder {:.3e}, {active} terms",
                losses.total(&weights),
                losses.decoder
            )));
            !cancel.load(Ordering::Relaxed)
        };
        let all: Vec<&Batch> = self.batches.iter().collect();
        let of_phase = |phase: usize| all.iter().copied().filter(move |b| b.phase == phase);
        // The published first step uses contact only. A network is undefined at states on which it was not trained.
        let first = match self.is_linear() || published {
            true => of_phase(0).collect(),
            false => all.clone(),
        };
        let mut step = |parameters: &mut Parameters,
                        moved,
                        batches: &[&Batch],
                        listener: &mut Listener<'_>| {
            descend(parameters, moved, batches, &mut loss, schedule, listener)
        };
        let losses = step(&mut parameters, Moved::All, &first, &mut listener);
        if published {
            let mut quiet = |_: usize, _: &Losses, _: usize| {
                let _ = news.send(None);
                !cancel.load(Ordering::Relaxed)
            };
            step(&mut parameters, Moved::Decoder, &all, &mut quiet);
            for phase in 0..parameters.xi.len() {
                let own: Vec<&Batch> = of_phase(phase).collect();
                parameters.xi[phase].fill(options.xi_start);
                step(&mut parameters, Moved::Xi, &own, &mut quiet);
            }
        }
        Run {
            seed,
            parameters,
            losses,
        }
    }

    fn loss(&self, weights: LossWeights, parameters: &Parameters) -> JointLoss<'_> {
        let options = self.task.options;
        let maps = (self.frame.clone(), options.encoder.coordinate_weights());
        let terms = (weights, options.joint.unroll);
        JointLoss::new(&self.task.features, maps, terms, parameters)
    }

    fn is_linear(&self) -> bool {
        self.task.options.joint.maps.is_linear()
    }

    fn is_published(&self) -> bool {
        self.task.options.joint.transfer == Transfer::Published
    }

    /// Where a seed starts: random maps, and for linear ones `b_e = 0` as published or `-W_e mean(x)`.
    fn start(&self, seed: u64) -> Parameters {
        let options = &self.task.options.joint;
        let (maps, training) = (&options.maps, &self.task.training);
        let d = self.task.options.latent_dim;
        let encoder = [&[STATE_DIM], &maps.encoder_layers[..], &[d]].concat();
        let decoder = [&[d], &maps.decoder_layers[..], &[STATE_DIM]].concat();
        let (terms, phases) = (&self.task.features, training.phases.patterns.len());
        let shape = (terms.library_dim(), phases, options.xi_start);
        let widths = (&encoder[..], &decoder[..]);
        let mut start = Parameters::random(widths, maps.activation, shape, &mut Random::new(seed));
        if self.is_linear() && !self.is_published() {
            let encoder = &mut start.encoder.layers[0];
            let mean = training.states(Some(0)).column_mean();
            encoder.bias = -(encoder.weights.tr_mul(&mean));
            start.decoder.layers[0].bias = mean;
        }
        start
    }

    fn finish(&self, run: Run, judged: &[Batch], monitor: &mut Monitor<'_>) -> Outcome {
        let fitted = if self.is_published() {
            self.published(run.parameters, judged)?
        } else {
            let maps = self.canonical_maps(&run.parameters)?;
            self.task.fit_dynamics(maps, monitor)?
        };
        let report = (self.task).seed_report(&fitted, run.seed, Some(run.losses));
        Ok((report, fitted))
    }

    /// The maps and Xi as they were learned, judged by the combined loss.
    fn published(&self, parameters: Parameters, judged: &[Batch]) -> Result<Fitted> {
        let plain = LatentBasis::unchanged(self.task.options.latent_dim);
        let (encoder, decoder) = folded(&parameters, self.frame, &plain)?;
        let weights = self.task.options.joint.weights;
        let mut loss = self.loss(weights, &parameters);
        let losses =
            (judged.iter()).map(|batch| loss.evaluate(&parameters, batch, Moved::All, None));
        let total: f64 = losses.map(|losses| losses.total(&weights)).sum();
        Ok(Fitted {
            score: total / judged.len().max(1) as f64,
            maps: self.task.encoded(encoder, decoder),
            xi: parameters.xi,
            choice: None,
        })
    }

    /// The learned maps in the canonical latent basis, the decoder's last layer by least squares.
    fn canonical_maps(&self, parameters: &Parameters) -> Result<(StateMap, StateMap)> {
        let (task, d) = (self.task, self.task.options.latent_dim);
        let learned = folded(parameters, self.frame, &LatentBasis::unchanged(d))?.0;
        if let (true, Some(linear)) = (self.is_linear(), learned.as_affine()) {
            let rows = linear.weights().transpose().qr().q();
            let encoder = task.encoder_over(&task.frame.nearest(&rows, d))?.into();
            let decoder = least_squares_decoder(&task.training, &encoder, None)?.into();
            return Ok((encoder, decoder));
        }
        let basis = self.basis(&learned);
        let (encoder, decoder) = folded(parameters, self.frame, &basis)?;
        let mut layers = decoder.layers().to_vec();
        let last = layers.pop().expect("invariant: a map has a layer");
        let hidden = match layers.is_empty() {
            true => None,
            false => Some(StateMap::new("decoder", layers.clone())?),
        };
        let map = least_squares_decoder(&task.training, &encoder, hidden.as_ref())?;
        layers.push(Layer { map, ..last });
        Ok((encoder, StateMap::new("decoder", layers)?))
    }

    /// The basis in which `J J^T` is the identity in the mean, rotated by varimax, with the latents' mean at 0.
    fn basis(&self, encoder: &StateMap) -> LatentBasis {
        let (d, training) = (self.task.options.latent_dim, &self.task.training);
        let x = training.states(None);
        let gram = x.column_iter().fold(DMatrix::zeros(d, d), |sum, x| {
            let jacobian = encoder
                .jacobian(&x.into_owned())
                .expect("accepts the robot's states");
            sum + &jacobian * jacobian.transpose()
        }) / x.ncols().max(1) as f64;
        // A basis without full rank is left as it is; the regression then reports that no model is stable.
        let white = gram.cholesky().and_then(|factor| factor.l().try_inverse());
        let white = white.unwrap_or_else(|| DMatrix::identity(d, d));
        let mean = &white * mean_jacobian(encoder, training);
        let (_, rotation) = self.task.canonical_basis(&mean.transpose());
        let turn = rotation.transpose() * white;
        let Some(back) = turn.clone().try_inverse() else {
            return LatentBasis::unchanged(d);
        };
        let shift = -(&turn * map_samples(encoder, &x).column_mean());
        LatentBasis { turn, back, shift }
    }

    /// Of a descent that left the finite numbers the term that made it do so, if one has no value where it began.
    fn explained(&self, error: TrainError, seed: u64) -> TrainError {
        if !matches!(error, TrainError::Model(ModelError::NonFinite { .. })) {
            return error;
        }
        let training = &self.task.training;
        let terms_at_start = || {
            let plain = LatentBasis::unchanged(self.task.options.latent_dim);
            let encoder = folded(&self.start(seed), self.frame, &plain)?.0;
            let latent = Latent::of(training, &encoder);
            let set = EncodedSet::new(training, &latent);
            check_terms(set, &self.task.features, &self.task.library)
        };
        terms_at_start().err().unwrap_or(error)
    }
}
