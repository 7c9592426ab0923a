//! Generated modules, run by the checkers in this folder and compared with results of the interpreter.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use romc::deploy::{EmitOptions, Target, emit};
use romc::equations::Equations;
use romc::files::{Overwrite, write_files};
use romc::lower::Form;
use romc::model::ReducedModel;
use serde_json::{Value, json};

use super::functions::{Function, Kind, Random, functions as functions_of};
use super::tools;

/// Points at which each function is compared.
const N_POINTS: usize = 5;

/// Most points drawn to replace those with non-finite results, which JSON cannot represent.
const MAX_DRAWN: usize = 4000;

/// Compares the functions of a target (Python, CasADi or MATLAB) for models. Without the language it prints a message
/// and returns `None`, except in thorough runs, which fail. Returns the functions omitted because no point with finite
/// results was found.
pub fn check(target: Target, models: Vec<(ReducedModel, Form)>) -> Option<Vec<String>> {
    let models = models.into_iter();
    check_at(
        target,
        models
            .map(|(model, form)| (model, form, Vec::new()))
            .collect(),
    )
}

/// The same with points `(z, dz, u_lat)` for the Jacobian of each model; an empty list stands for random points.
pub fn check_at(
    target: Target,
    models: Vec<(ReducedModel, Form, Vec<Vec<f64>>)>,
) -> Option<Vec<String>> {
    let python = |library| {
        move |cases: &Path| {
            let mut command = python();
            command
                .arg(folder().join("check.py"))
                .arg(library)
                .arg(cases);
            command
        }
    };
    match target {
        Target::Python => {
            let mut probe = self::python();
            run(
                target,
                ".py",
                probe.args(["-c", "import numpy"]),
                models,
                python("numpy"),
            )
        }
        Target::Casadi => {
            let mut probe = self::python();
            let probe = probe.args(["-c", "import numpy, casadi"]);
            run(target, "_casadi.py", probe, models, python("casadi"))
        }
        Target::Matlab => {
            let mut probe = octave();
            let probe = probe.args(["--eval", "exist('jsondecode')"]);
            run(target, ".m", probe, models, |cases: &Path| {
                let mut command = octave();
                let text = format!("check('{}')", cases.display());
                command.current_dir(folder()).args(["--eval", &text]);
                command
            })
        }
        other => panic!("{other:?} is not a script"),
    }
}

/// Emits all models. Returns every function with points and expected results, and the names of functions that are
/// finite nowhere.
fn cases(
    folder: &Path,
    target: Target,
    ending: &str,
    models: Vec<(ReducedModel, Form, Vec<Vec<f64>>)>,
) -> (Vec<Value>, Vec<String>) {
    let (mut cases, mut left_out) = (Vec::new(), Vec::new());
    for (model, form, points) in models {
        let options = EmitOptions {
            form,
            ..EmitOptions::default()
        };
        let files = emit(&Equations::of(&model), &[target], &options).expect("emits");
        let name = model.identifier().as_str();
        let own = folder.join(name);
        write_files(&own, &files, Overwrite::Refuse).expect("written");
        let file = own.join(format!("{name}{ending}"));
        let functions = functions_of(&model, N_POINTS, options.form);
        // In these languages the caller loops over arrays of points.
        for function in functions.into_iter().filter(|f| !f.is_batch()) {
            let full_name = format!("{name}_{}", function.name);
            let points = match &function.kind {
                Kind::Jacobian(..) => points.as_slice(),
                _ if points.is_empty() => &[],
                _ => continue,
            };
            match case(&file, function, points) {
                Some(case) => cases.push(case),
                None => left_out.push(full_name),
            }
        }
    }
    (cases, left_out)
}

/// A function at points with finite results, if there are any.
fn case(file: &Path, mut function: Function, given: &[Vec<f64>]) -> Option<Value> {
    let (from, to) = (function.input_len(), function.output_len());
    let mut random = Random(31);
    let (mut points, mut results) = (Vec::new(), Vec::new());
    function.n_points = 1;
    for drawn in 0..given.len().max(MAX_DRAWN) {
        let point = match given.get(drawn) {
            Some(point) => point.clone(),
            None if given.is_empty() => function.points(&mut random),
            None => break,
        };
        let result = function.interpret(&point);
        if result.iter().all(|value| value.is_finite()) {
            points.extend(point);
            results.extend(result);
        }
        if given.is_empty() && points.len() == N_POINTS * from {
            break;
        }
    }
    if points.len() < from * N_POINTS.min(given.len().max(1)) {
        return None;
    }
    let (inputs, outputs) = (&function.program.inputs, &function.program.outputs);
    let lens = |slots: &[romc::ir::Slot]| slots.iter().map(|s| s.len).collect::<Vec<_>>();
    Some(json!({
        "file": file,
        "model": function.model,
        "function": function.name,
        "is_step": function.is_step(),
        "is_smooth": given.is_empty(),
        "names": inputs.iter().map(|slot| slot.name.as_str()).collect::<Vec<_>>(),
        "points": points.len() / from,
        "inputs": points.chunks(from).map(|p| split(p, &lens(inputs))).collect::<Vec<_>>(),
        "outputs": results.chunks(to).map(|p| split(p, &lens(outputs))).collect::<Vec<_>>(),
        "flat_inputs": points,
        "flat_outputs": results,
        "input_lens": lens(inputs),
        "output_lens": lens(outputs),
    }))
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

fn run(
    target: Target,
    ending: &str,
    probe: &mut Command,
    models: Vec<(ReducedModel, Form, Vec<Vec<f64>>)>,
    checker: impl Fn(&Path) -> Command,
) -> Option<Vec<String>> {
    if !tools::answers(probe) {
        return None;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("cases.json");
    let (cases, left_out) = cases(folder.path(), target, ending, models);
    fs::write(&path, Value::from(cases).to_string()).expect("written");
    let output = checker(&path).output().expect("starts");
    let said = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(
        output.status.success() && said(&output.stdout).contains("functions agree"),
        "{}\n{}",
        said(&output.stdout),
        said(&output.stderr)
    );
    Some(left_out)
}

/// The Python to use: from the environment named by `ROMC_PYTHON`, or from the path.
fn python() -> Command {
    tools::python()
}

fn octave() -> Command {
    let mut command = Command::new("octave");
    command.args(["--no-gui", "--quiet", "--norc"]);
    command
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scripts")
}
