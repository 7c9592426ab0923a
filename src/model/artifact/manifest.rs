//! The grammar of the model file, as serde types.
//!
//! Only types and spelling are settled here; shapes, ranks and names are checked when the parts
//! become a [`ReducedModel`](crate::model::ReducedModel).

use std::fmt;

use nalgebra::{DMatrix, DVector};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error as _, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value};

use super::bounded;
use super::jump_prior::{LandmarksEntry, PriorEntry};
use super::read::ArtifactError;
use crate::model::{
    Activation, CoordinateNames, FeetRule, LibraryChoice, ScaleFactors, Scaling, StandardLibrary,
};
use crate::robot::{Actuators, WrenchFrame};
use crate::robot_file::RobotEntry;

/// Name and version of the format of a model without the keys of [`SCHEMA_2`].
pub(crate) const SCHEMA: &str = "romc-model/1";

/// The format with `actuators`, `wrench_frame`, `landmarks`, `prior`, inputs given states, and a
/// `robot` that is described.
pub(crate) const SCHEMA_2: &str = "romc-model/2";

pub(super) type Rows = Vec<Vec<f64>>;

/// The matrix with these rows; every row must have `expected` numbers, or as many as the first.
pub(super) fn from_rows(
    file: &str,
    tensor: &str,
    rows: &Rows,
    expected: Option<usize>,
) -> Result<DMatrix<f64>, ArtifactError> {
    let expected = expected.or(rows.first().map(Vec::len)).unwrap_or(0);
    for (row, numbers) in rows.iter().enumerate() {
        if numbers.len() != expected {
            let (place, found) = (format!("`{tensor}`[{row}]"), numbers.len());
            let found = format!("{found} numbers");
            return Err(ArtifactError::at(file, place, found, expected.to_string()));
        }
    }
    Ok(DMatrix::from_row_iterator(
        rows.len(),
        expected,
        rows.iter().flatten().copied(),
    ))
}

pub(super) fn to_rows(matrix: &DMatrix<f64>) -> Rows {
    matrix
        .row_iter()
        .map(|row| row.iter().copied().collect())
        .collect()
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Manifest {
    pub schema: String,
    pub name: String,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub description: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<CoordinateNames>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input: Option<CoordinateNames>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scaling: Option<Scaling>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub encoder: Option<MapEntry>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub decoder: Option<MapEntry>,
    pub latent_dim: usize,
    pub library: LibraryChoice,
    pub phases: Vec<PhaseEntry>,
    #[serde(default, skip_serializing_if = "Statistics::is_empty")]
    pub input_statistics: Statistics,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<RobotValue>,
    #[serde(default, deserialize_with = "present")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub actuators: Option<Actuators>,
    #[serde(default, deserialize_with = "present")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wrench_frame: Option<WrenchFrame>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample_time_s: Option<f64>,
    #[serde(default, deserialize_with = "present")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub landmarks: Option<LandmarksEntry>,
    #[serde(default, deserialize_with = "present")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior: Option<PriorEntry>,
    #[serde(default, deserialize_with = "bounded::object")]
    #[serde(skip_serializing_if = "Map::is_empty")]
    pub provenance: Map<String, Value>,
}

impl Manifest {
    /// A key that it has and the first schema does not know.
    pub(super) fn later_key(&self) -> Option<&'static str> {
        let mut statistics = self.input_statistics.0.iter();
        let has_given_state = statistics.any(|(_, entry)| entry.given_state.is_some());
        let later = [
            ("actuators", self.actuators.is_some()),
            ("wrench_frame", self.wrench_frame.is_some()),
            ("landmarks", self.landmarks.is_some()),
            ("prior", self.prior.is_some()),
            ("input_statistics.given_state", has_given_state),
            ("robot", matches!(self.robot, Some(RobotValue::Entry(_)))),
        ];
        let found = later.into_iter().find(|(_, there)| *there);
        found.map(|(key, _)| key)
    }
}

#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum RobotValue {
    Name(String),
    Entry(RobotEntry),
}

impl<'de> Deserialize<'de> for RobotValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Robot;
        impl<'de> Visitor<'de> for Robot {
            type Value = RobotValue;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a robot, or an object that describes one")
            }
            fn visit_str<E: serde::de::Error>(self, name: &str) -> Result<RobotValue, E> {
                Ok(RobotValue::Name(name.to_owned()))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<RobotValue, A::Error> {
                RobotEntry::deserialize(MapAccessDeserializer::new(map)).map(RobotValue::Entry)
            }
        }
        deserializer.deserialize_any(Robot)
    }
}

#[derive(Deserialize)]
pub(super) struct SchemaProbe {
    #[serde(default, deserialize_with = "bounded::value")]
    pub schema: Option<Value>,
}

