//! From a model to a file and its digest. JSON as people like to compare it: one key, or one row of a matrix, per line.

use sha2::{Digest as _, Sha256};

use super::*;

/// The model file as text: equal for equal models, numbers in the shortest form that reads back to the same bits.
pub fn to_text(model: &ReducedModel) -> String {
    let value = serde_json::to_value(Manifest::of(model))
        .expect("a manifest is strings, finite numbers and string-keyed maps");
    print(&value)
}

pub fn check_place(path: &Path, model: &ReducedModel, overwrite: Overwrite) -> Result<()> {
    check_text(path, &to_text(model), overwrite)
}

fn check_text(path: &Path, text: &str, overwrite: Overwrite) -> Result<()> {
    let same = || fs::read(path).is_ok_and(|bytes| bytes == text.as_bytes());
    match overwrite.allows(path) || same() {
        true => Ok(()),
        false => {
            let text = "a file of this name is there already";
            let file = path.display().to_string();
            Err(ArtifactError::text(&file, Place::Whole, text))
        }
    }
}

pub fn write(path: &Path, model: &ReducedModel, overwrite: Overwrite) -> Result<()> {
    let text = to_text(model);
    let written = write_whole(path, overwrite, |out| out.write_all(text.as_bytes()));
    match written {
        Err(source) if source.kind() == io::ErrorKind::AlreadyExists => {
            check_text(path, &text, Overwrite::Refuse)
        }
        Err(source) => {
            let (file, action) = (path.display().to_string(), "write the model file");
            Err(ArtifactError::io(&file, action, source))
        }
        Ok(()) => Ok(()),
    }
}

/// SHA-256 of the file that [`write()`] would write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Digest([u8; 32]);

impl Digest {
    pub fn short(&self) -> String {
        self.to_string()[..16].to_owned()
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&hex(&self.0))
    }
}

pub fn digest(model: &ReducedModel) -> Digest {
    Digest(Sha256::digest(to_text(model)).into())
}

const INDENT: &str = "  ";
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
