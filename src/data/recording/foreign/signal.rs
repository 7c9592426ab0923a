//! A log as it was read, which consists of named columns of numbers; and one quantity extracted from it, in SI units
//! and romc's order.

use super::map::{Factors, List, Name, Table};
use super::*;
use crate::recording::reader::folded;

#[derive(Debug, Clone)]
pub(super) struct Signal {
    pub values: DMatrix<f64>, // rows: elements in romc's order, a quaternion's four from w on; columns: samples
    pub times_s: Vec<f64>,
    pub first_row: usize,
}

pub(super) struct Source<'a> {
    map: &'a ColumnMap,
    quantity: Quantity,
    table: &'a Table,
    pub log: &'a Log,
}

impl<'a> Source<'a> {
    pub(crate) fn find(
        logs: &'a [Log],
        map: &'a ColumnMap,
        quantity: Quantity,
    ) -> Outcome<Option<Self>> {
        let Some(table) = map.table(quantity) else {
            return Ok(None);
        };
        let name = table.file.as_deref().unwrap_or_default();
        let named = |log: &&Log| log.name == name || (table.file.is_none() && logs.len() == 1);
        let columns = table.columns(&map.names, quantity);
        let has_all = |log: &&Log| columns.iter().all(|name| log.column(name).is_some());
        // A topic whose messages have several sets of names has several tables.
        let found = (logs.iter().filter(named).find(has_all)).or_else(|| logs.iter().find(named));
        let Some(log) = found else {
            let mut names: Vec<String> = logs.iter().map(|l| format!("`{}`", l.name)).collect();
            names.dedup();
            let expected = format!("one of {}", names.join(", "));
            let found = (table.file.as_ref()).map_or("nothing".to_owned(), |f| format!("`{f}`"));
            return Err(map.fault(&quantity.at("file"), found, expected));
        };
        if let Some(fault) = &log.fault {
            let found = format!("`{name}`, which cannot be read ({fault})");
            return Err(map.fault(&quantity.at("topic"), found, "a topic of numbers"));
        }
        let source = Self {
            map,
            quantity,
            table,
            log,
        };
        Ok(Some(source))
    }

    /// The quantity, its times in s from `epoch_s`, the whole seconds that all clocks count from.
    pub(crate) fn take(&self, epoch_s: i64) -> Outcome<Signal> {
        let columns = self.columns()?;
        let elements = match self.is_quaternion(columns.len()) {
            true => &QUATERNION,
            false => self.quantity.elements(),
        };
        let order = self.order(elements, columns.len())?;
        let unit = self.table.unit.as_ref();
        let factor = self.factor(&self.quantity.at("unit"), self.quantity.dimension(), unit)?;
        let signs = self.numbers(&self.table.sign, "sign", elements, &order, 1.0)?;
        let offsets = self.numbers(&self.table.offset, "offset", elements, &order, 0.0)?;
        if let Some(wrong) = signs.iter().find(|sign| sign.abs() != 1.0) {
            return Err(self.fault("sign", wrong.to_string(), "1 or -1"));
        }
        let times = self.times()?;
        let used: Vec<usize> = columns.iter().copied().chain(times.column).collect();
        let kept = self.kept(&used)?;
        let mut values = DMatrix::zeros(elements.len(), kept.len());
        for (place, &column) in columns.iter().enumerate() {
            let (scale, offset) = (signs[place] * factor, offsets[place]);
            let raw = &self.log.columns[column].values;
            for (sample, &row) in kept.iter().enumerate() {
                values[(order[place], sample)] = scale * raw[row] + offset;
            }
        }
        Ok(Signal {
            values,
            times_s: kept.iter().map(|row| times.at(*row, epoch_s)).collect(),
            first_row: self.log.first_row,
        })
    }

    /// First instant of the clock where that counts from an epoch, in whole seconds.
    pub(crate) fn epoch_s(&self) -> Outcome<Option<i64>> {
        let times = self.times()?;
        let instants = times.channel.and_then(|channel| channel.instants.as_ref());
        let first = instants.and_then(|instants| instants.first());
        Ok(first.map(|instant| instant.whole.div_euclid(times.per_second)))
    }

    fn fault(&self, key: &str, found: String, expected: impl Into<String>) -> RecordingError {
        self.map.fault(&self.quantity.at(key), found, expected)
    }

    fn is_quaternion(&self, columns: usize) -> bool {
        self.quantity == Quantity::Orientation && columns == QUATERNION.len()
    }

