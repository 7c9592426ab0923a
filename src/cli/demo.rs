//! `romc demo`: the main task with the shipped model and recordings, which are part of the binary.

use super::*;
use crate::mpc::Solver;

const MODEL: (&str, &[u8]) = ("go1-d4.json", include_bytes!("../../models/go1-d4.json"));
const JUMP_1: &[u8] = include_bytes!("../../examples/recordings/go1/test_01.csv.gz");
const JUMP_2: &[u8] = include_bytes!("../../examples/recordings/go1/test_02.csv.gz");
const JUMP_3: &[u8] = include_bytes!("../../examples/recordings/go1/test_03.csv.gz");
/// Names and files of jumps that were not used to train any shipped model.
pub static JUMPS: [(&str, &[u8]); 3] = [
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
    options.print.rounding = UnitsChoice::Physical.usual_rounding();
    let equations = Equations::of(&model).in_physical_units()?;
    let mut files = deploy::emit(&equations, &targets, &options)?;
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
    let is_failed = !failed.is_empty() || self_test.is_err() || verdict.fails_predictions();
    let self_test = self_test.unwrap_or_else(|reason| format!("FAILED: {reason}"));
    let mut text = format!(
        "romc demo: model {} on {} jumps of a simulated Go1 that training did not see\n\
         1. The model\n{}\n\
         2. Predictions from the first state, the recorded torques and contacts\n{}\n\
         3. Control along the jumps, without the recorded torques\n{}\n\
         4. Made in {}; open report.html next\n{}",
        MODEL.0.trim_end_matches(".json"),
        JUMPS.len(),
        model_text(&model).replace("\n\n", "\n"),
        predictions(&model, &evaluation, &verdict)?,
        controllers(&model, &jumps, &control[0])?,
        folder.display(),
        made_text(&model, &self_test)
    );
    if arguments.verbose {
        let tables = [control_table(&control[0]), run_table(&control[0])];
        text += &format!(
            "{}\n{}\n{}\n",
            baseline_table(&evaluation),
            tables[0],
            tables[1]
        );
        text += &lines("", verdict_lines(&verdict).lines());
    } else {
        let [fit, failed] = [&verdict.fit_for, &verdict.failed].map(|uses| uses.join(", "));
        text += &lines(
            "verdict: fit for ",
            Some(fit).filter(|uses| !uses.is_empty()),
        );
        text += &lines(
            "verdict: not fit for ",
            Some(failed).filter(|uses| !uses.is_empty()),
        );
    }
    text += &lines("FAILED along ", failures(&control[0]).iter().chain(&failed));
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

/// Errors of the body compared with the best of all baselines, and the height of the body over the first jump.
fn predictions(
    model: &ReducedModel,
    evaluation: &Assessment<'_>,
    verdict: &crate::evaluate::Verdict,
) -> Result<String> {
    let bodies = ["body.x", "body.z"].into_iter();
    let horizons = [("0.1 s", "0.1 s"), ("the whole motion", "whole jump")];
    let cells = bodies.flat_map(|body| horizons.map(|(of, shown)| (body, of, shown)));
    let rows = cells.map(|(body, of, shown)| {
        let name = format!("error of {body} over {of}");
        let row = verdict.rows.iter().find(|row| row.name == name);
        let row = row.expect("the shipped model decodes the body");
        (format!("{body}, {shown}"), row)
    });
    let in_mm = |rms: f64| 1e3 * rms;
    let table = Table::of(rows)
        .column("root mean square error", "mm", |row| row.0.clone())
        .column("model", "", |(_, row)| row.value.map(in_mm))
        .column("best baseline", "", |(_, row)| row.best_baseline.map(in_mm))
        .column("which", "", |(_, row)| row.best_baseline_name)
        .table();
    let run = &evaluation.runs[0];
    let recorded: Vec<f64> = run.segment.x.row(BODY_Z).iter().copied().collect();
    let states = run.full.states(recorded.len());
    let height = |state: &Option<(DVector<f64>, DVector<f64>)>| match state {
        Some((z, _)) => Ok::<_, Error>(model.decode(z)?[BODY_Z]),
        None => Ok(f64::NAN),
    };
    let predicted = states.iter().map(height).collect::<Result<Vec<_>>>()?;
    let curves = [('.', recorded), ('*', predicted)];
    let chart = chart::chart(&curves, 2);
    Ok(format!(
        "{table}  body height in {}, m: * model, . recorded\n{chart}",
        JUMPS[0].0
    ))
}

/// Torques of the controller and its baselines, deviations after a push, and the time of a step with both solvers.
fn controllers(model: &ReducedModel, jumps: &[Recording], runs: &[NamedRun]) -> Result<String> {
    let metrics: Vec<&ControlMetrics> = mpc::judged(runs);
    let mean = |of: &dyn Fn(&ControlMetrics) -> Option<f64>| {
        let values: Option<Vec<f64>> = metrics.iter().map(|metrics| of(metrics)).collect();
        values.map(|values| values.iter().sum::<f64>() / values.len() as f64)
    };
    let mm = |metres: Option<f64>| metres.map(|metres| 1e3 * metres);
    let rows = [
        (
            "romc",
            mean(&|of| of.torque_r2.contact),
            mean(&|of| mm(of.recovery_rms_m)),
            "with these equations",
        ),
        (
            "no dynamics",
            mean(&|of| of.baseline.no_dynamics.torque_r2.contact),
            mean(&|of| mm(of.baseline.no_dynamics.recovery_rms_m)),
            "with ddz = g u_lat",
        ),
        (
            "no feedback",
            None,
            mean(&|of| mm(of.baseline.feedback_off.recovery_rms_m)),
            "without measurements",
        ),
        (
            "replay",
            None,
            mean(&|of| mm(of.baseline.replay.recovery_rms_m)),
            "recorded torques again",
        ),
    ];
    let table = Table::of(rows)
        .column("controller", "", |row| row.0)
        .column("torques, R^2", "", |row| row.1)
        .column("deviation after a push, mm", "", |row| row.2)
        .column("", "", |row| row.3)
        .table();
    let settings = MpcSettings {
        solver: Solver::Riccati,
        ..usual_settings(model, jumps)
    };
    let mut structured = controller(model, settings)?;
    let run = along_recording(
        &mut structured,
        &jumps[0],
        ReferenceInput::Recorded,
        |_, _| (),
    )?;
    let [clarabel, own] = [&runs[0].1, &run].map(|run| run.summary.step_us.p50);
    Ok(format!(
        "{table}  median time of a step: clarabel {clarabel:.0} us, structured solver {own:.0} us\n"
    ))
}

/// The files by use, and further steps.
fn made_text(model: &ReducedModel, self_test: &str) -> String {
    let name = model.identifier();
    let files = [
        (
            format!("{name}.h, {name}.c, {name}/"),
            format!("C99 (self-test {self_test}) and a Rust crate"),
        ),
        (
            format!("{name}.tex, commands.csv"),
            "equations for a paper; torques of every step".to_owned(),
        ),
    ];
    files
        .map(|(files, words)| format!("  {files:<29} {words}\n"))
        .concat()
}

/// Compiles the emitted C with the machine's compiler and runs its self-test; its outcome, or why it failed.
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
