//! Training and validation jumps of one training.

use super::dataset::{Dataset, Quantity};
use super::error::TrainError;
use super::options::TrainOptions;
use super::subspace::Moments;
use crate::recording::Recording;
use crate::robot::Robot;

/// Recordings to learn from and to choose by.
#[derive(Clone, Copy, Debug)]
pub struct Recordings<'a> {
    /// Fitted.
    pub training: &'a [Recording],
    /// Used to choose between candidates; without any, the training recordings are.
    pub validation: &'a [Recording],
}

/// The recordings cut into phases, scaled.
pub(super) struct DataSets {
    pub training: Dataset,
    pub validation: Dataset,
}

impl DataSets {
    /// Cuts the recordings into phases, checks options and samples.
    pub fn new(
        recordings: Recordings<'_>,
        robot: &Robot,
        options: &TrainOptions,
    ) -> Result<Self, TrainError> {
        options.check()?;
        let (scaling, smoothing) = (options.scaling.factors(), options.regression.smoothing);
        let read = |set| Dataset::new(set, robot, &options.phases, &scaling, smoothing);
        let training = read(recordings.training)?;
        training.check_for_training()?;
        Ok(Self {
            training,
            validation: read(recordings.validation)?,
        })
    }

    /// Moments of the training samples.
    pub fn moments(&self) -> Moments {
        let gather = |quantity| self.training.gather(quantity, None);
        Moments::new(&gather(Quantity::X), &gather(Quantity::U))
    }

    /// The jumps that candidates are judged by.
    pub fn judged(&self) -> &Dataset {
        if self.validation.jumps.is_empty() {
            &self.training
        } else {
            &self.validation
        }
    }
}
