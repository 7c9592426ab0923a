//! `romc plan`: a new jump or walk, written as a recording.

use super::convert::write_recording;
use super::*;
use crate::plan::{self, Goal, GoalMap, Plan, PlanSettings, Verdict, WalkGoal, WalkMap, WalkPlan};

const DURATION_S: f64 = 5.0; // of a walk

pub(super) fn run(arguments: &PlanArguments) -> Result<Answer> {
    let inputs = Inputs::reading(&arguments.reading)
        .and([&arguments.model])
        .and(&arguments.start)
        .and(&arguments.settings)
        .into_folder(arguments.figures.as_deref())?;
    let output = arguments.output.as_deref();
    inputs.check_output(output, Format::RECORDING, arguments.force)?;
    let model = artifact::read(&arguments.model)?;
    let robot = model.robot()?;
    let of_controller = match arguments.speed {
        Some(_) => crate::mpc::walk_settings(robot),
        None => plan_settings::of_jumps(robot),
    };
    let settings_path = output.map(plan_settings::path_for);
    let settings_path = settings_path.filter(|path| !plan_settings::is_there(path, &of_controller));
    inputs.check_output(settings_path.as_deref(), Format::TOML, arguments.force)?;
    if let (Some(speed_m_s), Some(path)) = (arguments.speed, output) {
        let goal = WalkGoal {
            speed_m_s,
            yaw_rate_rad_s: arguments.yaw_rate.unwrap_or(0.0),
            duration_s: arguments.duration.unwrap_or(DURATION_S),
        };
        let planned = plan::walk(&model, &goal)?;
        trusted(&planned.verdict, arguments.force)?;
        let mut answer = walk_answer(arguments, &goal, &planned);
        write_plan(
            path,
            planned.motion,
            &of_controller,
            arguments.force,
            &mut answer,
        )?;
        return Ok(answer);
    }
    let settings = arguments.settings.as_deref();
    let settings = settings.map(|path| read_settings(path, PlanSettings::check));
    let settings = settings.transpose()?.unwrap_or_default();
    let figures = arguments.figures.as_deref();
    if arguments.reach && model.jump_prior().is_err() && model.stride_prior().is_ok() {
        let map = plan::walk_reach(&model)?;
        let mut answer = walk_reach_answer(arguments, &map);
        let drawn = || Ok(vec![walk_reach_figure(&map)]);
        inputs.write_figures(figures, drawn, arguments.force, &mut answer)?;
        return Ok(answer);
    }
    if arguments.reach {
        let bar = progress_bar("planning a grid of goals", 0);
        let progress = |done, total| show_progress(&bar, done, total);
        let reach = plan::reach(&model, &settings, progress)?;
        bar.finish_and_clear();
        let mut answer = reach_answer(arguments, &reach);
        let figure = reach_figure(&reach, model.jump_prior()?);
        let drawn = || Ok(vec![figure]);
        inputs.write_figures(figures, drawn, arguments.force, &mut answer)?;
        return Ok(answer);
    }
    let goal = goal(arguments, model.robot()?)?;
    let bar = spinner("planning");
    let planned = plan::plan(&model, &goal, &settings);
    bar.finish_and_clear();
    let planned = planned?;
    trusted(&planned.verdict, arguments.force)?;
    let mut answer = answer(arguments, &planned);
    // Figures first: if their folder is refused, no plan is written.
    let drawn = || Ok(plan_figures(&planned, model.robot()?));
    inputs.write_figures(figures, drawn, arguments.force, &mut answer)?;
    if let Some(path) = output {
        let motion = planned.motion.clone();
        write_plan(path, motion, &of_controller, arguments.force, &mut answer)?;
    }
    Ok(answer)
}

/// Refuses an untrustworthy plan unless it is forced, and warns of extrapolation beyond the recordings.
fn trusted(verdict: &Verdict, force: Overwrite) -> Result<()> {
    match verdict {
        Verdict::Refused(reasons) if force == Overwrite::Refuse => {
            Err(Error::Distrusted(reasons.join("; ")))
        }
        Verdict::Refused(reasons) | Verdict::Extrapolates(reasons) => {
            (reasons.iter()).for_each(|reason| {
                to_stderr("warning:", Style::new().yellow().bold(), reason);
            });
            Ok(())
        }
        Verdict::Trusted => Ok(()),
    }
}

fn write_plan(
    path: &Path,
    motion: Segment,
    of_controller: &MpcSettings,
    force: Overwrite,
    answer: &mut Answer,
) -> Result<()> {
    let (settings, text) = (
        plan_settings::path_for(path),
        plan_settings::text(of_controller),
    );
    write_recording(path, vec![motion], None, force)?;
    if !plan_settings::is_there(&settings, of_controller) {
        write_file(&settings, text.as_bytes(), force)?;
    }
    let [path, settings] = [path, &settings].map(|path| path.display().to_string());
    let _ = writeln!(
        answer.text,
        "\nthe plan: {path}\nsettings of its controller: {settings}"
    );
    answer.json["settings"] = json!(settings);
    Ok(())
}

