//! Models and recordings that are part of the package.

use pyo3::prelude::*;
use romc::artifact;
use romc::cli::SHIPPED_JUMPS;

use crate::errors::python_error;
use crate::model::Model;
use crate::recording::Recording;

/// Name and file of a model.
macro_rules! models {
    ($($name:literal),*) => {
        [$(($name, include_bytes!(concat!("../../models/", $name, ".json")).as_slice())),*]
    };
}

static MODELS: &[(&str, &[u8])] = &models![
    "go1-d2",
    "go1-d4",
    "go1-d6",
    "go1-d7",
    "go1-trot-d6",
    "go1-trot-d12",
    "go2-async-d4",
    "paper-2d"
];

/// The names of the models.
#[pyfunction]
pub fn shipped_models() -> Vec<&'static str> {
    MODELS.iter().map(|(name, _)| *name).collect()
}

/// The model of a name, if there is one.
#[pyfunction]
pub fn shipped_model(py: Python<'_>, name: &str) -> PyResult<Option<Model>> {
    let Some((name, bytes)) = MODELS.iter().find(|(known, _)| *known == name) else {
        return Ok(None);
    };
    let read = artifact::read_from_bytes(name, bytes);
    let read = read.map_err(|error| python_error(py, error))?;
    Ok(Some(Model::new(read)))
}

/// Three jumps of a simulated Go1 that no shipped model was trained on.
#[pyfunction]
pub fn shipped_recordings(py: Python<'_>) -> PyResult<Vec<Recording>> {
    let read = SHIPPED_JUMPS.iter().map(|(name, bytes)| {
        let read = romc::recording::read_from_bytes(name, bytes);
        (read.map(Recording::made)).map_err(|error| python_error(py, error))
    });
    read.collect()
}
