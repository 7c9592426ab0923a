//! The effect of simplification on rollouts over recordings.

use serde_json::{Map, Value, json};

use super::domain::Domain;
use crate::evaluate::CoordinateSums;
use crate::evaluate::EvaluateError;
use crate::lower::CompiledModel;
use crate::model::ReducedModel;
use crate::recording::Segment;
use crate::sim::{LatentSegment, Restart, Rollout, Window, rollout};

const BODY: &str = "body.";

/// Errors of a model's rollouts in the robot's body coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct RolloutErrors {
    /// Root mean squares of each coordinate: whole jumps, restarted.
    pub rms: Vec<[Option<f64>; 2]>,
    /// Windows that diverged: whole jumps, restarted.
    pub diverged: [usize; 2],
    /// Share of the predicted samples outside the domain, where no bound holds: whole jumps, restarted.
    pub outside: [Option<f64>; 2],
}

/// Rollouts of a model and of its simplification beside the recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct RolloutEffect {
    /// Names of the robot's body coordinates.
    pub names: Vec<String>,
    /// Their units.
    pub units: Vec<String>,
    /// Time between restarts, s.
    pub restart_every_s: f64,
    /// Of the model.
    pub before: RolloutErrors,
    /// Of the simplified model.
    pub after: RolloutErrors,
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
