//! From a model to the file's grammar.

use super::manifest::{
    FactorsEntry, FeetEntry, LayerEntry, LibraryEntry, Manifest, MapEntry, Pairs, PhaseEntry,
    SCHEMA, ScalingEntry, SignalsEntry, StandardEntry, StatisticsEntry,
};
use super::matrices::to_rows;
use crate::model::{
    CoordinateNames, FeetRule, InputStatistics, Library, LibrarySource, Phase, ReducedModel,
    ScaleFactors, Scaling, StateMap,
};

/// All that a model file says about the model.
pub(super) fn manifest_of(model: &ReducedModel) -> Manifest {
    let statistics = model
        .phases()
        .iter()
        .enumerate()
        .filter_map(|(index, phase)| {
            let statistics = model.input_statistics(index).ok()?;
            Some((phase.name.clone(), statistics_entry(statistics)))
        });
    Manifest {
        schema: SCHEMA.to_owned(),
        name: model.name().to_owned(),
        description: model.description().to_owned(),
        state: model.state().map(signals_entry),
        input: model.input().map(signals_entry),
        scaling: model.scaling().ok().map(scaling_entry),
        encoder: model.encoder_map().ok().map(map_entry),
        decoder: model.decoder_map().ok().map(map_entry),
        latent_dim: model.latent_dim(),
        library: library_entry(model.library()),
        phases: model.phases().iter().map(phase_entry).collect(),
        input_statistics: Pairs(statistics.collect()),
        robot: model.robot().ok().map(|robot| robot.name().to_owned()),
        sample_time_s: model.sample_time_s().ok(),
        provenance: model.provenance().clone(),
    }
}

fn signals_entry(signals: &CoordinateNames) -> SignalsEntry {
    SignalsEntry {
        names: signals.names.clone(),
        units: signals.units.clone(),
    }
}

fn scaling_entry(scaling: &Scaling) -> ScalingEntry {
    ScalingEntry {
        state: factors_entry(&scaling.state),
        input: factors_entry(&scaling.input),
    }
}

fn factors_entry(factors: &ScaleFactors) -> FactorsEntry {
    match factors {
        ScaleFactors::Uniform(factor) => FactorsEntry::Uniform(*factor),
        ScaleFactors::PerCoordinate(factors) => {
            FactorsEntry::PerCoordinate(factors.as_slice().to_vec())
        }
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

fn library_entry(library: &Library) -> LibraryEntry {
    match library.source() {
        LibrarySource::Terms => {
            let texts = library.terms().iter().map(|term| term.text().to_owned());
            LibraryEntry::Terms(texts.collect())
        }
        LibrarySource::Standard(standard) => LibraryEntry::Standard(StandardEntry {
            degree: standard.degree,
            trigonometric: standard.trigonometric,
            inputs: standard.inputs,
        }),
    }
}

fn phase_entry(phase: &Phase) -> PhaseEntry {
    PhaseEntry {
        name: phase.name.clone(),
        feet: match &phase.feet {
            FeetRule::Any => FeetEntry::Any,
            FeetRule::None => FeetEntry::None,
            FeetRule::Patterns(patterns) => FeetEntry::Patterns(patterns.clone()),
        },
        xi: to_rows(&phase.xi),
    }
}

fn statistics_entry(statistics: &InputStatistics) -> StatisticsEntry {
    StatisticsEntry {
        mean: statistics.mean.as_slice().to_vec(),
        covariance: to_rows(&statistics.covariance),
    }
}
