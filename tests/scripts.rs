//! Generated Python, CasADi and MATLAB code against the interpreter, on shipped and random models.

#[path = "differential/functions.rs"]
mod functions;
#[path = "differential/models.rs"]
mod models;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use functions::{Function, Random, functions as functions_of};
use romc::deploy::{EmitOptions, Target, emit};
use romc::equations::Equations;
use romc::files::Overwrite;
use romc::files::write_files;
use romc::lower::{Form, LowerOptions};
use romc::model::ReducedModel;
use serde_json::{Value, json};

/// Points at which each function is compared.
const N_POINTS: usize = 5;

/// The models, each with the form of its code.
fn all_models() -> Vec<(ReducedModel, Form)> {
    let of = |form: Form| move |model: ReducedModel| (model, form);
    let shipped = models::shipped().into_iter().map(of(Form::Automatic));
    let random = (0..12).map(models::random).map(of(Form::Automatic));
    let tables = (1000..1004).map(models::random).map(of(Form::Tables));
    let nonlinear = (0..3).map(models::random_nonlinear);
    let nonlinear = nonlinear.map(of(Form::Automatic));
    shipped
        .chain(random)
        .chain(tables)
        .chain(nonlinear)
        .collect()
}

/// Emits all models, and returns every function with points and expected results.
fn cases(folder: &Path, target: Target, ending: &str) -> Vec<Value> {
    let mut cases = Vec::new();
    for (model, form) in all_models() {
        let options = EmitOptions {
            lower: LowerOptions { form },
            ..EmitOptions::default()
        };
        let files = emit(&Equations::of(&model), &[target], &options).expect("emits");
        let name = model.identifier().as_str();
        let own = folder.join(name);
        write_files(&own, &files, Overwrite::Refuse).expect("written");
        let file = own.join(format!("{name}{ending}"));
        let functions = functions_of(&model, N_POINTS, &options.lower);
        // Arrays of points are the caller's loop in these languages.
        for function in functions.into_iter().filter(|f| !f.is_batch()) {
            cases.push(case(&file, function));
        }
    }
    cases
}

fn case(file: &Path, mut function: Function) -> Value {
    function.n_points = N_POINTS;
    let points = function.points(&mut Random(31));
    let results = function.interpret(&points);
    let (from, to) = (function.input_len(), function.output_len());
    let (inputs, outputs) = (function.program.inputs(), function.program.outputs());
    let lens = |slots: &[romc::ir::Slot]| slots.iter().map(|s| s.len).collect::<Vec<_>>();
    json!({
        "file": file,
        "model": function.model,
        "function": function.name,
        "is_step": function.is_step(),
        "names": inputs.iter().map(|slot| slot.name.as_str()).collect::<Vec<_>>(),
        "points": N_POINTS,
        "inputs": points.chunks(from).map(|p| split(p, &lens(inputs))).collect::<Vec<_>>(),
        "outputs": results.chunks(to).map(|p| split(p, &lens(outputs))).collect::<Vec<_>>(),
        "flat_inputs": points,
        "flat_outputs": results,
        "input_lens": lens(inputs),
        "output_lens": lens(outputs),
    })
}

fn split<'a>(mut flat: &'a [f64], lens: &[usize]) -> Vec<&'a [f64]> {
    let mut parts = Vec::new();
    for &len in lens {
        let (these, others) = flat.split_at(len);
        parts.push(these);
        flat = others;
    }
    parts
}

/// Writes the cases and runs a checker on them; without its tool says so and returns, unless
/// ROMC_REQUIRE_TOOLS=1.
fn check(target: Target, ending: &str, probe: &mut Command, run: impl Fn(&Path) -> Command) {
    let found = probe.output().is_ok_and(|output| output.status.success());
    if !found {
        let required = std::env::var("ROMC_REQUIRE_TOOLS").is_ok_and(|value| value == "1");
        assert!(!required, "{probe:?} fails and ROMC_REQUIRE_TOOLS=1");
        println!("skipped: {probe:?} fails");
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("cases.json");
    let cases = Value::from(cases(folder.path(), target, ending));
    fs::write(&path, cases.to_string()).expect("written");
    let output = run(&path).output().expect("starts");
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(
        output.status.success() && said(&output.stdout).contains("functions agree"),
        "{}\n{}",
        said(&output.stdout),
        said(&output.stderr)
    );
}

/// The Python to use: of the environment that `ROMC_PYTHON` names, or of the path.
fn python() -> Command {
    Command::new(std::env::var("ROMC_PYTHON").unwrap_or_else(|_| "python3".to_owned()))
}

fn checkers() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scripts")
}

fn check_python(target: Target, library: &'static str, needed: &str, ending: &str) {
    check(target, ending, python().args(["-c", needed]), |cases| {
        let mut command = python();
        command
            .arg(checkers().join("check.py"))
            .arg(library)
            .arg(cases);
        command
    });
}

#[test]
fn numpy_modules_equal_the_interpreter() {
    check_python(Target::Python, "numpy", "import numpy", ".py");
}

#[test]
fn casadi_functions_equal_the_interpreter() {
    check_python(
        Target::Casadi,
        "casadi",
        "import numpy, casadi",
        "_casadi.py",
    );
}

#[test]
fn matlab_files_equal_the_interpreter_in_octave() {
    let octave = || {
        let mut command = Command::new("octave");
        command.args(["--no-gui", "--quiet", "--norc"]);
        command
    };
    check(
        Target::Matlab,
        ".m",
        octave().args(["--eval", "exist('jsondecode')"]),
        |cases| {
            let mut command = octave();
            let text = format!("check('{}')", cases.display());
            command.current_dir(checkers()).args(["--eval", &text]);
            command
        },
    );
}
