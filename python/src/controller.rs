//! The controller, step by step and along recordings.

use std::sync::{Arc, Mutex, MutexGuard};

use nalgebra::DMatrix;
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use romc::Error;
use romc::cli::JudgedRuns;
use romc::evaluate::{ReferenceInput, StepRow, along_recording, control_metrics};
use romc::limits::table;
use romc::model::ReducedModel;
use romc::mpc::interface::{SETTINGS, Settings, status_text};
use romc::mpc::{
    Command, Measurement, MpcError, MpcSettings, ReferenceSamples, Status, words_of_setting,
};
use romc::robot::{ContactFlags, FOOT_DIM};

use crate::arrays::into_rows;
use crate::errors::{bad_reference, choice, known_word, python_error, unknown, usage, within};
use crate::model::Model;
use crate::recording::{Recording, Segment};

/// Settings of the controller by their names in the library's table; those not given are the library's.
fn settings(py: Python<'_>, given: Vec<(String, Bound<'_, PyAny>)>) -> PyResult<MpcSettings> {
    let mut settings = Settings::default();
    for (name, value) in given {
        let Some(row) = SETTINGS.iter().find(|row| row.name == name) else {
            let names: Vec<&str> = SETTINGS.iter().map(|row| row.name).collect();
            return Err(unknown(py, "setting", &name, &names.join(", ")));
        };
        let words = words_of_setting(&name);
        let number = match (value.extract::<f64>(), value.extract::<String>()) {
            (Ok(number), _) => number,
            (_, Ok(word)) if !words.is_empty() => known_word(py, &name, &word, &words)? as f64,
            _ => {
                let message = format!("{name}: found {}, expected a number", value.repr()?);
                return Err(usage(py, &message));
            }
        };
        match row.name {
            "horizon" => within(py, table::HORIZON, number)?,
            "step_s" => within(py, table::STEP, number)?,
            _ if row.kind == "i32" && number != f64::from(number as i32) => {
                let message = format!("{name} is {number}, expected a whole number");
                return Err(usage(py, &message));
            }
            _ => number,
        };
        settings.set(&name, number);
    }
    let settings = settings.to_mpc();
    settings.map_err(|error| python_error(py, MpcError::from(error)))
}

/// Each status in a word, and its meaning.
#[pyfunction]
pub fn statuses() -> Vec<(&'static str, String)> {
    let all = Status::ALL.iter();
    all.map(|status| {
        let text = status_text(status.code()).to_string_lossy();
        let meaning = text.split_once(": ").map_or(&*text, |(_, meaning)| meaning);
        (status.word(), meaning.to_owned())
    })
    .collect()
}

/// A controller, used by one thread at a time.
#[pyclass(frozen, module = "romc._romc")]
pub struct Controller {
    controller: Mutex<romc::mpc::Controller>,
    model: Arc<ReducedModel>,
}

/// A step's command.
#[derive(IntoPyObject)]
struct StepResult<'py> {
    torque: Bound<'py, PyArray1<f64>>,
    joint_position: Bound<'py, PyArray1<f64>>,
    joint_velocity: Bound<'py, PyArray1<f64>>,
    stiffness: f64,
    damping: f64,
    u_lat: Bound<'py, PyArray1<f64>>,
    status: &'static str,
    status_code: i32,
    has_plan: bool,
    source: &'static str,
    phase: Option<String>,
    iterations: u32,
    solve_us: f64,
    slack: f64,
}

#[pymethods]
impl Controller {
    #[new]
    fn new(
        py: Python<'_>,
        model: &Model,
        given: Vec<(String, Bound<'_, PyAny>)>,
    ) -> PyResult<Self> {
        let settings = settings(py, given)?;
        let made = py.detach(|| romc::mpc::controller(&model.data, settings));
        Ok(Controller {
            controller: Mutex::new(made.map_err(|error| python_error(py, error))?),
            model: Arc::clone(&model.data),
        })
    }

    /// Every setting by its name, as a word if it has some.
    #[getter]
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        let settings = py.detach(|| *self.lock().settings());
        for (row, number) in SETTINGS.iter().zip(Settings::from(&settings).numbers()) {
            match words_of_setting(row.name).get(number as usize) {
                Some(word) => dict.set_item(row.name, word)?,
                None if row.kind == "i32" => dict.set_item(row.name, number as i32)?,
                None => dict.set_item(row.name, number)?,
            }
        }
        Ok(dict)
    }

