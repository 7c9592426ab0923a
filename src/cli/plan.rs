//! `romc plan`: a jump that nobody recorded, as a recording.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use super::Answer;
use super::args::{PlanArguments, ReadingArguments};
use super::convert::write_recording;
use super::destination::{Format, Inputs, check_output, write_folder};
use super::output::{names, note_mismatches, progress_bar, reader, spinner, warn};
use super::train_settings::refused;
use crate::files::{EmittedFile, Overwrite};
use crate::model::ReducedModel;
use crate::plan::{self, Goal, Plan, PlanSettings, Reach, Verdict};
use crate::recording::Clocks;
use crate::report::figures::{Figure, figure_files};
use crate::report::{plan_figures, plan_json, reach_figure};
use crate::robot::Robot;
use crate::typeset::{Cell, Table};
use crate::{Error, artifact};

/// Plans a jump and writes it, or maps what can be planned.
///
/// # Errors
/// Whatever reading or planning refuses; [`Error::Distrusted`] for a plan that is not to be trusted,
/// unless forced; [`Error::Exists`] for the output.
pub fn run(arguments: &PlanArguments) -> Result<Answer, Error> {
    let overwrite = Overwrite::when_forced(arguments.force);
    let inputs = inputs(arguments);
    check_output(
        arguments.output.as_deref(),
        Format::Recording,
        &inputs,
        overwrite,
    )?;
    let model = artifact::read(&arguments.model)?;
    let settings = settings(arguments.settings.as_deref())?;
    if arguments.reach {
        return map(arguments, &model, &settings);
    }
    let (Some(distance), Some(apex)) = (arguments.distance, arguments.apex) else {
        unreachable!("clap asks for both without --reach");
    };
    let goal = goal(
        distance,
        apex,
        arguments.start.as_deref(),
        &arguments.reading,
        model.robot()?,
    )?;
    let bar = spinner("planning");
    let planned = plan::plan(&model, &goal, &settings);
    bar.finish_and_clear();
    let planned = planned?;
    match &planned.verdict {
        Verdict::Refused(reasons) if !arguments.force => {
            return Err(Error::Distrusted(reasons.join("; ")));
        }
        Verdict::Refused(reasons) | Verdict::Extrapolates(reasons) => {
            reasons.iter().for_each(|reason| warn(reason));
        }
        Verdict::Trusted => {}
    }
    let mut answer = answer(arguments, &planned);
    // Figures first: a folder that is refused leaves no plan behind.
    draw(
        arguments,
        &plan_figures(&planned, model.robot()?),
        &mut answer,
    )?;
    if let Some(path) = &arguments.output {
        write_recording(path, vec![planned.motion.clone()], None)?;
        let _ = writeln!(answer.text, "\nthe plan: {}", path.display());
    }
    Ok(answer)
}

/// The files that planning reads.
fn inputs(arguments: &PlanArguments) -> Inputs<'_> {
    Inputs::default()
        .and([&arguments.model])
        .and(&arguments.start)
        .and(&arguments.settings)
        .and(&arguments.reading.columns)
}

/// Writes figures, if a folder for them is given.
///
/// # Errors
/// [`Error::Folder`] for files there that romc did not make.
fn draw(arguments: &PlanArguments, figures: &[Figure], answer: &mut Answer) -> Result<(), Error> {
    let Some(folder) = &arguments.figures else {
        return Ok(());
    };
    let files: Vec<EmittedFile> = figures.iter().flat_map(figure_files).collect();
    let overwrite = Overwrite::when_forced(arguments.force);
    let written = write_folder(folder, &files, &inputs(arguments), overwrite)?;
    let _ = writeln!(
        answer.text,
        "{} figures: {}",
        figures.len(),
        folder.display()
    );
    answer.json["figures"] = names(&written).into();
    Ok(())
}

/// The settings of a file, or the defaults.
///
/// # Errors
/// [`Error::Read`], [`Error::Config`].
fn settings(path: Option<&Path>) -> Result<PlanSettings, Error> {
    let Some(path) = path else {
        return Ok(PlanSettings::default());
    };
    let text = fs::read_to_string(path).map_err(|source| Error::Read {
        path: path.to_owned(),
        source,
    })?;
    let settings: PlanSettings =
        toml::from_str(&text).map_err(|error| refused(path, error.to_string().trim_end()))?;
    settings
        .check()
        .map_err(|message| refused(path, &message))?;
    Ok(settings)
}

/// The goal of the arguments.
///
/// # Errors
/// [`Error::Plan`] for numbers that no jump has, [`Error::Recording`] for the start.
fn goal(
    distance_m: f64,
    apex_m: f64,
    start: Option<&Path>,
    reading: &ReadingArguments,
    robot: &Robot,
) -> Result<Goal, Error> {
    let goal = Goal::new(distance_m, apex_m)?;
    let Some(path) = start else { return Ok(goal) };
    let recording = reader(reading, Clocks::Recorded)?.read(path)?.recording;
    note_mismatches(&recording, robot);
    let first = &recording.segments[0];
    let column = |rows: &nalgebra::DMatrix<f64>| rows.column(0).into_owned();
    Ok(goal.from_start(column(&first.x), column(&first.dx)))
}

