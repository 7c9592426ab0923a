//! `romc train`: recordings in, a model file out.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use serde_json::json;

use super::Answer;
use super::args::{TrainArguments, TrainMethod};
use super::output::{Table, check_output, read_recordings, significant, spinner};
use crate::files::Overwrite;
use crate::recording::Recording;
use crate::robot::Robot;
use crate::train::{Origin, Progress, Recordings, SetMetrics, TrainOptions, Trained, Watch};
use crate::{Error, artifact, train};

/// Learns a model and writes it.
///
/// # Errors
/// Whatever reading or training refuses; [`Error::Exists`] for the model file.
pub fn run(arguments: &TrainArguments) -> Result<Answer, Error> {
    let overwrite = Overwrite::when_forced(arguments.force);
    check_output(Some(&arguments.output), overwrite)?;
    let robot = Robot::by_name(&arguments.robot)?;
    let training = read_recordings(&arguments.recordings)?;
    let validation = read_recordings(&arguments.validation)?;
    let sets = Recordings {
        training: &training,
        validation: &validation,
    };
    let all: Vec<Recording> = training.iter().chain(&validation).cloned().collect();
    let origin = Origin::new(command_line(arguments), &all);
    let options = TrainOptions::new(model_name(arguments), arguments.latent_dim);

    let bar = spinner("training");
    let mut listener = |news: Progress| match news {
        Progress::Stage { name, .. } => bar.set_message(name),
        Progress::Done { text, .. } => bar.set_message(text),
    };
    let cancel = AtomicBool::new(false);
    let mut watch = Watch::new(&mut listener, &cancel);
    let trained = match arguments.method {
        TrainMethod::ClosedForm => train::closed_form(sets, robot, &options, &origin, &mut watch)?,
    };
    bar.finish_and_clear();
    artifact::write_with(&arguments.output, &trained.model, overwrite)?;
    Ok(answer(arguments, &trained))
}

fn model_name(arguments: &TrainArguments) -> String {
    let stem = || {
        arguments
            .output
            .file_stem()
            .map(|stem| stem.to_string_lossy().into_owned())
    };
    arguments.name.clone().or_else(stem).unwrap_or_default()
}

/// The command that repeats this training, as the provenance keeps it.
fn command_line(arguments: &TrainArguments) -> String {
    let paths = |paths: &[PathBuf]| {
        let texts = paths.iter().map(|path| path.display().to_string());
        texts.collect::<Vec<_>>().join(" ")
    };
    let mut line = format!("romc train {}", paths(&arguments.recordings));
    if !arguments.validation.is_empty() {
        let _ = write!(line, " --validation {}", paths(&arguments.validation));
    }
    let TrainMethod::ClosedForm = arguments.method;
    let _ = write!(
        line,
        " --latent-dim {} --method closed-form --output {}",
        arguments.latent_dim,
        arguments.output.display()
    );
    line
}

fn answer(arguments: &TrainArguments, trained: &Trained) -> Answer {
    let report = &trained.report;
    let mut table = Table::new(["figure", "unit", "training", "validation"]);
    let validation = report.validation.as_ref();
    let mut row = |name: &str, unit: &str, value: &dyn Fn(&SetMetrics) -> Option<f64>| {
        let cell = |set: Option<&SetMetrics>, absent: &str| {
            set.map_or(String::new(), |set| {
                value(set).map_or(absent.to_owned(), significant)
            })
        };
        table.row([
            name.to_owned(),
            unit.to_owned(),
            cell(Some(&report.training), "diverged"),
            cell(validation, "diverged"),
        ]);
    };
    row("decoder mean square", "scaled", &|set| {
        Some(set.decoder_mse)
    });
    row("torque R^2 of the plain lift", "", &|set| {
        Some(set.torque_r2)
    });
    row("body x after 0.1 s", "m", &|set| Some(set.prediction_x_m));
    row("body z after 0.1 s", "m", &|set| Some(set.prediction_z_m));
    row("body x, whole jump", "m", &|set| set.rollout_x_m);
    row("body z, whole jump", "m", &|set| set.rollout_z_m);
    for (phase, terms) in report.active_terms.iter().enumerate() {
        let name = format!("ddz R^2 in {} ({} terms)", terms.phase, terms.active);
        row(&name, "", &|set| set.ddz_r2.get(phase).copied());
    }
    let text = format!(
        "{}: {} latent coordinates from {} recordings\n\n{table}",
        arguments.output.display(),
        arguments.latent_dim,
        arguments.recordings.len()
    );
    Answer {
        text,
        json: json!({
            "command": "train",
            "model": arguments.output.display().to_string(),
            "name": trained.model.name(),
            "latent_dim": arguments.latent_dim,
            "report": report,
        }),
    }
}
