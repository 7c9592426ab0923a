//! Recordings and their segments.

use std::io::ErrorKind;
use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::DMatrix;
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use romc::Error;
use romc::files::{Overwrite, Place};
use romc::recording::{
    Clocks, ColumnMap, Reader, ReadingNotes, RecordingError, RecordingFault, WriteOptions,
    read_from_bytes, write_as,
};
use romc::recording::{Notation, write_to};
use romc::robot::{ContactFlags, FOOT_DIM, InputRule, JOINT_DIM, Robot, STATE_DIM};
use romc::robot_file::find;

use crate::arrays::{into_rows, rows, tuples, values};
use crate::errors::{bad_reference, choice, python_error, wrench_frame};
use crate::model::Model;

/// The samples of a file or of arrays.
#[pyclass(frozen, module = "romc._romc")]
pub struct Recording {
    pub data: Arc<romc::recording::Recording>,
}

impl Recording {
    /// A recording that Python holds from now on.
    pub fn made(recording: romc::recording::Recording) -> Self {
        Recording {
            data: Arc::new(recording),
        }
    }
}

#[pymethods]
impl Recording {
    #[getter]
    fn path(&self) -> String {
        self.data.path.display().to_string()
    }

    #[getter]
    fn ignored_columns(&self) -> Vec<String> {
        self.data.ignored_columns.clone()
    }

    fn __len__(&self) -> usize {
        self.data.segments.len()
    }

    fn segment(&self, index: usize) -> Segment {
        let recording = Arc::clone(&self.data);
        assert!(
            index < recording.segments.len(),
            "the caller counts segments"
        );
        Segment { recording, index }
    }

    /// Writes the format of recordings; an existing file only if forced.
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        let written = py.detach(|| {
            let (options, overwrite) = (WriteOptions::default(), Overwrite::from(force));
            let written = write_as(&path, &self.data, None, &options, overwrite);
            written.map_err(|error| match &error.kind {
                RecordingFault::Io { source, .. } if source.kind() == ErrorKind::AlreadyExists => {
                    Error::Exists(path)
                }
                _ => error.into(),
            })
        });
        written.map_err(|error| python_error(py, error))
    }
}

/// Consecutive samples of a recording.
#[pyclass(frozen, module = "romc._romc")]
pub struct Segment {
    recording: Arc<romc::recording::Recording>,
    index: usize,
}

impl Segment {
    pub fn data(&self) -> &romc::recording::Segment {
        &self.recording.segments[self.index]
    }
}

impl Segment {
    fn inputs_by<'py>(
        &self,
        py: Python<'py>,
        rule: &InputRule,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let inputs = py.detach(|| self.data().input(rule));
        let inputs = inputs.map_err(|error| python_error(py, error))?;
        Ok(into_rows(py, inputs))
    }
}

/// An array over the memory of a segment.
macro_rules! view {
    ($this:ident, $of:expr, $field:ident) => {{
        let segment = $this.get().data();
        // SAFETY: the object holds the recording, which nothing changes.
        unsafe { $of($this.clone().into_any(), &segment.$field) }
    }};
}

#[pymethods]
impl Segment {
    #[getter]
    fn t<'py>(this: &Bound<'py, Self>) -> Bound<'py, PyArray1<f64>> {
        view!(this, values, time_s)
    }

    #[getter]
    fn x<'py>(this: &Bound<'py, Self>) -> Bound<'py, PyArray2<f64>> {
        view!(this, rows, x)
    }

    #[getter]
    fn dx<'py>(this: &Bound<'py, Self>) -> Bound<'py, PyArray2<f64>> {
        view!(this, rows, dx)
    }

    #[getter]
    fn ddx<'py>(this: &Bound<'py, Self>) -> Bound<'py, PyArray2<f64>> {
        view!(this, rows, ddx)
    }

    #[getter]
    fn torque<'py>(this: &Bound<'py, Self>) -> Bound<'py, PyArray2<f64>> {
        view!(this, rows, torque_nm)
    }

    #[getter]
    fn feet<'py>(this: &Bound<'py, Self>) -> Bound<'py, PyArray2<bool>> {
        view!(this, tuples, feet)
    }

    #[getter]
    fn first_row(&self) -> usize {
        self.data().first_row
    }

    fn __len__(&self) -> usize {
        self.data().len()
    }

    /// The inputs of a model, one row per sample.
    fn inputs<'py>(&self, py: Python<'py>, model: &Model) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let rule = model.data.input_rule();
        self.inputs_by(py, &rule.map_err(|error| python_error(py, error))?)
    }

    /// The inputs of a robot without losses in its joints, one row per sample.
    fn inputs_of<'py>(
        &self,
        py: Python<'py>,
        robot: &str,
        frame: &str,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let robot = find(robot).map_err(|error| python_error(py, error))?;
        self.inputs_by(py, &InputRule::new(robot, None, wrench_frame(py, frame)?))
    }
}

/// A map of columns: its file, or its text.
#[derive(FromPyObject)]
pub enum Columns {
    #[pyo3(transparent)]
    Text(String),
    #[pyo3(transparent)]
    File(PathBuf),
}

impl Columns {
    fn map(&self) -> Result<ColumnMap, RecordingError> {
        match self {
            Columns::Text(text) => ColumnMap::parse("columns", text),
            Columns::File(path) => ColumnMap::read(path),
        }
    }
}

/// The robot of recordings, which the reader of a file may need: its name, or a model's.
#[derive(FromPyObject)]
pub enum RobotOf<'py> {
    #[pyo3(transparent)]
    Name(String),
    #[pyo3(transparent)]
    Model(PyRef<'py, Model>),
}

