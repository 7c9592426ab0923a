//! `romc simulate`: rollouts over recordings, in full and restarted.

use std::fmt::Write as _;

use serde_json::json;

use super::Answer;
use super::args::SimulateArguments;
use super::destination::{Format, Inputs, check_output};
use super::output::{read_recordings, spinner, write_file};
use super::trajectory::trajectory_table;
use crate::evaluate::Assessment;
use crate::files::Overwrite;
use crate::model::ReducedModel;
use crate::report::{
    assessment_json, baseline_table, coordinate_table, dynamics_table, phase_table,
};
use crate::typeset::significant;
use crate::typeset::words::counted;
use crate::{Error, artifact};

/// Rolls the model out over every segment of every recording.
///
/// # Errors
/// Whatever reading, encoding or integrating refuses; [`Error::Exists`] for the output file.
pub fn run(arguments: &SimulateArguments) -> Result<Answer, Error> {
    let overwrite = Overwrite::when_forced(arguments.force);
    let inputs = Inputs::default()
        .and([&arguments.model])
        .and(&arguments.recordings)
        .and(&arguments.reading.columns);
    check_output(
        arguments.output.as_deref(),
        Format::Table,
        &inputs,
        overwrite,
    )?;
    let model = artifact::read(&arguments.model)?;
    let recordings = read_recordings(&arguments.recordings, &arguments.reading)?;
    let progress = spinner("simulating");
    let assessment = Assessment::over(&model, &recordings, arguments.restart_every)?;
    progress.finish_and_clear();
    let mut text = format!(
        "{} over {} of {}\n\n{}",
        arguments.model.display(),
        counted(assessment.runs.len(), "segment"),
        counted(recordings.len(), "recording"),
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
            "rollouts": assessment_json(&model, &assessment),
            "output": arguments.output.as_ref().map(|path| path.display().to_string()),
        }),
    })
}

/// All metrics of an assessment as text.
fn metrics_text(model: &ReducedModel, assessment: &Assessment<'_>) -> String {
    let mut text = format!("{}\n", coordinate_table(model, assessment));
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
    for remark in &assessment.remarks {
        let _ = writeln!(text, "\nnote: {remark}");
    }
    text
}
