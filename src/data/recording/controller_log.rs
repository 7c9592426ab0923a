//! Logs that generated controllers write (`NAME_log_write` of `--emit controller-c`): the columns of a recording without
//! accelerations, then those of the command. Numbers may be infinite or undefined, and times may stand still or go
//! back, as in the measurements that a controller refuses.

use super::error::Checked;
use super::lines::{Lines, MAX_ROWS, NumberReader, cells};
use super::*;
use crate::robot::JOINT_NAMES;

/// The quantity in a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogColumn {
    /// Of the measurement, or a torque of the command.
    Sample(Column),
    /// Code of the step's status.
    Status,
    /// Interior-point iterations.
    Iterations,
    /// Latent input, scaled.
    LatentInput(usize),
    /// Desired position of a joint, rad.
    Desired(usize),
}

impl LogColumn {
    /// Name in the header.
    pub fn name(self) -> String {
        match self {
            Self::Sample(column) => column.name(),
            Self::Status => "status".to_owned(),
            Self::Iterations => "iterations".to_owned(),
            Self::LatentInput(i) => format!("{LATENT_INPUT}{}", i + 1),
            Self::Desired(joint) => format!("{}.desired", JOINT_NAMES[joint]),
        }
    }

    /// The columns of a log, in the order of writing.
    pub fn all(latent_dim: usize) -> Vec<Self> {
        let samples = Column::all(false, false).into_iter().map(Self::Sample);
        let inputs = (0..latent_dim).map(Self::LatentInput);
        (samples
            .chain([Self::Status, Self::Iterations])
            .chain(inputs))
        .chain((0..JOINT_DIM).map(Self::Desired))
        .collect()
    }

    fn checked(self, cell: &str, value: Option<f64>) -> Checked<f64> {
        let (is_sound, expected): (fn(f64) -> bool, _) = match self {
            Self::Status | Self::Iterations => (|value| value.fract() == 0.0, "a whole number"),
            Self::Sample(Column::Foot(_)) => (|value| [0.0, 1.0].contains(&value), "0 or 1"),
            _ => (|_| true, "a number with a decimal point"),
        };
        let value = value.filter(|value| is_sound(*value));
        value.ok_or_else(|| RecordingFault::number(cell, expected))
    }
}

const LATENT_INPUT: &str = "u_lat_";

/// The last steps of a controller, oldest first.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerLog {
    columns: Vec<(LogColumn, Vec<f64>)>,
}

impl ControllerLog {
    /// Reads a log, plain or gzip; errors name row and column.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let mut lines = Lines::open(path)?;
        let Some((_, header)) = lines.next_row()? else {
            let expected = "the header of a log";
            return Err(unexpected("an empty file", expected).of(path));
        };
        let columns = arranged(path, header)?;
        let mut log = Self {
            columns: columns.into_iter().map(|c| (c, Vec::new())).collect(),
        };
        let mut numbers = NumberReader::new(',');
        while let Some((row, line)) = lines.next_row()? {
            if log.columns[0].1.len() == MAX_ROWS {
                let found = format!("more than {MAX_ROWS} steps");
                return Err(unexpected(found, "a shorter log").at(path, row));
            }
            log.push(line, &mut numbers)
                .map_err(|(column, fault)| fault.in_cell(path, row, &column.name()))?;
        }
        match log.is_empty() {
            true => Err(unexpected("a header alone", "at least one step").at(path, 1)),
            false => Ok(log),
        }
    }

    fn push(
        &mut self,
        line: &str,
        numbers: &mut NumberReader,
    ) -> Result<(), (LogColumn, RecordingFault)> {
        let (found, expected) = (cells(line, ',').count(), self.columns.len());
        if found != expected {
            let column = self.columns[found.min(expected - 1)].0;
            let (found, expected) = (format!("{found} cells"), expected.to_string());
            return Err((column, unexpected(found, expected)));
        }
        for ((column, values), cell) in self.columns.iter_mut().zip(cells(line, ',')) {
            let value = column.checked(cell, numbers.parse(cell));
            values.push(value.map_err(|fault| (*column, fault))?);
        }
        Ok(())
    }

    /// Number of steps.
    pub fn len(&self) -> usize {
        self.columns[0].1.len()
    }

    /// Whether there is no step.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The columns with their values.
    pub fn columns(&self) -> &[(LogColumn, Vec<f64>)] {
        &self.columns
    }

    /// Values of a column, one per step; none if the log does not have it.
    pub fn values(&self, column: LogColumn) -> &[f64] {
        let found = self.columns.iter().find(|(known, _)| *known == column);
        found.map_or(&[], |(_, values)| values)
    }
}

fn arranged(path: &Path, header: &str) -> Outcome<Vec<LogColumn>> {
    let names: Vec<&str> = cells(header, ',').collect();
    let is_input = |name: &&&str| name.starts_with(LATENT_INPUT);
    let columns = LogColumn::all(names.iter().filter(is_input).count());
    for (place, column) in columns.iter().enumerate() {
        let (found, name) = (names.get(place), column.name());
        if found.is_none_or(|found| *found != name) {
            let found = found.map_or("the end".to_owned(), |name| listed(&[(*name).into()], 1));
            let place = place + 1;
            let of_log =
                format!("`{name}` in column {place} of a log that `NAME_log_write` writes");
            return Err(unexpected(found, of_log).at(path, 1));
        }
    }
    match names.get(columns.len()) {
        None => Ok(columns),
        Some(name) => Err(RecordingFault::number(name, "the end of the header").at(path, 1)),
    }
}
