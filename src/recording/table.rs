//! Rows become samples, samples become segments.

use std::path::Path;

use nalgebra::DMatrix;

use super::columns::{Column, Layout};
use super::error::{RecordingError, RecordingFault, shortened};
use super::lines::{count, split_cells};
use super::number::{DecimalMark, NumberReader};
use super::preprocess::differences;
use super::segment::Segment;
use crate::robot::{BODY_DIM, ContactFlags, JOINT_DIM, STATE_DIM};

/// Most samples read from a file: half an hour at 2 ms.
pub(super) const MAX_ROWS: usize = 1_000_000;

/// A step this many times the one before it starts a new segment, as a jump
/// back does: samples were left out between the two.
const GAP_STEPS: f64 = 20.0;
/// Largest mean distance between samples: a jump lasts less than a second.
const LARGEST_STEP_S: f64 = 0.1;

/// One row, sorted by meaning.
#[derive(Default)]
struct Sample {
    time_s: f64,
    x: [f64; STATE_DIM],
    dx: [f64; STATE_DIM],
    ddx: [f64; STATE_DIM],
    torque_nm: [f64; JOINT_DIM],
    force: [f64; BODY_DIM],
    feet: ContactFlags,
}

/// The samples of a segment so far, each quantity sample after sample.
#[derive(Default)]
struct Open {
    first_row: usize,
    time_s: Vec<f64>,
    x: Vec<f64>,
    dx: Vec<f64>,
    ddx: Vec<f64>,
    torque_nm: Vec<f64>,
    force: Vec<f64>,
    feet: Vec<ContactFlags>,
}

/// The rows read so far.
pub(super) struct Table<'a> {
    path: &'a Path,
    delimiter: char,
    layout: &'a Layout,
    numbers: NumberReader,
    rows: usize,
    open: Open,
    segments: Vec<Segment>,
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
            open: Open::default(),
            segments: Vec::new(),
        }
    }

    pub fn push(&mut self, row: usize, line: &str) -> Result<(), RecordingError> {
        if self.rows == MAX_ROWS {
            return Err(RecordingFault::TooManyRows(MAX_ROWS).at(self.path, row));
        }
        self.rows += 1;
        let sample = self.parse(row, line)?;
        if self.starts_segment(row, sample.time_s)? {
            self.close()?;
        }
        if self.open.time_s.is_empty() {
            self.open.first_row = row;
        }
        self.open.time_s.push(sample.time_s);
        self.open.x.extend_from_slice(&sample.x);
        self.open.dx.extend_from_slice(&sample.dx);
        if self.layout.has_acceleration {
            self.open.ddx.extend_from_slice(&sample.ddx);
        }
        self.open.torque_nm.extend_from_slice(&sample.torque_nm);
        if self.layout.has_force {
            self.open.force.extend_from_slice(&sample.force);
        }
        self.open.feet.push(sample.feet);
        Ok(())
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
                let value = self.number(row, place, cell)?;
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

    /// Whether a time belongs to a new segment: it jumps back by more than a
    /// step or to where the segment began, or far ahead.
    fn starts_segment(&self, row: usize, time_s: f64) -> Result<bool, RecordingError> {
        let (first, last) = match self.open.time_s[..] {
            [] => return Ok(false),
            [first, .., last] => (first, last),
            [only] => (only, only),
        };
        let before = match self.open.time_s[..] {
            [.., a, b] => b - a,
            _ => f64::INFINITY,
        };
        let step = time_s - last;
        if step > 0.0 {
            return Ok(step > GAP_STEPS * before);
        }
        let jumps_back = step < 0.0 && (time_s <= first || -step > 1.5 * before);
        if jumps_back {
            return Ok(true);
        }
        let (found, previous) = (time_s, last);
        Err(RecordingFault::Time { found, previous }.in_cell(self.path, row, "Time"))
    }

    fn close(&mut self) -> Result<(), RecordingError> {
        let open = std::mem::take(&mut self.open);
        let n = open.time_s.len();
        if n < 2 {
            let (found, expected) = (n, 2);
            let fault = RecordingFault::TooShort { found, expected };
            return Err(fault.at(self.path, open.first_row));
        }
        let step_s = (open.time_s[n - 1] - open.time_s[0]) / (n - 1) as f64;
        if step_s > LARGEST_STEP_S {
            let (found, expected) = (step_s, LARGEST_STEP_S);
            let fault = RecordingFault::Sampling { found, expected };
            return Err(fault.in_cell(self.path, open.first_row, "Time"));
        }
        let dx = DMatrix::from_column_slice(STATE_DIM, n, &open.dx);
        let ddx = if self.layout.has_acceleration {
            DMatrix::from_column_slice(STATE_DIM, n, &open.ddx)
        } else {
            differences(&open.time_s, &dx)
        };
        self.require_finite(&open, &ddx)?;
        let has_force = self.layout.has_force;
        self.segments.push(Segment {
            path: self.path.to_owned(),
            first_row: open.first_row,
            row_stride: 1.0,
            time_s: open.time_s,
            x: DMatrix::from_vec(STATE_DIM, n, open.x),
            dx,
            ddx,
            torque_nm: DMatrix::from_vec(JOINT_DIM, n, open.torque_nm),
            feet: open.feet,
            body_wrench: has_force.then(|| DMatrix::from_vec(BODY_DIM, n, open.force)),
        });
        Ok(())
    }

    /// Differences of huge velocities over tiny steps can overflow.
    fn require_finite(&self, open: &Open, ddx: &DMatrix<f64>) -> Result<(), RecordingError> {
        match ddx.iter().position(|value| !value.is_finite()) {
            None => Ok(()),
            Some(place) => {
                let found = format!("{} from differences", ddx[place]);
                let expected = "a finite number";
                let row = open.first_row + place / STATE_DIM;
                let column = Column::Acceleration(place % STATE_DIM).name();
                let fault = RecordingFault::Number { found, expected };
                Err(fault.in_cell(self.path, row, &column))
            }
        }
    }

    pub fn finish(mut self) -> Result<Vec<Segment>, RecordingError> {
        if self.open.time_s.is_empty() {
            return Err(RecordingFault::HeaderOnly(self.layout.names.len()).of(self.path));
        }
        self.close()?;
        Ok(self.segments)
    }
}
