//! Equations to the files of the chosen targets.

use super::*;
use crate::typeset::{PrintOptions, TypesetError, latex, markdown, mathml};
use clap::ValueEnum as _;
use once_cell::unsync::OnceCell;

/// A target of code generation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum Target {
    /// Equations, table of coefficients and nomenclature for papers
    Latex,
    /// C99: header, source, self-test and CMake project
    C,
    /// A crate without `std` or allocation
    Rust,
    /// Equations in GitHub's Markdown
    Markdown,
    /// Equations for web pages
    Mathml,
    /// A Python module on NumPy
    Python,
    /// A Python module of CasADi functions
    Casadi,
    /// A function file for MATLAB and Octave
    Matlab,
    /// The controller as a crate with a C interface
    Controller,
    /// The controller in C99, one file next to the model's
    ControllerC,
}

impl Target {
    /// All targets, in the order in which they are listed.
    pub fn all() -> &'static [Self] {
        Self::value_variants()
    }

    /// The name on the command line.
    pub(crate) fn name(self) -> String {
        let value = self.to_possible_value().expect("no target is hidden");
        value.get_name().to_owned()
    }
}

/// Why the files of a target could not be made from a model.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each variant's message names its fields")]
pub enum EmitError {
    #[error(transparent)]
    Typeset(#[from] TypesetError),
    #[error(transparent)]
    Codegen(#[from] CodegenError),
    #[error(transparent)]
    Lower(#[from] LowerError),
    #[error("the controller cannot be generated")]
    Control(#[from] MpcError),
    #[error(
        "model `{model}`: generated controllers need affine encoders and decoders, this one has \
         layers with an activation"
    )]
    Nonlinear { model: String },
    #[error(
        "model `{model}`, phase `{phase}`: found the name that the controller's own functions have in C, \
         expected another"
    )]
    PhaseName { model: String, phase: String },
    #[error("the recorded jump of the example cannot be read")]
    Jump(#[from] RecordingError),
    #[error("the recorded jump of the example has a posture without forces")]
    JumpInput(#[from] RobotError),
    #[error("a template failed")]
    Template(#[from] askama::Error),
}

/// How files are made from a model.
#[derive(Clone, Debug, Default)]
pub struct EmitOptions {
    /// How programs are made.
    pub form: Form,
    /// How equations are printed, with the digest of the model file for the first lines of files.
    pub print: PrintOptions,
    /// Floating-point numbers of C and Rust.
    pub precision: Precision,
    /// Implementation of sines and cosines in C and Rust.
    pub sines: SineCosine,
    /// Units of robot coordinates in generated code.
    pub units: Units,
    /// The jump of a controller's example.
    pub plan: Option<PlannedJump>,
}

/// The files of the chosen targets, with paths below the output folder; a target chosen twice gives them once. Equal
/// equations and options give equal bytes. Controllers compute in the scaled units of the model's maps, for any units
/// of the equations.
pub fn emit(
    equations: &Equations<'_>,
    targets: &[Target],
    options: &EmitOptions,
) -> Result<Vec<EmittedFile>, EmitError> {
    let provenance = provenance(&equations.model, options.print.digest.as_deref());
    let (precision, sines) = (options.precision, options.sines);
    let (form, units) = (options.form, options.units);
    let made = [const { OnceCell::new() }; 2];
    let for_compilers = || made[0].get_or_try_init(|| compiled(equations, options, units));
    // Languages that compute in double precision alone.
    let for_scripts = || made[1].get_or_try_init(|| ModelInterface::new(equations, form, units));
    let control = equations.in_scaled_units();
    let mut files = Vec::new();
    for (position, target) in targets.iter().enumerate() {
        if targets[..position].contains(target) {
            continue;
        }
        files.extend(match target {
            Target::C => c::emit(for_compilers()?, &provenance, precision, sines)?,
            Target::Rust => rust::emit(for_compilers()?, &provenance, precision, sines)?,
            Target::Python => Script::NumPy.emit(for_scripts()?, &provenance)?,
            Target::Casadi => Script::Casadi.emit(for_scripts()?, &provenance)?,
            Target::Matlab => Script::Matlab.emit(for_scripts()?, &provenance)?,
            Target::Latex => latex::emit(equations, &options.print)?,
            Target::Markdown => markdown::emit(equations, &options.print)?,
            Target::Mathml => mathml::emit(equations, &options.print)?,
            Target::Controller => {
                controller::emit(control, form, &provenance, options.plan.as_ref())?
            }
            Target::ControllerC => controller_c::emit(control, options, &provenance)?,
        });
    }
    Ok(files)
}

pub(super) fn compiled(
    equations: &Equations<'_>,
    options: &EmitOptions,
    units: Units,
) -> Result<ModelInterface, EmitError> {
    if options.precision == Precision::Double {
        return Ok(ModelInterface::new(equations, options.form, units)?);
    }
    let folded = equations.clone().with_constants_folded();
    let entries = ModelInterface::new(&folded, options.form, units)?;
    options.precision.check(&entries)?;
    Ok(entries)
}

/// The first line of generated code, without comment signs.
fn provenance(model: &ReducedModel, digest: Option<&str>) -> String {
    let digest = digest.map_or(String::new(), |digest| format!(", digest {digest}"));
    format!(
        "Generated by romc {} from model `{}`{digest}. Do not edit.",
        env!("CARGO_PKG_VERSION"),
        model.name(),
    )
}
