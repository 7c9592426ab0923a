//! Identification of the robot from recordings: gravity, mass, the joints' losses, the legs' own inertia. In:
//! recordings and the robot's geometry. Out: an [`Identification`], each value with its standard error, and its file.
//! Read `estimate` first, the loop around the fit and the rejection of recordings that contradict each other.
//! `equations` has the linear equations of every sample, `windows` their averages, `fit` the weighted least squares.
//! `docs/explanation/identification.md` has the method and measured values.
//!
//! ```
//! use std::path::Path;
//! use romc::identify::identify;
//! use romc::robot::Robot;
//!
//! let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/recordings/go1/test_01.csv.gz");
//! let found = identify(&[romc::recording::read(&path)?], romc::robot_file::by_name("go1")?)?;
//! assert!((found.gravity_m_s2 - 9.81).abs() < 0.2);
//! assert!((found.mass_kg - 12.74).abs() < 0.6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod equations;
mod estimate;
mod fit;
mod identification;
#[cfg(test)]
#[path = "../../../tests/identify/made.rs"]
mod made;
mod parameters;
mod windows;

pub use estimate::{IdentifyError, identify};
pub use identification::{Fit, Identification, PerKind, StandardError};

use std::ops::Range;
use std::path::Path;

use equations::SampleEquations;
use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Rotation3, SMatrix, SVector, Unit, Vector3};
use parameters::{
    ARMATURE, CALF, CALF_SECOND, DELAY, DRY, GRAVITY, INVERSE_MASS, LEG_SIDE, PARAMETER_DIM, THIGH,
    THIGH_SECOND, VISCOUS,
};
use windows::{Group, Row};

use crate::files::{Fault, Located, Place};
use crate::recording::{Recording, RecordingError, Segment, between, stretches};
use crate::robot::{
    Actuators, DRY_SPEED_RAD_S, GRAVITY_M_S2, JOINT_DIM, JOINT_NAMES, LEG_JOINT_DIM, Leg,
    LegGeometry, LegLinks, LegMoments, Robot,
};
