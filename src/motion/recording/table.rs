//! Rows of a file become samples.

use std::path::Path;

use super::columns::{Column, Layout};
use super::error::{RecordingError, RecordingFault, shortened};
use super::instant::Instant;
use super::lines::{count, split_cells};
use super::number::{DecimalMark, NumberReader};
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
        let mark = match delimiter {
            ',' => DecimalMark::Point,
            _ => DecimalMark::Unknown,
        };
        Table {
            path,
            delimiter,
            layout,
            numbers: NumberReader::new(mark),
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
        let mut place = 0;
        split_cells(line, self.delimiter, |cell| {
            if let Some(column) = self.layout.columns[place] {
                let value = match (column, truth(cell)) {
                    (Column::Foot(_), Some(down)) => f64::from(u8::from(down)),
                    (Column::Time, _) => self.time(row, place, cell)?,
                    _ => self.number(row, place, cell)?,
                };
                match column {
                    Column::Time => sample.time_s = value,
                    Column::Position(i) => sample.x[i] = value,
                    Column::Velocity(i) => sample.dx[i] = value,
                    Column::Acceleration(i) => sample.ddx[i] = value,
                    Column::Torque(i) => sample.torque_nm[i] = value,
                    Column::Force(i) => sample.force[i] = value,
                    Column::Foot(i) => sample.feet[i] = self.flag(row, place, value)?,
                }
            }
            place += 1;
            Ok(())
        })?;
        Ok(sample)
    }

    fn count_cells(&self, line: &str) -> usize {
        if count(line, '"') == 0 {
            return 1 + count(line, self.delimiter);
        }
        let mut count = 0;
        let counted: Result<(), std::convert::Infallible> =
            split_cells(line, self.delimiter, |_| {
                count += 1;
                Ok(())
            });
        match counted {
            Ok(()) => count,
            Err(never) => match never {},
        }
    }

    fn number(&mut self, row: usize, place: usize, cell: &str) -> Result<f64, RecordingError> {
        let expected = match self.numbers.parse(cell) {
            Some(value) if value.is_finite() => return Ok(value),
            Some(_) => "a finite number",
            None => self.numbers.expected(),
        };
        let found = shortened(cell);
        let fault = RecordingFault::Number { found, expected };
        Err(fault.in_cell(self.path, row, &self.layout.names[place]))
    }

    /// A time in s; dates count from the first one.
    fn time(&mut self, row: usize, place: usize, cell: &str) -> Result<f64, RecordingError> {
        match Instant::from_iso(cell) {
            Some(date) => Ok(date.since(*self.start.get_or_insert(date))),
            None => self.number(row, place, cell),
        }
    }

    fn flag(&self, row: usize, place: usize, value: f64) -> Result<bool, RecordingError> {
        if value == 0.0 || value == 1.0 {
            return Ok(value == 1.0);
        }
        let column = &self.layout.names[place];
        Err(RecordingFault::Contact(value).in_cell(self.path, row, column))
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
