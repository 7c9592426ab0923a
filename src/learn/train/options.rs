//! Options of a training.

use clap::ValueEnum;

use super::frame::has_leg_rows;
use super::joint::{LossWeights, Schedule};
use super::recipe::RecipePart;
use super::*;
use crate::limits::table;
use crate::model::{Activation, LibraryChoice, MAX_LAYERS, StandardLibrary, check_name};
use crate::recording::CHATTER_SAMPLES;
use crate::recording::preprocess::BATCH_ROWS;
use crate::robot::{Actuators, JOINT_NAMES};

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Least-squares problems, one after the other; seconds
    ClosedForm,
    /// All parts together by Adam, as in the paper; minutes
    Joint,
}

impl Method {
    /// Learns a model, deterministically. A cancelled training ends with the seeds that have begun.
    ///
    /// # Errors
    /// [`TrainError`]: options out of range, too few samples, no stable model, or cancellation before the first seed.
    pub fn learn(
        self,
        recordings: Recordings<'_>,
        robot: &'static Robot,
        options: &TrainOptions,
        origin: &Origin,
        monitor: &mut Monitor<'_>,
    ) -> Result<Trained> {
        match self {
            Self::ClosedForm => {
                closed_form::closed_form(recordings, robot, options, origin, monitor)
            }
            Self::Joint => joint::run::joint(recordings, robot, options, origin, monitor),
        }
    }
}

/// Settings of the training; [`TrainOptions::new`] gives the defaults for a latent dimension.
#[derive(Clone, Debug)]
pub struct TrainOptions {
    pub name: String,
    pub latent_dim: usize,
    /// Candidate terms. The default is 1, `z`, `dz` and `u`.
    pub library: Option<LibraryChoice>,
    pub phases: PhaseRule,
    pub seed: u64,
    /// How many seeds are tried, counting up from `seed`; the best is kept.
    pub n_seeds: usize,
    pub scaling: ScaleOptions,
    /// Losses of the joints that are subtracted from the recorded torques; none if the motors' torques count.
    pub actuators: Option<Actuators>,
    pub wrench_frame: WrenchFrame,
    pub encoder: EncoderOptions,
    pub regression: RegressionOptions,
    pub joint: JointOptions,
}

#[derive(Clone, Debug, PartialEq)]
pub struct JointOptions {
    pub schedule: Schedule,
    pub weights: LossWeights,
    pub xi_start: f64,
    /// Seeds trained at the same time; the result does not depend on it.
    pub threads: usize,
    /// Window of the loss over predictions, which counts only if `weights.bptt` is not 0.
    pub unroll: Unroll,
    pub transfer: Transfer,
    pub maps: MapOptions,
}

