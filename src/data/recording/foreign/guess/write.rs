//! The guessed map as text, each line with its evidence.

use super::columns::{Clock, clock, groups};
use super::scales::order_line;
use super::*;

pub(super) type Lines = BTreeMap<Quantity, Vec<String>>;

pub(super) fn guessed(path: &Path, logs: &[Log], robot: &Robot) -> Guess {
    let groups = groups(logs, robot);
    let clock = clock(logs, &groups);
    let time = time(logs, &groups, clock.as_ref());
    let source = Source {
        path,
        logs,
        robot,
        groups: &groups,
        clock: clock.as_ref(),
        time: &time,
    };
    let file = path.file_name().unwrap_or(path.as_os_str());
    let mut text = format!(
        "# Guessed from {}: check every line, then `romc inspect LOG --columns THIS.toml`.\n\n[time]\n{time}\n",
        file.to_string_lossy()
    );
    let (mut lines, order, mut notes) = source.scales();
    let sound = Vec::from_iter(groups.iter().filter(|group| source.is_sound(group, &lines)));
    let mut open = Vec::new();
    for group in &sound {
        let key = group.quantity.key();
        let scales = lines.remove(&group.quantity).unwrap_or_default(); // none: SI units as they stand
        let lines = source.lines(group, order, scales).join("\n");
        text += &format!("\n[{key}]\n{lines}\n");
        if !group.others.is_empty() {
            let note = format!("{key}: by their names also {}", group.others.join(", "));
            open.extend(group.is_tie.then(|| note.clone()));
            notes.push(note);
        }
        if group.is_unnamed(logs) {
            let name = source.first_name(group);
            let found = format!("columns such as `{name}`, which are only counted");
            open.push(format!("{key}: {found}"));
        }
    }
    let mut missing = Vec::from(Quantity::ALL);
    missing.retain(|own| own.is_required() && sound.iter().all(|group| group.quantity != *own));
    let missing: Vec<&'static str> = missing.into_iter().map(Quantity::key).collect();
    for key in &missing {
        text += &format!("\n# not found, and needed:\n# [{key}]\n# columns = [ ]\n");
    }
    let outcome = ColumnMap::parse("the guessed map", &text)
        .and_then(|map| assemble(path, logs, &map))
        .map(|made| made.recording.sample_count());
    Guess {
        text,
        missing,
        outcome: outcome.map_err(|error| error.to_string()),
        notes,
        open,
    }
}

fn time(logs: &[Log], groups: &[Group], clock: Option<&Clock>) -> String {
    let step = "# sample_time_s = 0.001";
    match clock {
        None => format!("{step}   # no column counts time: the distance of samples"),
        Some(_) if logs[groups[0].log].clock.is_some() => {
            "# each topic has the time stamps of its messages".to_owned()
        }
        Some(Clock { name, unit }) => format!("column = {}\nunit = \"{unit}\"", quoted(name)),
    }
}

fn quoted(name: &str) -> String {
    serde_json::Value::from(name).to_string() // JSON escapes as TOML's basic strings do
}

pub(super) struct Source<'a> {
    pub path: &'a Path,
    pub logs: &'a [Log],
    pub robot: &'a Robot,
    pub time: &'a str,
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

    pub(crate) fn first_name(&self, group: &Group) -> &str {
        &self.logs[group.log].columns[group.columns[0]].name
    }

    pub(crate) fn told(&self, group: &Group, units: &[&'static str]) -> Option<&'static str> {
        unit(self.first_name(group), units)
    }

    /// Values of a group and their times, if they share the log of `with`.
    pub(crate) fn beside(&self, quantity: Quantity, with: &Group) -> Option<(Rows, Vec<f64>)> {
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

    pub(crate) fn columns(&self, group: &Group) -> Vec<String> {
        let log = &self.logs[group.log];
        let mut lines = Vec::new();
        if self.logs.len() > 1 {
            lines.push(format!("file = {}", quoted(&log.name)));
        }
        let names = group.columns.iter();
        let names: Vec<String> = names.map(|at| quoted(&log.columns[*at].name)).collect();
        lines.push(match names.len() {
            ..=4 => format!("columns = [{}]", names.join(", ")),
            _ => {
                let rows: Vec<String> = names.chunks(3).map(|row| row.join(", ")).collect();
                format!("columns = [\n    {},\n]", rows.join(",\n    "))
            }
        });
        lines
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

    /// Whether an acceleration is the derivative of its velocity, not the specific force that an IMU measures.
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
