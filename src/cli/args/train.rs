//! Arguments of `romc train` and `romc study`.

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::*;
use crate::limits::table;
use crate::recording::preprocess::SavitzkyGolay;
use crate::recording::{Accelerations, PhaseRule, Recording, SmoothedRows};
use crate::study::Shard;
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
    /// contact (any foot down) and flight
    #[value(alias = "contact-flight")]
    #[serde(alias = "contact-flight")]
    Jump,
    /// contact (a front foot down), rear (only rear feet down) and flight
    #[value(alias = "contact-rear-flight")]
    #[serde(alias = "contact-rear-flight")]
    JumpRear,
    /// fr_rl and fl_rr (a diagonal pair, or one foot of it), all (any other contact) and flight
    Trot,
    /// fr_up, fl_up, rr_up and rl_up (one foot in the air) and all (any other contact)
    Crawl,
    /// As jump
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

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc train examples/recordings/go1/train_*.csv.gz \\\n      --validation examples/recordings/go1/validation_*.csv.gz \\\n      --latent-dim 4 --method closed-form --output my-model.json"
)]
pub(crate) struct TrainArguments {
    /// Recordings to learn from
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Recordings that choose between candidate models
    #[arg(long, value_name = "RECORDING", num_args = 1..)]
    pub validation: Vec<PathBuf>,
    /// Recordings that training does not see; metrics of the finished model on them are reported
    #[arg(long, value_name = "RECORDING", num_args = 1..)]
    pub test: Vec<PathBuf>,
    /// Divide the jumps by these shares for training, validation and test, such as 14,3,3
    #[arg(long, value_name = "SHARES", conflicts_with_all = ["validation", "test"])]
    pub split: Option<Split>,
    /// Refine this model on recordings of hardware, or of another robot (--robot): encoder and decoder stay, coefficients
    /// of its equations change where left-out parts are predicted better
    #[arg(long, value_name = "MODEL.json")]
    pub from: Option<PathBuf>,
    /// The model file to write
    #[arg(long, value_name = "MODEL.json")]
    pub output: PathBuf,
    /// Settings by their names below, as `latent-dim = 4`; flags given here override them
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    #[command(flatten)]
    pub settings: TrainSettings,
    /// Name of the model; the output file's stem unless given
    #[arg(long)]
    pub name: Option<String>,
    /// Replace an existing output file
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
    #[command(flatten)]
    pub reading: ReadingArguments,
}

