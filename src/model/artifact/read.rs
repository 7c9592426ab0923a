//! From bytes to a checked model.

use std::error::Error;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use nalgebra::DVector;
use serde_json::Value;

use super::jump_prior::prior_of;
use super::manifest::{
    GivenStateEntry, Manifest, MapEntry, PhaseEntry, RobotValue, Rows, SCHEMA, SCHEMA_2,
    SchemaProbe, StatisticsEntry, from_rows,
};
use crate::files::size::Format;
use crate::files::{Fault, Located, Place, magic};
use crate::model::{
    Activation, AffineMap, InputGivenState, InputStatistics, Layer, Library, ModelError, Phase,
    ReducedModel, StateMap,
};
use crate::robot::STATE_DIM;

/// A fault and its place in a model file.
pub type ArtifactError = Located<Fault<ModelError>>;

/// An error and all its causes in one line.
pub fn describe(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(source) = cause {
        text.push_str(": ");
        text.push_str(&source.to_string());
        cause = source.source();
    }
    text
}

/// Largest model file; all of the largest model fits.
pub const MAX_FILE_BYTES: u64 = Format::Model.most_bytes();

/// Whether the path stands for standard input: `-`.
pub fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Reads and checks a model file, or standard input for the path `-`.
///
/// # Errors
/// [`ArtifactError`] with what was found and expected.
pub fn read(path: &Path) -> Result<ReducedModel, ArtifactError> {
    let mut bytes = Vec::new();
    let (name, source): (String, io::Result<Box<dyn Read>>) = match is_standard_input(path) {
        true => (
            "standard input".to_owned(),
            Ok(Box::new(io::stdin().lock())),
        ),
        false => (
            path.display().to_string(),
            File::open(path).map(|file| Box::new(file) as _),
        ),
    };
    // One byte more than allowed distinguishes a file that is too large from one that just fits.
    source
        .and_then(|source| source.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes))
        .map_err(|source| ArtifactError::io(&name, "read the model file", source))?;
    read_from_bytes(&name, &bytes)
}

/// Reads and checks a model file that is in memory; `file` names it in errors.
///
/// # Errors
/// As [`read`]. Never panics, whatever the bytes are.
pub fn read_from_bytes(file: &str, bytes: &[u8]) -> Result<ReducedModel, ArtifactError> {
    if bytes.len() as u64 > MAX_FILE_BYTES {
        let text = format!("found more than {MAX_FILE_BYTES} bytes, which no model file needs");
        return Err(ArtifactError::text(file, Place::Whole, text));
    }
    check_schema(file, bytes)?;
    let manifest: Manifest =
        parse(file, bytes).map_err(|fault| foreign(file, bytes).unwrap_or(fault))?;
    match manifest.later_key().filter(|_| manifest.schema == SCHEMA) {
        Some(key) => {
            let found = format!("in a file of \"{SCHEMA}\"");
            let expected = format!("only from \"{SCHEMA_2}\" on");
            Err(ArtifactError::at(file, format!("`{key}`"), found, expected))
        }
        None => to_model(file, manifest),
    }
}

fn parse<'de, T: serde::Deserialize<'de>>(
    file: &str,
    bytes: &'de [u8],
) -> Result<T, ArtifactError> {
    let syntax = |place: String, error: &serde_json::Error| {
        // serde_json ends its messages with line and column, which the fault has anyway.
        let text = error.to_string();
        let message = text
            .rsplit_once(" at line ")
            .map_or(&*text, |(message, _)| message);
        let place = Place::Key(place.into(), error.line(), error.column());
        ArtifactError::text(file, place, message)
    };
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    let value = serde_path_to_error::deserialize(&mut deserializer)
        .map_err(|error| syntax(error.path().to_string(), error.inner()))?;
    let rest = deserializer.end();
    rest.map_err(|error| syntax(".".to_owned(), &error))?;
    Ok(value)
}

/// The fault of a file that is no JSON but of a kind that other tools write.
fn foreign(file: &str, bytes: &[u8]) -> Option<ArtifactError> {
    let is_object = bytes.trim_ascii_start().starts_with(b"{");
    let found = magic::arrays(Path::new(file), bytes).filter(|_| !is_object)?;
    let import =
        "romc import (in Python Model.from_arrays, from_torch or from_pysindy) makes one of";
    let remedy = match (found.is_packed, found.remedy.as_str()) {
        (true, line) => line.to_owned(),
        (false, "") => format!("{import} it"),
        (false, lines) => format!("{import} {lines}"),
    };
    let expected = format!("a model file of romc: {remedy}");
    Some(ArtifactError::at(file, Place::Whole, found.what, expected))
}

/// Looks at the schema first: for a file of a later version it is the fault, not unknown keys.
fn check_schema(file: &str, bytes: &[u8]) -> Result<(), ArtifactError> {
    if bytes.trim_ascii_start().first() == Some(&b'[') {
        // serde would take an array for an object whose keys are left out.
        let place = Place::Key(".".into(), 1, 1);
        return Err(ArtifactError::at(file, place, "an array", "an object"));
    }
    let Ok(probe) = parse::<SchemaProbe>(file, bytes) else {
        // No JSON at all: reading the whole grammar meets the same fault, and knows its place.
        return Ok(());
    };
    let found: String = match probe.schema {
        Some(Value::String(schema)) if schema == SCHEMA || schema == SCHEMA_2 => return Ok(()),
        Some(other) => other.to_string().chars().take(80).collect(),
        None => "none".to_owned(),
    };
    let expected = format!("\"{SCHEMA}\" or \"{SCHEMA_2}\"");
    Err(ArtifactError::at(file, "`schema`", found, expected))
}

