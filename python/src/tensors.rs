//! Tensors of Python objects to a model, by the importer of files.

use std::collections::BTreeMap;
use std::path::PathBuf;

use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use romc::Error;
use romc::cli::{Compared, import_compared};
use romc::import::{ImportError, ImportOptions, Tensor, parse_standard};
use romc::model::LibraryChoice;
use romc::robot::{Actuators, PhasePattern, Robot};
use romc::robot_file::{ActuatorsEntry, RobotFileError, find, leg_moments, read_actuators};

use crate::errors::{choice, python_error, wrench_frame};
use crate::model::Model;
use crate::recording::{Recording, gather};

/// The options of `romc import`, under the same names.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct ImportArguments {
    name: String,
    description: String,
    /// The shorthand, if `terms` is not given.
    library: Option<String>,
    terms: Option<Vec<String>>,
    /// The order of the shorthand's terms.
    library_order: Option<String>,
    latent_dim: Option<usize>,
    /// `NAME=FEET` each.
    phases: Vec<String>,
    scaling: Vec<f64>,
    input_scaling: Vec<f64>,
    weights: Option<String>,
    xi_layout: Option<String>,
    activation: Option<String>,
    /// `PART=TENSOR` each.
    map: Vec<String>,
    /// A name or a file.
    robot: Option<String>,
    order: Option<String>,
    wrench_frame: String,
    actuators: Option<Losses>,
    sample_time: Option<f64>,
    /// Whether a model that misses the recordings is nevertheless made.
    unchecked: bool,
}

/// Joint friction and rotor inertia: a file with a table `actuators`, or its arrays by name.
#[derive(FromPyObject)]
enum Losses {
    File(PathBuf),
    Arrays(BTreeMap<String, Loss>),
}

/// Numbers of the joints, or the moments of a leg by name.
#[derive(FromPyObject)]
enum Loss {
    Joints(Vec<f64>),
    Legs(BTreeMap<String, f64>),
}

impl Losses {
    fn actuators(&self, robot: Option<&Robot>) -> Result<Actuators, RobotFileError> {
        match self {
            Losses::File(path) => read_actuators(path, robot),
            Losses::Arrays(arrays) => {
                let (mut joints, mut legs) = (BTreeMap::new(), None);
                for (name, loss) in arrays {
                    match loss {
                        Loss::Legs(moments) if name == "legs" => {
                            legs = Some(leg_moments(moments.clone())?);
                        }
                        Loss::Joints(values) => {
                            joints.insert(name.clone(), values.clone());
                        }
                        Loss::Legs(_) => {
                            joints.insert(name.clone(), Vec::new());
                        }
                    }
                }
                let actuators = ActuatorsEntry::of_arrays(joints)?.actuators("")?;
                Ok(Actuators { legs, ..actuators })
            }
        }
    }
}

fn not_a_phase(text: &str) -> ImportError {
    ImportError::option("--phase", format!("{text:?}"), PhasePattern::EXPECTED)
}

impl ImportArguments {
    fn options(&self, py: Python<'_>) -> PyResult<ImportOptions> {
        let refused = |error: ImportError| python_error(py, error);
        let library = match (&self.terms, &self.library) {
            (Some(terms), _) => Some(LibraryChoice::Terms(terms.clone())),
            (None, Some(shorthand)) => {
                let standard = parse_standard(shorthand).map_err(refused)?;
                Some(LibraryChoice::Standard(standard))
            }
            (None, None) => None,
        };
        let robot = self.robot.as_deref().map(find).transpose();
        let robot = robot.map_err(|error| python_error(py, error))?;
        let actuators = self.actuators.as_ref();
        let actuators = actuators.map(|losses| losses.actuators(robot)).transpose();
        let order = self.order.as_deref().map(str::parse).transpose();
        let (phases, map) = (self.phases.iter(), self.map.iter());
        Ok(ImportOptions {
            name: self.name.clone(),
            description: self.description.clone(),
            library,
            library_order: (self.library_order.as_deref())
                .map(|name| choice(py, "library_order", name))
                .transpose()?,
            latent_dim: self.latent_dim,
            phases: (phases.map(|text| text.parse().map_err(|_| refused(not_a_phase(text)))))
                .collect::<PyResult<_>>()?,
            mapping: (map.map(|text| text.parse().map_err(refused))).collect::<PyResult<_>>()?,
            weights: (self.weights.as_deref())
                .map(|name| choice(py, "weights", name))
                .transpose()?,
            xi_layout: (self.xi_layout.as_deref())
                .map(|name| choice(py, "xi_layout", name))
                .transpose()?,
            activation: (self.activation.as_deref())
                .map(|name| choice(py, "activation", name))
                .transpose()?,
            robot,
            order: order.map_err(|error| python_error(py, Error::Model(error)))?,
            wrench_frame: wrench_frame(py, &self.wrench_frame)?,
            actuators: actuators.map_err(|error| python_error(py, error))?,
            sample_time_s: self.sample_time,
            ..ImportOptions::of_factors(&self.scaling, &self.input_scaling)
        })
    }
}

/// Imports named arrays; returns the model, and its fault along the recordings if it has one and is not
/// refused. Recordings give it the statistics of the inputs.
#[pyfunction]
pub fn import_tensors(
    py: Python<'_>,
    source: &str,
    tensors: Vec<(String, PyReadonlyArrayDyn<'_, f64>)>,
    arguments: ImportArguments,
    recordings: Vec<PyRef<'_, Recording>>,
) -> PyResult<(Model, Option<String>)> {
    let options = arguments.options(py)?;
    let tensors: Vec<Tensor<'_>> = tensors
        .iter()
        .map(|(name, array)| {
            Ok(Tensor {
                name: name.clone(),
                shape: array.shape().to_vec(),
                values: array.as_slice()?,
                is_column_major: array.is_fortran_contiguous() && !array.is_c_contiguous(),
            })
        })
        .collect::<PyResult<_>>()?;
    let recordings = gather(&recordings);
    let made = py.detach(|| {
        let segments: Vec<_> = recordings.iter().flat_map(|r| &r.segments).collect();
        let read =
            |options: &ImportOptions| romc::import::import_tensors(source, &tensors, options);
        import_compared(read, options, &segments, arguments.unchecked)
    });
    let Compared {
        imported, fault, ..
    } = made.map_err(|error| python_error(py, error))?;
    Ok((Model::new(imported.model), fault))
}