/// Settings of `romc train`; what is not given keeps the default of the method.
#[derive(Debug, Default, Clone, PartialEq, Args, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub(crate) struct TrainSettings {
    /// Number of latent coordinates d
    #[arg(long, value_name = "D", required_unless_present_any = ["config", "from"], value_parser = count(&table::LATENT_DIM))]
    pub latent_dim: Option<usize>,
    /// How to learn (closed-form unless given)
    #[arg(long, value_enum)]
    pub method: Option<Method>,
    /// Robot that made the recordings: go1 (unless given), go2, a1, or a .toml or .urdf file
    #[arg(long, value_name = "ROBOT", value_parser = RobotParser, hide_possible_values = true)]
    pub robot: Option<String>,
    /// Train exactly as published: motor torques, forces in the body's axes, one scale, no mask, no lift loss, Xi from
    /// ones (joint method)
    #[arg(long)]
    pub paper: bool,
    /// Seed of all random choices
    #[arg(long)]
    pub seed: Option<u64>,
    /// Seeds to try, counting up from the seed; the best is kept (1 unless given, joint method 3)
    #[arg(long, value_parser = count(&table::SEEDS))]
    pub seeds: Option<usize>,
    /// Epochs of a step, refinement not counted (joint method)
    #[arg(long, value_parser = count(&table::EPOCHS))]
    pub epochs: Option<usize>,
    /// Widths of the encoder's hidden layers, such as 32,16; a linear layer to z follows (joint method)
    #[arg(long, value_name = "WIDTHS")]
    pub encoder_layers: Option<Widths>,
    /// Widths of the decoder's hidden layers, or `linear` (those of the encoder backwards unless given)
    #[arg(long, value_name = "WIDTHS")]
    pub decoder_layers: Option<Widths>,
    /// Activation of the hidden layers (elu unless given)
    #[arg(long, value_enum)]
    pub activation: Option<Activation>,
    /// Weight of the input energy that the latent input does not represent
    #[arg(long, value_name = "WEIGHT", value_parser = finite(&table::LIFT_WEIGHT))]
    pub lift_weight: Option<Finite>,
    /// Weight of body x, y, z in the reconstruction error
    #[arg(long, value_name = "WEIGHT", value_parser = finite(&table::BODY_WEIGHT))]
    pub body_weight: Option<Finite>,
    /// Weight of the loss over a window of predictions, 0 for none (joint method)
    #[arg(long, value_name = "WEIGHT", value_parser = finite(&table::BPTT_WEIGHT))]
    pub bptt_weight: Option<Finite>,
    /// Steps of that window (5 unless given)
    #[arg(long, value_name = "STEPS", value_parser = count(&table::BPTT_WINDOW))]
    pub bptt_window: Option<usize>,
    /// Samples per step of that window (5 unless given: 10 ms at 500 Hz)
    #[arg(long, value_name = "SAMPLES", value_parser = count(&table::BPTT_STRIDE))]
    pub bptt_stride: Option<usize>,
    /// Weight of a prediction relative to the previous one (0.9 unless given)
    #[arg(long, value_name = "FACTOR", value_parser = finite(&table::BPTT_DECAY))]
    pub bptt_decay: Option<Finite>,
    /// How predictions are integrated (rk2 unless given)
    #[arg(long, value_enum)]
    pub bptt_integrator: Option<Integrator>,
    /// Accepted increase of the validation error for fewer terms, as a share of the least error
    #[arg(long, value_name = "SHARE", value_parser = finite(&table::SLACK))]
    pub slack: Option<Finite>,
    /// Steps by which rollouts of the training jumps refine the chosen coefficients; 0 leaves those of the regression
    /// (10 unless given, 0 with --paper)
    #[arg(long, value_name = "STEPS", value_parser = count(&table::REFINEMENTS))]
    pub refinements: Option<usize>,
    /// Bound on the rate at which deviations grow, in every phase and through their sequence, 1/s (3 unless given, none
    /// with --paper)
    #[arg(long, value_name = "RATE", value_parser = finite(&table::GROWTH))]
    pub growth: Option<Finite>,
    /// Highest degree of the polynomial candidate terms [default: 1]
    #[arg(long, value_name = "P", value_parser = |text: &str| table::DEGREE.parse::<u32>(text))]
    pub degree: Option<u32>,
    /// Add sines and cosines of z and dz to the candidate terms
    #[arg(long)]
    pub trigonometric: bool,
    /// Custom candidate terms, separated by semicolons: "1; z1; dz1; u1; z1*dz2"
    #[arg(long, value_name = "TERMS", conflicts_with_all = ["degree", "trigonometric"])]
    pub terms: Option<String>,
    /// Friction and inertia of the joints, taken from the torques: a file with a table `actuators`, `identify` for what
    /// the training recordings tell (as `romc identify` does), or `none` (identify unless given, none with --paper)
    #[arg(long, value_name = "FILE.toml")]
    pub actuators: Option<String>,
    /// Axes of force and moment in the inputs: `world`, or `body` as published. `ground` is `world` of feet that only push,
    /// without the rotors' inertia as a loss in flight [default: ground, with --paper body]
    #[arg(long, value_name = "FRAME", value_parser = wrench_frame)]
    pub wrench_frame: Option<WrenchFrame>,
    /// Phases of the model, by the name of a motion [default: jump]
    #[arg(long, value_enum)]
    pub phases: Option<PhaseSet>,
    /// Phases of the model, one by one: any, none, always, or foot patterns (fr fl rr rl) such as rear=0011,0001; can be
    /// repeated, the first match wins
    #[arg(long, value_name = "NAME=FEET", conflicts_with = "phases")]
    pub phase: Option<Vec<PhasePattern>>,
    /// Leave out physically implausible samples (`romc inspect` lists them)
    #[arg(long)]
    pub leave_out_implausible: bool,
    /// Where accelerations come from (recorded unless given)
    #[arg(long, value_enum)]
    pub accelerations: Option<Accelerations>,
    /// Savitzky-Golay filter over each jump: samples of the window and degree, such as 11,2
    #[arg(long, value_name = "WINDOW,ORDER")]
    pub smooth: Option<SavitzkyGolay>,
    /// Signals that the filter is applied to (accelerations unless given)
    #[arg(long, value_enum)]
    pub smooth_rows: Option<SmoothedRows>,
    /// Window of the mean over accelerations within each phase (11 unless given, 1 with --paper)
    #[arg(long, value_name = "SAMPLES", value_parser = count(&table::MOVING_AVERAGE))]
    pub moving_average: Option<usize>,
    /// Coordinates with a smaller standard deviation (rad or m) are masked unless actuated; 0 for no mask
    #[arg(long, value_name = "STD", value_parser = finite(&table::MASK_STD))]
    pub mask_std: Option<Finite>,
    /// Coordinates with a larger share of the input's energy count as actuated
    #[arg(long, value_name = "SHARE", value_parser = finite(&table::MASK_INPUT_SHARE))]
    pub mask_input_share: Option<Finite>,
    /// Rows of a linear encoder: named (the centre of mass, then joints and pitch, left and right alike, from 7 on
    /// also rotation and feet; the dynamics obey Newton's second law and the invariances) or free [default: named;
    /// free with --paper or hidden layers]
    #[arg(long, value_name = "KIND")]
    pub coordinates: Option<Coordinates>,
    /// Body coordinates whose momentum is a coordinate of its own, by flights or else by forces: a list with x and z of x,
    /// y, z, roll, pitch and yaw, or all. With y, roll or yaw left and right may differ [default: x,z; from 5 coordinates
    /// on x,z,pitch; with --phases trot or crawl from 6 on all]
    #[arg(long, value_name = "LIST")]
    pub body: Option<BodyRows>,
    /// Whether equations of these coordinates are one for all phases [default: per-phase, with --phases trot or crawl
    /// all-phases]
    #[arg(long, value_enum)]
    pub body_equations: Option<BodyEquations>,
    /// Whether mirror images of the training recordings count as recordings, legs exchanged [default: added with y, roll
    /// or yaw in --body, otherwise none]
    #[arg(long, value_enum)]
    pub mirror_images: Option<MirrorImages>,
    /// Parts of the recipe for named coordinates to leave out; docs/learning.md has the effect of each
    #[arg(
        long,
        value_enum,
        value_name = "PART",
        value_delimiter = ',',
        hide_short_help = true
    )]
    pub leave_out: Option<Vec<RecipePart>>,
    /// Keep the latent basis as trained, without varimax rotation
    #[arg(long)]
    pub no_rotation: bool,
    /// Scaled units of the state in one rad or m (0.1 unless given)
    #[arg(long, value_name = "FACTOR", value_parser = finite(&table::STATE_SCALING))]
    pub state_scaling: Option<Finite>,
    /// Scaled units of joint torques in one N m (0.1 unless given)
    #[arg(long, value_name = "FACTOR", value_parser = finite(&table::TORQUE_SCALING))]
    pub torque_scaling: Option<Finite>,
    /// Scaled units of forces on the body in one N (0.005 unless given, 0.1 with --paper)
    #[arg(long, value_name = "FACTOR", value_parser = finite(&table::FORCE_SCALING))]
    pub force_scaling: Option<Finite>,
    /// Scaled units of moments on the body in one N m (0.02 unless given, 0.05 in the body's axes, 0.1 with --paper)
    #[arg(long, value_name = "FACTOR", value_parser = finite(&table::MOMENT_SCALING))]
    pub moment_scaling: Option<Finite>,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc study examples/recordings/go1/train_*.csv.gz \\\n      --validation examples/recordings/go1/validation_*.csv.gz --latent-dims 1..18 --seeds 5\n\nA stopped study goes on when the same command is given again. On a cluster, `--shard 3/8` computes a part,\n`romc study --merge part1 part2 --out-dir whole` joins parts."
)]
pub(crate) struct StudyArguments {
    /// Recordings to learn from
    #[arg(value_name = "RECORDING", required_unless_present = "merge")]
    pub recordings: Vec<PathBuf>,
    /// Recordings that choose between candidate models and give the metrics
    #[arg(long, value_name = "RECORDING", num_args = 1..)]
    pub validation: Vec<PathBuf>,
    /// Latent dimensions: `4`, `1..18` (both ends counted) or `2,4,6`
    #[arg(long, value_name = "DIMS", default_value = "1..18", value_parser = dimensions)]
    pub latent_dims: Dimensions,
    /// Seeds per dimension
    #[arg(long, default_value_t = 5, value_parser = count(&table::SEEDS))]
    pub seeds: usize,
    /// How to learn (closed-form unless given)
    #[arg(long, value_enum)]
    pub method: Option<Method>,
    /// Train as published (joint method)
    #[arg(long)]
    pub paper: bool,
    /// Robot of the recordings: go1, go2, a1, or a .toml or .urdf file (go1 unless given)
    #[arg(long, value_name = "ROBOT", value_parser = RobotParser, hide_possible_values = true)]
    pub robot: Option<String>,
    /// Settings of `romc train`, except `latent-dim`, `seed` and `seeds`
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Weight of the complexity in the combined loss 2 E_dec + 2 lambda log |Xi|
    #[arg(long, default_value_t = crate::evaluate::LAMBDA, value_parser = real(&table::LAMBDA))]
    pub lambda: f64,
    /// Compute only this part of the study, such as 3/8
    #[arg(long, value_name = "PART", value_parser = Shard::parse, conflicts_with = "merge")]
    pub shard: Option<Shard>,
    /// Join the finished parts in these folders instead of training
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["recordings", "validation", "config", "latent_dims", "seeds", "method", "paper", "robot"])]
    pub merge: Vec<PathBuf>,
    /// Folder of the study
    #[arg(long, value_name = "DIR", default_value = "out/study")]
    pub out_dir: PathBuf,
    /// Replace tables and figures of these names that romc did not make
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
    #[command(flatten)]
    pub reading: ReadingArguments,
}

/// Latent dimensions of a study, ascending.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Dimensions(pub Vec<usize>);

fn dimensions(text: &str) -> Result<Dimensions, String> {
    let expected =
        || format!("found `{text}`, expected 4, 1..18 or 2,4,6, each from 1 to {STATE_DIM}");
    let number = |text: &str| match text.trim().parse::<usize>() {
        Ok(d) if (1..=STATE_DIM).contains(&d) => Ok(d),
        _ => Err(expected()),
    };
    let mut found = match text.split_once("..") {
        Some((first, last)) => (number(first)?..=number(last)?).collect(),
        None => text.split(',').map(number).collect::<Result<Vec<_>, _>>()?,
    };
    found.sort_unstable();
    match found.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(&[twice, _]) => Err(format!(
            "found {twice} twice in `{text}`, expected each once"
        )),
        _ if found.is_empty() => Err(expected()),
        _ => Ok(Dimensions(found)),
    }
}