fn to_model(file: &str, manifest: Manifest) -> Result<ReducedModel, ArtifactError> {
    let latent_dim = manifest.latent_dim;
    let library = Library::of(latent_dim, manifest.library);
    let library = library.map_err(|source| ArtifactError::unusable(file, source))?;
    let mut builder = ReducedModel::builder(manifest.name, library)
        .description(manifest.description)
        .provenance(manifest.provenance);
    let robot = manifest.robot.map(|robot| match robot {
        RobotValue::Name(name) => crate::robot_file::by_name(&name)
            .map_err(|source| ArtifactError::unusable(file, source)),
        RobotValue::Entry(entry) => {
            let robot = entry.robot("robot");
            robot.map_err(|error| ArtifactError::text(file, Place::Whole, error.to_string()))
        }
    });
    let robot = robot.transpose()?;
    let known_dim = robot
        .map(|_| STATE_DIM)
        .or(manifest.state.as_ref().map(|state| state.names.len()));
    builder = builder
        .robot(robot)
        .state(manifest.state)
        .input(manifest.input)
        .scaling(manifest.scaling)
        .actuators(manifest.actuators)
        .wrench_frame(manifest.wrench_frame.unwrap_or_default())
        .sample_time_s(manifest.sample_time_s);
    if let Some(entry) = &manifest.encoder {
        builder = builder.encoder(map_of(file, "encoder", entry, known_dim)?);
    }
    if let Some(entry) = &manifest.decoder {
        builder = builder.decoder(map_of(file, "decoder", entry, Some(latent_dim))?);
    }
    let phases = manifest.phases.into_iter().enumerate();
    let phases = phases
        .map(|(index, PhaseEntry { name, feet, xi })| {
            let tensor = format!("phases[{index}].xi");
            let xi = from_rows(file, &tensor, &xi, Some(latent_dim))?;
            Ok(Phase { name, feet, xi })
        })
        .collect::<Result<Vec<_>, _>>()?;
    let prior = prior_of(file, (manifest.landmarks, manifest.prior), &phases)?;
    builder = builder.phases(phases).jump_prior(prior);
    for (name, entry) in manifest.input_statistics.0 {
        let statistics = statistics_of(file, &name, &entry)?;
        builder = builder.input_statistics(name, statistics);
    }
    builder
        .build()
        .map_err(|source| ArtifactError::unusable(file, source))
}

/// An encoder or decoder; a chain of one linear layer is the affine map.
fn map_of(
    file: &str,
    tensor: &str,
    entry: &MapEntry,
    columns: Option<usize>,
) -> Result<StateMap, ArtifactError> {
    let refused = |source: ModelError| ArtifactError::unusable(file, source);
    let entries = match entry {
        MapEntry::Affine { weights, bias } => {
            return affine_of(file, tensor, (weights, bias), columns).map(StateMap::from);
        }
        MapEntry::Layers { layers } => layers,
    };
    let mut layers: Vec<Layer> = Vec::with_capacity(entries.len());
    for (index, entry) in entries.iter().enumerate() {
        let name = format!("{tensor}.layers[{index}]");
        // What the layer before gives, this one takes.
        let before = layers.last().map(|layer| layer.map.output_dim());
        let columns = before.or(columns);
        let activation: Activation = entry.activation.parse().map_err(refused)?;
        let map = affine_of(file, &name, (&entry.weights, &entry.bias), columns)?;
        layers.push(Layer { map, activation });
    }
    StateMap::new(tensor, layers).map_err(refused)
}

fn affine_of(
    file: &str,
    tensor: &str,
    (weights, bias): (&Rows, &[f64]),
    columns: Option<usize>,
) -> Result<AffineMap, ArtifactError> {
    let weights = from_rows(file, &format!("{tensor}.weights"), weights, columns)?;
    let bias = DVector::from_column_slice(bias);
    AffineMap::new(tensor, weights, bias).map_err(|source| ArtifactError::unusable(file, source))
}

fn statistics_of(
    file: &str,
    phase: &str,
    entry: &StatisticsEntry,
) -> Result<InputStatistics, ArtifactError> {
    let phase: String = phase.chars().take(80).collect();
    let place = format!("input_statistics.{}", phase.escape_debug());
    let matrix = |key: &str, rows: &Rows, columns: Option<usize>| {
        from_rows(file, &format!("{place}.{key}"), rows, columns)
    };
    let covariance = matrix("covariance", &entry.covariance, Some(entry.mean.len()))?;
    let given = |given: &GivenStateEntry| {
        let matrix = |key: &str, rows: &Rows| matrix(&format!("given_state.{key}"), rows, None);
        Ok(InputGivenState {
            mean: matrix("mean", &given.mean)?,
            covariance: matrix("covariance", &given.covariance)?,
            acceleration_error: matrix("acceleration_error", &given.acceleration_error)?,
        })
    };
    Ok(InputStatistics {
        mean: DVector::from_column_slice(&entry.mean),
        covariance,
        given_state: entry.given_state.as_ref().map(given).transpose()?,
    })
}
