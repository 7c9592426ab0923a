//! Accuracy against complexity: one training for every latent dimension and seed (figures 10 and 11 of the paper). A
//! `Plan` and recordings enter; a folder with one file per training leaves, so that a stopped study goes on and parts
//! can be joined, and their `Summary`. Read `run` first.

pub(crate) mod run;
mod store;
mod summary;

pub(crate) use run::Plan;
pub(crate) use run::{CellId, FOLDS, Shard, StudyError, run};
pub(crate) use store::Store;
pub(crate) use summary::{Cell, DimensionSummary, Spread, cell_table};
pub(crate) use summary::{Outcome, Summary};

use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::{Deserialize, Serialize};

type Result<T, E = StudyError> = std::result::Result<T, E>;
