//! Tables of an assessment and of the controller's runs, for pages and terminals alike.

use std::path::{Path, PathBuf};

use super::introduction::headline;
use super::jump::modelled;
use crate::evaluate::{
    AslipSums, Assessment, ByContact, ControlMetrics, CoordinateSums, Fit, FitSums, Invariance,
    LinearisedPhase, PredictionError, Run, Verdict,
};
use crate::model::ReducedModel;
use crate::typeset::{Cell, Table, significant};

/// A recording and the controller's run along it.
pub(crate) type NamedRun = (PathBuf, Run);

fn rms(fit: Option<Fit>) -> Option<f64> {
    fit.map(|fit| fit.rms)
}

fn r2(fit: Option<Fit>) -> Cell {
    let r2 = fit.and_then(|fit| fit.r2);
    r2.map(|r2| format!("{r2:.3}")).into()
}

fn coordinates(assessment: &Assessment<'_>) -> Table {
    let mut table = Table::default();
    table.column("coordinate", "", &assessment.names);
    table.column("unit", "", &assessment.units);
    table
}

/// Fit of every coordinate, whole and restarted; a coordinate that no latent one takes in is marked.
pub(crate) fn coordinate_table(model: &ReducedModel, assessment: &Assessment<'_>) -> Table {
    let every = format!("restarted every {} s", assessment.restart_every_s);
    let mut table = coordinates(assessment);
    let first = assessment.runs.first();
    let modelled = first.and_then(|run| modelled(model, run).ok());
    let is_modelled = |row: usize| modelled.as_ref().is_none_or(|modelled| modelled[row]);
    for (title, coefficient, sums) in [
        ("full rms", "full R^2", &assessment.full),
        (&every, "restarted R^2", &assessment.restarted),
    ] {
        let fits = sums.fits();
        table.column(title, "", fits.iter().copied().map(rms));
        let cells = fits.into_iter().enumerate();
        let cells = cells.map(|(row, fit)| match is_modelled(row) {
            true => r2(fit),
            false => "not modelled".into(),
        });
        table.column(coefficient, "", cells);
    }
    table
}

pub(crate) fn error_table(model: &ReducedModel, assessment: &Assessment<'_>) -> Table {
    with_phases(coordinate_table(model, assessment), model, assessment)
}

pub(crate) fn phase_table(model: &ReducedModel, assessment: &Assessment<'_>) -> Table {
    with_phases(coordinates(assessment), model, assessment)
}

fn with_phases(mut table: Table, model: &ReducedModel, assessment: &Assessment<'_>) -> Table {
    for (index, phase) in model.phases().iter().enumerate() {
        let fits = assessment.restarted.phase_fits(index);
        table.column(&phase.name, "", fits.into_iter().map(rms));
    }
    table
}

pub(crate) fn body_rms(assessment: &Assessment<'_>, sums: &CoordinateSums) -> [Option<f64>; 2] {
    ["body.x", "body.z"].map(|name| rms(assessment.fit(sums, name)))
}

/// The same of a template model.
pub(crate) fn template_rms(sums: &AslipSums) -> [Option<f64>; 2] {
    [sums.x, sums.z].map(|sums| rms(sums.fit()))
}

