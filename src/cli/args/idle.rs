//! Flags that a command would ignore beside its other arguments: one row each, refused as wrong usage.
//!
//! What files would have to be read for, such as settings of a training, is refused or noted by the command itself.

use std::path::Path;

use super::{
    CheckArguments, Command, CompileArguments, ImportArguments, InspectArguments, MpcArguments,
    PlanArguments, ReadingArguments, RobotArguments, StudyArguments, UnitsChoice,
};
use crate::Error;
use crate::artifact::is_standard_input;
use crate::codegen::{Precision, SineCosine};
use crate::deploy::Target;
use crate::import::Format;
use crate::mpc::Lift;
use crate::robot::Robot;

/// A flag with whether it was given, whether anything uses it, and what would.
type Row = (&'static str, bool, bool, &'static str);

/// Refuses the first flag that has no effect.
///
/// # Errors
/// [`Error::Idle`].
pub fn refuse_idle(command: &Command) -> Result<(), Error> {
    let rows = match command {
        Command::Compile(arguments) => of_compile(arguments),
        Command::Inspect(arguments) => of_inspect(arguments),
        Command::Check(arguments) => of_check(arguments),
        Command::Mpc(arguments) => of_mpc(arguments),
        Command::Plan(arguments) => of_plan(arguments),
        Command::Import(arguments) => of_import(arguments),
        Command::Robot(arguments) => of_robot(arguments),
        Command::Study(arguments) => of_study(arguments),
        Command::Demo(_)
        | Command::Train(_)
        | Command::Convert(_)
        | Command::Identify(_)
        | Command::Simulate(_)
        | Command::Report(_)
        | Command::Manual(_)
        | Command::Completions(_) => Vec::new(),
    };
    let idle = rows.into_iter().find(|(_, given, used, _)| *given && !used);
    idle.map_or(Ok(()), |(flag, _, _, needs)| {
        Err(Error::Idle { flag, needs })
    })
}

fn ending(path: &Path) -> String {
    let ending = path.extension().unwrap_or_default();
    ending.to_string_lossy().to_lowercase()
}

fn reading(arguments: &ReadingArguments, is_used: bool, needs: &'static str) -> [Row; 2] {
    [
        ("--columns", arguments.columns.is_some(), is_used, needs),
        ("--clock", arguments.clock.is_some(), is_used, needs),
    ]
}

fn of_compile(arguments: &CompileArguments) -> Vec<Row> {
    use Target::{C, Casadi, ControllerC, Latex, Markdown, Mathml, Matlab, Python, Rust};
    const COMPILED: &str = "--emit with c, rust or controller-c";
    const PRINTED: &str = "--emit with latex, markdown or mathml";
    const LATEX: &str = "--emit with latex";
    let emits = |targets: &[Target]| targets.iter().any(|target| arguments.emit.contains(target));
    let is_compiled = emits(&[C, Rust, ControllerC]);
    let is_code = emits(&[C, Rust, Python, Casadi, Matlab]);
    let is_printed = emits(&[Latex, Markdown, Mathml]);
    let (code, print) = (&arguments.code, &arguments.equations);
    let domain = &arguments.simplification.domain;
    let has_table = domain.iter().any(|path| ending(path) == "toml");
    let has_recordings = !domain.is_empty() && !has_table || arguments.plan.is_some();
    let is_rounded = is_printed || !domain.is_empty();
    let precision = code.precision != Precision::default();
    let sines = code.sincos != SineCosine::default();
    let [scaled, physical] = [UnitsChoice::Scaled, UnitsChoice::Physical].map(|u| code.units == u);
    let mut rows = vec![
        ("--precision", precision, is_compiled, COMPILED),
        ("--sincos", sines, is_compiled, COMPILED),
        (
            "--units scaled",
            scaled,
            is_code,
            "--emit with c, rust, python, casadi or matlab",
        ),
        (
            "--units physical",
            physical,
            is_code || is_printed,
            "--emit with equations or code of functions",
        ),
        ("--digits", print.digits.is_some(), is_rounded, PRINTED),
        (
            "--significant",
            print.significant.is_some(),
            is_rounded,
            PRINTED,
        ),
        ("--rename", !print.rename.is_empty(), is_printed, PRINTED),
        ("--width", print.width.is_some(), is_printed, PRINTED),
        ("--form", print.form.is_some(), emits(&[Latex]), LATEX),
        ("--siunitx", print.siunitx, emits(&[Latex]), LATEX),
    ];
    let recordings = "recordings after --domain or --plan";
    rows.extend(reading(
        &arguments.simplification.reading,
        has_recordings,
        recordings,
    ));
    rows
}

