//! romc's errors as Python's, with their places as attributes.
//!
//! The classes are in `romc/errors.py`: `ModelError` with tensor, row and column (from 0, as in
//! NumPy), `RecordingError` with file, row (of the file, from 1) and column name.

use pyo3::IntoPyObjectExt as _;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyType};
use romc::Error;
use romc::artifact::ArtifactError;
use romc::deploy::EmitError;
use romc::evaluate::EvaluateError;
use romc::files::{Fault as FileFault, Place};
use romc::identify::IdentifyError;
use romc::limits::{OutOfRange, Range};
use romc::lower::LowerError;
use romc::model::ModelError;
use romc::mpc::{ControlError, MpcError};
use romc::plan::PlanError;
use romc::recording::RecordingError;
use romc::robot::WrenchFrame;
use romc::sim::SimError;
use romc::simplify::SimplifyError;
use romc::train::TrainError;

/// The class of an error in Python.
#[derive(Clone, Copy)]
enum Class {
    Model,
    Recording,
    Other,
}

impl Class {
    fn name(self) -> &'static str {
        match self {
            Class::Model => "ModelError",
            Class::Recording => "RecordingError",
            Class::Other => "RomcError",
        }
    }

    fn object<'py>(self, py: Python<'py>) -> PyResult<&'py Bound<'py, PyType>> {
        static CLASSES: [PyOnceLock<Py<PyType>>; 3] = [const { PyOnceLock::new() }; 3];
        CLASSES[self as usize].import(py, "romc.errors", self.name())
    }
}

/// Class and place of an error.
struct Fault {
    class: Class,
    file: Option<String>,
    tensor: Option<String>,
    row: Option<usize>,
    /// Index of a tensor's column, or the name of a recording's.
    column: Option<Column>,
}

enum Column {
    Index(usize),
    Name(String),
}

impl Fault {
    fn of(class: Class) -> Self {
        Fault {
            class,
            file: None,
            tensor: None,
            row: None,
            column: None,
        }
    }

    /// A fault at a path of the model file, such as `` `phases[0].xi`[2][1] ``, or an entry of an
    /// import, such as `` `xi.contact`[2, 1] as xi.contact ``.
    fn at_tensor(place: &str) -> Self {
        let (tensor, indices) = tensor_and_indices(place);
        Fault {
            tensor: Some(tensor),
            row: indices.first().copied(),
            column: indices.get(1).copied().map(Column::Index),
            ..Fault::of(Class::Model)
        }
    }

    fn of_recording(error: &RecordingError) -> Self {
        Fault {
            file: Some(error.file.to_string()),
            row: error.place.row(),
            column: match &error.place {
                Place::Cell(_, column) => Some(Column::Name(column.to_string())),
                _ => None,
            },
            ..Fault::of(Class::Recording)
        }
    }

    fn of_model(error: &ModelError) -> Self {
        match error {
            ModelError::Invalid { place, .. } => Fault::at_tensor(place),
            ModelError::NonFinite {
                tensor,
                row,
                column,
                ..
            } => Fault {
                tensor: Some(tensor.clone()),
                row: Some(*row),
                column: Some(Column::Index(*column)),
                ..Fault::of(Class::Model)
            },
            ModelError::UnreachablePhase { phase, .. } => {
                Fault::at_tensor(&format!("phases[{phase}].feet"))
            }
            ModelError::Term { .. } => Fault::at_tensor("library"),
            ModelError::Incomplete { part, .. } | ModelError::Missing { part, .. } => {
                Fault::at_tensor(part)
            }
            ModelError::Nonlinear { part, .. } => Fault::at_tensor(part),
            ModelError::Name { .. } | ModelError::Robot(_) | ModelError::PhaseIndex { .. } => {
                Fault::of(Class::Model)
            }
        }
    }

    fn of_model_file(error: &ArtifactError) -> Self {
        let fault = match (&error.kind, &error.place) {
            (FileFault::Unusable(source), _) => Fault::of_model(source),
            (_, Place::Entry(place) | Place::Key(place, ..)) => Fault::at_tensor(place),
            _ => Fault::of(Class::Model),
        };
        fault.in_file(&error.file)
    }

    fn of_sim(error: &SimError) -> Self {
        match error {
            SimError::Model(error) => Fault::of_model(error),
            SimError::Recording(error) => Fault::of_recording(error),
            _ => Fault::of(Class::Other),
        }
    }

