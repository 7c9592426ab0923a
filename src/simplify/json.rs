//! The certificate as JSON.

use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

use super::certificate::{Certificate, ChangeKind};
use super::rollouts::{RolloutEffect, RolloutErrors};
use super::tolerance::Tolerance;
use crate::model::LatentVariable;
use crate::symbolic::Interval;

/// The whole certificate.
pub fn certificate_json(certificate: &Certificate) -> Value {
    json!({
        "tolerance": certificate.tolerance.to_string(),
        "tolerance_is": match certificate.tolerance {
            Tolerance::ShareOfRms(_) => "share of the root mean square of each ddz over the recordings",
            Tolerance::Absolute(_) => "scaled units per s^2",
        },
        "terms": certificate.terms(),
        "digits": certificate.digits(),
        "operations": certificate.operations(),
        "largest_bound_share_of_rms": certificate.largest_bound_share(),
        "largest_measured_share_of_rms": certificate.largest_measured_share(),
        "phases": certificate.phases,
        "exact": certificate.exact,
    })
}

/// The effect on rollouts; keys are the coordinates' names.
pub fn rollouts_json(effect: &RolloutEffect) -> Value {
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

/// `ddz1` for the first latent coordinate.
pub(super) fn equation<S: Serializer>(output: &usize, to: S) -> Result<S::Ok, S::Error> {
    to.collect_str(&format_args!("ddz{}", output + 1))
}

/// The lower and the upper end of an interval.
pub(super) fn ends<S: Serializer>(interval: &Interval, to: S) -> Result<S::Ok, S::Error> {
    [interval.lo(), interval.hi()].serialize(to)
}

/// Ranges under their variables' names.
pub(super) fn ranges<S: Serializer>(
    domain: &Option<Vec<(String, Interval)>>,
    to: S,
) -> Result<S::Ok, S::Error> {
    let Some(ranges) = domain else {
        return to.serialize_none();
    };
    to.collect_map((ranges.iter()).map(|(name, range)| (name, [range.lo(), range.hi()])))
}

/// Names of variables.
pub(super) fn names<S: Serializer>(lost: &[LatentVariable], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(lost.iter().map(ToString::to_string))
}

/// The kind of a change, with the digits of a rounding.
pub(super) fn kind<S: Serializer>(kind: &ChangeKind, to: S) -> Result<S::Ok, S::Error> {
    let (kind, digits) = match kind {
        ChangeKind::Dropped => ("dropped", None),
        ChangeKind::Constant => ("constant", None),
        ChangeKind::Linear => ("linear", None),
        ChangeKind::Quadratic => ("quadratic", None),
        ChangeKind::Rounded { digits } => ("rounded", Some(digits)),
    };
    json!({ "kind": kind, "digits": digits }).serialize(to)
}