fn of_inspect(arguments: &InspectArguments) -> Vec<Row> {
    let is_model = |path: &std::path::PathBuf| is_standard_input(path) || ending(path) == "json";
    let has_recording = !arguments.files.iter().all(is_model);
    let is_chosen = arguments.robot != "go1";
    let mut rows = vec![("--robot", is_chosen, has_recording, "a recording")];
    let is_read = has_recording && !arguments.guess;
    let needs = "a recording, which --guess does not read by a map";
    rows.extend(reading(&arguments.reading, is_read, needs));
    rows
}

fn of_check(arguments: &CheckArguments) -> Vec<Row> {
    let files = [&arguments.left, &arguments.right];
    let mut formats = files.into_iter().map(|path| Format::of_path(path));
    let has_latex = formats.any(|format| matches!(format, Ok(Format::Latex)));
    let needs = "a file of LaTeX or Markdown";
    vec![
        ("--exact", arguments.exact, has_latex, needs),
        ("--symbols", !arguments.symbols.is_empty(), has_latex, needs),
    ]
}

fn of_mpc(arguments: &MpcArguments) -> Vec<Row> {
    let is_transpose = arguments.lift == Lift::Transpose;
    let needs = "--lift transpose";
    vec![(
        "--torque-rate",
        arguments.torque_rate.is_some(),
        is_transpose,
        needs,
    )]
}

fn of_plan(arguments: &PlanArguments) -> Vec<Row> {
    reading(&arguments.reading, arguments.start.is_some(), "--start").into()
}

fn of_import(arguments: &ImportArguments) -> Vec<Row> {
    let format = arguments
        .format
        .map_or_else(|| Format::of_path(&arguments.file).ok(), Some);
    let is = |wanted: &[Format]| format.is_none_or(|format| wanted.contains(&format));
    let is_latex = is(&[Format::Latex]);
    let has_tensors = is(&[Format::Safetensors, Format::Npz]);
    let tensors = "a file of tensors";
    let mut rows = vec![
        (
            "--symbols",
            !arguments.symbols.is_empty(),
            is_latex,
            "a file of LaTeX or Markdown",
        ),
        (
            "--activation",
            arguments.activation.is_some(),
            has_tensors,
            tensors,
        ),
        ("--order", arguments.order.is_some(), has_tensors, tensors),
        ("--robot", arguments.robot.is_some(), has_tensors, tensors),
        (
            "--scaling",
            !arguments.scaling.is_empty(),
            has_tensors,
            tensors,
        ),
    ];
    rows.extend(reading(
        &arguments.reading,
        !arguments.inputs_from.is_empty(),
        "--inputs-from",
    ));
    rows
}

fn of_robot(arguments: &RobotArguments) -> Vec<Row> {
    let is_file = !Robot::known_names().contains(&arguments.robot.as_str());
    vec![("--feet", !arguments.feet.is_empty(), is_file, "a URDF file")]
}

fn of_study(arguments: &StudyArguments) -> Vec<Row> {
    let trains = arguments.merge.is_empty();
    reading(
        &arguments.reading,
        trains,
        "recordings, which --merge does not read",
    )
    .into()
}
