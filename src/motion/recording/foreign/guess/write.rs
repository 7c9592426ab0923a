//! The guessed map as text, each line with what it rests on.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::DMatrix;

use super::super::attitude::{angle_rates, angles_of_quaternions, in_world, unwrap};
use super::super::elements::Quantity;
use super::super::log::Log;
use super::super::map::{Frame, Name};
use super::super::units::Dimension;
use super::columns::{Clock, Group, clock, groups};
use super::evidence::{Scale, axes, reach, scale, slopes};
use super::names::unit;
use crate::robot::{JOINT_DIM, JOINT_NAMES, Robot};

const ANGLE: [(&str, f64); 3] = [
    ("rad", 1.0),
    ("deg", std::f64::consts::PI / 180.0),
    ("rpm", std::f64::consts::PI / 30.0),
];
/// Largest joint angle in rad, at the 99th percentile.
const ANGLE_RAD: f64 = 5.0;
/// Share of the largest force at which a foot counts as down.
const FOOT_SHARE: f64 = 0.1;
/// Share of the largest force below which the least is that of a foot in the air.
const RESTING: f64 = 0.3;

/// The lines of tables.
type Lines = BTreeMap<Quantity, Vec<String>>;

/// The guessed map of logs, and the tables that a recording needs and that were not found.
pub(super) fn map_text(path: &Path, logs: &[Log], robot: &Robot) -> (String, Vec<&'static str>) {
    let groups = groups(logs);
    let clock = clock(logs, &groups);
    let source = Source {
        logs,
        groups: &groups,
        clock: clock.as_ref(),
    };
    let time = match &clock {
        None => {
            "# sample_time_s = 0.001   # no column counts time: the distance of samples".to_owned()
        }
        Some(_) if logs[groups[0].log].clock.is_some() => {
            "# each topic has the time stamps of its messages".to_owned()
        }
        Some(clock) => format!(
            "column = {}\nunit = \"{}\"",
            quoted(&clock.name),
            clock.unit
        ),
    };
    let mut text = format!(
        "# Guessed from {}: check every line, then `romc inspect LOG --columns THIS.toml`.\n\n[time]\n{time}\n",
        path.file_name().unwrap_or_default().to_string_lossy(),
    );
    let mut scales = source.trunk();
    let order = source.joint_scales(robot, &mut scales);
    let sound: Vec<&Group> = (groups.iter())
        .filter(|group| source.is_sound(group, &scales))
        .collect();
    for group in &sound {
        let mut lines = source.columns(group);
        if group.quantity == Quantity::Feet {
            lines.extend(source.feet(group));
        } else if group.quantity.is_of_joints() {
            lines.extend(order_line(order, group));
        }
        lines.extend(scales.remove(&group.quantity).unwrap_or_default());
        let (key, lines) = (group.quantity.key(), lines.join("\n"));
        text.push_str(&format!("\n[{key}]\n{lines}\n"));
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
    (text, missing)
}

fn quoted(name: &str) -> String {
    // JSON escapes as TOML's basic strings do.
    serde_json::Value::from(name).to_string()
}

/// The log and what its names say.
struct Source<'a> {
    logs: &'a [Log],
    groups: &'a [Group],
    clock: Option<&'a Clock>,
}

/// The order of a quantity of joints whose columns are counted.
fn order_line(order: Option<&str>, group: &Group) -> Option<String> {
    match order {
        Some(order) => Some(format!(
            "order = \"{order}\"   # knees are bent throughout, hips are not"
        )),
        None => group.is_counted.then(|| {
            "order = \"fr.* fl.* rr.* rl.*\"   # assumed: the columns are only counted".to_owned()
        }),
    }
}

fn unit_line(unit: &str, why: &str) -> String {
    format!("unit = \"{unit}\"{why}")
}

/// The signs of joints, if any is negative.
fn sign_line(signs: &[f64]) -> Option<String> {
    let negative: Vec<usize> = (0..signs.len()).filter(|i| signs[*i] < 0.0).collect();
    if negative.is_empty() {
        return None;
    }
    if negative.len() == signs.len() {
        return Some("sign = -1".to_owned());
    }
    let names = negative
        .iter()
        .map(|i| format!("\"{}\" = -1", JOINT_NAMES[*i]));
    let names: Vec<String> = names.collect();
    Some(format!("sign = {{ {} }}", names.join(", ")))
}

