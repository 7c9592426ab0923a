//! The guessed map as text, each line with what it rests on.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::DMatrix;

use super::super::elements::{Dimension, Quantity};
use super::super::map::{Frame, Name};
use super::super::signal::Log;
use super::Guess;
use super::columns::{Clock, Group, clock, groups};
use super::names::unit;
use super::physics::{scale, slopes};
use super::scales::{Scales, order_line};
use crate::robot::Robot;

pub(super) type Lines = BTreeMap<Quantity, Vec<String>>;

/// The guessed map of logs; what reading by it gives is not known yet.
pub(super) fn guessed(path: &Path, logs: &[Log], robot: &Robot) -> Guess {
    let groups = groups(logs, robot);
    let clock = clock(logs, &groups);
    let source = Source {
        path,
        logs,
        groups: &groups,
        clock: clock.as_ref(),
    };
    let time = source.time();
    let file = path
        .file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy();
    let mut text = format!(
        "# Guessed from {file}: check every line, then `romc inspect LOG --columns THIS.toml`.\n\n[time]\n{time}\n"
    );
    let Scales {
        lines: mut scales,
        order,
        mut notes,
    } = source.scales(robot, &time);
    let is_sound = |group: &&Group| source.is_sound(group, &scales);
    let sound: Vec<&Group> = groups.iter().filter(is_sound).collect();
    let mut open = Vec::new();
    for group in &sound {
        let key = group.quantity.key();
        let scales = scales.remove(&group.quantity).unwrap_or_default();
        let lines = source.lines(group, order, scales).join("\n");
        text.push_str(&format!("\n[{key}]\n{lines}\n"));
        if !group.others.is_empty() {
            let note = format!("{key}: by their names also {}", group.others.join(", "));
            open.extend(group.is_tie.then(|| note.clone()));
            notes.push(note);
        }
        if group.is_unnamed(logs) {
            let name = &logs[group.log].columns[group.columns[0]].name;
            open.push(format!(
                "{key}: columns such as `{name}`, which are only counted"
            ));
        }
    }
    let is_missing = |quantity: &Quantity| {
        quantity.is_required() && sound.iter().all(|group| group.quantity != *quantity)
    };
    let missing = Quantity::ALL.into_iter().filter(is_missing);
    let missing: Vec<&'static str> = missing.map(Quantity::key).collect();
    for key in &missing {
        text.push_str(&format!(
            "\n# not found, and needed:\n# [{key}]\n# columns = [ ]\n"
        ));
    }
    Guess {
        text,
        missing,
        outcome: Ok(0),
        notes,
        open,
    }
}

fn quoted(name: &str) -> String {
    // JSON escapes as TOML's basic strings do.
    serde_json::Value::from(name).to_string()
}

pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub logs: &'a [Log],
    groups: &'a [Group],
    clock: Option<&'a Clock>,
}

pub(super) fn unit_line(unit: &str, why: &str) -> String {
    format!("unit = \"{unit}\"{why}")
}

impl Source<'_> {
    pub(crate) fn group(&self, quantity: Quantity) -> Option<&Group> {
        self.groups.iter().find(|group| group.quantity == quantity)
    }

    pub(crate) fn told(&self, group: &Group, units: &[&'static str]) -> Option<&'static str> {
        let columns = &self.logs[group.log].columns;
        unit(&columns[group.columns[0]].name, units)
    }

    /// Values of a group and their times, if they share the log of `with`.
    pub(crate) fn beside(
        &self,
        quantity: Quantity,
        with: &Group,
    ) -> Option<(DMatrix<f64>, Vec<f64>)> {
        let group = self.group(quantity).filter(|group| group.log == with.log)?;
        Some((self.raw(group), self.times_s(group.log)?))
    }

    pub(crate) fn raw(&self, group: &Group) -> DMatrix<f64> {
        let log = &self.logs[group.log];
        DMatrix::from_fn(group.columns.len(), log.len(), |row, sample| {
            let value = log.columns[group.columns[row]].values[sample];
            if value.is_finite() { value } else { 0.0 }
        })
    }

    pub(crate) fn times_s(&self, log: usize) -> Option<Vec<f64>> {
        let (log, clock) = (&self.logs[log], self.clock?);
        if let Some(column) = log.clock {
            return Some(log.columns[column].times());
        }
        let column = log.column(&Name::Text(clock.name.clone()))?;
        let factor = Dimension::Time.factor(clock.unit)?;
        let times = log.columns[column].times().into_iter();
        Some(times.map(|time| factor * time).collect())
    }

    pub fn columns(&self, group: &Group) -> Vec<String> {
        let log = &self.logs[group.log];
        let mut lines = Vec::new();
        if self.logs.len() > 1 {
            lines.push(format!("file = {}", quoted(&log.name)));
        }
        let names = group.columns.iter();
        let names: Vec<String> = names.map(|at| quoted(&log.columns[*at].name)).collect();
        let rows = names.chunks(if names.len() == 4 { 4 } else { 3 });
        let rows: Vec<String> = rows.map(|row| row.join(", ")).collect();
        lines.push(match &rows[..] {
            [row] => format!("columns = [{row}]"),
            _ => format!("columns = [\n    {},\n]", rows.join(",\n    ")),
        });
        lines
    }

    fn time(&self) -> String {
        let uncounted =
            "# sample_time_s = 0.001   # no column counts time: the distance of samples";
        match self.clock {
            None => uncounted.to_owned(),
            Some(_) if self.logs[self.groups[0].log].clock.is_some() => {
                "# each topic has the time stamps of its messages".to_owned()
            }
            Some(Clock { name, unit }) => format!("column = {}\nunit = \"{unit}\"", quoted(name)),
        }
    }

    fn lines(&self, group: &Group, order: Option<&str>, scales: Vec<String>) -> Vec<String> {
        let mut lines = self.columns(group);
        if group.quantity == Quantity::Feet && group.is_counted {
            let order = "order = \"fr fl rr rl\"   # assumed: the columns are only counted";
            lines.push(order.to_owned());
        } else if group.quantity.is_of_joints() {
            lines.extend(order_line(order, group));
        }
        lines.extend(scales);
        let others = group.others.iter();
        lines.extend(others.map(|other| format!("# by their names also: {other}")));
        lines
    }

    /// Whether a group is what it is called: an acceleration has to be the derivative of its velocity, not what an IMU
    /// feels.
    fn is_sound(&self, group: &Group, scales: &Lines) -> bool {
        let mut accelerations = Quantity::ACCELERATIONS.into_iter();
        let Some((_, velocity)) = accelerations.find(|(own, _)| *own == group.quantity) else {
            return true;
        };
        let mut of_velocity = scales.get(&velocity).into_iter().flatten();
        let has_frame = of_velocity.any(|line| line.contains("frame"));
        let Some((velocity, times)) = self.beside(velocity, group) else {
            return false;
        };
        let rates = slopes(&times, &velocity);
        let same = scale(&rates, &[(Frame::World, self.raw(group))], &[("", 1.0)]);
        !has_frame && same.is_some_and(|scale| scale.sign > 0.0 && scale.left < 0.1)
    }
}
