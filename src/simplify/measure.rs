//! Differences of equations, also as printed with rounded coefficients: bounds over a box, size at samples, and the
//! effect on rollouts over recordings.

use super::*;
use crate::evaluate::{CoordinateSums, EvaluateError};
use crate::lower::CompiledModel;
use crate::recording::Segment;

/// How large an error is at recorded samples (scaled units per second squared).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Measured {
    pub max: f64,
    pub rms: f64,
}

impl Measured {
    pub(crate) fn of(errors: impl IntoIterator<Item = f64>) -> Option<Self> {
        let (mut count, mut square, mut max) = (0usize, 0.0, 0.0f64);
        for error in errors {
            count += 1;
            square += error * error;
            max = max.max(error.abs());
        }
        (count > 0).then(|| Self {
            max,
            rms: (square / count as f64).sqrt(),
        })
    }
}

/// Rows of terms with their coefficients before and after a change.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Differences(pub Vec<(usize, f64, f64)>);

impl Differences {
    pub(crate) fn between(before: &[f64], after: &[f64]) -> Self {
        let rows = before.iter().zip(after).enumerate();
        let rows = rows.map(|(row, (&before, &after))| (row, before, after));
        Self(rows.filter(|(_, before, after)| before != after).collect())
    }

    /// Contains the equation before minus the equation after at every point of the box.
    pub(crate) fn bound(&self, ranges: &mut Ranges<'_>) -> Interval {
        let part = |&(row, before, after): &(usize, f64, f64)| {
            (row, Interval::point(before) - Interval::point(after))
        };
        ranges.combination(&self.0.iter().map(part).collect::<Vec<_>>())
    }

    pub(crate) fn measured(&self, theta: &DMatrix<f64>) -> Option<Measured> {
        let at = |sample| {
            let parts = self.0.iter();
            parts.map(move |&(row, before, after)| (before - after) * theta[(sample, row)])
        };
        Measured::of((0..theta.nrows()).map(|sample| at(sample).sum()))
    }
}

/// How far a printed equation can be from the model's.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PrintedEquation {
    pub phase: String,
    /// Index of the latent coordinate.
    pub output: usize,
    /// Contains the model's `ddz` minus `ddz` as printed over the domain; `None` where the phase has none.
    pub bound: Option<Interval>,
    /// The same at the recorded samples in the domain.
    pub(crate) measured: Option<Measured>,
}

/// The errors of all equations when their coefficients are printed with `rounding`.
pub(crate) fn printed(
    equations: &Equations<'_>,
    domain: &Domain,
    samples: Option<&Samples>,
    rounding: Rounding,
) -> Result<Vec<PrintedEquation>> {
    let workspace = Workspace::new(equations)?;
    let mut all = Vec::new();
    for (index, phase) in equations.phases.iter().enumerate() {
        let theta = domain.theta(index, samples, &workspace.library)?;
        let mut ranges = domain
            .phase(index)
            .map(|domain| Ranges::new(&workspace, domain));
        for (output, summands) in phase.ddz.iter().enumerate() {
            let differences = summands.iter().map(|summand| {
                let printed = Decimal::rounded(summand.coefficient, rounding).value();
                (summand.term, summand.coefficient, printed)
            });
            let differences = differences.filter(|(_, exact, printed)| exact != printed);
            let differences = Differences(differences.collect());
            all.push(PrintedEquation {
                phase: phase.name.clone(),
                output,
                bound: (ranges.as_mut()).map(|ranges| differences.bound(ranges)),
                measured: differences.measured(&theta),
            });
        }
    }
    Ok(all)
}

const BODY: &str = "body.";

/// Errors of a model's rollouts in the robot's body coordinates.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RolloutErrors {
    /// Root mean squares of each coordinate: whole jumps, restarted.
    pub rms: Vec<[Option<f64>; 2]>,
    /// Windows that diverged: whole jumps, restarted.
    pub diverged: [usize; 2],
    /// Share of the predicted samples outside the domain, where no bound holds: whole jumps, restarted.
    pub outside: [Option<f64>; 2],
}

