//! `romc train`: recordings in, a model file out.

use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};

use serde_json::json;

use super::Answer;
use super::args::{TrainArguments, TrainSettings};
use super::destination::{Format, Inputs};
use super::output::{named, note, note_repeated, quoted, quoted_all, quoted_text, spinner};
use super::prepared_recordings::RecordedSets;
use super::train_settings;
use crate::recording::{Recording, RecordingSet};
use crate::robot::{BODY_X, BODY_Z};
use crate::train::{
    Method, Monitor, Origin, Progress, Recordings, SetMetrics, TrainOptions, TrainReport, Trained,
};
use crate::typeset::{Cell, Table, significant};
use crate::{Error, artifact, train};

pub(crate) fn run(arguments: &TrainArguments) -> Result<Answer, Error> {
    let settings = train_settings::effective(arguments)?;
    Inputs::default()
        .and(&arguments.recordings)
        .and(&arguments.validation)
        .and(&arguments.test)
        .and(&arguments.config)
        .and(&arguments.reading.columns)
        .and_robot(settings.robot.as_deref())
        .and(&settings.actuators)
        .check_output(Some(&arguments.output), Format::MODEL, arguments.force)?;
    let latent_dim = settings.latent_dim.expect("clap or the file's check asks");
    let method = train_settings::method(&settings);
    let robot = train_settings::robot(&settings)?;
    let name = named(arguments.name.as_deref(), &arguments.output);
    let mut options = train_settings::options(&settings, latent_dim, name, robot)?;
    let mut recorded = RecordedSets::new(arguments, &settings, robot, options.seed)?;
    train_settings::identified(&mut options, &settings, &recorded, robot)?;
    options.check()?;
    note_repeated(&recorded.files());
    let read = recorded.read();
    recorded.report_findings();
    read?;
    let [training, validation, test] = recorded.sets.each_ref().map(|set| &set.recordings[..]);
    let sets = Recordings::new(training, validation);
    let files = arguments.recordings.iter().chain(&arguments.validation);
    let command = command_line(arguments, &settings, method, &options);
    let mut origin = Origin::new(command, files);
    for file in &mut origin.recordings {
        file.sets = recorded.sets_of(&file.path);
    }

    let bar = spinner("training");
    let mut listener = |progress: Progress| match progress {
        Progress::Stage { name, .. } => bar.set_message(name),
        Progress::Done { text, .. } => bar.set_message(text),
    };
    let mut monitor = Monitor::new(&mut listener, stop_on_interrupt());
    let mut trained = method.learn(sets, robot, &options, &origin, &mut monitor)?;
    bar.finish_and_clear();
    let is_interrupted = INTERRUPTED.load(Ordering::Relaxed);
    if is_interrupted {
        trained = marked_as_interrupted(trained);
    }
    artifact::write(&arguments.output, &trained.model, arguments.force)?;
    let tested = (!test.is_empty()).then(|| train::assess(&trained.model, test));
    let tested = tested.transpose()?;
    let mut answer = answer(arguments, &trained, tested.as_ref());
    let notes = notes(&trained.report, tested.as_ref(), &recorded.sets);
    notes.iter().for_each(|text| note(text));
    if arguments.split.is_none()
        && let Some(words) = train_settings::without_effect(&settings, &options)
    {
        note(&words);
    }
    answer.json["notes"] = notes.into();
    answer.json["interrupted"] = is_interrupted.into();
    answer.json["recordings"] = recorded.findings_json();
    if let Some((text, json)) = recorded.division() {
        answer.json["split"] = json;
        let _ = write!(answer.text, "\n{text}");
    }
    if is_interrupted {
        answer.text += INTERRUPTED_TEXT;
        answer.code = INTERRUPTED_CODE;
    }
    Ok(answer)
}

const INTERRUPTED_TEXT: &str = "\ninterrupted by Ctrl-C: the model is the best until then, and the command in its provenance, which says so, does not give it again\n";