    /// Follows a recorded segment, with its inputs within the motors' limits or without any.
    fn follow(&self, py: Python<'_>, segment: &Segment, input: &str) -> PyResult<()> {
        let input: ReferenceInput = choice(py, "reference_input", input)?;
        let segment = segment.data();
        let taken = py.detach(|| -> Result<(), MpcError> {
            let mut controller = self.lock();
            let recorded = match input {
                ReferenceInput::Recorded => Some(segment.input(controller.plant().input_rule())?),
                ReferenceInput::None => None,
            };
            controller.set_reference(ReferenceSamples {
                time_s: &segment.time_s,
                x: segment.x.as_slice(),
                dx: segment.dx.as_slice(),
                u: recorded.as_ref().map(DMatrix::as_slice),
                feet: &segment.feet,
            })?;
            Ok(())
        });
        taken.map_err(|error| python_error(py, error))
    }

    /// Follows a trajectory of arrays, one row per sample.
    fn set_reference(
        &self,
        py: Python<'_>,
        t: PyReadonlyArray1<'_, f64>,
        x: PyReadonlyArray2<'_, f64>,
        dx: PyReadonlyArray2<'_, f64>,
        feet: PyReadonlyArray2<'_, bool>,
        u: Option<PyReadonlyArray2<'_, f64>>,
    ) -> PyResult<()> {
        if feet.shape()[1] != FOOT_DIM {
            let message = format!("`feet`: found {} columns, expected 4", feet.shape()[1]);
            return Err(bad_reference(py, &message, "feet"));
        }
        let (time_s, x, dx) = (t.as_slice()?, x.as_slice()?, dx.as_slice()?);
        let u = u.as_ref().map(|u| u.as_slice()).transpose()?;
        let (flags, _) = feet.as_slice()?.as_chunks::<FOOT_DIM>();
        let taken = py.detach(|| {
            self.lock().set_reference(ReferenceSamples {
                time_s,
                x,
                dx,
                u,
                feet: flags,
            })
        });
        taken.map_err(|error| python_error(py, MpcError::from(error)))
    }

    /// Prepares the step at a time.
    fn prepare(&self, py: Python<'_>, t: f64) {
        py.detach(|| self.lock().prepare(t));
    }

