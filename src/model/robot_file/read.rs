//! From a name or a file to a robot.

use std::path::Path;

use serde::de::DeserializeOwned;

use super::entry::RobotEntry;
use super::identity::{RobotReading, identified};
use super::legs::Places;
use super::urdf;
use crate::files::size::{Format, read_text_capped};
use crate::files::{Fault, Located, Place, read_toml};
use crate::robot::Robot;

/// A fault of a robot's file and its place; without a file, of a name or an option.
pub type RobotFileError = Located<Fault>;

/// What a command says of a robot's file besides its path.
#[derive(Clone, Copy, Debug, Default)]
pub struct RobotOptions<'a> {
    /// Links of the four feet of a URDF, each with a point in its frame where that is not the foot (`LINK:x,y,z`);
    /// empty to find them.
    pub feet: &'a [String],
    pub name: Option<&'a str>,
}

/// The robot of a name, or of a file that ends in `.toml` or `.urdf`.
pub fn find(name_or_file: &str) -> Result<&'static Robot, RobotFileError> {
    Ok(open(name_or_file, &RobotOptions::default())?.robot)
}

/// [`find`] with options and notes.
pub fn open(
    name_or_file: &str,
    options: &RobotOptions<'_>,
) -> Result<RobotReading, RobotFileError> {
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

pub(super) fn text_of(path: &Path) -> Result<String, RobotFileError> {
    let text = match ending(path).as_str() {
        "toml" => read_toml(path),
        _ => read_text_capped(path, Format::Robot),
    };
    let file = path.display().to_string();
    text.map_err(|source| RobotFileError::io(&file, "read the file", source))
}

/// Reads a robot from TOML or, by the ending of `file`, which names it in errors, URDF.
pub fn from_text(
    file: &str,
    text: &str,
    options: &RobotOptions<'_>,
) -> Result<RobotReading, RobotFileError> {
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

pub(super) fn from_toml_text<T: DeserializeOwned>(
    file: &str,
    text: &str,
) -> Result<T, RobotFileError> {
    toml::from_str(text).map_err(|error| {
        let place = match error.span() {
            None => Place::Whole,
            Some(span) => Place::of_byte(text, span.start),
        };
        RobotFileError::text(file, place, error.message())
    })
}