    fn columns(&self) -> Outcome<Vec<usize>> {
        let names = self.table.columns(&self.map.names, self.quantity);
        let key = self.quantity.at("columns");
        let columns = names.iter().map(|name| self.column(&key, name));
        let columns = columns.collect::<Outcome<Vec<_>>>()?;
        let expected = match self.quantity.elements().len() {
            count if columns.len() == count || self.is_quaternion(columns.len()) => {
                return Ok(columns);
            }
            _ if self.quantity == Quantity::Orientation => "3 (angles) or 4 (a quaternion)".into(),
            count => count.to_string(),
        };
        Err(self.fault("columns", format!("{} columns", columns.len()), expected))
    }

    fn column(&self, key: &str, name: &Name) -> Outcome<usize> {
        let log = self.log;
        log.column(name).ok_or_else(|| {
            let found = match name {
                Name::Number(number) => format!("column {number}"),
                Name::Text(text) => format!("`{text}`"),
            };
            let place = match (log.name.is_empty(), log.path.display()) {
                (true, path) => path.to_string(),
                (false, path) => format!("`{}` ({path})", log.name),
            };
            let expected = format!("a column of {place}, which has {}", log.summary());
            self.map.fault(key, found, expected)
        })
    }

    fn order(&self, elements: &[&str], columns: usize) -> Outcome<Vec<usize>> {
        let words: Vec<&str> = match &self.table.order {
            None if self.is_quaternion(columns) => {
                let found = "a quaternion without order".to_owned();
                return Err(self.fault("order", found, "`wxyz` or `xyzw`"));
            }
            None => return Ok((0..columns).collect()),
            Some(List::One(text)) => text.split_whitespace().collect(),
            Some(List::Many(words)) => words.iter().map(String::as_str).collect(),
        };
        let found = match ordered(&words, elements) {
            Ok(order) if order.len() == columns => return Ok(order),
            Ok(order) => format!("{} names", order.len()),
            Err(found) => found,
        };
        let expected = format!("each of {} once", elements.join(" "));
        Err(self.fault("order", found, expected))
    }

    fn factor(&self, key: &str, dimension: Dimension, unit: Option<&String>) -> Outcome<f64> {
        let Some(unit) = unit else { return Ok(1.0) };
        let expected = || format!("one of {}", dimension.names());
        let refused = || self.map.fault(key, format!("`{unit}`"), expected());
        dimension.factor(unit).ok_or_else(refused)
    }

    fn numbers(
        &self,
        factors: &Option<Factors>,
        key: &str,
        elements: &[&str],
        order: &[usize],
        default: f64,
    ) -> Outcome<Vec<f64>> {
        let count = order.len();
        let named_values = match factors {
            None => return Ok(vec![default; count]),
            Some(Factors::All(value)) => return Ok(vec![*value; count]),
            Some(Factors::Each(values)) if values.len() == count => return Ok(values.clone()),
            Some(Factors::Each(values)) => {
                let found = format!("{} numbers", values.len());
                return Err(self.fault(key, found, count.to_string()));
            }
            Some(Factors::Named(named_values)) => named_values,
        };
        let mut of_element = vec![default; elements.len()];
        for (word, value) in named_values {
            let found = named(word, elements);
            if found.is_empty() {
                let expected = format!("one of {}", elements.join(" "));
                return Err(self.fault(key, format!("`{word}`"), expected));
            }
            for element in found {
                of_element[element] = *value;
            }
        }
        Ok(order.iter().map(|element| of_element[*element]).collect())
    }

    /// The samples of these columns: all, or those without blanks where the map allows blanks; each a number.
    fn kept(&self, columns: &[usize]) -> Outcome<Vec<usize>> {
        let log = self.log;
        let is_blank =
            |row: &usize| (columns.iter()).any(|at| log.columns[*at].values[*row].is_nan());
        let mut kept = Vec::from_iter(0..log.len());
        kept.retain(|row| !self.map.text.blank || !is_blank(row));
        for &column in columns {
            let channel = &log.columns[column];
            let fault = match kept.iter().find(|row| !channel.values[**row].is_finite()) {
                Some(&row) => {
                    let found = match &channel.refused {
                        Some((sample, text)) if *sample == row => text,
                        _ => &channel.values[row].to_string(),
                    };
                    let expected = "a finite number (for cells left empty on purpose: `blank = true` in `[text]`)";
                    (row, RecordingFault::number(found, expected))
                }
                None if kept.is_empty() => (0, RecordingFault::header_only(log.columns.len())),
                None => continue,
            };
            let name = match channel.name.is_empty() {
                true => &(column + 1).to_string(),
                false => &channel.name,
            };
            return Err(fault.1.in_cell(&log.path, log.first_row + fault.0, name));
        }
        Ok(kept)
    }

