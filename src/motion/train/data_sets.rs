//! Training and validation jumps of one training.

use super::dataset::Dataset;
use crate::recording::Source;

/// Recordings to learn from and to choose by.
#[derive(Clone, Debug)]
pub struct Recordings<'a> {
    /// Fitted.
    pub training: Source<'a>,
    /// Used to choose between candidates; without any, the training recordings are.
    pub validation: Source<'a>,
}

impl<'a> Recordings<'a> {
    /// These recordings, each in memory or in files.
    pub fn new(training: impl Into<Source<'a>>, validation: impl Into<Source<'a>>) -> Self {
        Self {
            training: training.into(),
            validation: validation.into(),
        }
    }
}

/// The recordings cut into phases, scaled.
pub(super) struct DataSets {
    pub training: Dataset,
    pub validation: Dataset,
}

impl DataSets {
    /// The jumps that candidates are judged by.
    pub fn judged(&self) -> &Dataset {
        if self.validation.jumps.is_empty() {
            &self.training
        } else {
            &self.validation
        }
    }
}
