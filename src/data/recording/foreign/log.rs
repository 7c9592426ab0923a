//! A log as it was read: named columns of numbers, before anyone says what they are.

use std::path::PathBuf;

use super::map::Name;
use crate::recording::columns::folded;
use crate::recording::instant::Instant;

/// One file or topic.
#[derive(Debug, Clone, Default)]
pub(in crate::recording) struct Log {
    pub path: PathBuf,
    /// Name of the file in a map, or of the topic; empty for the only file.
    pub name: String,
    /// Column of the clock, in s, that every message of a topic has.
    pub clock: Option<usize>,
    pub columns: Vec<Channel>,
    pub is_named: bool,
    pub first_row: usize, // line of the first sample, 1 for the first message of a topic
    pub fault: Option<String>, // why a topic is no table; it has no columns then
    pub notes: Vec<String>,
}

#[derive(Debug, Clone, Default)]
pub(in crate::recording) struct Channel {
    pub name: String,     // its name; empty without a header
    pub values: Vec<f64>, // its values; NaN where a cell is empty or no number
    /// The same as times, where the column holds times that one number does not hold.
    pub instants: Option<Vec<Instant>>,
    /// The first cell that is no number: its sample and text.
    pub refused: Option<(usize, String)>,
}

impl Channel {
    pub(crate) fn named(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            ..Self::default()
        }
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
        let names = self.columns.iter().map(|channel| channel.name.clone());
        names.collect()
    }

    /// Number of samples.
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

    /// Sorts the rows by these times of theirs; those of one time keep their order.
    pub(crate) fn sort_by(&mut self, times: &[f64]) {
        let mut order = Vec::from_iter(0..times.len());
        order.sort_by(|one, other| times[*one].total_cmp(&times[*other]));
        self.choose(&order);
    }

    /// The column of a name or number: an exact name before one that differs in case and blanks.
    pub(in crate::recording::foreign) fn column(&self, name: &Name) -> Option<usize> {
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
