//! The robots that romc brings, and those that were read.

use std::collections::BTreeSet;
use std::sync::{Mutex, OnceLock, PoisonError};

use super::entry::RobotEntry;
use super::legs::{self, Places};
use super::read;
use crate::robot::{Robot, RobotError};

const KNOWN: [(&str, &str); 3] = [
    ("go1", include_str!("known/go1.toml")),
    ("go2", include_str!("known/go2.toml")),
    ("a1", include_str!("known/a1.toml")),
];

/// The robot of romc's own that is named so, such as `go1`.
pub fn by_name(name: &str) -> Result<&'static Robot, RobotError> {
    static ROBOTS: [OnceLock<&Robot>; KNOWN.len()] = [const { OnceLock::new() }; KNOWN.len()];
    let known = KNOWN.iter().position(|(known, _)| *known == name);
    let at = known.ok_or_else(|| RobotError::UnknownRobot {
        found: name.to_owned(),
        known: known_names().join(", "),
    })?;
    Ok(ROBOTS[at].get_or_init(|| {
        let (file, text) = KNOWN[at];
        let entry = read::from_toml_text::<RobotEntry>(file, text);
        let robot = entry.and_then(|entry| legs::build(&entry, &Places::keys(file)));
        keep(robot.expect("a file of romc's own, read by a test"))
    }))
}

pub fn known_names() -> Vec<&'static str> {
    KNOWN.iter().map(|(name, _)| *name).collect()
}

/// The one robot that is equal to this one: robots live as long as the process, each once.
pub(super) fn keep(robot: Robot) -> &'static Robot {
    static KEPT: Mutex<Vec<&'static Robot>> = Mutex::new(Vec::new());
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(same) = kept.iter().find(|known| ***known == robot) {
        return same;
    }
    let robot: &'static Robot = Box::leak(Box::new(robot));
    kept.push(robot);
    robot
}

pub(super) fn word(text: &str) -> &'static str {
    static WORDS: Mutex<BTreeSet<&'static str>> = Mutex::new(BTreeSet::new());
    let mut words = WORDS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(same) = words.get(text) {
        return same;
    }
    let text: &'static str = Box::leak(text.to_owned().into_boxed_str());
    words.insert(text);
    text
}
