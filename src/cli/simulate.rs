//! `romc simulate`: rollouts over recordings, in full and restarted.

use std::fmt::Write as _;

use serde_json::{Map, Value, json};

use super::Answer;
use super::args::SimulateArguments;
use super::output::{Table, check_output, read_recordings, significant, spinner, write_file};
use super::trajectory::TrajectoryTable;
use crate::evaluate::{Assessment, Baseline, CoordinateSums, Fit, FitSums, LinearisedPhase};
use crate::files::Overwrite;
use crate::model::ReducedModel;
use crate::{Error, artifact};

/// Rolls the model out over every segment of every recording.
///
/// # Errors
/// Whatever reading, encoding or integrating refuses; [`Error::Exists`] for the output file.
pub fn run(arguments: &SimulateArguments) -> Result<Answer, Error> {
    let overwrite = Overwrite::when_forced(arguments.force);
    check_output(arguments.output.as_deref(), overwrite)?;
    let model = artifact::read(&arguments.model)?;
    let recordings = read_recordings(&arguments.recordings)?;
    let progress = spinner("simulating");
    let assessment = Assessment::over(&model, &recordings, arguments.restart_every)?;
    progress.finish_and_clear();
    let mut text = format!(
        "{} over {} segments of {} recordings\n\n{}",
        arguments.model.display(),
        assessment.runs.len(),
        recordings.len(),
        figures_text(&model, &assessment)
    );
    if let Some(path) = &arguments.output {
        let mut trajectories = TrajectoryTable::new(&model);
        for (index, run) in assessment.runs.iter().enumerate() {
            trajectories.add(&model, index, run)?;
        }
        write_file(path, trajectories.as_bytes(), overwrite)?;
        let _ = writeln!(text, "trajectories: {}", path.display());
    }
    Ok(Answer {
        text,
        json: json!({
            "command": "simulate",
            "model": arguments.model.display().to_string(),
            "rollouts": figures_json(&model, &assessment),
            "output": arguments.output.as_ref().map(|path| path.display().to_string()),
        }),
    })
}

/// All figures of an assessment as text.
pub fn figures_text(model: &ReducedModel, assessment: &Assessment<'_>) -> String {
    let mut text = format!("{}\n", coordinate_table(assessment));
    for (kind, sums) in [
        ("full", &assessment.full),
        ("restarted", &assessment.restarted),
    ] {
        if sums.diverged > 0 {
            let _ = writeln!(
                text,
                "{} of {} {kind} rollouts diverged; the table covers them up to there\n",
                sums.diverged, sums.windows
            );
        }
    }
    let every = assessment.restart_every_s;
    let _ = writeln!(
        text,
        "root mean square by phase, restarted every {every} s\n\n{}",
        phase_table(model, assessment)
    );
    let _ = writeln!(text, "{}", baseline_table(assessment));
    for baseline in &assessment.baselines {
        let constants = baseline.template.constants();
        let _ = writeln!(text, "  {}: {constants}", baseline.name);
    }
    let _ = writeln!(text, "\n{}", dynamics_table(model, assessment));
    if let Some(mean_square) = assessment.decoder_mean_square() {
        let mean_square = significant(mean_square);
        let _ = writeln!(text, "decoder mean square: {mean_square} (scaled units)");
    }
    let _ = writeln!(
        text,
        "active terms: {}, combined loss L_mod: {}",
        assessment.active_terms,
        cell(assessment.combined_loss())
    );
    let lift = &assessment.lift;
    let _ = writeln!(
        text,
        "plain lift of exactly projected inputs: torque R^2 {} in contact, {} in flight, {} over all samples; inconsistency {}",
        cell(lift.torque_r2().contact),
        cell(lift.torque_r2().flight),
        cell(lift.torque_r2_all()),
        cell(lift.inconsistency())
    );
    for remark in remarks(model, assessment) {
        let _ = writeln!(text, "\nnote: {remark}");
    }
    text
}

