//! Tables of an assessment and of the controller's runs, for pages and terminals alike.

use std::path::PathBuf;

use crate::evaluate::{AslipSums, Assessment, CoordinateSums, Fit, FitSums, LinearisedPhase, Run};
use crate::model::ReducedModel;
use crate::typeset::{Cell, Table};

/// A recording and the controller's run along it.
pub type NamedRun = (PathBuf, Run);

fn rms(fit: Option<Fit>) -> Option<f64> {
    fit.map(|fit| fit.rms)
}

fn r2(fit: Option<Fit>) -> Cell {
    let r2 = fit.and_then(|fit| fit.r2);
    r2.map(|r2| format!("{r2:.3}")).into()
}

/// A row for each coordinate, so far with its name and unit.
fn coordinates(assessment: &Assessment<'_>) -> Table {
    let mut table = Table::default();
    table.column("coordinate", "", &assessment.names);
    table.column("unit", "", &assessment.units);
    table
}

/// Fit of every coordinate, whole and restarted.
pub fn coordinate_table(assessment: &Assessment<'_>) -> Table {
    let every = format!("restarted every {} s", assessment.restart_every_s);
    let mut table = coordinates(assessment);
    for (title, sums) in [
        ("full rms", &assessment.full),
        (&every, &assessment.restarted),
    ] {
        let fits = sums.fits();
        table.column(title, "", fits.iter().copied().map(rms));
        table.column("R^2", "", fits.iter().copied().map(r2));
    }
    table
}

/// Restarted residuals of every coordinate, one column per phase.
pub fn phase_table(model: &ReducedModel, assessment: &Assessment<'_>) -> Table {
    let mut table = coordinates(assessment);
    for (index, phase) in model.phases().iter().enumerate() {
        let fits = assessment.restarted.phase_fits(index);
        table.column(&phase.name, "", fits.into_iter().map(rms));
    }
    table
}

/// Root mean square errors of body x and z.
pub fn body_rms(assessment: &Assessment<'_>, sums: &CoordinateSums) -> [Option<f64>; 2] {
    ["body.x", "body.z"].map(|name| rms(assessment.fit(sums, name)))
}

/// The same of a template model.
pub fn template_rms(sums: &AslipSums) -> [Option<f64>; 2] {
    [sums.x, sums.z].map(|sums| rms(sums.fit()))
}

/// The model beside the template models, body x and z.
pub fn baseline_table(assessment: &Assessment<'_>) -> Table {
    let every = format!("restarted every {} s", assessment.restart_every_s);
    let titles = ["body.x", "body.z"]
        .into_iter()
        .flat_map(|name| ["whole jump", &every].map(|title| format!("{name}, {title}")));
    let mut table = Table::default();
    table.column("rms error", "m", titles);
    let rows = |[x, z]: [Option<f64>; 2], [restarted_x, restarted_z]: [Option<f64>; 2]| {
        [x, restarted_x, z, restarted_z]
    };
    let [full, restarted] =
        [&assessment.full, &assessment.restarted].map(|sums| body_rms(assessment, sums));
    table.column("model", "", rows(full, restarted));
    for baseline in &assessment.baselines {
        let [full, restarted] = [&baseline.full, &baseline.restarted].map(template_rms);
        table.column(baseline.name, "", rows(full, restarted));
    }
    table
}

/// Latent accelerations, stability and input gain of each phase.
pub fn dynamics_table(model: &ReducedModel, assessment: &Assessment<'_>) -> Table {
    let fits = assessment.pointwise.acceleration.iter().map(FitSums::fit);
    let phases = model.phases().iter();
    let linearised = assessment.linearised.iter().map(Option::as_ref);
    let growth = "largest Re of eigenvalues";
    let rows = phases.zip(linearised).zip(fits);
    Table::of(rows.map(|((phase, linear), fit)| (phase, linear, fit)))
        .column("phase", "", |(phase, ..)| &phase.name)
        .column("samples", "", |(_, linear, _)| {
            linear.map_or(0, |linear| linear.samples)
        })
        .column("active terms", "", |(phase, ..)| phase.active_count())
        .column("latent acceleration R^2", "", |(.., fit)| r2(*fit))
        .column(growth, "1/s", |(_, linear, _)| {
            linear.and_then(LinearisedPhase::growth_rate)
        })
        .column("input gain condition", "", |(_, linear, _)| {
            linear.and_then(LinearisedPhase::input_condition)
        })
        .column("input gain rank", "", |(_, linear, _)| {
            let rank = linear.map(LinearisedPhase::input_effective_rank);
            rank.map(|rank| format!("{rank} of {}", model.latent_dim()))
        })
        .table()
}

/// Signs that the recordings are unlike those that the model was learned from. Flight is left out: accelerations
/// hardly vary there, and any model is as far off as their mean.
pub fn remarks(model: &ReducedModel, assessment: &Assessment<'_>) -> Vec<String> {
    let accelerations = assessment.pointwise.acceleration.iter().map(FitSums::fit);
    let worse_than_mean = |fit: &Option<Fit>| fit.and_then(|fit| fit.r2).is_some_and(|r2| r2 < 0.0);
    (model.phases().iter().zip(accelerations))
        .filter(|(phase, fit)| !phase.feet.matches([false; 4]) && worse_than_mean(fit))
        .map(|(phase, _)| {
            format!(
                "in {} the latent accelerations are further off than their mean would be (R^2 below 0): \
                 these recordings are unlike those of the training. Another robot, other signs or \
                 frames, or motions that it never saw? Do not rely on predictions or torques there",
                phase.name
            )
        })
        .collect()
}

/// Steps, torques and times of the controller, one row per run.
pub fn run_table(runs: &[NamedRun]) -> Table {
    let rows = runs.iter().map(|(path, run)| (path, &run.summary));
    Table::of(rows)
        .column("recording", "", |(path, _)| {
            let name = path.file_name().unwrap_or_default();
            name.to_string_lossy().into_owned()
        })
        .column("steps", "", |(_, run)| run.steps)
        .column("solved", "", |(_, run)| run.solved)
        .column("softened", "", |(_, run)| run.softened)
        .column("failed", "", |(_, run)| run.failed)
        .column("torque R^2 contact", "", |(_, run)| run.torque_r2.contact)
        .column("flight", "", |(_, run)| run.torque_r2.flight)
        .column("rms", "N m", |(_, run)| run.torque_rms_nm)
        .column("lift R^2 contact", "", |(_, run)| run.lift_r2.contact)
        .column("limit violations", "", |(_, run)| run.limit_violations)
        .column("friction violations", "", |(_, run)| {
            run.friction_violations
        })
        .column("median", "us", |(_, run)| format!("{:.0}", run.step_us.p50))
        .column("p99", "us", |(_, run)| format!("{:.0}", run.step_us.p99))
        .table()
}
