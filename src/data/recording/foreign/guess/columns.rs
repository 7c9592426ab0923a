//! Columns sorted into quantities, and the clock among them.

use std::cmp::Reverse;

use super::names::{Reading, is_quantity, is_time, is_wanted, read};
use super::*;
use crate::recording::preprocess::median;

#[derive(Debug, Clone)]
pub(super) struct Group {
    pub quantity: Quantity,
    pub log: usize,
    pub columns: Vec<usize>,
    pub is_quaternion: bool,
    pub is_counted: bool,
    pub others: Vec<String>,
    pub is_tie: bool, // whether one of these fits no less than the columns, which are only the first
    is_wanted: bool,
    family: Vec<String>,
}

impl Group {
    fn qualifiers(&self) -> impl Iterator<Item = &String> {
        self.family.iter().filter(|word| !is_quantity(word))
    }

    /// Whether its legs are only counted, as an arm's joints may be; Unitree's low-level state counts in romc's order.
    pub(super) fn is_unnamed(&self, logs: &[Log]) -> bool {
        let is_motor = |channel: &Channel| {
            let name = &channel.name;
            name.starts_with("motor_state[") || name.starts_with("motorState[")
        };
        let is_unitree = || logs[self.log].columns.iter().any(is_motor);
        self.is_counted && self.quantity.is_by_leg() && !is_unitree()
    }
}

#[derive(Debug, Clone)]
pub(super) struct Clock {
    pub name: String,
    pub unit: &'static str,
}

/// The quantities found by names. Of several families it is the measured one that matches the other quantities and has
/// the highest rate.
pub(super) fn groups(logs: &[Log], robot: &Robot) -> Vec<Group> {
    // Rates that differ by less than a tenth are of the same class.
    let class = |rate: f64| (10.0 * rate.ln()).round() as i32;
    let rates: Vec<_> = logs.iter().map(|log| rate_hz(log).map(class)).collect();
    let all = complete(logs, robot);
    let of = |quantity: Quantity| all.iter().filter(move |group| group.quantity == quantity);
    // Quantities of joints, or of the body, in the same words: of `q_sim`, `q` and `tau` the last two belong together.
    let fellows = |one: &Group| -> usize {
        let own = one.quantity;
        let is_fellow =
            |other: &Quantity| *other != own && other.is_of_joints() == own.is_of_joints();
        let is_alike = |other: &Group| other.qualifiers().eq(one.qualifiers());
        let others = Quantity::ALL.into_iter().filter(is_fellow);
        others.filter(|other| of(*other).any(is_alike)).count()
    };
    let rate = |group: &Group| Reverse(rates[group.log].unwrap_or_default());
    let preference = |group: &&Group| {
        let (fellows, words) = (Reverse(fellows(group)), group.family.len());
        let is_unnamed = group.is_unnamed(logs);
        (group.is_wanted, is_unnamed, rate(group), fellows, words)
    };
    let first = |quantity| of(quantity).min_by_key(preference);
    let [joints, body] = [Quantity::JointPosition, Quantity::BodyPosition].map(first);
    let chosen = Quantity::ALL.into_iter().filter_map(|quantity| {
        let base = match quantity.is_by_leg() {
            true => joints.or(body),
            false => body.or(joints),
        };
        let is_base = |group: &Group| base.is_some_and(|base| std::ptr::eq(base, group));
        // The base is alike to nothing but itself.
        let rank = |group: &Group, base: Option<&Group>| {
            let same_log = base.is_some_and(|base| base.log == group.log);
            let words = base.iter().flat_map(|base| &base.family);
            let words = words.filter(|word| group.family.contains(word)).count();
            let plain = (group.is_quaternion, group.family.len());
            let (log, words) = (Reverse(same_log), Reverse(words));
            (group.is_unnamed(logs), log, rate(group), words, plain)
        };
        let preference = |group: &&Group| (!is_base(group), group.is_wanted, rank(group, base));
        let best = of(quantity).min_by_key(preference)?;
        let is_other = |group: &&Group| {
            let kind = |group: &Group| (group.is_wanted, group.is_quaternion);
            !std::ptr::eq(*group, best) && kind(group) == kind(best)
        };
        let others: Vec<&Group> = of(quantity).filter(is_other).collect();
        let base = base.filter(|base| !std::ptr::eq(*base, best));
        // Tables of one topic hold the same messages.
        let is_apart =
            |other: &Group| other.log == best.log || logs[other.log].name != logs[best.log].name;
        let ties = |other: &&Group| {
            is_apart(other) && rank(other, base) == rank(best, base) && differ(logs, best, other)
        };
        Some(Group {
            is_tie: others.iter().any(ties),
            others: others.iter().map(|own| in_words(logs, own)).collect(),
            ..best.clone()
        })
    });
    chosen.collect()
}

