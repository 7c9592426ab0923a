//! Models: reading, writing, maps and accelerations.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use nalgebra::DVector;
use numpy::{PyArray2, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use romc::artifact;
use romc::files::Overwrite;
use romc::lower::{CompiledModel, LowerError};
use romc::model::{ModelError, ReducedModel};

use crate::arrays::{from_vectors, matrix, vectors};
use crate::errors::{python_error, refusal};

/// A checked model.
#[pyclass(frozen, module = "romc._romc")]
pub struct Model {
    pub data: Arc<ReducedModel>,
    /// Its programs, made when the first acceleration is asked for.
    compiled: OnceLock<CompiledModel>,
}

impl Model {
    pub fn new(model: ReducedModel) -> Self {
        Model {
            data: Arc::new(model),
            compiled: OnceLock::new(),
        }
    }

    fn compiled(&self) -> Result<CompiledModel, LowerError> {
        if let Some(compiled) = self.compiled.get() {
            return Ok(compiled.clone());
        }
        let compiled = CompiledModel::new(&self.data)?;
        Ok(self.compiled.get_or_init(|| compiled).clone())
    }

    fn known_state_dim(&self, py: Python<'_>) -> PyResult<usize> {
        (self.data.state_dim()).ok_or_else(|| {
            let name = self.data.name();
            let message = format!("model {name} has no `encoder`, needed for robot coordinates");
            refusal(py, &message, Some("encoder"))
        })
    }

    /// A map of vectors of one length, applied to each row.
    fn each_row<'py>(
        &self,
        input: (&str, &PyReadonlyArray2<'py, f64>, usize),
        output_dim: usize,
        map: impl Fn(&ReducedModel, &DVector<f64>) -> Result<DVector<f64>, ModelError> + Sync,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (name, array, width) = input;
        let py = array.py();
        let rows = vectors(name, array, width)?;
        let mapped = py.detach(|| -> Result<Vec<_>, ModelError> {
            rows.iter().map(|row| map(&self.data, row)).collect()
        });
        let mapped = mapped.map_err(|error| python_error(py, error))?;
        Ok(from_vectors(py, output_dim, &mapped))
    }

    /// The same of vectors at states.
    fn each_pair<'py>(
        &self,
        state: (&str, &PyReadonlyArray2<'py, f64>, usize),
        input: (&str, &PyReadonlyArray2<'py, f64>, usize),
        output_dim: usize,
        map: impl Fn(&ReducedModel, &DVector<f64>, &DVector<f64>) -> Result<DVector<f64>, ModelError>
        + Sync,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let py = input.1.py();
        let states = vectors(state.0, state.1, state.2)?;
        let inputs = vectors(input.0, input.1, input.2)?;
        check_counts(py, (state.0, states.len()), (input.0, inputs.len()))?;
        let mapped = py.detach(|| -> Result<Vec<_>, ModelError> {
            let pairs = states.iter().zip(&inputs);
            pairs.map(|(x, input)| map(&self.data, x, input)).collect()
        });
        let mapped = mapped.map_err(|error| python_error(py, error))?;
        Ok(from_vectors(py, output_dim, &mapped))
    }
}

fn check_counts(py: Python<'_>, first: (&str, usize), second: (&str, usize)) -> PyResult<()> {
    if first.1 == second.1 {
        return Ok(());
    }
    let message = format!(
        "`{}`: found {} rows, expected {} as in `{}`",
        second.0, second.1, first.1, first.0
    );
    Err(refusal(py, &message, Some(second.0)))
}

#[pymethods]
impl Model {
    /// Reads a model file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let read = py.detach(|| artifact::read(&path));
        read.map(Model::new)
            .map_err(|error| python_error(py, error))
    }

    /// Reads the text of a model file; `name` stands for the file in errors.
    #[staticmethod]
    fn from_text(py: Python<'_>, name: &str, text: &str) -> PyResult<Self> {
        let read = py.detach(|| artifact::read_from_bytes(name, text.as_bytes()));
        read.map(Model::new)
            .map_err(|error| python_error(py, error))
    }

    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        let overwrite = Overwrite::from(force);
        let written = py.detach(|| artifact::write(&path, &self.data, overwrite));
        written.map_err(|error| python_error(py, error))
    }

    fn to_text(&self) -> String {
        artifact::to_text(&self.data)
    }

    #[getter]
    fn digest(&self) -> String {
        artifact::digest(&self.data).to_string()
    }

    #[getter]
    fn name(&self) -> String {
        self.data.name().to_owned()
    }

    #[getter]
    fn latent_dim(&self) -> usize {
        self.data.latent_dim()
    }

    #[getter]
    fn state_dim(&self) -> Option<usize> {
        self.data.state_dim()
    }

    #[getter]
    fn is_linear(&self) -> bool {
        self.data.is_linear()
    }

    #[getter]
    fn latent_words(&self) -> Vec<String> {
        let words = self.data.latent_words();
        words.iter().map(ToString::to_string).collect()
    }

    #[getter]
    fn library(&self) -> Vec<String> {
        let terms = self.data.library().terms().iter();
        terms.map(|term| term.text.clone()).collect()
    }

    /// Name, feet and coefficients (terms x latent) of each phase.
    #[allow(clippy::type_complexity)]
    fn phases<'py>(this: &Bound<'py, Self>) -> Vec<(String, String, Bound<'py, PyArray2<f64>>)> {
        let phases = this.get().data.phases().iter();
        let entry = |phase: &'_ romc::model::Phase| {
            // SAFETY: the object holds the model, which nothing changes.
            let xi = unsafe { matrix(this.clone().into_any(), &phase.xi) };
            (phase.name.clone(), phase.feet.to_string(), xi)
        };
        phases.map(entry).collect()
    }

    fn encode<'py>(&self, x: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let dim = self.known_state_dim(x.py())?;
        let map = |model: &ReducedModel, x: &DVector<f64>| model.encode(x);
        self.each_row(("x", &x, dim), self.data.latent_dim(), map)
    }

    fn decode<'py>(&self, z: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let dim = self.known_state_dim(z.py())?;
        let map = |model: &ReducedModel, z: &DVector<f64>| model.decode(z);
        self.each_row(("z", &z, self.data.latent_dim()), dim, map)
    }

    fn encode_velocity<'py>(
        &self,
        x: PyReadonlyArray2<'py, f64>,
        dx: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let dim = self.known_state_dim(dx.py())?;
        let latent = self.data.latent_dim();
        self.each_pair(("x", &x, dim), ("dx", &dx, dim), latent, |model, x, dx| {
            Ok(model.encoder_jacobian(x)? * dx)
        })
    }

    fn project_input<'py>(
        &self,
        x: PyReadonlyArray2<'py, f64>,
        u: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let dim = self.known_state_dim(u.py())?;
        let latent = self.data.latent_dim();
        self.each_pair(("x", &x, dim), ("u", &u, dim), latent, |model, x, u| {
            Ok(model.tangent(x)?.project * u)
        })
    }

    fn lift_input<'py>(
        &self,
        x: PyReadonlyArray2<'py, f64>,
        u_lat: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let dim = self.known_state_dim(u_lat.py())?;
        let latent = self.data.latent_dim();
        let input = ("u_lat", &u_lat, latent);
        self.each_pair(("x", &x, dim), input, dim, |model, x, u_lat| {
            Ok(model.tangent(x)?.lift * u_lat)
        })
    }

    /// Accelerations of a phase, one row per point.
    fn acceleration<'py>(
        &self,
        phase: &str,
        z: PyReadonlyArray2<'py, f64>,
        dz: PyReadonlyArray2<'py, f64>,
        u_lat: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (py, d) = (z.py(), self.data.latent_dim());
        let mut phases = self.data.phases().iter();
        let Some(index) = phases.position(|known| known.name == phase) else {
            let phases = self.data.phases().iter();
            let known: Vec<&str> = phases.map(|phase| phase.name.as_str()).collect();
            let expected = known.join(", ");
            let message = format!("phase: found {phase:?}, expected one of {expected}");
            return Err(refusal(py, &message, None));
        };
        let points = [("z", &z), ("dz", &dz), ("u_lat", &u_lat)];
        for (name, array) in points {
            check_counts(py, ("z", z.shape()[0]), (name, array.shape()[0]))?;
        }
        let [z, dz, u_lat] = points.map(|(name, array)| vectors(name, array, d));
        let (z, dz, u_lat) = (z?, dz?, u_lat?);
        let accelerations = py.detach(|| -> Result<Vec<_>, LowerError> {
            let mut compiled = self.compiled()?;
            let points = z.iter().zip(&dz).zip(&u_lat);
            let ddz = points.map(|((z, dz), u_lat)| {
                let mut ddz = DVector::zeros(d);
                let (z, dz, u_lat) = (z.as_slice(), dz.as_slice(), u_lat.as_slice());
                compiled.ddz(index, z, dz, u_lat, ddz.as_mut_slice());
                ddz
            });
            Ok(ddz.collect())
        });
        let accelerations = accelerations.map_err(|error| python_error(py, error))?;
        Ok(from_vectors(py, d, &accelerations))
    }

    /// The model file's keys without the tensors, for `repr` and notebooks.
    fn summary(&self) -> BTreeMap<&'static str, String> {
        let mut summary = BTreeMap::new();
        summary.insert("description", self.data.description().to_owned());
        if let Ok(robot) = self.data.robot() {
            summary.insert("robot", robot.name.to_owned());
        }
        if let Ok(encoder) = self.data.encoder_map() {
            summary.insert("encoder", encoder.summary());
        }
        if let Ok(decoder) = self.data.decoder_map() {
            summary.insert("decoder", decoder.summary());
        }
        summary
    }
}
