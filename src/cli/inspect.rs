//! `romc inspect`: what a recording or a model holds, and what is implausible in it.
//!
//! Of a model its parts, its phases, the pattern of Xi and the composition of each latent coordinate; of a recording
//! ranges, phases on a time bar, implausible samples.

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::DMatrix;
use serde::Serialize;
use serde_json::{Value, json};

use super::args::InspectArguments;
use super::destination::{Format, Inputs};
use super::output::{lines, note, reader, shown, write_file};
use super::simplification::exact_words;
use super::{Answer, robot};
use crate::equations::Equations;
use crate::evaluate::Invariance;
use crate::model::{ReducedModel, StateMap};
use crate::recording::check::{Finding, check};
use crate::recording::foreign::guess::guess;
use crate::recording::mismatch::{Figures, mismatches};
use crate::recording::{Clocks, PhaseRule, PhaseSpan, Reading, ReadingNotes, Recording, Segment};
use crate::report::invariance_table;
use crate::robot::{JOINT_DIM, JOINT_NAMES, Robot, WrenchFrame};
use crate::typeset::words::counted;
use crate::typeset::{Cell, Table, significant};
use crate::{Error, artifact};

/// Endings of models; those of other tools are refused with the lines that convert them.
const OF_MODELS: [&str; 9] = [
    "json",
    "safetensors",
    "pt",
    "pth",
    "ckpt",
    "keras",
    "onnx",
    "tflite",
    "msgpack",
];

/// Inspects each file: those with an ending of models as such, all others as recordings.
pub(crate) fn run(arguments: &InspectArguments) -> Result<Answer, Error> {
    let robot = robot::chosen(&arguments.robot)?;
    if arguments.guess {
        return guessed(arguments, robot);
    }
    let reader = reader(&arguments.reading, Clocks::Recorded)?.for_robot(robot);
    let (mut texts, mut files) = (Vec::new(), Vec::new());
    for path in &arguments.files {
        let is_model = artifact::is_standard_input(path)
            || OF_MODELS
                .iter()
                .any(|of| path.extension().is_some_and(|e| e == *of));
        let Answer { text, json, .. } = match is_model {
            true => describe_model(path, &artifact::read(path)?)?,
            false => describe_recording(&reader.read(path)?, robot)?,
        };
        texts.push(text);
        files.push(json);
    }
    Ok(Answer::new(texts.join("\n"), json!({ "files": files })))
}

fn guessed(arguments: &InspectArguments, robot: &Robot) -> Result<Answer, Error> {
    let [log] = &arguments.files[..] else {
        return Err(Error::NotOne {
            found: format!("{} files", arguments.files.len()),
            expected: "log to guess a map of",
        });
    };
    Inputs::default()
        .and([log])
        .and_robot(Some(&arguments.robot))
        .check_output(arguments.output.as_deref(), Format::TOML, arguments.force)?;
    let guess = guess(log, robot)?;
    let outcome = match &guess.outcome {
        Ok(samples) => format!("read by this map, the log has {samples} samples"),
        Err(reason) => format!("read by this map: {reason}"),
    };
    let mut text = guess.text.clone();
    match &arguments.output {
        Some(path) => {
            write_file(path, guess.text.as_bytes(), arguments.force)?;
            text = format!("{}: a first map; {outcome}\n", path.display());
        }
        None => note(&outcome),
    }
    guess.notes.iter().for_each(|text| note(text));
    let json = json!({
        "file": log.display().to_string(),
        "map": guess.text,
        "missing": guess.missing,
        "notes": guess.notes,
        "samples": guess.outcome.as_ref().ok(),
        "refused": guess.outcome.as_ref().err(),
        "output": shown(&arguments.output),
    });
    Ok(Answer::new(text, json))
}

/// Library terms that still fit as a pattern in a terminal.
const PATTERN_WIDTH: usize = 120;
const DOMINANT: usize = 4;

