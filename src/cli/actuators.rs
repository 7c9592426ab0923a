//! What the joints take of the motors' torques, from a file.

use std::fs;
use std::path::Path;

use serde::Deserialize;

use super::output::note;
use super::train_settings::refused;
use crate::Error;
use crate::identify::identify;
use crate::recording::RecordingFiles;
use crate::robot::{Actuators, JOINT_DIM, JOINT_NAMES, Robot};

/// The word that stands for no file.
pub(super) const NONE: &str = "none";

/// The word that stands for what the training recordings tell.
pub(super) const IDENTIFIED: &str = "identify";
/// Files of recordings that tell it, at most.
const IDENTIFIED_FROM: usize = 20;

/// The actuators that the first recordings tell, `None` with a note on stderr where they do not.
///
/// # Errors
/// [`Error::Recording`] for a file that cannot be read.
pub(super) fn identified(
    recordings: &RecordingFiles,
    robot: &Robot,
) -> Result<Option<Actuators>, Error> {
    match identify(&recordings.first(IDENTIFIED_FROM)?, robot) {
        Ok(found) => Ok(Some(found.actuators)),
        Err(reason) => {
            note(&format!(
                "torques are those of the motors, as the recordings do not tell the joints' losses: {reason}"
            ));
            Ok(None)
        }
    }
}

/// The tables that are read; a file of `romc identify` has others as well.
#[derive(Deserialize)]
struct File {
    actuators: Table,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    viscous: Vec<f64>,
    dry: Vec<f64>,
    armature: Vec<f64>,
}

/// The actuators of a file with a table `[actuators]`: `viscous` (N m s/rad), `dry` (N m) and
/// `armature` (kg m^2), each with twelve numbers or three (hx, hy, kn) that hold for every leg.
///
/// # Errors
/// [`Error::Read`]; [`Error::Config`] with key and joint for anything but finite numbers of at least 0.
pub(super) fn read(path: &Path) -> Result<Actuators, Error> {
    let text = fs::read_to_string(path).map_err(|source| Error::Read {
        path: path.to_owned(),
        source,
    })?;
    let File { actuators } =
        toml::from_str(&text).map_err(|error| refused(path, error.to_string().trim_end()))?;
    let joints = |name: &str, values: Vec<f64>| -> Result<[f64; JOINT_DIM], Error> {
        let found = values.len();
        match found {
            3 | JOINT_DIM => Ok(std::array::from_fn(|joint| values[joint % found])),
            _ => Err(refused(
                path,
                &format!(
                    "`actuators.{name}`: found {found} numbers, expected 12, or 3 for hx, hy, kn"
                ),
            )),
        }
    };
    let actuators = Actuators {
        viscous: joints("viscous", actuators.viscous)?,
        dry: joints("dry", actuators.dry)?,
        armature: joints("armature", actuators.armature)?,
    };
    match actuators.unusable() {
        None => Ok(actuators),
        Some((name, joint, found)) => Err(refused(
            path,
            &format!(
                "`actuators.{name}`, joint {}: found {found}, expected a number of at least 0",
                JOINT_NAMES[joint]
            ),
        )),
    }
}
