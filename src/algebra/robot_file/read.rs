//! From a name or a file to a robot.

use std::path::Path;

use serde::de::DeserializeOwned;

use super::entry::RobotEntry;
use super::error::{RobotFileError, RobotFileFault};
use super::identity::{RobotReading, identified};
use super::legs::Places;
use super::urdf;
use crate::files::size::{Format, read_text_capped};
use crate::files::{Located, Place, read_toml};
use crate::robot::Robot;

/// What a command says of a robot's file besides its path.
#[derive(Clone, Copy, Debug, Default)]
pub struct RobotOptions<'a> {
    /// Links of the four feet of a URDF, each with a point in its frame where that is not the foot
    /// (`LINK:x,y,z`); empty to find them.
    pub feet: &'a [String],
    /// The robot's name instead of the file's.
    pub name: Option<&'a str>,
}

/// The robot of a name, or of a file that ends in `.toml` or `.urdf`.
///
/// # Errors
/// [`RobotFileFault::Unknown`] for what is neither, else as [`read`].
pub fn find(name_or_file: &str) -> Result<&'static Robot, RobotFileError> {
    Ok(open(name_or_file, &RobotOptions::default())?.robot)
}

/// [`find`] with options and notes.
///
/// # Errors
/// As [`find`], and for options of a robot that has no file.
pub fn open(
    name_or_file: &str,
    options: &RobotOptions<'_>,
) -> Result<RobotReading, RobotFileError> {
    let path = Path::new(name_or_file);
    match (Robot::by_name(name_or_file), ending(path).as_str()) {
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
            Err(misplaced(
                option,
                format!("romc's own {name_or_file}"),
                "a file",
            ))
        }
        (Err(_), "toml" | "urdf" | "xml" | "xacro") => read_with(path, options),
        (Err(unknown), _) => {
            let fault = RobotFileFault::Unknown(unknown);
            Err(Located::new("", Place::Whole, fault))
        }
    }
}

fn ending(path: &Path) -> String {
    let ending = path.extension().unwrap_or_default();
    ending.to_string_lossy().to_lowercase()
}

fn misplaced(option: &'static str, found: String, expected: &str) -> RobotFileError {
    let expected = expected.to_owned();
    let fault = RobotFileFault::Unexpected { found, expected };
    Located::new("", Place::Option(option), fault)
}

/// Reads a robot from a TOML or, by its ending, a URDF file; `feet` names the links of the feet of a
/// URDF, empty to find them.
///
/// # Errors
/// [`RobotFileError`] with the entry that is wrong or missing.
pub fn read(path: &Path, feet: &[String]) -> Result<&'static Robot, RobotFileError> {
    Ok(read_with(path, &RobotOptions { feet, name: None })?.robot)
}

fn read_with(path: &Path, options: &RobotOptions<'_>) -> Result<RobotReading, RobotFileError> {
    let file = path.display().to_string();
    let text = text_of(path)?;
    match ending(path).as_str() {
        "toml" if options.feet.is_empty() => toml_reading(&file, &text, options.name),
        "toml" => Err(misplaced(
            "--feet",
            format!("{file} with links of feet"),
            "a URDF",
        )),
        _ => urdf_reading(&file, &text, options),
    }
}

/// The text of a file of bounded size.
pub(super) fn text_of(path: &Path) -> Result<String, RobotFileError> {
    let file = path.display().to_string();
    let fault = |fault| RobotFileError::new(&file, Place::Whole, fault);
    let text = match ending(path).as_str() {
        "toml" => read_toml(path),
        _ => read_text_capped(path, Format::Robot),
    };
    text.map_err(|source| fault(RobotFileFault::Read(source)))
}

/// Reads a robot from TOML; `file` names it in errors.
///
/// # Errors
/// As [`read`].
pub fn from_toml(file: &str, text: &str) -> Result<&'static Robot, RobotFileError> {
    Ok(toml_reading(file, text, None)?.robot)
}

fn toml_reading(
    file: &str,
    text: &str,
    name: Option<&str>,
) -> Result<RobotReading, RobotFileError> {
    let entry = from_toml_text::<RobotEntry>(file, text)?;
    identified(file, entry, &Places::Keys, name, Vec::new())
}

/// Reads a robot from URDF; `feet` names the links of its feet, empty to find them.
///
/// # Errors
/// As [`read`].
pub fn from_urdf(
    file: &str,
    text: &str,
    feet: &[String],
) -> Result<&'static Robot, RobotFileError> {
    Ok(urdf_reading(file, text, &RobotOptions { feet, name: None })?.robot)
}

