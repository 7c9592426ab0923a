//! `romc mpc`: the latent-space controller along recordings.

use indicatif::ProgressBar;

use super::*;
use crate::evaluate::{Run, Verdict};

pub(super) fn run(arguments: &MpcArguments) -> Result<Answer> {
    let inputs = Inputs::reading(&arguments.reading)
        .and([&arguments.model])
        .and(&arguments.recordings)
        .into_folder(arguments.figures.as_deref())?;
    inputs.check_output(arguments.output.as_deref(), Format::TABLE, arguments.force)?;
    let model = artifact::read(&arguments.model)?;
    let settings = settings(&model, arguments)?;
    let recordings = read_for(&model, &arguments.recordings, &arguments.reading)?;
    note_turns(motions(&recordings), UNROLLED);
    let bar = control_bar(recordings.len());
    let runs = run_all(
        &model,
        &recordings,
        settings,
        arguments.reference_input,
        &bar,
    )?;
    bar.finish_and_clear();
    let runs = JudgedRuns::of(&model, &recordings, runs)?;
    let mut answer = answer(arguments, &settings, &runs);
    let figures = || Ok(control_figures(&model, &settings, &runs.runs));
    let folder = arguments.figures.as_deref();
    inputs.write_figures(folder, figures, arguments.force, &mut answer)?;
    if let Some(path) = &arguments.output {
        let table = command_table(&model, &runs.runs);
        write_file(path, table.csv().as_bytes(), arguments.force)?;
    }
    Ok(answer.failed_if(!runs.failed.is_empty() || runs.verdict.fails_control()))
}

/// A controller's runs along recordings with their verdict.
#[derive(Debug)]
pub struct JudgedRuns {
    runs: Vec<NamedRun>,
    /// Runs most of whose steps have no plan, in words.
    failed: Vec<String>,
    verdict: Verdict,
    remarks: Vec<String>,
}

impl JudgedRuns {
    /// Judges runs along these recordings, each with its path and metrics.
    pub fn of(
        model: &ReducedModel,
        recordings: &[Recording],
        runs: Vec<(PathBuf, Run)>,
    ) -> Result<Self, Error> {
        let assessment = Assessment::over(model, recordings, RESTART_S)?;
        Ok(Self {
            failed: failed_runs(&runs),
            verdict: verdict(model, &assessment, &judged(&runs)),
            remarks: assessment.remarks,
            runs,
        })
    }

    /// Tables, failures and verdict as `romc mpc` prints them.
    pub fn text(&self) -> String {
        let (runs, failed) = (&self.runs, &self.failed);
        let mut text = format!("{}\n{}\n", control_table(runs), run_table(runs));
        text += &lines("FAILED along ", failures(runs).iter().chain(failed));
        text += &lines("", verdict_lines(&self.verdict).lines());
        text + &lines("note: ", &self.remarks)
    }

    /// The same for programs.
    pub fn json(&self) -> Value {
        json!({
            "remarks": self.remarks,
            "failed": self.failed,
            "verdict": self.verdict,
            "runs": runs_json(&self.runs),
        })
    }
}

/// Those next to the recordings, where an option does not replace them.
fn settings(model: &ReducedModel, arguments: &MpcArguments) -> Result<MpcSettings> {
    let usual = crate::mpc::settings_for(model);
    let mut settings = plan_settings::read_for(&arguments.recordings[0], &usual)?;
    for path in &arguments.recordings[1..] {
        if plan_settings::read_for(path, &usual)? != settings {
            let message = format!(
                "found settings of the controller that differ from those for {}, expected the same for all recordings: \
                 follow them one at a time",
                arguments.recordings[0].display()
            );
            return Err(Error::refused(path, message));
        }
    }
    set(&mut settings.horizon, arguments.horizon);
    set(&mut settings.step_s, arguments.step);
    set(&mut settings.lift, arguments.lift);
    set(&mut settings.solver, arguments.solver);
    settings.torque_rate_nm_s = arguments.torque_rate.or(settings.torque_rate_nm_s);
    Ok(settings)
}

/// Of the runs with both lifts those with the lift that the model usually has.
pub(super) fn of_usual_lift<'r>(
    model: &ReducedModel,
    [plain, consistent]: [&'r [NamedRun]; 2],
) -> &'r [NamedRun] {
    match crate::mpc::settings_for(model).lift {
        Lift::Transpose => plain,
        Lift::Consistent => consistent,
    }
}

pub(super) fn judged(runs: &[NamedRun]) -> Vec<&ControlMetrics> {
    let metrics = runs.iter().filter_map(|(_, run)| run.metrics.as_ref());
    metrics.collect()
}

/// Steps of progress of a run along a recording, and of its comparison with baselines.
const STEPS: u64 = 1000;

/// Progress of this number of runs with their comparisons.
fn control_bar(runs: usize) -> ProgressBar {
    progress_bar("running the controller", 2 * STEPS as usize * runs)
}

