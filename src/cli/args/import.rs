//! `romc import`: models trained elsewhere.

use super::*;
use crate::limits::table::{IMPORTED_LATENT_DIM, INPUT_SCALING, SAMPLE_TIME, SCALING};

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum LibraryArgument {
    /// `degree=1,trigonometric,inputs`
    Shorthand(StandardLibrary),
    File(PathBuf),
    Terms(Vec<String>),
}

fn library_argument(text: &str) -> Result<LibraryArgument, ImportError> {
    if text.starts_with("degree=") {
        parse_standard(text).map(LibraryArgument::Shorthand)
    } else if text.contains(';') {
        let terms = text.split(';').map(|term| term.trim().to_owned());
        Ok(LibraryArgument::Terms(terms.collect()))
    } else {
        Ok(LibraryArgument::File(PathBuf::from(text)))
    }
}

const FILE: &str = "File";
const EQUATIONS: &str = "Equations";
const ROBOT: &str = "Robot and units";
const COMPARISON: &str = "Comparison with recordings";

/// Beginning of the last lines of `-h`, in place of the names of tensors.
const SHORT: &str =
    "This is a selection: `romc import --help` lists all options and the names of tensors.\n\n";

const TENSORS: &str = "\
Tensors are found by the names of the parts:
  encoder.weight, encoder.bias, decoder.weight, decoder.bias,
  xi.PHASE (or sindy_coefficients.PHASE), mask.PHASE (or coefficient_mask.PHASE),
  input_mean.PHASE, input_covariance.PHASE (of u in SI units, 18 numbers and 18 x 18),
  scaling.state, scaling.input, mean.state, std.state, std.input.
Names of modules may come first (net.encoder.0.weight, encoder/dense_1/kernel). Dots, slashes and underscores \
separate words (xi_contact). --map names the others.

The command prints the part and layout of each tensor, unused tensors, and the terms of the rows of Xi.

";

const EXAMPLES: &str = "Examples:
  romc import net.safetensors --library degree=1,trigonometric,inputs --library-order paper \\
      --scaling 0.1 --map xi.contact=Xi_c --map xi.flight=Xi_f --robot go1 --output my-model.json
  romc import equations.txt --phase contact=any --phase flight=none --output hopper.json
  romc import paper.tex --symbols z1=x --symbols z2=theta --output paper.json";

#[derive(Debug, Args)]
#[command(after_help = format!("{SHORT}{EXAMPLES}"), after_long_help = format!("{TENSORS}{EXAMPLES}"))]
pub(crate) struct ImportArguments {
    /// File to import: .safetensors, .npz, or equations as .txt, .tex or .md
    pub file: PathBuf,
    /// Kind of file [default: by content or extension]
    #[arg(long, help_heading = FILE, value_enum)]
    pub format: Option<Format>,
    /// Use this tensor as this part of the model; can be repeated [default: parts found by name]
    #[arg(long, help_heading = FILE, value_name = "PART=TENSOR")]
    pub map: Vec<Mapping>,
    /// Storage of weights [default: by shape; required for square weights]
    #[arg(long, help_heading = FILE, value_name = "KIND", value_enum, hide_short_help = true)]
    pub weights: Option<WeightVectors>,
    /// Storage of coefficients [default: by shape; required if both kinds fit]
    #[arg(long, help_heading = FILE, value_name = "KIND", value_enum, hide_short_help = true)]
    pub xi_layout: Option<XiLayout>,
    /// Activation between the layers of an encoder or decoder [default: none; required for several layers]
    #[arg(long, help_heading = FILE, value_name = "NAME", value_enum, hide_short_help = true)]
    pub activation: Option<Activation>,
    /// Another name for a variable in LaTeX, such as z1=x or u2=F_z; can be repeated [default: none]
    #[arg(long, help_heading = FILE, value_name = "VARIABLE=NAME")]
    pub symbols: Vec<String>,

