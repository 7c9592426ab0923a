//! romc's own format of recordings as text.
//!
//! `;` or tabs with decimal comma or point, or `,` with decimal point, found from the
//! header; columns by name in any order; gzip found from the first two bytes.
//! Memory is bounded by the samples kept: lines and rows have a limit.

use std::path::Path;

use super::columns::Column;
use super::error::RecordingError;
use super::foreign::{TextFormat, read_lines};
use super::lines::Lines;
use super::reader::Reading;
use super::segment::{Recording, Segment};
use super::segments::{DERIVED_DDX, divided};

/// Most samples read from a file: half an hour at 2 ms.
pub(super) const MAX_ROWS: usize = 1_000_000;

/// Reads a recording, plain or gzip.
///
/// # Errors
/// [`RecordingError`], which names file, row and column.
pub fn read(path: &Path) -> Result<Recording, RecordingError> {
    read_noted(path, Lines::open(path)?).map(|reading| reading.recording)
}

/// Reads a recording from memory; `name` stands for the file in messages.
///
/// # Errors
/// As [`read`]. No bytes make it panic.
pub fn read_from_bytes(name: &str, bytes: &[u8]) -> Result<Recording, RecordingError> {
    let path = Path::new(name);
    read_noted(path, Lines::of(path, bytes)?).map(|reading| reading.recording)
}

/// [`read`], with a note of what the file leaves to be derived.
pub(super) fn read_noted(path: &Path, lines: Lines<'_>) -> Result<Reading, RecordingError> {
    let format = TextFormat {
        own: true,
        ..TextFormat::default()
    };
    let log = read_lines(path, lines, &format)?;
    let columns = Column::arranged(path, &log.names())?;
    let mut time_s = Vec::new();
    let mut ignored_columns = Vec::new();
    for (column, channel) in columns.iter().zip(&log.columns) {
        match column {
            Some(Column::Time) => time_s = channel.times(),
            None if !channel.name.is_empty() => ignored_columns.push(channel.name.clone()),
            Some(_) | None => {}
        }
    }
    let mut whole = Segment {
        first_row: log.first_row,
        ..Segment::still(path, time_s)
    };
    let has_acceleration = columns.contains(&Some(Column::Acceleration(0)));
    for (column, channel) in columns.into_iter().zip(log.columns) {
        if let Some(column) = column {
            whole.set(column, channel.values.into_iter());
        }
    }
    let recording = Recording {
        path: path.to_owned(),
        segments: divided(whole, has_acceleration)?,
        ignored_columns,
    };
    let derived = (!has_acceleration).then(|| DERIVED_DDX.to_owned());
    Ok(Reading::as_recorded(
        recording,
        derived.into_iter().collect(),
    ))
}
