//! Flags that a command would ignore beside its other arguments, refused as wrong usage.
//!
//! What files would have to be read for, such as settings of a training, is refused or noted by the command itself.

use std::path::{Path, PathBuf};

use super::{
    CheckArguments, Command, CompileArguments, ImportArguments, InspectArguments, ReadingArguments,
    UnitsChoice,
};
use crate::Error;
use crate::artifact::is_standard_input;
use crate::codegen::{Precision, SineCosine};
use crate::deploy::Target;
use crate::import::Format;
use crate::mpc::Lift;

/// Refuses the first flag that has no effect.
///
/// # Errors
/// [`Error::Idle`].
pub fn refuse_idle(command: &Command) -> Result<(), Error> {
    match command {
        Command::Compile(arguments) => of_compile(arguments),
        Command::Inspect(arguments) => of_inspect(arguments),
        Command::Check(arguments) => of_check(arguments),
        Command::Import(arguments) => of_import(arguments),
        Command::Mpc(arguments) => {
            let (lift, rate) = (arguments.lift, arguments.torque_rate);
            let flags = [("--torque-rate", rate.is_some())];
            refuse(lift == Lift::Transpose, "--lift transpose", &flags)
        }
        Command::Plan(arguments) => {
            let has_start = arguments.start.is_some();
            refuse(has_start, "--start", &reading(&arguments.reading))
        }
        Command::Robot(arguments) => {
            let is_file = !crate::robot_file::known_names().contains(&arguments.robot.as_str());
            let flags = [("--feet", !arguments.feet.is_empty())];
            refuse(is_file, "a URDF file", &flags)
        }
        Command::Study(arguments) => {
            let needs = "recordings, which --merge does not read";
            refuse(
                arguments.merge.is_empty(),
                needs,
                &reading(&arguments.reading),
            )
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

/// Refuses the first flag that was given, unless what it needs is there.
fn refuse(is_used: bool, needs: &'static str, flags: &[(&'static str, bool)]) -> Result<(), Error> {
    match flags.iter().find(|(_, given)| *given && !is_used) {
        Some(&(flag, _)) => Err(Error::Idle { flag, needs }),
        None => Ok(()),
    }
}

fn reading(arguments: &ReadingArguments) -> [(&'static str, bool); 2] {
    let (columns, clock) = (&arguments.columns, arguments.clock);
    [
        ("--columns", columns.is_some()),
        ("--clock", clock.is_some()),
    ]
}

fn ending(path: &Path) -> String {
    let ending = path.extension().unwrap_or_default();
    ending.to_string_lossy().to_lowercase()
}

fn of_compile(arguments: &CompileArguments) -> Result<(), Error> {
    use Target::{C, Casadi, ControllerC, Latex, Markdown, Mathml, Matlab, Python, Rust};
    const PRINTED: &str = "--emit with latex, markdown or mathml";
    let emits = |targets: &[Target]| targets.iter().any(|target| arguments.emit.contains(target));
    let (is_code, is_printed) = (
        emits(&[C, Rust, Python, Casadi, Matlab]),
        emits(&[Latex, Markdown, Mathml]),
    );
    let (code, print, simplify) = (
        &arguments.code,
        &arguments.equations,
        &arguments.simplification,
    );
    let compiled = [
        ("--precision", code.precision != Precision::default()),
        ("--sincos", code.sincos != SineCosine::default()),
    ];
    let is_compiled = emits(&[C, Rust, ControllerC]);
    refuse(
        is_compiled,
        "--emit with c, rust or controller-c",
        &compiled,
    )?;
    let scaled = [("--units scaled", code.units == UnitsChoice::Scaled)];
    refuse(
        is_code,
        "--emit with c, rust, python, casadi or matlab",
        &scaled,
    )?;
    let physical = [("--units physical", code.units == UnitsChoice::Physical)];
    let needs = "--emit with equations or code of functions";
    refuse(is_code || is_printed, needs, &physical)?;
    let rounding = [
        ("--digits", print.digits.is_some()),
        ("--significant", print.significant.is_some()),
    ];
    refuse(
        is_printed || !simplify.domain.is_empty(),
        PRINTED,
        &rounding,
    )?;
    let printed = [
        ("--rename", !print.rename.is_empty()),
        ("--width", print.width.is_some()),
    ];
    refuse(is_printed, PRINTED, &printed)?;
    let latex = [
        ("--form", print.form.is_some()),
        ("--siunitx", print.siunitx),
    ];
    refuse(emits(&[Latex]), "--emit with latex", &latex)?;
    let has_table = simplify.domain.iter().any(|path| ending(path) == "toml");
    let has_domain = !simplify.domain.is_empty() && !has_table;
    let needs = "recordings after --domain or --plan";
    let is_read = has_domain || arguments.plan.is_some();
    refuse(is_read, needs, &reading(&simplify.reading))
}

fn of_inspect(arguments: &InspectArguments) -> Result<(), Error> {
    let is_model = |path: &PathBuf| is_standard_input(path) || ending(path) == "json";
    let has_recording = !arguments.files.iter().all(is_model);
    let robot = [("--robot", arguments.robot != "go1")];
    refuse(has_recording, "a recording", &robot)?;
    let needs = "a recording, which --guess does not read by a map";
    let is_read = has_recording && !arguments.guess;
    refuse(is_read, needs, &reading(&arguments.reading))
}

fn of_check(arguments: &CheckArguments) -> Result<(), Error> {
    let is_latex = |path: &PathBuf| matches!(Format::of_path(path), Ok(Format::Latex));
    let has_latex = [&arguments.left, &arguments.right]
        .into_iter()
        .any(is_latex);
    let flags = [
        ("--exact", arguments.exact),
        ("--symbols", !arguments.symbols.is_empty()),
    ];
    refuse(has_latex, "a file of LaTeX or Markdown", &flags)
}

fn of_import(arguments: &ImportArguments) -> Result<(), Error> {
    let of_path = || Format::of_path(&arguments.file).ok();
    let format = arguments.format.or_else(of_path);
    let is = |wanted: &[Format]| format.is_none_or(|format| wanted.contains(&format));
    let symbols = [("--symbols", !arguments.symbols.is_empty())];
    refuse(
        is(&[Format::Latex]),
        "a file of LaTeX or Markdown",
        &symbols,
    )?;
    let of_tensors = [
        ("--activation", arguments.activation.is_some()),
        ("--order", arguments.order.is_some()),
        ("--robot", arguments.robot.is_some()),
        ("--scaling", !arguments.scaling.is_empty()),
    ];
    let has_tensors = is(&[Format::Safetensors, Format::Npz]);
    refuse(has_tensors, "a file of tensors", &of_tensors)?;
    let is_read = !arguments.inputs_from.is_empty();
    refuse(is_read, "--inputs-from", &reading(&arguments.reading))
}
