//! Reader of the recordings' CSV format.
//!
//! `;` or tabs with decimal comma or point, or `,` with decimal point, found from the
//! header; columns by name in any order; gzip found from the first two bytes.
//! Memory is bounded by the samples kept: lines and rows have a limit.

use std::path::Path;

use super::columns::{Column, Layout};
use super::error::{RecordingError, RecordingFault, shortened};
use super::instant::Instant;
use super::lines::{Lines, cells, count};
use super::number::NumberReader;
use super::reader::Reading;
use super::segment::Recording;
use super::segments::{DERIVED_DDX, Sample, SegmentBuilder};

/// Most samples read from a file: half an hour at 2 ms.
pub(super) const MAX_ROWS: usize = 1_000_000;

/// Reads a recording, plain or gzip.
///
/// # Errors
/// [`RecordingError`], which names file, row and column.
pub fn read(path: &Path) -> Result<Recording, RecordingError> {
    read_noted(path).map(|reading| reading.recording)
}

/// [`read`], with a note of what the file leaves to be derived.
///
/// # Errors
/// As [`read`].
pub(super) fn read_noted(path: &Path) -> Result<Reading, RecordingError> {
    read_lines(path, Lines::open(path)?)
}

/// Reads a recording from memory; `name` stands for the file in messages.
///
/// # Errors
/// As [`read`]. No bytes make it panic.
pub fn read_from_bytes(name: &str, bytes: &[u8]) -> Result<Recording, RecordingError> {
    let path = Path::new(name);
    read_lines(path, Lines::of(path, bytes)?).map(|reading| reading.recording)
}

fn read_lines(path: &Path, mut lines: Lines<'_>) -> Result<Reading, RecordingError> {
    let (delimiter, layout) = read_header(path, &mut lines)?;
    let mut table = Table {
        path,
        delimiter,
        numbers: NumberReader::new(delimiter),
        start: None,
        segments: SegmentBuilder::new(path, layout.has_acceleration, layout.has_force),
        layout: &layout,
    };
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
    let recording = Recording {
        path: path.to_owned(),
        segments: table.segments.finish(layout.names.len())?,
        ignored_columns: layout.ignored(),
    };
    let derived = (!layout.has_acceleration).then(|| DERIVED_DDX.to_owned());
    Ok(Reading::as_recorded(
        recording,
        derived.into_iter().collect(),
    ))
}

fn read_header(path: &Path, lines: &mut Lines<'_>) -> Result<(char, Layout), RecordingError> {
    let (row, line) = loop {
        match lines.next_row()? {
            None => return Err(RecordingFault::Empty.of(path)),
            Some((_, line)) if line.trim().is_empty() => {}
            Some(found) => break found,
        }
    };
    if row > 1 {
        let fault = RecordingFault::delimiter("", "`;`, a tab or `,` in a header");
        return Err(fault.at(path, row - 1));
    }
    let delimiter = ([';', '\t', ','].into_iter())
        .find(|mark| line.contains(*mark))
        .ok_or_else(|| RecordingFault::delimiter(line, "`;`, a tab or `,`").at(path, row))?;
    let names = cells(line, delimiter).map(str::to_owned).collect();
    Ok((delimiter, Layout::from_header(path, names)?))
}

/// The rows read so far.
struct Table<'a> {
    path: &'a Path,
    delimiter: char,
    layout: &'a Layout,
    numbers: NumberReader,
    /// The first date, where times are dates.
    start: Option<Instant>,
    segments: SegmentBuilder<'a>,
}

impl Table<'_> {
    fn push(&mut self, row: usize, line: &str) -> Result<(), RecordingError> {
        // The header is the first row, and none is blank.
        if row > MAX_ROWS + 1 {
            return Err(RecordingFault::TooManyRows(MAX_ROWS).at(self.path, row));
        }
        let sample = self.parse(row, line)?;
        self.segments.push(row, sample)
    }

    fn parse(&mut self, row: usize, line: &str) -> Result<Sample, RecordingError> {
        let expected = self.layout.columns.len();
        let found = self.count_cells(line);
        if found != expected {
            let other = if self.delimiter == ';' { ',' } else { ';' };
            if found == 1 && line.contains(other) {
                let expected = if self.delimiter == ';' { "`;`" } else { "`,`" };
                return Err(RecordingFault::delimiter(line, expected).at(self.path, row));
            }
            return Err(self.length_error(row, found));
        }
        let mut sample = Sample::default();
        for (place, cell) in cells(line, self.delimiter).enumerate() {
            let Some(column) = self.layout.columns[place] else {
                continue;
            };
            let name = &self.layout.names[place];
            let value = self.value(column, cell);
            sample.set(
                column,
                value.map_err(|fault| fault.in_cell(self.path, row, name))?,
            );
        }
        Ok(sample)
    }

    fn count_cells(&self, line: &str) -> usize {
        match count(line, '"') {
            0 => 1 + count(line, self.delimiter),
            _ => cells(line, self.delimiter).count(),
        }
    }

    /// A cell's value: a time in s, of which dates count from the first one; 0 or 1 of a foot; or a number.
    fn value(&mut self, column: Column, cell: &str) -> Result<f64, RecordingFault> {
        let is_foot = matches!(column, Column::Foot(_));
        if is_foot && let Some(down) = truth(cell) {
            return Ok(f64::from(u8::from(down)));
        }
        if column == Column::Time
            && let Some(date) = Instant::from_iso(cell)
        {
            return Ok(date.since(*self.start.get_or_insert(date)));
        }
        let expected = match self.numbers.parse(cell) {
            Some(value) if value.is_finite() => {
                return match is_foot && value != 0.0 && value != 1.0 {
                    true => Err(RecordingFault::Contact(value)),
                    false => Ok(value),
                };
            }
            Some(_) => "a finite number",
            None => self.numbers.expected(),
        };
        let found = shortened(cell);
        Err(RecordingFault::Number { found, expected })
    }

    fn length_error(&self, row: usize, found: usize) -> RecordingError {
        let names = &self.layout.names;
        let column = names.get(found).or(names.last()).map_or("", String::as_str);
        let fault = RecordingFault::RowLength {
            found,
            expected: names.len(),
            hint: match self.delimiter {
                ',' if found > names.len() => {
                    "; where numbers have decimal commas, cells are separated by `;`"
                }
                _ => "",
            },
        };
        fault.in_cell(self.path, row, column)
    }
}

/// `True` or `False` as programs write them.
fn truth(cell: &str) -> Option<bool> {
    match cell {
        "True" | "true" | "TRUE" => Some(true),
        "False" | "false" | "FALSE" => Some(false),
        _ => None,
    }
}
