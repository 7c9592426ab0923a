//! Accuracy against complexity: one training for every latent dimension and seed (figures 10 and 11 of the paper).
//!
//! Enters: a `Plan` and recordings. Leaves: a folder with one file per training, each written whole, so that a stopped
//! study goes on where it was and parts computed on several machines can be joined; and their `Summary`. Read `plan`
//! first, then `run`.

pub mod run;
mod store;
mod summary;

pub use run::Plan;
pub(crate) use run::{CellId, FOLDS, Shard, StudyError, run};
pub(crate) use store::Store;
pub(crate) use summary::{Cell, DimensionSummary, Spread, cell_table};
pub use summary::{Outcome, Summary};
