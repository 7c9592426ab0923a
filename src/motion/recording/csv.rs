//! Reader of the recordings' CSV format.
//!
//! `;` or tabs with decimal comma or point, or `,` with decimal point, found from the
//! header; columns by name in any order; gzip found from the first two bytes.
//! Memory is bounded by the samples kept: lines and rows have a limit.

use std::path::Path;

use super::columns::Layout;
use super::error::{RecordingError, RecordingFault};
use super::foreign::Assembled;
use super::lines::{Lines, cells};
use super::segment::Recording;
use super::segments::DERIVED_DDX;
use super::table::Table;

/// Reads a recording, plain or gzip.
///
/// # Errors
/// [`RecordingError`], which names file, row and column.
pub fn read(path: &Path) -> Result<Recording, RecordingError> {
    read_noted(path).map(|assembled| assembled.recording)
}

/// [`read`], with a note of what the file leaves to be derived.
///
/// # Errors
/// As [`read`].
pub(super) fn read_noted(path: &Path) -> Result<Assembled, RecordingError> {
    read_lines(path, Lines::open(path)?)
}

/// Reads a recording from memory; `name` stands for the file in messages.
///
/// # Errors
/// As [`read`]. No bytes make it panic.
pub fn read_from_bytes(name: &str, bytes: &[u8]) -> Result<Recording, RecordingError> {
    let path = Path::new(name);
    read_lines(path, Lines::of(path, bytes)?).map(|assembled| assembled.recording)
}

fn read_lines(path: &Path, mut lines: Lines<'_>) -> Result<Assembled, RecordingError> {
    let (delimiter, layout) = read_header(path, &mut lines)?;
    let mut table = Table::new(path, delimiter, &layout);
    let mut blank = None;
    while let Some((row, line)) = lines.next_row()? {
        if line.trim().is_empty() {
            blank.get_or_insert(row);
            continue;
        }
        // Blank lines may end a file, but not divide it.
        if let Some(row) = blank {
            return Err(table.length_error(row, 0));
        }
        table.push(row, line)?;
    }
    let derived = (!layout.has_acceleration).then(|| DERIVED_DDX.to_owned());
    Ok(Assembled {
        recording: Recording {
            path: path.to_owned(),
            segments: table.finish()?,
            ignored_columns: layout.ignored(),
        },
        notes: derived.into_iter().collect(),
    })
}

fn read_header(path: &Path, lines: &mut Lines<'_>) -> Result<(char, Layout), RecordingError> {
    let Some((row, line)) = lines.next_row()? else {
        return Err(RecordingFault::Empty.of(path));
    };
    if line.trim().is_empty() {
        while let Some((row, line)) = lines.next_row()? {
            if !line.trim().is_empty() {
                return Err(
                    RecordingFault::delimiter("", "`;`, a tab or `,` in a header")
                        .at(path, row - 1),
                );
            }
        }
        return Err(RecordingFault::Empty.of(path));
    }
    let delimiter = ([';', '\t', ','].into_iter())
        .find(|mark| line.contains(*mark))
        .ok_or_else(|| RecordingFault::delimiter(line, "`;`, a tab or `,`").at(path, row))?;
    let names = cells(line, delimiter).map(str::to_owned).collect();
    Ok((delimiter, Layout::from_header(path, names)?))
}
