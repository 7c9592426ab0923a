//! `romc inspect` of a recording: ranges, phases on a time bar, implausible samples.

use std::fmt::Write as _;

use nalgebra::DMatrix;
use serde::Serialize;
use serde_json::{Value, json};

use super::Answer;
use super::output::lines;
use crate::Error;
use crate::recording::check::{Finding, check};
use crate::recording::mismatch::{Figures, mismatches};
use crate::recording::{PhaseRule, PhaseSpan, Reading, ReadingNotes, Recording, Segment};
use crate::robot::{JOINT_DIM, Robot};
use crate::typeset::words::counted;
use crate::typeset::{Cell, Table, significant};

const BAR_WIDTH: usize = 60;
/// Shorter spans are feet that leave or land one after the other, part of the span before them.
const CHATTER: usize = 10;
/// Findings shown to people; JSON holds them all.
const FINDINGS_SHOWN: usize = 12;

pub fn describe(reading: &Reading, robot: &Robot) -> Result<Answer, Error> {
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
struct Range {
    coordinate: String,
    unit: String,
    position: (f64, f64),
    velocity: (f64, f64),
    torque_nm: Option<(f64, f64)>,
}

fn ranges(recording: &Recording) -> Vec<Range> {
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
        .map(|(row, (name, unit))| Range {
            coordinate: name,
            unit,
            position: extremes(row, &|segment| &segment.x),
            velocity: extremes(row, &|segment| &segment.dx),
            torque_nm: (row < JOINT_DIM).then(|| extremes(row, &|segment| &segment.torque_nm)),
        })
        .collect()
}

fn range_table(ranges: &[Range]) -> Table {
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
