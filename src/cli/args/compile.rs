//! `romc compile`: equations and code, and how far they may be simplified.

use super::*;
use crate::limits::table::{DIGITS, MARGIN, SIGNIFICANT, WIDTH};
use crate::typeset::{Form, Rounding};

const TARGETS: &str = "Targets";
const EQUATIONS: &str = "Printed equations";
const SIMPLIFICATION: &str = "Simplification";

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
                  romc compile models/paper-2d.json --emit latex,c,rust --out-dir out/paper-2d\n  \
                  romc compile models/go1-d4.json --emit latex,c --out-dir out/short --tolerance 5% \\\n      \
                  --domain examples/recordings/go1/train_*.csv.gz --save-model go1-d4-short.json")]
pub(crate) struct CompileArguments {
    /// Model file
    pub model: PathBuf,
    /// Targets, separated by commas
    #[arg(long, help_heading = TARGETS, value_enum, value_name = "TARGET")]
    #[arg(value_delimiter = ',', default_value = "latex,c,rust")]
    pub emit: Vec<Target>,
    /// Recording or plan that the examples of generated controllers follow, made with the model's robot. For PLAN.csv the
    /// settings in PLAN.settings.toml become defaults of the controller [default: a shipped jump of a Go1]
    #[arg(long, help_heading = TARGETS, value_name = "PLAN.csv")]
    pub plan: Option<PathBuf>,
    #[command(flatten)]
    pub code: CodeArguments,
    #[command(flatten)]
    pub equations: EquationArguments,
    #[command(flatten)]
    pub simplification: SimplifyArguments,
    /// Folder for the emitted files
    #[arg(long, help_heading = OUTPUT, value_name = "DIR")]
    pub out_dir: PathBuf,
    /// Write into a folder that has files of other origin
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}

/// Units of coordinates and inputs in equations and generated code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum UnitsChoice {
    /// SI units of robot coordinates and inputs; latent coordinates have the factors of the model file
    Si,
    /// Factors of the model file for robot coordinates also
    Scaled,
    /// SI units also for latent coordinates and inputs
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
#[command(next_help_heading = EQUATIONS)]
pub(crate) struct EquationArguments {
    /// Decimal places of coefficients [default: at least two, more for coefficients that would change by over 5 %; none
    /// with --units physical]
    #[arg(long, value_name = "N", value_parser = count(&DIGITS), conflicts_with = "significant")]
    pub digits: Option<usize>,
    /// Significant digits of coefficients [default: 3 with --units physical; otherwise by decimal places]
    #[arg(long, value_name = "N", value_parser = count(&SIGNIFICANT))]
    pub significant: Option<usize>,
    /// Another name for a variable, such as z1=x or u2=F_z; can be repeated [default: none]
    #[arg(long, value_name = "VARIABLE=NAME")]
    pub rename: Vec<String>,
    /// Longest line in em, 22 for a column of a two-column paper [default: 32 in LaTeX; 44 elsewhere]
    #[arg(long, value_name = "EM", value_parser = real(&WIDTH))]
    pub width: Option<f64>,
    /// Arrangement in LaTeX [default: cases for a phase that fits on a page; otherwise align]
    #[arg(long, value_enum)]
    pub form: Option<Form>,
    /// Write numbers in LaTeX with siunitx's \num
    #[arg(long)]
    pub siunitx: bool,
    /// Keep coefficients times terms as in the model file, instead of the simplest equal form
    #[arg(long)]
    pub as_learned: bool,
}

/// How far equations may be simplified.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = SIMPLIFICATION)]
pub(crate) struct SimplifyArguments {
    /// Largest error of any ddz in the domain after dropping and rounding terms. 1% is a share of its root mean square over
    /// the recordings, 0.05 is in scaled units per s^2 [default: 0]
    #[arg(long, value_name = "ERROR", requires = "domain")]
    #[arg(allow_negative_numbers = true)]
    pub tolerance: Option<Tolerance>,
    /// Recordings whose bounding box in each phase is the domain, or one .toml file of ranges [default: none]
    #[arg(long, value_name = "RECORDING", num_args = 1..)]
    pub domain: Vec<PathBuf>,
    /// Extension of the domain beyond the recordings, relative to the range of each variable [default: 0.1]
    #[arg(long, value_name = "SHARE", value_parser = real(&MARGIN))]
    #[arg(requires = "domain", allow_negative_numbers = true)]
    pub margin: Option<f64>,
    /// Also write the simplified model to this file [default: none]
    #[arg(long, value_name = "MODEL.json", requires = "domain")]
    pub save_model: Option<PathBuf>,
    #[command(flatten)]
    pub reading: ReadingArguments,
}
