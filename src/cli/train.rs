//! `romc train`: recordings in, a model file out.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::json;

use super::Answer;
use super::actuators::NONE;
use super::args::{TrainArguments, TrainMethod, TrainSettings};
use super::output::{Table, check_output, significant, spinner};
use super::prepared_recordings::{RecordedSets, read_all};
use super::train_settings;
use crate::files::Overwrite;
use crate::robot::{Robot, WrenchFrame};
use crate::train::{Origin, Progress, Recordings, SetMetrics, TrainReport, Trained, Watch};
use crate::{Error, artifact, train};

/// Learns a model and writes it.
///
/// # Errors
/// Whatever reading or training refuses; [`Error::Exists`] for the model file.
pub fn run(arguments: &TrainArguments) -> Result<Answer, Error> {
    let overwrite = Overwrite::when_forced(arguments.force);
    check_output(Some(&arguments.output), overwrite)?;
    let settings = train_settings::effective(arguments)?;
    let latent_dim = settings
        .latent_dim
        .expect("checked by clap, or with the file");
    let method = train_settings::method(&settings);
    let robot = Robot::by_name(settings.robot.as_deref().unwrap_or("go1"))?;
    let options = train_settings::options(&settings, latent_dim, model_name(arguments))?;
    let recorded = RecordedSets::new(arguments, &settings, robot, options.seed)?;
    // a fault of the test recordings ends the command before the training
    read_all(&recorded.test)?;
    let sets = Recordings::new(&recorded.training, &recorded.validation);
    let files = arguments.recordings.iter().chain(&arguments.validation);
    let command = command_line(arguments, &settings, method, options.wrench_frame);
    let origin = Origin::of_files(command, files);

    let bar = spinner("training");
    let mut findings_reported = false;
    let mut report_findings = || {
        if !std::mem::replace(&mut findings_reported, true) {
            bar.suspend(|| recorded.report_findings());
        }
    };
    let mut listener = |news: Progress| match news {
        Progress::Stage { name, .. } => {
            report_findings();
            bar.set_message(name);
        }
        Progress::Done { text, .. } => bar.set_message(text),
    };
    let mut watch = Watch::new(&mut listener, stop_on_interrupt());
    let learn = match method {
        TrainMethod::ClosedForm => train::closed_form,
        TrainMethod::Joint => train::joint,
    };
    let trained = learn(sets, robot, &options, &origin, &mut watch);
    report_findings();
    let trained = trained?;
    bar.finish_and_clear();
    artifact::write_with(&arguments.output, &trained.model, overwrite)?;
    let mut answer = match recorded.test.is_empty() {
        true => answer(arguments, &trained, None),
        false => {
            let tested = train::assess(&trained.model, &recorded.test)?;
            answer(arguments, &trained, Some(&tested))
        }
    };
    answer.json["recordings"] = recorded.findings_json();
    if let (Some(sets), Some(json)) = (&recorded.divided, recorded.json()) {
        answer.json["split"] = json;
        let [training, validation, test] = sets.each_ref().map(Vec::len);
        let _ = writeln!(
            answer.text,
            "\nof the jumps {training} were for training, {validation} for validation, {test} for test"
        );
    }
    Ok(answer)
}

/// Becomes true at the first Ctrl-C, so that a training ends with the best so far; the second one ends the process.
fn stop_on_interrupt() -> &'static AtomicBool {
    static INTERRUPTED: AtomicBool = AtomicBool::new(false);
    // Without a handler (there is one already) Ctrl-C ends the process at once, which leaves no half file either.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    &INTERRUPTED
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
fn command_line(
    arguments: &TrainArguments,
    settings: &TrainSettings,
    method: TrainMethod,
    wrench_frame: WrenchFrame,
) -> String {
    let paths = |paths: &[PathBuf]| {
        let texts = paths.iter().map(|path| path.display().to_string());
        texts.collect::<Vec<_>>().join(" ")
    };
    let mut line = format!("romc train {}", paths(&arguments.recordings));
    if !arguments.validation.is_empty() {
        let _ = write!(line, " --validation {}", paths(&arguments.validation));
    }
    if let Some(split) = arguments.split {
        let _ = write!(line, " --split {split}");
    }
    let settings = TrainSettings {
        method: Some(method),
        wrench_frame: Some(wrench_frame),
        actuators: Some(settings.actuators.clone().unwrap_or(NONE.to_owned())),
        ..settings.clone()
    };
    line += &train_settings::as_flags(&settings);
    let _ = write!(line, " --output {}", arguments.output.display());
    line
}

