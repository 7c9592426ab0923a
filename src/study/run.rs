//! Trains what a study still misses, on all cores.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::cell::{Cell, Figures, Outcome};
use super::error::StudyError;
use super::plan::{CellId, FOLDS, Shard};
use super::store::Store;
use crate::recording::Recording;
use crate::robot::Robot;
use crate::train::{
    Origin, Recordings, TrainError, TrainOptions, Trained, Watch, closed_form, joint,
};

/// Trains the cells of a shard that the store misses; each is kept as soon as it is finished.
///
/// Seeds of the joint method are random starts, as published. The closed form finds the same model from every start,
/// so its seed `s` leaves out every fifth training jump, beginning with the `s`-th: its spread says how much the
/// recordings matter. Where the encoder may look at fewer coordinates than the latent space has, the mask is lifted.
/// `[training, validation]` are the recordings, `options` gives the settings for a latent dimension, `finished` hears of every cell. The result does not depend on
/// the number of threads.
///
/// # Errors
/// [`StudyError::File`]. A training that refuses is an outcome, not an error.
pub fn run(
    store: &Store,
    shard: Shard,
    [training, validation]: [&[Recording]; 2],
    robot: &'static Robot,
    options: &(dyn Fn(usize) -> TrainOptions + Sync),
    finished: &(dyn Fn(CellId) + Sync),
) -> Result<(), StudyError> {
    let missing = store.missing();
    let todo: Vec<CellId> = shard
        .of(&store.plan().cells())
        .into_iter()
        .filter(|id| missing.contains(id))
        .collect();
    let is_joint = store.plan().method == "joint";
    let next = AtomicUsize::new(0);
    let failed: Mutex<Option<StudyError>> = Mutex::new(None);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads.min(todo.len()) {
            scope.spawn(|| {
                while let Some(&id) = todo.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let cell = Cell {
                        id,
                        outcome: train(
                            id,
                            [training, validation],
                            robot,
                            options(id.latent_dim),
                            is_joint,
                        ),
                    };
                    if let Err(error) = store.put(&cell) {
                        failed
                            .lock()
                            .expect("no thread panics")
                            .get_or_insert(error);
                        next.store(todo.len(), Ordering::Relaxed);
                    }
                    finished(id);
                }
            });
        }
    });
    match failed.into_inner().expect("no thread panics") {
        Some(error) => Err(error),
        None => Ok(()),
    }
}

fn train(
    id: CellId,
    [training, validation]: [&[Recording]; 2],
    robot: &'static Robot,
    mut options: TrainOptions,
    is_joint: bool,
) -> Outcome {
    options.seed = id.seed;
    options.n_seeds = 1;
    options.joint.threads = 1;
    let training: Vec<Recording> = if is_joint {
        training.to_vec()
    } else {
        without_fold(training, id.seed)
    };
    let sets = Recordings::new(&training, validation);
    let learn = |options: &TrainOptions| -> Result<Trained, TrainError> {
        let never = AtomicBool::new(false);
        let mut deaf = |_| {};
        let mut watch = Watch::new(&mut deaf, &never);
        let method = if is_joint { joint } else { closed_form };
        method(sets.clone(), robot, options, &Origin::default(), &mut watch)
    };
    let mut trained = learn(&options);
    if matches!(trained, Err(TrainError::LatentDim { .. })) {
        options.encoder.least_std = 0.0;
        trained = learn(&options);
    }
    match trained {
        Ok(trained) => match Figures::of(&trained.report) {
            figures if figures.is_finite() => Outcome::Trained(figures),
            _ => Outcome::Refused("a prediction of 0.1 s diverges".to_owned()),
        },
        Err(error) => Outcome::Refused(error.to_string()),
    }
}

/// All jumps but every fifth, beginning with the one of the seed; all of them where that would leave none.
fn without_fold(recordings: &[Recording], seed: u64) -> Vec<Recording> {
    let fold = (seed.wrapping_sub(1) % FOLDS as u64) as usize;
    let kept = recordings
        .iter()
        .enumerate()
        .filter(|(i, _)| i % FOLDS != fold);
    let kept: Vec<Recording> = kept.map(|(_, recording)| recording.clone()).collect();
    if kept.is_empty() {
        recordings.to_vec()
    } else {
        kept
    }
}
