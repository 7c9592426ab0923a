//! Training and validation jumps of one training.

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
