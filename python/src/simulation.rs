//! Rollouts of a model along recordings.

use nalgebra::{DMatrix, DVector};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use romc::Error;
use romc::evaluate::{Assessment, SegmentRun, verdict_by_default};
use romc::limits::table;
use romc::model::{ModelError, ReducedModel};
use romc::report::assessment_json;
use romc::sim::Rollout;
use serde_json::json;

use crate::arrays::into_rows;
use crate::errors::{python_error, within};
use crate::model::Model;
use crate::recording::{Recording, gather};

/// Recorded and predicted samples of one segment.
struct Run {
    time_s: Vec<f64>,
    phase: Vec<usize>,
    /// Name and samples (one column each).
    arrays: Vec<(String, DMatrix<f64>)>,
}

impl Run {
    fn of(model: &ReducedModel, run: SegmentRun<'_>) -> Result<Self, ModelError> {
        let latent = run.latent;
        let mut arrays = Vec::new();
        for (name, rollout) in [("full", &run.full), ("restarted", &run.restarted)] {
            let [z, dz, x] = predictions(model, rollout, latent.time_s.len())?;
            arrays.push((format!("z_{name}"), z));
            arrays.push((format!("dz_{name}"), dz));
            arrays.push((format!("x_{name}"), x));
        }
        arrays.extend([
            ("x".to_owned(), run.segment.x.clone()),
            ("z".to_owned(), latent.z),
            ("dz".to_owned(), latent.dz),
            ("ddz".to_owned(), latent.ddz),
            ("u_lat".to_owned(), latent.u_lat),
        ]);
        Ok(Run {
            time_s: latent.time_s,
            phase: latent.phase,
            arrays,
        })
    }

    fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        dict.set_item("t", PyArray1::from_vec(py, self.time_s))?;
        let phase = self.phase.into_iter().map(|phase| phase as i64);
        dict.set_item("phase", PyArray1::from_iter(py, phase))?;
        for (name, samples) in self.arrays {
            dict.set_item(name, into_rows(py, samples))?;
        }
        Ok(dict)
    }
}

/// Predicted `z`, `dz` and `x` of `n` samples, NaN where no prediction arrived.
fn predictions(
    model: &ReducedModel,
    rollout: &Rollout,
    n: usize,
) -> Result<[DMatrix<f64>; 3], ModelError> {
    let empty = |rows| DMatrix::from_element(rows, n, f64::NAN);
    let d = model.latent_dim();
    let (mut z, mut dz) = (empty(d), empty(d));
    let mut x = empty(model.decoder_map()?.output_dim());
    for (sample, window, column) in rollout.predictions() {
        z.set_column(sample, &window.z.column(column));
        dz.set_column(sample, &window.dz.column(column));
        let decoded: DVector<f64> = model.decode(&window.z.column(column).into_owned())?;
        x.set_column(sample, &decoded);
    }
    Ok([z, dz, x])
}

/// Rolls the model out; returns metrics and verdict as JSON and a dictionary of arrays per segment.
#[pyfunction]
pub fn simulate<'py>(
    py: Python<'py>,
    model: &Model,
    recordings: Vec<PyRef<'_, Recording>>,
    restart_every: f64,
) -> PyResult<(String, Bound<'py, PyList>)> {
    let restart_every = within(py, table::RESTART_EVERY, restart_every)?;
    let recordings = gather(&recordings);
    let made = py.detach(|| -> Result<_, Error> {
        let assessment = Assessment::over(&model.data, &recordings, restart_every)?;
        let (verdict, _) = verdict_by_default(&model.data, &recordings, &assessment, |_, _| {});
        let metrics = json!({
            "metrics": assessment_json(&model.data, &assessment),
            "verdict": verdict,
        })
        .to_string();
        let runs = assessment.runs.into_iter();
        let runs = runs.map(|run| Run::of(&model.data, run));
        Ok((metrics, runs.collect::<Result<Vec<_>, _>>()?))
    });
    let (metrics, runs) = made.map_err(|error| python_error(py, error))?;
    let runs = runs.into_iter().map(|run| run.into_dict(py));
    Ok((
        metrics,
        PyList::new(py, runs.collect::<PyResult<Vec<_>>>()?)?,
    ))
}
