//! JSON as people like to read and compare it: one key, or one row of a matrix, a line; lists of
//! words fill lines.

use serde_json::Value;

const INDENT: &str = "  ";
/// Lists of words and small objects keep to this width, without indentation.
const LINE_WIDTH: usize = 100;

/// The value as text, with a newline at the end.
pub(super) fn print(value: &Value) -> String {
    let mut out = String::new();
    push_value(&mut out, value, 0);
    out.push('\n');
    out
}

fn push_value(out: &mut String, value: &Value, depth: usize) {
    match value {
        Value::Array(words)
            if words.iter().all(Value::is_string) && !on_one_line(words.iter(), value) =>
        {
            let lines = fill_lines(words);
            push_lines(out, depth, ('[', ']'), lines.iter(), |out, line| {
                out.push_str(line)
            });
        }
        Value::Array(items) if !on_one_line(items.iter(), value) => {
            push_lines(out, depth, ('[', ']'), items.iter(), |out, item| {
                push_value(out, item, depth + 1);
            });
        }
        Value::Object(entries) if !on_one_line(entries.values(), value) => {
            push_lines(
                out,
                depth,
                ('{', '}'),
                entries.iter(),
                |out, (key, item)| {
                    push_compact(out, &Value::String(key.clone()));
                    out.push_str(": ");
                    push_value(out, item, depth + 1);
                },
            );
        }
        Value::Array(_)
        | Value::Object(_)
        | Value::Null
        | Value::Bool(_)
        | Value::Number(_)
        | Value::String(_) => push_compact(out, value),
    }
}

/// Rows of numbers stay on one line however long; other lists and objects if they are short.
fn on_one_line<'a>(mut items: impl Iterator<Item = &'a Value> + Clone, whole: &Value) -> bool {
    if items.clone().all(Value::is_number) {
        return whole.is_array();
    }
    let scalar = |item: &Value| !item.is_array() && !item.is_object();
    let mut text = String::new();
    items.all(scalar) && {
        push_compact(&mut text, whole);
        text.len() <= LINE_WIDTH
    }
}

/// Words with commas between them, as many on a line as fit; no comma at the end of a line.
fn fill_lines(words: &[Value]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words {
        let mut text = String::new();
        push_compact(&mut text, word);
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

fn push_lines<T>(
    out: &mut String,
    depth: usize,
    (open, close): (char, char),
    items: impl Iterator<Item = T>,
    push: impl Fn(&mut String, T),
) {
    out.push(open);
    for (index, item) in items.enumerate() {
        out.push_str(if index == 0 { "\n" } else { ",\n" });
        out.push_str(&INDENT.repeat(depth + 1));
        push(out, item);
    }
    out.push('\n');
    out.push_str(&INDENT.repeat(depth));
    out.push(close);
}

/// On one line, with a space after each comma and colon.
fn push_compact(out: &mut String, value: &Value) {
    match value {
        Value::Array(items) => {
            out.push('[');
            for (index, item) in items.iter().enumerate() {
                out.push_str(if index == 0 { "" } else { ", " });
                push_compact(out, item);
            }
            out.push(']');
        }
        Value::Object(entries) => {
            out.push('{');
            for (index, (key, item)) in entries.iter().enumerate() {
                out.push_str(if index == 0 { " " } else { ", " });
                push_compact(out, &Value::String(key.clone()));
                out.push_str(": ");
                push_compact(out, item);
            }
            out.push_str(if entries.is_empty() { "}" } else { " }" });
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {
            out.push_str(&value.to_string());
        }
    }
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
