//! `romc compile`: equations and code, and how far they may be simplified.

use super::*;
use crate::limits::table::{DIGITS, MARGIN, SIGNIFICANT, WIDTH};
use crate::typeset::{Form, Rounding};

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  romc compile models/paper-2d.json --emit latex,c,rust --out-dir out/paper-2d\n  romc compile models/go1-d4.json --emit latex,c --out-dir out/short --tolerance 5% \\\n      --domain examples/recordings/go1/train_*.csv.gz --save-model out/go1-d4-short.json"
)]
pub(crate) struct CompileArguments {
    /// Model file
    pub model: PathBuf,
    /// Targets, separated by commas
    #[arg(long, value_enum, value_name = "TARGET")]
    #[arg(value_delimiter = ',', default_value = "latex,c,rust")]
    pub emit: Vec<Target>,
    /// Folder for the emitted files
    #[arg(long, value_name = "DIR")]
    pub out_dir: PathBuf,
    /// A recording that the C examples of generated controllers follow, such as `romc plan` makes: of the model's own
    /// robot, where that is not a go1. Settings in PLAN.settings.toml are the defaults of these controllers
    #[arg(long, value_name = "PLAN.csv")]
    pub plan: Option<PathBuf>,
    #[command(flatten)]
    pub code: CodeArguments,
    #[command(flatten)]
    pub equations: EquationArguments,
    #[command(flatten)]
    pub simplification: SimplifyArguments,
    /// Write into a folder that holds files romc did not make
    #[arg(long, help_heading = None, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

/// Units of coordinates and inputs in equations and generated code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum UnitsChoice {
    /// rad, m, N m, N
    Si,
    /// Scaled as the model was learned: the model file's factors times SI values
    Scaled,
    /// SI units, and latent coordinates and inputs in m, rad, N, N m too: equations and code without scale factors,
    /// every coefficient with a unit
    Physical,
}

impl UnitsChoice {
    /// Rounding of printed coefficients where neither digits nor significant digits are chosen.
    pub fn usual_rounding(self) -> Rounding {
        match self {
            Self::Si | Self::Scaled => Rounding::default(),
            Self::Physical => Rounding::PHYSICAL,
        }
    }

    /// Units at the interface of functions.
    pub fn of_interface(self) -> Units {
        match self {
            Self::Si | Self::Physical => Units::Si,
            Self::Scaled => Units::Scaled,
        }
    }
}

/// How code is generated.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Generated code")]
pub(crate) struct CodeArguments {
    /// Floating-point numbers of C and Rust
    #[arg(long, value_enum, default_value = "f64")]
    pub precision: Precision,
    /// Units of coordinates and inputs in equations and functions
    #[arg(long, value_enum, default_value = "si")]
    pub units: UnitsChoice,
    /// Source of sines and cosines in C and Rust
    #[arg(long, value_enum, default_value = "inline")]
    pub sincos: SineCosine,
}

/// How equations are printed.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Printed equations")]
pub(crate) struct EquationArguments {
    /// Decimal places of coefficients; as many as each needs, at least two, unless given
    #[arg(long, value_name = "N", value_parser = count(&DIGITS), conflicts_with = "significant")]
    pub digits: Option<usize>,
    /// Significant digits of coefficients
    #[arg(long, value_name = "N", value_parser = count(&SIGNIFICANT))]
    pub significant: Option<usize>,
    /// Another name for a variable, such as z1=x or u2=F_z; may be repeated
    #[arg(long, value_name = "VARIABLE=NAME")]
    pub rename: Vec<String>,
    /// Longest line in em: 32 suits one column, 22 a column of a two-column paper
    #[arg(long, value_name = "EM", value_parser = real(&WIDTH))]
    pub width: Option<f64>,
    /// Arrangement in LaTeX; cases for what fits on a page, align for longer phases, unless given
    #[arg(long, value_enum)]
    pub form: Option<Form>,
    /// Write numbers in LaTeX with siunitx's \\num
    #[arg(long)]
    pub siunitx: bool,
    /// Keep coefficients times terms as the model file has them; without it, equations are printed and emitted in their
    /// simplest equal form
    #[arg(long)]
    pub as_learned: bool,
}

/// How far equations may be simplified.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Simplification")]
pub(crate) struct SimplifyArguments {
    /// Drop and round terms as long as no ddz is off by more than this anywhere in the domain: 1% (of its root mean
    /// square over the recordings) or 0.05 (scaled units per s^2); nothing changes at 0
    #[arg(long, value_name = "ERROR", requires = "domain")]
    #[arg(allow_negative_numbers = true)]
    pub tolerance: Option<Tolerance>,
    /// Recordings whose bounding box in each phase is the domain; or one .toml file of ranges
    #[arg(long, value_name = "RECORDING", num_args = 1..)]
    pub domain: Vec<PathBuf>,
    /// How far the domain reaches beyond the recordings, as a share of each variable's range (0.1 unless given)
    #[arg(long, value_name = "SHARE", value_parser = real(&MARGIN))]
    #[arg(requires = "domain", allow_negative_numbers = true)]
    pub margin: Option<f64>,
    /// Also write the simplified model to this file
    #[arg(long, value_name = "MODEL.json", requires = "domain")]
    pub save_model: Option<PathBuf>,
    #[command(flatten)]
    pub reading: ReadingArguments,
}
