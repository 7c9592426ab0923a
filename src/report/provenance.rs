//! A model's origin as tables: values by their place, and lists of objects folded away.

use super::*;

const LONGEST_LIST: usize = 24;

const DIGEST: usize = 12;

#[derive(Default)]
pub(crate) struct Origin {
    /// Name and value of each entry that fits a cell.
    pub facts: Vec<(String, String)>,
    /// The others as tables with their names as captions: objects by place and value, lists of objects by their keys.
    pub lists: Vec<Table>,
}

pub(crate) fn origin(provenance: &Map<String, Value>) -> Origin {
    let mut origin = Origin::default();
    for (key, value) in provenance {
        let Value::Object(entries) = value else {
            add(&mut origin.facts, &mut origin.lists, key, value);
            continue;
        };
        let (mut facts, place) = (Vec::new(), origin.lists.len());
        for (key, value) in entries {
            add(&mut facts, &mut origin.lists, key, value);
        }
        let table = Table::of(&facts)
            .column("entry", "", |(entry, _)| entry)
            .column("value", "", |(_, value)| value);
        (origin.lists).insert(place, table.table().captioned(spaced(key)));
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
            let keys = items.iter().find_map(Value::as_object).into_iter();
            let keys: Vec<&String> = keys.flat_map(Map::keys).collect();
            let mut table = Table::new(keys.iter().map(|key| spaced(key)));
            for item in items {
                table.row(
                    keys.iter()
                        .map(|key| item.get(key.as_str()).map_or(String::new(), text)),
                );
            }
            lists.push(table.captioned(format!("{}: {}", spaced(place), items.len())));
        }
        value => facts.push((spaced(place), text(value))),
    }
}

fn spaced(key: &str) -> String {
    key.replace('_', " ")
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