/// An encoder or decoder: one affine map, or a chain of layers with activations.
#[derive(Serialize, Deserialize)]
#[serde(try_from = "MapFields", untagged)]
pub(super) enum MapEntry {
    Affine { weights: Rows, bias: Vec<f64> },
    Layers { layers: Vec<LayerEntry> },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LayerEntry {
    pub weights: Rows,
    pub bias: Vec<f64>,
    #[serde(default = "linear")]
    pub activation: String,
}

fn linear() -> String {
    Activation::Linear.name().to_owned()
}

/// All keys that an encoder or decoder may have, before it is known which kind it is.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MapFields {
    #[serde(default, deserialize_with = "present")]
    weights: Option<Rows>,
    #[serde(default, deserialize_with = "present")]
    bias: Option<Vec<f64>>,
    #[serde(default, deserialize_with = "present")]
    layers: Option<Vec<LayerEntry>>,
}

/// A value that may be left out, but not be `null`.
fn present<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
}

impl TryFrom<MapFields> for MapEntry {
    type Error = &'static str;

    fn try_from(fields: MapFields) -> Result<Self, &'static str> {
        match (fields.weights, fields.bias, fields.layers) {
            (None, None, Some(layers)) => Ok(Self::Layers { layers }),
            (_, _, Some(_)) => {
                Err("found `layers` beside `weights` or `bias`, expected one of the two")
            }
            (Some(weights), Some(bias), None) => Ok(Self::Affine { weights, bias }),
            (None, _, None) => Err("missing field `weights`"),
            (_, None, None) => Err("missing field `bias`"),
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PhaseEntry {
    pub name: String,
    pub feet: FeetRule,
    pub xi: Rows,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StatisticsEntry {
    pub mean: Vec<f64>,
    pub covariance: Rows,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub given_state: Option<GivenStateEntry>,
}

/// The latent input given the latent state.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GivenStateEntry {
    pub mean: Rows,
    pub covariance: Rows,
    pub acceleration_error: Rows,
}

/// A number for all coordinates, or one number per coordinate.
impl Serialize for ScaleFactors {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            ScaleFactors::Uniform(factor) => factor.serialize(serializer),
            ScaleFactors::PerCoordinate(factors) => factors.as_slice().serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for ScaleFactors {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Factors;
        impl<'de> Visitor<'de> for Factors {
            type Value = ScaleFactors;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or a list of numbers")
            }
            fn visit_f64<E>(self, value: f64) -> Result<ScaleFactors, E> {
                Ok(ScaleFactors::Uniform(value))
            }
            fn visit_u64<E>(self, value: u64) -> Result<ScaleFactors, E> {
                Ok(ScaleFactors::Uniform(value as f64))
            }
            fn visit_i64<E>(self, value: i64) -> Result<ScaleFactors, E> {
                Ok(ScaleFactors::Uniform(value as f64))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<ScaleFactors, A::Error> {
                let factors = Vec::deserialize(SeqAccessDeserializer::new(seq))?;
                Ok(ScaleFactors::PerCoordinate(DVector::from_vec(factors)))
            }
        }
        deserializer.deserialize_any(Factors)
    }
}

impl<'de> Deserialize<'de> for LibraryChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Terms;
        impl<'de> Visitor<'de> for Terms {
            type Value = LibraryChoice;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list of terms, or an object with degree, trigonometric and inputs")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<LibraryChoice, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(seq)).map(LibraryChoice::Terms)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<LibraryChoice, A::Error> {
                StandardLibrary::deserialize(MapAccessDeserializer::new(map))
                    .map(LibraryChoice::Standard)
            }
        }
        deserializer.deserialize_any(Terms)
    }
}

/// Statistics by phase: a JSON object as pairs in the file's order, in which no key comes twice.
#[derive(Default)]
pub(super) struct Statistics(pub Vec<(String, StatisticsEntry)>);

impl Statistics {
    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl Serialize for Statistics {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(key, value)| (key, value)))
    }
}

impl<'de> Deserialize<'de> for Statistics {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Object;
        impl<'de> Visitor<'de> for Object {
            type Value = Statistics;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object with one entry per phase")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Statistics, A::Error> {
                let mut pairs: Vec<(String, StatisticsEntry)> = Vec::new();
                while let Some(key) = map.next_key::<String>()? {
                    if pairs.iter().any(|(earlier, _)| *earlier == key) {
                        return Err(A::Error::custom(format_args!("duplicate key {key:?}")));
                    }
                    pairs.push((key, map.next_value()?));
                }
                Ok(Statistics(pairs))
            }
        }
        deserializer.deserialize_map(Object)
    }
}
