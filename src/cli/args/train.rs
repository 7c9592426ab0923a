//! Arguments of `romc train`.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::*;
use crate::limits::table;
use crate::recording::preprocess::SavitzkyGolay;
use crate::recording::{Accelerations, PhaseRule, Recording, SmoothedRows};
use crate::train::{
    BodyEquations, BodyRows, Coordinates, Integrator, Method, MirrorImages, RecipePart, Split,
};

/// Widths of hidden layers in their order: `32,16`, or `linear` for none; a list of numbers in a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct Widths(pub Vec<usize>);

impl FromStr for Widths {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let each = table::LAYER_WIDTH.in_words();
        let widths = text.split(',').filter(|_| text != "linear");
        let widths = widths.map(|width| table::LAYER_WIDTH.parse(width));
        let widths: Result<Vec<usize>, String> = widths.collect();
        widths.map(Self).map_err(|_| {
            format!("found `{text}`, expected widths such as 32,16, or `linear`, each {each}")
        })
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub(crate) struct Finite(f64);

impl TryFrom<f64> for Finite {
    type Error = String;

    fn try_from(value: f64) -> Result<Self, String> {
        match value.is_finite() {
            true => Ok(Self(value)),
            false => Err(format!("found {value}, expected a finite number")),
        }
    }
}

impl From<Finite> for f64 {
    fn from(Finite(value): Finite) -> f64 {
        value
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum PhaseSet {
    /// contact (any foot down), flight
    #[value(alias = "contact-flight")]
    #[serde(alias = "contact-flight")]
    Jump,
    /// contact (a front foot down), rear (only rear feet), flight
    #[value(alias = "contact-rear-flight")]
    #[serde(alias = "contact-rear-flight")]
    JumpRear,
    /// fr_rl and fl_rr (diagonal pairs), all (other), flight
    Trot,
    /// fr_up, fl_up, rr_up, rl_up (one foot up), all (other)
    Crawl,
    /// The same as jump
    Pronk,
}

/// Least share of the samples with a diagonal pair alone, or with three feet, in which a trot or a crawl shows, and with
/// rear feet alone, in which a jump that leaves the ground with the front feet first does.
const GAIT_SHARE: f64 = 0.3;
const REAR_SHARE: f64 = 0.1;

impl PhaseSet {
    /// The motion that the contacts of recordings look like.
    pub(crate) fn of(recordings: &[Recording]) -> Self {
        let segments = recordings.iter().flat_map(|recording| &recording.segments);
        let feet: Vec<ContactFlags> = segments.flat_map(|segment| segment.feet.clone()).collect();
        let share = |of: fn(ContactFlags) -> bool| {
            let count = feet.iter().filter(|down| of(**down)).count();
            count as f64 / feet.len().max(1) as f64
        };
        if share(|[fr, fl, rr, rl]| fr == rl && fl == rr && fr != fl) >= GAIT_SHARE {
            Self::Trot
        } else if share(|feet| feet.iter().filter(|down| **down).count() == 3) >= GAIT_SHARE {
            Self::Crawl
        } else if share(|[fr, fl, rr, rl]| !fr && !fl && (rr || rl)) >= REAR_SHARE {
            Self::JumpRear
        } else {
            Self::Jump
        }
    }

    pub(crate) fn rule(self) -> PhaseRule {
        match self {
            Self::Jump | Self::Pronk => PhaseRule::two_phase(),
            Self::JumpRear => PhaseRule::three_phase(),
            Self::Trot => PhaseRule::trot(),
            Self::Crawl => PhaseRule::crawl(),
        }
    }
}

const MODEL: &str = "Model";
const METHOD: &str = "Learning";
const JOINT: &str = "Joint method";
const SIGNALS: &str = "Signals";
const SCALES: &str = "Scales and mask";

const USAGE: &str = "romc train [OPTIONS] --latent-dim <D> --output <MODEL.json> <RECORDING>...
       romc train [OPTIONS] --from <MODEL.json> --output <MODEL.json> <RECORDING>...";

const EXAMPLE: &str =
    "The example takes about 3 seconds. The joint method takes seconds to minutes per seed.

Example:
  romc train examples/recordings/go1/train_*.csv.gz \\
      --validation examples/recordings/go1/validation_*.csv.gz \\
      --latent-dim 4 --output my-model.json";

const SHORT: &str = "This is a selection: `romc train --help` lists all options.\n\n";

#[derive(Debug, Args)]
#[command(override_usage = USAGE)]
#[command(after_help = format!("{SHORT}{EXAMPLE}"), after_long_help = EXAMPLE)]
#[command(mut_arg("clock", |clock| clock.help(clock_help("repaired; recorded with --paper"))))]
pub(crate) struct TrainArguments {
    /// Recordings to learn from
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Recordings that choose among candidates [default: those of training]
    #[arg(long, help_heading = RECORDINGS, value_name = "RECORDING", num_args = 1..)]
    pub validation: Vec<PathBuf>,
    /// Recordings for final metrics only [default: none]
    #[arg(long, help_heading = RECORDINGS, value_name = "RECORDING", num_args = 1..)]
    pub test: Vec<PathBuf>,
    /// Shares of training, validation and test that divide the motions, such as 14,3,3 [default: none]
    #[arg(long, help_heading = RECORDINGS, value_name = "SHARES")]
    #[arg(conflicts_with_all = ["validation", "test"])]
    pub split: Option<Split>,
    #[command(flatten)]
    pub reading: ReadingArguments,
    #[command(flatten)]
    pub settings: TrainSettings,
    /// Settings by their names, as `latent-dim = 4`; options on the command line replace them [default: none]
    #[arg(long, help_heading = METHOD, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Refine the coefficients of this model on recordings of hardware or of another robot; encoder and decoder stay
    /// [default: none]
    #[arg(long, help_heading = METHOD, value_name = "MODEL.json")]
    pub from: Option<PathBuf>,
    /// The model file to write
    #[arg(long, help_heading = OUTPUT, value_name = "MODEL.json")]
    pub output: PathBuf,
    /// Name of the model [default: the file name of --output]
    #[arg(long, help_heading = OUTPUT)]
    pub name: Option<String>,
    /// Also print R^2 of accelerations per phase, and R^2 of deviations per part of a jump
    #[arg(long, help_heading = OUTPUT, conflicts_with = "from")]
    pub verbose: bool,
    /// Replace an existing output file
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

/// Settings of `romc train`; a setting that is not given keeps the default of the method.
#[derive(Debug, Default, Clone, PartialEq, Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub(crate) struct TrainSettings {
    /// Number of latent coordinates d [required, or in --config]
    #[arg(long, help_heading = MODEL, value_name = "D", value_parser = count(&table::LATENT_DIM))]
    #[arg(required_unless_present_any = ["config", "from"])]
    #[arg(display_order = 0)]
    pub latent_dim: Option<usize>,
    /// Method [default: closed-form; joint with --paper or an option under Joint method]
    #[arg(long, help_heading = METHOD, value_enum)]
    pub method: Option<Method>,
    /// Robot of the recordings: go1, go2, a1, or a .toml or .urdf file [default: go1; with --from that of the model]
    #[arg(long, help_heading = RECORDINGS, value_name = "ROBOT")]
    #[arg(value_parser = RobotParser, hide_possible_values = true)]
    pub robot: Option<String>,
    /// Train as in the paper by the joint method: motor torques, forces in body axes, one scale, no mask, no lift loss, Xi
    /// from ones
    #[arg(long, help_heading = METHOD)]
    pub paper: bool,
    /// Seed of all random choices [default: 1]
    #[arg(long, help_heading = METHOD, value_name = "N")]
    pub seed: Option<u64>,
    /// Number of seeds, counted from --seed; the best model is kept [default: 1; 3 with the joint method without --paper]
    #[arg(long, help_heading = METHOD, value_name = "N", value_parser = count(&table::SEEDS))]
    pub seeds: Option<usize>,
    /// Epochs of each training step, without those of its refinement [default: 501]
    #[arg(long, help_heading = JOINT, value_name = "N", value_parser = count(&table::EPOCHS))]
    pub epochs: Option<usize>,
    /// Widths of the encoder's hidden layers, such as 32,16, or `linear` [default: linear]
    #[arg(long, help_heading = JOINT, value_name = "WIDTHS")]
    pub encoder_layers: Option<Widths>,
    /// Widths of the decoder's hidden layers, or `linear` [default: those of the encoder in reverse order]
    #[arg(long, help_heading = JOINT, value_name = "WIDTHS")]
    #[arg(hide_short_help = true)]
    pub decoder_layers: Option<Widths>,
    /// Activation of the hidden layers: elu, tanh, sigmoid, relu, gelu, gelu-tanh, silu or softplus [default: elu]
    #[arg(long, help_heading = JOINT, value_name = "NAME", value_enum)]
    #[arg(hide_short_help = true)]
    #[arg(hide_possible_values = true)]
    pub activation: Option<Activation>,
    /// Weight of the input energy that the latent input cannot represent [default: 0.001; 0 with --paper]
    #[arg(long, help_heading = METHOD, value_name = "WEIGHT", value_parser = finite(&table::LIFT_WEIGHT))]
    #[arg(hide_short_help = true)]
    pub lift_weight: Option<Finite>,
    /// Weight of body x, y and z in the reconstruction error [default: 300; 1 with --paper]
    #[arg(long, help_heading = METHOD, value_name = "WEIGHT", value_parser = finite(&table::BODY_WEIGHT))]
    #[arg(hide_short_help = true)]
    pub body_weight: Option<Finite>,
    /// Weight of the loss over a window of predictions [default: 0]
    #[arg(long, help_heading = JOINT, value_name = "WEIGHT", value_parser = finite(&table::BPTT_WEIGHT))]
    #[arg(hide_short_help = true)]
    pub bptt_weight: Option<Finite>,
    /// Steps of that window [default: 5]
    #[arg(long, help_heading = JOINT, value_name = "N", value_parser = count(&table::BPTT_WINDOW))]
    #[arg(hide_short_help = true)]
    pub bptt_window: Option<usize>,
    /// Samples per step of that window [default: 5; 10 ms at 500 Hz]
    #[arg(long, help_heading = JOINT, value_name = "N", value_parser = count(&table::BPTT_STRIDE))]
    #[arg(hide_short_help = true)]
    pub bptt_stride: Option<usize>,
    /// Weight of a prediction relative to the previous one [default: 0.9]
    #[arg(long, help_heading = JOINT, value_name = "FACTOR", value_parser = finite(&table::BPTT_DECAY))]
    #[arg(hide_short_help = true)]
    pub bptt_decay: Option<Finite>,
    /// Integrator: euler, rk2 (midpoint rule) or rk4 [default: rk2]
    #[arg(long, help_heading = JOINT, value_name = "NAME", value_enum, hide_short_help = true)]
    #[arg(hide_possible_values = true)]
    pub bptt_integrator: Option<Integrator>,
    /// Relative increase of the validation error that is accepted for fewer terms [default: 0.1; 0.04 with rows of the
    /// legs, from d = 7]
    #[arg(long, help_heading = METHOD, value_name = "SHARE", value_parser = finite(&table::SLACK))]
    #[arg(hide_short_help = true)]
    pub slack: Option<Finite>,
    /// Refinements of coefficients by rollouts [default: 10; 0 with --paper]
    #[arg(long, help_heading = METHOD, value_name = "N", value_parser = count(&table::REFINEMENTS))]
    #[arg(hide_short_help = true)]
    pub refinements: Option<usize>,
    /// Largest growth rate of deviations in a phase and over all phases, in 1/s [default: 3; none with --paper]
    #[arg(long, help_heading = METHOD, value_name = "RATE", value_parser = finite(&table::GROWTH))]
    #[arg(hide_short_help = true)]
    pub growth: Option<Finite>,
    /// Highest degree of the polynomial candidate terms [default: 1]
    #[arg(long, help_heading = MODEL, value_name = "P")]
    #[arg(value_parser = |text: &str| table::DEGREE.parse::<u32>(text))]
    pub degree: Option<u32>,
    /// Add sines and cosines of z and dz, as --paper does
    #[arg(long, help_heading = MODEL)]
    pub trigonometric: bool,
    /// Candidate terms, separated by semicolons, such as "1; z1; dz1; u1; z1*dz2" [default: 1, z, dz and u]
    #[arg(long, help_heading = MODEL, value_name = "TERMS")]
    #[arg(conflicts_with_all = ["degree", "trigonometric"])]
    pub terms: Option<String>,
    /// Joint friction and rotor inertia to subtract from the torques: a file of `romc identify`, `identify` to estimate
    /// them, or `none` [default: identify; none with --paper; with --from those of the model]
    #[arg(long, help_heading = RECORDINGS, value_name = "FILE.toml")]
    pub actuators: Option<String>,
    /// Axes of force and moment in the inputs: ground, world, or body as in the paper. `ground` is `world` for feet that
    /// push and never pull [default: ground; body with --paper]
    #[arg(long, help_heading = MODEL, value_name = "FRAME", value_parser = wrench_frame)]
    #[arg(hide_short_help = true)]
    pub wrench_frame: Option<WrenchFrame>,
    /// Phases by the name of a motion [default: jump]
    #[arg(long, help_heading = MODEL, value_name = "MOTION", value_enum)]
    #[arg(display_order = 2)]
    pub phases: Option<PhaseSet>,
    /// Phases one by one: any, none, always, or foot patterns (fr fl rr rl) such as rear=0011,0001. Can be repeated; the
    /// first match counts [default: those of --phases]
    #[arg(long, help_heading = MODEL, value_name = "NAME=FEET", conflicts_with = "phases")]
    #[arg(display_order = 3)]
    pub phase: Option<Vec<PhasePattern>>,
    /// Leave out implausible samples, which `romc inspect` lists
    #[arg(long, help_heading = RECORDINGS)]
    pub leave_out_implausible: bool,
    /// Source of accelerations [default: recorded]
    #[arg(long, help_heading = SIGNALS, value_name = "SOURCE", value_enum, hide_short_help = true)]
    pub accelerations: Option<Accelerations>,
    /// Savitzky-Golay filter: window in samples and degree, such as 11,2 [default: none; 30 ms and degree 3 for all rows
    /// of recordings with rebuilt times]
    #[arg(long, help_heading = SIGNALS, value_name = "WINDOW,ORDER", hide_short_help = true)]
    pub smooth: Option<SavitzkyGolay>,
    /// Signals that --smooth filters [default: accelerations]
    #[arg(long, help_heading = SIGNALS, value_name = "ROWS", value_enum, hide_short_help = true)]
    pub smooth_rows: Option<SmoothedRows>,
    /// Window of the mean over accelerations within each phase [default: 11; 1 with --paper]
    #[arg(long, help_heading = SIGNALS, value_name = "N", value_parser = count(&table::MOVING_AVERAGE))]
    #[arg(hide_short_help = true)]
    pub moving_average: Option<usize>,
    /// Mask coordinates with a smaller standard deviation, in rad or m, except actuated ones [default: 0.015; 0 with
    /// --paper]
    #[arg(long, help_heading = SCALES, value_name = "STD", value_parser = finite(&table::MASK_STD))]
    #[arg(hide_short_help = true)]
    pub mask_std: Option<Finite>,
    /// Share of the input energy above which a coordinate counts as actuated [default: 0.005]
    #[arg(long, help_heading = SCALES, value_name = "SHARE", value_parser = finite(&table::MASK_INPUT_SHARE))]
    #[arg(hide_short_help = true)]
    pub mask_input_share: Option<Finite>,
    /// Rows of a linear encoder [default: named; free with --paper or hidden layers]
    #[arg(long, help_heading = MODEL, value_name = "KIND", value_enum)]
    #[arg(display_order = 1)]
    pub coordinates: Option<Coordinates>,
    /// Body coordinates with a latent coordinate of their own, a list with x and z, or all [default: x,z; x,z,pitch from d
    /// = 5; all with --phases trot or crawl from d = 6]
    #[arg(long, help_heading = MODEL, value_name = "LIST", hide_short_help = true)]
    pub body: Option<BodyRows>,
    /// Equations of these coordinates, shared by the phases or not [default: per-phase; all-phases with --phases trot or
    /// crawl from d = 6]
    #[arg(long, help_heading = MODEL, value_name = "KIND", value_enum, hide_short_help = true)]
    pub body_equations: Option<BodyEquations>,
    /// Mirror images of the training recordings [default: added with y, roll or yaw in --body; otherwise none]
    #[arg(long, help_heading = METHOD, value_name = "IMAGES", value_enum, hide_short_help = true)]
    pub mirror_images: Option<MirrorImages>,
    /// Parts of the recipe for named coordinates to leave out; docs/evaluation/training-choices.md states the effect of each [default: none]
    #[arg(long, help_heading = METHOD, value_enum, value_name = "PART", value_delimiter = ',')]
    #[arg(hide_short_help = true)]
    pub leave_out: Option<Vec<RecipePart>>,
    /// Keep the latent basis of the training, without varimax rotation
    #[arg(long, help_heading = MODEL, hide_short_help = true)]
    pub no_rotation: bool,
    /// Scaled units of the state per rad or m [default: 0.1]
    #[arg(long, help_heading = SCALES, value_name = "FACTOR", value_parser = finite(&table::STATE_SCALING))]
    #[arg(hide_short_help = true)]
    pub state_scaling: Option<Finite>,
    /// Scaled units of joint torques per N m [default: 0.1]
    #[arg(long, help_heading = SCALES, value_name = "FACTOR", value_parser = finite(&table::TORQUE_SCALING))]
    #[arg(hide_short_help = true)]
    pub torque_scaling: Option<Finite>,
    /// Scaled units of forces on the body per N [default: 0.005; 0.1 with --paper]
    #[arg(long, help_heading = SCALES, value_name = "FACTOR", value_parser = finite(&table::FORCE_SCALING))]
    #[arg(hide_short_help = true)]
    pub force_scaling: Option<Finite>,
    /// Scaled units of moments on the body per N m [default: 0.02; 0.05 with --wrench-frame body; 0.1 with --paper]
    #[arg(long, help_heading = SCALES, value_name = "FACTOR", value_parser = finite(&table::MOMENT_SCALING))]
    #[arg(hide_short_help = true)]
    pub moment_scaling: Option<Finite>,
}