/// Where whole jumps are worse than standing still: of the validation, or else of the training, and of the test.
fn notes(
    report: &TrainReport,
    tested: Option<&SetMetrics>,
    [training, validation, test]: &[RecordingSet; 3],
) -> Vec<String> {
    let judged = match &report.validation {
        Some(metrics) => ("validation", Some(metrics), validation),
        None => ("training", Some(&report.training), training),
    };
    let sets = [judged, ("test", tested, test)].into_iter();
    sets.filter_map(|(name, metrics, set)| whole_jump_note(metrics?, name, &set.recordings))
        .collect()
}

/// Exit code of a process that Ctrl-C ended: 128 and the number of the signal.
const INTERRUPTED_CODE: u8 = 130;

/// Becomes true at the first Ctrl-C, so that a training ends with the best so far; the second one ends the process.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

fn marked_as_interrupted(trained: Trained) -> Trained {
    note(
        "interrupted: this is the best model so far; its provenance says so, its command does not repeat it",
    );
    let mut provenance = trained.model.provenance().clone();
    provenance.insert("interrupted".to_owned(), true.into());
    let builder = trained.model.into_builder().provenance(provenance);
    let model = builder.build().expect("the model was sound before");
    Trained { model, ..trained }
}

fn stop_on_interrupt() -> &'static AtomicBool {
    // Without a handler (there is one already) Ctrl-C ends the process at once, which leaves no half file either.
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(INTERRUPTED_CODE.into());
        }
    });
    &INTERRUPTED
}

fn command_line(
    arguments: &TrainArguments,
    settings: &TrainSettings,
    method: Method,
    options: &TrainOptions,
) -> String {
    let mut line = format!("romc train {}", quoted_all(&arguments.recordings));
    if !arguments.validation.is_empty() {
        let _ = write!(line, " --validation {}", quoted_all(&arguments.validation));
    }
    if let Some(split) = arguments.split {
        let _ = write!(line, " --split {split}");
    }
    let settings = TrainSettings {
        method: Some(method),
        wrench_frame: Some(options.wrench_frame),
        coordinates: Some(options.coordinates()),
        actuators: Some(train_settings::actuators(settings).to_owned()),
        ..settings.clone()
    };
    line += &train_settings::as_flags(&settings);
    line += &arguments.reading.as_flags();
    if let Some(name) = &arguments.name {
        let _ = write!(line, " --name {}", quoted_text(name));
    }
    let _ = write!(line, " --output {}", quoted(&arguments.output));
    line
}

fn answer(arguments: &TrainArguments, trained: &Trained, tested: Option<&SetMetrics>) -> Answer {
    let report = &trained.report;
    let latent_dim = trained.model.latent_dim();
    let text = format!(
        "{}: {latent_dim} latent coordinates from {} recordings\n\n{}{}",
        arguments.output.display(),
        arguments.recordings.len(),
        metrics_table(report, tested),
        seed_table(report)
    );
    let json = json!({
        "model": arguments.output.display().to_string(),
        "name": trained.model.name(),
        "latent_dim": latent_dim,
        "report": report,
        "test": tested,
    });
    Answer::new(text, json)
}

fn metrics_table(report: &TrainReport, tested: Option<&SetMetrics>) -> Table {
    let mut sets = vec![
        ("training", Some(&report.training)),
        ("validation", report.validation.as_ref()),
    ];
    sets.extend(tested.map(|tested| ("test", Some(tested))));
    let sets_of = sets.iter().map(|(name, _)| *name);
    let mut table = Table::new(["metric", "unit"].into_iter().chain(sets_of));
    let mut row = |name: &str, unit: &str, value: &dyn Fn(&SetMetrics) -> Option<f64>| {
        let cell = |set: &SetMetrics| value(set).map_or("diverged".into(), Cell::from);
        let cells = (sets.iter()).map(|(_, set)| set.map(cell).unwrap_or_default());
        table.row([name.into(), unit.into()].into_iter().chain(cells));
    };
    row("decoder mean square", "scaled", &|m| Some(m.decoder_mse));
    row("torque R^2 of the plain lift, all samples", "", &|m| {
        Some(m.torque_r2)
    });
    let (short, whole) = ("fixed steps over 0.1 s", "fixed steps, whole jump");
    row(&format!("body x, {short}"), "m", &|m| {
        Some(m.prediction_x_m)
    });
    row(&format!("body z, {short}"), "m", &|m| {
        Some(m.prediction_z_m)
    });
    row(&format!("body x, {whole}"), "m", &|m| m.rollout_x_m);
    row(&format!("body z, {whole}"), "m", &|m| m.rollout_z_m);
    for (phase, terms) in report.active_terms.iter().enumerate() {
        let (name, active) = (&terms.phase, terms.active);
        let name = format!("smoothed ddz R^2 in {name} ({active} terms)");
        row(&name, "", &|m| m.ddz_r2.get(phase).copied());
    }
    for score in &report.deviations {
        let name = format!("ddz R^2 of deviations in {}, jump left out", score.part);
        table.row([name.into(), "".into(), Cell::from(score.ddz_r2)]);
    }
    if let Some(overlap) = report.support_overlap {
        let name = format!("overlap of supports, {} seeds", report.seeds.len());
        table.row([name.into(), "".into(), Cell::from(overlap)]);
    }
    table
}