fn describe_model(path: &Path, model: &ReducedModel) -> Result<Answer, Error> {
    let dominant = dominant_coordinates(model);
    let equations = Equations::of(model);
    let mut text = format!(
        "{}: model `{}`, {} latent coordinates, {} candidate terms\n",
        path.display(),
        model.name(),
        model.latent_dim(),
        model.library().len()
    );
    if !model.description().is_empty() {
        let _ = writeln!(text, "  {}", model.description());
    }
    text.push_str(&input_rule(model));
    let coefficients = equations.terms().len() * equations.latent_dim();
    let table = Table::of(equations.phases())
        .column("phase", "", |phase| &phase.name)
        .column("feet", "", |phase| phase.feet.to_string())
        .column("active terms", "", |phase| phase.active_count())
        .column("of", "", |_| coefficients)
        .table();
    let phases = equations.phases().iter().map(|phase| {
        json!({
            "name": phase.name,
            "feet": phase.feet.to_string(),
            "active_terms": phase.active_count(),
            "coefficients": coefficients,
        })
    });
    let _ = writeln!(text, "\n{table}");
    text.push_str(&exact_words(&equations));
    for phase in 0..equations.phases().len() {
        text.push_str(&pattern(&equations, phase));
    }
    let [encoder, decoder] =
        [model.encoder_map(), model.decoder_map()].map(|map| map.ok().map(StateMap::summary));
    text += &composition(
        dominant.as_deref(),
        [encoder.as_deref(), decoder.as_deref()],
    );
    let file = path.display().to_string();
    let invariance = Invariance::of(model).unwrap_or_else(|error| {
        note(&format!("{file}: invariance is not told: {error}"));
        None
    });
    if let Some(invariance) = &invariance {
        let table = invariance_table(invariance);
        let _ = write!(text, "\n{}\n\n{table}", table.caption());
    }
    let json = json!({
        "kind": "model",
        "file": file,
        "name": model.name(),
        "description": model.description(),
        "digest": artifact::digest(model).to_string(),
        "latent_dim": model.latent_dim(),
        "library_dim": model.library().len(),
        "library": model.library().terms().iter().map(|term| term.text()).collect::<Vec<_>>(),
        "phases": phases.collect::<Vec<_>>(),
        "exact": equations.steps(),
        "dominant_coordinates": dominant,
        "encoder": encoder,
        "decoder": decoder,
        "actuators": model.actuators(),
        "wrench_frame": model.wrench_frame(),
        "invariance": invariance,
        "provenance": model.provenance(),
    });
    Ok(Answer::new(text, json))
}

/// The largest weights of a linear encoder, or the layers of the maps.
fn composition(
    dominant: Option<&[Vec<(String, f64)>]>,
    [encoder, decoder]: [Option<&str>; 2],
) -> String {
    let Some(latents) = dominant else {
        return match encoder {
            Some(_) => lines("  encoder ", encoder) + &lines("  decoder ", decoder),
            None => {
                "latent-only: no encoder, so it says nothing about a robot's coordinates\n".into()
            }
        };
    };
    let weight = |(name, weight): &(String, f64)| format!("{} {name}", significant(*weight));
    let line = |(latent, weights): (usize, &Vec<(String, f64)>)| {
        let parts: Vec<String> = weights.iter().map(weight).collect();
        format!("  z{} = {} ...\n", latent + 1, parts.join(", "))
    };
    latents.iter().enumerate().map(line).collect()
}

fn input_rule(model: &ReducedModel) -> String {
    let Ok(robot) = model.robot() else {
        return String::new();
    };
    let axes = match model.wrench_frame() {
        WrenchFrame::Body => "the body's axes, as published",
        WrenchFrame::World => "the world's axes, moments of roll, pitch and yaw",
    };
    let mut text = format!("  inputs of robot {}: forces in {axes};", robot.name());
    let Some(actuators) = model.actuators() else {
        return text + " torques of the motors\n";
    };
    text.push_str(" torques of the motors less what the joints take\n\n");
    let mut table = Table::default();
    table
        .column("joint", "", JOINT_NAMES)
        .column("viscous", "N m s/rad", actuators.viscous)
        .column("dry", "N m", actuators.dry)
        .column("armature", "kg m^2", actuators.armature);
    text + &table.to_string()
}

