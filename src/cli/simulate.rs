//! `romc simulate`: rollouts over recordings, in full and restarted.

use std::fmt::Write as _;

use serde_json::{Map, Value, json};

use super::Answer;
use super::args::SimulateArguments;
use super::output::{check_output, read_recordings, spinner, write_file};
use super::trajectory::trajectory_table;
use crate::evaluate::{Assessment, Baseline, CoordinateSums, Fit, LinearisedPhase};
use crate::files::Overwrite;
use crate::model::ReducedModel;
use crate::report::{
    baseline_table, coordinate_table, dynamics_table, phase_table, remarks, template_rms,
};
use crate::typeset::significant;
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
        metrics_text(&model, &assessment)
    );
    if let Some(path) = &arguments.output {
        let table = trajectory_table(&model, &assessment.runs)?;
        write_file(path, table.csv().as_bytes(), overwrite)?;
        let _ = writeln!(text, "trajectories: {}", path.display());
    }
    Ok(Answer {
        text,
        json: json!({
            "command": "simulate",
            "model": arguments.model.display().to_string(),
            "rollouts": metrics_json(&model, &assessment),
            "output": arguments.output.as_ref().map(|path| path.display().to_string()),
        }),
    })
}

/// All metrics of an assessment as text.
fn metrics_text(model: &ReducedModel, assessment: &Assessment<'_>) -> String {
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
    let _ = writeln!(
        text,
        "root mean square by phase, restarted every {} s\n\n{}\n{}",
        assessment.restart_every_s,
        phase_table(model, assessment),
        baseline_table(assessment)
    );
    for baseline in &assessment.baselines {
        let constants = baseline.template.constants();
        let _ = writeln!(text, "  {}: {constants}", baseline.name);
    }
    let _ = writeln!(text, "\n{}", dynamics_table(model, assessment));
    if let Some(mean_square) = assessment.decoder_mean_square() {
        let mean_square = significant(mean_square);
        let _ = writeln!(text, "decoder mean square: {mean_square} (scaled units)");
    }
    let shown = |value: Option<f64>| value.map_or("-".to_owned(), significant);
    let lift = &assessment.lift;
    let _ = writeln!(
        text,
        "active terms: {}, combined loss L_mod: {}\n\
         plain lift of exactly projected inputs: torque R^2 {} in contact, {} in flight, {} over all samples; inconsistency {}",
        assessment.active_terms,
        shown(assessment.combined_loss()),
        shown(lift.torque_r2().contact),
        shown(lift.torque_r2().flight),
        shown(lift.torque_r2_all()),
        shown(lift.inconsistency())
    );
    for remark in remarks(model, assessment) {
        let _ = writeln!(text, "\nnote: {remark}");
    }
    text
}

/// All metrics of an assessment as JSON.
pub fn metrics_json(model: &ReducedModel, assessment: &Assessment<'_>) -> Value {
    let lift = &assessment.lift;
    json!({
        "segments": assessment.runs.len(),
        "restart_every_s": assessment.restart_every_s,
        "full": rollouts_json(model, assessment, &assessment.full),
        "restarted": rollouts_json(model, assessment, &assessment.restarted),
        "acceleration_r2": by_phase(model, |index| {
            let fit = assessment.pointwise.acceleration[index].fit();
            json!(fit.and_then(|fit| fit.r2))
        }),
        "linearised": by_phase(model, |index| {
            json!(assessment.linearised[index].as_ref().map(linearised_json))
        }),
        "decoder_mean_square_scaled": assessment.decoder_mean_square(),
        "active_terms": assessment.active_terms,
        "combined_loss": assessment.combined_loss(),
        "lift": {
            "torque_r2": {
                "contact": lift.torque_r2().contact,
                "flight": lift.torque_r2().flight,
                "all": lift.torque_r2_all(),
            },
            "inconsistency": lift.inconsistency(),
        },
        "baselines": assessment.baselines.iter().map(baseline_json).collect::<Vec<_>>(),
        "remarks": remarks(model, assessment),
    })
}

/// A value of each phase under its name.
fn by_phase(model: &ReducedModel, value: impl Fn(usize) -> Value) -> Map<String, Value> {
    let phases = model.phases().iter().enumerate();
    phases
        .map(|(index, phase)| (phase.name.clone(), value(index)))
        .collect()
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
    let [full, restarted] = [&baseline.full, &baseline.restarted]
        .map(template_rms)
        .map(|[x, z]| json!({ "body.x": x, "body.z": z }));
    json!({
        "name": baseline.name,
        "constants": baseline.template.constants(),
        "rms_m": { "full": full, "restarted": restarted },
    })
}

fn rollouts_json(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    sums: &CoordinateSums,
) -> Value {
    let named = |fits: Vec<Option<Fit>>| -> Map<String, Value> {
        let names = assessment.names.iter().zip(&assessment.units).zip(fits);
        let entry = |((name, unit), fit): ((&String, &String), Option<Fit>)| {
            let (rms, r2) = (fit.map(|fit| fit.rms), fit.and_then(|fit| fit.r2));
            (name.clone(), json!({ "unit": unit, "rms": rms, "r2": r2 }))
        };
        names.map(entry).collect()
    };
    json!({
        "rollouts": sums.windows,
        "diverged": sums.diverged,
        "coordinates": named(sums.fits()),
        "phases": by_phase(model, |index| json!(named(sums.phase_fits(index)))),
    })
}
