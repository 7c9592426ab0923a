//! From a model to the file's grammar.

use super::jump_prior::entries_of;
use super::manifest::{
    GivenStateEntry, LayerEntry, Manifest, MapEntry, PhaseEntry, RobotValue, SCHEMA, SCHEMA_2,
    Statistics, StatisticsEntry, to_rows,
};
use crate::model::{InputStatistics, ReducedModel, StateMap};
use crate::robot::{Robot, WrenchFrame};
use crate::robot_file::RobotEntry;

pub(super) fn manifest_of(model: &ReducedModel) -> Manifest {
    let phases = model.phases().iter().enumerate();
    let statistics = phases.filter_map(|(index, phase)| {
        let statistics = model.input_statistics(index).ok()?;
        Some((phase.name.clone(), statistics_entry(statistics)))
    });
    let frame = model.wrench_frame();
    let (landmarks, prior) = entries_of(model);
    let mut manifest = Manifest {
        schema: SCHEMA.to_owned(),
        name: model.name().to_owned(),
        description: model.description().to_owned(),
        state: model.state().cloned(),
        input: model.input().cloned(),
        scaling: model.scaling().ok().cloned(),
        encoder: model.encoder_map().ok().map(map_entry),
        decoder: model.decoder_map().ok().map(map_entry),
        latent_dim: model.latent_dim(),
        library: model.library().choice(),
        phases: (model.phases().iter())
            .map(|phase| PhaseEntry {
                name: phase.name.clone(),
                feet: phase.feet.clone(),
                xi: to_rows(&phase.xi),
            })
            .collect(),
        input_statistics: Statistics(statistics.collect()),
        robot: model.robot().ok().map(robot_value),
        actuators: model.actuators().cloned(),
        wrench_frame: (frame != WrenchFrame::Body).then_some(frame),
        sample_time_s: model.sample_time_s().ok(),
        landmarks,
        prior,
        provenance: model.provenance().clone(),
    };
    if manifest.later_key().is_some() {
        manifest.schema = SCHEMA_2.to_owned();
    }
    manifest
}

fn robot_value(robot: &Robot) -> RobotValue {
    match crate::robot_file::by_name(robot.name()) {
        Ok(_) => RobotValue::Name(robot.name().to_owned()),
        Err(_) => RobotValue::Entry(RobotEntry::of(robot)),
    }
}

fn map_entry(map: &StateMap) -> MapEntry {
    if let Some(affine) = map.as_affine() {
        return MapEntry::Affine {
            weights: to_rows(affine.weights()),
            bias: affine.bias().as_slice().to_vec(),
        };
    }
    let layers = map.layers().iter().map(|layer| LayerEntry {
        weights: to_rows(layer.map.weights()),
        bias: layer.map.bias().as_slice().to_vec(),
        activation: layer.activation.name().to_owned(),
    });
    MapEntry::Layers {
        layers: layers.collect(),
    }
}

fn statistics_entry(statistics: &InputStatistics) -> StatisticsEntry {
    StatisticsEntry {
        mean: statistics.mean.as_slice().to_vec(),
        covariance: to_rows(&statistics.covariance),
        given_state: (statistics.given_state.as_ref()).map(|given| GivenStateEntry {
            mean: to_rows(&given.mean),
            covariance: to_rows(&given.covariance),
            acceleration_error: to_rows(&given.acceleration_error),
        }),
    }
}