    /// Candidate terms in the order of the rows of Xi. They are `degree=N[,trigonometric][,inputs]`, a file with one term
    /// per line, or a list such as "1; z1; sin(z1); u1" [required for tensors]
    #[arg(long, help_heading = EQUATIONS, value_name = "LIBRARY", value_parser = library_argument)]
    pub library: Option<LibraryArgument>,
    /// Order of the terms of degree=N,...: 1, z, dz, products, sines and cosines as below, inputs [default: decided by
    /// --inputs-from; otherwise required for libraries with sines]
    #[arg(long, help_heading = EQUATIONS, value_name = "ORDER", value_enum, requires = "library")]
    pub library_order: Option<LibraryOrder>,
    /// Number of latent coordinates d [default: from the file]
    #[arg(long, help_heading = EQUATIONS, value_name = "D", value_parser = count(&IMPORTED_LATENT_DIM))]
    pub latent_dim: Option<usize>,
    /// Condition of a phase: any, none, always, or foot patterns (fr fl rr rl) such as rear=0011,0001. Can be repeated;
    /// the first match counts [default: contact=any, flight=none, always=always]
    #[arg(long, help_heading = EQUATIONS, value_name = "NAME=FEET")]
    pub phase: Vec<PhasePattern>,

    /// Robot with the 18 coordinates of the encoder: go1, go2, a1, or a .toml or .urdf file [default: none]
    #[arg(long, help_heading = ROBOT, value_name = "ROBOT")]
    #[arg(value_parser = RobotParser, hide_possible_values = true)]
    pub robot: Option<String>,
    /// Order of the 18 coordinates (and inputs) in the file, as names or groups: body,fl,fr,rl,rr or hx,hy,kn,body
    /// [default: fr,fl,rr,rl,body]
    #[arg(long, help_heading = ROBOT, value_name = "NAMES", requires = "robot")]
    pub order: Option<CoordinateOrder>,
    /// Scaled value = factor times SI value: one number or one per coordinate, separated by commas [default: from tensors;
    /// otherwise required with an encoder or decoder]
    #[arg(long, help_heading = ROBOT, value_name = "FACTOR", value_delimiter = ',')]
    #[arg(value_parser = real(&SCALING))]
    pub scaling: Vec<f64>,
    /// Factors of the inputs, where they differ from those of the states [default: those of --scaling]
    #[arg(long, help_heading = ROBOT, value_name = "FACTOR", value_delimiter = ',')]
    #[arg(value_parser = real(&INPUT_SCALING), hide_short_help = true)]
    pub input_scaling: Vec<f64>,
    /// Axes of force and moment in the inputs of the training: body as in the paper, world, or ground. `ground` is `world`
    /// for feet that push and never pull [default: body]
    #[arg(long, help_heading = ROBOT, value_name = "FRAME", requires = "robot")]
    #[arg(value_parser = wrench_frame, hide_short_help = true)]
    pub wrench_frame: Option<WrenchFrame>,
    /// Joint friction and rotor inertia that the training subtracted from the torques. A file with a table `actuators`,
    /// such as one of `romc identify` [default: none]
    #[arg(long, help_heading = ROBOT, value_name = "FILE.toml", requires = "robot")]
    pub actuators: Option<PathBuf>,
    /// Sampling period of the training recordings in s, stored in the model [default: none]
    #[arg(long, help_heading = ROBOT, value_name = "SECONDS", value_parser = real(&SAMPLE_TIME))]
    #[arg(hide_short_help = true)]
    pub sample_time: Option<f64>,

    /// Recordings for the input statistics of the controller and for a comparison; a model with large errors on them is
    /// refused [default: none]
    #[arg(long, help_heading = COMPARISON, value_name = "RECORDING", num_args = 1.., requires = "robot")]
    pub inputs_from: Vec<PathBuf>,
    /// Write the model in spite of large errors on the recordings of --inputs-from
    #[arg(long, help_heading = COMPARISON, requires = "inputs_from")]
    pub unchecked: bool,
    #[command(flatten)]
    pub reading: ReadingArguments,

    /// The model file to write
    #[arg(long, help_heading = OUTPUT, value_name = "MODEL.json")]
    pub output: PathBuf,
    /// Name of the model [default: the file name of --output]
    #[arg(long, help_heading = OUTPUT)]
    pub name: Option<String>,
    /// Free text about the model [default: none]
    #[arg(long, help_heading = OUTPUT, value_name = "TEXT", default_value = "")]
    #[arg(hide_default_value = true)]
    pub description: String,
    /// Replace an existing output file
    #[arg(long, help_heading = OUTPUT, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
}
