//! What can be typed: the commands, their options, and an example for each.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::artifact::import::{Format, ImportError, Mapping, PhaseRule, parse_standard};
use crate::backend::Target;
use crate::backend::typeset::MOST_DIGITS;
use crate::model::{Activation, StandardLibrary};
use crate::simplify::{MARGIN, Tolerance};

mod train;

pub use train::{
    AccelerationSource, BpttIntegrator, Dimensions, FilterShape, FilteredRows, HiddenActivation,
    PhaseSet, StudyArguments, TrainArguments, TrainMethod, TrainSettings, Widths,
};

/// The reduced-order model compiler: from recorded jumps to equations, code and torques.
#[derive(Debug, Parser)]
#[command(
    name = "romc",
    version,
    propagate_version = true,
    after_help = "Start with `romc demo`. `romc <command> --help` explains a command with an example."
)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

/// One of romc's commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// The main job on the shipped model and recordings: equations, code, rollouts, controller
    Demo(DemoArguments),
    /// Tell what a recording or a model holds, and what is implausible in it
    Inspect(InspectArguments),
    /// Learn a model from recordings
    Train(Box<TrainArguments>),
    /// Train every latent dimension with several seeds: accuracy against complexity
    Study(StudyArguments),
    /// Take over a model trained elsewhere: safetensors, npz, PySINDy, equations as text
    Import(ImportArguments),
    /// Compile a model to LaTeX, C and Rust
    Compile(CompileArguments),
    /// Roll a model out over recordings and measure how far it drifts
    Simulate(SimulateArguments),
    /// Run the latent-space controller along a recording
    Mpc(MpcArguments),
    /// Put equations, errors, baselines and the controller's torques on one HTML page
    Report(ReportArguments),
    /// Write man pages, one a command
    Manual(ManualArguments),
    /// Print completions for a shell
    Completions(CompletionsArguments),
}

impl Command {
    /// Whether `--json` was given.
    pub fn wants_json(&self) -> bool {
        match self {
            Self::Demo(arguments) => arguments.output_format.json,
            Self::Inspect(arguments) => arguments.output_format.json,
            Self::Train(arguments) => arguments.output_format.json,
            Self::Study(arguments) => arguments.output_format.json,
            Self::Import(arguments) => arguments.output_format.json,
            Self::Compile(arguments) => arguments.output_format.json,
            Self::Simulate(arguments) => arguments.output_format.json,
            Self::Mpc(arguments) => arguments.output_format.json,
            Self::Report(arguments) => arguments.output_format.json,
            Self::Manual(arguments) => arguments.output_format.json,
            Self::Completions(arguments) => arguments.output_format.json,
        }
    }
}

/// Output every command offers.
#[derive(Debug, Clone, Args)]
pub struct OutputArguments {
    /// Print one JSON object to stdout and nothing else there
    #[arg(long, help_heading = None)]
    pub json: bool,
}

/// `romc demo`
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  romc demo --out-dir out/demo")]
pub struct DemoArguments {
    /// Folder for what the demo makes
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    pub out_dir: PathBuf,
    /// Write into a folder that holds files romc did not make
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub output_format: OutputArguments,
}

/// `romc inspect`
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc inspect models/go1-d4.json examples/recordings/go1/test_01.csv.gz"
)]
pub struct InspectArguments {
    /// Models (`.json`) and recordings (`.csv`, `.csv.gz`)
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Robot whose limits the recordings are held against
    #[arg(long, default_value = "go1")]
    pub robot: String,
    #[command(flatten)]
    pub output_format: OutputArguments,
}

/// Kinds of files that can be imported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum StoredFormat {
    /// Tensors in a safetensors file, such as a PyTorch state dict
    Safetensors,
    /// NumPy arrays
    Npz,
    /// Equations as text: `[contact]`, then `ddz1 = 0.36 - 0.16*dz1 + u1` and so on
    Equations,
}

impl From<StoredFormat> for Format {
    fn from(stored: StoredFormat) -> Format {
        match stored {
            StoredFormat::Safetensors => Format::Safetensors,
            StoredFormat::Npz => Format::Npz,
            StoredFormat::Equations => Format::Equations,
        }
    }
}

/// How a file stores weights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum StoredWeights {
    /// For `z = x W` (TensorFlow, Keras)
    Row,
    /// For `z = W x` (torch.nn.Linear)
    Column,
}

/// How a file stores coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum StoredXi {
    /// A row a candidate term
    TermsByLatent,
    /// A row a latent coordinate (PySINDy)
    LatentByTerms,
}

