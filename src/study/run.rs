//! The trainings of a study, and their run on all cores.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::summary::Metrics;
use super::*;
use crate::limits::table::SEEDS;
use crate::recording::Recording;
use crate::robot::{Robot, STATE_DIM};
use crate::train::{Method, Monitor, Origin, Recordings, TrainError, TrainOptions, Trained};

/// Trains the cells of a shard that the store misses. Seeds of the joint method are random starts; the closed form
/// finds the same model from every start, so that its seeds leave out jumps. Where the mask leaves fewer coordinates
/// than the latent space has, it is lifted. No cell begins once `stop` is true.
pub(crate) fn run(
    store: &Store,
    shard: Shard,
    [training, validation]: [&[Recording]; 2],
    robot: &'static Robot,
    options: &TrainOptions,
    (finished, stop): (&(dyn Fn(CellId) + Sync), &AtomicBool),
) -> Result<()> {
    let missing = store.missing();
    let mut todo = shard.of(&store.plan.cells());
    todo.retain(|id| missing.contains(id));
    let method = store.plan.method;
    let next = AtomicUsize::new(0);
    let worker = || {
        while !stop.load(Ordering::Relaxed)
            && let Some(&id) = todo.get(next.fetch_add(1, Ordering::Relaxed))
        {
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

pub(crate) const FOLDS: usize = 5;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Plan {
    pub latent_dims: Vec<usize>,
    pub seeds: usize,
    pub method: Method,
    pub settings: String,
    /// Digests of the recordings, training then validation.
    pub recordings: Vec<String>,
    pub training: usize,
    pub romc: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CellId {
    pub latent_dim: usize,
    pub seed: u64,
}

impl Plan {
    pub(crate) fn check(&self) -> Result<()> {
        let refuse =
            |found: String, expected: &'static str| Err(StudyError::Range { found, expected });
        if self.latent_dims.is_empty() || self.seeds == 0 {
            let (dims, seeds) = (self.latent_dims.len(), self.seeds);
            let found = format!("{dims} latent dimensions and {seeds} seeds");
            return refuse(found, "at least one of each");
        }
        SEEDS.check_count(self.seeds)?;
        let mut dims = self.latent_dims.iter();
        match dims.find(|d| !(1..=STATE_DIM).contains(*d)) {
            Some(d) => refuse(format!("latent dimension {d}"), "1 to 18"),
            None => Ok(()),
        }
    }

    pub(crate) fn cells(&self) -> Vec<CellId> {
        let seeds = 1..=self.seeds as u64;
        let of = |&latent_dim: &usize| seeds.clone().map(move |seed| CellId { latent_dim, seed });
        self.latent_dims.iter().flat_map(of).collect()
    }
}

/// Part `index` (from 1) of `count` parts of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    index: usize,
    count: usize,
}

impl Shard {
    pub(crate) const WHOLE: Self = Self { index: 1, count: 1 };

    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let expected = || format!("found `{text}`, expected a part such as 3/8");
        let (index, count) = text.split_once('/').ok_or_else(expected)?;
        let number = |text: &str| text.parse::<usize>().map_err(|_| expected());
        let (index, count) = (number(index)?, number(count)?);
        let is_part = (1..=count).contains(&index);
        (is_part.then_some(Self { index, count })).ok_or_else(expected)
    }

    /// The cells of this part: every `count`-th, so that all parts have dimensions of all sizes.
    pub(crate) fn of(self, cells: &[CellId]) -> Vec<CellId> {
        let own = cells.iter().skip(self.index - 1).step_by(self.count);
        own.copied().collect()
    }
}

#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    #[error("{found}, expected {expected}")]
    Range {
        found: String,
        expected: &'static str,
    },
    #[error(transparent)]
    Seeds(#[from] crate::limits::OutOfRange),
    #[error(
        "{path}: belongs to another study ({difference} differ); choose another folder, or repeat the command that made it"
    )]
    OtherStudy {
        path: PathBuf,
        difference: &'static str,
    },
    #[error("{path}: {message}")]
    Broken { path: PathBuf, message: String },
    #[error("{first} and {second} are the same training with different results")]
    Contradiction { first: PathBuf, second: PathBuf },
    #[error("{path}: cannot {action}")]
    File {
        path: PathBuf,
        action: &'static str,
        source: io::Error,
    },
}