impl Source<'_> {
    fn group(&self, quantity: Quantity) -> Option<&Group> {
        self.groups.iter().find(|group| group.quantity == quantity)
    }

    /// The unit that the names of a group carry.
    fn told(&self, group: &Group, units: &[&'static str]) -> Option<&'static str> {
        let columns = &self.logs[group.log].columns;
        unit(&columns[group.columns[0]].name, units)
    }

    /// Values of a group and their times, if they share the log of `with`.
    fn beside(&self, quantity: Quantity, with: &Group) -> Option<(DMatrix<f64>, Vec<f64>)> {
        let group = self.group(quantity).filter(|group| group.log == with.log)?;
        Some((self.raw(group), self.times_s(group.log)?))
    }

    /// Values of a group in the units of the log, one row a column.
    fn raw(&self, group: &Group) -> DMatrix<f64> {
        let log = &self.logs[group.log];
        DMatrix::from_fn(group.columns.len(), log.len(), |row, sample| {
            let value = log.columns[group.columns[row]].values[sample];
            if value.is_finite() { value } else { 0.0 }
        })
    }

    /// Times of a log in s.
    fn times_s(&self, log: usize) -> Option<Vec<f64>> {
        let (log, clock) = (&self.logs[log], self.clock?);
        let (column, factor) = match log.clock {
            Some(column) => (column, 1.0),
            None => {
                let column = log.column(&Name::Text(clock.name.clone()))?;
                (column, Dimension::Time.factor(clock.unit)?)
            }
        };
        let times = log.columns[column].times();
        Some(times.into_iter().map(|time| factor * time).collect())
    }

    /// The file and the columns of a group.
    fn columns(&self, group: &Group) -> Vec<String> {
        let log = &self.logs[group.log];
        let mut lines = Vec::new();
        if self.logs.len() > 1 {
            lines.push(format!("file = {}", quoted(&log.name)));
        }
        let names = group.columns.iter();
        let names: Vec<String> = names.map(|at| quoted(&log.columns[*at].name)).collect();
        let rows: Vec<String> = names
            .chunks(if names.len() == 4 { 4 } else { 3 })
            .map(|row| row.join(", "))
            .collect();
        lines.push(match &rows[..] {
            [row] => format!("columns = [{row}]"),
            _ => format!("columns = [\n    {},\n]", rows.join(",\n    ")),
        });
        lines
    }

    /// Adds units and signs of the joints' quantities; the order of their columns, if it is not that of the legs.
    fn joint_scales(&self, robot: &Robot, lines: &mut Lines) -> Option<&'static str> {
        let group = self.group(Quantity::JointPosition)?;
        let mut position = self.raw(group);
        let told = self.told(group, &["mrad", "rad", "deg"]);
        let in_degrees = reach(position.iter().copied()) > ANGLE_RAD;
        let unit = told.unwrap_or(if in_degrees { "deg" } else { "rad" });
        let by_size = "   # by their size";
        let why = if told.is_none() && in_degrees {
            by_size
        } else {
            ""
        };
        let said = unit_line(unit, why);
        position *= Dimension::Angle.factor(unit).unwrap_or(1.0);
        let (mut order, mut element) = (None, Vec::from_iter(0..JOINT_DIM));
        if group.is_counted && grouped_by_joint(&position) {
            order = Some("*.hx *.hy *.kn");
            element = (0..JOINT_DIM).map(|i| 3 * (i % 4) + i / 4).collect();
        }
        let in_order = |rows: &DMatrix<f64>| {
            let mut sorted = rows.clone();
            for (row, element) in element.iter().enumerate() {
                sorted.set_row(*element, &rows.row(row));
            }
            sorted
        };
        position = in_order(&position);
        let mut signs = vec![1.0; JOINT_DIM];
        for (row, (low, high)) in robot.joint_limit_rad().iter().enumerate() {
            let inside = |sign: f64| {
                let range = low - 0.1..=high + 0.1;
                let values = position.row(row);
                values
                    .iter()
                    .filter(|v| range.contains(&(sign * **v)))
                    .count()
            };
            if inside(-1.0) > 2 * inside(1.0) {
                signs[row] = -1.0;
            }
            position.row_mut(row).scale_mut(signs[row]);
        }
        let all =
            |unit: String, signs: &[f64]| [unit].into_iter().chain(sign_line(signs)).collect();
        lines.insert(Quantity::JointPosition, all(said, &signs));
        let velocity = self.beside(Quantity::JointVelocity, group);
        if let Some((velocity, times)) = &velocity {
            let velocity = in_order(velocity);
            let rates = slopes(times, &position);
            let mut own = signs.clone();
            let mut units = Vec::new();
            for row in 0..JOINT_DIM {
                let rows = |m: &DMatrix<f64>| m.rows(row, 1).into_owned();
                if let Some((Scale { unit, sign, .. }, _)) =
                    scale(&rows(&rates), &rows(&velocity), &ANGLE)
                {
                    own[row] = sign;
                    units.push(unit);
                }
            }
            let most = ANGLE.iter().map(|(unit, _)| *unit);
            let most = most.max_by_key(|unit| units.iter().filter(|own| own == &unit).count());
            let unit = most.filter(|_| !units.is_empty()).unwrap_or(unit);
            let why = "   # by the change of the positions";
            lines.insert(Quantity::JointVelocity, all(unit_line(unit, why), &own));
        }
        if let Some(group) = self.group(Quantity::JointTorque) {
            let mut torque = in_order(&self.raw(group));
            let is_large = reach(torque.iter().copied()) > 1000.0;
            for row in 0..JOINT_DIM {
                torque.row_mut(row).scale_mut(signs[row]);
            }
            // Knees stretch while a robot stands and jumps.
            let knees: f64 = (0..4).map(|leg| torque.row(3 * leg + 2).sum()).sum();
            if knees < 0.0 {
                signs.iter_mut().for_each(|sign| *sign = -*sign);
            }
            let unit = is_large.then(|| unit_line("N mm", by_size));
            let all = unit.into_iter().chain(sign_line(&signs)).collect();
            lines.insert(Quantity::JointTorque, all);
        }
        order
    }

    /// Units and axes of the trunk's quantities.
    fn trunk(&self) -> Lines {
        let (mut out, mut angles) = (Lines::new(), None);
        if let Some(group) = self.group(Quantity::Orientation) {
            let values = self.raw(group);
            let mut lines = Vec::new();
            let found = match group.is_quaternion {
                true => {
                    // The real part of a robot on its feet is the largest.
                    let size = |row: usize| values.row(row).abs().sum();
                    let last = group.is_counted && size(3) > size(0);
                    lines.push(match (group.is_counted, last) {
                        (true, false) => "order = \"wxyz\"   # the first is the largest".to_owned(),
                        (true, true) => "order = \"xyzw\"   # the last is the largest".to_owned(),
                        (false, _) => "order = \"wxyz\"".to_owned(),
                    });
                    match last {
                        true => angles_of_quaternions(&values.select_rows(&[3, 0, 1, 2])),
                        false => angles_of_quaternions(&values),
                    }
                }
                false => {
                    let told = self.told(group, &["rad", "deg"]);
                    // No robot that jumps pitches by more than a quarter turn.
                    let steep = reach(values.row(1).iter().copied()) > 1.6;
                    let unit = told.unwrap_or(if steep { "deg" } else { "rad" });
                    lines.push(unit_line(unit, ""));
                    values * if unit == "deg" { ANGLE[1].1 } else { 1.0 }
                }
            };
            out.insert(Quantity::Orientation, lines);
            if let Some((raw, times)) = self.beside(Quantity::AngularVelocity, group) {
                let mut own = found.clone();
                unwrap(&mut own);
                let rates = slopes(&times, &own);
                let frames = [Frame::Angles, Frame::Body, Frame::World];
                let turned = |frame| angle_rates(&own, &raw, frame).ok();
                let scale = axes(frames, turned, &rates, &ANGLE[..2]);
                let lines = velocity_lines(scale, "the angles");
                out.insert(Quantity::AngularVelocity, lines);
            }
            angles = Some(found);
        }
        if let Some(group) = self.group(Quantity::BodyPosition) {
            let values = self.raw(group);
            let told = self.told(group, &["mm", "cm"]);
            let height = reach(values.row(2).iter().copied());
            let unit = told.unwrap_or(match height {
                60.0.. => "mm",
                4.0.. => "cm",
                _ => "m",
            });
            let line = unit_line(unit, &format!("   # z reaches {height:.3}"));
            out.insert(Quantity::BodyPosition, vec![line]);
            let factor = Dimension::Length.factor(unit).unwrap_or(1.0);
            if let Some((raw, times)) = self.beside(Quantity::BodyVelocity, group) {
                let rates = slopes(&times, &(values * factor));
                let angles = angles.filter(|angles| angles.ncols() == raw.ncols());
                let turned = |frame| match frame {
                    Frame::Body => Some(in_world(angles.as_ref()?, &raw)),
                    Frame::World | Frame::Angles => Some(raw.clone()),
                };
                let frames = [Frame::World, Frame::Body];
                let scale = axes(frames, turned, &rates, Dimension::Length.units());
                let lines = velocity_lines(scale, "the position");
                out.insert(Quantity::BodyVelocity, lines);
            }
        }
        out
    }

    /// Contact as flags or by a threshold.
    fn feet(&self, group: &Group) -> Vec<String> {
        let values = self.raw(group);
        let mut lines = Vec::new();
        if group.is_counted {
            lines.push(
                "order = \"fr fl rr rl\"   # assumed: the columns are only counted".to_owned(),
            );
        }
        if values.iter().any(|value| *value != 0.0 && *value != 1.0) {
            let (rest, most) = (rest_force(&values), reach(values.iter().copied()));
            let at = |share: f64| rest + share * (most - rest);
            lines.push(format!(
                "threshold = {:.3}   # a tenth of the way from no force to the largest",
                at(FOOT_SHARE)
            ));
            lines.push(format!("release = {:.3}", at(FOOT_SHARE / 2.0)));
        }
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
        let same = scale(&rates, &self.raw(group), &[("", 1.0)]);
        !has_frame && same.is_some_and(|(scale, left)| scale.sign > 0.0 && left < 0.1)
    }
}

