//! The guessed map as text, each line with what it rests on.

use std::fmt::Write as _;
use std::path::Path;

use nalgebra::DMatrix;

use super::super::attitude::angles_of_quaternions;
use super::super::elements::Quantity;
use super::super::log::Log;
use super::super::units::Dimension;
use super::columns::{Clock, Group};
use super::evidence::{Axes, Scale, angular, linear, reach, real_is_last, scale, slopes};
use super::first_map::{raw, times_s};
use super::names::unit;
use crate::robot::{JOINT_DIM, JOINT_NAMES, Robot};

const ANGLE: [(&str, f64); 3] = [
    ("rad", 1.0),
    ("deg", std::f64::consts::PI / 180.0),
    ("rpm", std::f64::consts::PI / 30.0),
];
const LENGTH: [(&str, f64); 3] = [("m", 1.0), ("mm", 1e-3), ("cm", 1e-2)];
/// Largest joint angle in rad, at the 99th percentile.
const ANGLE_RAD: f64 = 5.0;
/// Share of the largest force at which a foot counts as down.
const FOOT_SHARE: f64 = 0.1;
/// Share of the largest force below which the least is that of a foot in the air.
const RESTING: f64 = 0.3;

/// The lines of a table.
struct Lines {
    quantity: Quantity,
    lines: Vec<String>,
}

/// A map in the making.
pub(super) struct Draft {
    tables: Vec<Lines>,
    time: Vec<String>,
}

impl Draft {
    pub fn of(logs: &[Log], groups: &[Group], clock: Option<&Clock>, robot: &Robot) -> Self {
        let source = Source {
            logs,
            groups,
            clock,
        };
        let mut draft = Self {
            tables: Vec::new(),
            time: Vec::new(),
        };
        draft.time = match clock {
            None => vec![
                "# sample_time_s = 0.001   # no column counts time: the distance of samples"
                    .to_owned(),
            ],
            Some(_) if logs[groups[0].log].clock.is_some() => {
                vec!["# each topic has the time stamps of its messages".to_owned()]
            }
            Some(clock) => vec![
                format!("column = {}", quoted(&clock.name)),
                format!("unit = \"{}\"", clock.unit),
            ],
        };
        let joints = source.joint_scales(robot);
        let trunk = source.trunk();
        for group in groups {
            let mut lines = Vec::new();
            if logs.len() > 1 {
                lines.push(format!("file = {}", quoted(&logs[group.log].name)));
            }
            let columns: Vec<String> = (group.columns.iter())
                .map(|column| quoted(&logs[group.log].columns[*column].name))
                .collect();
            let rows: Vec<String> = columns
                .chunks(if columns.len() == 4 { 4 } else { 3 })
                .map(|row| row.join(", "))
                .collect();
            match rows.len() {
                1 => lines.push(format!("columns = [{}]", rows[0])),
                _ => lines.push(format!("columns = [\n    {},\n]", rows.join(",\n    "))),
            }
            match group.quantity {
                Quantity::JointAcceleration if !source.is_acceleration(group, &trunk) => continue,
                Quantity::JointPosition
                | Quantity::JointVelocity
                | Quantity::JointTorque
                | Quantity::JointAcceleration => lines.extend(joints.lines(group)),
                Quantity::BodyPosition
                | Quantity::Orientation
                | Quantity::BodyVelocity
                | Quantity::AngularVelocity => lines.extend(trunk.lines(group)),
                Quantity::Feet => lines.extend(source.feet(group)),
                Quantity::BodyAcceleration | Quantity::AngularAcceleration => {
                    if !source.is_acceleration(group, &trunk) {
                        continue;
                    }
                }
            }
            let quantity = group.quantity;
            draft.tables.push(Lines { quantity, lines });
        }
        draft
    }

    /// Whether a quantity was found.
    pub fn has(&self, quantity: Quantity) -> bool {
        self.tables.iter().any(|table| table.quantity == quantity)
    }

