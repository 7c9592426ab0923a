//! `romc demo`: the main job on the shipped model and recordings, which are part of the binary.

use super::*;
use crate::evaluate::Verdict;

const MODEL: (&str, &[u8]) = ("go1-d4.json", include_bytes!("../../models/go1-d4.json"));
const JUMP_1: &[u8] = include_bytes!("../../examples/recordings/go1/test_01.csv.gz");
const JUMP_2: &[u8] = include_bytes!("../../examples/recordings/go1/test_02.csv.gz");
const JUMP_3: &[u8] = include_bytes!("../../examples/recordings/go1/test_03.csv.gz");
const JUMPS: [(&str, &[u8]); 3] = [
    ("test_01", JUMP_1),
    ("test_02", JUMP_2),
    ("test_03", JUMP_3),
];

const REPORT_TOLERANCE: Tolerance = Tolerance::ShareOfRms(0.01);

pub(super) fn run(arguments: &DemoArguments) -> Result<Answer> {
    let folder = &arguments.out_dir;
    let inputs = Inputs::default().into_folder(Some(folder))?;
    let progress = spinner("reading the shipped model and recordings");
    let model = artifact::read_from_bytes(MODEL.0, MODEL.1)?;
    let jumps = (JUMPS.iter())
        .map(|(name, bytes)| crate::recording::read_from_bytes(name, bytes))
        .collect::<Result<Vec<_>, _>>()?;

    progress.set_message("compiling equations and code");
    let targets = [Target::Latex, Target::C, Target::Rust];
    let mut options = EmitOptions::default();
    options.print.digest = Some(artifact::digest(&model).short());
    let mut files = deploy::emit(&Equations::of(&model), &targets, &options)?;
    progress.set_message("rolling the model out");
    let evaluation = Assessment::over(&model, &jumps, RESTART_S)?;
    progress.finish_and_clear();
    let control = mpc::run_with_both_lifts(&model, &jumps)?;
    let commands = mpc::command_table(&model, &control[0]).csv();
    files.push(EmittedFile::new("commands.csv", commands));
    let digests = JUMPS.map(|(name, bytes)| (PathBuf::from(name), sha256(bytes)));
    let verdict = verdict(&model, &evaluation, &mpc::judged(&control[0]));
    let content = Content {
        model: &model,
        assessment: &evaluation,
        verdict: &verdict,
        plain: &control[0],
        usual: &control[0],
        consistent: &control[1],
        study: None,
        plan: None,
        digests: &digests,
    };
    let report = report::page_of(&content, REPORT_TOLERANCE, vec!["romc demo".to_owned()])?;
    files.push(EmittedFile::new("report.html", report.page));
    let made = inputs.write_folder(folder, &files, arguments.force)?;
    let progress = spinner("checking the C code");
    let self_test = self_test(&model, folder);
    progress.finish_and_clear();

    let failed: Vec<String> = control.iter().flat_map(|runs| failed_runs(runs)).collect();
    let mut text = figures(&evaluation, &control[0], &failed, &verdict);
    let is_failed = !failed.is_empty() || self_test.is_err() || verdict.fails_predictions();
    let self_test = self_test.unwrap_or_else(|reason| format!("FAILED: {reason}"));
    let _ = writeln!(text, "\nself-test of the emitted C: {self_test}\n");
    let _ = writeln!(text, "made in {}:", folder.display());
    let size = |file: &EmittedFile| format!("{} ({} bytes)", file.path, file.contents.len());
    text += &lines("  ", files.iter().map(size));
    let json = json!({
        "model": MODEL.0,
        "rollouts": assessment_json(&model, &evaluation),
        "mpc": {"transpose": mpc::runs_json(&control[0]), "consistent": mpc::runs_json(&control[1])},
        "self_test": self_test,
        "verdict": verdict,
        "failed": failed,
        "files": names(&made),
    });
    Ok(Answer::new(text, json).failed_if(is_failed))
}

/// What is printed of the rollouts and of the controller.
fn figures(
    evaluation: &Assessment,
    runs: &[NamedRun],
    failed: &[String],
    verdict: &Verdict,
) -> String {
    let mut text = format!(
        "romc demo: model {} on {} recorded jumps of a simulated Go1 that its training did not see\n\n{}\n{}\n{}",
        MODEL.0,
        JUMPS.len(),
        baseline_table(evaluation),
        control_table(runs),
        run_table(runs)
    );
    text += &lines("FAILED along ", failures(runs).iter().chain(failed));
    text + &verdict_lines(verdict)
}

/// Compiles the emitted C with the machine's compiler and runs its self-test: what became of it, or why it failed.
fn self_test(model: &ReducedModel, folder: &Path) -> Result<String, String> {
    let name = model.identifier().as_str();
    let scratch = tempfile::tempdir().map_err(|_| "no temporary folder")?;
    let binary = scratch.path().join("selftest");
    let compiled = process::Command::new("cc")
        .args(["-std=c99", "-O2", "-o"])
        .arg(&binary)
        .arg(folder.join(format!("{name}.c")))
        .arg(folder.join(format!("{name}_selftest.c")))
        .arg("-lm")
        .output();
    match compiled {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Ok("not run: no C compiler `cc` was found".to_owned());
        }
        Err(error) => return Err(error.to_string()),
        Ok(compiled) if !compiled.status.success() => {
            return Err(String::from_utf8_lossy(&compiled.stderr).into_owned());
        }
        Ok(_) => {}
    }
    match process::Command::new(&binary).output() {
        Ok(output) if output.status.success() => Ok("passed".to_owned()),
        Ok(output) => Err(String::from_utf8_lossy(&output.stdout).into_owned()),
        Err(error) => Err(error.to_string()),
    }
}