/// Widths of the hidden layers of encoder and decoder, which end with a linear layer; without any both are affine maps.
#[derive(Clone, Debug, PartialEq)]
pub struct MapOptions {
    pub encoder_layers: Vec<usize>,
    pub decoder_layers: Vec<usize>,
    pub activation: Activation,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transfer {
    /// The published steps by Adam: decoder on whole jumps, then Xi of every phase.
    Published,
    /// Rotation of the basis, least-squares decoder, Xi chosen among regressions by rollouts.
    Chosen,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EncoderOptions {
    /// Weight of the lift loss, the input energy that the latent input cannot carry, against the reconstruction error.
    pub lift_weight: f64,
    /// Weight of the three body positions in the reconstruction error, or of all body coordinates if `body` has lateral
    /// ones; the others have 1.
    pub body_weight: f64,
    /// Coordinates with a smaller standard deviation (rad or m) are masked unless they are actuated.
    pub least_std: f64,
    /// Coordinates with a larger share of the input's energy count as actuated.
    pub least_input_share: f64,
    pub rotate: bool,
    pub coordinates: Coordinates,
    /// Body coordinates with a row of their own, if coordinates are named.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<BodyRows>,
    /// Whether mirror images of the training recordings count as recordings.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mirror_images: Option<MirrorImages>,
    pub restarts: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum MirrorImages {
    /// Each recording again with left and right exchanged
    Added,
    /// No mirror images
    None,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum BodyEquations {
    /// Own equations in each phase; free fall in flight
    PerPhase,
    /// The same in all phases on the ground; free fall in flight
    AllPhases,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Coordinates {
    /// Centre of mass, joints and pitch; from d = 5 rotation, from d = 7 foot positions. The dynamics obey known physics
    Named,
    /// Any rows over coordinates that move or are actuated
    Free,
}

#[derive(Clone, Debug, PartialEq)]
pub struct RegressionOptions {
    pub smoothing: usize,
    /// Parts of the recipe for named coordinates that are left out.
    pub leave_out: Vec<RecipePart>,
    pub body_equations: BodyEquations,
    /// Of all candidates within this share of the best validation score, the one with the fewest terms is chosen.
    pub slack: f64,
    /// Steps by which rollouts of the training jumps refine the coefficients chosen; 0 leaves the regression's.
    pub refinements: usize,
    /// Largest rate in 1/s at which deviations may grow, in every phase and through their sequence; none for no bound.
    pub growth_per_s: Option<f64>,
}

impl TrainOptions {
    pub fn new(name: impl Into<String>, latent_dim: usize) -> Self {
        Self {
            name: name.into(),
            latent_dim,
            library: None,
            phases: PhaseRule::two_phase().with_min_samples(CHATTER_SAMPLES),
            seed: 1,
            n_seeds: 1,
            scaling: ScaleOptions::in_frame(WrenchFrame::Ground),
            actuators: None,
            wrench_frame: WrenchFrame::Ground,
            encoder: EncoderOptions {
                lift_weight: 1e-3,
                body_weight: 300.0,
                least_std: 0.015,
                least_input_share: 0.005,
                rotate: true,
                coordinates: Coordinates::Named,
                body: None,
                mirror_images: None,
                restarts: 4,
            },
            regression: RegressionOptions {
                smoothing: 11,
                leave_out: Vec::new(),
                body_equations: BodyEquations::PerPhase,
                slack: slack(&BodyRows::of_dim(latent_dim), latent_dim),
                refinements: 10,
                growth_per_s: Some(3.0),
            },
            joint: JointOptions::by_the_author(),
        }
    }

    /// Sets the body coordinates with a row of their own.
    pub fn set_body(&mut self, body: BodyRows) {
        self.regression.slack = slack(&body, self.latent_dim);
        self.encoder.body = Some(body);
    }

    /// The body coordinates with a row of their own, if coordinates are named.
    pub(super) fn body(&self) -> BodyRows {
        let given = self.encoder.body.clone();
        given.unwrap_or_else(|| BodyRows::of_dim(self.latent_dim))
    }

    /// Whether mirror images count: by default those of models that contain y, roll or yaw as rows.
    pub(super) fn mirror_images(&self) -> MirrorImages {
        let spatial = self.coordinates() == Coordinates::Named && self.body().is_spatial();
        match self.encoder.mirror_images {
            None if spatial => MirrorImages::Added,
            given => given.unwrap_or(MirrorImages::None),
        }
    }

    pub fn input_rule(&self, robot: &'static Robot) -> InputRule {
        InputRule::new(robot, self.actuators.clone(), self.wrench_frame)
    }

    /// The settings of the paper: motors' torques, forces in the body's axes, one scale, no mask, no lift loss,
    /// accelerations as recorded. Also Xi from ones, the published library and transfer steps.
    pub fn paper(name: impl Into<String>, latent_dim: usize) -> Self {
        let mut options = Self::new(name, latent_dim);
        options.library = Some(LibraryChoice::Standard(StandardLibrary::default()));
        options.scaling = ScaleOptions::uniform(0.1);
        options.wrench_frame = WrenchFrame::Body;
        let encoder = &mut options.encoder;
        (encoder.lift_weight, encoder.body_weight, encoder.least_std) = (0.0, 1.0, 0.0);
        (encoder.rotate, encoder.coordinates) = (false, Coordinates::Free);
        let regression = &mut options.regression;
        (regression.smoothing, regression.refinements) = (1, 0);
        regression.growth_per_s = None;
        let joint = &mut options.joint;
        (joint.xi_start, joint.transfer) = (1.0, Transfer::Published);
        options
    }

    /// The coordinates of the encoder's rows: networks have no fixed rows, so theirs are free.
    pub fn coordinates(&self) -> Coordinates {
        match self.joint.maps.is_linear() {
            true => self.encoder.coordinates,
            false => Coordinates::Free,
        }
    }

    pub(crate) fn seeds(&self) -> Vec<u64> {
        let count = self.n_seeds.max(1) as u64;
        (0..count).map(|i| self.seed.wrapping_add(i)).collect()
    }

    pub(crate) fn library(&self) -> Result<Library> {
        let choice = match &self.library {
            Some(given) => given.clone(),
            None => LibraryChoice::Standard(StandardLibrary {
                degree: 1,
                trigonometric: false,
                inputs: true,
            }),
        };
        let library = Library::of(self.latent_dim, choice)?;
        library.check_distinct()?;
        Ok(library)
    }

    /// # Errors
    /// [`TrainError::Range`] or [`TrainError::Option`] naming the first setting out of range, [`TrainError::Model`] for
    /// a name that no model can have.
    pub fn check(&self) -> Result<()> {
        check_name(&self.name)?;
        let (encoder, regression) = (&self.encoder, &self.regression);
        table::LIFT_WEIGHT.check(encoder.lift_weight)?;
        table::BODY_WEIGHT.check(encoder.body_weight)?;
        table::MASK_STD.check(encoder.least_std)?;
        table::MASK_INPUT_SHARE.check(encoder.least_input_share)?;
        table::SEEDS.check_count(self.n_seeds.max(1))?;
        let body = self.body();
        if !body.fits(self.latent_dim) {
            let rows = body.coordinates.len();
            return Err(TrainError::Option {
                option: "body",
                found: format!("{rows} rows with {} latent coordinates", self.latent_dim),
                expected: "at least as many latent coordinates as rows",
            });
        }
        table::MOVING_AVERAGE.check_count(regression.smoothing)?;
        self.joint.maps.check(self.latent_dim)?;
        self.joint.check_predictions()?;
        table::SLACK.check(regression.slack)?;
        if let Some(rate) = regression.growth_per_s {
            table::GROWTH.check(rate)?;
        }
        table::STATE_SCALING.check(self.scaling.state)?;
        table::TORQUE_SCALING.check(self.scaling.torque)?;
        table::FORCE_SCALING.check(self.scaling.force)?;
        table::MOMENT_SCALING.check(self.scaling.moment)?;
        if let Some((array, joint, found)) = self.actuators.as_ref().and_then(Actuators::unusable) {
            return Err(TrainError::Option {
                option: "actuators",
                found: format!("{array} {found} at {}", JOINT_NAMES[joint]),
                expected: "finite numbers of at least 0",
            });
        }
        Ok(())
    }
}

/// Smaller with rows of the legs, because the score includes them and their terms are not dropped.
fn slack(body: &BodyRows, latent_dim: usize) -> f64 {
    if has_leg_rows(body, latent_dim) {
        0.04
    } else {
        0.1
    }
}

impl JointOptions {
    /// The author's schedule, weights and window (five steps of 10 ms); Xi starts at 0, all cores.
    fn by_the_author() -> Self {
        Self {
            schedule: Schedule {
                epochs: 501,
                refinement: 101,
                threshold: 0.01,
                threshold_every: 100,
                learning_rate: 1e-3,
            },
            weights: LossWeights {
                ddz: 1e-4,
                ddx: 1e-6,
                l1: 1e-6,
                lift: 0.0,
                bptt: 0.0,
            },
            xi_start: 0.0,
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            unroll: Unroll {
                window: 5,
                stride: 5,
                decay: 0.9,
                integrator: Integrator::Rk2,
            },
            transfer: Transfer::Chosen,
            maps: MapOptions {
                encoder_layers: Vec::new(),
                decoder_layers: Vec::new(),
                activation: Activation::Elu,
            },
        }
    }

    /// Reports a window of predictions out of range; a window longer than every batch would have no effect.
    fn check_predictions(&self) -> Result<()> {
        table::BPTT_WEIGHT.check(self.weights.bptt)?;
        let (window, stride) = (self.unroll.window, self.unroll.stride);
        table::BPTT_WINDOW.check_count(window)?;
        table::BPTT_STRIDE.check_count(stride)?;
        table::BPTT_DECAY.check(self.unroll.decay)?;
        let reach = window.checked_mul(stride);
        if self.weights.bptt > 0.0 && reach.is_none_or(|reach| reach >= BATCH_ROWS) {
            return Err(TrainError::Option {
                option: "bptt-window times bptt-stride",
                found: format!("{window} x {stride} with batches of {BATCH_ROWS}"),
                expected: "fewer samples than a batch has",
            });
        }
        Ok(())
    }
}

impl MapOptions {
    pub fn is_linear(&self) -> bool {
        self.encoder_layers.is_empty() && self.decoder_layers.is_empty()
    }

    fn check(&self, latent_dim: usize) -> Result<()> {
        let each = [
            ("encoder-layers", &self.encoder_layers, latent_dim.max(1)),
            ("decoder-layers", &self.decoder_layers, 1),
        ];
        for (option, widths, least) in each {
            let expected = if widths.len() >= MAX_LAYERS {
                "at most 15 hidden layers"
            } else if widths
                .iter()
                .any(|width| *width as f64 > table::LAYER_WIDTH.most)
            {
                "layers of at most 1024 units"
            } else if widths.iter().any(|width| *width < least) {
                "layers at least as wide as the latent space"
            } else {
                continue;
            };
            return Err(TrainError::Option {
                option,
                found: format!("{widths:?}"),
                expected,
            });
        }
        Ok(())
    }
}

impl RegressionOptions {
    pub(super) fn has(&self, part: RecipePart) -> bool {
        !self.leave_out.contains(&part)
    }
}

impl EncoderOptions {
    pub(super) fn coordinate_weights(&self) -> DVector<f64> {
        let spatial = self.body.as_ref().is_some_and(BodyRows::is_spatial);
        let heavy = if spatial { STATE_DIM } else { BODY_Z + 1 };
        DVector::from_fn(STATE_DIM, |i, _| match (BODY_X..heavy).contains(&i) {
            true => self.body_weight,
            false => 1.0,
        })
    }
}
