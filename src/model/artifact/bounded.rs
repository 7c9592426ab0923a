//! JSON of any form, such as a provenance, with a bound on its number of values: each takes up to a hundred times the
//! bytes that it has in a file.

use std::cell::Cell;
use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Number, Value};

/// Most values; the provenance of a training with a thousand recordings has some ten thousand.
const MOST: usize = 100_000;

pub(super) fn value<'de, D: Deserializer<'de>>(source: D) -> Result<Option<Value>, D::Error> {
    let value = Bounded(&Cell::new(MOST)).deserialize(source)?;
    Ok(Some(value).filter(|value| !value.is_null()))
}

pub(super) fn object<'de, D: Deserializer<'de>>(source: D) -> Result<Map<String, Value>, D::Error> {
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
