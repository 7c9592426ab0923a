//! The grammar of the model file as serde types; shapes, ranks and names are checked when it becomes a model.

use std::cell::Cell;

use nalgebra::DVector;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{DeserializeSeed, Error, MapAccess, SeqAccess, Visitor};

use super::*;
use crate::model::StridePrior;
use crate::robot::{Actuators, Robot, WrenchFrame};
use crate::robot_file::{self, RobotEntry};

pub(crate) const SCHEMA: &str = "romc-model/1";
/// With `actuators`, `wrench_frame`, `landmarks`, `prior`, inputs given states, and a `robot` that is described.
pub(crate) const SCHEMA_2: &str = "romc-model/2";
/// With `strides`.
pub(crate) const SCHEMA_3: &str = "romc-model/3";

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
    pub encoder: Option<StateMap>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub decoder: Option<StateMap>,
    pub latent_dim: usize,
    pub library: LibraryChoice,
    pub phases: Vec<Phase>,
    #[serde(default, with = "by_phase", skip_serializing_if = "Vec::is_empty")]
    pub input_statistics: Vec<(String, InputStatistics)>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<RobotValue>,
    #[serde(
        default,
        deserialize_with = "present",
        skip_serializing_if = "Option::is_none"
    )]
    pub actuators: Option<Actuators>,
    #[serde(
        default,
        deserialize_with = "present",
        skip_serializing_if = "Option::is_none"
    )]
    pub wrench_frame: Option<WrenchFrame>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sample_time_s: Option<f64>,
    #[serde(
        default,
        deserialize_with = "present",
        skip_serializing_if = "Option::is_none"
    )]
    pub landmarks: Option<Landmarks>,
    #[serde(
        default,
        deserialize_with = "present",
        skip_serializing_if = "Option::is_none"
    )]
    pub prior: Option<JumpPrior>,
    #[serde(
        default,
        deserialize_with = "present",
        skip_serializing_if = "Option::is_none"
    )]
    pub strides: Option<StridePrior>,
    #[serde(
        default,
        deserialize_with = "object",
        skip_serializing_if = "Map::is_empty"
    )]
    pub provenance: Map<String, Value>,
}

impl Manifest {
    pub(super) fn of(model: &ReducedModel) -> Self {
        let parts = model.parts.clone();
        let landmarks = parts.jump_prior.as_ref();
        let mut manifest = Self {
            schema: SCHEMA.to_owned(),
            name: parts.name,
            description: parts.description,
            state: parts.state,
            input: parts.input,
            scaling: parts.scaling,
            encoder: parts.encoder,
            decoder: parts.decoder,
            latent_dim: parts.library.latent_dim(),
            library: parts.library.choice(),
            phases: parts.phases,
            input_statistics: parts.statistics,
            robot: parts.robot.map(RobotValue::of),
            actuators: parts.actuators,
            wrench_frame: Some(parts.wrench_frame).filter(|frame| *frame != WrenchFrame::Body),
            sample_time_s: parts.sample_time_s,
            landmarks: landmarks.map(|prior| prior.landmarks.clone()),
            prior: parts.jump_prior,
            strides: parts.stride_prior,
            provenance: parts.provenance,
        };
        if let Some((_, schema)) = manifest.later_key() {
            manifest.schema = schema.to_owned();
        }
        manifest
    }

    pub(super) fn model(self, file: &str) -> Result<ReducedModel> {
        let refused = |source: ModelError| ArtifactError::unusable(file, source);
        let incomplete = |part, needs| Err(refused(ModelError::Incomplete { part, needs }));
        let prior = match (self.landmarks, self.prior) {
            (None, None) => None,
            (Some(_), None) => return incomplete("landmarks", "prior"),
            (None, Some(_)) => return incomplete("prior", "landmarks"),
            (Some(landmarks), Some(prior)) => Some(JumpPrior { landmarks, ..prior }),
        };
        let robot = self.robot.map(|robot| robot.robot(file)).transpose()?;
        let library = Library::of(self.latent_dim, self.library).map_err(refused)?;
        ReducedModel::builder(self.name, library)
            .description(self.description)
            .state(self.state)
            .input(self.input)
            .scaling(self.scaling)
            .phases(self.phases)
            .robot(robot)
            .actuators(self.actuators)
            .wrench_frame(self.wrench_frame.unwrap_or_default())
            .jump_prior(prior)
            .stride_prior(self.strides)
            .sample_time_s(self.sample_time_s)
            .provenance(self.provenance)
            .encoder(self.encoder)
            .decoder(self.decoder)
            .all_input_statistics(self.input_statistics)
            .build()
            .map_err(refused)
    }

    /// A key that the first schema does not have, and the first one that has it; the latest such.
    pub(super) fn later_key(&self) -> Option<(&'static str, &'static str)> {
        if self.strides.is_some() {
            return Some(("strides", SCHEMA_3));
        }
        let mut statistics = self.input_statistics.iter();
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
        found.map(|(key, _)| (key, SCHEMA_2))
    }
}

#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum RobotValue {
    Name(String),
    Entry(RobotEntry),
}