/// Rows are outputs, columns terms; a dot is an inactive one.
fn pattern(equations: &Equations<'_>, phase: usize) -> String {
    if equations.terms().len() > PATTERN_WIDTH {
        return String::new();
    }
    let mut text = format!(
        "Xi of {} (one column per term, + positive, - negative)\n",
        equations.phases()[phase].name
    );
    for (output, row) in equations.coefficients(phase).column_iter().enumerate() {
        let cells = row.iter().map(|value| match value {
            value if *value > 0.0 => '+',
            value if *value < 0.0 => '-',
            _ => '.',
        });
        let _ = writeln!(text, "  ddz{}  {}", output + 1, cells.collect::<String>());
    }
    text.push('\n');
    text
}

fn dominant_coordinates(model: &ReducedModel) -> Option<Vec<Vec<(String, f64)>>> {
    let weights = model.encoder().ok()?.weights();
    let names = match model.state() {
        Some(state) => state.names.clone(),
        None if weights.ncols() == Robot::state_names().len() => Robot::state_names().to_vec(),
        None => (1..=weights.ncols()).map(|i| format!("x{i}")).collect(),
    };
    let of_latent = |row: usize| {
        let pairs = names
            .iter()
            .cloned()
            .zip(weights.row(row).into_iter().copied());
        let mut pairs: Vec<(String, f64)> = pairs.collect();
        pairs.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        pairs.truncate(DOMINANT);
        pairs
    };
    Some((0..weights.nrows()).map(of_latent).collect())
}

const BAR_WIDTH: usize = 60;
/// Shorter spans are feet that leave or land one after the other, part of the span before them.
const CHATTER: usize = 10;
/// Findings shown to people; JSON holds them all.
const FINDINGS_SHOWN: usize = 12;

fn describe_recording(reading: &Reading, robot: &Robot) -> Result<Answer, Error> {
    let recording = &reading.recording;
    let mut notes = ReadingNotes::default();
    notes.add(reading);
    let notes = notes.lines();
    let findings = check(recording, robot);
    let rule = PhaseRule::three_phase().with_min_samples(CHATTER);
    let mut text = format!(
        "{}: {} samples in {}\n",
        recording.path.display(),
        recording.sample_count(),
        counted(recording.segments.len(), "segment")
    );
    let mut segments = Vec::new();
    for (index, segment) in recording.segments.iter().enumerate() {
        let spans = rule.spans(segment)?;
        let _ = writeln!(
            text,
            "  segment {index}: {:.3} s, {} samples every {:.3} ms",
            segment.duration_s(),
            segment.len(),
            1e3 * segment.mean_step_s()
        );
        let _ = writeln!(text, "  |{}|", time_bar(segment));
        segments.push(segment_json(segment, &spans, &rule));
    }
    if !recording.ignored_columns.is_empty() {
        let names = recording.ignored_columns.join("`, `");
        let _ = writeln!(text, "  columns not read: `{names}`");
    }
    text += &lines("  ", &notes);
    text.push_str("  # a front foot is down, = only rear feet are, blank: flight\n\n");
    let ranges = ranges(recording);
    let _ = writeln!(text, "{}", range_table(&ranges));
    let mismatches = mismatches(recording, robot);
    if findings.is_empty() && mismatches.is_empty() {
        text.push_str("nothing implausible\n");
    } else if !findings.is_empty() {
        text.push_str(&findings_text(&findings));
    }
    text += &lines("note: ", &mismatches);
    let json = json!({
        "kind": "recording",
        "file": recording.path.display().to_string(),
        "samples": recording.sample_count(),
        "segments": segments,
        "notes": notes,
        "ranges": ranges,
        "ignored_columns": recording.ignored_columns,
        "figures": Figures::of(recording, robot),
        "mismatches": mismatches,
        "implausible": findings.iter().map(|finding| {
            let mut value = finding_json(finding);
            value["segment"] = json!(finding.segment);
            value
        }).collect::<Vec<_>>(),
    });
    Ok(Answer::new(text, json))
}