/// What says that the recordings are unlike those that the model was learned from. Flight says
/// nothing: accelerations hardly vary there, and any model is as far off as their mean.
pub fn remarks(model: &ReducedModel, assessment: &Assessment<'_>) -> Vec<String> {
    let accelerations = assessment.pointwise.acceleration.iter().map(FitSums::fit);
    let worse_than_mean = |fit: &Option<Fit>| fit.and_then(|fit| fit.r2).is_some_and(|r2| r2 < 0.0);
    (model.phases().iter().zip(accelerations))
        .filter(|(phase, fit)| !phase.feet.matches([false; 4]) && worse_than_mean(fit))
        .map(|(phase, _)| {
            format!(
                "in {} the latent accelerations are further off than their mean would be (R^2 below 0): \
                 these recordings are unlike those of the training. Another robot, other signs or \
                 frames, or motions that it never saw? Do not rely on predictions or torques there",
                phase.name
            )
        })
        .collect()
}

fn cell(value: Option<f64>) -> String {
    value.map_or("-".to_owned(), significant)
}

fn rms_cell(fit: Option<Fit>) -> String {
    cell(fit.map(|fit| fit.rms))
}

fn r2_cell(fit: Option<Fit>) -> String {
    let r2 = fit.and_then(|fit| fit.r2);
    r2.map_or("-".to_owned(), |r2| format!("{r2:.3}"))
}

/// Fit of every coordinate, whole and restarted.
pub fn coordinate_table(assessment: &Assessment<'_>) -> Table {
    let every = format!("restarted every {} s", assessment.restart_every_s);
    let mut table = Table::new(["coordinate", "unit", "full rms", "R^2", &every, "R^2"]);
    let (full, restarted) = (assessment.full.fits(), assessment.restarted.fits());
    for (index, name) in assessment.names.iter().enumerate() {
        table.row([
            name.clone(),
            assessment.units[index].clone(),
            rms_cell(full[index]),
            r2_cell(full[index]),
            rms_cell(restarted[index]),
            r2_cell(restarted[index]),
        ]);
    }
    table
}

/// Restarted residuals of every coordinate, a column a phase.
pub fn phase_table(model: &ReducedModel, assessment: &Assessment<'_>) -> Table {
    let mut header = vec!["coordinate".to_owned(), "unit".to_owned()];
    header.extend(model.phases().iter().map(|phase| phase.name.clone()));
    let mut table = Table::new(header);
    let fits: Vec<_> = (0..model.phases().len())
        .map(|phase| assessment.restarted.phase_fits(phase))
        .collect();
    for (index, name) in assessment.names.iter().enumerate() {
        let mut row = vec![name.clone(), assessment.units[index].clone()];
        row.extend(fits.iter().map(|fits| rms_cell(fits[index])));
        table.row(row);
    }
    table
}

/// The model beside the template models, body x and z.
pub fn baseline_table(assessment: &Assessment<'_>) -> Table {
    let mut header = vec!["rms error, m".to_owned(), "model".to_owned()];
    header.extend(assessment.baselines.iter().map(|b| b.name.to_owned()));
    let mut table = Table::new(header);
    let restarted = format!("restarted every {} s", assessment.restart_every_s);
    for name in ["body.x", "body.z"] {
        for (title, is_full) in [("whole jump", true), (restarted.as_str(), false)] {
            let sums = if is_full {
                &assessment.full
            } else {
                &assessment.restarted
            };
            let mut row = vec![
                format!("{name}, {title}"),
                rms_cell(assessment.fit(sums, name)),
            ];
            let of_baseline = |b: &Baseline| rms_cell(baseline_sums(b, is_full, name).fit());
            row.extend(assessment.baselines.iter().map(of_baseline));
            table.row(row);
        }
    }
    table
}

fn baseline_sums(baseline: &Baseline, is_full: bool, name: &str) -> FitSums {
    let sums = if is_full {
        &baseline.full
    } else {
        &baseline.restarted
    };
    if name == "body.x" { sums.x } else { sums.z }
}

