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

#[derive(Debug, Args)]
#[command(
    after_help = "Tensors are found by the names of the parts, encoder.weight, encoder.bias, decoder.weight,\n\
                  decoder.bias, xi.PHASE (or sindy_coefficients.PHASE), mask.PHASE (or coefficient_mask.PHASE),\n\
                  input_mean.PHASE, input_covariance.PHASE, scaling.state, scaling.input, mean.state, std.state,\n\
                  std.input, alone or behind names of modules (net.encoder.0.weight, encoder/dense_1/kernel), with\n\
                  dots, slashes or underscores (xi_contact); --map names the others. Statistics are of u in SI units:\n\
                  18 numbers and 18 x 18. The part and layout of each tensor, the tensors that are not used and the\n\
                  terms of the rows of Xi are printed.\n\n\
                  Examples:\n  \
                  romc import net.safetensors --library degree=1,trigonometric,inputs --library-order paper \\\n      \
                  --scaling 0.1 --map xi.contact=Xi_c --map xi.flight=Xi_f --robot go1 --output my-model.json\n  \
                  romc import equations.txt --phase contact=any --phase flight=none --output hopper.json\n  \
                  romc import paper.tex --symbols z1=x --symbols z2=theta --output paper.json"
)]
pub(crate) struct ImportArguments {
    /// File to import: .safetensors, .npz, or equations as .txt, .tex or .md
    pub file: PathBuf,
    /// The model file to write
    #[arg(long, value_name = "MODEL.json")]
    pub output: PathBuf,
    /// Kind of file, if its extension does not identify it
    #[arg(long, value_enum)]
    pub format: Option<Format>,
    /// Take a tensor for a part of the model; can be repeated
    #[arg(long, value_name = "PART=TENSOR")]
    pub map: Vec<Mapping>,
    /// How weights are stored: needed for square ones only
    #[arg(long, value_enum)]
    pub weights: Option<WeightVectors>,
    /// What is between the layers of an encoder or decoder that has several
    #[arg(long, value_name = "NAME")]
    pub activation: Option<Activation>,
    /// How coefficients are stored: needed if their shape fits both ways
    #[arg(long, value_enum)]
    pub xi_layout: Option<XiLayout>,
    /// Another name that LaTeX has for a variable, such as z1=x or u2=F_z; can be repeated
    #[arg(long, value_name = "VARIABLE=NAME")]
    pub symbols: Vec<String>,
    /// Candidate terms in the order of the rows of Xi: `degree=N[,trigonometric][,inputs]`, a file with one term per
    /// line, or the terms themselves as in "1; z1; sin(z1); u1"
    #[arg(long, value_name = "LIBRARY", value_parser = library_argument)]
    pub library: Option<LibraryArgument>,
    /// Order of the terms of degree=N,...: 1, z, dz, products, then sines and cosines as stated here, then inputs.
    /// Needed where the library has sines, unless the recordings of --inputs-from decide it
    #[arg(long, value_name = "ORDER", value_enum, requires = "library")]
    pub library_order: Option<LibraryOrder>,
    /// Number of latent coordinates d: needed if shapes leave it open
    #[arg(long, value_name = "D", value_parser = count(&IMPORTED_LATENT_DIM))]
    pub latent_dim: Option<usize>,
    /// When a phase holds: any, none, always, or foot patterns (fr fl rr rl) such as rear=0011,0001; can be repeated,
    /// the first match wins; contact=any, flight=none and always=always are known
    #[arg(long, value_name = "NAME=FEET")]
    pub phase: Vec<PhasePattern>,
    /// Scaled value = factor times SI value: one number or one per coordinate, separated by commas
    #[arg(long, value_name = "FACTOR", value_delimiter = ',', value_parser = real(&SCALING))]
    pub scaling: Vec<f64>,
    /// Factors of the inputs, where they differ from --scaling or a tensor has those of the states alone
    #[arg(long, value_name = "FACTOR", value_delimiter = ',', value_parser = real(&INPUT_SCALING))]
    pub input_scaling: Vec<f64>,
    /// Robot whose 18 coordinates the encoder takes: go1, go2, a1, or a .toml or .urdf file
    #[arg(long, value_name = "ROBOT", value_parser = RobotParser, hide_possible_values = true)]
    pub robot: Option<String>,
    /// Order of the 18 coordinates (and inputs) in the file, as names or groups: body,fl,fr,rl,rr or hx,hy,kn,body;
    /// romc's own is fr,fl,rr,rl,body
    #[arg(long, value_name = "NAMES", requires = "robot")]
    pub order: Option<CoordinateOrder>,
    /// Axes of the force and moment in the inputs that the model was trained with: body, as published, world, or ground
    /// (as world, of feet that only push) [default: body]
    #[arg(long, value_name = "FRAME", requires = "robot", value_parser = wrench_frame)]
    pub wrench_frame: Option<WrenchFrame>,
    /// Friction and inertia of the joints, if the model was trained with torques less these: a file with a table
    /// `actuators`, such as one of `romc identify`; the motors' torques unless given
    #[arg(long, value_name = "FILE.toml", requires = "robot")]
    pub actuators: Option<PathBuf>,
    /// Sampling period of the training recordings
    #[arg(long, value_name = "SECONDS", value_parser = real(&SAMPLE_TIME))]
    pub sample_time: Option<f64>,
    /// Recordings that give the mean and covariance of the inputs in each phase, by which the controller weighs inputs,
    /// and that the model is compared with: a model that misses them is not written. Needs --robot
    #[arg(long, value_name = "RECORDING", num_args = 1.., requires = "robot")]
    pub inputs_from: Vec<PathBuf>,
    /// Write the model even if it misses the recordings of --inputs-from
    #[arg(long, requires = "inputs_from")]
    pub unchecked: bool,
    /// Name of the model; the output file's stem unless given
    #[arg(long)]
    pub name: Option<String>,
    /// Free text about the model
    #[arg(long, value_name = "TEXT", default_value = "")]
    #[arg(hide_default_value = true)]
    pub description: String,
    /// Replace an existing output file
    #[arg(long, action = ArgAction::SetTrue, value_parser = overwrite())]
    pub force: Overwrite,
    #[command(flatten)]
    pub reading: ReadingArguments,
}
