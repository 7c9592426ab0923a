//! Which trainings a study consists of.

use std::io;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::limits::table::SEEDS;
use crate::robot::STATE_DIM;
use crate::train::Method;

/// Seeds of the closed form leave out every jump whose number has this remainder of the seed.
pub(crate) const FOLDS: usize = 5;

/// The trainings of a study; parts of one study have equal plans.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    pub latent_dims: Vec<usize>,
    /// Seeds, counted from 1.
    pub seeds: usize,
    pub method: Method,
    /// The settings of the training as flags.
    pub settings: String,
    /// Digests of the recordings, training then validation.
    pub recordings: Vec<String>,
    /// Of all recordings, how many are for training.
    pub training: usize,
    pub romc: String,
}

/// One training of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CellId {
    pub latent_dim: usize,
    /// Seed, from 1.
    pub seed: u64,
}

impl Plan {
    pub fn check(&self) -> Result<(), StudyError> {
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

    /// All trainings, by dimension and then seed.
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
        is_part
            .then_some(Self { index, count })
            .ok_or_else(expected)
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
