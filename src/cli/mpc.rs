//! `romc mpc`: the latent-space controller along recordings.

use std::fmt::Write as _;
use std::path::PathBuf;

use serde_json::{Value, json};

use super::Answer;
use super::args::{LiftChoice, MpcArguments, ReferenceInput};
use super::output::{Table, check_output, progress_bar, read_recordings, significant, write_file};
use super::report::figure_files;
use crate::evaluate;
use crate::evaluate::{Run, StepRow};
use crate::files::Overwrite;
use crate::files::{EmittedFile, write_files};
use crate::model::ReducedModel;
use crate::mpc::{Controller, Lift, MpcSettings};
use crate::recording::Recording;
use crate::report::control_figures;
use crate::robot::{JOINT_DIM, Robot};
use crate::{Error, artifact};

/// Runs the controller along each recording.
///
/// # Errors
/// Whatever reading or the controller's set-up refuses; [`Error::Exists`] for the output file.
pub fn run(arguments: &MpcArguments) -> Result<Answer, Error> {
    let overwrite = Overwrite::when_forced(arguments.force);
    check_output(arguments.output.as_deref(), overwrite)?;
    let model = artifact::read(&arguments.model)?;
    let settings = MpcSettings {
        horizon: arguments.horizon,
        step_s: arguments.step,
        lift: match arguments.lift {
            LiftChoice::Transpose => Lift::Transpose,
            LiftChoice::Consistent => Lift::Consistent,
        },
        ..MpcSettings::default()
    };
    let reference_input = match arguments.reference_input {
        ReferenceInput::Recorded => evaluate::ReferenceInput::Recorded,
        ReferenceInput::None => evaluate::ReferenceInput::None,
    };
    let recordings = read_recordings(&arguments.recordings)?;
    let runs = run_all(&model, &recordings, settings, reference_input)?;
    let mut answer = answer(arguments, &runs);
    if let Some(folder) = &arguments.figures {
        let figures = control_figures(&model, &settings, &runs);
        let files: Vec<EmittedFile> = figures.iter().flat_map(figure_files).collect();
        let written = write_files(folder, &files, overwrite)?;
        let count = figures.len();
        let _ = writeln!(answer.text, "{count} figures: {}", folder.display());
        let paths = written.iter().map(|path| path.display().to_string());
        answer.json["figures"] = paths.collect::<Vec<_>>().into();
    }
    if let Some(path) = &arguments.output {
        write_file(path, command_table(&model, &runs).as_bytes(), overwrite)?;
    }
    Ok(answer)
}

/// A recording and what the controller did along it.
pub type NamedRun = (PathBuf, Run);

/// Runs a fresh controller along each recording.
///
/// # Errors
/// Whatever reading or the controller's set-up refuses.
pub fn run_all(
    model: &ReducedModel,
    recordings: &[Recording],
    settings: MpcSettings,
    reference_input: evaluate::ReferenceInput,
) -> Result<Vec<NamedRun>, Error> {
    let mut controller = Controller::new(model, settings)?;
    let mut runs = Vec::with_capacity(recordings.len());
    for recording in recordings {
        let bar = progress_bar(format!("controlling along {}", recording.path.display()));
        controller.reset();
        let run = evaluate::along_recording(
            &mut controller,
            recording,
            reference_input,
            |done, total| {
                bar.set_length(total as u64);
                bar.set_position(done as u64);
            },
        )?;
        bar.finish_and_clear();
        runs.push((recording.path.clone(), run));
    }
    Ok(runs)
}

/// The figures of runs, a row each.
pub fn run_table(runs: &[NamedRun]) -> Table {
    let header = [
        "recording",
        "steps",
        "solved",
        "softened",
        "failed",
        "torque R^2 contact",
        "flight",
        "rms N m",
        "lift R^2 contact",
        "limit violations",
        "friction violations",
        "median us",
        "p99 us",
    ];
    let mut table = Table::new(header);
    let optional = |value: Option<f64>| value.map_or("-".to_owned(), significant);
    for (path, run) in runs {
        let summary = &run.summary;
        table.row([
            path.file_name()
                .map_or(String::new(), |name| name.to_string_lossy().into_owned()),
            summary.steps.to_string(),
            summary.solved.to_string(),
            summary.softened.to_string(),
            summary.failed.to_string(),
            optional(summary.torque_r2.contact),
            optional(summary.torque_r2.flight),
            optional(summary.torque_rms_nm),
            optional(summary.lift_r2.contact),
            summary.limit_violations.to_string(),
            summary
                .friction_violations
                .map_or("-".to_owned(), |count| count.to_string()),
            format!("{:.0}", summary.step_us.p50),
            format!("{:.0}", summary.step_us.p99),
        ]);
    }
    table
}

