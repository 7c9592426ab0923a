//! An assessment as JSON.

use super::tables::template_rms;
use super::*;
use crate::evaluate::{Baseline, LinearisedPhase};
use crate::plan::{self, Plan};

/// Every metric of an assessment, under the names of the documentation; rms in the units of each coordinate.
pub fn assessment_json(model: &ReducedModel, assessment: &Assessment<'_>) -> Value {
    let (lift, lift_r2) = (&assessment.lift, assessment.lift.torque.r2());
    json!({
        "segments": assessment.runs.len(),
        "restart_every_s": assessment.restart_every_s,
        "full": rollouts_json(model, assessment, &assessment.full),
        "restarted": rollouts_json(model, assessment, &assessment.restarted),
        "acceleration_r2": by_phase(model, |index| {
            let fit = assessment.pointwise.acceleration[index].fit();
            json!(fit.and_then(|fit| fit.r2))
        }),
        "linearised": by_phase(model, |index| {
            json!(assessment.linearised[index].as_ref().map(linearised_json))
        }),
        "decoder_mean_square_scaled": assessment.decoder_mean_square(),
        "active_terms": assessment.active_terms,
        "combined_loss": assessment.combined_loss(),
        "lift": {
            "torque_r2": {
                "contact": lift_r2.contact,
                "flight": lift_r2.flight,
                "all": lift.torque.r2_all(),
            },
            "inconsistency": lift.inconsistency(),
        },
        "baselines": assessment.baselines.iter().map(baseline_json).collect::<Vec<_>>(),
        "remarks": assessment.remarks,
    })
}

fn by_phase(model: &ReducedModel, value: impl Fn(usize) -> Value) -> Map<String, Value> {
    let names = model.phases().iter().map(|phase| phase.name.clone());
    names.zip((0..).map(value)).collect()
}

fn linearised_json(phase: &LinearisedPhase) -> Value {
    json!({
        "samples": phase.samples,
        "eigenvalues_per_s": phase.eigenvalues.iter().map(|v| [v.re, v.im]).collect::<Vec<_>>(),
        "input_singular_values": phase.input_singular_values,
        "input_condition": phase.input_condition(),
        "input_effective_rank": phase.input_effective_rank(),
    })
}

fn baseline_json(baseline: &Baseline) -> Value {
    let sums = [&baseline.full, &baseline.restarted].map(template_rms);
    let [full, restarted] = sums.map(|[x, z]| json!({ "body.x": x, "body.z": z }));
    json!({
        "name": baseline.name,
        "constants": baseline.template.constants(),
        "rms_m": { "full": full, "restarted": restarted },
    })
}

fn rollouts_json(
    model: &ReducedModel,
    assessment: &Assessment<'_>,
    sums: &CoordinateSums,
) -> Value {
    let named = |fits: Vec<Option<Fit>>| -> Map<String, Value> {
        let names = assessment.names.iter().cloned();
        let fits = assessment.units.iter().zip(fits).map(|(unit, fit)| {
            let (rms, r2) = (fit.map(|fit| fit.rms), fit.and_then(|fit| fit.r2));
            json!({ "unit": unit, "rms": rms, "r2": r2 })
        });
        names.zip(fits).collect()
    };
    json!({
        "rollouts": sums.windows,
        "diverged": sums.diverged,
        "coordinates": named(sums.fits()),
        "phases": by_phase(model, |index| json!(named(sums.phase_fits(index)))),
    })
}

pub fn plan_json(planned: &Plan) -> Value {
    let durations = (planned.parts.iter()).map(|part| (part.name.clone(), json!(part.duration_s)));
    json!({
        "distance_m": planned.reached_m[0],
        "apex_m": planned.reached_m[1],
        "goal_m": planned.goal_m,
        "expected_error_m": { "distance": planned.error_m[0], "apex": planned.error_m[1] },
        "durations_s": durations.collect::<Map<_, _>>(),
        "cost": planned.cost,
        "input_deviation": planned.input_deviation,
        "extrapolates": planned.verdict != plan::Verdict::Trusted,
        "reasons": planned.verdict.reasons(),
        "margins": planned.margins,
        "programs": planned.programs,
        "solve_ms": planned.solve_ms,
        "status": planned.verdict.word(),
    })
}