    fn of_train(error: &TrainError) -> Self {
        match error {
            TrainError::Recording(error) => Fault::of_recording(error),
            TrainError::Model(error) => Fault::of_model(error),
            TrainError::TooFewSamples { path, row, .. } => Fault {
                row: Some(*row),
                ..Fault::of(Class::Recording).in_file(&path.to_string_lossy())
            },
            TrainError::TermValue { path, sample, .. } => Fault {
                row: Some(*sample),
                ..Fault::of(Class::Recording).in_file(&path.to_string_lossy())
            },
            TrainError::NoRecording | TrainError::PhaseSamples { .. } => {
                Fault::of(Class::Recording)
            }
            _ => Fault::of(Class::Other),
        }
    }

    fn of_lower(error: &LowerError) -> Self {
        match error {
            LowerError::Model(error) => Fault::of_model(error),
            LowerError::NonFinite { .. } | LowerError::Program(_) => Fault::of(Class::Model),
        }
    }

    /// References are trajectories, so that their faults are those of recordings.
    fn of_control(error: &ControlError) -> Self {
        let at_sample = |sample: &usize, column: &str| Fault {
            row: Some(*sample),
            column: Some(Column::Name(column.to_owned())),
            ..Fault::of(Class::Recording)
        };
        match error {
            ControlError::ReferenceValue { name, sample, .. } => at_sample(sample, name),
            ControlError::ReferenceTime { sample, .. } => at_sample(sample, "t"),
            ControlError::ReferencePhase { sample, .. } => at_sample(sample, "feet"),
            ControlError::ReferenceLen { .. } | ControlError::ReferenceShape { .. } => {
                Fault::of(Class::Recording)
            }
            _ => Fault::of(Class::Other),
        }
    }

    fn of_mpc(error: &MpcError) -> Self {
        match error {
            MpcError::Model(error) => Fault::of_model(error),
            MpcError::Lower(error) => Fault::of_lower(error),
            MpcError::Recording(error) => Fault::of_recording(error),
            MpcError::Control(error) => Fault::of_control(error),
            MpcError::StateDim { .. } => Fault::at_tensor("encoder"),
            MpcError::Statistics { .. } => Fault::at_tensor("input_statistics"),
            _ => Fault::of(Class::Other),
        }
    }

    fn of_any(error: &Error) -> Self {
        match error {
            Error::Recording(error) => Fault::of_recording(error),
            Error::Model(error) => Fault::of_model(error),
            Error::ModelFile(error) => Fault::of_model_file(error),
            Error::Mismatch { file, .. } => {
                Fault::of(Class::Model).in_file(&file.to_string_lossy())
            }
            Error::RobotFile(error) => Fault::of(Class::Other).in_file(&error.file),
            Error::Sim(error) => Fault::of_sim(error),
            Error::Train(error) => Fault::of_train(error),
            Error::Identify(error) => match error {
                IdentifyError::Recording(error) => Fault::of_recording(error),
                _ => Fault::of(Class::Recording),
            },
            Error::Lower(error) => Fault::of_lower(error),
            Error::Mpc(error) => Fault::of_mpc(error),
            Error::Evaluate(error) => match error {
                EvaluateError::Model(error) => Fault::of_model(error),
                EvaluateError::Lower(error) => Fault::of_lower(error),
                EvaluateError::Recording(error) => Fault::of_recording(error),
                EvaluateError::Sim(error) => Fault::of_sim(error),
                EvaluateError::Control(error) => Fault::of_mpc(error),
            },
            Error::Emit(error) => match error {
                EmitError::Lower(error) => Fault::of_lower(error),
                EmitError::Control(error) => Fault::of_mpc(error),
                EmitError::Nonlinear { .. } => Fault::at_tensor("encoder"),
                EmitError::Jump(error) => Fault::of_recording(error),
                EmitError::PhaseName { .. } => Fault::at_tensor("phases"),
                EmitError::JumpInput(_) => Fault::of(Class::Other),
                EmitError::Typeset(_) | EmitError::Codegen(_) | EmitError::Template(_) => {
                    Fault::of(Class::Model)
                }
            },
            Error::Plan(error) => match error {
                PlanError::Model(error) => Fault::of_model(error),
                PlanError::Lower(error) => Fault::of_lower(error),
                _ => Fault::of(Class::Other),
            },
            Error::Simplify(SimplifyError::NoEncoder { .. }) => Fault::at_tensor("encoder"),
            Error::Typeset(_) | Error::Codegen(_) | Error::Physical(_) => Fault::of(Class::Model),
            _ => Fault::of(Class::Other),
        }
    }

    fn in_file(self, file: &str) -> Self {
        Fault {
            file: (!file.is_empty()).then(|| file.to_owned()),
            ..self
        }
    }

