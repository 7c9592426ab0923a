//! Where the error is bounded: a box of latent states and inputs for each phase.

use std::path::{Path, PathBuf};

use super::*;
use crate::lower::LowerError;

/// Default extension of a domain beyond the samples, as a share of each variable's range.
pub const MARGIN: f64 = 0.1;

#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SimplifyError {
    #[error("the domain {0}")]
    Domain(String),
    #[error("{path}: {message}", path = path.display())]
    DomainFile { path: PathBuf, message: String },
    #[error(
        "model `{model}` has no encoder, so recordings give it no domain; give a .toml file with one table per phase, such as [contact], and a range for each of z1, dz1, u1, ..., such as z1 = [-0.2, 0.4]"
    )]
    NoEncoder { model: String },
    #[error(
        "a tolerance in percent is a share of the root mean square of each ddz over recordings, and the domain has none; give a number in scaled units per s^2"
    )]
    NoSamples,
    #[error(
        "a margin widens the box around recordings; the ranges of a .toml file are used unchanged"
    )]
    Margin,
    #[error(
        "internal error: in phase `{phase}`, ddz{output} of the simplified model has an error of {measured:e} at a recorded sample, beyond the bound {bound:e}", output = output + 1
    )]
    Contradiction {
        phase: String,
        output: usize,
        measured: f64,
        bound: f64,
    },
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Lower(#[from] LowerError),
}

/// Recorded samples, sorted by the model's phases.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    /// One matrix per phase, `3 latent_dim x n`: one column per sample, `z`, then `dz`, then `u_lat` (scaled units).
    pub phases: Vec<DMatrix<f64>>,
}

impl Samples {
    /// Sorts the samples of encoded recordings by phase.
    pub fn of(model: &ReducedModel, segments: &[&LatentSegment]) -> Self {
        let rows = 3 * model.latent_dim();
        let of_phase = |phase: usize| {
            let mut values: Vec<f64> = Vec::new();
            for segment in segments {
                for k in (0..segment.time_s.len()).filter(|&k| segment.phase[k] == phase) {
                    for block in [&segment.z, &segment.dz, &segment.u_lat] {
                        values.extend(block.column(k).iter());
                    }
                }
            }
            DMatrix::from_vec(rows, values.len() / rows, values)
        };
        let phases = (0..model.phases().len()).map(of_phase);
        Self {
            phases: phases.collect(),
        }
    }
}

/// One box per phase, over `z`, then `dz`, then `u_lat` (scaled units). A phase without one keeps its equations.
#[derive(Clone, Debug, PartialEq)]
pub struct Domain {
    boxes: Vec<Option<Vec<Interval>>>,
}

impl Domain {
    /// The domain with these boxes, one per phase of the model.
    ///
    /// # Errors
    /// [`SimplifyError::Domain`] for another number of boxes or ranges, and for a range that is empty or infinite.
    pub(crate) fn new(model: &ReducedModel, boxes: Vec<Option<Vec<Interval>>>) -> Result<Self> {
        check_count(boxes.len(), model.phases().len())?;
        let refused = |message| Err(SimplifyError::Domain(message));
        let variables: Vec<_> = LatentVariable::all(model.latent_dim()).collect();
        for (ranges, phase) in boxes.iter().zip(model.phases()) {
            let Some(ranges) = ranges else { continue };
            let (name, found, expected) = (&phase.name, ranges.len(), variables.len());
            if found != expected {
                return refused(format!(
                    "of phase `{name}` has {found} ranges, expected {expected} (z, dz, u of each latent coordinate)"
                ));
            }
            for (range, variable) in ranges.iter().zip(&variables) {
                if range.is_empty() || !range.magnitude().is_finite() {
                    let (lo, hi) = (range.lo(), range.hi());
                    return refused(format!(
                        "of `{variable}` in phase `{name}` is {lo} to {hi}, expected finite numbers in order"
                    ));
                }
            }
        }
        Ok(Self { boxes })
    }

