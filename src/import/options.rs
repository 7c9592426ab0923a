//! Options of an import: everything that tensors do not carry.
#![allow(missing_docs, reason = "the names are self-explanatory")]

use clap::ValueEnum;

use super::*;
use crate::files::magic::OtherFormat;
use crate::robot::{Actuators, Robot, WrenchFrame};

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Tensors, such as a PyTorch state dict
    Safetensors,
    /// NumPy arrays
    Npz,
    /// Text such as `[contact]` and `ddz1 = 0.36 - 0.16*dz1 + u1`
    Equations,
    /// LaTeX in a .tex or Markdown file
    Latex,
}

impl Format {
    pub(crate) fn of_path(path: &Path) -> Read<Self> {
        let ending = (path.extension()).map(|ending| ending.to_string_lossy().to_lowercase());
        let found = match ending.as_deref() {
            Some("safetensors") => return Ok(Format::Safetensors),
            Some("npz") => return Ok(Format::Npz),
            Some("txt" | "eq" | "equations") => return Ok(Format::Equations),
            Some("tex" | "ltx" | "md" | "markdown") => return Ok(Format::Latex),
            Some(ending) => format!("the ending `.{ending}`"),
            None => "no ending".to_owned(),
        };
        let foreign = magic::arrays_by_ending(path).and_then(|found| refusal(path, found));
        Err(foreign.unwrap_or_else(|| {
            let expected = match ending.as_deref() {
                Some("json") => {
                    "a file of tensors or equations; model files of romc need no import"
                }
                _ => {
                    "a file that ends in .safetensors, .npz, .txt (equations), .tex or .md (LaTeX), \
                     or --format with its format"
                }
            };
            ImportError::at(&path.display().to_string(), Place::Whole, found, expected)
        }))
    }

    /// The kind of a file that was read: as given, else by its bytes or its ending.
    pub(super) fn of_file(path: &Path, bytes: &[u8], given: Option<Self>) -> Read<Self> {
        let content = magic::arrays_by_content(path, bytes);
        let is_known = content.is_some();
        match content.and_then(|found| refusal(path, found)) {
            Some(refused) => Err(refused),
            None if given.is_some() || !is_known => given.map_or_else(|| Self::of_path(path), Ok),
            None if bytes.starts_with(b"PK") => Ok(Format::Npz),
            None => Ok(Format::Safetensors),
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Format::Safetensors => "safetensors",
            Format::Npz => "npz",
            Format::Equations => "equations",
            Format::Latex => "latex",
        }
    }
}

