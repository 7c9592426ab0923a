//! Reader of the recordings' CSV format.
//!
//! `;` or tabs with decimal comma or point, or `,` with decimal point, found from the
//! header; columns by name in any order; gzip found from the first two bytes.
//! Memory is bounded by the samples kept: lines and rows have a limit.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

use super::columns::Layout;
use super::error::{RecordingError, RecordingFault};
use super::foreign::Assembled;
use super::lines::{Lines, split_cells};
use super::segment::Recording;
use super::segments::DERIVED_DDX;
use super::table::Table;

pub(super) const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

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
    let file = File::open(path).map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => RecordingFault::Missing.of(path),
        _ => RecordingFault::io("open", source).of(path),
    })?;
    unpacked(path, file)
}

/// Reads a recording from memory; `name` stands for the file in messages.
///
/// # Errors
/// As [`read`]. No bytes make it panic.
pub fn read_from_bytes(name: &str, bytes: &[u8]) -> Result<Recording, RecordingError> {
    read_from(Path::new(name), bytes)
}

/// Reads a recording from any source; `path` stands for it in messages.
///
/// # Errors
/// As [`read`].
pub fn read_from(path: &Path, source: impl Read) -> Result<Recording, RecordingError> {
    unpacked(path, source).map(|assembled| assembled.recording)
}

fn unpacked(path: &Path, mut source: impl Read) -> Result<Assembled, RecordingError> {
    let mut start = Vec::with_capacity(2);
    (&mut source)
        .take(2)
        .read_to_end(&mut start)
        .map_err(|source| RecordingFault::io("read", source).of(path))?;
    let compressed = start == GZIP_MAGIC;
    let source = BufReader::new(io::Cursor::new(start).chain(source));
    if compressed {
        let unpacked = BufReader::new(MultiGzDecoder::new(source));
        read_lines(path, Lines::new(path, unpacked, true))
    } else {
        read_lines(path, Lines::new(path, source, false))
    }
}

fn read_lines<R: BufRead>(
    path: &Path,
    mut lines: Lines<'_, R>,
) -> Result<Assembled, RecordingError> {
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

fn read_header<R: BufRead>(
    path: &Path,
    lines: &mut Lines<'_, R>,
) -> Result<(char, Layout), RecordingError> {
    let (row, line) = match lines.next_row()? {
        None => return Err(RecordingFault::Empty.of(path)),
        Some(found) => found,
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
    let delimiter = if line.contains(';') {
        ';'
    } else if line.contains('\t') {
        '\t'
    } else if line.contains(',') {
        ','
    } else {
        return Err(RecordingFault::delimiter(line, "`;`, a tab or `,`").at(path, row));
    };
    let mut names = Vec::new();
    split_cells::<RecordingError>(line, delimiter, |cell| {
        names.push(cell.to_owned());
        Ok(())
    })?;
    Ok((delimiter, Layout::from_header(path, names)?))
}