/// Latent accelerations, stability and input gain of each phase.
pub fn dynamics_table(model: &ReducedModel, assessment: &Assessment<'_>) -> Table {
    let mut table = Table::new([
        "phase",
        "samples",
        "active terms",
        "latent acceleration R^2",
        "largest Re of eigenvalues, 1/s",
        "input gain condition",
        "input gain rank",
    ]);
    let accelerations = assessment.pointwise.acceleration.iter().map(FitSums::fit);
    for ((phase, linear), fit) in (model.phases().iter())
        .zip(&assessment.linearised)
        .zip(accelerations)
    {
        let linear = linear.as_ref();
        table.row([
            phase.name.clone(),
            linear.map_or("0".to_owned(), |linear| linear.samples.to_string()),
            phase.active_count().to_string(),
            r2_cell(fit),
            cell(linear.and_then(LinearisedPhase::growth_rate)),
            cell(linear.and_then(LinearisedPhase::input_condition)),
            linear.map_or("-".to_owned(), |linear| {
                format!(
                    "{} of {}",
                    linear.input_effective_rank(),
                    model.latent_dim()
                )
            }),
        ]);
    }
    table
}

/// All figures of an assessment as JSON.
pub fn figures_json(model: &ReducedModel, assessment: &Assessment<'_>) -> Value {
    let phases = model.phases().iter().enumerate();
    json!({
        "segments": assessment.runs.len(),
        "restart_every_s": assessment.restart_every_s,
        "full": rollouts_json(model, assessment, &assessment.full),
        "restarted": rollouts_json(model, assessment, &assessment.restarted),
        "acceleration_r2": phases.clone()
            .map(|(index, phase)| {
                let fit = assessment.pointwise.acceleration[index].fit();
                (phase.name.clone(), json!(fit.and_then(|fit| fit.r2)))
            })
            .collect::<Map<_, _>>(),
        "linearised": phases
            .map(|(index, phase)| {
                let value = assessment.linearised[index].as_ref().map(linearised_json);
                (phase.name.clone(), json!(value))
            })
            .collect::<Map<_, _>>(),
        "decoder_mean_square_scaled": assessment.decoder_mean_square(),
        "active_terms": assessment.active_terms,
        "combined_loss": assessment.combined_loss(),
        "lift": {
            "torque_r2": {
                "contact": assessment.lift.torque_r2().contact,
                "flight": assessment.lift.torque_r2().flight,
                "all": assessment.lift.torque_r2_all(),
            },
            "inconsistency": assessment.lift.inconsistency(),
        },
        "baselines": assessment.baselines.iter().map(baseline_json).collect::<Vec<_>>(),
        "remarks": remarks(model, assessment),
    })
}

fn linearised_json(phase: &LinearisedPhase) -> Value {
    json!({
        "samples": phase.samples,
        "eigenvalues_per_s": phase.eigenvalues.iter().map(|v| [v.re, v.im]).collect::<Vec<_>>(),
        "input_singular_values": phase.input_singular_values,
        "input_condition": phase.input_condition(),
        "input_effective_rank": phase.input_effective_rank(),
    })
}

fn baseline_json(baseline: &Baseline) -> Value {
    let rms = |sums: FitSums| sums.fit().map(|fit| fit.rms);
    let pair = |is_full| {
        let [x, z] = ["body.x", "body.z"].map(|name| rms(baseline_sums(baseline, is_full, name)));
        json!({ "body.x": x, "body.z": z })
    };
    json!({
        "name": baseline.name,
        "constants": baseline.template.constants(),
        "rms_m": { "full": pair(true), "restarted": pair(false) },
    })
}

fn fit_json(unit: &str, fit: Option<Fit>) -> Value {
    json!({
        "unit": unit,
        "rms": fit.map(|fit| fit.rms),
        "r2": fit.and_then(|fit| fit.r2),
    })
}

fn rollouts_json(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    sums: &CoordinateSums,
) -> Value {
    let named = |fits: Vec<Option<Fit>>| -> Map<String, Value> {
        let names = assessment.names.iter().zip(&assessment.units).zip(fits);
        names
            .map(|((name, unit), fit)| (name.clone(), fit_json(unit, fit)))
            .collect()
    };
    let phases: Map<_, _> = (model.phases().iter().enumerate())
        .map(|(index, phase)| (phase.name.clone(), json!(named(sums.phase_fits(index)))))
        .collect();
    json!({
        "rollouts": sums.windows,
        "diverged": sums.diverged,
        "coordinates": named(sums.fits()),
        "phases": phases,
    })
}
