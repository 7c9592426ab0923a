//! Arguments of `romc check`, `simulate`, `mpc` and `report`.

use super::*;
use crate::evaluate::ReferenceInput;
use crate::limits::table::{HORIZON, RESTART_EVERY, STEP, TORQUE_RATE};

#[derive(Debug, Args)]
#[command(
    after_help = "Phases of LaTeX are found by a comment `% Phase NAME` or a label that ends in the name, those of \
                  Markdown by a heading. Otherwise their order counts. Decimals of LaTeX and Markdown are regarded as \
                  rounded in their last digit.\n\n\
                  A domain is a TOML file with a table per phase, such as `[contact]`. It has a range per variable in \
                  scaled units, such as `z1 = [-0.2, 0.4]`. Without a domain, points are drawn from ranges of several sizes \
                  around zero, the smallest -0.03 to 0.03 and the largest -100 to 100.\n\n\
                  Exit code 0: proven equal; 1: different, or not decided; 2: a file could not be read.\n\n\
                  Examples:\n  \
                  romc check models/paper-2d.json paper.tex\n  \
                  romc check models/go1-d4.json equations.txt --domain ranges.toml"
)]
pub(crate) struct CheckArguments {
    /// A model (.json), equations (.txt), or LaTeX (.tex, .md)
    #[arg(value_name = "A")]
    pub left: PathBuf,
    /// A second file of any of these kinds
    #[arg(value_name = "B")]
    pub right: PathBuf,
    /// Ranges in which points of difference are searched [default: several around zero, see below]
    #[arg(long, help_heading = "Comparison", value_name = "FILE.toml")]
    pub domain: Option<PathBuf>,
    /// Regard decimals of LaTeX and Markdown as exact
    #[arg(long, help_heading = "Comparison")]
    pub exact: bool,
    /// Another name for a variable in LaTeX, such as z1=x or u2=F_z; can be repeated [default: none]
    #[arg(long, help_heading = "Comparison", value_name = "VARIABLE=NAME")]
    pub symbols: Vec<String>,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc simulate models/go1-d4.json examples/recordings/go1/test_*.csv.gz"
)]
pub(crate) struct SimulateArguments {
    /// Model file
    pub model: PathBuf,
    /// Recordings with the inputs of the rollouts and the motion to compare with
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Time between restarts from the recorded state, in s
    #[arg(
        long,
        help_heading = "Rollouts",
        value_name = "SECONDS",
        default_value_t = 0.1
    )]
    #[arg(value_parser = real(&RESTART_EVERY))]
    pub restart_every: f64,
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Write the trajectories of all rollouts to this CSV file [default: none]
    #[arg(long, help_heading = OUTPUT, value_name = "FILE.csv")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
    /// Also print the errors of all coordinates and of the centre of mass over several horizons, with those of baselines
    #[arg(long, help_heading = OUTPUT)]
    pub verbose: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "The command takes about as long as the recordings last.\n\n\
                  Example:\n  \
                  romc mpc models/go1-d4.json examples/recordings/go1/test_01.csv.gz --output mpc.csv"
)]
pub(crate) struct MpcArguments {
    /// Model file
    pub model: PathBuf,
    /// Recordings to follow, or plans of `romc plan`. For PLAN.csv the settings in PLAN.settings.toml replace the
    /// defaults below
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Number of stages of the prediction [default: 20]
    #[arg(long, help_heading = CONTROLLER, value_name = "N", value_parser = count(&HORIZON))]
    pub horizon: Option<usize>,
    /// Length of a stage, in s [default: 0.01]
    #[arg(long, help_heading = CONTROLLER, value_name = "SECONDS", value_parser = real(&STEP))]
    pub step: Option<f64>,
    /// Lift from latent inputs to joint torques [default: transpose; consistent for models of walks]
    #[arg(long, help_heading = CONTROLLER, value_parser = choice(&LIFTS))]
    pub lift: Option<Lift>,
    /// Input of the reference
    #[arg(long, help_heading = CONTROLLER, value_name = "INPUT", value_enum, default_value = "recorded")]
    pub reference_input: ReferenceInput,
    /// Solver of the quadratic program of each step [default: clarabel]
    #[arg(long, help_heading = CONTROLLER, value_parser = choice(&SOLVERS))]
    pub solver: Option<Solver>,
    /// Largest rate of change of a torque with the transpose lift, in N m/s [default: none]
    #[arg(long, help_heading = CONTROLLER, value_name = "RATE", value_parser = real(&TORQUE_RATE))]
    pub torque_rate: Option<f64>,
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// Write one row per control step to this CSV file [default: none]
    #[arg(long, help_heading = OUTPUT, value_name = "FILE.csv")]
    pub output: Option<PathBuf>,
    /// Folder for figures of torques, latent inputs, tracking and solve times, each as SVG, PDF and CSV [default: none]
    #[arg(long, help_heading = OUTPUT, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

const CONTROLLER: &str = "Controller";
const PAGE: &str = "Page";

#[derive(Debug, Args)]
#[command(
    override_usage = "romc report [OPTIONS] --output <FILE.html> <MODEL> <RECORDING>...\n       \
                      romc report [OPTIONS] --output <FILE.html> --log <FILE.csv>",
    after_help = "A page takes about a second per second of recording.\n\n\
                  Examples:\n  \
                  romc report models/go1-d4.json examples/recordings/go1/test_*.csv.gz --output report.html\n  \
                  romc report --log log.csv --output log.html"
)]
pub(crate) struct ReportArguments {
    /// Model file
    #[arg(required_unless_present = "log")]
    pub model: Option<PathBuf>,
    /// Recordings that the model is compared with
    #[arg(required_unless_present = "log", value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Show the log of a generated controller (of `NAME_log_write`) instead of a model: status, motion and torques over
    /// time [default: none]
    #[arg(long, help_heading = PAGE, value_name = "FILE.csv")]
    #[arg(conflicts_with_all = ["model", "recordings", "study", "plan", "restart_every", "tolerance", "columns", "clock"])]
    pub log: Option<PathBuf>,
    /// Time between restarts of rollouts from the recorded state, in s
    #[arg(long, help_heading = PAGE, value_name = "SECONDS", default_value_t = 0.1)]
    #[arg(value_parser = real(&RESTART_EVERY))]
    pub restart_every: f64,
    /// List the simplifications within this error: 1% or 0.05, as in `romc compile`
    #[arg(long, help_heading = PAGE, value_name = "ERROR", default_value = "1%")]
    #[arg(allow_negative_numbers = true)]
    pub tolerance: Tolerance,
    /// Folder of a finished `romc study`, for figures of accuracy against complexity [default: none]
    #[arg(long, help_heading = PAGE, value_name = "DIR")]
    pub study: Option<PathBuf>,
    /// Plan of `romc plan` that the first motion follows, drawn together with that motion [default: none]
    #[arg(long, help_heading = PAGE, value_name = "PLAN.csv")]
    pub plan: Option<PathBuf>,
    #[command(flatten)]
    pub reading: ReadingArguments,
    /// The page to write
    #[arg(long, help_heading = OUTPUT, value_name = "FILE.html")]
    pub output: PathBuf,
    /// Also write each figure as SVG, PDF and CSV into this folder [default: none]
    #[arg(long, help_heading = OUTPUT, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// Replace an existing page, or write into a folder that has files of other origin
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}