    /// The smallest boxes that hold all samples, each side moved out by `margin` times the width.
    pub fn around(model: &ReducedModel, samples: &Samples, margin: f64) -> Result<Self> {
        let boxes = samples.phases.iter().map(|samples| {
            let ranges = samples.row_iter().map(|row| {
                let points = row.iter().copied().map(Interval::point);
                let range = points.reduce(Interval::hull)?;
                let by = margin * range.width();
                Some(Interval::new(range.lo() - by, range.hi() + by))
            });
            ranges.collect()
        });
        Self::new(model, boxes.collect())
    }

    /// Reads boxes from TOML: one table per phase, with a range per variable, such as `z1 = [-0.2, 0.4]`.
    ///
    /// # Errors
    /// [`SimplifyError::DomainFile`] for an unknown phase or variable, one without a range, and as `Domain::new`.
    pub fn from_toml(model: &ReducedModel, path: &Path, text: &str) -> Result<Self> {
        let refused = |message: String| SimplifyError::DomainFile {
            path: path.to_owned(),
            message,
        };
        let mut tables: BTreeMap<String, BTreeMap<String, [f64; 2]>> =
            toml::from_str(text).map_err(|error| refused(error.to_string()))?;
        let names = (model.phases().iter()).map(|phase| format!("[{}]", phase.name));
        let expected = names.collect::<Vec<_>>().join(" or ");
        let mut boxes = Vec::new();
        for phase in model.phases() {
            let Some(mut table) = tables.remove(&phase.name) else {
                boxes.push(None);
                continue;
            };
            let in_phase = |what: String| refused(format!("[{}] {what}", phase.name));
            let mut ranges = Vec::new();
            for variable in LatentVariable::all(model.latent_dim()) {
                let [lo, hi] = table.remove(&variable.to_string()).ok_or_else(|| {
                    in_phase(format!(
                        "has no range of `{variable}`, expected {variable} = [LOW, HIGH]"
                    ))
                })?;
                // reported as typed: an interval has no ends that are not numbers
                if !(lo.is_finite() && hi.is_finite() && lo <= hi) {
                    return Err(in_phase(format!(
                        "{variable} = [{lo}, {hi}], expected finite numbers in order"
                    )));
                }
                ranges.push(Interval::new(lo, hi));
            }
            if let Some(unknown) = table.keys().next() {
                return Err(in_phase(format!(
                    "has a range of `{unknown}`, which is no variable of the model"
                )));
            }
            boxes.push(Some(ranges));
        }
        if let Some(unknown) = tables.keys().next() {
            return Err(refused(format!(
                "[{unknown}] is no phase of the model, expected {expected}"
            )));
        }
        if boxes.iter().all(Option::is_none) {
            return Err(refused(format!("no phase has ranges, expected {expected}")));
        }
        Self::new(model, boxes)
    }

    pub(crate) fn phase(&self, phase: usize) -> Option<&[Interval]> {
        self.boxes[phase].as_deref()
    }

    /// Whether a point lies in a box; `false` for a phase without one.
    pub(crate) fn contains(&self, phase: usize, point: impl Iterator<Item = f64>) -> bool {
        let is_inside = |ranges: &[Interval]| {
            (ranges.iter().zip(point)).all(|(range, value)| range.contains(value))
        };
        self.phase(phase).is_some_and(is_inside)
    }

    /// Values of the terms of `library` at the samples of a phase that lie in its box: one row per sample.
    pub(super) fn theta(
        &self,
        phase: usize,
        samples: Option<&Samples>,
        library: &Library,
    ) -> Result<DMatrix<f64>, ModelError> {
        let Some(samples) = samples.map(|samples| &samples.phases[phase]) else {
            return Ok(DMatrix::zeros(0, library.terms().len()));
        };
        let inside: Vec<usize> = (0..samples.ncols())
            .filter(|&k| self.contains(phase, samples.column(k).iter().copied()))
            .collect();
        library.evaluate_points(&samples.select_columns(&inside))
    }
}

pub(super) fn check_count(found: usize, expected: usize) -> Result<()> {
    match found == expected {
        true => Ok(()),
        false => Err(SimplifyError::Domain(format!(
            "has {found} boxes, expected one for each of {expected} phases"
        ))),
    }
}