    /// The map.
    pub fn text(&self, path: &Path, missing: &[&str]) -> String {
        let mut text = format!(
            "# Guessed from {}: check every line, then `romc inspect LOG --columns THIS.toml`.\n\n[time]\n{}\n",
            path.file_name().unwrap_or_default().to_string_lossy(),
            self.time.join("\n")
        );
        for table in &self.tables {
            let lines = table.lines.join("\n");
            let _ = write!(text, "\n[{}]\n{lines}\n", table.quantity.key());
        }
        for key in missing {
            let _ = write!(
                text,
                "\n# not found, and needed:\n# [{key}]\n# columns = [ ]\n"
            );
        }
        text
    }
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

/// Units and signs of the joints' quantities.
#[derive(Default)]
struct JointScales {
    of: Vec<(Quantity, &'static str, String)>,
    signs: Vec<(Quantity, Vec<f64>)>,
    order: Option<&'static str>,
    is_counted: bool,
}

impl JointScales {
    fn lines(&self, group: &Group) -> Vec<String> {
        let mut lines = Vec::new();
        if let Some(order) = self.order {
            lines.push(format!(
                "order = \"{order}\"   # knees are bent throughout, hips are not"
            ));
        } else if group.is_counted {
            lines.push(
                "order = \"fr.* fl.* rr.* rl.*\"   # assumed: the columns are only counted"
                    .to_owned(),
            );
        }
        if let Some((_, unit, why)) = self.of.iter().find(|(own, ..)| *own == group.quantity) {
            lines.push(format!("unit = \"{unit}\"{why}"));
        }
        let signs = self.signs.iter().find(|(own, _)| *own == group.quantity);
        if let Some((_, signs)) = signs {
            lines.extend(sign_line(signs));
        }
        lines
    }
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

/// Units and axes of the trunk's quantities.
#[derive(Default)]
struct Trunk {
    lines: Vec<(Quantity, Vec<String>)>,
    angles: Option<DMatrix<f64>>,
}

impl Trunk {
    fn lines(&self, group: &Group) -> Vec<String> {
        let own = self.lines.iter().find(|(own, _)| *own == group.quantity);
        own.map(|(_, lines)| lines.clone()).unwrap_or_default()
    }
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
        let times = times_s(self.logs, group.log, self.clock)?;
        Some((raw(self.logs, group), times))
    }

    fn joint_scales(&self, robot: &Robot) -> JointScales {
        let mut out = JointScales::default();
        let Some(group) = self.group(Quantity::JointPosition) else {
            return out;
        };
        let mut position = raw(self.logs, group);
        out.is_counted = group.is_counted;
        let told = self.told(group, &["mrad", "rad", "deg"]);
        let in_degrees = reach(position.iter().copied()) > ANGLE_RAD;
        let unit = told.unwrap_or(if in_degrees { "deg" } else { "rad" });
        let why = if told.is_none() && in_degrees {
            "   # by their size"
        } else {
            ""
        };
        out.of.push((Quantity::JointPosition, unit, why.to_owned()));
        position *= Dimension::Angle.factor(unit).unwrap_or(1.0);
        let mut element: Vec<usize> = (0..JOINT_DIM).collect();
        if group.is_counted && grouped_by_joint(&position) {
            out.order = Some("*.hx *.hy *.kn");
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
        for kind in 0..JOINT_DIM / 4 {
            let rows: Vec<usize> = (0..4).map(|leg| 3 * leg + kind).collect();
            for row in rows {
                let (low, high) = robot.joint_limit_rad()[row];
                let inside = |sign: f64| {
                    let values = position.row(row);
                    let margin = 0.1;
                    values
                        .iter()
                        .filter(|v| (low - margin..=high + margin).contains(&(sign * **v)))
                        .count()
                };
                if inside(-1.0) > 2 * inside(1.0) {
                    signs[row] = -1.0;
                }
            }
        }
        for row in 0..JOINT_DIM {
            position.row_mut(row).scale_mut(signs[row]);
        }
        out.signs.push((Quantity::JointPosition, signs.clone()));
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
            out.of.push((Quantity::JointVelocity, unit, why.to_owned()));
            out.signs.push((Quantity::JointVelocity, own));
        }
        if let Some(group) = self.group(Quantity::JointTorque) {
            let mut torque = in_order(&raw(self.logs, group));
            let large = reach(torque.iter().copied()) > 1000.0;
            if large {
                let why = "   # by their size".to_owned();
                out.of.push((Quantity::JointTorque, "N mm", why));
            }
            for row in 0..JOINT_DIM {
                torque.row_mut(row).scale_mut(signs[row]);
            }
            // Knees stretch while a robot stands and jumps.
            let knees: f64 = (0..4).map(|leg| torque.row(3 * leg + 2).sum()).sum();
            if knees < 0.0 {
                signs.iter_mut().for_each(|sign| *sign = -*sign);
            }
            out.signs.push((Quantity::JointTorque, signs));
        }
        out
    }

