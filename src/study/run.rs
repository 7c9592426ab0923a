//! Trains the missing cells of a study on all cores.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::plan::{CellId, FOLDS, Shard, StudyError};
use super::store::Store;
use super::summary::{Cell, Metrics, Outcome};
use crate::recording::Recording;
use crate::robot::Robot;
use crate::train::{Method, Monitor, Origin, Recordings, TrainError, TrainOptions, Trained};

/// Trains the cells of a shard that the store misses; each is kept as soon as it is finished.
///
/// Seeds of the joint method are random starts, as published. The closed form finds the same model from every start, so
/// its seed `s` leaves out every fifth training jump, beginning with the `s`-th: its spread says how much the
/// recordings matter. Where the encoder may look at fewer coordinates than the latent space has, the mask is lifted.
/// `[training, validation]` are the recordings, `options` the settings but for name, latent dimension and seed,
/// `finished` is called for every cell. The result does not depend on the number of threads.
pub(crate) fn run(
    store: &Store,
    shard: Shard,
    [training, validation]: [&[Recording]; 2],
    robot: &'static Robot,
    options: &TrainOptions,
    finished: &(dyn Fn(CellId) + Sync),
) -> Result<(), StudyError> {
    let missing = store.missing();
    let mut todo = shard.of(&store.plan().cells());
    todo.retain(|id| missing.contains(id));
    let method = store.plan().method;
    let next = AtomicUsize::new(0);
    let worker = || {
        while let Some(&id) = todo.get(next.fetch_add(1, Ordering::Relaxed)) {
            let outcome = train(id, [training, validation], robot, options.clone(), method);
            let kept = store.put(&Cell { id, outcome });
            finished(id);
            if kept.is_err() {
                next.store(todo.len(), Ordering::Relaxed);
                return kept;
            }
        }
        Ok(())
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        let started = (0..threads.min(todo.len())).map(|_| scope.spawn(worker));
        let workers: Vec<_> = started.collect();
        let mut workers = workers.into_iter();
        workers.try_for_each(|worker| worker.join().expect("no thread panics"))
    })
}

fn train(
    id: CellId,
    [training, validation]: [&[Recording]; 2],
    robot: &'static Robot,
    mut options: TrainOptions,
    method: Method,
) -> Outcome {
    options.name = format!("d{}", id.latent_dim);
    options.latent_dim = id.latent_dim;
    options.seed = id.seed;
    options.n_seeds = 1;
    options.joint.threads = 1;
    let training = match method {
        Method::Joint => training.to_vec(),
        Method::ClosedForm => without_fold(training, id.seed),
    };
    let sets = Recordings::new(&training, validation);
    let learn = |options: &TrainOptions| -> Result<Trained, TrainError> {
        let never = AtomicBool::new(false);
        let mut deaf = |_| {};
        let mut monitor = Monitor::new(&mut deaf, &never);
        method.learn(sets, robot, options, &Origin::default(), &mut monitor)
    };
    let mut trained = learn(&options);
    if matches!(trained, Err(TrainError::LatentDim { .. })) {
        options.encoder.least_std = 0.0;
        trained = learn(&options);
    }
    match trained {
        Ok(trained) => match Metrics::of(&trained.report) {
            metrics if metrics.is_finite() => Outcome::Trained(metrics),
            _ => Outcome::Refused("a prediction of 0.1 s diverges".to_owned()),
        },
        Err(error) => Outcome::Refused(error.to_string()),
    }
}

/// All jumps but every fifth, beginning with the one of the seed; all of them where that would leave none.
fn without_fold(recordings: &[Recording], seed: u64) -> Vec<Recording> {
    let fold = (seed.wrapping_sub(1) % FOLDS as u64) as usize;
    let kept = (recordings.iter().enumerate()).filter(|(index, _)| index % FOLDS != fold);
    let kept: Vec<Recording> = kept.map(|(_, recording)| recording.clone()).collect();
    match kept.is_empty() {
        true => recordings.to_vec(),
        false => kept,
    }
}