/// The metrics of each seed, the one kept first; empty for one seed.
fn seed_table(report: &TrainReport) -> String {
    if report.seeds.len() < 2 {
        return String::new();
    }
    let table = Table::of(&report.seeds)
        .column("seed", "", |seed| seed.seed.to_string())
        .column("decoder mean square", "", |seed| seed.judged.decoder_mse)
        .column("torque R^2", "", |seed| seed.judged.torque_r2)
        .column("x after 0.1 s", "m", |seed| seed.judged.prediction_x_m)
        .column("z after 0.1 s", "m", |seed| seed.judged.prediction_z_m)
        .column("terms", "", |seed| seed.active)
        .column("latents follow", "", |seed| seed.dominant.join(", "))
        .table();
    format!("\n{table}")
}

const BODY: [usize; 2] = [BODY_X, BODY_Z];

/// A note if rollouts of whole jumps end up further off than a body would be that stays where each jump starts: root mean
/// squares over all samples of the body's error forwards and upwards, and of its way from the start.
fn whole_jump_note(metrics: &SetMetrics, set: &str, recordings: &[Recording]) -> Option<String> {
    let (mut squares, mut samples) = (0.0, 0);
    for segment in recordings.iter().flat_map(|recording| &recording.segments) {
        for row in BODY {
            let start = segment.x[(row, 0)];
            squares += (segment.x.row(row).iter())
                .map(|value| (value - start).powi(2))
                .sum::<f64>();
        }
        samples += segment.len();
    }
    let moved_m = (squares / f64::from(u32::try_from(samples.max(1)).unwrap_or(u32::MAX))).sqrt();
    let off = match (metrics.rollout_x_m, metrics.rollout_z_m) {
        (Some(x), Some(z)) if x.hypot(z) <= moved_m => return None,
        (Some(x), Some(z)) => format!("are {} m off", significant(x.hypot(z))),
        (None, _) | (_, None) => "diverge".to_owned(),
    };
    Some(format!(
        "rollouts of the whole {set} jumps {off}, where a body that stays at its start is {} m off: rely on predictions \
         of 0.1 s only, try another number of latent coordinates, or record more jumps",
        significant(moved_m)
    ))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::recording;

    #[test]
    fn whole_jump_note_appears_where_standing_still_is_better() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/recordings/go1");
        // moves by 0.140 m forwards and 0.065 m upwards, root mean squares
        let jumps = [recording::read(&folder.join("test_01.csv.gz")).expect("shipped")];
        let note = |x: Option<f64>, z: f64| {
            let metrics = SetMetrics {
                decoder_mse: 0.0,
                ddz_r2: Vec::new(),
                torque_r2: 1.0,
                prediction_x_m: 0.0,
                prediction_z_m: 0.0,
                rollout_x_m: x,
                rollout_z_m: Some(z),
            };
            whole_jump_note(&metrics, "validation", &jumps)
        };
        assert_eq!(note(Some(0.13), 0.06), None);
        let found = note(Some(0.15), 0.07).expect("a note");
        assert!(
            found.contains("validation jumps are 0.1655 m off"),
            "{found}"
        );
        assert!(note(Some(3.0), 4.0).expect("a note").contains("5.000 m"));
        assert!(note(None, 0.0).expect("a note").contains("diverge"));
    }
}
