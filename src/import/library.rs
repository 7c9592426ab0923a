//! The candidate terms of imported coefficients.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use super::ImportError;
use super::options::standard_text;
use super::pysindy;
use super::run::{check_size, read_file};
use crate::model::{Library, LibraryChoice, LibraryOrder, StandardLibrary};

const MAX_TERMS_BYTES: u64 = 32 << 20;

pub(super) fn dim(choice: &LibraryChoice, latent_dim: usize) -> Option<usize> {
    match choice {
        LibraryChoice::Standard(standard) => standard.term_count(latent_dim),
        LibraryChoice::Terms(terms) => Some(terms.len()),
    }
}

/// The library at a latent dimension; a standard one in romc's order.
pub(super) fn build(
    file: &str,
    choice: &LibraryChoice,
    latent_dim: usize,
) -> Result<Library, ImportError> {
    let choice = match choice {
        LibraryChoice::Terms(terms) => LibraryChoice::Terms(
            pysindy::readable(terms, latent_dim)
                .map_err(|(found, expected)| ImportError::option("--library", found, expected))?,
        ),
        LibraryChoice::Standard(_) => choice.clone(),
    };
    Library::of(latent_dim, choice).map_err(|source| ImportError::unusable(file, source))
}

/// The order of a file's terms: as stated, or the only one that there is.
pub(super) fn order(
    standard: StandardLibrary,
    latent_dim: usize,
    stated: Option<LibraryOrder>,
) -> Result<LibraryOrder, ImportError> {
    let texts = |order: &LibraryOrder| standard.texts_in(*order, latent_dim);
    let orders: Result<Vec<Vec<String>>, _> = LibraryOrder::NAMED.iter().map(texts).collect();
    let orders = orders.map_err(|source| ImportError::unusable("", source))?;
    if let Some(stated) = stated {
        return Ok(stated);
    }
    let differs = |(a, b): (usize, usize)| {
        let mut rows = orders[a].iter().zip(&orders[b]);
        rows.position(|(a, b)| a != b)
    };
    let pairs = [(0, 1), (0, 2), (1, 2)].into_iter();
    let rows: BTreeSet<usize> = pairs.filter_map(differs).collect();
    if rows.is_empty() {
        return Ok(LibraryOrder::ROMC);
    }
    let choice = |(order, texts): (&LibraryOrder, &Vec<String>)| {
        let term = |row: &usize| format!("{} in row {}", texts[*row], row + 1);
        let terms: Vec<String> = rows.iter().map(term).collect();
        Some(format!(
            "--library-order {} ({})",
            order.name()?,
            terms.join(", ")
        ))
    };
    let choices = LibraryOrder::NAMED.iter().zip(&orders).filter_map(choice);
    let choices = choices.collect::<Vec<String>>().join(", ");
    let expected = format!("one of {choices}: the order of the rows of Xi, counted from 1");
    let found = format!("no order of the terms of {}", standard_text(standard));
    Err(ImportError::option("--library-order", found, expected))
}

/// The shorthands that have this many terms.
pub(super) fn standards_with(term_count: usize, latent_dim: usize) -> Vec<String> {
    let fits = |standard: &StandardLibrary| standard.term_count(latent_dim) == Some(term_count);
    let fitting = StandardLibrary::small().filter(fits);
    fitting.map(standard_text).collect()
}

/// Reads a list of terms: a JSON list of texts, a JSON object with such a list under `library`, or one term per line
/// (`#` starts a comment).
///
/// # Errors
/// [`ImportError`] with line and column.
pub fn read_terms(path: &Path) -> Result<Vec<String>, ImportError> {
    let (file, bytes) = read_file(path, MAX_TERMS_BYTES)?;
    check_size(&file, &bytes, MAX_TERMS_BYTES)?;
    parse_terms(&file, &String::from_utf8_lossy(&bytes))
}

fn parse_terms(file: &str, text: &str) -> Result<Vec<String>, ImportError> {
    let text = text.trim_start_matches('\u{feff}');
    let refused = |place: (usize, usize), found: &str, expected: &str| {
        ImportError::at(file, place, found, expected)
    };
    if !text.trim_start().starts_with(['[', '{']) {
        let lines = (text.lines()).map(|line| line.split('#').next().unwrap_or("").trim());
        let lines = lines.filter(|line| !line.is_empty());
        let terms: Vec<String> = lines.map(str::to_owned).collect();
        return match terms.is_empty() {
            true => Err(refused((1, 1), "no term", "one term per line")),
            false => Ok(terms),
        };
    }
    let value: Value = serde_json::from_str(text).map_err(|error| {
        let expected = "a list of terms such as [\"1\", \"z1\", \"sin(z1)\"]";
        refused((error.line(), error.column()), "no JSON", expected)
    })?;
    let list = value.get("library").unwrap_or(&value);
    let expected = "a list of terms, or an object with such a list under `library`";
    let list = (list.as_array()).ok_or_else(|| refused((1, 1), kind_of(list), expected))?;
    let texts = list.iter().enumerate().map(|(index, term)| {
        let found = || format!("{} at [{index}]", kind_of(term));
        let text = term.as_str().map(str::to_owned);
        text.ok_or_else(|| refused((1, 1), &found(), "a term as text"))
    });
    texts.collect()
}

fn kind_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "true or false",
        Value::Number(_) => "a number",
        Value::String(_) => "a text",
        Value::Array(_) => "a list",
        Value::Object(_) => "an object",
    }
}
