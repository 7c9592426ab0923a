//! A model's origin as tables: values by their place, and lists of objects folded away.

use serde_json::{Map, Value};

use crate::typeset::{Table, significant};

/// Longest list of values in one cell.
const LONGEST_LIST: usize = 24;

/// Digits of a digest that are shown.
const DIGEST: usize = 12;

#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Origin {
    /// Name and value of each entry that fits a cell.
    pub facts: Vec<(String, String)>,
    /// The others as tables with their names as captions: objects by place and value, lists of objects by their keys.
    pub lists: Vec<Table>,
}

pub(crate) fn origin(provenance: &Map<String, Value>) -> Origin {
    let mut origin = Origin::default();
    for (key, value) in provenance {
        match value {
            Value::Object(entries) => {
                let (mut facts, place) = (Vec::new(), origin.lists.len());
                for (key, value) in entries {
                    add(&mut facts, &mut origin.lists, key, value);
                }
                let table = Table::of(&facts)
                    .column("entry", "", |(entry, _)| entry)
                    .column("value", "", |(_, value)| value);
                (origin.lists).insert(place, table.table().captioned(spaced(key)));
            }
            value => add(&mut origin.facts, &mut origin.lists, key, value),
        }
    }
    origin
}

fn add(facts: &mut Vec<(String, String)>, lists: &mut Vec<Table>, place: &str, value: &Value) {
    match value {
        Value::Object(entries) => {
            for (key, value) in entries {
                add(facts, lists, &format!("{place}, {key}"), value);
            }
        }
        Value::Array(items) if items.iter().any(Value::is_object) => {
            lists.push(list(place, items));
        }
        value => facts.push((spaced(place), text(value))),
    }
}

fn spaced(key: &str) -> String {
    key.replace('_', " ")
}

fn list(place: &str, items: &[Value]) -> Table {
    let keys: Vec<&String> = (items.iter().find_map(Value::as_object))
        .map(|entries| entries.keys().collect())
        .unwrap_or_default();
    let mut table = Table::new(keys.iter().map(|key| spaced(key)));
    for item in items {
        table.row((keys.iter()).map(|key| item.get(key.as_str()).map_or(String::new(), text)));
    }
    table.captioned(format!("{}: {}", spaced(place), items.len()))
}

/// A value in one cell: numbers with four digits, digests shortened, lists with commas.
fn text(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::Bool(flag) => if *flag { "yes" } else { "no" }.to_owned(),
        Value::Number(number) => match number.as_f64() {
            Some(value) if !number.is_i64() && !number.is_u64() => significant(value),
            Some(_) | None => number.to_string(),
        },
        Value::String(text) => match text.strip_prefix("sha256:") {
            Some(digest) if digest.len() > DIGEST && digest.is_ascii() => {
                format!("sha256:{}…", &digest[..DIGEST])
            }
            Some(_) | None => text.clone(),
        },
        Value::Array(items) => {
            let shown: Vec<String> = items.iter().take(LONGEST_LIST).map(text).collect();
            let rest = match items.len().saturating_sub(LONGEST_LIST) {
                0 => String::new(),
                rest => format!(" and {rest} more"),
            };
            shown.join(", ") + &rest
        }
        Value::Object(entries) => {
            let shown = |(key, value): (&String, &Value)| format!("{key}: {}", text(value));
            entries.iter().map(shown).collect::<Vec<_>>().join(", ")
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn nothing_of_a_provenance_is_lost_or_shown_as_json() {
        let value = json!({
            "command": "romc train a.csv", "seed": 3,
            "encoder_options": { "rotate": true, "restarts": 4, "weights": { "body": 0.0123456 } },
            "recordings": [
                { "path": "a.csv", "digest": format!("sha256:{}", "0917caf76347ee1c".repeat(4)) },
                { "path": "b.csv", "digest": "" },
            ],
            "encoded": ["fr.hx", "fr.hy"],
        });
        let origin = origin(value.as_object().unwrap());
        let encoded = ("encoded", "fr.hx, fr.hy");
        let facts = [("command", "romc train a.csv"), ("seed", "3"), encoded];
        let facts = facts.map(|(key, value)| (key.to_owned(), value.to_owned()));
        assert_eq!(origin.facts, facts);
        let [options, recordings] = origin.lists.as_slice() else {
            panic!("{:?}", origin.lists);
        };
        assert_eq!(options.caption(), "encoder options");
        assert_eq!(
            options.csv(),
            "entry,value\nrotate,yes\nrestarts,4\n\"weights, body\",0.01235\n"
        );
        assert_eq!(recordings.caption(), "recordings: 2");
        assert_eq!(
            recordings.csv(),
            "path,digest\na.csv,sha256:0917caf76347…\nb.csv,\n"
        );
    }
}