pub(crate) fn baseline_table(assessment: &Assessment<'_>) -> Table {
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

pub(crate) fn dynamics_table(model: &ReducedModel, assessment: &Assessment<'_>) -> Table {
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

pub(crate) fn invariance_table(invariance: &Invariance) -> Table {
    let shown = |value: Option<f64>| value.map_or("-".to_owned(), significant);
    let words = format!(
        "What the model says of physics that is known: gravity in flight {} m/s^2, mass {} kg; decoded joints \
         move by up to {} rad for a body 1 m further on; by phase, change of the body's acceleration per metre of \
         shift along x and y, and difference between mirror images",
        shown(invariance.gravity_m_s2),
        shown(invariance.mass_kg),
        significant(invariance.joint_shift_rad_m)
    );
    Table::of(&invariance.phases)
        .column("phase", "", |phase| &phase.phase)
        .column("shift in x", "1/s^2", |phase| phase.shift_x)
        .column("shift in y", "1/s^2", |phase| phase.shift_y)
        .column("mirror", "m/s^2", |phase| phase.mirror_asymmetry)
        .table()
        .captioned(words)
}

/// What drives a robot, its predictions, its torques, how far the body is off after a push.
type Driven<'a> = (
    &'static str,
    Option<&'a PredictionError>,
    ByContact,
    Option<f64>,
);

/// The model and its baselines along each recording: figures that a wrong model changes.
pub(crate) fn control_table(runs: &[NamedRun]) -> Table {
    let judged = (runs.iter()).filter_map(|(path, run)| Some((path, run.metrics.as_ref()?)));
    let rows = judged.flat_map(|(path, metrics)| driven(metrics).map(|row| (path, row)));
    let stage =
        |of: fn(&PredictionError) -> f64| move |(_, row): &(&PathBuf, Driven<'_>)| row.1.map(of);
    let millimetres = |metres: f64| 1e3 * metres;
    let x = stage(|error| 1e3 * error.body_x_m);
    let z = stage(|error| 1e3 * error.body_z_m);
    let joints = stage(|error| error.joints_rad);
    Table::of(rows)
        .column("recording", "", |(path, _)| file_name(path))
        .column("controller", "", |(_, row)| row.0)
        .column("x one stage ahead", "mm", x)
        .column("z one stage ahead", "mm", z)
        .column("joints one stage ahead", "rad", joints)
        .column("own input: torque R^2 contact", "", |(_, row)| {
            row.2.contact
        })
        .column("torque R^2 flight", "", |(_, row)| row.2.flight)
        .column("off after a push", "mm", |(_, row)| row.3.map(millimetres))
        .table()
}

fn driven(metrics: &ControlMetrics) -> [Driven<'_>; 5] {
    let (baseline, none) = (&metrics.baseline, ByContact::default());
    let blind = &baseline.no_dynamics;
    let [own, blinds, constant] = [
        &metrics.prediction_rms,
        &blind.prediction_rms,
        &baseline.constant_velocity.prediction_rms,
    ]
    .map(Option::as_ref);
    let [off, replay] = [baseline.feedback_off, baseline.replay].map(|b| b.recovery_rms_m);
    [
        ("model", own, metrics.torque_r2, metrics.recovery_rms_m),
        ("no dynamics", blinds, blind.torque_r2, blind.recovery_rms_m),
        ("constant velocity", constant, none, None),
        ("feedback off", None, none, off),
        ("replay", None, none, replay),
    ]
}

pub(crate) fn failures(runs: &[NamedRun]) -> Vec<String> {
    let failed = runs.iter().filter_map(|(path, run)| {
        let failure = run.metrics.as_ref()?.failure.as_ref()?;
        Some(format!("{}: {failure}", file_name(path)))
    });
    failed.collect()
}

pub(crate) fn verdict_table(verdict: &Verdict) -> Table {
    let number = |value: Option<f64>| match value {
        Some(value) if !value.is_finite() => "diverges".to_owned(),
        value => value.map_or("-".to_owned(), significant),
    };
    Table::of(&verdict.rows)
        .column("for", "", |row| &row.of)
        .column("figure", "", |row| match row.unit {
            "" => row.name.clone(),
            unit => format!("{}, {unit}", row.name),
        })
        .column("model", "", |row| number(row.value))
        .column("needed", "", |row| {
            format!("{} {}", row.bound.words(), significant(row.threshold))
        })
        .column("baseline", "", |row| {
            let baseline = row.baseline.map(significant);
            baseline.map(|baseline| format!("{baseline}, {}", row.baseline_name))
        })
        .column("result", "", |row| match (row.passed, row.counts) {
            (None, _) => "not measured".to_owned(),
            (Some(true), true) => "passed".to_owned(),
            (Some(false), true) => "failed".to_owned(),
            (Some(true), false) => format!("better than {}, does not count", row.baseline_name),
            (Some(false), false) => format!("worse than {}, does not count", row.baseline_name),
        })
        .table()
}

/// A verdict as lines of text: fit for what, every counted row that fails, every other that is worse than its baseline.
pub(crate) fn verdict_lines(verdict: &Verdict) -> String {
    let mut text = format!("verdict: {}\n", headline(verdict, false));
    for row in &verdict.rows {
        match (row.passed, row.counts) {
            (Some(false), true) => text += &format!("FAILED {}: {}\n", row.of, row.words()),
            (Some(false), false) => {
                let name = row.baseline_name;
                text += &format!("worse than {name}, does not count: {}\n", row.words());
            }
            (Some(true) | None, _) => {}
        }
    }
    text
}

pub(crate) fn failed_runs(runs: &[NamedRun]) -> Vec<String> {
    let failed = (runs.iter())
        .filter_map(|(path, run)| Some(format!("{}: {}", file_name(path), run.failure()?)));
    failed.collect()
}

pub(super) fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// The solver's work along each recording, and what the lift makes of recorded inputs, one row per run: whether the
/// dynamics are right changes none of it.
pub(crate) fn run_table(runs: &[NamedRun]) -> Table {
    let rows = runs.iter().map(|(path, run)| (path, &run.summary));
    let whole = |us: f64| format!("{us:.0}");
    Table::of(rows)
        .column("recording", "", |(path, _)| file_name(path))
        .column("steps", "", |(_, run)| run.steps)
        .column("solved", "", |(_, run)| run.solved)
        .column("softened", "", |(_, run)| run.softened)
        .column("failed", "", |(_, run)| run.failed)
        .column("lift R^2 contact", "", |(_, run)| run.lift_r2.contact)
        .column("lift R^2 flight", "", |(_, run)| run.lift_r2.flight)
        .column("limit violations", "", |(_, run)| run.limit_violations)
        .column("friction violations", "", |(_, run)| {
            run.friction_violations
        })
        .column("step, median", "us", |(_, run)| whole(run.step_us.p50))
        .column("step, p99", "us", |(_, run)| whole(run.step_us.p99))
        .table()
}
