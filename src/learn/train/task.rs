//! One training as every method sees it, checked before any map is learned.

use super::dataset::Dataset;
use super::error::TrainError;
use super::features::Features;
use super::frame::Frame;
use super::knowledge::Knowledge;
use super::options::TrainOptions;
use super::subspace::Moments;
use crate::model::Library;
use crate::recording::Recording;
use crate::robot::Robot;

/// Recordings to learn from and to choose by.
#[derive(Clone, Copy, Debug)]
pub struct Recordings<'a> {
    pub training: &'a [Recording],
    /// Used to choose between candidates; without any, the training recordings are.
    pub validation: &'a [Recording],
}

impl<'a> Recordings<'a> {
    pub fn new(training: &'a [Recording], validation: &'a [Recording]) -> Self {
        Self {
            training,
            validation,
        }
    }
}

pub(super) struct Task<'a> {
    /// The training recordings cut into phases, scaled.
    pub training: Dataset,
    /// The same of the validation recordings; may have no jump.
    pub validation: Dataset,
    pub moments: Moments,
    pub library: Library,
    pub features: Features,
    pub active: Vec<usize>,
    pub frame: Frame,
    /// What is known of the dynamics in its coordinates, one a phase.
    pub knowledge: Vec<Knowledge>,
    pub options: &'a TrainOptions,
    pub robot: &'static Robot,
}

impl<'a> Task<'a> {
    /// Checks the options, reads the data sets and cuts them into phases, and checks them against the options.
    pub(super) fn new(
        recordings: Recordings<'_>,
        robot: &'static Robot,
        options: &'a TrainOptions,
    ) -> Result<Self, TrainError> {
        options.check()?;
        let (scaling, smoothing) = (options.scaling.factors(), options.regression.smoothing);
        let rule = options.input_rule(robot);
        let read =
            |set: &[Recording]| Dataset::new(set, &rule, &options.phases, &scaling, smoothing);
        let training = read(recordings.training)?;
        training.check_for_training()?;
        let validation = read(recordings.validation)?;
        let moments = training.moments();
        let least_std = options.encoder.least_std * options.scaling.state;
        let active = moments.active_coordinates(least_std, options.encoder.least_input_share);
        let (coordinates, requested) = (options.coordinates(), options.latent_dim);
        let frame = Frame::new(&training, &active, requested, coordinates, robot);
        if requested == 0 || requested > frame.dim() {
            return Err(TrainError::LatentDim {
                requested,
                active: frame.dim(),
            });
        }
        let library = options.library()?;
        let features = Features::new(&library);
        Ok(Self {
            knowledge: Knowledge::of_phases(&training, &features, &frame),
            training,
            validation,
            moments,
            features,
            library,
            active,
            frame,
            options,
            robot,
        })
    }
}
