//! Units, signs, axes and orders of the guessed map: by names, by derivatives, and by what the robot's geometry says.

use std::cmp::Ordering;
use std::f64::consts::TAU;

use nalgebra::DMatrix;

use super::super::assemble::assemble;
use super::super::elements::{
    Dimension, Quantity, angle_rates, angles_of_quaternions, in_world, unwrap,
};
use super::super::map::{ColumnMap, Frame};
use super::columns::Group;
use super::feet::force_lines;
use super::physics::{NamedUnit, Reading, Scale, View, reach, scale, slopes};
use super::write::{Lines, Source, unit_line};
use crate::robot::{JOINT_DIM, JOINT_NAMES, Robot};

const ANGLE: [(&str, f64); 3] = [
    ("rad", 1.0),
    ("deg", std::f64::consts::PI / 180.0),
    ("rpm", std::f64::consts::PI / 30.0),
];
const LENGTHS: [&str; 3] = ["m", "cm", "mm"];
const PITCH_RAD: f64 = 1.6; // largest pitch for which radians are the first choice

pub(super) struct Scales {
    pub lines: Lines,
    /// The order of the joints' columns, if they are counted and grouped by kind.
    pub order: Option<&'static str>,
    pub notes: Vec<String>,
}

struct Choice {
    attitude: usize,
    reading: Reading,
    torques: Option<([f64; JOINT_DIM], NamedUnit)>,
    as_well: Vec<Reading>,
}

/// A way to read the trunk's attitude: its lines, and roll, pitch and yaw.
type Attitude = (Vec<String>, DMatrix<f64>);

