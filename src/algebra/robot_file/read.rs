//! From a name or a file to a robot.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use serde::de::DeserializeOwned;

use super::entry::RobotEntry;
use super::error::{RobotFileError, RobotFileFault};
use super::urdf;
use crate::files::{Located, Place, read_toml};
use crate::robot::Robot;

/// Largest file of a robot; a URDF with meshes beside it is far smaller.
const MAX_FILE_BYTES: u64 = 16 << 20;

/// The robot of a name, or of a file that ends in `.toml` or `.urdf`.
///
/// # Errors
/// [`RobotFileFault::Unknown`] for what is neither, else as [`read`].
pub fn find(name_or_file: &str) -> Result<&'static Robot, RobotFileError> {
    match Robot::by_name(name_or_file) {
        Ok(robot) => Ok(robot),
        Err(unknown) => match ending(Path::new(name_or_file)).as_str() {
            "toml" | "urdf" | "xml" => read(Path::new(name_or_file), &[]),
            _ => Err(Located::new(
                "",
                Place::Whole,
                RobotFileFault::Unknown(unknown),
            )),
        },
    }
}

fn ending(path: &Path) -> String {
    let ending = path.extension().unwrap_or_default();
    ending.to_string_lossy().to_lowercase()
}

/// Reads a robot from a TOML or, by its ending, a URDF file; `feet` names the links of the feet of a
/// URDF, empty to find them.
///
/// # Errors
/// [`RobotFileError`] with the entry that is wrong or missing.
pub fn read(path: &Path, feet: &[String]) -> Result<&'static Robot, RobotFileError> {
    let file = path.display().to_string();
    let text = text_of(path)?;
    match ending(path).as_str() {
        "toml" if feet.is_empty() => from_toml(&file, &text),
        "toml" => {
            let found = format!("{file} with links of feet");
            let expected = "a URDF".to_owned();
            let fault = RobotFileFault::Unexpected { found, expected };
            Err(Located::new("", Place::Option("--feet"), fault))
        }
        _ => from_urdf(&file, &text, feet),
    }
}

/// The text of a file of bounded size.
pub(super) fn text_of(path: &Path) -> Result<String, RobotFileError> {
    let file = path.display().to_string();
    let fault = |fault| RobotFileError::new(&file, Place::Whole, fault);
    if !["urdf", "xml"].contains(&ending(path).as_str()) {
        return read_toml(path).map_err(|source| fault(RobotFileFault::Read(source)));
    }
    let mut text = String::new();
    // One byte more than allowed distinguishes a file that is too large from one that just fits.
    File::open(path)
        .and_then(|open| open.take(MAX_FILE_BYTES + 1).read_to_string(&mut text))
        .map_err(|source| fault(RobotFileFault::Read(source)))?;
    match text.len() as u64 > MAX_FILE_BYTES {
        true => Err(fault(RobotFileFault::TooLarge(MAX_FILE_BYTES))),
        false => Ok(text),
    }
}

/// Reads a robot from TOML; `file` names it in errors.
///
/// # Errors
/// As [`read`].
pub fn from_toml(file: &str, text: &str) -> Result<&'static Robot, RobotFileError> {
    from_toml_text::<RobotEntry>(file, text)?.robot(file)
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
    urdf::entry(file, text, feet)?.robot(file)
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
        let a1 = to_toml(Robot::by_name("a1").unwrap()).replace("12.78", "12.79");
        let error = from_toml("r.toml", &a1).unwrap_err().to_string();
        assert!(error.contains("r.toml: name: found \"a1\" with other numbers"));
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
