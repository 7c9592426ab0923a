//! JSON as people like to read and compare it: one key, or one row of a matrix, a line; lists of
//! words fill lines.

use serde_json::Value;

const INDENT: &str = "  ";
/// Lists of words and small objects keep to this width, without indentation.
const LINE_WIDTH: usize = 100;

/// The value as text, with a newline at the end.
pub(super) fn print(value: &Value) -> String {
    lines(value, 0) + "\n"
}

fn lines(value: &Value, depth: usize) -> String {
    let items: Vec<String> = match value {
        Value::Array(items) if on_one_line(items.iter(), value) => return compact(value),
        Value::Object(entries) if on_one_line(entries.values(), value) => return compact(value),
        Value::Array(words) if words.iter().all(Value::is_string) => fill_lines(words),
        Value::Array(items) => items.iter().map(|item| lines(item, depth + 1)).collect(),
        Value::Object(entries) => {
            let entry = |(key, item): (&String, &Value)| {
                format!("{}: {}", quoted(key), lines(item, depth + 1))
            };
            entries.iter().map(entry).collect()
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {
            return compact(value);
        }
    };
    let [open, close] = if value.is_array() {
        ["[", "]"]
    } else {
        ["{", "}"]
    };
    let mut text = open.to_owned();
    for (index, item) in items.iter().enumerate() {
        text.push_str(if index == 0 { "\n" } else { ",\n" });
        text.push_str(&INDENT.repeat(depth + 1));
        text.push_str(item);
    }
    text + "\n" + &INDENT.repeat(depth) + close
}

/// Rows of numbers stay on one line however long; other lists and objects if they are short.
fn on_one_line<'a>(mut items: impl Iterator<Item = &'a Value> + Clone, whole: &Value) -> bool {
    if items.clone().all(Value::is_number) {
        return whole.is_array();
    }
    let scalar = |item: &Value| !item.is_array() && !item.is_object();
    items.all(scalar) && compact(whole).len() <= LINE_WIDTH
}

/// Words with commas between them, as many on a line as fit; no comma at the end of a line.
fn fill_lines(words: &[Value]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for text in words.iter().map(compact) {
        match lines.last_mut() {
            Some(line) if line.len() + text.len() + 3 <= LINE_WIDTH => {
                line.push_str(", ");
                line.push_str(&text);
            }
            _ => lines.push(text),
        }
    }
    lines
}

/// On one line, with a space after each comma and colon.
fn compact(value: &Value) -> String {
    match value {
        Value::Array(items) => {
            let items: Vec<String> = items.iter().map(compact).collect();
            format!("[{}]", items.join(", "))
        }
        Value::Object(entries) if entries.is_empty() => "{}".to_owned(),
        Value::Object(entries) => {
            let entry =
                |(key, item): (&String, &Value)| format!("{}: {}", quoted(key), compact(item));
            let entries: Vec<String> = entries.iter().map(entry).collect();
            format!("{{ {} }}", entries.join(", "))
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => value.to_string(),
    }
}

fn quoted(key: &str) -> String {
    Value::String(key.to_owned()).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn matrix_prints_one_row_a_line() {
        let value = json!({ "name": "m", "weights": [[1.0, -0.5], [2.5e-7, 3.0]], "bias": [0.0] });
        let expected = "{\n  \"name\": \"m\",\n  \"weights\": [\n    [1.0, -0.5],\n    \
                        [2.5e-7, 3.0]\n  ],\n  \"bias\": [0.0]\n}\n";
        assert_eq!(print(&value), expected);
    }

    #[test]
    fn long_list_of_words_fills_lines() {
        let words = vec!["x".repeat(38); 3];
        let word = format!("\"{}\"", words[0]);
        let expected = format!("{{\n  \"w\": [\n    {word}, {word},\n    {word}\n  ]\n}}\n");
        assert_eq!(print(&json!({ "w": words })), expected);
    }

    #[test]
    fn printed_value_reads_back_equal() {
        let value = json!({
            "empty": {}, "none": [], "nested": [[], [{ "a": [null, true] }]],
            "text": "quote \" and \u{1} and \\", "words": ["a".repeat(60), "b".repeat(60)],
            "number": [1e300, -0.0, 5e-324, 12345678901234567u64],
        });
        let again: Value = serde_json::from_str(&print(&value)).unwrap();
        assert_eq!(again, value);
    }
}