/// [`from_urdf`] with options and notes.
///
/// # Errors
/// As [`read`].
pub fn urdf_reading(
    file: &str,
    text: &str,
    options: &RobotOptions<'_>,
) -> Result<RobotReading, RobotFileError> {
    let reading = urdf::read(file, text, options.feet, options.name)?;
    identified(
        file,
        reading.entry,
        &reading.places,
        options.name,
        reading.notes,
    )
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
        let fault = RobotFileFault::Syntax(error.message().to_owned());
        Located::new(file, place, fault)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{Leg, LegGeometry};
    use crate::robot_file::to_toml;

    #[test]
    fn known_robots_are_planar_and_come_back_from_their_own_text_as_themselves() {
        for name in Robot::known_names() {
            let robot = Robot::by_name(name).expect("read");
            for leg in Leg::ALL {
                assert!(
                    matches!(robot.geometry(leg), LegGeometry::Planar(_)),
                    "{name} {leg}"
                );
            }
            let again = from_toml(name, &to_toml(robot)).expect("its own text");
            assert!(std::ptr::eq(again, robot), "{name}");
            assert!(std::ptr::eq(find(name).expect("known"), robot));
        }
    }

    #[test]
    fn faults_name_the_entry() {
        let good = to_toml(Robot::by_name("go1").unwrap()).replace("\"go1\"", "\"mine\"");
        for (from, to, said) in [
            (
                "FR_calf_joint",
                "FR_hip_joint",
                "leg[0].joint[2].name: found \"FR_hip_joint\" a second",
            ),
            (
                "torque_nm = 35.55",
                "torque_nm = -1.0",
                "leg[0].joint[2].torque_nm: found -1",
            ),
            (
                "axis = \"y\"",
                "axis = \"w\"",
                "leg[0].joint[1].axis: found Name(\"w\")",
            ),
            (
                "limits_rad = [-0.863, 0.863]",
                "limits_rad = [0.863, -0.863]",
                "the lower limit first",
            ),
            (
                "[0.1881, 0.04675, 0.0]",
                "[0.1881, -0.04675, 0.0]",
                "one at each corner",
            ),
            ("mass_kg", "mass", "unknown field `mass`"),
            ("axis = \"y\"", "axis = \"z\"", "parallel axes"),
        ] {
            assert!(good.contains(from), "{from}");
            let error = from_toml("r.toml", &good.replacen(from, to, 1))
                .unwrap_err()
                .to_string();
            assert!(error.contains(said), "{error}");
        }
    }

    #[test]
    fn another_robot_of_a_known_name_is_one_of_its_own_and_says_what_differs() {
        let a1 = to_toml(Robot::by_name("a1").unwrap()).replace("12.78", "12.79");
        let read = toml_reading("r.toml", &a1, None).unwrap();
        assert_eq!(
            (read.robot.name(), read.robot.mass_kg()),
            ("a1-toml", 12.79)
        );
        assert_eq!(
            read.notes,
            [
                "its numbers are not those of romc's own \"a1\" (mass_kg 12.79 instead of 12.78): it is called \
              \"a1-toml\"; --name (romc robot) gives it another name"
            ]
        );
        assert_eq!(
            toml_reading("r.toml", &a1, Some("mine"))
                .unwrap()
                .robot
                .name(),
            "mine"
        );
        let error = toml_reading("r.toml", &a1, Some("a1"))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("--name: found \"a1\", romc's own robot with other"),
            "{error}"
        );
        // A model file's robot is what it is; it is not renamed.
        let entry: RobotEntry = from_toml_text("r.toml", &a1).unwrap();
        let error = entry.robot("robot").unwrap_err().to_string();
        assert!(error.contains("(mass_kg 12.79 instead of 12.78), expected another name"));
    }

    #[test]
    fn signs_and_offsets_turn_the_same_leg_at_other_angles() {
        let own = Robot::by_name("go1").unwrap();
        let text = to_toml(own).replace("\"go1\"", "\"mine\"");
        // Knees that count the other way, and read 0.4 where the leg is straight.
        let text = text.replace(
            "_calf_joint\", at = [0.0, 0.0, -0.213], axis = \"y\"",
            "_calf_joint\", at = [0.0, 0.0, -0.213], axis = \"y\", sign = -1.0, offset_rad = 0.4",
        );
        let turned = from_toml("mine.toml", &text).unwrap();
        for leg in Leg::ALL {
            let q = [0.1, 0.7, -1.4];
            let read = [q[0], q[1], 0.4 - q[2]];
            let (a, b) = (own.foot_position(leg, &q), turned.foot_position(leg, &read));
            assert!((a - b).norm() < 1e-15, "{leg}: {a} {b}");
            let (a, b) = (own.foot_jacobian(leg, &q), turned.foot_jacobian(leg, &read));
            assert!((a.column(2) + b.column(2)).norm() < 1e-15);
        }
    }
}
