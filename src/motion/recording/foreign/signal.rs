//! One quantity taken from a log: its values in SI units and romc's order, and their times.

use nalgebra::DMatrix;

use super::elements::{QUATERNION, Quantity, named, ordered};
use super::log::{Channel, Log};
use super::map::{ColumnMap, Factors, Name, Table, Words};
use super::units::Dimension;
use crate::recording::error::{RecordingError, RecordingFault};
use crate::recording::instant::Instant;

/// A quantity with the clock that it was logged by.
#[derive(Debug, Clone)]
pub(super) struct Signal {
    /// One row an element in romc's order, one column a sample; a quaternion has four rows, w first.
    pub values: DMatrix<f64>,
    /// Times of the samples, in s.
    pub times_s: Vec<f64>,
    /// Line of the first sample.
    pub first_row: usize,
}

/// Takes quantities out of logs as a map says.
pub(super) struct Taker<'a> {
    pub logs: &'a [Log],
    pub map: &'a ColumnMap,
    /// Whole seconds that all clocks count from.
    pub epoch_s: i64,
}

impl<'a> Taker<'a> {
    /// A quantity of the map; `None` if the map does not have it.
    pub fn take(&self, quantity: Quantity) -> Result<Option<Signal>, RecordingError> {
        let Some(table) = self.map.table(quantity) else {
            return Ok(None);
        };
        let log = self.log(table, quantity)?;
        let columns = self.columns(table, quantity, log)?;
        let elements = elements_of(quantity, columns.len());
        let order = self.order(table, quantity, &elements, columns.len())?;
        let factor = self.unit(table, quantity)?;
        let signs = self.numbers(&table.sign, quantity, "sign", &elements, &order, 1.0)?;
        let offsets = self.numbers(&table.offset, quantity, "offset", &elements, &order, 0.0)?;
        if let Some(wrong) = signs.iter().find(|sign| sign.abs() != 1.0) {
            let key = format!("{}.sign", quantity.key());
            return Err(self
                .map
                .fault(&key, wrong.to_string(), "1 or -1".to_owned()));
        }
        let times = self.times(table, quantity, log)?;
        let kept = self.kept(log, &columns, times.column);
        for column in columns.iter().copied().chain(times.column) {
            self.require_numbers(log, column, &kept)?;
        }
        let mut values = DMatrix::zeros(elements.len(), kept.len());
        for (place, &column) in columns.iter().enumerate() {
            let (scale, offset) = (signs[place] * factor, offsets[place]);
            let raw = &log.columns[column].values;
            for (sample, &row) in kept.iter().enumerate() {
                values[(order[place], sample)] = scale * raw[row] + offset;
            }
        }
        Ok(Some(Signal {
            values,
            times_s: kept.iter().map(|row| times.at(*row)).collect(),
            first_row: log.first_row,
        }))
    }

    /// First instant of a quantity's clock where that counts from an epoch, in whole seconds.
    pub fn epoch_of(&self, quantity: Quantity) -> Result<Option<i64>, RecordingError> {
        let Some(table) = self.map.table(quantity) else {
            return Ok(None);
        };
        let log = self.log(table, quantity)?;
        let times = self.times(table, quantity, log)?;
        let first = times.instants.and_then(|instants| instants.first());
        Ok(first.map(|instant| instant.whole.div_euclid(times.per_second)))
    }