/// In which order a file has the sines and cosines of the shorthand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum TermOrder {
    /// sin z, sin dz, cos z, cos dz: the published arrays
    Author,
    /// sin z, cos z, sin dz, cos dz: appendix B of the paper
    Paper,
}

/// The candidate terms of an imported model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LibraryArgument {
    /// `degree=1,trigonometric,inputs`
    Shorthand(StandardLibrary),
    /// A file with the list of terms
    File(PathBuf),
}

fn library_argument(text: &str) -> Result<LibraryArgument, ImportError> {
    if text.starts_with("degree=") {
        parse_standard(text).map(LibraryArgument::Shorthand)
    } else {
        Ok(LibraryArgument::File(PathBuf::from(text)))
    }
}

/// `romc import`
#[derive(Debug, Args)]
#[command(
    after_help = "Tensors are found by usual names (encoder.weight, encoder.0.bias, W_e, xi_contact, ...); --map\n\
                  names the others. Parts: encoder.weight, encoder.bias, decoder.weight, decoder.bias,\n\
                  xi.PHASE, mask.PHASE, input_mean.PHASE, input_covariance.PHASE, scaling.state,\n\
                  scaling.input. What was taken for what, and turned how, is printed.\n\n\
                  Examples:\n  \
                  romc import net.safetensors --library degree=1,trigonometric,inputs --scaling 0.1 \\\n      \
                  --map xi.contact=Xi_c --map xi.flight=Xi_f --robot go1 --output my-model.json\n  \
                  romc import equations.txt --phase contact=any --phase flight=none --output hopper.json"
)]
pub struct ImportArguments {
    /// What to import: .safetensors, .npz, or equations as .txt
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// The model file to write
    #[arg(long, value_name = "MODEL.json")]
    pub output: PathBuf,
    /// Kind of file, if its ending does not tell
    #[arg(long, value_enum)]
    pub format: Option<StoredFormat>,
    /// Take a tensor for a part of the model; can be repeated
    #[arg(long, value_name = "PART=TENSOR")]
    pub map: Vec<Mapping>,
    /// How weights are stored, if their shape does not tell
    #[arg(long, value_enum)]
    pub weights: Option<StoredWeights>,
    /// What is between the layers of an encoder or decoder that has several: elu, tanh, sigmoid
    #[arg(long, value_name = "NAME")]
    pub activation: Option<Activation>,
    /// How coefficients are stored, if their shape does not tell
    #[arg(long, value_enum)]
    pub xi_layout: Option<StoredXi>,
    /// Candidate terms: `degree=N[,trigonometric][,inputs]`, or a file with the list of terms
    #[arg(long, value_name = "LIBRARY", value_parser = library_argument)]
    pub library: Option<LibraryArgument>,
    /// Order of the sines and cosines of degree=N,trigonometric
    #[arg(long, value_enum, default_value = "author")]
    pub library_order: TermOrder,
    /// Number of latent coordinates d, if shapes do not tell
    #[arg(long, value_name = "D", value_parser = at_least_one)]
    pub latent_dim: Option<usize>,
    /// When a phase holds: any, none, or foot patterns (fr fl rr rl) such as rear=0011,0001; can be
    /// repeated, the first match wins; contact=any and flight=none are known
    #[arg(long, value_name = "NAME=FEET")]
    pub phase: Vec<PhaseRule>,
    /// Scaled value = factor times SI value: one number or one per coordinate, separated by commas
    #[arg(long, value_name = "FACTOR", value_delimiter = ',')]
    pub scaling: Vec<f64>,
    /// Factors of the inputs, where they differ from --scaling
    #[arg(
        long,
        value_name = "FACTOR",
        value_delimiter = ',',
        requires = "scaling"
    )]
    pub input_scaling: Vec<f64>,
    /// Robot whose 18 coordinates the encoder takes
    #[arg(long)]
    pub robot: Option<String>,
    /// Sampling period of the training recordings
    #[arg(long, value_name = "SECONDS", value_parser = positive_seconds)]
    pub sample_time: Option<f64>,
    /// Name of the model; the output file's stem unless given
    #[arg(long)]
    pub name: Option<String>,
    /// Free text about the model
    #[arg(
        long,
        value_name = "TEXT",
        default_value = "",
        hide_default_value = true
    )]
    pub description: String,
    /// Replace an existing output file
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub output_format: OutputArguments,
}

