//! From bytes to a checked model.

use std::error::Error;
use std::fs::File;
use std::io::Read;

use super::manifest::{SCHEMA, SCHEMA_2, SCHEMA_3, SchemaProbe};
use super::*;
use crate::files::size::Format;

pub type ArtifactError = Located<Fault<ModelError>>;

pub fn describe(error: &dyn Error) -> String {
    let causes = std::iter::successors(error.source(), |&cause| cause.source());
    causes.fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}

const SCHEMAS: [&str; 3] = [SCHEMA, SCHEMA_2, SCHEMA_3];
const MAX_FILE_BYTES: u64 = Format::Model.most_bytes();

pub fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Reads and checks a model file, or standard input for the path `-`.
pub fn read(path: &Path) -> Result<ReducedModel> {
    let mut bytes = Vec::new();
    let file = || File::open(path).map(|file| Box::new(file) as Box<dyn Read>);
    let (name, source) = match is_standard_input(path) {
        true => ("standard input".to_owned(), Ok(Box::new(io::stdin()) as _)),
        false => (path.display().to_string(), file()),
    };
    // One byte more than allowed distinguishes a file that is too large from one that just fits.
    source
        .and_then(|source| source.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes))
        .map_err(|source| ArtifactError::io(&name, "read the model file", source))?;
    read_from_bytes(&name, &bytes)
}

/// The same for a file in memory; `file` names it in errors. Never panics, for any bytes.
pub fn read_from_bytes(file: &str, bytes: &[u8]) -> Result<ReducedModel> {
    if bytes.len() as u64 > MAX_FILE_BYTES {
        let text = format!("found more than {MAX_FILE_BYTES} bytes, which no model file needs");
        return Err(ArtifactError::text(file, Place::Whole, text));
    }
    check_schema(file, bytes)?;
    let manifest: Manifest =
        parse(file, bytes).map_err(|fault| foreign(file, bytes).unwrap_or(fault))?;
    // Names of schemas grow as their numbers do.
    match manifest
        .later_key()
        .filter(|(_, from)| *manifest.schema < **from)
    {
        Some((key, from)) => {
            let found = format!("in a file of \"{}\"", manifest.schema);
            let expected = format!("only from \"{from}\" on");
            Err(ArtifactError::at(file, format!("`{key}`"), found, expected))
        }
        None => manifest.model(file),
    }
}

fn parse<'de, T: Deserialize<'de>>(file: &str, bytes: &'de [u8]) -> Result<T> {
    let syntax = |place: String, error: &serde_json::Error| {
        // serde_json ends its messages with line and column, which the fault has anyway.
        let text = error.to_string();
        let message = (text.rsplit_once(" at line ")).map_or(&*text, |(message, _)| message);
        let place = Place::Key(place.into(), error.line(), error.column());
        ArtifactError::text(file, place, message)
    };
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    let value = serde_path_to_error::deserialize(&mut deserializer)
        .map_err(|error| syntax(error.path().to_string(), error.inner()))?;
    let rest = deserializer.end();
    rest.map_err(|error| syntax(".".to_owned(), &error))?;
    Ok(value)
}

fn foreign(file: &str, bytes: &[u8]) -> Option<ArtifactError> {
    let is_object = bytes.trim_ascii_start().starts_with(b"{");
    let found = magic::arrays(Path::new(file), bytes).filter(|_| !is_object)?;
    let import =
        "romc import (in Python Model.from_arrays, from_torch or from_pysindy) makes one of";
    let remedy = match (found.is_packed, found.remedy.as_str()) {
        (true, line) => line.to_owned(),
        (false, "") => format!("{import} it"),
        (false, lines) => format!("{import} {lines}"),
    };
    let expected = format!("a model file of romc: {remedy}");
    Some(ArtifactError::at(file, Place::Whole, found.what, expected))
}

/// Looks at the schema first: for a file of a later version it is the fault, not unknown keys.
fn check_schema(file: &str, bytes: &[u8]) -> Result<()> {
    if bytes.trim_ascii_start().first() == Some(&b'[') {
        // serde would accept an array as an object whose keys are left out.
        let place = Place::Key(".".into(), 1, 1);
        return Err(ArtifactError::at(file, place, "an array", "an object"));
    }
    let Ok(probe) = parse::<SchemaProbe>(file, bytes) else {
        // No JSON at all: reading the whole grammar finds the same fault, with its position.
        return Ok(());
    };
    let found: String = match probe.schema {
        Some(Value::String(schema)) if SCHEMAS.contains(&&*schema) => return Ok(()),
        Some(other) => other.to_string().chars().take(80).collect(),
        None => "none".to_owned(),
    };
    let expected = format!("\"{SCHEMA}\", \"{SCHEMA_2}\" or \"{SCHEMA_3}\"");
    Err(ArtifactError::at(file, "`schema`", found, expected))
}
