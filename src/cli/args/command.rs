//! The program, its commands and their options; those of `compile`, `import` and `train` have files of their own.

use super::compile::CompileArguments;
use super::import::ImportArguments;
use super::train::{StudyArguments, TrainArguments};
use super::*;
use crate::evaluate::ReferenceInput;
use crate::limits::table::{
    APEX, DISTANCE, DURATION, HORIZON, RESTART_EVERY, SPEED, STEP, TORQUE_RATE, YAW_RATE,
};

/// The reduced-order model compiler: from recorded jumps to equations, code and torques.
#[derive(Debug, Parser)]
#[command(
    name = "romc",
    version,
    propagate_version = true,
    after_help = "Start with `romc demo`. `romc <command> --help` explains a command with an example."
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Print one JSON object to stdout and nothing else there
    #[arg(long, global = true, help_heading = None)]
    pub json: bool,
}

/// One of romc's commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// The main job on the shipped model and recordings: equations, code, rollouts, controller
    Demo(DemoArguments),
    /// Describe a recording or a model, and list what is implausible in it
    Inspect(InspectArguments),
    /// Write recordings, or logs of other programs, as CSV or MCAP
    Convert(ConvertArguments),
    /// Find gravity, mass and the joints' losses in recordings
    Identify(IdentifyArguments),
    /// Learn a model from recordings
    Train(Box<TrainArguments>),
    /// Train every latent dimension with several seeds: accuracy against complexity
    Study(StudyArguments),
    /// Take over a model trained elsewhere: safetensors, npz, PySINDy, equations as text
    Import(ImportArguments),
    /// Show a robot, or what a TOML or URDF file says of one
    Robot(RobotArguments),
    /// Prove that two models, equation files or LaTeX papers say the same, or show where they differ
    Check(CheckArguments),
    /// Compile a model to equations, code (C, Rust, Python, MATLAB) or a controller
    Compile(CompileArguments),
    /// Roll a model out over recordings and measure how far it drifts
    Simulate(SimulateArguments),
    /// Run the latent-space controller along a recording
    Mpc(MpcArguments),
    /// Plan a jump that nobody recorded, as a recording
    Plan(PlanArguments),
    /// Put equations, errors, baselines and the controller's torques on one HTML page
    Report(ReportArguments),
    /// Write man pages, one per command
    Manual(ManualArguments),
    /// Print completions for a shell
    Completions(CompletionsArguments),
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  romc demo --out-dir out/demo")]
pub(crate) struct DemoArguments {
    /// Folder for the files of the demo
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    pub out_dir: PathBuf,
    /// Also print every metric of every jump
    #[arg(long)]
    pub verbose: bool,
    /// Write into a folder that holds files romc did not make
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc inspect models/go1-d4.json examples/recordings/go1/test_01.csv.gz\n  romc inspect --guess my-log.csv > my-log.toml"
)]
pub(crate) struct InspectArguments {
    /// Models (`.json`) and recordings (`.csv`, `.csv.gz`)
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Robot whose limits the recordings are compared with: go1, go2, a1, or a .toml or .urdf file
    #[arg(long, value_name = "ROBOT", default_value = "go1", value_parser = RobotParser, hide_possible_values = true)]
    pub robot: String,
    /// Write a first map of an unknown log for --columns, from its names and numbers
    #[arg(long, conflicts_with = "columns")]
    pub guess: bool,
    /// Write the guessed map to this file instead of to stdout
    #[arg(long, value_name = "MAP.toml", requires = "guess")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
    #[command(flatten)]
    pub reading: ReadingArguments,
}