    fn trunk(&self) -> Trunk {
        let mut out = Trunk::default();
        if let Some(group) = self.group(Quantity::Orientation) {
            let values = raw(self.logs, group);
            let mut lines = Vec::new();
            let angles = match group.is_quaternion {
                true => {
                    let last = group.is_counted && real_is_last(&values);
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
                    lines.push(format!("unit = \"{unit}\""));
                    values * if unit == "deg" { ANGLE[1].1 } else { 1.0 }
                }
            };
            out.lines.push((Quantity::Orientation, lines));
            if let Some((raw, times)) = self.beside(Quantity::AngularVelocity, group) {
                let mut own = angles.clone();
                super::super::attitude::unwrap(&mut own);
                let rates = slopes(&times, &own);
                let found = angular(&own, &rates, &raw, &ANGLE[..2]);
                let lines = match found {
                    None => vec![
                        "# frame = \"body\"   # unknown: it does not follow the angles".to_owned(),
                    ],
                    Some((scale, axes)) => velocity_lines(scale, axes, "the angles"),
                };
                out.lines.push((Quantity::AngularVelocity, lines));
            }
            out.angles = Some(angles);
        }
        if let Some(group) = self.group(Quantity::BodyPosition) {
            let values = raw(self.logs, group);
            let told = self.told(group, &["mm", "cm"]);
            let height = reach(values.row(2).iter().copied());
            let unit = told.unwrap_or(match height {
                60.0.. => "mm",
                4.0.. => "cm",
                _ => "m",
            });
            let line = format!("unit = \"{unit}\"   # z reaches {height:.3}");
            out.lines.push((Quantity::BodyPosition, vec![line]));
            let factor = LENGTH.iter().find(|(name, _)| *name == unit);
            let factor = factor.map_or(1.0, |(_, factor)| *factor);
            if let Some((raw, times)) = self.beside(Quantity::BodyVelocity, group) {
                let rates = slopes(&times, &(values * factor));
                let lines = match linear(out.angles.as_ref(), &rates, &raw, &LENGTH) {
                    None => vec![
                        "# frame = \"body\"   # unknown: it does not follow the position"
                            .to_owned(),
                    ],
                    Some((scale, axes)) => velocity_lines(scale, axes, "the position"),
                };
                out.lines.push((Quantity::BodyVelocity, lines));
            }
        }
        out
    }

    /// Contact as flags or by a threshold.
    fn feet(&self, group: &Group) -> Vec<String> {
        let values = raw(self.logs, group);
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

    /// Whether a column called acceleration is one: the derivative of its velocity, not what an IMU feels.
    fn is_acceleration(&self, group: &Group, trunk: &Trunk) -> bool {
        let velocity = match group.quantity {
            Quantity::JointAcceleration => Quantity::JointVelocity,
            Quantity::BodyAcceleration => Quantity::BodyVelocity,
            _ => Quantity::AngularVelocity,
        };
        let plain = |line: &String| !line.contains("frame");
        let of_velocity = trunk.lines.iter().find(|(own, _)| *own == velocity);
        let Some((velocity, times)) = self.beside(velocity, group) else {
            return false;
        };
        let rates = slopes(&times, &velocity);
        let same = scale(&rates, &raw(self.logs, group), &[("", 1.0)]);
        let sound = of_velocity.is_none_or(|(_, lines)| lines.iter().all(plain));
        sound && same.is_some_and(|(scale, left)| scale.sign > 0.0 && left < 0.1)
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
fn velocity_lines(scale: Scale, axes: Axes, of: &str) -> Vec<String> {
    let mut lines = vec![format!(
        "unit = \"{}\"   # by the change of {of}",
        scale.unit
    )];
    if scale.sign < 0.0 {
        lines.push("sign = -1".to_owned());
    }
    match axes {
        Axes::Body => lines.push("frame = \"body\"".to_owned()),
        Axes::World if of == "the angles" => lines.push("frame = \"world\"".to_owned()),
        Axes::World | Axes::Angles => {}
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
