//! JSON as people like to read and compare it: one key, or one row of a matrix, a line; lists of words fill lines.

use serde_json::Value;

const INDENT: &str = "  ";
/// Lists of words and small objects keep to this width, without indentation.
const LINE_WIDTH: usize = 100;

pub(super) fn print(value: &Value) -> String {
    let mut out = String::new();
    push(&mut out, value, Some(0));
    out + "\n"
}

/// Pushes a value whose lines are that deep, or without a depth on one line with a space after each comma and colon.
fn push(out: &mut String, value: &Value, depth: Option<usize>) {
    let depth = depth.filter(|_| !is_on_one_line(value));
    let inner = depth.map(|depth| depth + 1);
    let lines = depth.map(|depth| {
        let end = format!("\n{}", INDENT.repeat(depth));
        [format!("{end}{INDENT}"), format!(",{end}{INDENT}"), end]
    });
    let [first, next, last] = match &lines {
        Some(marks) => marks.each_ref().map(String::as_str),
        None if value.as_object().is_some_and(|entries| !entries.is_empty()) => [" ", ", ", " "],
        None => ["", ", ", ""],
    };
    match value {
        Value::Array(words) if inner.is_some() && words.iter().all(Value::is_string) => {
            let lines = fill_lines(words).join(next);
            out.extend(["[", first, &lines, last, "]"]);
        }
        Value::Array(items) => {
            out.push('[');
            for (index, item) in items.iter().enumerate() {
                out.push_str(if index == 0 { first } else { next });
                push(out, item, inner);
            }
            out.extend([last, "]"]);
        }
        Value::Object(entries) => {
            out.push('{');
            for (index, (key, item)) in entries.iter().enumerate() {
                out.push_str(if index == 0 { first } else { next });
                out.extend([&Value::from(&**key).to_string(), ": "]);
                push(out, item, inner);
            }
            out.extend([last, "}"]);
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {
            out.push_str(&value.to_string());
        }
    }
}

/// Rows of numbers stay on one line however long; other lists and objects if they are short.
fn is_on_one_line(value: &Value) -> bool {
    let is_short = || {
        let mut text = String::new();
        push(&mut text, value, None);
        text.len() <= LINE_WIDTH
    };
    let is_scalar = |item: &Value| !item.is_array() && !item.is_object();
    match value {
        Value::Array(items) => {
            items.iter().all(Value::is_number) || items.iter().all(is_scalar) && is_short()
        }
        Value::Object(entries) => {
            !entries.values().all(Value::is_number) && entries.values().all(is_scalar) && is_short()
        }
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => true,
    }
}

/// Words with commas between them, as many on a line as fit; no comma at the end of a line.
fn fill_lines(words: &[Value]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for text in words.iter().map(Value::to_string) {
        match lines.last_mut() {
            Some(line) if line.len() + text.len() + 3 <= LINE_WIDTH => {
                line.extend([", ", &text]);
            }
            _ => lines.push(text),
        }
    }
    lines
}
