//! A first map for an unknown log: from the names of its columns, then checked and completed by its numbers.
//!
//! `names` says what a name means, `columns` sorts them into quantities; `evidence` compares positions with velocities
//! to find units, signs, axes and the order of a quaternion; `write` prints the map with what it rests on.

mod columns;
mod evidence;
mod names;
mod write;

use std::path::Path;

use self::write::map_text;
use super::assemble::assemble;
use super::log::Log;
use super::map::{ColumnMap, TextFormat};
use super::mcap::read_mcap;
use super::text::read_text;
use crate::recording::error::{RecordingError, RecordingFault};
use crate::recording::reader::is_mcap;
use crate::robot::Robot;

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
        false => vec![read_text(path, &TextFormat::default())?],
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
    let (text, missing) = map_text(path, logs, robot);
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
