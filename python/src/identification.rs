//! Identification of a robot from recordings.

use pyo3::prelude::*;
use romc::Error;
use romc::cli::identification_text;
use romc::identify::identify as identify_robot;
use romc::robot_file::find;
use serde_json::json;

use crate::errors::python_error;
use crate::recording::{Recording, gather};

/// Gravity, mass, friction and rotor inertia from recordings: as JSON, as TOML, and the text of `romc identify`.
#[pyfunction]
pub fn identify(
    py: Python<'_>,
    recordings: Vec<PyRef<'_, Recording>>,
    robot: &str,
) -> PyResult<(String, String, String)> {
    let recordings = gather(&recordings);
    let made = py.detach(|| -> Result<_, Error> {
        let robot = find(robot)?;
        let found = identify_robot(&recordings, robot)?;
        let text = identification_text(&found, robot, recordings.len());
        Ok((json!(found).to_string(), found.to_toml(), text))
    });
    made.map_err(|error| python_error(py, error))
}
