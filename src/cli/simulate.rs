//! `romc simulate`: rollouts over recordings, in full and restarted.

use super::*;

pub(super) fn run(arguments: &SimulateArguments) -> Result<Answer> {
    Inputs::reading(&arguments.reading)
        .and([&arguments.model])
        .and(&arguments.recordings)
        .check_output(arguments.output.as_deref(), Format::TABLE, arguments.force)?;
    let model = artifact::read(&arguments.model)?;
    let recordings = read_for(&model, &arguments.recordings, &arguments.reading)?;
    note_turns(motions(&recordings), CUT);
    note_late_restarts(&recordings, arguments.restart_every);
    let progress = spinner("simulating");
    let assessment = Assessment::over(&model, &recordings, arguments.restart_every)?;
    let horizons = match arguments.verbose {
        true => Horizon::all(&model, &assessment)?,
        false => Vec::new(),
    };
    begin_part(&progress, "running the controller", Some(recordings.len()));
    let judged = |done, total| show_progress(&progress, done, total);
    let (verdict, unmeasured) = verdict_by_default(&model, &recordings, &assessment, judged);
    progress.finish_and_clear();
    let unmeasured =
        unmeasured.map(|reason| format!("torques and control are not judged: {reason}"));
    let mut text = format!(
        "{} over {} of {}\n\n{}{}",
        arguments.model.display(),
        counted(assessment.runs.len(), "segment"),
        counted(recordings.len(), "recording"),
        metrics_text(&model, &assessment, &horizons, arguments.verbose),
        lines("", verdict_lines(&verdict).lines())
    );
    if arguments.verbose {
        text = format!("{}\n{text}", model_text(&model));
    }
    text += &lines("note: ", &unmeasured);
    if let Some(path) = &arguments.output {
        let table = trajectory_table(&model, &assessment)?;
        write_file(path, table.csv().as_bytes(), arguments.force)?;
        let _ = writeln!(text, "trajectories: {}", path.display());
    }
    let mut json = json!({
        "model": arguments.model.display().to_string(),
        "rollouts": assessment_json(&model, &assessment),
        "verdict": verdict,
        "unmeasured": unmeasured,
        "output": shown(&arguments.output),
    });
    if arguments.verbose {
        let horizons = horizons.iter();
        json["horizons"] = horizons.map(|of| horizon_json(&assessment, of)).collect();
    }
    Ok(Answer::new(text, json).failed_if(verdict.fails_predictions()))
}

fn metrics_text(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    horizons: &[Horizon],
    is_verbose: bool,
) -> String {
    let mut text = format!("{}\n", coordinate_table(model, assessment));
    let sums = [&assessment.full, &assessment.restarted].into_iter();
    let kinds = ["full", "restarted"].into_iter().zip(sums);
    for (kind, sums) in kinds.filter(|(_, sums)| sums.diverged > 0) {
        let (diverged, all) = (sums.diverged, sums.windows);
        let words = "rollouts diverged; the table covers them up to there";
        text += &format!("{diverged} of {all} {kind} {words}\n\n");
    }
    let met = |horizon: &&Horizon| horizon.predictors[0].1.windows > 0;
    for horizon in horizons.iter().filter(met) {
        let (name, own) = (&horizon.name, &horizon.predictors[0].1);
        let table = horizon_table(assessment, horizon);
        text += &format!("root mean square errors, {name}\n\n{table}\n");
        if own.diverged > 0 {
            let (diverged, all) = (own.diverged, own.windows);
            text += &format!("{diverged} of {all} rollouts diverged: {name}\n\n");
        }
    }
    text += &format!("{}\n", baseline_table(assessment));
    if is_verbose {
        text += &details(model, assessment);
    }
    text + &lines("note: ", &assessment.remarks)
}

/// Errors by phase, constants of the baselines, dynamics, and the lift of recorded inputs.
fn details(model: &ReducedModel, assessment: &Assessment<'_>) -> String {
    let baselines = assessment.baselines.iter();
    let constants = baselines.map(|of| format!("{}: {}", of.name, of.template.constants()));
    let mut text = lines("  ", constants);
    text += &format!(
        "\nroot mean square error over {} s by phase\n\n{}\n{}\n",
        assessment.restart_every_s,
        phase_table(model, assessment),
        dynamics_table(model, assessment)
    );
    text += &lines("", assessment.stride.as_ref().map(StrideGrowth::words));
    let (lift, r2) = (&assessment.lift, assessment.lift.torque.r2());
    let table = Table::of([
        (
            "mean square of the decoder, scaled units",
            assessment.decoder_mean_square(),
        ),
        ("combined loss L_mod", assessment.combined_loss()),
        ("torque R^2 in contact", r2.contact),
        ("torque R^2 in flight", r2.flight),
        ("torque R^2 of all samples", lift.torque.r2_all()),
        ("inconsistency", lift.inconsistency()),
    ])
    .column("recorded inputs projected and lifted by W_e^T", "", |row| {
        row.0
    })
    .column("value", "", |row| row.1.map(significant))
    .table();
    format!("{text}\n{table}\n")
}

/// `segment, time, phase`, then recorded, full and restarted of each latent coordinate, of its velocity, the latent
/// input, and the three of every robot coordinate in SI units; empty after a divergence.
fn trajectory_table(model: &ReducedModel, assessment: &Assessment<'_>) -> Result<Table> {
    let thrice = |name: String| ["", "_full", "_restarted"].map(|kind| format!("{name}{kind}"));
    let latent = |name: &'static str| numbered(name, model.latent_dim());
    let first = ["segment", "time", "phase"].map(str::to_owned).into_iter();
    let mut table = Table::new(
        first
            .chain(latent("z").flat_map(thrice))
            .chain(latent("dz").flat_map(thrice))
            .chain(latent("u_lat"))
            .chain(assessment.names.iter().cloned().flat_map(thrice)),
    );
    for (index, run) in assessment.runs.iter().enumerate() {
        let (segment, latent) = (&*run.segment, &run.latent);
        let [full, restarted] =
            [&run.full, &run.restarted].map(|rollout| rollout.states(latent.time_s.len()));
        for (sample, states) in full.iter().zip(&restarted).enumerate() {
            let states = [states.0.as_ref(), states.1.as_ref()];
            let z = states.map(|state| state.map(|(z, _)| z));
            let dz = states.map(|state| state.map(|(_, dz)| dz));
            let [full, restarted] = z.map(|z| z.map(|z| model.decode(z)).transpose());
            let (full, restarted) = (full?, restarted?);
            let phase = &model.phases()[latent.phase[sample]].name;
            let time = segment.time_s[sample].to_string();
            let mut row = vec![index.to_string(), time, phase.clone()];
            add(&mut row, latent.z.column(sample).iter(), z);
            add(&mut row, latent.dz.column(sample).iter(), dz);
            row.extend(latent.u_lat.column(sample).iter().map(f64::to_string));
            let decoded = [full.as_ref(), restarted.as_ref()];
            add(&mut row, segment.x.column(sample).iter(), decoded);
            table.row(row);
        }
    }
    Ok(table)
}

fn add<'a>(
    row: &mut Vec<String>,
    recorded: impl Iterator<Item = &'a f64>,
    predicted: [Option<&DVector<f64>>; 2],
) {
    for (index, value) in recorded.enumerate() {
        let cell = |values: Option<&DVector<f64>>| values.map(|values| values[index].to_string());
        row.push(value.to_string());
        row.extend(predicted.map(|values| cell(values).unwrap_or_default()));
    }
}