fn walk_answer(arguments: &PlanArguments, goal: &WalkGoal, planned: &WalkPlan) -> Answer {
    let model = arguments.model.display().to_string();
    let WalkGoal {
        speed_m_s,
        yaw_rate_rad_s,
        duration_s,
    } = *goal;
    let WalkPlan {
        stride_s,
        duty,
        height_m,
        ref verdict,
        ..
    } = *planned;
    let word = verdict.word();
    let text = format!(
        "{model}: a walk of {speed_m_s} m/s that turns by {yaw_rate_rad_s} rad/s for {duration_s} s: {word}\n\n\
         a stride of {stride_s:.3} s, of which each foot stands {:.0} %, with the body at {height_m:.3} m\n",
        100.0 * duty
    );
    let json = json!({
        "model": model,
        "speed_m_s": speed_m_s,
        "yaw_rate_rad_s": yaw_rate_rad_s,
        "duration_s": duration_s,
        "stride_s": stride_s,
        "duty": duty,
        "height_m": height_m,
        "status": word,
        "reasons": verdict.reasons(),
        "output": shown(&arguments.output),
    });
    Answer::new(text, json)
}

fn goal(arguments: &PlanArguments, robot: &'static Robot) -> Result<Goal> {
    let (Some(distance_m), Some(apex_m)) = (arguments.distance, arguments.apex) else {
        unreachable!("clap asks for both without --reach");
    };
    let goal = Goal::new(distance_m, apex_m)?;
    let Some(path) = &arguments.start else {
        return Ok(goal);
    };
    let reader = reader(&arguments.reading, Clocks::Recorded, Some(robot))?;
    let recordings = read_with(&reader, std::slice::from_ref(path))?;
    note_mismatches(&recordings[0], robot);
    let first = &recordings[0].segments[0];
    let column = |rows: &nalgebra::DMatrix<f64>| rows.column(0).into_owned();
    Ok(goal.from_start(column(&first.x), column(&first.dx)))
}

fn answer(arguments: &PlanArguments, planned: &Plan) -> Answer {
    let mut table = Table::new(["", "unit", "planned", "expected error"]);
    for (i, name) in ["distance", "apex"].into_iter().enumerate() {
        let values = [planned.reached_m[i], planned.error_m[i]].map(Cell::from);
        table.row([name.into(), "m".into()].into_iter().chain(values));
    }
    for part in &planned.parts {
        let name = format!("duration of {}", part.name);
        table.row([name.into(), "s".into(), Cell::from(part.duration_s)]);
    }
    let (model, verdict) = (arguments.model.display().to_string(), &planned.verdict);
    let ([distance, apex], word) = (planned.goal_m, verdict.word());
    let text = format!(
        "{model}: a jump of {distance} m with an apex of {apex} m: {word}\n\n{table}\n{}\n{}, {:.0} ms\n",
        margins_table(planned),
        counted(planned.programs, "convex program"),
        planned.solve_ms,
    );
    let mut json = json!({ "model": model });
    extend(&mut json, plan_json(planned));
    json["output"] = json!(shown(&arguments.output));
    Answer::new(text, json)
}

/// Distances of the plan from the recordings and from the limits.
fn margins_table(planned: &Plan) -> Table {
    let margins = &planned.margins;
    let [[slip, lift], [drift, sink]] =
        [margins.foot_slip_m, margins.foot_drift_m].map(|of| of.map(|m| 1e3 * m));
    Table::of([
        ("cost", planned.cost),
        (
            "input, standard deviations from the recorded inputs",
            planned.input_deviation,
        ),
        ("torque, % of the limit", 100.0 * margins.torque_share),
        ("feet along the floor, beyond the mean jump, mm", slip),
        ("feet above the floor, beyond the mean jump, mm", lift),
        ("feet along the floor, mm", drift),
        ("feet below the floor, mm", sink),
    ])
    .column("largest", "", |row| row.0)
    .column("value", "", |row| row.1)
    .table()
}

fn walk_reach_answer(arguments: &PlanArguments, map: &WalkMap) -> Answer {
    let speeds = map.speeds_m_s.iter().map(|speed| format!("{speed:.2}"));
    let corner = "yaw rate, rad/s \\ speed, m/s".to_owned();
    let mut table = Table::new(std::iter::once(corner).chain(speeds));
    let rows = map.points.chunks_exact(map.speeds_m_s.len());
    for (yaw_rate, row) in map.yaw_rates_rad_s.iter().zip(rows).rev() {
        let cells = row.iter().map(|point| match point.status {
            "trusted" => format!("{:.0}", 100.0 * point.torque_share),
            _ => format!("({:.0})", 100.0 * point.torque_share),
        });
        table.row(std::iter::once(format!("{yaw_rate:.2}")).chain(cells));
    }
    let points = map.points.iter().map(|point| {
        json!({
            "speed_m_s": point.speed_m_s,
            "yaw_rate_rad_s": point.yaw_rate_rad_s,
            "status": point.status,
            "torque_share": point.torque_share,
        })
    });
    let model = arguments.model.display().to_string();
    let text = format!(
        "{model}: largest torque of planned walks, % of its limit\n\n{table}\nin brackets: beyond the recorded \
         walks; farther ones are refused\n"
    );
    let points = points.collect::<Vec<_>>();
    Answer::new(text, json!({ "model": model, "reach": points }))
}

fn reach_answer(arguments: &PlanArguments, reach: &GoalMap) -> Answer {
    let distances = reach.distances_m.iter().map(|d| format!("{d:.2}"));
    let corner = "apex, m \\ distance, m".to_owned();
    let mut table = Table::new(std::iter::once(corner).chain(distances));
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
    let model = arguments.model.display().to_string();
    let text = format!(
        "{model}: largest deviation of the planned input from the recorded ones, in standard \
         deviations\n\n{table}\nin brackets: refused; -: no plan\n"
    );
    let solve_ms = json!({ "median": times[times.len() / 2], "max": times[times.len() - 1] });
    let points = points.collect::<Vec<_>>();
    let json = json!({ "model": model, "reach": points, "solve_ms": solve_ms });
    Answer::new(text, json)
}
