//! Columns sorted into quantities, and the clock among them.

use super::super::elements::Quantity;
use super::super::log::{Channel, Log};
use super::super::units::Dimension;
use super::names::{Reading, is_time, read, unit};
use crate::recording::preprocess::median;
use crate::robot::JOINT_DIM;

/// The columns of one quantity.
#[derive(Debug, Clone)]
pub(super) struct Group {
    pub quantity: Quantity,
    /// Index of the log.
    pub log: usize,
    /// The columns, by element.
    pub columns: Vec<usize>,
    pub is_quaternion: bool,
    /// Whether elements were counted rather than named.
    pub is_counted: bool,
}

/// The clock of the log, if it is a column.
#[derive(Debug, Clone)]
pub(super) struct Clock {
    pub name: String,
    pub unit: &'static str,
}

/// The quantities that the names say, the first complete family of columns of each.
pub(super) fn groups(logs: &[Log]) -> Vec<Group> {
    let mut families: Vec<(usize, Vec<(usize, Reading)>)> = Vec::new();
    for (index, log) in logs.iter().enumerate() {
        for (column, channel) in log.columns.iter().enumerate() {
            // What a column alone does not say its topic may: `/foot_contacts` of `position[fr]`.
            let in_topic = || read(&format!("{} {}", log.name, channel.name));
            let Some(reading) = read(&channel.name).or_else(in_topic) else {
                continue;
            };
            let same = |(own, members): &&mut (usize, Vec<(usize, Reading)>)| {
                let first = &members[0].1;
                *own == index
                    && first.quantity == reading.quantity
                    && first.is_quaternion == reading.is_quaternion
                    && first.family == reading.family
            };
            match families.iter_mut().find(same) {
                Some((_, members)) => members.push((column, reading)),
                None => families.push((index, vec![(column, reading)])),
            }
        }
    }
    for (_, members) in &mut families {
        lists_of_three(members);
        bare_hips(members);
    }
    let mut out = Vec::new();
    for quantity in Quantity::ALL {
        let complete = families.iter().filter_map(|(log, members)| {
            let first = &members[0].1;
            let count = match first.is_quaternion {
                true => 4,
                false => quantity.elements().len(),
            };
            let column = |element| {
                let mut found = members.iter().filter(|(_, own)| own.element == element);
                found.next().map(|(column, _)| *column)
            };
            let columns: Option<Vec<usize>> = (0..count).map(column).collect();
            let group = Group {
                quantity,
                log: *log,
                columns: columns?,
                is_quaternion: first.is_quaternion,
                is_counted: members.iter().any(|(_, reading)| reading.is_counted),
            };
            (first.quantity == quantity).then_some((first.is_wanted, group))
        });
        // What was measured before what was asked for, angles before quaternions.
        let chosen = complete.min_by_key(|(is_wanted, group)| (*is_wanted, group.is_quaternion));
        out.extend(chosen.map(|(_, group)| group));
    }
    out
}

/// Hips without a word for which one are the second joints where the first have another name: `abad hip knee`.
fn bare_hips(members: &mut [(usize, Reading)]) {
    let is_first = |reading: &Reading| reading.element.is_multiple_of(3);
    let is_joint = members[0].1.quantity.elements().len() == JOINT_DIM;
    let another = |(_, reading): &(usize, Reading)| is_first(reading) && !reading.is_bare_hip;
    if is_joint && members.iter().any(another) {
        let hips = members
            .iter_mut()
            .filter(|(_, reading)| reading.is_bare_hip);
        hips.for_each(|(_, reading)| reading.element += 1);
    }
}

/// Lists of three counted positions or velocities are the trunk's.
fn lists_of_three(members: &mut [(usize, Reading)]) {
    let trunk = match members[0].1.quantity {
        Quantity::JointPosition => Quantity::BodyPosition,
        Quantity::JointVelocity => Quantity::BodyVelocity,
        _ => return,
    };
    let counted = members
        .iter()
        .all(|(_, reading)| reading.is_counted && reading.element < 3);
    if counted && members.len() == 3 {
        members
            .iter_mut()
            .for_each(|(_, reading)| reading.quantity = trunk);
    }
}

/// The column that counts time, its unit by name or by the distance of samples.
pub(super) fn clock(logs: &[Log], groups: &[Group]) -> Option<Clock> {
    let base = groups.first()?;
    let log = &logs[base.log];
    if let Some(column) = log.clock {
        return Some(Clock {
            name: log.columns[column].name.clone(),
            unit: "s",
        });
    }
    let counts = |channel: &&Channel| mean_step(channel).is_some();
    let candidates = || log.columns.iter().filter(counts);
    let named = candidates().find(|channel| is_time(&channel.name));
    let channel = named.or_else(|| candidates().next())?;
    const UNITS: [&str; 4] = ["s", "ms", "us", "ns"];
    let told = unit(&channel.name, &["ms", "us", "ns", "s"]);
    // Samples further apart show no jump.
    let step = mean_step(channel)?;
    let is_possible = |unit: &&str| {
        (Dimension::Time.factor(unit)).is_some_and(|factor| (2e-4..0.06).contains(&(factor * step)))
    };
    Some(Clock {
        name: channel.name.clone(),
        unit: told.into_iter().chain(UNITS).find(is_possible)?,
    })
}

/// Typical distance of samples in a column that counts upwards, else nothing.
fn mean_step(channel: &Channel) -> Option<f64> {
    let times = channel.times();
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let forward: Vec<f64> = steps.iter().copied().filter(|step| *step > 0.0).collect();
    // Several jumps in a file let time jump back now and then.
    let back = steps.len() - forward.len();
    let counts = !forward.is_empty() && back * 50 <= steps.len();
    counts.then(|| median(forward.into_iter()))
}