    fn times(&self) -> Outcome<Times<'a>> {
        let (time, table) = (&self.map.time, self.table);
        let (key, name, own_unit) = match &table.time {
            Some(name) => (self.quantity.at("time"), Some(name), &table.time_unit),
            None => ("time.column".to_owned(), time.column.as_ref(), &None),
        };
        let (column, step_s) = match (name, self.log.clock, time.sample_time_s) {
            (Some(name), _, _) => (Some(self.column(&key, name)?), 1.0),
            (None, _, Some(step_s)) => (None, step_s),
            (None, Some(clock), None) => (Some(clock), 1.0),
            (None, None, None) => {
                let expected = "a column, or `sample_time_s`";
                return Err(self.map.fault("time", "no clock", expected));
            }
        };
        let unit = own_unit.as_ref().or(time.unit.as_ref());
        let unit = unit.filter(|_| name.is_some());
        let factor = self.factor("time.unit", Dimension::Time, unit)?;
        Ok(Times {
            column,
            channel: column.map(|column| &self.log.columns[column]),
            factor: factor * step_s,
            per_second: (1.0 / factor).round().max(1.0) as i64,
            offset_s: table.time_offset_s,
        })
    }
}

struct Times<'a> {
    column: Option<usize>,
    channel: Option<&'a Channel>,
    factor: f64, // seconds of one unit, or from sample to sample without a clock
    per_second: i64,
    offset_s: f64,
}

impl Times<'_> {
    fn at(&self, row: usize, epoch_s: i64) -> f64 {
        let instants = self.channel.and_then(|channel| channel.instants.as_ref());
        let time = match (instants, self.channel) {
            (Some(instants), _) => {
                let whole = epoch_s.saturating_mul(self.per_second);
                instants[row].since(Instant { whole, rest: 0.0 })
            }
            (None, Some(channel)) => channel.values[row],
            (None, None) => row as f64,
        };
        time * self.factor + self.offset_s
    }
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Log {
    pub path: PathBuf,
    pub name: String, // name of the file in a map, or of the topic; empty for the only file
    pub clock: Option<usize>, // column of the clock, in s, that every message of a topic has
    pub columns: Vec<Channel>,
    pub is_named: bool,
    pub first_row: usize, // line of the first sample, 1 for the first message of a topic
    pub fault: Option<String>, // why a topic is no table; it has no columns then
    pub notes: Vec<String>,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Channel {
    pub name: String,                     // its name; empty without a header
    pub values: Vec<f64>,                 // its values; NaN where a cell is empty or no number
    pub instants: Option<Vec<Instant>>, // the same as times, where the column holds times that one number does not hold
    pub refused: Option<(usize, String)>, // the first cell that is no number: its sample and text
}

impl Channel {
    pub(crate) fn named(name: &str) -> Self {
        let name = name.to_owned();
        let other = Self::default();
        Self { name, ..other }
    }

    /// Its values as times, from the first on where one number does not hold them.
    pub(crate) fn times(&self) -> Vec<f64> {
        match &self.instants {
            Some(all) => all.iter().map(|instant| instant.since(all[0])).collect(),
            None => self.values.clone(),
        }
    }
}

impl Log {
    pub(crate) fn names(&self) -> Vec<String> {
        let columns = self.columns.iter();
        columns.map(|channel| channel.name.clone()).collect()
    }

    pub(crate) fn len(&self) -> usize {
        (self.columns.first()).map_or(0, |channel| channel.values.len())
    }

    pub(crate) fn choose(&mut self, rows: &[usize]) {
        for column in &mut self.columns {
            column.values = rows.iter().map(|row| column.values[*row]).collect();
            if let Some(instants) = &mut column.instants {
                *instants = rows.iter().map(|row| instants[*row]).collect();
            }
        }
    }

    pub(crate) fn sort_by(&mut self, times: &[f64]) {
        let mut order = Vec::from_iter(0..times.len());
        order.sort_by(|one, other| times[*one].total_cmp(&times[*other]));
        self.choose(&order);
    }

    /// The column of a name or number: an exact name before one that differs in case and blanks.
    pub(crate) fn column(&self, name: &Name) -> Option<usize> {
        match name {
            Name::Number(number) => number.checked_sub(1).filter(|i| *i < self.columns.len()),
            Name::Text(text) => {
                let mut names = self.columns.iter().map(|channel| &channel.name);
                let exact = names.clone().position(|name| name == text);
                let wanted = folded(text);
                exact.or_else(|| names.position(|name| folded(name) == wanted))
            }
        }
    }

    pub(crate) fn summary(&self) -> String {
        const MOST: usize = 6;
        if !self.is_named {
            return format!("{} columns without names", self.columns.len());
        }
        let names = self.columns.iter().take(MOST);
        let names: Vec<String> = names.map(|channel| format!("`{}`", channel.name)).collect();
        match self.columns.len().checked_sub(MOST) {
            Some(more) if more > 0 => format!("{} and {more} more", names.join(", ")),
            _ => names.join(", "),
        }
    }
}
