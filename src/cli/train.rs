//! `romc train`: recordings in, a model file out.

use std::sync::atomic::{AtomicBool, Ordering};

use super::*;

pub(super) fn run(arguments: &TrainArguments) -> Result<Answer> {
    let settings = TrainSettings::effective(arguments)?;
    let reading = &arguments.reading;
    Inputs::reading(reading)
        .and(&arguments.recordings)
        .and(&arguments.validation)
        .and(&arguments.test)
        .and(&arguments.config)
        .and_robot(settings.robot.as_deref())
        .and(&settings.actuators)
        .check_output(
            reading.file_of_model(&arguments.output),
            Format::MODEL,
            arguments.force,
        )?;
    let latent_dim = settings.latent_dim.expect("clap or the file's check asks");
    let (method, robot) = (settings.method(), settings.robot()?);
    let name = named(arguments.name.as_deref(), &arguments.output);
    let mut options = settings.options(latent_dim, name, robot)?;
    let mut recorded = RecordedSets::new(arguments, &settings, robot, options.seed)?;
    settings.identify(&mut options, &recorded, robot)?;
    options.check()?;
    note_repeated(&recorded.files());
    let read = recorded.read();
    recorded.report_findings();
    read?;
    let [training, validation, test] = recorded.sets.each_ref().map(|set| &set.recordings[..]);
    let sets = Recordings::new(training, validation);
    let command = command_line(arguments, &settings, method, &options);
    let origin = origin(arguments, command, &recorded);

    settings.check_phases(&mut options, training)?;

    let bar = spinner("training");
    let mut listener = |progress: Progress| match progress {
        Progress::Stage { name, steps } => begin_part(&bar, name, steps),
        Progress::Done { text } => {
            bar.set_message(text);
            bar.inc(1);
        }
        Progress::Step => bar.inc(1),
    };
    let stop = match &reading.host {
        Some(host) => &host.stop,
        None => stop_on_interrupt(),
    };
    let mut monitor = Monitor::new(&mut listener, stop);
    let mut trained = method.learn(sets, robot, &options, &origin, &mut monitor)?;
    bar.finish_and_clear();
    let is_interrupted = stop.load(Ordering::Relaxed);
    if is_interrupted {
        trained = marked_as_interrupted(trained);
    }
    reading.write_model(&arguments.output, &trained.model, arguments.force)?;
    let tested = (!test.is_empty()).then(|| assess(&trained.model, test));
    let tested = tested.transpose()?;
    let mut answer = answer(arguments, &trained, tested.as_ref());
    let notes = notes(&trained.report, tested.as_ref(), &recorded.sets);
    notes.iter().for_each(|text| note(text));
    let without_effect = settings.without_effect(&options);
    let without_effect = without_effect.filter(|_| arguments.split.is_none());
    without_effect.iter().for_each(|text| note(text));
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

fn origin(arguments: &TrainArguments, command: String, recorded: &RecordedSets) -> Origin {
    let files = arguments.recordings.iter().chain(&arguments.validation);
    let mut origin = Origin::new(command, files);
    for file in &mut origin.recordings {
        file.sets = recorded.sets_of(&file.path);
    }
    origin
}

const INTERRUPTED_TEXT: &str = "\ninterrupted by Ctrl-C: the model is the best one until then; its provenance is marked as interrupted, and the command there does not reproduce it\n";

/// Where whole jumps are worse than standing still: of the validation, or else of the training, and of the test.
fn notes(
    report: &TrainReport,
    tested: Option<&SetMetrics>,
    [training, validation, test]: &[RecordingSet; 3],
) -> Vec<String> {
    let judged = match &report.validation {
        Some(metrics) => ("validation", metrics, validation),
        None => ("training", &report.training, training),
    };
    let tested = tested.map(|metrics| ("test", metrics, test));
    let sets = std::iter::once(judged).chain(tested);
    sets.filter_map(|(name, metrics, set)| whole_jump_note(metrics, name, &set.recordings))
        .collect()
}

/// Exit code of a process that Ctrl-C ended: 128 and the number of the signal.
const INTERRUPTED_CODE: u8 = 130;

/// Becomes true at the first Ctrl-C, so that a training ends with the best so far; the second one ends the process.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

fn marked_as_interrupted(trained: Trained) -> Trained {
    note(
        "interrupted: this is the best model so far; its provenance is marked as interrupted, and the command there does not reproduce it",
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
    let validation = Some(&arguments.validation).filter(|paths| !paths.is_empty());
    line.extend(validation.map(|paths| format!(" --validation {}", quoted_all(paths))));
    line.extend(arguments.split.map(|split| format!(" --split {split}")));
    let settings = TrainSettings {
        method: Some(method),
        wrench_frame: Some(options.wrench_frame),
        coordinates: Some(options.coordinates()),
        actuators: Some(settings.actuators().to_owned()),
        ..settings.clone()
    };
    line += &(settings.as_flags() + &arguments.reading.as_flags());
    let name = arguments.name.iter();
    line.extend(name.map(|name| format!(" --name {}", quoted_text(name))));
    line + " --output " + &quoted(&arguments.output)
}

fn answer(arguments: &TrainArguments, trained: &Trained, tested: Option<&SetMetrics>) -> Answer {
    let (report, latent_dim) = (&trained.report, trained.model.latent_dim());
    let output = arguments.output.display().to_string();
    let text = format!(
        "{output}: {latent_dim} latent coordinates from {}\n\n{}\n{}{}",
        counted(arguments.recordings.len(), "recording"),
        model_text(&trained.model),
        metrics_table(report, tested, arguments.verbose),
        seed_table(report)
    );
    let json = json!({
        "model": output,
        "name": trained.model.name(),
        "latent_dim": latent_dim,
        "report": report,
        "test": tested,
    });
    Answer::new(text, json)
}

/// A metric with as many decimals as others of its unit.
fn shown(value: f64, unit: &str) -> Cell {
    match unit {
        "mm" => format!("{value:.2}").into(),
        "" => format!("{value:.3}").into(),
        _ => value.into(),
    }
}

fn metrics_table(report: &TrainReport, tested: Option<&SetMetrics>, is_verbose: bool) -> Table {
    let mut sets = vec![
        ("training", Some(&report.training)),
        ("validation", report.validation.as_ref()),
    ];
    sets.extend(tested.map(|tested| ("test", Some(tested))));
    let sets_of = sets.iter().map(|(name, _)| *name);
    let mut table = Table::new(["metric", "unit"].into_iter().chain(sets_of));
    let row = |name: &str, unit: &str, value: &dyn Fn(&SetMetrics) -> Option<f64>| {
        let cell = |set: &SetMetrics| value(set).map_or("diverged".into(), |of| shown(of, unit));
        // A set that was not given has no cell.
        let cells = (sets.iter()).map(|(_, set)| set.map_or(Cell::default(), cell));
        let cells = [name.into(), unit.into()].into_iter().chain(cells);
        cells.collect::<Vec<Cell>>()
    };
    let of_all = |name: String, value: f64| [name.into(), "".into(), shown(value, "")];
    let (lift, short, whole) = (
        "torque R^2 of the transpose lift",
        "over 0.1 s",
        "over the whole motion",
    );
    let error = |axis: &str, over: &str| format!("error of body {axis} {over}");
    table.row(row("decoder mean square", "scaled", &|m| {
        Some(m.decoder_mse)
    }));
    table.row(row(lift, "", &|m| Some(m.torque_r2)));
    table.row(row(&error("x", short), "mm", &|m| {
        Some(1e3 * m.prediction_x_m)
    }));
    table.row(row(&error("z", short), "mm", &|m| {
        Some(1e3 * m.prediction_z_m)
    }));
    table.row(row(&error("x", whole), "mm", &|m| {
        Some(1e3 * m.rollout_x_m?)
    }));
    table.row(row(&error("z", whole), "mm", &|m| {
        Some(1e3 * m.rollout_z_m?)
    }));
    if let Some(overlap) = report.support_overlap {
        let name = format!("overlap of supports, {} seeds", report.seeds.len());
        table.row(of_all(name, overlap));
    }
    if !is_verbose {
        return table;
    }
    for (phase, terms) in report.active_terms.iter().enumerate() {
        let (name, active) = (&terms.phase, terms.active);
        let name = format!("R^2 of smoothed ddz, {name} ({})", counted(active, "term"));
        table.row(row(&name, "", &|m| m.ddz_r2.get(phase).copied()));
    }
    for score in &report.deviations {
        let name = format!("R^2 of deviations of ddz, {}", score.part);
        table.row(of_all(name, score.ddz_r2));
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
        .column("error of body x over 0.1 s", "m", |seed| {
            seed.judged.prediction_x_m
        })
        .column("error of body z over 0.1 s", "m", |seed| {
            seed.judged.prediction_z_m
        })
        .column("terms", "", |seed| seed.active)
        .column("latents follow", "", |seed| seed.dominant.join(", "))
        .table();
    format!("\n{table}")
}

/// A note if rollouts of whole jumps are further off than a body that stays where each jump starts.
fn whole_jump_note(metrics: &SetMetrics, set: &str, recordings: &[Recording]) -> Option<String> {
    let (mut squares, mut samples) = (0.0, 0);
    for segment in recordings.iter().flat_map(|recording| &recording.segments) {
        for row in [BODY_X, BODY_Z].map(|row| segment.x.row(row)) {
            let off = row.iter().map(|value| (value - row[0]).powi(2));
            squares += off.sum::<f64>();
        }
        samples += segment.len();
    }
    let moved_m = (squares / samples.max(1) as f64).sqrt();
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
#[path = "../../tests/units/cli_train.rs"]
mod tests;
