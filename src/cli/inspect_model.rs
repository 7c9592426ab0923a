//! `romc inspect` of a model: its parts, its phases, the pattern of Xi, what each latent is made of.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::{Value, json};

use super::Answer;
use super::output::{Table, significant};
use super::simplification::{exact_json, exact_words};
use crate::Error;
use crate::artifact;
use crate::equations::Equations;
use crate::model::{FeetRule, Phase, ReducedModel, StateMap};
use crate::robot::{JOINT_NAMES, Robot, WrenchFrame};

/// Library terms that still fit as a pattern in a terminal.
const PATTERN_WIDTH: usize = 120;
/// Coordinates named for each latent.
const DOMINANT: usize = 4;

/// Describes a model.
///
/// # Errors
/// [`Error::Artifact`] if the digest cannot be computed.
pub fn describe(path: &Path, model: &ReducedModel) -> Result<Answer, Error> {
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
    let mut phases = Table::new(["phase", "feet", "active terms", "of"]);
    for phase in model.phases() {
        phases.row([
            phase.name.clone(),
            feet(&phase.feet),
            phase.active_count().to_string(),
            phase.xi.len().to_string(),
        ]);
    }
    let _ = writeln!(text, "\n{phases}");
    text.push_str(&exact_words(&equations));
    for phase in model.phases() {
        text.push_str(&pattern(model, phase));
    }
    if let Some(dominant) = &dominant {
        for (latent, weights) in dominant.iter().enumerate() {
            let parts: Vec<String> = (weights.iter())
                .map(|(name, weight)| format!("{} {name}", significant(*weight)))
                .collect();
            let _ = writeln!(text, "  z{} = {} ...", latent + 1, parts.join(", "));
        }
    } else if let Ok(encoder) = model.encoder_map() {
        let _ = writeln!(text, "  encoder {}", encoder.summary());
        if let Ok(decoder) = model.decoder_map() {
            let _ = writeln!(text, "  decoder {}", decoder.summary());
        }
    } else {
        text.push_str("latent-only: no encoder, so it says nothing about a robot's coordinates\n");
    }
    Ok(Answer {
        text,
        json: json!({
            "kind": "model",
            "file": path.display().to_string(),
            "name": model.name(),
            "description": model.description(),
            "digest": artifact::digest(model).to_string(),
            "latent_dim": model.latent_dim(),
            "library_dim": model.library().len(),
            "library": model.library().terms().iter().map(|term| term.text()).collect::<Vec<_>>(),
            "phases": model.phases().iter().map(phase_json).collect::<Vec<_>>(),
            "exact": equations.steps().iter().map(exact_json).collect::<Vec<_>>(),
            "dominant_coordinates": dominant,
            "encoder": model.encoder_map().ok().map(StateMap::summary),
            "decoder": model.decoder_map().ok().map(StateMap::summary),
            "actuators": model.actuators(),
            "wrench_frame": model.wrench_frame(),
            "provenance": model.provenance(),
        }),
    })
}

/// What the inputs of a model over a robot are made of.
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
    let mut table = Table::new([
        "joint",
        "viscous, N m s/rad",
        "dry, N m",
        "armature, kg m^2",
    ]);
    for (joint, name) in JOINT_NAMES.into_iter().enumerate() {
        let values = actuators
            .named()
            .map(|(_, values)| significant(values[joint]));
        table.row([name.to_owned()].into_iter().chain(values));
    }
    text + &format!("{table}")
}

fn feet(rule: &FeetRule) -> String {
    match rule {
        FeetRule::Any => "any".to_owned(),
        FeetRule::None => "none".to_owned(),
        FeetRule::Patterns(patterns) => {
            let text =
                |pattern: &[bool; 4]| pattern.map(|down| if down { "1" } else { "0" }).concat();
            patterns.iter().map(text).collect::<Vec<_>>().join(" ")
        }
    }
}

/// Rows are outputs, columns library terms; a dot is an inactive one.
fn pattern(model: &ReducedModel, phase: &Phase) -> String {
    if model.library().len() > PATTERN_WIDTH {
        return String::new();
    }
    let mut text = format!(
        "Xi of {} (a column a term, + positive, - negative)\n",
        phase.name
    );
    for output in 0..model.latent_dim() {
        let cells: String = (phase.xi.column(output).iter())
            .map(|value| match value {
                value if *value > 0.0 => '+',
                value if *value < 0.0 => '-',
                _ => '.',
            })
            .collect();
        let _ = writeln!(text, "  ddz{}  {cells}", output + 1);
    }
    text.push('\n');
    text
}

/// For each latent, the coordinates of the largest encoder weights.
fn dominant_coordinates(model: &ReducedModel) -> Option<Vec<Vec<(String, f64)>>> {
    let weights = model.encoder().ok()?.weights();
    let names = match model.state() {
        Some(state) => state.names.clone(),
        None if weights.ncols() == Robot::state_names().len() => Robot::state_names().to_vec(),
        None => (1..=weights.ncols())
            .map(|index| format!("x{index}"))
            .collect(),
    };
    let of_latent = |row: usize| {
        let mut pairs: Vec<(String, f64)> = names
            .iter()
            .cloned()
            .zip(weights.row(row).iter().copied())
            .collect();
        pairs.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        pairs.truncate(DOMINANT);
        pairs
    };
    Some((0..weights.nrows()).map(of_latent).collect())
}

fn phase_json(phase: &Phase) -> Value {
    json!({
        "name": phase.name,
        "feet": feet(&phase.feet),
        "active_terms": phase.active_count(),
        "coefficients": phase.xi.len(),
    })
}
