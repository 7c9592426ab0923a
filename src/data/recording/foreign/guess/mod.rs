//! A first map for an unknown log: from the names of its columns, then checked and completed by its numbers.
//!
//! `names` says what a name means, `columns` sorts them into quantities; `scales` finds units, signs, axes and orders:
//! `evidence` compares positions with velocities, `physics` tries readings on the robot's geometry and weight, `feet`
//! divides forces; `write` prints the map with what it rests on.

mod columns;
mod feet;
mod names;
mod physics;
mod scales;
mod write;

use std::path::Path;

use super::assemble::assemble;
use super::map::{ColumnMap, TextFormat};
use super::mcap::{is_mcap, read_mcap};
use super::signal::Log;
use super::text::read_text;
use crate::recording::error::{RecordingError, RecordingFault};
use crate::robot::Robot;

const MOST_SKIPPED: usize = 20; // most lines before the header of a text
const LEAST_COLUMNS: usize = 3; // fewest columns of a table

/// A first map of a log.
#[derive(Debug, Clone)]
pub struct Guess {
    /// The map, TOML with comments.
    pub text: String,
    /// Quantities that a recording needs and that were not found, by their tables.
    pub missing: Vec<&'static str>,
    /// What the map gives when the log is read by it: samples, or why it cannot be read.
    pub outcome: Result<usize, String>,
    /// Where other readings of the log fit as well, or none fits.
    pub notes: Vec<String>,
    /// What names and numbers do not decide, for a log that is read without asking.
    pub(in crate::recording) open: Vec<String>,
}

/// Guesses the map of a text or MCAP file.
///
/// # Errors
/// [`RecordingError`] for a file that is no table, or whose columns have no names.
pub fn guess(path: &Path, robot: &Robot) -> Result<Guess, RecordingError> {
    if is_mcap(path) {
        return guess_of(path, &read_mcap(path)?, robot);
    }
    let mut format = TextFormat::default();
    let log = loop {
        match read_text(path, &format) {
            Ok(log) if format.skip == 0 || log.columns.len() >= LEAST_COLUMNS => break log,
            Err(error)
                if format.skip == 0 && !matches!(error.kind, RecordingFault::RowLength { .. }) =>
            {
                return Err(error);
            }
            // Lines before the header have other numbers of cells.
            Ok(_) | Err(_) if format.skip < MOST_SKIPPED => format.skip += 1,
            Ok(_) | Err(_) => break read_text(path, &TextFormat::default())?,
        }
    };
    let mut guess = guess_of(path, &[log], robot)?;
    if format.skip > 0 {
        let skip = format.skip;
        let skip = format!("[text]\nskip = {skip}   # lines before the header\n\n[time]\n");
        guess.text = guess.text.replacen("[time]\n", &skip, 1);
    }
    Ok(guess)
}

/// Guesses the map of logs that are one recording.
pub(in crate::recording) fn guess_of(
    path: &Path,
    logs: &[Log],
    robot: &Robot,
) -> Result<Guess, RecordingError> {
    if logs.iter().all(|log| !log.is_named) {
        let text =
            "found columns without names, of which no map can be guessed; a map counts them from 1";
        return Err(RecordingFault::Text(text.to_owned()).of(path));
    }
    let mut guess = write::guessed(path, logs, robot);
    guess.outcome = ColumnMap::parse("the guessed map", &guess.text)
        .and_then(|map| assemble(path, logs, &map))
        .map(|made| made.recording.sample_count())
        .map_err(|error| error.to_string());
    Ok(guess)
}