/// `romc compile`
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  romc compile models/paper-2d.json --emit latex,c,rust --out-dir out/paper-2d\n  romc compile models/go1-d4.json --emit latex,c --out-dir out/short --tolerance 5% \\\n      --domain examples/recordings/go1/train_*.csv.gz --save-model out/go1-d4-short.json"
)]
pub struct CompileArguments {
    /// Model file
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// What to write, separated by commas
    #[arg(
        long,
        value_name = "TARGET",
        value_delimiter = ',',
        default_value = "latex,c,rust",
        value_parser = target
    )]
    pub emit: Vec<Target>,
    /// Folder for the emitted files
    #[arg(long, value_name = "DIR")]
    pub out_dir: PathBuf,
    #[command(flatten)]
    pub code: CodeArguments,
    #[command(flatten)]
    pub equations: EquationArguments,
    #[command(flatten)]
    pub simplification: SimplifyArguments,
    /// Write into a folder that holds files romc did not make
    #[arg(long, help_heading = None)]
    pub force: bool,
    #[command(flatten)]
    pub output_format: OutputArguments,
}

/// Floating-point numbers of generated code.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum PrecisionChoice {
    /// 64 bits: `double` and `f64`
    #[default]
    F64,
    /// 32 bits: `float` and `f32`; each function states the bound of its rounding errors
    F32,
}

/// Units of robot coordinates at the interface of generated code.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum UnitsChoice {
    /// rad, m, N m, N
    #[default]
    Si,
    /// Scaled as the model was learned: the model file's factors times SI values
    Scaled,
}

/// What computes sines and cosines in generated code.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum SinCosChoice {
    /// A kernel inside the file that compilers vectorise, the same bits everywhere
    #[default]
    Inline,
    /// The platform's mathematics library
    Library,
}

/// How the equations of a phase stand on a page of LaTeX.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum FormChoice {
    /// A number for each equation; breaks across pages
    Align,
    /// One number, a brace around the phase's equations
    Cases,
}

/// How code is generated.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Generated code")]
pub struct CodeArguments {
    /// Floating-point numbers of C and Rust
    #[arg(long, value_enum, default_value = "f64")]
    pub precision: PrecisionChoice,
    /// Units of robot coordinates and inputs that functions take and give
    #[arg(long, value_enum, default_value = "si")]
    pub units: UnitsChoice,
    /// What computes sines and cosines in C and Rust
    #[arg(long, value_enum, default_value = "inline")]
    pub sincos: SinCosChoice,
}

/// How equations are printed.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Printed equations")]
pub struct EquationArguments {
    /// Decimal places of coefficients; as many as each needs, at least two, unless given
    #[arg(long, value_name = "N", value_parser = decimal_places, conflicts_with = "significant")]
    pub digits: Option<usize>,
    /// Significant digits of coefficients
    #[arg(long, value_name = "N", value_parser = printed_digits)]
    pub significant: Option<usize>,
    /// Another name for a variable, such as z1=x or u2=F_z; may be repeated
    #[arg(long, value_name = "VARIABLE=NAME")]
    pub rename: Vec<String>,
    /// Longest line in em: 32 suits one column, 22 a column of a two-column paper
    #[arg(long, value_name = "EM", value_parser = positive_width)]
    pub width: Option<f64>,
    /// Arrangement in LaTeX; cases for what fits on a page, align for longer phases, unless given
    #[arg(long, value_enum)]
    pub form: Option<FormChoice>,
    /// Write numbers in LaTeX with siunitx's \\num
    #[arg(long)]
    pub siunitx: bool,
}

/// How far equations may be simplified.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Simplification")]
pub struct SimplifyArguments {
    /// Drop and round terms as long as no ddz is off by more than this anywhere in the domain: 1%
    /// (of its root mean square over the recordings) or 0.05 (scaled units per s^2); nothing
    /// changes at 0
    #[arg(
        long,
        value_name = "ERROR",
        requires = "domain",
        allow_negative_numbers = true
    )]
    pub tolerance: Option<Tolerance>,
    /// Recordings whose smallest box is the domain, a phase; or one .toml file of ranges
    #[arg(long, value_name = "RECORDING", num_args = 1..)]
    pub domain: Vec<PathBuf>,
    /// How far the domain reaches beyond the recordings, as a share of each variable's range
    #[arg(
        long,
        value_name = "SHARE",
        default_value_t = MARGIN,
        value_parser = share,
        requires = "domain",
        allow_negative_numbers = true
    )]
    pub margin: f64,
    /// Also write the simplified model to this file
    #[arg(long, value_name = "MODEL.json", requires = "domain")]
    pub save_model: Option<PathBuf>,
}

