//! Spelling of feet, joint losses and frames in files, with the feature `serde`. Generated controllers do without.

use std::fmt;

use serde::de::value::SeqAccessDeserializer;
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::{Actuators, FeetRule, JOINT_DIM, LegMoments, WrenchFrame};

/// `"any"`, `"none"`, or a list of patterns of four flags (0 or 1) in the order fr, fl, rr, rl.
impl Serialize for FeetRule {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            FeetRule::Any => "any".serialize(serializer),
            FeetRule::None => "none".serialize(serializer),
            FeetRule::Patterns(patterns) => {
                serializer.collect_seq(patterns.iter().map(|feet| feet.map(u8::from)))
            }
        }
    }
}

impl<'de> Deserialize<'de> for FeetRule {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Feet;
        impl<'de> Visitor<'de> for Feet {
            type Value = FeetRule;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"any\", \"none\" or a list of patterns such as [1, 1, 0, 0]")
            }
            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<FeetRule, E> {
                match text {
                    "any" => Ok(FeetRule::Any),
                    "none" => Ok(FeetRule::None),
                    _ => Err(E::invalid_value(serde::de::Unexpected::Str(text), &self)),
                }
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<FeetRule, A::Error> {
                let rows: Vec<[Flag; 4]> = Vec::deserialize(SeqAccessDeserializer::new(seq))?;
                let patterns = rows.into_iter().map(|row| row.map(|flag| flag.0));
                Ok(FeetRule::Patterns(patterns.collect()))
            }
        }
        deserializer.deserialize_any(Feet)
    }
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Actuators", deny_unknown_fields)]
struct ActuatorsEntry {
    viscous: [f64; JOINT_DIM],
    dry: [f64; JOINT_DIM],
    armature: [f64; JOINT_DIM],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    legs: Option<LegMoments>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "LegMoments", deny_unknown_fields)]
struct LegMomentsEntry {
    side_kg_m: f64,
    thigh_kg_m: f64,
    calf_kg_m: f64,
    thigh_kg_m2: f64,
    calf_kg_m2: f64,
}

macro_rules! as_entries {
    ($($value:ident: $entry:ident),*) => {$(
        impl Serialize for $value {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                $entry::serialize(self, serializer)
            }
        }

        impl<'de> Deserialize<'de> for $value {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                $entry::deserialize(deserializer)
            }
        }
    )*};
}
as_entries!(LegMoments: LegMomentsEntry, Actuators: ActuatorsEntry);

impl Serialize for WrenchFrame {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.name().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for WrenchFrame {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let unknown = |()| {
            let found = serde::de::Unexpected::Str(&name);
            D::Error::invalid_value(found, &"\"body\", \"world\" or \"ground\"")
        };
        name.parse().map_err(unknown)
    }
}

/// 0 or 1, as recordings write the contact of a foot.
struct Flag(bool);

impl<'de> Deserialize<'de> for Flag {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match u8::deserialize(deserializer)? {
            0 => Ok(Flag(false)),
            1 => Ok(Flag(true)),
            other => Err(D::Error::invalid_value(
                serde::de::Unexpected::Unsigned(other.into()),
                &"0 or 1",
            )),
        }
    }
}
