//! Rollouts of a model along recordings: trajectories, predictions and the verdict.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use romc::Error;
use romc::evaluate::{Assessment, SegmentRun, Verdict, verdict_by_default};
use romc::limits::{Range, table};
use romc::lower::CompiledModel;
use romc::model::{ModelError, ReducedModel};
use romc::recording::Segment;
use romc::report::{assessment_json, verdict_lines};
use romc::sim::{LatentSegment, Restart, Rollout, rollout};
use romc::typeset::wrapped;
use serde_json::json;

use crate::arrays::into_rows;
use crate::errors::{python_error, recording_error, within};
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

/// The time between restarts under another name.
fn horizon(py: Python<'_>, horizon_s: f64) -> PyResult<f64> {
    let mut range: Range = table::RESTART_EVERY;
    range.name = "horizon_s";
    within(py, range, horizon_s)
}

/// Predicted states of all samples, one row each, from the recorded state at each restart (never without a time).
#[pyfunction]
pub fn predict<'py>(
    py: Python<'py>,
    model: &Model,
    recording: &Recording,
    horizon_s: Option<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let restart = match horizon_s {
        Some(horizon_s) => Restart::Every(horizon(py, horizon_s)?),
        None => Restart::Never,
    };
    let segments = &recording.data.segments;
    let turns = |segment: &&Segment| !matches!(segment.by_heading()[..], [Cow::Borrowed(_)]);
    if let Some(segment) = segments.iter().find(turns) {
        let message = format!(
            "{}: the motion from row {} turns by more than 0.25 rad, and predictions are of pieces in the axes of \
             their heading: simulate(recording).runs has these pieces",
            segment.path.display(),
            segment.first_row
        );
        return Err(recording_error(py, &message));
    }
    let predicted = py.detach(|| -> Result<_, Error> {
        let compiled = CompiledModel::new(&model.data)?;
        let of_segment = |segment: &Segment| -> Result<_, Error> {
            let latent = LatentSegment::encode(&model.data, segment)?;
            let rollout = rollout(&compiled, &latent, restart);
            let [_, _, x] = predictions(&model.data, &rollout, segment.len())?;
            Ok(x)
        };
        let segments = segments.iter().map(of_segment);
        let segments = segments.collect::<Result<Vec<_>, _>>()?;
        let columns: Vec<_> = segments.iter().flat_map(|x| x.column_iter()).collect();
        Ok(DMatrix::from_columns(&columns))
    });
    let predicted = predicted.map_err(|error| python_error(py, error))?;
    Ok(into_rows(py, predicted))
}

/// The verdict on a model along recordings, as JSON and as text.
#[pyfunction]
pub fn score(
    py: Python<'_>,
    model: &Model,
    recordings: Vec<PyRef<'_, Recording>>,
    horizon_s: f64,
) -> PyResult<(String, String)> {
    let horizon_s = horizon(py, horizon_s)?;
    let recordings = gather(&recordings);
    let made = py.detach(|| -> Result<_, Error> {
        let assessment = Assessment::over(&model.data, &recordings, horizon_s)?;
        let (verdict, unmeasured) =
            verdict_by_default(&model.data, &recordings, &assessment, |_, _| {});
        let mut json = json!(verdict);
        json["unmeasured"] = json!(unmeasured.map(|reason| reason.to_string()));
        Ok((json.to_string(), verdict_text(&verdict)))
    });
    made.map_err(|error| python_error(py, error))
}

/// The headline of a verdict and a line for each of its rows.
fn verdict_text(verdict: &Verdict) -> String {
    let lines = verdict_lines(verdict);
    let mut text = format!("{}\n", lines.lines().next().unwrap_or_default());
    let mut last_use = "";
    for row in &verdict.rows {
        if row.of != last_use {
            text += &format!("\n{}\n", row.of);
            last_use = &row.of;
        }
        let mut outcome = match (row.counts, row.passed) {
            (_, None) => "not measured",
            (false, Some(_)) => "does not count",
            (true, Some(true)) => "passed",
            (true, Some(false)) => "FAILED",
        };
        let better = row.better_baseline();
        let better = better.map(|better| format!("; a baseline is better, {better}"));
        let words = row.words() + &better.unwrap_or_default();
        for line in wrapped(&words, WORDS_WIDTH) {
            text += &format!("  {outcome:OUTCOME_WIDTH$}  {line}\n");
            outcome = "";
        }
    }
    text
}

const OUTCOME_WIDTH: usize = 14;
/// Width of the words of a row, so that lines have 80 characters at most.
const WORDS_WIDTH: usize = 80 - OUTCOME_WIDTH - 4;
