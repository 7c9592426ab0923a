//! Units, signs, axes and orders of the guessed map: by names, by derivatives, and by the robot's geometry.

use std::cmp::Ordering;
use std::f64::consts::TAU;

use super::super::elements::{angle_rates, in_world, unwrap};
use super::feet::force_lines;
use super::physics::{NamedUnit, Reading, Scale, Torques, View, reach};
use super::write::{Lines, Source, unit_line};
use super::*;

const ANGLE: [(&str, f64); 3] = [
    ("rad", 1.0),
    ("deg", std::f64::consts::PI / 180.0),
    ("rpm", std::f64::consts::PI / 30.0),
];
const LENGTHS: [&str; 3] = ["m", "cm", "mm"];
const PITCH_RAD: f64 = 1.6; // largest pitch for which radians are the first choice

type Attitude = (Vec<String>, DMatrix<f64>); // a way to read the trunk's attitude: its lines, and roll, pitch and yaw

impl Source<'_> {
    /// Lines of each quantity, the order of the joints' columns, if they are counted and grouped by kind, and notes.
    pub(crate) fn scales(&self) -> (Lines, Option<&'static str>, Vec<String>) {
        let (mut lines, mut notes) = (Lines::new(), Vec::new());
        if let Some(feet) = self.group(Quantity::Feet) {
            let (own, note) = force_lines(self.raw(feet));
            lines.insert(Quantity::Feet, own);
            notes.extend(note);
        }
        let mut attitudes = self.attitudes();
        let (attitude, reading) = self.choice(&attitudes, &lines);
        notes.extend(said(&reading));
        let turned = |what: &str, signs: &[f64]| {
            sign_line(signs).map(|line| format!("{what}: {line}, as the feet and the weight show"))
        };
        notes.extend(turned("joint.position", &reading.signs));
        let of_torques = |(signs, _): Torques| turned("joint.torque", &signs);
        notes.extend(reading.torques.and_then(of_torques));
        let attitude = (attitude < attitudes.len()).then(|| attitudes.remove(attitude));
        self.trunk(attitude, reading.position, &mut lines);
        self.joints(&reading, &mut lines);
        let order = reading.by_kind.then_some("*.hx *.hy *.kn");
        (lines, order, notes)
    }

    /// The reading under which feet on the ground stay best in place; by the joints' limits if all are in the air.
    fn choice(&self, attitudes: &[Attitude], lines: &Lines) -> (usize, Reading) {
        let place = self.raw_of(Quantity::BodyPosition);
        let by_height = || match reach(place.row(2).iter().copied()) {
            60.0.. => "mm",
            4.0.. => "cm",
            _ => "m",
        };
        let positions = self.units(Quantity::BodyPosition, &["mm", "cm"], &LENGTHS, by_height);
        let by_size = || self.angle_by_limits();
        let told = ["mrad", "rad", "deg"];
        let joints = self.units(Quantity::JointPosition, &told, &["rad", "deg"], by_size);
        let group = self.group(Quantity::JointPosition);
        let is_counted = group.is_some_and(|group| group.is_counted);
        let orders: &[bool] = if is_counted { &[false, true] } else { &[false] };
        let mut found: Option<(usize, Reading)> = None;
        for (attitude, (own, _)) in attitudes.iter().enumerate() {
            let Some(recording) = self.without_scales(own, lines) else {
                continue;
            };
            let view = View::of(&recording, self.robot);
            if let Some(mut reading) = view.best([&positions, &joints], orders)
                && (found.as_ref()).is_none_or(|(_, best)| reading.beats(best))
            {
                reading.torques = view.torques(&mut reading);
                found = Some((attitude, reading));
            }
        }
        found.unwrap_or_else(|| (0, self.by_limits(positions[0], joints[0])))
    }

    fn raw_of(&self, quantity: Quantity) -> DMatrix<f64> {
        let zeros = || DMatrix::zeros(quantity.elements().len(), 1);
        let group = self.group(quantity);
        group.map_or_else(zeros, |group| self.raw(group))
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
        let is_steep = || reach(values.row(1).iter().copied()) > PITCH_RAD;
        let first = || if is_steep() { "deg" } else { "rad" };
        let both = ["rad", "deg"];
        let units = self.units(Quantity::Orientation, &both, &both, first);
        let of_unit = |(unit, factor): NamedUnit| (vec![unit_line(unit, "")], &values * factor);
        units.into_iter().map(of_unit).collect()
    }

    /// The log read with this attitude and these lines of the feet, all other numbers unscaled.
    fn without_scales(&self, attitude: &[String], lines: &Lines) -> Option<Recording> {
        let mut text = format!("[time]\n{}\n", self.time);
        let has_torques = self.group(Quantity::JointTorque).is_some();
        let is_required = |quantity: &Quantity| quantity.is_required();
        for quantity in Quantity::ALL.into_iter().filter(is_required) {
            // Torques are not needed to detect standing feet.
            let group = match quantity {
                Quantity::JointTorque if !has_torques => self.group(Quantity::JointPosition)?,
                _ => self.group(quantity)?,
            };
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
        if !has_torques {
            let segments = recording.segments.iter_mut();
            segments.for_each(|segment| segment.torque_nm.fill(0.0));
        }
        Some(recording)
    }

    /// The unit in which more angles are within the joints' limits, apart from turns and signs; degrees beyond a turn.
    fn angle_by_limits(&self) -> &'static str {
        let values = self.raw_of(Quantity::JointPosition);
        let inside = |factor: f64| -> usize {
            let rows = values.row_iter().zip(self.robot.joint_limit_rad());
            let of_row = rows.map(|(row, (low, high))| {
                let is_inside = |angle: f64| (angle - low).rem_euclid(TAU) <= high - low;
                let either = |angle: &f64| is_inside(*angle) || is_inside(-angle);
                row.iter().map(|v| factor * v).filter(either).count()
            });
            of_row.sum()
        };
        let is_degrees = match inside(ANGLE[1].1).cmp(&inside(ANGLE[0].1)) {
            Ordering::Equal => reach(values.iter().copied()) > TAU,
            order => order.is_gt(),
        };
        if is_degrees { "deg" } else { "rad" }
    }

    fn by_limits(&self, position: NamedUnit, joint: NamedUnit) -> Reading {
        let mut reading = Reading::plain(position, joint, false);
        let values = self.raw_of(Quantity::JointPosition) * joint.1;
        for (row, (low, high)) in self.robot.joint_limit_rad().iter().enumerate() {
            let range = low - 0.1..=high + 0.1;
            let inside = |sign: f64| {
                let signed = values.row(row).into_iter().map(|value| sign * value);
                signed.filter(|value| range.contains(value)).count()
            };
            if inside(-1.0) > 2 * inside(1.0) {
                reading.signs[row] = -1.0;
            }
        }
        reading
    }

    fn joints(&self, reading: &Reading, lines: &mut Lines) {
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
        let is_told = self.told(group, &["mrad", "rad", "deg"]).is_some();
        let why = match is_told || reading.joint.0 == "rad" {
            true => "",
            false => "   # by their size and the feet",
        };
        let (unit, signs) = (reading.joint.0, &reading.signs);
        put(Quantity::JointPosition, unit, why, signs);
        if let Some((velocity, times)) = self.beside(Quantity::JointVelocity, group) {
            let (velocity, rates) = (in_order(velocity), slopes(&times, &position));
            let mut own = reading.signs;
            let mut units = Vec::new();
            for row in 0..JOINT_DIM {
                let [velocity, rate] = [&velocity, &rates].map(|m| m.rows(row, 1).into_owned());
                if let Some(found) = scale(&rate, &[(Frame::Angles, velocity)], &ANGLE) {
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
            let carries = "   # unit and signs by the weight that the feet carry";
            let nothing = "   # signs as of the angles: the torques carry nothing";
            let of_weight = (reading.torques).map(|(signs, (unit, _))| (signs, unit, carries));
            let (signs, unit, why) = of_weight.unwrap_or((reading.signs, "N m", nothing));
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
        if let Some((own, _)) = &attitude {
            lines.insert(Quantity::Orientation, own.clone());
        }
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
        let own = self.group(velocity);
        let is_odometry = own.is_some_and(|own| self.first_name(own).starts_with("twist.twist."));
        let mut frames = frames.to_vec();
        frames.sort_by_key(|frame| is_odometry && *frame != Frame::Body);
        let rates = slopes(&times, positions);
        let frames = (frames.iter()).filter_map(|frame| Some((*frame, turned(&raw, *frame)?)));
        let found = scale(&rates, &frames.collect::<Vec<_>>(), units);
        lines.insert(velocity, velocity_lines(found, of, is_odometry));
    }
}

fn said(reading: &Reading) -> Vec<String> {
    let mut notes = Vec::new();
    if !reading.fits() {
        notes.push(format!(
            "feet on the ground move by {:.0} mm in the best reading that was found: check order, signs, offsets and \
             contact",
            1e3 * reading.slip_m
        ));
    }
    let others = reading.as_well.iter().map(|other| {
        let (position, joint) = (other.position.0, other.joint.0);
        let order = ["", ", joints grouped by kind"][usize::from(other.by_kind)];
        format!("positions in {position}, angles in {joint}{order}")
    });
    let others = others.collect::<Vec<_>>().join("; ");
    if !others.is_empty() {
        let found = "feet on the ground stay in place as well with";
        notes.push(format!("{found} {others}"));
    }
    notes
}

fn sign_line(signs: &[f64]) -> Option<String> {
    let negative = JOINT_NAMES
        .iter()
        .zip(signs)
        .filter(|(_, sign)| **sign < 0.0);
    let names = Vec::from_iter(negative.map(|(name, _)| format!("\"{name}\" = -1")));
    match names.len() {
        0 => None,
        JOINT_DIM => Some("sign = -1".to_owned()),
        _ => Some(format!("sign = {{ {} }}", names.join(", "))),
    }
}

fn velocity_lines(found: Option<Scale>, of: &str, is_odometry: bool) -> Vec<String> {
    let Some(scale) = found else {
        let odometry = is_odometry.then_some(("", "an odometry's"));
        let (sign, what) = odometry.unwrap_or(("# ", "unknown"));
        let line = format!("{sign}frame = \"body\"   # {what}: it does not follow {of}");
        return vec![line];
    };
    let why = format!("   # by the change of {of}");
    let mut lines = vec![unit_line(scale.unit, &why)];
    lines.extend((scale.sign < 0.0).then(|| "sign = -1".to_owned()));
    let frame = match scale.frame {
        Frame::Body => Some("body"),
        Frame::World if of == "the angles" => Some("world"),
        Frame::World | Frame::Angles => None,
    };
    lines.extend(frame.map(|frame| format!("frame = \"{frame}\"")));
    lines
}

pub(super) fn order_line(order: Option<&str>, group: &Group) -> Option<String> {
    let shown = order.map(|order| (order, "feet on the ground stay in place"));
    let counted = "fr.* fl.* rr.* rl.*";
    let why = "assumed: the columns are only counted";
    let (order, why) = shown.or(group.is_counted.then_some((counted, why)))?;
    Some(format!("order = \"{order}\"   # {why}"))
}