pub(super) fn refusal(path: &Path, found: OtherFormat) -> Option<ImportError> {
    let file = path.display().to_string();
    let refused = || ImportError::at(&file, Place::Whole, found.what, found.remedy.as_str());
    (!found.remedy.is_empty()).then(refused)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum WeightVectors {
    /// For `z = x W` (TensorFlow, Keras)
    Row,
    /// For `z = W x` (torch.nn.Linear), as in the model file
    Column,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum XiLayout {
    /// One row per candidate term, as in the model file
    TermsByLatent,
    /// One row per latent coordinate (PySINDy)
    LatentByTerms,
}

/// Reads `degree=2,trigonometric,inputs`; faults name the option.
pub fn parse_standard(text: &str) -> Read<StandardLibrary> {
    let refused = |part: &str| {
        let expected = "degree=N, then trigonometric and inputs if the library has them, separated \
                        by commas; or a file with the list of terms";
        ImportError::option("--library", format!("{part:?}"), expected)
    };
    let mut degree = None;
    let (mut trigonometric, mut inputs) = (false, false);
    for part in text.split(',').map(str::trim) {
        match part.split_once('=') {
            Some(("degree", number)) if degree.is_none() => {
                degree = Some(number.parse().map_err(|_| refused(part))?);
            }
            None if part == "trigonometric" && !trigonometric => trigonometric = true,
            None if part == "inputs" && !inputs => inputs = true,
            Some(_) | None => return Err(refused(part)),
        }
    }
    Ok(StandardLibrary {
        degree: degree.ok_or_else(|| refused(text))?,
        trigonometric,
        inputs,
    })
}

pub(super) fn standard_text(standard: StandardLibrary) -> String {
    let words = [
        (standard.trigonometric, ",trigonometric"),
        (standard.inputs, ",inputs"),
    ];
    let words = words.map(|(has, word)| if has { word } else { "" });
    format!("degree={}{}", standard.degree, words.concat())
}

/// Options of an import; only the name is always needed.
#[derive(Clone, Debug, Default)]
pub struct ImportOptions {
    pub name: String,
    pub description: String,
    /// The kind of file, if its ending is none of the known ones.
    pub format: Option<Format>,
    /// Tensors by name; those not mentioned are found by the names of the parts.
    pub mapping: Vec<Mapping>,
    /// How weights are stored: needed for square ones, checked for others.
    pub weights: Option<WeightVectors>,
    pub activation: Option<Activation>,
    /// How coefficients are stored: needed if their shape fits both ways, else checked.
    pub xi_layout: Option<XiLayout>,
    pub symbols: SymbolNames,
    /// The candidate terms in the order of Xi's rows; equations bring their own.
    pub library: Option<LibraryChoice>,
    /// The order of a standard library's terms in the file: needed where it has sines, as trainers differ.
    pub library_order: Option<LibraryOrder>,
    /// Number of latent coordinates: needed if shapes leave it open, else checked.
    pub latent_dim: Option<usize>,
    /// The phases in the order in which they are tried; `contact` and `flight` are known.
    pub phases: Vec<PhasePattern>,
    /// Scale factors; needed with an encoder or decoder, unless tensors have them.
    pub scaling: Option<Scaling>,
    /// Factors of the inputs, where tensors have those of the states alone.
    pub input_scaling: Option<ScaleFactors>,
    /// The order of coordinates in the file, if it is not that of the robot; needs the robot.
    pub order: Option<CoordinateOrder>,
    pub robot: Option<&'static Robot>,
    /// Axes of the force and moment in the inputs that the model was trained with; needs the robot.
    pub wrench_frame: WrenchFrame,
    /// Friction and inertia of the joints, if training subtracted them from the torques; needs the robot.
    pub actuators: Option<Actuators>,
    pub sample_time_s: Option<f64>,
}

impl ImportOptions {
    /// Options with scale factors of states and inputs: none, one, or one per coordinate; inputs default to states.
    pub fn of_factors(state: &[f64], input: &[f64]) -> Self {
        let factors = |given: &[f64]| match given {
            [factor] => ScaleFactors::Uniform(*factor),
            list => ScaleFactors::PerCoordinate(DVector::from_column_slice(list)),
        };
        let of_inputs = match input {
            [] => state,
            input => input,
        };
        let scaling = || Scaling {
            state: factors(state),
            input: factors(of_inputs),
        };
        Self {
            scaling: (!state.is_empty()).then(scaling),
            input_scaling: (state.is_empty() && !input.is_empty()).then(|| factors(input)),
            ..Self::default()
        }
    }

    pub(super) fn first_of(&self, options: &[&'static str]) -> Option<&'static str> {
        let is_given = |option: &&&str| match **option {
            "--map" => !self.mapping.is_empty(),
            "--weights" => self.weights.is_some(),
            "--xi-layout" => self.xi_layout.is_some(),
            "--library-order" => self.library_order.is_some(),
            "--activation" => self.activation.is_some(),
            "--scaling" => self.scaling.is_some(),
            "--input-scaling" => self.input_scaling.is_some(),
            "--order" => self.order.is_some(),
            "--robot" => self.robot.is_some(),
            other => unreachable!("{other} is no option of a table of this module"),
        };
        options.iter().find(is_given).copied()
    }

    pub(super) fn given(&self, phase: &str) -> Option<usize> {
        self.phases.iter().position(|rule| rule.name == phase)
    }

    /// The rule of a phase: as given, or the usual one; `found` of the file belongs to it.
    pub(super) fn feet_of(&self, file: &str, phase: &str, found: &str) -> Read<FeetRule> {
        match (self.given(phase), phase) {
            (Some(place), _) => Ok(self.phases[place].feet.clone()),
            (None, "contact") => Ok(FeetRule::Any),
            (None, "flight") => Ok(FeetRule::None),
            (None, ONLY_PHASE) if self.phases.is_empty() => Ok(FeetRule::always()),
            (None, _) => {
                let found = format!("{found} of phase `{phase}`");
                let expected = format!(
                    "--phase {phase}=any (or none, always, or patterns such as 0011 in the order fr \
                     fl rr rl)"
                );
                Err(ImportError::at(file, Place::Whole, found, expected))
            }
        }
    }

    pub(super) fn usual_feet(&self, phase: &str, feet: &FeetRule) -> Option<String> {
        let note = || {
            format!(
                "phase {phase} is selected by feet `{feet}`, as its name suggests (change with --phase)"
            )
        };
        self.given(phase).is_none().then(note)
    }
}