fn answer(arguments: &TrainArguments, trained: &Trained, tested: Option<&SetMetrics>) -> Answer {
    let report = &trained.report;
    let mut sets = vec![
        ("training", Some(&report.training)),
        ("validation", report.validation.as_ref()),
    ];
    if tested.is_some() {
        sets.push(("test", tested));
    }
    let names = sets.iter().map(|(name, _)| *name);
    let mut table = Table::new(["figure", "unit"].into_iter().chain(names));
    let mut row = |name: &str, unit: &str, value: &dyn Fn(&SetMetrics) -> Option<f64>| {
        let cell = |set: Option<&SetMetrics>| {
            set.map_or(String::new(), |set| {
                value(set).map_or("diverged".to_owned(), significant)
            })
        };
        let label = [name.to_owned(), unit.to_owned()].into_iter();
        table.row(label.chain(sets.iter().map(|(_, set)| cell(*set))));
    };
    row("decoder mean square", "scaled", &|set| {
        Some(set.decoder_mse)
    });
    row("torque R^2 of the plain lift, all samples", "", &|set| {
        Some(set.torque_r2)
    });
    row("body x, fixed steps over 0.1 s", "m", &|set| {
        Some(set.prediction_x_m)
    });
    row("body z, fixed steps over 0.1 s", "m", &|set| {
        Some(set.prediction_z_m)
    });
    row("body x, fixed steps, whole jump", "m", &|set| {
        set.rollout_x_m
    });
    row("body z, fixed steps, whole jump", "m", &|set| {
        set.rollout_z_m
    });
    for (phase, terms) in report.active_terms.iter().enumerate() {
        let name = format!(
            "smoothed ddz R^2 in {} ({} terms)",
            terms.phase, terms.active
        );
        row(&name, "", &|set| set.ddz_r2.get(phase).copied());
    }
    if let Some(overlap) = report.support_overlap {
        let name = format!("overlap of supports, {} seeds", report.seeds.len());
        table.row([name, String::new(), significant(overlap), String::new()]);
    }
    let text = format!(
        "{}: {} latent coordinates from {} recordings\n\n{table}{}",
        arguments.output.display(),
        trained.model.latent_dim(),
        arguments.recordings.len(),
        seed_table(report)
    );
    Answer {
        text,
        json: json!({
            "command": "train",
            "model": arguments.output.display().to_string(),
            "name": trained.model.name(),
            "latent_dim": trained.model.latent_dim(),
            "report": report,
            "test": tested,
        }),
    }
}

/// What each seed came to, the one kept first; empty for one seed.
fn seed_table(report: &TrainReport) -> String {
    if report.seeds.len() < 2 {
        return String::new();
    }
    let mut table = Table::new([
        "seed",
        "decoder mean square",
        "torque R^2",
        "x after 0.1 s, m",
        "z after 0.1 s, m",
        "terms",
        "latents follow",
    ]);
    for seed in &report.seeds {
        table.row([
            seed.seed.to_string(),
            significant(seed.judged.decoder_mse),
            significant(seed.judged.torque_r2),
            significant(seed.judged.prediction_x_m),
            significant(seed.judged.prediction_z_m),
            seed.active.to_string(),
            seed.dominant.join(", "),
        ]);
    }
    format!("\n{table}")
}
