//! The certificate as JSON.

use serde_json::{Map, Value, json};

use super::certificate::{Certificate, Change, ChangeKind, EquationCertificate, PhaseCertificate};
use super::measure::Measured;
use super::rollouts::{RolloutEffect, RolloutErrors};
use super::tolerance::Tolerance;
use crate::symbolic::Interval;

/// The whole certificate.
pub fn certificate_json(certificate: &Certificate) -> Value {
    let ((terms_before, terms_after), (operations_before, operations_after)) =
        (certificate.terms(), certificate.operations());
    let (digits_before, digits_after) = certificate.digits();
    json!({
        "tolerance": certificate.tolerance.to_string(),
        "tolerance_is": match certificate.tolerance {
            Tolerance::ShareOfRms(_) => "share of the root mean square of each ddz over the recordings",
            Tolerance::Absolute(_) => "scaled units per s^2",
        },
        "terms": { "before": terms_before, "after": terms_after },
        "digits": { "before": digits_before, "after": digits_after },
        "operations": { "before": operations_before, "after": operations_after },
        "largest_bound_share_of_rms": certificate.largest_bound_share(),
        "largest_measured_share_of_rms": certificate.largest_measured_share(),
        "phases": certificate.phases.iter().map(phase_json).collect::<Vec<_>>(),
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

fn phase_json(phase: &PhaseCertificate) -> Value {
    let domain = phase.domain.as_ref().map(|domain| {
        let ranges = domain
            .iter()
            .map(|(name, range)| (name.clone(), interval_json(*range)));
        ranges.collect::<Map<_, _>>()
    });
    json!({
        "name": phase.name,
        "domain": domain,
        "samples": phase.samples,
        "samples_outside_domain": phase.samples_outside,
        "operations": { "before": phase.operations.0, "after": phase.operations.1 },
        "no_longer_depends_on": phase.lost.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "equations": phase.equations.iter().map(equation_json).collect::<Vec<_>>(),
    })
}

fn equation_json(equation: &EquationCertificate) -> Value {
    json!({
        "equation": format!("ddz{}", equation.output + 1),
        "rms": equation.rms,
        "allowed": equation.allowed,
        "bound": interval_json(equation.bound),
        "sum_of_bounds": interval_json(equation.sum_of_bounds),
        "measured": equation.measured.map(measured_json),
        "terms": { "before": equation.terms_before, "after": equation.terms_after },
        "changes": equation.changes.iter().map(change_json).collect::<Vec<_>>(),
    })
}

fn change_json(change: &Change) -> Value {
    let (kind, digits) = match change.kind {
        ChangeKind::Dropped => ("dropped", None),
        ChangeKind::Constant => ("constant", None),
        ChangeKind::Linear => ("linear", None),
        ChangeKind::Quadratic => ("quadratic", None),
        ChangeKind::Rounded { digits } => ("rounded", Some(digits)),
    };
    let effects = change.effects.iter().map(
        |effect| json!({ "term": effect.term, "before": effect.before, "after": effect.after }),
    );
    json!({
        "kind": kind,
        "digits": digits,
        "term": change.term,
        "before": change.before,
        "after": change.after,
        "others": effects.collect::<Vec<_>>(),
        "bound": interval_json(change.bound),
        "measured": change.measured.map(measured_json),
    })
}

fn measured_json(measured: Measured) -> Value {
    json!({ "max": measured.max, "rms": measured.rms })
}

fn interval_json(interval: Interval) -> Value {
    json!([interval.lo(), interval.hi()])
}