/// Reads a value in one of several forms: words for the expected forms, then a visit for each form.
macro_rules! read_by_form {
    ($value:ty, $words:literal, $($visit:tt)*) => {
        impl<'de> Deserialize<'de> for $value {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Form;
                impl<'de> Visitor<'de> for Form {
                    type Value = $value;
                    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                        f.write_str($words)
                    }
                    $($visit)*
                }
                deserializer.deserialize_any(Form)
            }
        }
    };
}

read_by_form! {
    RobotValue, "the name of a robot, or an object that describes one",
    fn visit_str<E: Error>(self, name: &str) -> Result<RobotValue, E> {
        Ok(RobotValue::Name(name.to_owned()))
    }
    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<RobotValue, A::Error> {
        RobotEntry::deserialize(MapAccessDeserializer::new(map)).map(RobotValue::Entry)
    }
}

impl RobotValue {
    fn of(robot: &Robot) -> Self {
        match robot_file::by_name(robot.name) {
            Ok(_) => Self::Name(robot.name.to_owned()),
            Err(_) => Self::Entry(RobotEntry::of(robot)),
        }
    }

    fn robot(self, file: &str) -> Result<&'static Robot> {
        match self {
            Self::Name(name) => {
                robot_file::by_name(&name).map_err(|source| ArtifactError::unusable(file, source))
            }
            Self::Entry(entry) => entry
                .robot("robot")
                .map_err(|error| ArtifactError::text(file, Place::Whole, error.to_string())),
        }
    }
}

#[derive(Deserialize)]
pub(super) struct SchemaProbe {
    #[serde(default, deserialize_with = "bounded_value")]
    pub schema: Option<Value>,
}

fn present<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    T::deserialize(deserializer).map(Some)
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

read_by_form! {
    ScaleFactors, "a number or a list of numbers",
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

read_by_form! {
    LibraryChoice, "a list of terms, or an object with degree, trigonometric and inputs",
    fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<LibraryChoice, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(seq)).map(LibraryChoice::Terms)
    }
    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<LibraryChoice, A::Error> {
        StandardLibrary::deserialize(MapAccessDeserializer::new(map)).map(LibraryChoice::Standard)
    }
}

/// In the file's order, no key twice.
mod by_phase {
    use super::*;

    type Pairs = Vec<(String, InputStatistics)>;

    pub(super) fn serialize<S: Serializer>(pairs: &Pairs, to: S) -> Result<S::Ok, S::Error> {
        to.collect_map(pairs.iter().map(|(key, value)| (key, value)))
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Pairs, D::Error> {
        struct Object;
        impl<'de> Visitor<'de> for Object {
            type Value = Pairs;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object with one entry per phase")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Pairs, A::Error> {
                let mut pairs = Pairs::new();
                while let Some(key) = map.next_key::<String>()? {
                    if pairs.iter().any(|(earlier, _)| *earlier == key) {
                        return Err(A::Error::custom(format_args!("duplicate key {key:?}")));
                    }
                    pairs.push((key, map.next_value()?));
                }
                Ok(pairs)
            }
        }
        from.deserialize_map(Object)
    }
}

/// Most values; the provenance of a training with a thousand recordings has some ten thousand.
const MOST: usize = 100_000;

fn bounded_value<'de, D: Deserializer<'de>>(source: D) -> Result<Option<Value>, D::Error> {
    let value = Bounded(&Cell::new(MOST)).deserialize(source)?;
    Ok(Some(value).filter(|value| !value.is_null()))
}

fn object<'de, D: Deserializer<'de>>(source: D) -> Result<Map<String, Value>, D::Error> {
    match Bounded(&Cell::new(MOST)).deserialize(source)? {
        Value::Object(object) => Ok(object),
        other => {
            let found: String = other.to_string().chars().take(80).collect();
            Err(D::Error::custom(format!(
                "found {found}, expected an object"
            )))
        }
    }
}

/// JSON of any form. The bound limits the number of its values, because each needs up to a hundred times its bytes.
struct Bounded<'a>(&'a Cell<usize>);

impl<'de> DeserializeSeed<'de> for Bounded<'_> {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, source: D) -> Result<Value, D::Error> {
        let left = self.0.get().checked_sub(1).ok_or_else(|| {
            let text = format!("found more than {MOST} values, expected at most so many");
            D::Error::custom(text)
        })?;
        self.0.set(left);
        source.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Bounded<'_> {
    type Value = Value;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }
    fn visit_unit<E: Error>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }
    fn visit_bool<E: Error>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }
    fn visit_i64<E: Error>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }
    fn visit_u64<E: Error>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }
    fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
        Ok(Number::from_f64(value).map_or(Value::Null, Value::Number))
    }
    fn visit_str<E: Error>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }
    fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<Value, A::Error> {
        let mut array = Vec::new();
        while let Some(value) = values.next_element_seed(Bounded(self.0))? {
            array.push(value);
        }
        Ok(array.into())
    }
    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some(key) = entries.next_key::<String>()? {
            let value = entries.next_value_seed(Bounded(self.0))?;
            object.insert(key, value);
        }
        Ok(object.into())
    }
}
