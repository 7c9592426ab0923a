//! Robots from files: TOML, URDF, the object in a model file, the built-in robots; and tables of joint losses.
//!
//! In: a name, or the path or text of a file. Out: a checked [`Robot`] with its legs in romc's order, or an error with
//! file, place, the text found and the text expected. Legs are matched by the positions of their first joints, joints
//! by their order from the trunk. Read `identity.rs` first, the grammar, which also checks plausibility. `legs.rs`
//! makes a robot of it, `urdf` finds the legs of a tree. `docs/reference/robots.md` describes the file.
//!
//! ```
//! use romc::robot::{Leg, Robot};
//! use romc::robot_file;
//!
//! let own = robot_file::find("go1")?;
//! let text = robot_file::to_toml(own).replace("\"go1\"", "\"lighter\"").replace("12.01", "9.5");
//! let lighter = robot_file::from_text("lighter.toml", &text, &Default::default())?.robot;
//! assert_eq!((lighter.name, lighter.mass_kg()), ("lighter", 9.5));
//! let q = [0.1, 0.7, -1.4];
//! assert_eq!(lighter.geometry(Leg::RearLeft).foot_position(&q), own.geometry(Leg::RearLeft).foot_position(&q));
//! # Ok::<(), romc::robot_file::RobotFileError>(())
//! ```

mod identity;
mod legs;
mod read;
mod urdf;

pub use identity::{RobotEntry, RobotReading, to_toml};
pub use legs::{ActuatorsEntry, leg_moments, read_actuators};
pub use read::{RobotFileError, RobotOptions, by_name, find, from_text, known_names, open};

use std::path::Path;

use identity::{Axis, JointEntry, LARGEST_ANGLE_RAD, LegEntry, identified, namesake};
use legs::{Part, Places, build};
use nalgebra::{Rotation3, Unit, Vector3};
use read::{from_toml_text, keep, text_of, word};
use serde::{Deserialize, Serialize};

use crate::files::{Fault, Located, Place, is_invisible};
use crate::robot::{
    Actuators, FOOT_DIM, GRAVITY_M_S2, JOINT_DIM, JOINT_NAMES, LEG_JOINT_DIM, Leg, LegGeometry,
    LegMoments, Robot, RobotError,
};

type Result<T, E = RobotFileError> = std::result::Result<T, E>;
