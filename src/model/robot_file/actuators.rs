//! What the joints take of the motors' torques, from a file.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::read::RobotFileError;
use super::read::{from_toml_text, text_of};
use crate::robot::{Actuators, GRAVITY_M_S2, JOINT_DIM, JOINT_NAMES, Robot};

const COUNT: &str = "12, or 3 for hx, hy, kn";

/// The table that is read; a file of `romc identify` has others as well.
#[derive(Deserialize)]
struct File {
    robot: Option<String>,
    gravity_m_s2: Option<f64>,
    actuators: ActuatorsEntry,
}

/// Share by which the gravity that was identified with the losses may differ from the earth's.
const GRAVITY_SHARE: f64 = 0.25;

/// Joint losses as files and programs write them: twelve numbers each, or three (hx, hy, kn) that hold for every leg.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActuatorsEntry {
    viscous: Vec<f64>,
    dry: Vec<f64>,
    armature: Vec<f64>,
}

impl ActuatorsEntry {
    /// The entry of a program's arrays by name.
    pub fn of_arrays(mut arrays: BTreeMap<String, Vec<f64>>) -> Result<Self, RobotFileError> {
        let mut take = |name: &str| {
            let missing = || RobotFileError::at("", format!("actuators.{name}"), "nothing", COUNT);
            arrays.remove(name).ok_or_else(missing)
        };
        let entry = Self {
            viscous: take("viscous")?,
            dry: take("dry")?,
            armature: take("armature")?,
        };
        match arrays.into_keys().next() {
            None => Ok(entry),
            Some(name) => {
                let place = format!("actuators.{name}");
                let expected = "viscous, dry and armature alone";
                Err(RobotFileError::at("", place, "an unknown array", expected))
            }
        }
    }

    /// The actuators of the entry, which is `actuators` of `file` in errors.
    pub fn actuators(&self, file: &str) -> Result<Actuators, RobotFileError> {
        let joints = |name: &str, values: &[f64]| match values.len() {
            found @ (3 | JOINT_DIM) => Ok(std::array::from_fn(|joint| values[joint % found])),
            found => {
                let (place, found) = (format!("actuators.{name}"), format!("{found} numbers"));
                Err(RobotFileError::at(file, place, found, COUNT))
            }
        };
        let actuators = Actuators {
            viscous: joints("viscous", &self.viscous)?,
            dry: joints("dry", &self.dry)?,
            armature: joints("armature", &self.armature)?,
        };
        match actuators.unusable() {
            None => Ok(actuators),
            Some((name, joint, found)) => {
                let place = format!("actuators.{name}, joint {}", JOINT_NAMES[joint]);
                let (found, expected) = (found.to_string(), "a number of at least 0");
                Err(RobotFileError::at(file, place, found, expected))
            }
        }
    }
}

/// Reads the table `[actuators]` of a TOML file, such as one of `romc identify`, for a robot if one is known.
pub fn read_actuators(path: &Path, robot: Option<&Robot>) -> Result<Actuators, RobotFileError> {
    let file = path.display().to_string();
    let File {
        robot: of,
        gravity_m_s2: gravity,
        actuators,
    } = from_toml_text(&file, &text_of(path)?)?;
    let is_off = |gravity: &f64| (gravity / GRAVITY_M_S2 - 1.0).abs() > GRAVITY_SHARE;
    if let Some(gravity) = gravity.filter(is_off) {
        let expected = format!(
            "about {GRAVITY_M_S2}: the recordings of this file do not show the robot's losses"
        );
        return Err(RobotFileError::at(
            &file,
            "gravity_m_s2",
            gravity.to_string(),
            expected,
        ));
    }
    match (of, robot.map(Robot::name)) {
        (Some(found), Some(expected)) if found != expected => {
            let expected = format!("{expected}, whose recordings these are, or no such line");
            Err(RobotFileError::at(&file, "robot", found, expected))
        }
        _ => actuators.actuators(&file),
    }
}