fn answer(arguments: &PlanArguments, planned: &Plan) -> Answer {
    let mut table = Table::new(["", "unit", "planned", "expected error"]);
    let quantities = ["distance", "apex"].into_iter().enumerate();
    for (i, name) in quantities {
        table.row([
            name.into(),
            "m".into(),
            Cell::from(planned.reached_m[i]),
            Cell::from(planned.error_m[i]),
        ]);
    }
    for part in &planned.parts {
        let name = format!("duration of {}", part.name);
        table.row([
            name.into(),
            "s".into(),
            Cell::from(part.duration_s),
            "".into(),
        ]);
    }
    let margins = &planned.margins;
    let mut text = format!(
        "{}: a jump of {} m with an apex of {} m: {}\n\n{table}\n",
        arguments.model.display(),
        planned.goal_m[0],
        planned.goal_m[1],
        planned.verdict.word()
    );
    let _ = writeln!(
        text,
        "cost {:.3}; largest deviation of the input from the recorded ones: {:.2} standard deviations\n\
         largest torque {:.0} % of its limit; feet on the ground move {:.1} mm along the floor and \
         {:.1} mm above it beyond those of the training's mean jump to this goal, {:.1} mm along it and {:.1} mm \
         below it in all\n{} convex programs, {:.0} ms",
        planned.cost,
        planned.input_deviation,
        100.0 * margins.torque_share,
        1e3 * margins.foot_slip_m[0],
        1e3 * margins.foot_slip_m[1],
        1e3 * margins.foot_drift_m[0],
        1e3 * margins.foot_drift_m[1],
        planned.programs,
        planned.solve_ms,
    );
    for reason in planned.verdict.reasons() {
        let _ = writeln!(text, "{}: {reason}", planned.verdict.word());
    }
    Answer {
        text,
        json: json_of(arguments, planned),
    }
}

/// The object of the documentation.
fn json_of(arguments: &PlanArguments, planned: &Plan) -> Value {
    let mut value = json!({
        "command": "plan",
        "model": arguments.model.display().to_string(),
    });
    if let (Value::Object(all), Value::Object(plan)) = (&mut value, plan_json(planned)) {
        all.extend(plan);
    }
    value["output"] = json!(
        arguments
            .output
            .as_ref()
            .map(|path| path.display().to_string())
    );
    value
}

fn map(
    arguments: &PlanArguments,
    model: &ReducedModel,
    settings: &PlanSettings,
) -> Result<Answer, Error> {
    let bar = progress_bar("planning a grid of goals".to_owned());
    let reach = plan::reach(model, settings, |done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    let mut answer = reach_answer(arguments, &reach);
    let figure = reach_figure(&reach, model.jump_prior()?);
    draw(arguments, &[figure], &mut answer)?;
    Ok(answer)
}

fn reach_answer(arguments: &PlanArguments, reach: &Reach) -> Answer {
    let first = std::iter::once("apex, m \\ distance, m".to_owned());
    let heads = first.chain(reach.distances_m.iter().map(|d| format!("{d:.2}")));
    let mut table = Table::new(heads);
    let rows = reach.points.chunks_exact(reach.distances_m.len());
    for (apex, row) in reach.apexes_m.iter().zip(rows).rev() {
        let cells = row.iter().map(|point| match point.input_deviation {
            Some(deviation) if point.status == "refused" => format!("({deviation:.1})"),
            Some(deviation) => format!("{deviation:.1}"),
            None => "-".to_owned(),
        });
        table.row(std::iter::once(format!("{apex:.3}")).chain(cells));
    }
    let mut times: Vec<f64> = reach.points.iter().map(|point| point.solve_ms).collect();
    times.sort_by(f64::total_cmp);
    let points = reach.points.iter().map(|point| {
        json!({
            "distance_m": point.goal_m[0],
            "apex_m": point.goal_m[1],
            "status": point.status,
            "input_deviation": point.input_deviation,
            "solve_ms": point.solve_ms,
        })
    });
    Answer {
        text: format!(
            "{}: largest deviation of the planned input from the recorded ones, in standard \
             deviations\n\n{table}\nin brackets: refused; -: no plan\n",
            arguments.model.display()
        ),
        json: json!({
            "command": "plan",
            "model": arguments.model.display().to_string(),
            "reach": points.collect::<Vec<_>>(),
            "solve_ms": {
                "median": times[times.len() / 2],
                "max": times[times.len() - 1],
            },
        }),
    }
}