/// `romc simulate`
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc simulate models/go1-d4.json examples/recordings/go1/test_*.csv.gz"
)]
pub struct SimulateArguments {
    /// Model file
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Recordings to follow
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Time between restarts from the recorded state, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.1, value_parser = positive_seconds)]
    pub restart_every: f64,
    /// Write the trajectories of all rollouts to this CSV file
    #[arg(long, value_name = "FILE.csv")]
    pub output: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub output_format: OutputArguments,
}

/// Where the controller's input reference comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ReferenceInput {
    /// The recorded torques and forces, projected into the latent space
    Recorded,
    /// None: the controller finds the input itself
    None,
}

/// How a latent input becomes joint torques.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LiftChoice {
    /// `u = W_e^T u_lat`, the paper's
    Transpose,
    /// Torques whose own ground reaction forces reproduce the latent input
    Consistent,
}

/// `romc mpc`
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc mpc models/go1-d4.json examples/recordings/go1/test_01.csv.gz --output mpc.csv"
)]
pub struct MpcArguments {
    /// Model file
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Recordings to follow
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// Number of stages
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = at_least_one)]
    pub horizon: usize,
    /// Length of a stage in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.01, value_parser = positive_seconds)]
    pub step: f64,
    /// How latent inputs become joint torques
    #[arg(long, value_enum, default_value = "transpose")]
    pub lift: LiftChoice,
    /// Where the input reference comes from
    #[arg(long, value_enum, default_value = "recorded")]
    pub reference_input: ReferenceInput,
    /// Write one row per control step to this CSV file
    #[arg(long, value_name = "FILE.csv")]
    pub output: Option<PathBuf>,
    /// Folder for figures of torques, latent inputs, latent tracking and solve times: SVG, PDF, CSV
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// Replace an existing output file
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub output_format: OutputArguments,
}

/// `romc report`
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc report models/go1-d4.json examples/recordings/go1/test_*.csv.gz --output report.html"
)]
pub struct ReportArguments {
    /// Model file
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// Recordings that the model is held against
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,
    /// The page to write
    #[arg(long, value_name = "FILE.html")]
    pub output: PathBuf,
    /// Folder of a finished `romc study`, to show figures 10 and 11
    #[arg(long, value_name = "DIR")]
    pub study: Option<PathBuf>,
    /// Also write each figure as SVG, PDF and CSV into this folder
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// Time between restarts from the recorded state, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.1, value_parser = positive_seconds)]
    pub restart_every: f64,
    /// List what simplification within this error changes: 1% or 0.05, as in `romc compile`
    #[arg(
        long,
        value_name = "ERROR",
        default_value = "1%",
        allow_negative_numbers = true
    )]
    pub tolerance: Tolerance,
    /// Replace an existing page, or write into a folder that holds files romc did not make
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub output_format: OutputArguments,
}

/// `romc manual`
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc manual --out-dir ~/.local/share/man/man1 && man romc-compile"
)]
pub struct ManualArguments {
    /// Folder for the pages
    #[arg(long, value_name = "DIR")]
    pub out_dir: PathBuf,
    /// Replace files in the folder that romc did not make
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub output_format: OutputArguments,
}

/// `romc completions`
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  romc completions bash > ~/.local/share/bash-completion/completions/romc"
)]
pub struct CompletionsArguments {
    /// The shell: bash, zsh, fish, elvish or powershell
    #[arg(value_enum, value_name = "SHELL")]
    pub shell: clap_complete::Shell,
    #[command(flatten)]
    pub output_format: OutputArguments,
}

fn positive_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds.is_finite() && seconds > 0.0 => Ok(seconds),
        _ => Err("expected a positive number of seconds".to_owned()),
    }
}

fn decimal_places(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(places) if places <= MOST_DIGITS => Ok(places),
        _ => Err(format!("expected a whole number from 0 to {MOST_DIGITS}")),
    }
}

fn printed_digits(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(digits) if (1..=MOST_DIGITS).contains(&digits) => Ok(digits),
        _ => Err(format!("expected a whole number from 1 to {MOST_DIGITS}")),
    }
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if share.is_finite() && share >= 0.0 => Ok(share),
        _ => Err("expected a number of at least 0, such as 0.1".to_owned()),
    }
}

fn positive_width(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(width) if width.is_finite() && width > 0.0 => Ok(width),
        _ => Err("expected a positive width in em".to_owned()),
    }
}

fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(count) if count > 0 => Ok(count),
        _ => Err("expected a whole number of at least 1".to_owned()),
    }
}

fn target(text: &str) -> Result<Target, String> {
    text.parse::<Target>().map_err(|error| error.to_string())
}