fn answer(arguments: &MpcArguments, runs: &[NamedRun]) -> Answer {
    let table = run_table(runs);
    let mut text = format!(
        "{}: latent MPC, {} stages of {} s\n\n{table}\n",
        arguments.model.display(),
        arguments.horizon,
        arguments.step
    );
    if let Some(row) = runs
        .iter()
        .flat_map(|(_, run)| &run.rows)
        .find(|row| row.status.has_plan())
    {
        let torques = row.torque_nm.map(|torque| format!("{torque:.2}")).join(" ");
        let _ = writeln!(text, "first torque command (N m): {torques}");
    }
    if let Some(path) = &arguments.output {
        let _ = writeln!(text, "every step: {}", path.display());
    }
    Answer {
        text,
        json: json!({
            "command": "mpc",
            "model": arguments.model.display().to_string(),
            "horizon": arguments.horizon,
            "step_s": arguments.step,
            "runs": runs.iter().map(run_json).collect::<Vec<_>>(),
            "output": arguments.output.as_ref().map(|path| path.display().to_string()),
        }),
    }
}

/// The summary of one run, under the names of the documentation.
pub fn run_json((path, run): &NamedRun) -> Value {
    let summary = &run.summary;
    json!({
        "recording": path.display().to_string(),
        "steps": summary.steps,
        "solved": summary.solved,
        "softened": summary.softened,
        "failed": summary.failed,
        "step_us": {
            "p50": summary.step_us.p50, "p99": summary.step_us.p99, "max": summary.step_us.max,
        },
        "torque_r2": {
            "contact": summary.torque_r2.contact, "flight": summary.torque_r2.flight,
        },
        "lift_r2": { "contact": summary.lift_r2.contact, "flight": summary.lift_r2.flight },
        "torque_rms_nm": summary.torque_rms_nm,
        "tracking_rms": summary.tracking_rms,
        "limit_violations": summary.limit_violations,
        "friction_violations": summary.friction_violations,
        "inconsistency": summary.inconsistency,
        "implausible_steps": summary.implausible,
    })
}

/// One CSV row a control step.
pub fn command_table(model: &ReducedModel, runs: &[NamedRun]) -> String {
    let d = model.latent_dim();
    let input_names = match model.input() {
        Some(input) => input.names.clone(),
        None => Robot::input_names().to_vec(),
    };
    let mut header: Vec<String> = [
        "recording",
        "segment",
        "time",
        "phase",
        "status",
        "solve_us",
        "iterations",
    ]
    .map(str::to_owned)
    .to_vec();
    header.extend((1..=d).map(|i| format!("u_lat_{i}")));
    header.extend(input_names.iter().cloned());
    header.extend(
        input_names
            .iter()
            .take(JOINT_DIM)
            .map(|name| format!("{name} torque")),
    );
    header.extend((1..=d).map(|i| format!("z_ref_{i}")));
    header.extend((1..=d).map(|i| format!("z_{i}")));
    let mut text = header.join(",");
    text.push('\n');
    for (path, run) in runs {
        for row in &run.rows {
            write_row(&mut text, model, &path.display().to_string(), row);
        }
    }
    text
}

fn write_row(text: &mut String, model: &ReducedModel, recording: &str, row: &StepRow) {
    let phase = row
        .phase
        .map_or("", |phase| model.phases()[phase].name.as_str());
    let _ = write!(
        text,
        "{},{},{},{phase},{},{:.1},{}",
        quoted(recording),
        row.segment,
        row.time_s,
        row.status.word(),
        row.solve_us,
        row.iterations
    );
    let values = (row.u_lat.iter())
        .chain(&row.input)
        .chain(&row.torque_nm)
        .chain(&row.z_reference)
        .chain(&row.z);
    for value in values {
        let _ = write!(text, ",{value}");
    }
    text.push('\n');
}

/// A CSV cell that may hold a comma or a quote.
fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}
