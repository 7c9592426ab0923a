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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::{CommandFactory as _, Parser as _};

    use super::*;
    use crate::cli::args::Arguments;

    /// Command lines with a flag that does nothing there, and that flag.
    const IDLE: [(&str, &str); 28] = [
        (
            "compile m.json --out-dir o --emit latex --precision f32",
            "--precision",
        ),
        (
            "compile m.json --out-dir o --emit python --sincos libm",
            "--sincos",
        ),
        (
            "compile m.json --out-dir o --emit latex --units scaled",
            "--units scaled",
        ),
        (
            "compile m.json --out-dir o --emit controller --units physical",
            "--units physical",
        ),
        ("compile m.json --out-dir o --emit c --digits 3", "--digits"),
        (
            "compile m.json --out-dir o --emit c,rust --significant 3",
            "--significant",
        ),
        (
            "compile m.json --out-dir o --emit c --rename z1=x",
            "--rename",
        ),
        (
            "compile m.json --out-dir o --emit python --width 22",
            "--width",
        ),
        (
            "compile m.json --out-dir o --emit markdown --form align",
            "--form",
        ),
        (
            "compile m.json --out-dir o --emit mathml --siunitx",
            "--siunitx",
        ),
        ("compile m.json --out-dir o --columns c.toml", "--columns"),
        ("compile m.json --out-dir o --clock recorded", "--clock"),
        (
            "compile m.json --out-dir o --domain r.toml --clock recorded",
            "--clock",
        ),
        ("inspect m.json --robot go2", "--robot"),
        ("inspect m.json --columns c.toml", "--columns"),
        ("inspect m.json --clock repaired", "--clock"),
        ("inspect --guess log.csv --clock repaired", "--clock"),
        ("check a.json b.txt --exact", "--exact"),
        ("check a.json b.txt --symbols z1=x", "--symbols"),
        (
            "mpc m.json r.csv --lift consistent --torque-rate 100",
            "--torque-rate",
        ),
        ("plan m.json --reach --columns c.toml", "--columns"),
        (
            "plan m.json --distance 0.3 --apex 0.1 --output p.csv --clock recorded",
            "--clock",
        ),
        ("import e.txt --output m.json --symbols z1=x", "--symbols"),
        (
            "import e.tex --output m.json --activation elu",
            "--activation",
        ),
        (
            "import e.txt --output m.json --robot go1 --order body,fl,fr,rl,rr",
            "--order",
        ),
        ("import n.npz --output m.json --columns c.toml", "--columns"),
        ("robot go1 --feet a,b,c,d", "--feet"),
        ("study --merge a b --columns c.toml", "--columns"),
    ];

    /// The same flags where they do something.
    const USED: [&str; 11] = [
        "compile m.json --out-dir o --emit c --precision f32 --units scaled --sincos libm",
        "compile m.json --out-dir o --emit latex --digits 3 --rename z1=x --form align --siunitx",
        "compile m.json --out-dir o --emit c --digits 3 --domain r.csv --clock recorded",
        "compile m.json --out-dir o --emit markdown --units physical --width 22",
        "compile m.json --out-dir o --emit controller-c --plan p.csv --columns c.toml",
        "inspect m.json r.csv --robot go2 --columns c.toml --clock repaired",
        "check a.json b.tex --exact --symbols z1=x",
        "mpc m.json r.csv --torque-rate 100",
        "plan m.json --distance 0.3 --apex 0.1 --output p.csv --start r.csv --clock recorded",
        "import n.npz --output m.json --robot go1 --order body,fl,fr,rl,rr --inputs-from r.csv --clock recorded",
        "robot r.urdf --feet a,b,c,d",
    ];

    fn parsed(line: &str) -> Command {
        let words = ["romc"].into_iter().chain(line.split(' '));
        let parsed = Arguments::try_parse_from(words);
        parsed
            .unwrap_or_else(|error| panic!("{line}: {error}"))
            .command
    }

    #[test]
    fn a_flag_without_effect_is_refused_by_name_and_one_with_effect_is_not() {
        for (line, idle) in IDLE {
            match refuse_idle(&parsed(line)) {
                Err(error @ Error::Idle { flag, .. }) => {
                    assert_eq!(flag, idle, "{line}");
                    assert!(error.is_usage());
                }
                other => panic!("{line}: {other:?}"),
            }
        }
        for line in USED {
            refuse_idle(&parsed(line)).unwrap_or_else(|error| panic!("{line}: {error}"));
        }
    }

    /// Flags that always have an effect, or that clap itself or their command refuses where they have none.
    const ELSEWHERE: &str = "json help version force output out-dir \
        compile: emit as-learned tolerance domain margin save-model plan \
        inspect: guess check: domain convert: inputs-of clock columns identify: robot clock columns \
        simulate: restart-every clock columns mpc: horizon step lift reference-input solver figures clock columns \
        plan: distance apex start figures reach settings \
        report: study figures plan restart-every tolerance clock columns \
        import: format map weights xi-layout library latent-dim phase scaling input-scaling robot wrench-frame \
        actuators sample-time inputs-from unchecked name description \
        train: validation test split config latent-dim method robot paper seed seeds epochs encoder-layers \
        decoder-layers activation lift-weight body-weight bptt-weight bptt-window bptt-stride bptt-decay \
        bptt-integrator slack refinements growth no-rotation degree trigonometric terms actuators wrench-frame phases leave-out-implausible \
        accelerations smooth smooth-rows moving-average mask-std mask-input-share coordinates state-scaling \
        torque-scaling force-scaling moment-scaling name clock columns \
        study: validation latent-dims seeds method paper robot config lambda shard merge";

    #[test]
    fn every_flag_is_in_the_table_or_known_to_be_used_or_refused_elsewhere() {
        let mut known = BTreeSet::new();
        let mut command = "";
        for word in ELSEWHERE.split_whitespace() {
            match word.strip_suffix(':') {
                Some(name) => command = name,
                None => drop(known.insert((command, word))),
            }
        }
        for (line, flag) in IDLE {
            let command = line.split(' ').next().expect("a command");
            let flag = flag.trim_start_matches("--").split(' ').next();
            known.insert((command, flag.expect("a flag")));
        }
        for command in Arguments::command().get_subcommands() {
            for flag in command.get_arguments().filter_map(clap::Arg::get_long) {
                let name = command.get_name();
                let is_known = known.contains(&(name, flag)) || known.contains(&("", flag));
                assert!(is_known, "--{flag} of {name}: can it be without effect?");
            }
        }
    }
}