impl Source<'_> {
    pub(crate) fn scales(&self, robot: &Robot, time: &str) -> Scales {
        let (mut lines, mut notes) = (Lines::new(), Vec::new());
        if let Some(feet) = self.group(Quantity::Feet) {
            let (own, note) = force_lines(&self.raw(feet));
            lines.insert(Quantity::Feet, own);
            notes.extend(note);
        }
        let attitudes = self.attitudes();
        let choice = self.choice(robot, time, &attitudes, &lines);
        let (reading, torques) = (&choice.reading, choice.torques);
        notes.extend(said(reading, &choice.as_well));
        let turned = |what: &str, signs: &[f64]| {
            sign_line(signs).map(|line| format!("{what}: {line}, as the feet and the weight show"))
        };
        notes.extend(turned("joint.position", &reading.signs));
        notes.extend(torques.and_then(|(signs, _)| turned("joint.torque", &signs)));
        let attitude = attitudes.into_iter().nth(choice.attitude);
        self.trunk(attitude, reading.position, &mut lines);
        self.joints(reading, torques, &mut lines);
        Scales {
            lines,
            order: reading.by_kind.then_some("*.hx *.hy *.kn"),
            notes,
        }
    }

    /// The reading under which feet on the ground stay best in place; by the joints' limits where no feet stand.
    fn choice(&self, robot: &Robot, time: &str, attitudes: &[Attitude], lines: &Lines) -> Choice {
        let place = self.raw_of(Quantity::BodyPosition);
        let by_height = || match reach(place.row(2).iter().copied()) {
            60.0.. => "mm",
            4.0.. => "cm",
            _ => "m",
        };
        let positions = self.units(Quantity::BodyPosition, &["mm", "cm"], &LENGTHS, by_height);
        let by_size = || self.angle_by_limits(robot);
        let told = ["mrad", "rad", "deg"];
        let joints = self.units(Quantity::JointPosition, &told, &["rad", "deg"], by_size);
        let group = self.group(Quantity::JointPosition);
        let orders: &[bool] = match group.is_some_and(|group| group.is_counted) {
            true => &[false, true],
            false => &[false],
        };
        let mut found: Option<Choice> = None;
        for (attitude, (own, _)) in attitudes.iter().enumerate() {
            let Some(recording) = self.without_scales(time, own, lines) else {
                continue;
            };
            let view = View::of(&recording, robot);
            let Some((mut reading, as_well)) = view.best(&positions, &joints, orders) else {
                continue;
            };
            let is_best = |best: &Choice| reading.beats(&best.reading);
            if found.as_ref().is_none_or(is_best) {
                let torques = view.torques(&mut reading);
                found = Some(Choice {
                    attitude,
                    reading,
                    torques,
                    as_well,
                });
            }
        }
        found.unwrap_or_else(|| Choice {
            attitude: 0,
            reading: self.by_limits(robot, positions.first(), joints.first()),
            torques: None,
            as_well: Vec::new(),
        })
    }

    fn raw_of(&self, quantity: Quantity) -> DMatrix<f64> {
        match self.group(quantity) {
            Some(group) => self.raw(group),
            None => DMatrix::zeros(quantity.elements().len(), 1),
        }
    }

    /// The units that a quantity may have, the first choice first: the one of its name, else all of `units`.
    fn units(
        &self,
        quantity: Quantity,
        named: &[&'static str],
        units: &[&'static str],
        first: impl Fn() -> &'static str,
    ) -> Vec<NamedUnit> {
        let factor = |unit: &'static str| (unit, quantity.dimension().factor(unit).unwrap_or(1.0));
        let told = (self.group(quantity)).and_then(|group| self.told(group, named));
        if let Some(told) = told {
            return vec![factor(told)];
        }
        let first = first();
        let others = units.iter().copied().filter(|unit| *unit != first);
        [first].into_iter().chain(others).map(factor).collect()
    }

    fn attitudes(&self) -> Vec<Attitude> {
        let Some(group) = self.group(Quantity::Orientation) else {
            return Vec::new();
        };
        let values = self.raw(group);
        if group.is_quaternion {
            let attitude = |(name, order): (&str, [usize; 4]), why: &str| {
                let angles = angles_of_quaternions(&values.select_rows(&order));
                (vec![format!("order = \"{name}\"{why}")], angles)
            };
            let mut orders = [("wxyz", [0, 1, 2, 3]), ("xyzw", [3, 0, 1, 2])];
            if !group.is_counted {
                return vec![attitude(orders[0], "")];
            }
            // The real part of a robot on its feet is the largest, unless it looks backwards.
            let size = |row: usize| values.row(row).abs().sum();
            if size(3) > size(0) {
                orders.reverse();
            }
            let why = "   # feet on the ground stay in place";
            return orders.map(|order| attitude(order, why)).to_vec();
        }
        let of_unit = |(unit, factor): NamedUnit| (vec![unit_line(unit, "")], &values * factor);
        let is_steep = || reach(values.row(1).iter().copied()) > PITCH_RAD;
        let first = || if is_steep() { "deg" } else { "rad" };
        let both = ["rad", "deg"];
        let units = self.units(Quantity::Orientation, &both, &both, first);
        units.into_iter().map(of_unit).collect()
    }

    /// The log read with this attitude and these lines of the feet, everything else as its numbers are; none without
    /// what stands of feet rest on.
    fn without_scales(
        &self,
        time: &str,
        attitude: &[String],
        lines: &Lines,
    ) -> Option<crate::recording::Recording> {
        let mut text = format!("[time]\n{time}\n");
        let required = |quantity: &Quantity| quantity.is_required();
        for quantity in Quantity::ALL.into_iter().filter(required) {
            // Torques need not be there to see feet stand.
            let stands_in = match quantity {
                Quantity::JointTorque => self.group(Quantity::JointPosition),
                _ => None,
            };
            let group = self.group(quantity).or(stands_in)?;
            let mut own = self.columns(group);
            match quantity {
                Quantity::Orientation => own.extend(attitude.iter().cloned()),
                Quantity::Feet => own.extend(lines.get(&quantity).into_iter().flatten().cloned()),
                _ => {}
            }
            text += &format!("[{}]\n{}\n", quantity.key(), own.join("\n"));
        }
        let map = ColumnMap::parse("the guessed map", &text).ok()?;
        let mut recording = assemble(self.path, self.logs, &map).ok()?.recording;
        if self.group(Quantity::JointTorque).is_none() {
            let segments = recording.segments.iter_mut();
            segments.for_each(|segment| segment.torque_nm.fill(0.0));
        }
        Some(recording)
    }

    /// The unit of angles in which more of them are within the joints' limits, apart from whole turns and signs; where
    /// limits do not decide, degrees for angles beyond a turn.
    fn angle_by_limits(&self, robot: &Robot) -> &'static str {
        let values = self.raw_of(Quantity::JointPosition);
        let inside = |factor: f64| -> usize {
            let rows = values.row_iter().zip(robot.joint_limit_rad());
            let of_row = rows.map(|(row, (low, high))| {
                let is_inside = |angle: f64| (angle - low).rem_euclid(TAU) <= high - low;
                let angles = row.iter().map(|value| factor * value);
                let inside = angles.filter(|angle| is_inside(*angle) || is_inside(-angle));
                inside.count()
            });
            of_row.sum()
        };
        let is_degrees = match inside(ANGLE[1].1).cmp(&inside(ANGLE[0].1)) {
            Ordering::Equal => reach(values.iter().copied()) > TAU,
            order => order.is_gt(),
        };
        if is_degrees { "deg" } else { "rad" }
    }

    /// Signs by the limits of the joints, where nothing else shows them.
    fn by_limits(
        &self,
        robot: &Robot,
        position: Option<&NamedUnit>,
        joint: Option<&NamedUnit>,
    ) -> Reading {
        let joint = joint.copied().unwrap_or(ANGLE[0]);
        let mut reading = Reading::plain(position.copied().unwrap_or(("m", 1.0)), joint);
        let values = self.raw_of(Quantity::JointPosition) * joint.1;
        for (row, (low, high)) in robot.joint_limit_rad().iter().enumerate() {
            let range = low - 0.1..=high + 0.1;
            let values = values.row(row);
            let inside = |sign: f64| {
                let signed = values.iter().map(|value| sign * value);
                signed.filter(|value| range.contains(value)).count()
            };
            if inside(-1.0) > 2 * inside(1.0) {
                reading.signs[row] = -1.0;
            }
        }
        reading
    }

    fn joints(
        &self,
        reading: &Reading,
        torques: Option<([f64; JOINT_DIM], NamedUnit)>,
        lines: &mut Lines,
    ) {
        let Some(group) = self.group(Quantity::JointPosition) else {
            return;
        };
        let in_order = |rows: DMatrix<f64>| {
            let order: [usize; JOINT_DIM] = std::array::from_fn(|joint| reading.row(joint));
            rows.select_rows(&order)
        };
        let mut position = in_order(self.raw(group) * reading.joint.1);
        for (mut row, sign) in position.row_iter_mut().zip(reading.signs) {
            row *= sign;
        }
        let mut put = |quantity, unit, why, signs: &[f64]| {
            let own = [unit_line(unit, why)].into_iter().chain(sign_line(signs));
            lines.insert(quantity, own.collect());
        };
        let why = match self.told(group, &["mrad", "rad", "deg"]) {
            None if reading.joint.0 != "rad" => "   # by their size and the feet",
            Some(_) | None => "",
        };
        let (unit, signs) = (reading.joint.0, &reading.signs);
        put(Quantity::JointPosition, unit, why, signs);
        if let Some((velocity, times)) = self.beside(Quantity::JointVelocity, group) {
            let velocity = in_order(velocity);
            let rates = slopes(&times, &position);
            let mut own = reading.signs;
            let mut units = Vec::new();
            for row in 0..JOINT_DIM {
                let rows = |m: &DMatrix<f64>| m.rows(row, 1).into_owned();
                let velocity = [(Frame::Angles, rows(&velocity))];
                if let Some(found) = scale(&rows(&rates), &velocity, &ANGLE) {
                    own[row] = found.sign;
                    units.push(found.unit);
                }
            }
            let count = |unit: &&str| units.iter().filter(|own| *own == unit).count();
            let most = ANGLE.iter().map(|(unit, _)| *unit).max_by_key(count);
            let unit = (most.filter(|_| !units.is_empty())).unwrap_or(reading.joint.0);
            let why = "   # by the change of the positions";
            put(Quantity::JointVelocity, unit, why, &own);
        }
        if let Some(group) = self.group(Quantity::JointTorque) {
            let told = self.told(group, &["nmm", "mnm", "ncm"]);
            let (signs, unit, why) = match torques {
                Some((signs, (unit, _))) => {
                    let why = "   # unit and signs by the weight that the feet carry";
                    (signs, unit, why)
                }
                None => {
                    let why = "   # signs as of the angles: the torques carry nothing";
                    (reading.signs, "N m", why)
                }
            };
            put(Quantity::JointTorque, told.unwrap_or(unit), why, &signs);
        }
    }

    fn trunk(&self, attitude: Option<Attitude>, (unit, factor): NamedUnit, lines: &mut Lines) {
        let angles = attitude.as_ref().map(|(_, angles)| angles);
        if let (Some(group), Some(angles)) = (self.group(Quantity::Orientation), angles) {
            let mut own = angles.clone();
            unwrap(&mut own);
            let turned = |raw: &DMatrix<f64>, frame| angle_rates(&own, raw, frame).ok();
            let frames = [Frame::Angles, Frame::Body, Frame::World];
            let of = (group, &own, "the angles");
            let velocity = (Quantity::AngularVelocity, &ANGLE[..2]);
            self.velocity(velocity, of, &frames, turned, lines);
        }
        lines.extend(
            attitude
                .iter()
                .map(|(own, _)| (Quantity::Orientation, own.clone())),
        );
        let Some(group) = self.group(Quantity::BodyPosition) else {
            return;
        };
        let values = self.raw(group);
        let height = reach(values.row(2).iter().copied());
        let line = unit_line(unit, &format!("   # z reaches {height:.3}"));
        lines.insert(Quantity::BodyPosition, vec![line]);
        let turned = |raw: &DMatrix<f64>, frame| match frame {
            Frame::Body => {
                let angles = angles.filter(|angles| angles.ncols() == raw.ncols())?;
                Some(in_world(angles, raw))
            }
            Frame::World | Frame::Angles => Some(raw.clone()),
        };
        let velocity = (Quantity::BodyVelocity, Dimension::Length.units());
        let of = (group, &(values * factor), "the position");
        self.velocity(velocity, of, &[Frame::World, Frame::Body], turned, lines);
    }

    /// Lines of a velocity of the trunk, whose positions have this group and these values: unit, sign and axes, of
    /// `frames` the first that fits nearly as well as the best.
    fn velocity(
        &self,
        (velocity, units): (Quantity, &[NamedUnit]),
        (group, positions, of): (&Group, &DMatrix<f64>, &str),
        frames: &[Frame],
        turned: impl Fn(&DMatrix<f64>, Frame) -> Option<DMatrix<f64>>,
        lines: &mut Lines,
    ) {
        let Some((raw, times)) = self.beside(velocity, group) else {
            return;
        };
        // The twist of an odometry is in the body's frame unless the numbers show another.
        let is_odometry = self.group(velocity).is_some_and(|group| {
            let first = &self.logs[group.log].columns[group.columns[0]];
            first.name.starts_with("twist.twist.")
        });
        let mut frames = frames.to_vec();
        frames.sort_by_key(|frame| is_odometry && *frame != Frame::Body);
        let rates = slopes(&times, positions);
        let frames = (frames.iter()).filter_map(|frame| Some((*frame, turned(&raw, *frame)?)));
        let found = scale(&rates, &frames.collect::<Vec<_>>(), units);
        lines.insert(velocity, velocity_lines(found, of, is_odometry));
    }
}