    fn raise(self, py: Python<'_>, message: &str) -> PyErr {
        let build = || {
            let attributes = PyDict::new(py);
            attributes.set_item("file", self.file)?;
            attributes.set_item("tensor", self.tensor)?;
            attributes.set_item("row", self.row)?;
            let column = match self.column {
                None => py.None(),
                Some(Column::Index(index)) => index.into_py_any(py)?,
                Some(Column::Name(name)) => name.into_py_any(py)?,
            };
            attributes.set_item("column", column)?;
            self.class.object(py)?.call((message,), Some(&attributes))
        };
        build().map_or_else(|error| error, PyErr::from_value)
    }
}

/// The tensor at a place, and the indices behind its name.
fn tensor_and_indices(place: &str) -> (String, Vec<usize>) {
    let place = place.split(" as ").next().unwrap_or(place);
    let (name, rest) = match place
        .strip_prefix('`')
        .and_then(|rest| rest.split_once('`'))
    {
        Some((name, rest)) => (name, rest),
        None => (place, ""),
    };
    // In the model file's paths indices of numbers follow the last key.
    let last_key = name.rfind('.').map_or(0, |dot| dot + 1);
    let (name, inside) = match name[last_key..].find('[') {
        Some(bracket) => name.split_at(last_key + bracket),
        None => (name, ""),
    };
    let text = format!("{inside}{rest}");
    let indices = text.split(['[', ']', ',', ' ']);
    let indices = indices.filter(|part| !part.is_empty()).map(str::parse);
    (name.to_owned(), indices.map_while(Result::ok).collect())
}

/// An error of the library as Python's, its causes in the message.
pub fn python_error(py: Python<'_>, error: impl Into<Error>) -> PyErr {
    let error = error.into();
    Fault::of_any(&error).raise(py, &romc::artifact::describe(&error))
}

/// A `ModelError` of an argument.
pub fn refusal(py: Python<'_>, message: &str, tensor: Option<&str>) -> PyErr {
    let fault = Fault {
        tensor: tensor.map(str::to_owned),
        ..Fault::of(Class::Model)
    };
    fault.raise(py, message)
}

/// A `RecordingError` of an array.
pub fn bad_reference(py: Python<'_>, message: &str, array: &str) -> PyErr {
    let fault = Fault {
        column: Some(Column::Name(array.to_owned())),
        ..Fault::of(Class::Recording)
    };
    fault.raise(py, message)
}

/// A `RecordingError` of a recording as a whole.
pub fn recording_error(py: Python<'_>, message: &str) -> PyErr {
    Fault::of(Class::Recording).raise(py, message)
}

/// An option with a value that it cannot have.
pub fn usage(py: Python<'_>, message: &str) -> PyErr {
    Fault::of(Class::Other).raise(py, message)
}

/// A number inside the range that the command line has for it.
pub fn within(py: Python<'_>, range: Range, value: f64) -> PyResult<f64> {
    range.check(value).map_err(|error| out_of_range(py, &error))
}

/// A count inside the range that the command line has for it.
pub fn count_within(py: Python<'_>, range: Range, count: usize) -> PyResult<usize> {
    range
        .check_count(count)
        .map_err(|error| out_of_range(py, &error))
}

fn out_of_range(py: Python<'_>, error: &OutOfRange) -> PyErr {
    let name = error.name.replace('-', "_");
    usage(
        py,
        &format!("{name} is {}, expected {}", error.found, error.expected),
    )
}

/// One of the values that an option has, by its name on the command line.
pub fn choice<T: clap::ValueEnum>(py: Python<'_>, option: &str, name: &str) -> PyResult<T> {
    T::from_str(name, true).map_err(|_| {
        let values = T::value_variants().iter().filter_map(T::to_possible_value);
        let values: Vec<String> = values.map(|value| value.get_name().to_owned()).collect();
        unknown(py, option, name, &values.join(", "))
    })
}

/// The place of a word among those that an option has.
pub fn known_word(py: Python<'_>, option: &str, word: &str, known: &[&str]) -> PyResult<usize> {
    let mut all = known.iter();
    let place = all.position(|known| known.eq_ignore_ascii_case(word));
    place.ok_or_else(|| unknown(py, option, word, &known.join(", ")))
}

pub fn unknown(py: Python<'_>, option: &str, name: &str, expected: &str) -> PyErr {
    usage(
        py,
        &format!("{option}: found {name:?}, expected one of {expected}"),
    )
}

/// The axes of force and moment, by their name on the command line.
pub fn wrench_frame(py: Python<'_>, name: &str) -> PyResult<WrenchFrame> {
    name.parse().map_err(|()| {
        let names = WrenchFrame::ALL.map(WrenchFrame::name).join(", ");
        usage(
            py,
            &format!("wrench_frame: found {name:?}, expected one of {names}"),
        )
    })
}