    /// The file or topic of a table.
    pub fn log(&self, table: &Table, quantity: Quantity) -> Result<&'a Log, RecordingError> {
        let found = match &table.file {
            Some(name) => self.logs.iter().find(|log| log.name == *name),
            None if self.logs.len() == 1 => self.logs.first(),
            None => self.logs.iter().find(|log| log.name.is_empty()),
        };
        found.ok_or_else(|| {
            let names: Vec<String> = self.logs.iter().map(|l| format!("`{}`", l.name)).collect();
            let expected = format!("one of {}", names.join(", "));
            let found = (table.file.as_ref()).map_or("nothing".to_owned(), |f| format!("`{f}`"));
            self.map
                .fault(&format!("{}.file", quantity.key()), found, expected)
        })
    }

    fn columns(
        &self,
        table: &Table,
        quantity: Quantity,
        log: &Log,
    ) -> Result<Vec<usize>, RecordingError> {
        let names = table.columns(&self.map.names, quantity);
        let key = format!("{}.columns", quantity.key());
        let mut out = Vec::new();
        for name in &names {
            out.push(self.column(&key, name, log)?);
        }
        let expected = quantity.elements().len();
        let fits = match quantity {
            Quantity::Orientation => [expected, QUATERNION.len()].contains(&out.len()),
            _ => out.len() == expected,
        };
        if !fits {
            let found = format!("{} columns", out.len());
            let expected = match quantity {
                Quantity::Orientation => "3 (angles) or 4 (a quaternion)".to_owned(),
                _ => expected.to_string(),
            };
            return Err(self.map.fault(&key, found, expected));
        }
        Ok(out)
    }

    fn column(&self, key: &str, name: &Name, log: &Log) -> Result<usize, RecordingError> {
        log.column(name).ok_or_else(|| {
            let found = match name {
                Name::Number(number) => format!("column {number}"),
                Name::Text(text) => format!("`{text}`"),
            };
            let place = log.path.display();
            let expected = match log.name.is_empty() {
                true => format!("a column of {place}, which has {}", log.summary()),
                false => format!(
                    "a column of `{}` ({place}), which has {}",
                    log.name,
                    log.summary()
                ),
            };
            self.map.fault(key, found, expected)
        })
    }

    /// For each column the element that it is.
    fn order(
        &self,
        table: &Table,
        quantity: Quantity,
        elements: &[String],
        columns: usize,
    ) -> Result<Vec<usize>, RecordingError> {
        let key = format!("{}.order", quantity.key());
        let Some(words) = &table.order else {
            if quantity == Quantity::Orientation && columns == QUATERNION.len() {
                let found = "a quaternion without order".to_owned();
                return Err(self.map.fault(&key, found, "`wxyz` or `xyzw`".to_owned()));
            }
            return Ok((0..columns).collect());
        };
        let words: Vec<String> = match words {
            Words::One(text) => text.split_whitespace().map(str::to_owned).collect(),
            Words::Many(words) => words.clone(),
        };
        let fault = |found| {
            let expected = format!("each of {} once", elements.join(" "));
            self.map.fault(&key, found, expected)
        };
        let order = ordered(&words, elements).map_err(fault)?;
        match order.len() == columns {
            true => Ok(order),
            false => Err(fault(format!("{} names", order.len()))),
        }
    }

    fn unit(&self, table: &Table, quantity: Quantity) -> Result<f64, RecordingError> {
        let Some(unit) = &table.unit else {
            return Ok(1.0);
        };
        let dimension = quantity.dimension();
        dimension.factor(unit).ok_or_else(|| {
            let expected = format!("one of {}", dimension.names());
            self.map.fault(
                &format!("{}.unit", quantity.key()),
                format!("`{unit}`"),
                expected,
            )
        })
    }

    /// A number for each column.
    fn numbers(
        &self,
        factors: &Option<Factors>,
        quantity: Quantity,
        key: &str,
        elements: &[String],
        order: &[usize],
        default: f64,
    ) -> Result<Vec<f64>, RecordingError> {
        let fault = |found, expected| {
            let key = format!("{}.{key}", quantity.key());
            Err(self.map.fault(&key, found, expected))
        };
        match factors {
            None => Ok(vec![default; order.len()]),
            Some(Factors::All(value)) => Ok(vec![*value; order.len()]),
            Some(Factors::Each(values)) if values.len() == order.len() => Ok(values.clone()),
            Some(Factors::Each(values)) => {
                fault(format!("{} numbers", values.len()), order.len().to_string())
            }
            Some(Factors::Named(named_values)) => {
                let mut of_element = vec![default; elements.len()];
                for (word, value) in named_values {
                    let found = named(word, elements);
                    if found.is_empty() {
                        return fault(
                            format!("`{word}`"),
                            format!("one of {}", elements.join(" ")),
                        );
                    }
                    found
                        .into_iter()
                        .for_each(|element| of_element[element] = *value);
                }
                Ok(order.iter().map(|element| of_element[*element]).collect())
            }
        }
    }

    /// The samples that a quantity has: all, or those without blanks where the map allows blanks.
    fn kept(&self, log: &Log, columns: &[usize], time: Option<usize>) -> Vec<usize> {
        let blank = |row: usize| {
            let mut used = columns.iter().copied().chain(time);
            used.any(|column| log.columns[column].values[row].is_nan())
        };
        (0..log.len())
            .filter(|row| !self.map.text.blank || !blank(*row))
            .collect()
    }

    fn require_numbers(
        &self,
        log: &Log,
        column: usize,
        kept: &[usize],
    ) -> Result<(), RecordingError> {
        let channel: &Channel = &log.columns[column];
        let name = match channel.name.is_empty() {
            true => (column + 1).to_string(),
            false => channel.name.clone(),
        };
        if kept.is_empty() {
            let fault = RecordingFault::HeaderOnly(log.columns.len());
            return Err(fault.in_cell(&log.path, log.first_row, &name));
        }
        let wrong = kept.iter().find(|row| !channel.values[**row].is_finite());
        let Some(&row) = wrong else { return Ok(()) };
        let found = match &channel.refused {
            Some((sample, text)) if *sample == row => text.clone(),
            Some(_) | None => channel.values[row].to_string(),
        };
        let expected =
            "a finite number (for cells left empty on purpose: `blank = true` in `[text]`)";
        let fault = RecordingFault::Number { found, expected };
        Err(fault.in_cell(&log.path, log.first_row + row, &name))
    }

    fn times<'b>(
        &self,
        table: &Table,
        quantity: Quantity,
        log: &'b Log,
    ) -> Result<Times<'b>, RecordingError> {
        let time = &self.map.time;
        let (key, name, unit) = match &table.time {
            Some(name) => {
                let key = format!("{}.time", quantity.key());
                (
                    key,
                    Some(name),
                    table.time_unit.as_ref().or(time.unit.as_ref()),
                )
            }
            None => (
                "time.column".to_owned(),
                time.column.as_ref(),
                time.unit.as_ref(),
            ),
        };
        let offset_s = table.time_offset_s;
        let (column, step_s) = match (name, log.clock, time.sample_time_s) {
            (Some(name), _, _) => (Some(self.column(&key, name, log)?), 1.0),
            (None, _, Some(step_s)) => (None, step_s),
            (None, Some(clock), None) => (Some(clock), 1.0),
            (None, None, None) => {
                let expected = "a column, or `sample_time_s`".to_owned();
                return Err(self.map.fault("time", "no clock".to_owned(), expected));
            }
        };
        let is_text_clock = name.is_some();
        let factor = match unit.filter(|_| is_text_clock) {
            None => 1.0,
            Some(unit) => Dimension::Time.factor(unit).ok_or_else(|| {
                let expected = format!("one of {}", Dimension::Time.names());
                self.map.fault("time.unit", format!("`{unit}`"), expected)
            })?,
        };
        let channel = column.map(|column| &log.columns[column]);
        Ok(Times {
            column,
            values: channel.map(|channel| &channel.values[..]),
            instants: channel.and_then(|channel| channel.instants.as_deref()),
            factor: factor * step_s,
            per_second: (1.0 / factor).round().max(1.0) as i64,
            epoch_s: self.epoch_s,
            offset_s,
        })
    }
}

/// Elements of a quantity that stands in so many columns.
fn elements_of(quantity: Quantity, columns: usize) -> Vec<String> {
    if quantity == Quantity::Orientation && columns == QUATERNION.len() {
        return QUATERNION.map(str::to_owned).to_vec();
    }
    quantity.elements()
}

/// The clock of a log.
struct Times<'a> {
    column: Option<usize>,
    values: Option<&'a [f64]>,
    instants: Option<&'a [Instant]>,
    /// Seconds of one unit, or from sample to sample without a clock.
    factor: f64,
    per_second: i64,
    epoch_s: i64,
    offset_s: f64,
}

impl Times<'_> {
    /// Time of a row, in s from the common epoch.
    fn at(&self, row: usize) -> f64 {
        let time = match (self.instants, self.values) {
            (Some(instants), _) => {
                let whole = self.epoch_s.saturating_mul(self.per_second);
                instants[row].since(Instant { whole, rest: 0.0 })
            }
            (None, Some(values)) => values[row],
            (None, None) => row as f64,
        };
        time * self.factor + self.offset_s
    }
}