fn run_all(
    model: &ReducedModel,
    recordings: &[Recording],
    settings: MpcSettings,
    reference_input: ReferenceInput,
    bar: &ProgressBar,
) -> Result<Vec<NamedRun>> {
    let mut controller = controller(model, settings)?;
    let mut runs = Vec::with_capacity(recordings.len());
    for recording in recordings {
        let path = recording.path.display();
        let begun = bar.position();
        bar.set_message(format!("controlling along {path}"));
        controller.reset();
        let progress = |done, total| bar.set_position(begun + STEPS * done as u64 / total as u64);
        let mut run = along_recording(&mut controller, recording, reference_input, progress)?;
        bar.set_message(format!("comparing with baselines along {path}"));
        run.metrics = Some(control_metrics(model, recording, settings)?);
        bar.set_position(begun + 2 * STEPS);
        runs.push((recording.path.clone(), run));
    }
    Ok(runs)
}

pub(super) fn run_with_both_lifts(
    model: &ReducedModel,
    recordings: &[Recording],
) -> Result<[Vec<NamedRun>; 2]> {
    let usual = usual_settings(model, recordings);
    let default = MpcSettings::default();
    if usual.step_s != default.step_s {
        note(&format!(
            "the controller acts every {:.0} ms, as often as there are samples; {:.0} ms is usual",
            1e3 * usual.step_s,
            1e3 * default.step_s
        ));
    }
    let bar = control_bar(2 * recordings.len());
    let with = |lift| {
        let settings = MpcSettings { lift, ..usual };
        run_all(model, recordings, settings, ReferenceInput::Recorded, &bar)
    };
    let runs = [with(Lift::Transpose)?, with(Lift::Consistent)?];
    bar.finish_and_clear();
    Ok(runs)
}

fn answer(arguments: &MpcArguments, settings: &MpcSettings, judged: &JudgedRuns) -> Answer {
    let mut text = format!(
        "{}: latent MPC, {} stages of {} s\n\n{}",
        arguments.model.display(),
        settings.horizon,
        settings.step_s,
        judged.text()
    );
    let mut rows = judged.runs.iter().flat_map(|(_, run)| &run.rows);
    let first = rows.find(|row| row.command.status.has_plan());
    let torques = first.map(|row| row.command.torque_nm.map(|torque| format!("{torque:.2}")));
    text += &lines("first torque command (N m): ", torques.map(|t| t.join(" ")));
    let output = shown(&arguments.output);
    text += &lines("every step: ", &output);
    let mut json = json!({
        "model": arguments.model.display().to_string(),
        "horizon": settings.horizon,
        "step_s": settings.step_s,
    });
    extend(&mut json, judged.json());
    extend(&mut json, json!({ "output": output }));
    Answer::new(text, json)
}

pub(super) fn runs_json(runs: &[NamedRun]) -> Vec<Value> {
    runs.iter().map(run_json).collect()
}

/// `steps` to `prepare_us` and `lift` do not depend on whether the dynamics are right.
fn run_json((path, run): &NamedRun) -> Value {
    let summary = &run.summary;
    let mut value = json!({
        "recording": path.display().to_string(),
        "steps": summary.steps,
        "solved": summary.solved,
        "softened": summary.softened,
        "failed": summary.failed,
        "limit_violations": summary.limit_violations,
        "friction_violations": summary.friction_violations,
        "implausible_steps": summary.implausible,
        "step_us": summary.step_us,
        "prepare_us": summary.prepare_us,
        "lift": {
            "torque_r2": summary.lift_r2,
            "commanded_torque_r2": summary.torque_r2,
            "commanded_torque_rms_nm": summary.torque_rms_nm,
            "inconsistency": summary.inconsistency,
        },
    });
    extend(&mut value, json!(run.metrics));
    value
}

pub(super) fn command_table(model: &ReducedModel, runs: &[NamedRun]) -> Table {
    let latent = |name| numbered(name, model.latent_dim());
    let inputs = match model.input() {
        Some(input) => input.names.clone(),
        None => Robot::input_names().to_vec(),
    };
    let torques = inputs.iter().take(JOINT_DIM);
    let torques: Vec<String> = torques.map(|name| format!("{name} torque")).collect();
    let first = "recording,segment,time,phase,status,solve_us,iterations".split(',');
    let columns = (first.map(str::to_owned))
        .chain(latent("u_lat"))
        .chain(inputs)
        .chain(torques)
        .chain(latent("z_ref"))
        .chain(latent("z"));
    let mut table = Table::new(columns);
    let steps = runs.iter();
    let steps = steps.flat_map(|(path, run)| run.rows.iter().map(move |row| (path, row)));
    for (path, row) in steps {
        let command = &row.command;
        let phase = (command.phase).map(|phase| model.phases()[phase].name.clone());
        let values = (command.u_lat.iter())
            .chain(&row.input)
            .chain(&command.torque_nm)
            .chain(&row.z_reference)
            .chain(&row.z);
        let first = [
            path.display().to_string(),
            row.segment.to_string(),
            row.time_s.to_string(),
            phase.unwrap_or_default(),
            command.status.word().to_owned(),
            format!("{:.1}", command.solve_us),
            command.iterations.to_string(),
        ];
        table.row(first.into_iter().chain(values.map(f64::to_string)));
    }
    table
}
