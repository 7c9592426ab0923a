//! `romc inspect`: contents of a recording or a model, and implausible values in it.

use serde::Serialize;

use super::*;
use crate::recording::check::check;
use crate::recording::mismatch::{Figures, notes as mismatches};

/// Endings of models; for those of other tools the error shows the lines that convert them.
const OF_MODELS: &str = "json safetensors pt pth ckpt keras onnx tflite msgpack";

pub(super) fn run(arguments: &InspectArguments) -> Result<Answer> {
    let robot = robot::chosen(&arguments.robot)?;
    if arguments.guess {
        return guessed(arguments, robot);
    }
    let reader = reader(&arguments.reading, Clocks::Recorded, Some(robot))?;
    let (mut texts, mut files) = (Vec::new(), Vec::new());
    for path in &arguments.files {
        let ending = path.extension().and_then(|ending| ending.to_str());
        let has_ending = ending.is_some_and(|end| OF_MODELS.split(' ').any(|of| of == end));
        let Answer { text, json, .. } = match has_ending || artifact::is_standard_input(path) {
            true => describe_model(path, &arguments.reading.model(path)?),
            false => describe_recording(&reader.read(path)?, robot)?,
        };
        texts.push(text);
        files.push(json);
    }
    Ok(Answer::new(texts.join("\n"), json!({ "files": files })))
}