/// Feet on the ground over time, one character per slice of equal duration.
fn time_bar(segment: &Segment) -> String {
    let feet = (0..BAR_WIDTH).map(|slot| segment.feet[slot * segment.len() / BAR_WIDTH]);
    let character = |feet: [bool; 4]| match feet {
        [false, false, false, false] => ' ',
        [false, false, _, _] => '=',
        [_, _, _, _] => '#',
    };
    feet.map(character).collect()
}

fn segment_json(segment: &Segment, spans: &[PhaseSpan], rule: &PhaseRule) -> Value {
    let names = rule.names();
    let phases: Vec<Value> = (spans.iter())
        .map(|span| {
            json!({
                "phase": names[span.phase],
                "stance": span.kind,
                "samples": span.range.len(),
                "start_s": segment.time_s[span.range.start],
            })
        })
        .collect();
    json!({
        "samples": segment.len(),
        "duration_s": segment.duration_s(),
        "mean_step_s": segment.mean_step_s(),
        "first_row": segment.first_row,
        "phases": phases,
    })
}

#[derive(Serialize)]
struct Extremes {
    coordinate: String,
    unit: String,
    position: (f64, f64),
    velocity: (f64, f64),
    torque_nm: Option<(f64, f64)>,
}

fn ranges(recording: &Recording) -> Vec<Extremes> {
    let extremes = |row: usize, matrix: &dyn Fn(&Segment) -> &DMatrix<f64>| {
        let segments = recording.segments.iter();
        let values = segments
            .flat_map(|segment| matrix(segment).row(row).iter().copied().collect::<Vec<_>>());
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        })
    };
    let names = Robot::state_names().into_iter().zip(Robot::state_units());
    names
        .enumerate()
        .map(|(row, (name, unit))| Extremes {
            coordinate: name,
            unit,
            position: extremes(row, &|segment| &segment.x),
            velocity: extremes(row, &|segment| &segment.dx),
            torque_nm: (row < JOINT_DIM).then(|| extremes(row, &|segment| &segment.torque_nm)),
        })
        .collect()
}

fn range_table(ranges: &[Extremes]) -> Table {
    let pair = |(low, high): (f64, f64)| -> Cell {
        format!("{} .. {}", significant(low), significant(high)).into()
    };
    Table::of(ranges)
        .column("coordinate", "", |range| &range.coordinate)
        .column("unit", "", |range| &range.unit)
        .column("position", "", |range| pair(range.position))
        .column("velocity", "per s", |range| pair(range.velocity))
        .column("torque", "N m", |range| {
            range.torque_nm.map_or("".into(), pair)
        })
        .table()
}

fn findings_text(findings: &[Finding]) -> String {
    let mut text = format!("{} implausible runs of samples\n", findings.len());
    text += &lines("  ", findings.iter().take(FINDINGS_SHOWN));
    if findings.len() > FINDINGS_SHOWN {
        let more = findings.len() - FINDINGS_SHOWN;
        let _ = writeln!(text, "  and {more} more, all of them with --json");
    }
    text
}

/// A finding without the place of its recording.
pub(crate) fn finding_json(finding: &Finding) -> Value {
    json!({
        "what": finding.kind.description(),
        "samples": finding.samples.len(),
        "first_row": finding.first_row,
        "worst_row": finding.worst_row,
        "column": finding.column,
        "value": finding.value,
        "bound": finding.bound,
    })
}