    /// The command for a measurement. Arrays of the wrong length give a safe command.
    fn step<'py>(
        &self,
        py: Python<'py>,
        t: f64,
        x: PyReadonlyArray1<'py, f64>,
        dx: PyReadonlyArray1<'py, f64>,
        feet: PyReadonlyArray1<'py, bool>,
    ) -> PyResult<StepResult<'py>> {
        let (x, dx, flags) = (x.as_slice()?, dx.as_slice()?, feet.as_slice()?);
        let Ok(feet) = ContactFlags::try_from(flags) else {
            let message = format!("`feet`: found {} flags, expected 4", flags.len());
            return Err(bad_reference(py, &message, "feet"));
        };
        let measurement = Measurement {
            time_s: t,
            x,
            dx,
            feet,
        };
        let command: Command = py.detach(|| self.lock().step(measurement));
        Ok(StepResult {
            torque: PyArray1::from_slice(py, &command.torque_nm),
            joint_position: PyArray1::from_slice(py, &command.joint_position_rad),
            joint_velocity: PyArray1::from_slice(py, &command.joint_velocity_rad_s),
            stiffness: command.drives.stiffness_nm_rad,
            damping: command.drives.damping_nm_s_rad,
            u_lat: PyArray1::from_slice(py, &command.u_lat),
            status: command.status.word(),
            status_code: command.status.code(),
            has_plan: command.status.has_plan(),
            source: command.source.word(),
            phase: command.phase.map(|phase| self.phase(phase).to_owned()),
            iterations: command.iterations,
            solve_us: command.solve_us,
            slack: command.slack,
        })
    }

    /// Forgets plan and past measurements, but not the reference.
    fn reset(&self, py: Python<'_>) {
        py.detach(|| self.lock().reset());
    }

    /// Runs along a recording; returns the JSON and the text of `romc mpc`, and a dictionary of arrays.
    fn along<'py>(
        &self,
        py: Python<'py>,
        recording: &Recording,
        input: &str,
    ) -> PyResult<(String, String, Bound<'py, PyDict>)> {
        let input: ReferenceInput = choice(py, "reference_input", input)?;
        let recording = &recording.data;
        let made = py.detach(|| -> Result<_, Error> {
            let mut controller = self.lock();
            let settings = *controller.settings();
            controller.reset();
            let mut run = along_recording(&mut controller, recording, input, |_, _| {})?;
            drop(controller);
            run.metrics = Some(control_metrics(&self.model, recording, settings)?);
            let (runs, rows) = (vec![(recording.path.clone(), run.clone())], run.rows);
            let judged = JudgedRuns::of(&self.model, std::slice::from_ref(recording), runs)?;
            Ok((judged, rows))
        });
        let (judged, rows) = made.map_err(|error| python_error(py, error))?;
        let arrays = self.arrays_of(py, &rows)?;
        Ok((judged.json().to_string(), judged.text(), arrays))
    }
}

impl Controller {
    fn phase(&self, index: usize) -> &str {
        &self.model.phases()[index].name
    }

    /// The controller; after a panic in a step it begins anew, as its plan may contradict itself.
    fn lock(&self) -> MutexGuard<'_, romc::mpc::Controller> {
        self.controller.lock().unwrap_or_else(|poisoned| {
            let mut controller = poisoned.into_inner();
            controller.reset();
            self.controller.clear_poison();
            controller
        })
    }

    /// One row per step under the names of the command line's table.
    fn arrays_of<'py>(&self, py: Python<'py>, rows: &[StepRow]) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        let numbers = |of: &dyn Fn(&StepRow) -> &[f64]| {
            let width = rows.first().map_or(0, |row| of(row).len());
            let samples = rows.iter().flat_map(|row| of(row).iter().copied());
            into_rows(py, DMatrix::from_iterator(width, rows.len(), samples))
        };
        let list = |of: &dyn Fn(&StepRow) -> f64| PyArray1::from_iter(py, rows.iter().map(of));
        let words: Vec<&str> = rows.iter().map(|row| row.command.status.word()).collect();
        let phases = rows
            .iter()
            .map(|row| row.command.phase.map(|phase| self.phase(phase)));
        dict.set_item(
            "segment",
            PyArray1::from_iter(py, rows.iter().map(|r| r.segment as i64)),
        )?;
        dict.set_item("t", list(&|row| row.time_s))?;
        dict.set_item("phase", phases.collect::<Vec<_>>())?;
        dict.set_item("status", words)?;
        let iterations = rows.iter().map(|row| i64::from(row.command.iterations));
        dict.set_item("iterations", PyArray1::from_iter(py, iterations))?;
        dict.set_item("solve_us", list(&|row| row.command.solve_us))?;
        dict.set_item("torque", numbers(&|row| &row.command.torque_nm))?;
        dict.set_item("recorded_torque", numbers(&|row| &row.recorded_torque_nm))?;
        dict.set_item("u", numbers(&|row| &row.input))?;
        dict.set_item("u_lat", numbers(&|row| &row.command.u_lat))?;
        dict.set_item("z", numbers(&|row| &row.z))?;
        dict.set_item("z_ref", numbers(&|row| &row.z_reference))?;
        Ok(dict)
    }
}