fn guessed(arguments: &InspectArguments, robot: &Robot) -> Result<Answer> {
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

const DOMINANT: usize = 4;
const KINDS: usize = JOINT_DIM / 4; // joints of a leg
const LATENT_ONLY: &str =
    "no encoder: the latent coordinates have no relation to a robot's coordinates\n";

fn describe_model(path: &Path, model: &ReducedModel) -> Answer {
    let (equations, file) = (Equations::of(model), path.display().to_string());
    let mut text = format!(
        "{file}: model `{}`, {} latent coordinates, {} candidate terms\n",
        model.name(),
        model.latent_dim(),
        model.library().terms().len()
    );
    let description = Some(model.description()).filter(|text| !text.is_empty());
    text += &lines("  ", description);
    text += &format!("\n{}\n", model_text(model));
    let coefficients = equations.terms.len() * equations.latent_dim();
    let phases = equations.phases.iter().map(|phase| {
        let (feet, active) = (phase.feet.to_string(), phase.active_count());
        json!({"name": phase.name, "feet": feet, "active_terms": active, "coefficients": coefficients})
    });
    let phases: Vec<Value> = phases.collect();
    let invariance = Invariance::of(model).unwrap_or_else(|error| {
        note(&format!("{file}: known physics cannot be checked: {error}"));
        None
    });
    if let Some(table) = (invariance.as_ref()).map(|of| invariance_table(model, of)) {
        let _ = writeln!(text, "{table}");
    }
    let table = phase_table(&equations, coefficients);
    text += &format!("{table}\n{}", exact_words(&equations));
    let words: Vec<String> = (model.latent_words().iter())
        .map(ToString::to_string)
        .collect();
    let dominant = dominant_coordinates(model);
    // As the equations above, which are in scaled units where the model has no others.
    let (shown, units) = match equations.in_physical_units() {
        Ok(physical) => (
            dominant_coordinates(&physical.model),
            "in the units of the equations",
        ),
        Err(_) => (dominant_coordinates(model), "in scaled units"),
    };
    let [encoder, decoder] =
        [model.encoder_map(), model.decoder_map()].map(|map| map.ok().map(StateMap::summary));
    text += &match (&shown, &encoder) {
        (Some(shown), _) => composition(shown, units),
        (None, Some(_)) => lines("  encoder ", &encoder) + &lines("  decoder ", &decoder),
        (None, None) => LATENT_ONLY.to_owned(),
    };
    text += &input_rule(model);
    let json = json!({
        "kind": "model",
        "file": file,
        "name": model.name(),
        "description": model.description(),
        "digest": artifact::digest(model).to_string(),
        "latent_dim": model.latent_dim(),
        "library_dim": model.library().terms().len(),
        "library": model.library().terms().iter().map(|term| term.text.as_str()).collect::<Vec<_>>(),
        "phases": phases,
        "exact": equations.steps,
        "dominant_coordinates": dominant,
        "latent_coordinates": (!words.is_empty()).then_some(words),
        "encoder": encoder,
        "decoder": decoder,
        "actuators": model.actuators(),
        "wrench_frame": model.wrench_frame(),
        "invariance": invariance,
        "provenance": model.provenance(),
    });
    Answer::new(text, json)
}

fn phase_table(equations: &Equations<'_>, coefficients: usize) -> Table {
    Table::of(&equations.phases)
        .column("phase", "", |phase| &phase.name)
        .column("feet", "", |phase| phase.feet.to_string())
        .column("active terms", "", |phase| phase.active_count())
        .column("of", "", |_| coefficients)
        .table()
}

type Dominant = Vec<Vec<(String, f64)>>;

fn composition(dominant: &Dominant, units: &str) -> String {
    let line = |(latent, weights): (usize, &Vec<(String, f64)>)| {
        let part = |(name, weight): &(String, f64)| format!("{} {name}", significant(*weight));
        let parts: Vec<String> = weights.iter().map(part).collect();
        fitted(&format!("  z{}: {} ...", latent + 1, parts.join(", ")))
    };
    let largest: String = dominant.iter().enumerate().map(line).collect();
    format!("largest weights of the encoder, {units}\n{largest}\n")
}

fn input_rule(model: &ReducedModel) -> String {
    let Ok(robot) = model.robot() else {
        return String::new();
    };
    let axes = match model.wrench_frame() {
        WrenchFrame::Body => "the body's axes, as published",
        WrenchFrame::World => "the world's axes, moments of roll, pitch and yaw",
        WrenchFrame::Ground => {
            "the world's axes, moments of roll, pitch and yaw, of feet that push"
        }
    };
    let rule = format!("inputs of robot {}: forces in {axes};", robot.name);
    let Some(actuators) = model.actuators() else {
        return fitted(&(rule + " motor torques"));
    };
    let is_alike = |of: &[f64; JOINT_DIM]| (0..JOINT_DIM).all(|i| of[i] == of[i % KINDS]);
    let all = [&actuators.viscous, &actuators.dry, &actuators.armature];
    let (count, first) = match all.iter().all(|of| is_alike(of)) {
        true => (KINDS, "*"),
        false => (JOINT_DIM, ""),
    };
    let names = JOINT_NAMES[..count].iter();
    let names = names.map(|name| first.to_owned() + &name[2 * first.len()..]);
    let mut table = Table::default();
    table
        .column("joint", "", names)
        .column("viscous", "N m s/rad", actuators.viscous[..count].to_vec())
        .column("dry", "N m", actuators.dry[..count].to_vec())
        .column(
            "rotor inertia",
            "kg m^2",
            actuators.armature[..count].to_vec(),
        );
    let rule = fitted(&(rule + " motor torques minus joint friction and rotor inertia"));
    let legs = actuators.legs.as_ref().map_or(String::new(), leg_table);
    format!("{rule}\n{table}{legs}")
}

/// The moments by which the weight and the inertia of a leg on the ground are subtracted from its torques.
fn leg_table(legs: &LegMoments) -> String {
    let rows = [
        ("first, sideways from the hip", "kg m", legs.side_kg_m),
        ("first, thigh", "kg m", legs.thigh_kg_m),
        ("first, calf", "kg m", legs.calf_kg_m),
        ("second, thigh", "kg m^2", legs.thigh_kg_m2),
        ("second, calf", "kg m^2", legs.calf_kg_m2),
    ];
    let table = Table::of(rows)
        .column("moment of a leg's links", "", |row| {
            format!("{}, {}", row.0, row.1)
        })
        .column("value", "", |row| row.2)
        .table();
    format!("\nweight and inertia of legs on the ground are subtracted\n\n{table}")
}

fn dominant_coordinates(model: &ReducedModel) -> Option<Dominant> {
    let weights = model.encoder().ok()?.weights();
    let names = match model.state() {
        Some(state) => state.names.clone(),
        None if weights.ncols() == Robot::state_names().len() => Robot::state_names().to_vec(),
        None => (1..=weights.ncols()).map(|i| format!("x{i}")).collect(),
    };
    let of_latent = |row: usize| {
        let weights = weights.row(row).into_iter().copied();
        let mut pairs: Vec<(String, f64)> = names.iter().cloned().zip(weights).collect();
        pairs.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        pairs.truncate(DOMINANT);
        pairs
    };
    Some((0..weights.nrows()).map(of_latent).collect())
}

const BAR_WIDTH: usize = 60;
const STRIDES_SHOWN: f64 = 3.0;
/// Shorter spans count as part of the previous span: feet leave or land one after the other.
const CHATTER: usize = 10;
const FINDINGS_SHOWN: usize = 12;

fn describe_recording(reading: &Reading, robot: &Robot) -> Result<Answer> {
    let recording = &reading.recording;
    let file = recording.path.display().to_string();
    let samples = recording.sample_count();
    let mut notes = ReadingNotes::default();
    notes.add(reading);
    let notes = notes.lines();
    let count = counted(recording.segments.len(), "segment");
    let mut text = format!("{file}: {samples} samples in {count}\n");
    let mut segments = Vec::new();
    for (index, segment) in recording.segments.iter().enumerate() {
        text += &format!(
            "  segment {index}: {:.3} s, {} samples every {:.3} ms\n  |{}|\n",
            segment.duration_s(),
            segment.len(),
            1e3 * segment.mean_step_s(),
            time_bar(segment)
        );
        segments.push(segment_json(segment)?);
    }
    if !recording.ignored_columns.is_empty() {
        let names = recording.ignored_columns.join("`, `");
        let _ = writeln!(text, "  columns not read: `{names}`");
    }
    let ranges = ranges(recording);
    let (findings, mismatches) = (check(recording, robot), mismatches(recording, robot));
    text += &lines("  ", &notes);
    text += "  # a front foot is down, = only rear feet are, blank: flight\n";
    let stride_s = stride_s(recording.segments.iter());
    if let Some(stride_s) = stride_s {
        text += &feet_strips(&recording.segments[0], stride_s);
    }
    text += "\n";
    text += &format!("{}\n", range_table(&ranges));
    if !findings.is_empty() {
        let _ = writeln!(text, "{} implausible runs of samples", findings.len());
        text += &lines("  ", findings.iter().take(FINDINGS_SHOWN));
    } else if mismatches.is_empty() {
        text += "nothing implausible\n";
    }
    if let more @ 1.. = findings.len().saturating_sub(FINDINGS_SHOWN) {
        let _ = writeln!(text, "  and {more} more, all of them with --json");
    }
    text += &lines("note: ", &mismatches);
    let findings = findings.iter().map(|finding| {
        let mut value = finding_json(finding);
        value["segment"] = json!(finding.segment);
        value
    });
    let mut json = json!({
        "kind": "recording",
        "file": file,
        "samples": samples,
        "segments": segments,
        "notes": notes,
        "ranges": ranges,
        "ignored_columns": recording.ignored_columns,
        "figures": Figures::of(recording, robot),
        "mismatches": mismatches,
        "implausible": findings.collect::<Vec<_>>(),
    });
    if let Some(stride_s) = stride_s {
        json["stride_s"] = stride_s.into();
    }
    Ok(Answer::new(text, json))
}

fn time_bar(segment: &Segment) -> String {
    let feet = (0..BAR_WIDTH).map(|slot| segment.feet[slot * segment.len() / BAR_WIDTH]);
    let character = |feet: [bool; 4]| match feet {
        [false, false, false, false] => ' ',
        [false, false, _, _] => '=',
        [_, _, _, _] => '#',
    };
    feet.map(character).collect()
}

/// The feet on the ground over a few strides in the middle of a motion.
fn feet_strips(segment: &Segment, stride_s: f64) -> String {
    let (first, last) = (segment.time_s[0], segment.time_s[segment.len() - 1]);
    let lasts_s = (STRIDES_SHOWN * stride_s).min(last - first);
    let start_s = first + 0.5 * (last - first - lasts_s);
    let mut text = format!(
        "  a stride lasts {stride_s:.3} s; segment 0 from {start_s:.2} s to {:.2} s, # a foot is down\n",
        start_s + lasts_s
    );
    for leg in Leg::ALL {
        let slots = (0..BAR_WIDTH).map(|slot| {
            let time_s = start_s + lasts_s * (slot as f64 + 0.5) / BAR_WIDTH as f64;
            let sample = between(&segment.time_s, time_s).0;
            if segment.feet[sample][leg.index()] {
                '#'
            } else {
                ' '
            }
        });
        let _ = writeln!(text, "  {leg} |{}|", slots.collect::<String>());
    }
    text
}

fn segment_json(segment: &Segment) -> Result<Value> {
    let rule = PhaseRule::three_phase().with_min_samples(CHATTER);
    let (names, spans) = (rule.names(), rule.spans(segment)?);
    let phases = spans.iter().map(|span| {
        json!({
            "phase": names[span.phase],
            "stance": span.kind,
            "samples": span.range.len(),
            "start_s": segment.time_s[span.range.start],
        })
    });
    Ok(json!({
        "samples": segment.len(),
        "duration_s": segment.duration_s(),
        "mean_step_s": segment.mean_step_s(),
        "first_row": segment.first_row,
        "phases": phases.collect::<Vec<_>>(),
    }))
}

type Extremes = (f64, f64);

#[derive(Serialize)]
struct Ranges {
    coordinate: String,
    unit: String,
    position: Extremes,
    velocity: Extremes,
    torque_nm: Option<Extremes>,
}

fn ranges(recording: &Recording) -> Vec<Ranges> {
    let extremes = |row: usize, matrix: fn(&Segment) -> &DMatrix<f64>| {
        let segments = recording.segments.iter();
        range(segments.flat_map(|s| matrix(s).row(row).iter().copied().collect::<Vec<_>>()))
    };
    let names = Robot::state_names().into_iter().zip(Robot::state_units());
    let ranges = names.enumerate().map(|(row, (coordinate, unit))| Ranges {
        coordinate,
        unit,
        position: extremes(row, |segment| &segment.x),
        velocity: extremes(row, |segment| &segment.dx),
        torque_nm: (row < JOINT_DIM).then(|| extremes(row, |segment| &segment.torque_nm)),
    });
    ranges.collect()
}

fn range_table(ranges: &[Ranges]) -> Table {
    let pair = |(low, high)| format!("{} .. {}", significant(low), significant(high));
    let torque = |range: &Ranges| range.torque_nm.map_or_else(String::new, pair);
    Table::of(ranges)
        .column("coordinate", "", |range| &range.coordinate)
        .column("unit", "", |range| &range.unit)
        .column("position", "", |range| pair(range.position))
        .column("velocity", "per s", |range| pair(range.velocity))
        .column("torque", "N m", |range| torque(range))
        .table()
}

pub(super) fn finding_json(finding: &Finding) -> Value {
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
