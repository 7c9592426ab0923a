//! From a name or a file to a robot; the robots that romc brings, and those that were read.

use std::collections::BTreeSet;
use std::sync::{Mutex, OnceLock, PoisonError};

use serde::de::DeserializeOwned;

use super::*;
use crate::files::size::{Format, read_text_capped, read_toml};

/// A fault of a robot's file and its place; without a file, of a name or an option.
pub type RobotFileError = Located<Fault>;

#[derive(Clone, Copy, Debug, Default)]
pub struct RobotOptions<'a> {
    /// The four foot links of a URDF, as `LINK:x,y,z` where the foot is not the link's origin; empty to find them.
    pub feet: &'a [String],
    pub name: Option<&'a str>,
}

/// The robot of a name, or of a file that ends in `.toml` or `.urdf`.
pub fn find(name_or_file: &str) -> Result<&'static Robot> {
    Ok(open(name_or_file, &RobotOptions::default())?.robot)
}

pub fn open(name_or_file: &str, options: &RobotOptions<'_>) -> Result<RobotReading> {
    let path = Path::new(name_or_file);
    match (
        crate::robot_file::by_name(name_or_file),
        ending(path).as_str(),
    ) {
        (Ok(robot), _) if options.feet.is_empty() && options.name.is_none() => Ok(RobotReading {
            robot,
            notes: Vec::new(),
        }),
        (Ok(_), _) => {
            let option = if options.feet.is_empty() {
                "--name"
            } else {
                "--feet"
            };
            let found = format!("romc's own {name_or_file}");
            Err(RobotFileError::option(option, found, "a file"))
        }
        (Err(_), "toml" | "urdf" | "xml" | "xacro") => {
            from_text(name_or_file, &text_of(path)?, options)
        }
        (Err(unknown), _) => {
            let text = format!("{unknown}, or a file that ends in .toml or .urdf");
            Err(RobotFileError::text("", Place::Whole, text))
        }
    }
}

fn ending(path: &Path) -> String {
    let ending = path.extension().unwrap_or_default(); // no ending is none of a robot's
    ending.to_string_lossy().to_lowercase()
}

pub(super) fn text_of(path: &Path) -> Result<String> {
    let text = match ending(path).as_str() {
        "toml" => read_toml(path),
        _ => read_text_capped(path, Format::Robot),
    };
    let file = path.display().to_string();
    text.map_err(|source| RobotFileError::io(&file, "read the file", source))
}

/// Reads a robot from TOML or, by the ending of `file`, which names it in errors, URDF.
pub fn from_text(file: &str, text: &str, options: &RobotOptions<'_>) -> Result<RobotReading> {
    if ending(Path::new(file)) != "toml" {
        return urdf::read(file, text, options);
    }
    if !options.feet.is_empty() {
        let found = format!("{file} with links of feet");
        return Err(RobotFileError::option("--feet", found, "a URDF"));
    }
    let entry = from_toml_text::<RobotEntry>(file, text)?;
    identified(entry, &Places::keys(file), options.name, Vec::new())
}

pub(super) fn from_toml_text<T: DeserializeOwned>(file: &str, text: &str) -> Result<T> {
    toml::from_str(text).map_err(|error| {
        let place = match error.span() {
            None => Place::Whole,
            Some(span) => Place::of_byte(text, span.start),
        };
        RobotFileError::text(file, place, error.message())
    })
}

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
        let entry = from_toml_text::<RobotEntry>(file, text);
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
