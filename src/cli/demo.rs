//! `romc demo`: the main job on the shipped model and recordings, from a recorded jump to torques.
//!
//! Model and recordings are part of the binary, so that the demo runs anywhere.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::json;

use super::args::DemoArguments;
use super::destination::Inputs;
use super::mpc::runs_json;
use super::output::{lines, names, spinner};
use super::simplification::RESTART_S;
use super::{Answer, mpc as mpc_command, report};
use crate::deploy::{self, EmitOptions, Target};
use crate::equations::Equations;
use crate::evaluate::{Assessment, verdict};
use crate::files::EmittedFile;
use crate::model::ReducedModel;
use crate::report::{
    Content, assessment_json, baseline_table, control_table, failed_runs, failures, run_table,
    verdict_lines,
};
use crate::simplify::Tolerance;
use crate::train::sha256;
use crate::{Error, artifact, recording};

const MODEL: (&str, &[u8]) = ("go1-d4.json", include_bytes!("../../models/go1-d4.json"));

const JUMPS: [(&str, &[u8]); 3] = [
    (
        "test_01",
        include_bytes!("../../examples/recordings/go1/test_01.csv.gz"),
    ),
    (
        "test_02",
        include_bytes!("../../examples/recordings/go1/test_02.csv.gz"),
    ),
    (
        "test_03",
        include_bytes!("../../examples/recordings/go1/test_03.csv.gz"),
    ),
];

const REPORT_TOLERANCE: Tolerance = Tolerance::ShareOfRms(0.01);

/// Runs the whole path and reports its files and metrics. The exit code is 1 if predictions of body x or z, the
/// self-test or a run fail.
pub(crate) fn run(arguments: &DemoArguments) -> Result<Answer, Error> {
    let inputs = Inputs::default().into_folder(Some(&arguments.out_dir))?;
    let progress = spinner("reading the shipped model and recordings");
    let model = artifact::read_from_bytes(MODEL.0, MODEL.1)?;
    let jumps = (JUMPS.iter())
        .map(|(name, bytes)| recording::read_from_bytes(name, bytes))
        .collect::<Result<Vec<_>, _>>()?;

    progress.set_message("compiling equations and code");
    let mut files = emitted(&model)?;
    progress.set_message("rolling the model out");
    let evaluation = Assessment::over(&model, &jumps, RESTART_S)?;
    progress.set_message("running the controller");
    let control = mpc_command::run_with_both_lifts(&model, &jumps)?;
    let commands = mpc_command::command_table(&model, &control[0]).csv();
    files.push(EmittedFile::new("commands.csv", commands));
    progress.set_message("drawing the report");
    let digests = JUMPS.map(|(name, bytes)| (PathBuf::from(name), sha256(bytes)));
    let verdict = verdict(&model, &evaluation, &mpc_command::judged(&control[0]));
    let content = Content {
        model: &model,
        assessment: &evaluation,
        verdict: &verdict,
        plain: &control[0],
        consistent: &control[1],
        study: None,
        plan: None,
        digests: &digests,
    };
    let report = report::page_of(&content, REPORT_TOLERANCE, vec!["romc demo".to_owned()])?;
    files.push(EmittedFile::new("report.html", report.page));
    let made = inputs.write_folder(&arguments.out_dir, &files, arguments.force)?;
    progress.set_message("checking the C code");
    let self_test = self_test(&model, &arguments.out_dir);
    progress.finish_and_clear();

    let mut text = format!(
        "romc demo: model {} on {} recorded jumps of a simulated Go1 that its training did not see\n\n{}\n{}\n{}",
        MODEL.0,
        jumps.len(),
        baseline_table(&evaluation),
        control_table(&control[0]),
        run_table(&control[0])
    );
    let failed: Vec<String> = control.iter().flat_map(|runs| failed_runs(runs)).collect();
    text += &lines("FAILED along ", failures(&control[0]).iter().chain(&failed));
    text += &verdict_lines(&verdict);
    let is_failed = !failed.is_empty() || self_test.is_err() || verdict.fails_predictions();
    let self_test = match self_test {
        Ok(words) => words.to_owned(),
        Err(reason) => format!("FAILED: {reason}"),
    };
    let _ = writeln!(text, "\nself-test of the emitted C: {self_test}\n");
    text += &made_in(&arguments.out_dir, &made, &files);
    let json = json!({
        "model": MODEL.0,
        "rollouts": assessment_json(&model, &evaluation),
        "mpc": { "transpose": runs_json(&control[0]), "consistent": runs_json(&control[1]) },
        "self_test": self_test,
        "verdict": verdict,
        "failed": failed,
        "files": names(&made),
    });
    Ok(Answer::new(text, json).failed_if(is_failed))
}

fn emitted(model: &ReducedModel) -> Result<Vec<EmittedFile>, Error> {
    let targets = [Target::Latex, Target::C, Target::Rust];
    let mut options = EmitOptions::default();
    options.print.digest = Some(artifact::digest(model).short());
    Ok(deploy::emit(&Equations::of(model), &targets, &options)?)
}

fn made_in(folder: &Path, made: &[PathBuf], files: &[EmittedFile]) -> String {
    let mut text = format!("made in {}:\n", folder.display());
    for (path, file) in made.iter().zip(files) {
        let name = path.strip_prefix(folder).unwrap_or(path);
        let (name, bytes) = (name.display(), file.contents.len());
        let _ = writeln!(text, "  {name} ({bytes} bytes)");
    }
    text
}

/// Compiles the emitted C with the machine's compiler and runs its self-test: what became of it, or why it failed.
fn self_test(model: &ReducedModel, folder: &Path) -> Result<&'static str, String> {
    let name = model.identifier().as_str();
    let scratch = tempfile::tempdir().map_err(|_| "no temporary folder")?;
    let binary = scratch.path().join("selftest");
    let compiled = Command::new("cc")
        .args(["-std=c99", "-O2", "-o"])
        .arg(&binary)
        .arg(folder.join(format!("{name}.c")))
        .arg(folder.join(format!("{name}_selftest.c")))
        .arg("-lm")
        .output();
    let compiled = match compiled {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Ok("not run: no C compiler `cc` was found");
        }
        compiled => compiled.map_err(|error| error.to_string())?,
    };
    if !compiled.status.success() {
        return Err(String::from_utf8_lossy(&compiled.stderr).into_owned());
    }
    match Command::new(&binary).output() {
        Ok(output) if output.status.success() => Ok("passed"),
        Ok(output) => Err(String::from_utf8_lossy(&output.stdout).into_owned()),
        Err(error) => Err(error.to_string()),
    }
}