fn in_words(logs: &[Log], group: &Group) -> String {
    let log = &logs[group.log];
    let name = |at: usize| &log.columns[group.columns[at]].name;
    let columns = format!("`{}` to `{}`", name(0), name(group.columns.len() - 1));
    match (log.name.is_empty(), rate_hz(log)) {
        (true, _) => columns,
        (false, None) => format!("{columns} of `{}`", log.name),
        (false, Some(rate)) => format!("{columns} of `{}` ({rate:.0} Hz)", log.name),
    }
}

fn rate_hz(log: &Log) -> Option<f64> {
    let times = log.columns[log.clock?].times();
    let span = times.last()? - times.first()?;
    (span > 0.0).then(|| (times.len() - 1) as f64 / span)
}

fn differ(logs: &[Log], one: &Group, other: &Group) -> bool {
    let values = |group: &Group, at: usize| &logs[group.log].columns[group.columns[at]].values;
    (0..one.columns.len()).any(|at| values(one, at) != values(other, at))
}

type Family = (usize, Vec<(usize, Reading)>);

fn complete(logs: &[Log], robot: &Robot) -> Vec<Group> {
    let mut families: Vec<Family> = Vec::new();
    for (index, log) in logs.iter().enumerate() {
        for (column, channel) in log.columns.iter().enumerate() {
            // The topic may complete a column's name: `/foot_contacts` of `position[fr]`.
            let in_topic = || read(&format!("{} {}", log.name, channel.name));
            let of_robot = of_robot(&channel.name, robot);
            let reading = of_robot.or_else(|| read(&channel.name)).or_else(in_topic);
            let Some(mut reading) = reading else {
                continue;
            };
            reading.is_wanted |= is_wanted(&log.name);
            let same = |(own, members): &&mut Family| {
                let of = |one: &Reading| (one.quantity, one.is_quaternion);
                let first = &members[0].1;
                *own == index && of(first) == of(&reading) && first.family == reading.family
            };
            match families.iter_mut().find(same) {
                Some((_, members)) => members.push((column, reading)),
                None => families.push((index, vec![(column, reading)])),
            }
        }
    }
    let group = |(log, mut members): Family| {
        from_zero(&mut members);
        lists_of_three(&mut members);
        bare_hips(&mut members);
        let first = &members[0].1;
        let count = match first.is_quaternion {
            true => QUATERNION.len(),
            false => first.quantity.elements().len(),
        };
        let column = |element| {
            let found = members.iter().find(|(_, own)| own.element == element);
            found.map(|(column, _)| *column)
        };
        Some(Group {
            quantity: first.quantity,
            log,
            columns: (0..count).map(column).collect::<Option<_>>()?,
            is_quaternion: first.is_quaternion,
            is_counted: members.iter().any(|(_, reading)| reading.is_counted),
            others: Vec::new(),
            is_tie: false,
            is_wanted: first.is_wanted,
            family: first.family.split_whitespace().map(str::to_owned).collect(),
        })
    };
    families.into_iter().filter_map(group).collect()
}