impl RobotOf<'_> {
    fn robot(&self) -> Result<Option<&'static Robot>, Error> {
        match self {
            RobotOf::Name(name) => Ok(Some(find(name)?)),
            RobotOf::Model(model) => Ok(model.data.robot().ok()),
        }
    }
}

/// Reads files, one reader for all; returns the recordings, and the repairs in words.
#[pyfunction]
pub fn read(
    py: Python<'_>,
    paths: Vec<PathBuf>,
    columns: Option<Columns>,
    clock: &str,
    robot: Option<RobotOf<'_>>,
) -> PyResult<(Vec<Recording>, Vec<String>)> {
    let clocks: Clocks = choice(py, "clock", clock)?;
    let robot = robot.map(|robot| robot.robot()).transpose();
    let robot = robot.map_err(|error| python_error(py, error))?.flatten();
    let read = py.detach(|| -> Result<_, RecordingError> {
        let map = columns.as_ref().map(Columns::map).transpose()?;
        let reader = Reader::new(map, clocks);
        let reader = match robot {
            Some(robot) => reader.for_robot(robot),
            None => reader,
        };
        let mut notes = ReadingNotes::default();
        let readings = paths.iter().map(|path| {
            let reading = reader.read(path)?;
            notes.add(&reading);
            Ok(Recording::made(reading.recording))
        });
        let recordings = readings.collect::<Result<Vec<_>, _>>()?;
        Ok((recordings, notes.lines()))
    });
    read.map_err(|error| python_error(py, error))
}

/// A first map of an unknown log; returns its text, and why a log cannot be read by it, if so.
#[pyfunction]
pub fn guess(py: Python<'_>, path: PathBuf, robot: &str) -> PyResult<(String, Option<String>)> {
    let guessed =
        py.detach(|| -> Result<_, Error> { Ok(romc::recording::guess(&path, find(robot)?)?) });
    let guessed = guessed.map_err(|error| python_error(py, error))?;
    Ok((guessed.text, guessed.outcome.err()))
}

/// Rows of numbers.
type Rows<'py> = PyReadonlyArray2<'py, f64>;

/// The arrays of a recording, one row per sample.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Arrays<'py> {
    t: PyReadonlyArray1<'py, f64>,
    x: Rows<'py>,
    dx: Rows<'py>,
    ddx: Option<Rows<'py>>,
    torque: Rows<'py>,
    feet: PyReadonlyArray2<'py, bool>,
}

/// A recording of arrays, checked as a file is: it goes through the format of files, whose numbers
/// are read back to the same bits.
#[pyfunction]
pub fn from_arrays(py: Python<'_>, name: &str, arrays: Arrays<'_>) -> PyResult<Recording> {
    let Arrays {
        t,
        x,
        dx,
        ddx,
        torque,
        feet,
    } = arrays;
    let n = t.len();
    let check = |name: &str, found: &[usize], width: usize| {
        if found != [n, width] {
            let message = format!("`{name}`: found {found:?}, expected ({n}, {width})");
            return Err(bad_reference(py, &message, name));
        }
        Ok(())
    };
    let samples = |name: &str, array: &Rows<'_>, width: usize| {
        check(name, array.shape(), width)?;
        let rows = array.as_array();
        Ok::<_, PyErr>(DMatrix::from_fn(width, n, |i, sample| rows[(sample, i)]))
    };
    check("feet", feet.shape(), FOOT_DIM)?;
    let flags = feet.as_array();
    let options = WriteOptions {
        notation: Notation::Comma,
        accelerations: ddx.is_some(),
    };
    let segment = romc::recording::Segment {
        path: PathBuf::from(name),
        first_row: FIRST_ROW,
        row_stride: 1.0,
        x: samples("x", &x, STATE_DIM)?,
        dx: samples("dx", &dx, STATE_DIM)?,
        ddx: match &ddx {
            Some(ddx) => samples("ddx", ddx, STATE_DIM)?,
            None => DMatrix::zeros(STATE_DIM, n),
        },
        torque_nm: samples("torque", &torque, JOINT_DIM)?,
        feet: (0..n)
            .map(|sample| -> ContactFlags { std::array::from_fn(|foot| flags[(sample, foot)]) })
            .collect(),
        time_s: t.as_array().to_vec(),
        body_wrench: None,
        is_walk: false,
    };
    let recording = romc::recording::Recording {
        path: PathBuf::from(name),
        segments: vec![segment],
        ignored_columns: Vec::new(),
    };
    let checked = py.detach(|| through_the_format(name, &recording, &options));
    (checked.map(Recording::made)).map_err(|error| python_error(py, error))
}

/// Row of a file's first sample.
const FIRST_ROW: usize = 2;

fn through_the_format(
    name: &str,
    recording: &romc::recording::Recording,
    options: &WriteOptions,
) -> Result<romc::recording::Recording, RecordingError> {
    let mut text = Vec::new();
    write_to(&mut text, recording, None, options).expect("memory takes all bytes");
    read_from_bytes(name, &text).map_err(|mut error| {
        // Arrays count from 0 and have no header.
        match &mut error.place {
            Place::Row(row) | Place::Cell(row, _) => *row = row.saturating_sub(FIRST_ROW),
            _ => {}
        }
        error
    })
}

/// The recordings of a list, in one piece of memory.
pub fn gather(recordings: &[PyRef<'_, Recording>]) -> Vec<romc::recording::Recording> {
    let recordings = recordings.iter();
    recordings
        .map(|recording| romc::recording::Recording::clone(&recording.data))
        .collect()
}
