//! `romc inspect` of a model: its parts, its phases, the pattern of Xi, the composition of each latent.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::json;

use super::Answer;
use super::output::note;
use super::simplification::exact_words;
use crate::Error;
use crate::artifact;
use crate::equations::Equations;
use crate::evaluate::Invariance;
use crate::model::{ReducedModel, StateMap};
use crate::report::invariance_table;
use crate::robot::{JOINT_NAMES, Robot, WrenchFrame};
use crate::typeset::{Table, significant};

/// Library terms that still fit as a pattern in a terminal.
const PATTERN_WIDTH: usize = 120;
const DOMINANT: usize = 4;

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
        "encoder": model.encoder_map().ok().map(StateMap::summary),
        "decoder": model.decoder_map().ok().map(StateMap::summary),
        "actuators": model.actuators(),
        "wrench_frame": model.wrench_frame(),
        "invariance": invariance,
        "provenance": model.provenance(),
    });
    Ok(Answer::new(text, json))
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