fn of_robot(name: &str, robot: &Robot) -> Option<Reading> {
    let low = name.to_lowercase();
    let names = robot.joint_names.iter().map(|joint| joint.to_lowercase());
    let found = (names.enumerate()).filter(|(_, joint)| !joint.is_empty() && low.contains(joint));
    let (element, joint) = found.max_by_key(|(_, joint)| joint.len())?; // `joint_11` contains `joint_1`
    let (before, after) = low.split_once(&joint)?;
    let is_cut = |c: Option<char>| c.is_some_and(char::is_alphanumeric);
    if is_cut(before.chars().next_back()) || is_cut(after.chars().next()) {
        return None;
    }
    let reading = read(&format!("fr {before} {after} hx"))?; // the rest as it would be of a joint that is known
    (reading.quantity.is_of_joints()).then_some(Reading { element, ..reading })
}

/// Hips without a word for which one are the second joints where the first have another name: `abad hip knee`.
fn bare_hips(members: &mut [(usize, Reading)]) {
    let is_joint = members[0].1.quantity.is_of_joints();
    let another =
        |(_, reading): &(usize, Reading)| reading.element.is_multiple_of(3) && !reading.is_bare_hip;
    if is_joint && members.iter().any(another) {
        let hips = (members.iter_mut()).filter(|(_, reading)| reading.is_bare_hip);
        hips.for_each(|(_, reading)| reading.element += 1);
    }
}

fn from_zero(members: &mut [(usize, Reading)]) {
    let last = members[0].1.quantity.elements().len();
    let counted = members.iter_mut().map(|(_, reading)| reading);
    let mut counted: Vec<&mut Reading> = counted.filter(|reading| reading.is_counted).collect();
    let has = |number: usize| counted.iter().any(|reading| reading.element == number);
    if has(last) && !has(0) {
        counted.iter_mut().for_each(|reading| reading.element -= 1);
    }
}

/// Lists of three counted positions or velocities are the trunk's.
fn lists_of_three(members: &mut [(usize, Reading)]) {
    let trunk = match members[0].1.quantity {
        Quantity::JointPosition => Quantity::BodyPosition,
        Quantity::JointVelocity => Quantity::BodyVelocity,
        _ => return,
    };
    let is_counted = |(_, reading): &(usize, Reading)| reading.is_counted && reading.element < 3;
    if members.len() == 3 && members.iter().all(is_counted) {
        (members.iter_mut()).for_each(|(_, reading)| reading.quantity = trunk);
    }
}

/// The column that counts time, its unit by name or by the distance of samples.
pub(super) fn clock(logs: &[Log], groups: &[Group]) -> Option<Clock> {
    let base = groups.first()?;
    let log = &logs[base.log];
    if let Some(column) = log.clock {
        let name = log.columns[column].name.clone();
        return Some(Clock { name, unit: "s" });
    }
    let counts = |channel: &&Channel| mean_step(channel).is_some();
    let candidates = || log.columns.iter().filter(counts);
    let named = candidates().find(|channel| is_time(&channel.name));
    let channel = named.or_else(|| candidates().next())?;
    const UNITS: [&str; 4] = ["s", "ms", "us", "ns"];
    let told = unit(&channel.name, &["ms", "us", "ns", "s"]);
    let step = mean_step(channel)?; // samples further apart show no jump
    let is_possible = |unit: &&str| {
        let factor = Dimension::Time.factor(unit);
        factor.is_some_and(|factor| (2e-4..0.06).contains(&(factor * step)))
    };
    let unit = told.into_iter().chain(UNITS).find(is_possible)?;
    let name = channel.name.clone();
    Some(Clock { name, unit })
}

/// Typical distance of samples in a column that counts upwards, else nothing.
fn mean_step(channel: &Channel) -> Option<f64> {
    let times = channel.times();
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let count = steps.len();
    steps.retain(|step| *step > 0.0);
    // Several jumps in a file let time jump back now and then.
    let counts = !steps.is_empty() && (count - steps.len()) * 50 <= count;
    counts.then(|| median(steps.into_iter()))
}
