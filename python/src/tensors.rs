//! Tensors of Python objects to a model, by the importer of files.

use nalgebra::DVector;
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use romc::Error;
use romc::import::{ImportOptions, LibraryChoice, Tensor, parse_standard};
use romc::model::{ScaleFactors, Scaling};
use romc::robot::Robot;

use crate::errors::{choice, python_error};
use crate::model::Model;

/// The options of `romc import`, under the same names.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct ImportArguments {
    name: String,
    description: String,
    /// The shorthand, if `terms` is not given.
    library: Option<String>,
    terms: Option<Vec<String>>,
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
    robot: Option<String>,
    sample_time: Option<f64>,
}

impl ImportArguments {
    fn options(&self, py: Python<'_>) -> PyResult<ImportOptions> {
        let refused = |error: romc::import::ImportError| python_error(py, error);
        let library = match (&self.terms, &self.library) {
            (Some(terms), _) => Some(LibraryChoice::Terms(terms.clone())),
            (None, Some(shorthand)) => {
                let standard = parse_standard(shorthand).map_err(refused)?;
                Some(LibraryChoice::Standard(standard))
            }
            (None, None) => None,
        };
        let activation = self.activation.as_deref().map(str::parse).transpose();
        let robot = self.robot.as_deref().map(Robot::by_name).transpose();
        let (phases, map) = (self.phases.iter(), self.map.iter());
        Ok(ImportOptions {
            name: self.name.clone(),
            description: self.description.clone(),
            library,
            latent_dim: self.latent_dim,
            phases: (phases.map(|text| text.parse().map_err(refused))).collect::<PyResult<_>>()?,
            mapping: (map.map(|text| text.parse().map_err(refused))).collect::<PyResult<_>>()?,
            weights: (self.weights.as_deref())
                .map(|name| choice(py, "weights", name))
                .transpose()?,
            xi_layout: (self.xi_layout.as_deref())
                .map(|name| choice(py, "xi_layout", name))
                .transpose()?,
            activation: activation.map_err(|error| python_error(py, Error::Model(error)))?,
            scaling: self.scaling(),
            robot: robot.map_err(|error| python_error(py, error))?,
            sample_time_s: self.sample_time,
            ..ImportOptions::default()
        })
    }

    fn scaling(&self) -> Option<Scaling> {
        let factors = |given: &[f64]| match given {
            [factor] => ScaleFactors::Uniform(*factor),
            list => ScaleFactors::PerCoordinate(DVector::from_column_slice(list)),
        };
        let input = match self.input_scaling.as_slice() {
            [] => &self.scaling,
            input => input,
        };
        (!self.scaling.is_empty()).then(|| Scaling {
            state: factors(&self.scaling),
            input: factors(input),
        })
    }
}

/// Imports named arrays; returns the model and the report as JSON.
#[pyfunction]
pub fn import_tensors(
    py: Python<'_>,
    source: &str,
    tensors: Vec<(String, PyReadonlyArrayDyn<'_, f64>)>,
    arguments: ImportArguments,
) -> PyResult<(Model, String)> {
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
    let imported = py.detach(|| romc::import::import_tensors(source, &tensors, &options));
    let imported = imported.map_err(|error| python_error(py, error))?;
    let report = serde_json::json!(imported.report).to_string();
    Ok((Model::new(imported.model), report))
}