/// Rollouts of a model and of its simplification, compared with the recordings.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RolloutEffect {
    pub names: Vec<String>,
    pub units: Vec<String>,
    /// Time between restarts, s.
    pub restart_every_s: f64,
    /// Of the model.
    pub(crate) before: RolloutErrors,
    /// Of the simplified model.
    pub(crate) after: RolloutErrors,
}

#[derive(Clone, Debug)]
pub(crate) struct RolloutBasis<'a> {
    pub domain: &'a Domain,
    pub segments: Vec<&'a Segment>,
    pub latent: Vec<&'a LatentSegment>,
    pub restart_every_s: f64,
}

impl RolloutBasis<'_> {
    pub(crate) fn effect(
        &self,
        model: &ReducedModel,
        simplified: &ReducedModel,
    ) -> Result<RolloutEffect, EvaluateError> {
        let (names, units) = body(model).map(|(_, name, unit)| (name, unit)).unzip();
        Ok(RolloutEffect {
            names,
            units,
            restart_every_s: self.restart_every_s,
            before: self.errors(model)?,
            after: self.errors(simplified)?,
        })
    }

    pub(crate) fn errors(&self, model: &ReducedModel) -> Result<RolloutErrors, EvaluateError> {
        let coordinates: Vec<usize> = body(model).map(|(index, _, _)| index).collect();
        let compiled = CompiledModel::new(model)?;
        let mut errors = RolloutErrors {
            rms: vec![[None; 2]; coordinates.len()],
            diverged: [0; 2],
            outside: [None; 2],
        };
        let restarts = [Restart::Never, Restart::Every(self.restart_every_s)];
        for (kind, restart) in restarts.into_iter().enumerate() {
            let mut sums = CoordinateSums::new(model)?;
            let (mut outside, mut predicted) = (0usize, 0usize);
            for (&segment, &latent) in self.segments.iter().zip(&self.latent) {
                let run = rollout(&compiled, latent, restart);
                sums.add_rollout(model, segment, latent, &run)?;
                outside += self.outside(latent, &run);
                predicted += run.predictions().count();
            }
            for (of_coordinate, &k) in errors.rms.iter_mut().zip(&coordinates) {
                of_coordinate[kind] = sums.fits()[k].map(|fit| fit.rms);
            }
            errors.diverged[kind] = sums.diverged;
            errors.outside[kind] = (predicted > 0).then(|| outside as f64 / predicted as f64);
        }
        Ok(errors)
    }

    fn outside(&self, latent: &LatentSegment, run: &Rollout) -> usize {
        let is_inside = |(sample, window, column): &(usize, &Window, usize)| {
            let z = window.z.column(*column);
            let dz = window.dz.column(*column);
            let u_lat = latent.u_lat.column(*sample);
            let point = z.iter().chain(dz.iter()).chain(u_lat.iter()).copied();
            self.domain.contains(latent.phase[*sample], point)
        };
        run.predictions().filter(|place| !is_inside(place)).count()
    }
}

fn body(model: &ReducedModel) -> impl Iterator<Item = (usize, String, String)> + '_ {
    let signals = model.state().into_iter();
    signals
        .flat_map(|state| state.names.iter().zip(&state.units).enumerate())
        .filter(|(_, (name, _))| name.starts_with(BODY))
        .map(|(index, (name, unit))| (index, name.clone(), unit.clone()))
}

pub(crate) fn rollouts_json(effect: &RolloutEffect) -> Value {
    let of = |errors: &RolloutErrors| -> Map<String, Value> {
        let named = effect.names.iter().zip(&errors.rms);
        let entry = |rms: &[Option<f64>; 2]| json!({ "full": rms[0], "restarted": rms[1] });
        named
            .map(|(name, rms)| (name.clone(), entry(rms)))
            .collect()
    };
    json!({
        "restart_every_s": effect.restart_every_s,
        "rms_before": of(&effect.before),
        "rms_after": of(&effect.after),
        "diverged": { "full": effect.after.diverged[0], "restarted": effect.after.diverged[1] },
        "share_outside_domain": { "full": effect.after.outside[0], "restarted": effect.after.outside[1] },
    })
}

#[cfg(test)]
#[path = "../../tests/units/simplify_measure.rs"]
mod tests;