#[derive(Debug, Args)]
#[command(
    after_help = "The ending of the output says its format: .csv, .csv.gz or .mcap. Clocks stay as recorded unless\n\
                  --clock repaired.\n\n\
                  Examples:\n  \
                  romc convert log.txt --columns my-log.toml --output jump.csv.gz\n  \
                  romc convert jump.mcap --output jump.csv --inputs-of models/go1-d4.json"
)]
pub(crate) struct ConvertArguments {
    /// Recordings, or logs that --columns describes; several follow each other in the output
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// The file to write
    #[arg(long, value_name = "FILE")]
    pub output: PathBuf,
    /// Also write the 18 inputs that this model has of each sample, in N and N m
    #[arg(long, value_name = "MODEL.json")]
    pub inputs_of: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
    #[command(flatten)]
    pub reading: ReadingArguments,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Recordings should hold jumps: flight shows gravity and the legs' inertia,\n\
                  moving legs their losses.\n\n\
                  Example:\n  \
                  romc identify examples/recordings/go1/test_*.csv.gz --robot go1"
)]
pub(crate) struct IdentifyArguments {
    /// Recordings of one robot
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Robot whose geometry and limits count: go1, go2, a1, or a .toml or .urdf file
    #[arg(long, value_name = "ROBOT", value_parser = RobotParser, hide_possible_values = true)]
    pub robot: String,
    /// Write losses of the twelve joints, gravity, mass, standard errors to this file
    #[arg(long, value_name = "ACTUATORS.toml")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
    #[command(flatten)]
    pub reading: ReadingArguments,
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  romc robot go1\n  \
                  romc robot solo12.urdf --output solo12.toml\n  \
                  romc robot my.urdf --feet LF_FOOT,RF_FOOT,LH_FOOT,RH_FOOT --output my.toml\n  \
                  romc robot go1.urdf --name my-go1 --output my-go1.toml")]
pub(crate) struct RobotArguments {
    /// Robot: go1, go2, a1, or a .toml or .urdf file
    pub robot: String,
    /// Links of the four feet of a URDF, where they are not found by themselves: LINK,LINK,..., or with the foot's
    /// place in the frame of each, in m, where no link is: LINK:x,y,z,LINK:x,y,z,...
    #[arg(long, value_name = "LINKS", value_delimiter = ',')]
    pub feet: Vec<String>,
    /// Name of the robot [default: the file's]
    #[arg(long)]
    pub name: Option<String>,
    /// Write the robot to this file
    #[arg(long, value_name = "FILE.toml")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Phases of LaTeX go by a comment `% Phase NAME` (in Markdown a heading) or a label that ends in\n\
                  the name, else by their order. Decimals of LaTeX and Markdown stand for numbers rounded in\n\
                  their last digit, unless --exact. A domain is a TOML file with a table per phase and a range\n\
                  per variable (scaled units), such as `[contact]` and `z1 = [-0.2, 0.4]`; without it, points\n\
                  are searched in -1 to 1, then closer and farther.\n\n\
                  Exit code 0: proven equal; 1: different, or not decided; 2: a file could not be read.\n\n\
                  Examples:\n  \
                  romc check models/paper-2d.json paper.tex\n  \
                  romc check models/go1-d4.json equations.txt --domain ranges.toml"
)]
pub(crate) struct CheckArguments {
    /// A model (.json), equations (.txt), or LaTeX (.tex, .md)
    #[arg(value_name = "A")]
    pub left: PathBuf,
    /// What to compare it with, of any of these kinds
    #[arg(value_name = "B")]
    pub right: PathBuf,
    /// Ranges in which points of difference are searched
    #[arg(long, value_name = "FILE.toml")]
    pub domain: Option<PathBuf>,
    /// Take decimals of LaTeX and Markdown as exact
    #[arg(long)]
    pub exact: bool,
    /// Another name that LaTeX has for a variable, such as z1=x or u2=F_z; can be repeated
    #[arg(long, value_name = "VARIABLE=NAME")]
    pub symbols: Vec<String>,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc simulate models/go1-d4.json examples/recordings/go1/test_*.csv.gz"
)]
pub(crate) struct SimulateArguments {
    /// Model file
    pub model: PathBuf,
    /// Recordings to follow
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Time between restarts from the recorded state, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.1, value_parser = real(&RESTART_EVERY))]
    pub restart_every: f64,
    /// Also print the errors of all coordinates over several horizons, compared with a constant velocity and a robot at rest
    #[arg(long)]
    pub verbose: bool,
    /// Write the trajectories of all rollouts to this CSV file
    #[arg(long, value_name = "FILE.csv")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
    #[command(flatten)]
    pub reading: ReadingArguments,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc mpc models/go1-d4.json examples/recordings/go1/test_01.csv.gz --output mpc.csv"
)]
pub(crate) struct MpcArguments {
    /// Model file
    pub model: PathBuf,
    /// Recordings to follow; PLAN.csv of `romc plan` with the settings in PLAN.settings.toml, where options do not replace
    /// them
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Number of stages [default: 20]
    #[arg(long, value_name = "N", value_parser = count(&HORIZON))]
    pub horizon: Option<usize>,
    /// Length of a stage in seconds [default: 0.01]
    #[arg(long, value_name = "SECONDS", value_parser = real(&STEP))]
    pub step: Option<f64>,
    /// How latent inputs become joint torques [default: transpose]
    #[arg(long, value_parser = choice(&LIFTS))]
    pub lift: Option<Lift>,
    /// Where the input reference comes from
    #[arg(long, value_enum, default_value = "recorded")]
    pub reference_input: ReferenceInput,
    /// What solves the quadratic program of a step [default: clarabel]
    #[arg(long, value_parser = choice(&SOLVERS))]
    pub solver: Option<Solver>,
    /// Largest change of a torque that the transpose lift gives, in N m/s [default: none]
    #[arg(long, value_name = "N_M_PER_S", value_parser = real(&TORQUE_RATE))]
    pub torque_rate: Option<f64>,
    /// Write one row per control step to this CSV file
    #[arg(long, value_name = "FILE.csv")]
    pub output: Option<PathBuf>,
    /// Folder for figures of torques, latent inputs, latent tracking and solve times: SVG, PDF, CSV
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
    #[command(flatten)]
    pub reading: ReadingArguments,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Exit code 1 and a reason where there is no plan to be trusted.\n\n\
                  Examples:\n  \
                  romc plan models/go1-d7.json --distance 0.35 --apex 0.15 --output plan.csv\n  \
                  romc plan models/go1-d7.json --reach --figures reach"
)]
pub(crate) struct PlanArguments {
    /// Model file with `landmarks` and `prior`, for a walk with `strides`, as `romc train` writes them
    pub model: PathBuf,
    /// Distance of the body from start to end, in metres
    #[arg(long, value_name = "M", value_parser = real(&DISTANCE), required_unless_present_any = ["reach", "speed"])]
    #[arg(allow_negative_numbers = true)]
    pub distance: Option<f64>,
    /// Rise of the body above its height at the start, in metres
    #[arg(long, value_name = "M", value_parser = real(&APEX), required_unless_present_any = ["reach", "speed"])]
    #[arg(allow_negative_numbers = true)]
    pub apex: Option<f64>,
    /// Instead: a walk at this speed, in m/s, of a model that was trained on walks
    #[arg(long, value_name = "M_S", value_parser = real(&SPEED), conflicts_with_all = ["distance", "apex", "start", "reach", "settings", "figures"])]
    #[arg(allow_negative_numbers = true)]
    pub speed: Option<f64>,
    /// Yaw rate of the walk, to the left, in rad/s [default: 0]
    #[arg(long, value_name = "RAD_S", value_parser = real(&YAW_RATE))]
    #[arg(allow_negative_numbers = true)]
    pub yaw_rate: Option<f64>,
    /// Duration of the walk, in s [default: 5]
    #[arg(long, value_name = "S", value_parser = real(&DURATION))]
    pub duration: Option<f64>,
    /// Start from the first sample of this recording (default: the mean start of the training jumps)
    #[arg(long, value_name = "RECORDING")]
    pub start: Option<PathBuf>,
    /// Write the plan to this recording, which every other command takes
    #[arg(long, value_name = "PLAN.csv", required_unless_present = "reach")]
    pub output: Option<PathBuf>,
    /// Folder for figures of posture, body path, torques and phases, or of the reach: SVG, PDF, CSV
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// Plan a grid of distances and apexes instead, of walks of speeds and yaw rates, and say which can be reached
    #[arg(long, conflicts_with_all = ["distance", "apex", "start", "output"])]
    pub reach: bool,
    /// Weights and bounds of the plan, a TOML file with the names of `docs/planning.md`
    #[arg(long, value_name = "FILE.toml")]
    pub settings: Option<PathBuf>,
    /// Write a plan that is not to be trusted, and replace existing files
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
    #[command(flatten)]
    pub reading: ReadingArguments,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  romc report models/go1-d4.json examples/recordings/go1/test_*.csv.gz --output report.html\n  \
                  romc report --log log.csv --output log.html"
)]
pub(crate) struct ReportArguments {
    /// Model file
    #[arg(required_unless_present = "log")]
    pub model: Option<PathBuf>,
    /// Recordings that the model is compared with
    #[arg(required_unless_present = "log", value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Instead: the log of a generated controller (`NAME_log_write`), its statuses, motion and torques over time
    #[arg(long, value_name = "FILE.csv")]
    #[arg(conflicts_with_all = ["model", "recordings", "study", "plan", "restart_every", "tolerance", "columns", "clock"])]
    pub log: Option<PathBuf>,
    /// The page to write
    #[arg(long, value_name = "FILE.html")]
    pub output: PathBuf,
    /// Folder of a finished `romc study`, to show figures 10 and 11
    #[arg(long, value_name = "DIR")]
    pub study: Option<PathBuf>,
    /// Also write each figure as SVG, PDF and CSV into this folder
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// The plan that the first jump follows, as `romc plan` writes it: drawn beside that jump
    #[arg(long, value_name = "PLAN.csv")]
    pub plan: Option<PathBuf>,
    /// Time between restarts from the recorded state, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.1, value_parser = real(&RESTART_EVERY))]
    pub restart_every: f64,
    /// List what simplification within this error changes: 1% or 0.05, as in `romc compile`
    #[arg(long, value_name = "ERROR", default_value = "1%")]
    #[arg(allow_negative_numbers = true)]
    pub tolerance: Tolerance,
    /// Replace an existing page, or write into a folder that holds files romc did not make
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
    #[command(flatten)]
    pub reading: ReadingArguments,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc manual --out-dir ~/.local/share/man/man1 && man romc-compile"
)]
pub(crate) struct ManualArguments {
    /// Folder for the pages
    #[arg(long, value_name = "DIR")]
    pub out_dir: PathBuf,
    /// Replace files in the folder that romc did not make
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc completions bash > ~/.local/share/bash-completion/completions/romc"
)]
pub(crate) struct CompletionsArguments {
    /// The shell: bash, zsh, fish, elvish or powershell
    #[arg(value_enum, value_name = "SHELL")]
    pub shell: clap_complete::Shell,
}
