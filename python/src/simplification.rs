//! Simplification of a model over recordings or ranges.

use std::path::Path;

use pyo3::prelude::*;
use romc::Error;
use romc::equations::Equations;
use romc::limits::table;
use romc::model::ReducedModel;
use romc::sim::LatentSegment;
use romc::simplify::{
    Domain, MARGIN, Samples, SimplifyError, Tolerance, certificate_json, certificate_page,
};

use crate::errors::{python_error, usage, within};
use crate::model::Model;
use crate::recording::{Recording, gather};

/// A simpler model within a tolerance, whether it differs, its certificate as JSON and as a page of
/// Markdown.
///
/// The domain is the box around recordings, or `ranges`, the text of a file of ranges.
#[pyfunction]
pub fn simplify(
    py: Python<'_>,
    model: &Model,
    tolerance: &str,
    recordings: Vec<PyRef<'_, Recording>>,
    ranges: Option<&str>,
    margin: Option<f64>,
) -> PyResult<(Model, bool, String, String)> {
    let tolerance: Tolerance =
        (tolerance.parse()).map_err(|error| usage(py, &format!("tolerance: {error}")))?;
    let recordings = gather(&recordings);
    let margin = margin
        .map(|margin| within(py, table::MARGIN, margin))
        .transpose()?;
    let original = &model.data;
    let made = py.detach(|| {
        let (domain, samples) = match ranges {
            Some(_) if margin.is_some() => Err(Error::from(SimplifyError::Margin)),
            Some(text) => {
                let domain = Domain::from_toml(original, Path::new("domain"), text)?;
                Ok((domain, None))
            }
            None => around(original, &recordings, margin.unwrap_or(MARGIN)),
        }?;
        let equations = Equations::of(original);
        let simplified =
            romc::simplify::simplify(&equations, &domain, samples.as_ref(), tolerance)?;
        let (model, certificate) = (simplified.model, simplified.certificate);
        let json = certificate_json(&certificate).to_string();
        let page = certificate_page([original, &model], &certificate);
        let is_changed = certificate.n_changes() > 0;
        Ok((Model::new(model), is_changed, json, page))
    });
    made.map_err(|error: Error| python_error(py, error))
}

/// The box around all samples of recordings, and the samples.
fn around(
    model: &ReducedModel,
    recordings: &[romc::recording::Recording],
    margin: f64,
) -> Result<(Domain, Option<Samples>), Error> {
    if model.encoder_map().is_err() {
        let model = model.name().to_owned();
        return Err(SimplifyError::NoEncoder { model }.into());
    }
    let segments = recordings.iter().flat_map(|recording| &recording.segments);
    let latent = segments.map(|segment| LatentSegment::encode(model, segment));
    let latent = latent.collect::<Result<Vec<_>, _>>()?;
    let samples = Samples::of(model, &latent.iter().collect::<Vec<_>>());
    Ok((Domain::around(model, &samples, margin)?, Some(samples)))
}
