//! Flags without effect together with the other arguments of a command, refused as wrong usage.

use super::*;
use crate::Error;
use crate::artifact::is_standard_input;

impl Arguments {
    /// Refuses a flag that has no effect together with the other arguments.
    pub(crate) fn refuse_idle(&self) -> Result<(), Error> {
        match &self.command {
            Command::Compile(arguments) => of_compile(arguments),
            Command::Inspect(arguments) => of_inspect(arguments),
            Command::Check(arguments) => of_check(arguments),
            Command::Import(arguments) => of_import(arguments),
            Command::Mpc(arguments) => {
                Needed("--lift transpose", arguments.lift != Some(Lift::Consistent))
                    .by("--torque-rate", arguments.torque_rate.is_some())
            }
            Command::Plan(arguments) => {
                let walks = Needed("--speed", arguments.speed.is_some());
                walks.by("--yaw-rate", arguments.yaw_rate.is_some())?;
                walks.by("--duration", arguments.duration.is_some())?;
                Needed("--start", arguments.start.is_some()).by_reading(&arguments.reading)
            }
            Command::Robot(arguments) => {
                let is_file = !crate::robot_file::known_names().contains(&arguments.robot.as_str());
                Needed("a URDF file", is_file).by("--feet", !arguments.feet.is_empty())
            }
            Command::Study(arguments) => {
                let needs = "recordings, which --merge does not read";
                Needed(needs, arguments.merge.is_empty()).by_reading(&arguments.reading)
            }
            Command::Demo(_)
            | Command::Train(_)
            | Command::Convert(_)
            | Command::Identify(_)
            | Command::Simulate(_)
            | Command::Report(_)
            | Command::Manual(_)
            | Command::Completions(_) => Ok(()),
        }
    }
}

/// A requirement of flags, in words, and whether it is satisfied.
#[derive(Clone, Copy)]
struct Needed(&'static str, bool);

impl Needed {
    fn by(self, flag: &'static str, is_given: bool) -> Result<(), Error> {
        let Self(needs, is_there) = self;
        match is_given && !is_there {
            true => Err(Error::Idle { flag, needs }),
            false => Ok(()),
        }
    }

    fn by_reading(self, arguments: &ReadingArguments) -> Result<(), Error> {
        self.by("--columns", arguments.columns.is_some())?;
        self.by("--clock", arguments.clock.is_some())
    }
}

fn ending(path: &Path) -> String {
    let ending = path.extension().unwrap_or_default();
    ending.to_string_lossy().to_lowercase()
}

fn of_compile(arguments: &CompileArguments) -> Result<(), Error> {
    use Target::{C, Casadi, ControllerC, Latex, Markdown, Mathml, Matlab, Python, Rust};
    let emits = |targets: &[Target]| targets.iter().any(|target| arguments.emit.contains(target));
    let is_code = emits(&[C, Rust, Python, Casadi, Matlab]);
    let is_printed = emits(&[Latex, Markdown, Mathml]);
    let (code, print) = (&arguments.code, &arguments.equations);
    let simplify = &arguments.simplification;
    let compiled = "--emit with c, rust or controller-c";
    let compiled = Needed(compiled, emits(&[C, Rust, ControllerC]));
    compiled.by("--precision", code.precision != Precision::default())?;
    compiled.by("--sincos", code.sincos != SineCosine::default())?;
    Needed("--emit with c, rust, python, casadi or matlab", is_code)
        .by("--units scaled", code.units == UnitsChoice::Scaled)?;
    let equations = "--emit with equations or code of functions";
    Needed(equations, is_code || is_printed)
        .by("--units physical", code.units == UnitsChoice::Physical)?;
    let printed = Needed("--emit with latex, markdown or mathml", is_printed);
    let rounded = Needed(printed.0, is_printed || !simplify.domain.is_empty());
    rounded.by("--digits", print.digits.is_some())?;
    rounded.by("--significant", print.significant.is_some())?;
    printed.by("--rename", !print.rename.is_empty())?;
    printed.by("--width", print.width.is_some())?;
    let latex = Needed("--emit with latex", emits(&[Latex]));
    latex.by("--form", print.form.is_some())?;
    latex.by("--siunitx", print.siunitx)?;
    let has_table = simplify.domain.iter().any(|path| ending(path) == "toml");
    let is_read = !simplify.domain.is_empty() && !has_table || arguments.plan.is_some();
    Needed("recordings after --domain or --plan", is_read).by_reading(&simplify.reading)
}

fn of_inspect(arguments: &InspectArguments) -> Result<(), Error> {
    let mut files = arguments.files.iter();
    let has_recording = files.any(|path| !is_standard_input(path) && ending(path) != "json");
    Needed("a recording", has_recording).by("--robot", arguments.robot != "go1")?;
    let needs = "a recording, which --guess does not read by a map";
    Needed(needs, has_recording && !arguments.guess).by_reading(&arguments.reading)
}

fn of_check(arguments: &CheckArguments) -> Result<(), Error> {
    let mut files = [&arguments.left, &arguments.right].into_iter();
    let has_latex = files.any(|path| matches!(Format::of_path(path), Ok(Format::Latex)));
    let latex = Needed("a file of LaTeX or Markdown", has_latex);
    latex.by("--exact", arguments.exact)?;
    latex.by("--symbols", !arguments.symbols.is_empty())
}

fn of_import(arguments: &ImportArguments) -> Result<(), Error> {
    // If the name has no known ending, the import recognises the format by the content: every flag is allowed.
    let format = (arguments.format).or_else(|| Format::of_path(&arguments.file).ok());
    let is = |wanted: &[Format]| format.is_none_or(|format| wanted.contains(&format));
    Needed("a file of LaTeX or Markdown", is(&[Format::Latex]))
        .by("--symbols", !arguments.symbols.is_empty())?;
    let tensors = is(&[Format::Safetensors, Format::Npz]);
    let tensors = Needed("a file of tensors", tensors);
    tensors.by("--activation", arguments.activation.is_some())?;
    tensors.by("--order", arguments.order.is_some())?;
    tensors.by("--robot", arguments.robot.is_some())?;
    tensors.by("--scaling", !arguments.scaling.is_empty())?;
    Needed("--inputs-from", !arguments.inputs_from.is_empty()).by_reading(&arguments.reading)
}
