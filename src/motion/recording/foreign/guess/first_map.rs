//! From the columns of a log to the text of its map.

use std::path::Path;

use super::super::assemble::assemble;
use super::super::elements::Quantity;
use super::super::log::Log;
use super::super::map::{ColumnMap, Name, TextFormat};
use super::super::mcap::read_mcap;
use super::super::text::read_text;
use crate::recording::error::{RecordingError, RecordingFault};
use crate::recording::reader::is_mcap;
use crate::robot::Robot;

use super::columns::{Clock, Group, clock, groups};
use super::write::Draft;

/// A first map of a log.
#[derive(Debug, Clone)]
pub struct Guess {
    /// The map, TOML with comments.
    pub text: String,
    /// Quantities that a recording needs and that were not found, by their tables.
    pub missing: Vec<&'static str>,
    /// What the map gives when the log is read by it: samples, or why it cannot be read.
    pub outcome: Result<usize, String>,
}

/// Guesses the map of a text or MCAP file.
///
/// # Errors
/// [`RecordingError`] for a file that is no table, or whose columns have no names.
pub fn guess(path: &Path, robot: &Robot) -> Result<Guess, RecordingError> {
    let logs = match is_mcap(path) {
        true => read_mcap(path)?,
        false => vec![read_text(path, String::new(), &TextFormat::default())?],
    };
    guess_of(path, &logs, robot)
}

/// Guesses the map of logs that are one recording.
pub(in crate::recording) fn guess_of(
    path: &Path,
    logs: &[Log],
    robot: &Robot,
) -> Result<Guess, RecordingError> {
    if logs.iter().all(|log| !log.is_named) {
        return Err(RecordingFault::Unnamed.of(path));
    }
    let groups = groups(logs);
    let clock = clock(logs, &groups);
    let map = Draft::of(logs, &groups, clock.as_ref(), robot);
    let missing: Vec<&'static str> = Quantity::ALL
        .into_iter()
        .filter(|quantity| quantity.is_required() && !map.has(*quantity))
        .map(Quantity::key)
        .collect();
    let text = map.text(path, &missing);
    let outcome = ColumnMap::parse("the guessed map", &text)
        .and_then(|map| assemble(path, logs, &map))
        .map(|made| made.recording.sample_count())
        .map_err(|error| error.to_string());
    Ok(Guess {
        text,
        missing,
        outcome,
    })
}

/// Values of a group in the units of the log, one row a column.
pub(super) fn raw(logs: &[Log], group: &Group) -> nalgebra::DMatrix<f64> {
    let log = &logs[group.log];
    nalgebra::DMatrix::from_fn(group.columns.len(), log.len(), |row, sample| {
        let value = log.columns[group.columns[row]].values[sample];
        if value.is_finite() { value } else { 0.0 }
    })
}

/// Times of a log in s.
pub(super) fn times_s(logs: &[Log], log: usize, clock: Option<&Clock>) -> Option<Vec<f64>> {
    let log = &logs[log];
    let clock = clock?;
    let (column, factor) = match log.clock {
        Some(column) => (column, 1.0),
        None => (log.column(&Name::Text(clock.name.clone()))?, clock.factor),
    };
    let channel = &log.columns[column];
    Some(match &channel.instants {
        Some(instants) => (instants.iter())
            .map(|instant| factor * instant.since(instants[0]))
            .collect(),
        None => channel.values.iter().map(|time| factor * time).collect(),
    })
}