fn said(reading: &Reading, as_well: &[Reading]) -> Vec<String> {
    let mut notes = Vec::new();
    if !reading.fits() {
        notes.push(format!(
            "feet on the ground move by {:.0} mm in the best reading that was found: check order, signs, offsets and \
             contact",
            1e3 * reading.slip_m
        ));
    }
    let others = as_well.iter().map(|other| {
        let (position, joint) = (other.position.0, other.joint.0);
        let order = ["", ", joints grouped by kind"][usize::from(other.by_kind)];
        format!("positions in {position}, angles in {joint}{order}")
    });
    let others = others.collect::<Vec<_>>().join("; ");
    if !others.is_empty() {
        notes.push(format!(
            "feet on the ground stay in place as well with {others}"
        ));
    }
    notes
}

fn sign_line(signs: &[f64]) -> Option<String> {
    let negative: Vec<usize> = (0..signs.len()).filter(|i| signs[*i] < 0.0).collect();
    if negative.is_empty() {
        return None;
    }
    if negative.len() == signs.len() {
        return Some("sign = -1".to_owned());
    }
    let names = (negative.iter()).map(|i| format!("\"{}\" = -1", JOINT_NAMES[*i]));
    let names = names.collect::<Vec<_>>().join(", ");
    Some(format!("sign = {{ {names} }}"))
}

fn velocity_lines(found: Option<Scale>, of: &str, is_odometry: bool) -> Vec<String> {
    let Some(scale) = found else {
        let (sign, what) = match is_odometry {
            true => ("", "an odometry's"),
            false => ("# ", "unknown"),
        };
        let line = format!("{sign}frame = \"body\"   # {what}: it does not follow {of}");
        return vec![line];
    };
    let why = format!("   # by the change of {of}");
    let mut lines = vec![unit_line(scale.unit, &why)];
    if scale.sign < 0.0 {
        lines.push("sign = -1".to_owned());
    }
    match scale.frame {
        Frame::Body => lines.push("frame = \"body\"".to_owned()),
        Frame::World if of == "the angles" => lines.push("frame = \"world\"".to_owned()),
        Frame::World | Frame::Angles => {}
    }
    lines
}

pub(super) fn order_line(order: Option<&str>, group: &Group) -> Option<String> {
    let (order, why) = match order {
        Some(order) => (order, "feet on the ground stay in place"),
        None if group.is_counted => (
            "fr.* fl.* rr.* rl.*",
            "assumed: the columns are only counted",
        ),
        None => return None,
    };
    Some(format!("order = \"{order}\"   # {why}"))
}
