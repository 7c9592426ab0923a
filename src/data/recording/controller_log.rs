//! Logs of generated controllers (`NAME_log_write` of `--emit controller-c`): the columns of a recording without
//! accelerations, then those of the command. Numbers may be infinite or undefined, and times may stand still or go
//! back, as in measurements that a controller refuses.

use super::foreign::{TextFormat, read_lines};
use super::lines::{Lines, cells};
use super::*;
use crate::robot::JOINT_NAMES;

const LATENT_INPUT: &str = "u_lat_";

/// The last steps of a controller, oldest first.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerLog {
    columns: Vec<(String, Vec<f64>)>,
}

impl ControllerLog {
    /// Names of the columns, in the order of writing.
    pub fn column_names(latent_dim: usize) -> Vec<String> {
        let samples = Column::all(false, false).into_iter().map(Column::name);
        let inputs = (1..=latent_dim).map(|input| format!("{LATENT_INPUT}{input}"));
        let desired = JOINT_NAMES.map(|joint| format!("{joint}.desired"));
        let of_step = ["status", "iterations"].map(str::to_owned);
        (samples.chain(of_step).chain(inputs).chain(desired)).collect()
    }

    /// Reads a log, plain or gzip; errors name row and column.
    pub fn read(path: &Path) -> Result<Self, RecordingError> {
        let mut first = Lines::open(path)?;
        let header = first.next_row()?.map_or("", |(_, line)| line);
        check_header(path, &cells(header, ',').collect::<Vec<_>>())?;
        let header = Some(true);
        let other = TextFormat::default();
        let log = read_lines(path, Lines::open(path)?, &TextFormat { header, ..other })?;
        for column in &log.columns {
            let (is_sound, expected): (fn(&f64) -> bool, _) = match &*column.name {
                "status" | "iterations" => (|value| value.fract() == 0.0, "a whole number"),
                name if name.ends_with(" Foot") => (|value| [0.0, 1.0].contains(value), "0 or 1"),
                _ => (|_| true, "a number"),
            };
            let refused = (column.refused.clone()).or_else(|| {
                let sample = column.values.iter().position(|value| !is_sound(value))?;
                Some((sample, column.values[sample].to_string()))
            });
            if let Some((sample, found)) = refused {
                let fault = RecordingFault::number(&found, expected);
                return Err(fault.in_cell(path, log.first_row + sample, &column.name));
            }
        }
        let columns = log.columns.into_iter();
        let columns = columns.map(|column| (column.name, column.values));
        Ok(Self {
            columns: columns.collect(),
        })
    }

    /// Values of a column, one per step; none if the log does not have it.
    pub fn values(&self, name: &str) -> &[f64] {
        let found = self.columns.iter().find(|(known, _)| known == name);
        found.map_or(&[], |(_, values)| values)
    }
}

fn check_header(path: &Path, names: &[&str]) -> Outcome<()> {
    let inputs = names.iter().filter(|name| name.starts_with(LATENT_INPUT));
    let expected = ControllerLog::column_names(inputs.count());
    for place in 0..expected.len().max(names.len()) {
        let (found, expected) = (names.get(place), expected.get(place));
        if found.copied() != expected.map(String::as_str) {
            let quoted = |name: Option<&str>| name.map_or("the end".into(), |n| format!("`{n}`"));
            let found = quoted(found.map(|name| error::shortened(name)).as_deref());
            let expected = quoted(expected.map(String::as_str));
            let place = place + 1;
            let of_log = format!("{expected} as column {place} of a log of `NAME_log_write`");
            return Err(unexpected(found, of_log).at(path, 1));
        }
    }
    Ok(())
}