/// What sensors of feet in the air show: the first percentile, or none where all feet stand throughout.
fn rest_force(values: &DMatrix<f64>) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().collect();
    sorted.sort_by(f64::total_cmp);
    let least = sorted.get(sorted.len() / 100).copied().unwrap_or_default();
    match least.abs() < RESTING * reach(sorted.into_iter()) {
        true => least,
        false => 0.0,
    }
}

/// Unit, sign and axes of a velocity of the trunk.
fn velocity_lines(found: Option<(Scale, Frame)>, of: &str) -> Vec<String> {
    let Some((scale, axes)) = found else {
        return vec![format!(
            "# frame = \"body\"   # unknown: it does not follow {of}"
        )];
    };
    let mut lines = vec![unit_line(
        scale.unit,
        &format!("   # by the change of {of}"),
    )];
    if scale.sign < 0.0 {
        lines.push("sign = -1".to_owned());
    }
    match axes {
        Frame::Body => lines.push("frame = \"body\"".to_owned()),
        Frame::World if of == "the angles" => lines.push("frame = \"world\"".to_owned()),
        Frame::World | Frame::Angles => {}
    }
    lines
}

/// Whether counted joints go hips, thighs, calves: the last four bent throughout.
fn grouped_by_joint(position: &DMatrix<f64>) -> bool {
    let mean = |row: usize| position.row(row).mean().abs();
    let last = (8..12).map(mean).fold(f64::INFINITY, f64::min);
    let first = (0..4).map(mean).fold(0.0, f64::max);
    last > 0.6 && first < 0.6 && mean(2) < 0.5 * last
}
