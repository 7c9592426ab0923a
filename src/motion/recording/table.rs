//! Rows of a file become samples.

use std::path::Path;

use super::columns::{Column, Layout};
use super::error::{RecordingError, RecordingFault, shortened};
use super::instant::Instant;
use super::lines::{cells, count};
use super::number::NumberReader;
use super::segment::Segment;
use super::segments::{Sample, SegmentBuilder};

/// Most samples read from a file: half an hour at 2 ms.
pub(super) const MAX_ROWS: usize = 1_000_000;

/// The rows read so far.
pub(super) struct Table<'a> {
    path: &'a Path,
    delimiter: char,
    layout: &'a Layout,
    numbers: NumberReader,
    rows: usize,
    /// The first date, where times are dates.
    start: Option<Instant>,
    segments: SegmentBuilder<'a>,
}

impl<'a> Table<'a> {
    pub fn new(path: &'a Path, delimiter: char, layout: &'a Layout) -> Self {
        Table {
            path,
            delimiter,
            layout,
            numbers: NumberReader::new(delimiter),
            rows: 0,
            start: None,
            segments: SegmentBuilder::new(path, layout.has_acceleration, layout.has_force),
        }
    }

    pub fn push(&mut self, row: usize, line: &str) -> Result<(), RecordingError> {
        if self.rows == MAX_ROWS {
            return Err(RecordingFault::TooManyRows(MAX_ROWS).at(self.path, row));
        }
        self.rows += 1;
        let sample = self.parse(row, line)?;
        self.segments.push(row, &sample)
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

    pub fn length_error(&self, row: usize, found: usize) -> RecordingError {
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

    pub fn finish(self) -> Result<Vec<Segment>, RecordingError> {
        self.segments.finish(self.layout.names.len())
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
