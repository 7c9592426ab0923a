//! Tables of an assessment and of the controller's runs, for pages and terminals alike.

use super::introduction::headline;
use super::*;
use crate::evaluate::PhaseInvariance;

use crate::plan;

pub(crate) type NamedRun = (PathBuf, Run);

fn rms(fit: Option<Fit>) -> Option<f64> {
    fit.map(|fit| fit.rms)
}

fn r2(fit: Option<Fit>) -> Cell {
    let r2 = fit.and_then(|fit| fit.r2);
    r2.map(|r2| format!("{r2:.3}")).into()
}

fn fit_json(unit: &str, fit: Option<Fit>) -> Value {
    json!({ "unit": unit, "rms": rms(fit), "r2": fit.and_then(|fit| fit.r2) })
}

fn coordinates(assessment: &Assessment<'_>) -> Table {
    let mut table = Table::default();
    table.column("coordinate", "", &assessment.names);
    table.column("unit", "", &assessment.units);
    table
}

pub(crate) fn coordinate_table(model: &ReducedModel, assessment: &Assessment<'_>) -> Table {
    let every = format!("error over {} s", assessment.restart_every_s);
    let every_r2 = format!("R^2 over {} s", assessment.restart_every_s);
    let mut table = coordinates(assessment);
    let first = assessment.runs.first();
    let modelled = first.and_then(|run| modelled(model, run).ok());
    let r2 = |(row, fit): (usize, &Option<Fit>)| match &modelled {
        Some(modelled) if !modelled[row] => "not modelled".into(),
        _ => r2(*fit),
    };
    for (title, coefficient, sums) in [
        ("error, whole motion", "R^2, whole motion", &assessment.full),
        (&every, &every_r2, &assessment.restarted),
    ] {
        let fits = sums.fits();
        table.column(title, "", fits.iter().copied().map(rms));
        table.column(coefficient, "", fits.iter().enumerate().map(r2));
    }
    table
}

pub(crate) fn phase_table(model: &ReducedModel, assessment: &Assessment<'_>) -> Table {
    with_phases(coordinates(assessment), model, assessment)
}

pub(super) fn with_phases(
    mut table: Table,
    model: &ReducedModel,
    assessment: &Assessment<'_>,
) -> Table {
    for (index, phase) in model.phases().iter().enumerate() {
        let fits = assessment.restarted.phase_fits(index);
        table.column(&phase.name, "", fits.into_iter().map(rms));
    }
    table
}

pub(crate) fn body_rms(assessment: &Assessment<'_>, sums: &CoordinateSums) -> [Option<f64>; 2] {
    ["body.x", "body.z"].map(|name| rms(assessment.fit(sums, name)))
}

pub(crate) fn baseline_table(assessment: &Assessment<'_>) -> Table {
    let every = format!("{} s", assessment.restart_every_s);
    let rows = ["body.x", "body.z"].map(|name| ["whole motion", &every].map(|kind| (name, kind)));
    let rows = rows.concat().into_iter();
    let rows = rows.map(|(name, kind)| format!("{name}, {kind}"));
    let mut table = Table::default();
    table.column("root mean square error", "m", rows);
    let sums = [&assessment.full, &assessment.restarted];
    let mut column = |name: &str, [full, restarted]: [[Option<f64>; 2]; 2]| {
        let cells = [full[0], restarted[0], full[1], restarted[1]];
        table.column(name, "", cells);
    };
    column("model", sums.map(|sums| body_rms(assessment, sums)));
    let constant = [
        ("constant velocity", &assessment.constant_velocity),
        (
            "constant latent velocity",
            &assessment.constant_latent_velocity,
        ),
    ];
    for (name, [full, restarted]) in constant {
        column(
            name,
            [full, restarted].map(|sums| body_rms(assessment, sums)),
        );
    }
    for baseline in &assessment.baselines {
        let sums = [&baseline.full, &baseline.restarted];
        column(baseline.name, sums.map(AslipSums::rms));
    }
    table
}

/// Coordinates by row of a table: each of the body, and joints of a kind together; each alone for states without joints.
fn groups(names: &[String]) -> Vec<(String, Vec<usize>)> {
    let of = |is_one: &dyn Fn(&str) -> bool| -> Vec<usize> {
        (0..names.len()).filter(|&i| is_one(&names[i])).collect()
    };
    if names != Robot::state_names() {
        return names.iter().cloned().zip((0..).map(|i| vec![i])).collect();
    }
    let body = names[JOINT_DIM..].iter();
    let body = body.map(|name| (&name[..], of(&|other| other == name)));
    let joints = [("abductions", ".hx"), ("flexions", ".hy"), ("knees", ".kn")];
    let joints = joints.map(|(name, kind)| (name, of(&|other| other.ends_with(kind))));
    let all = body.chain(joints);
    all.map(|(name, rows)| (name.to_owned(), rows)).collect()
}

/// Names and units of the errors of a horizon: the robot's coordinates, then the centre of mass.
fn quantities(assessment: &Assessment<'_>, horizon: &Horizon) -> Vec<(String, String)> {
    let coordinates = assessment.names.iter().zip(&assessment.units);
    let coordinates = coordinates.map(|(name, unit)| (name.clone(), unit.clone()));
    let mass_centre = horizon.mass_centre.iter().map(|of| {
        let body = &assessment.names[of.axis];
        (
            body.replace("body.", "com."),
            assessment.units[of.axis].clone(),
        )
    });
    coordinates.chain(mass_centre).collect()
}

pub(crate) fn horizon_table(assessment: &Assessment<'_>, horizon: &Horizon) -> Table {
    let mut groups = groups(&assessment.names);
    let quantities = quantities(assessment, horizon);
    let mass_centre = (0..).zip(&quantities).skip(assessment.names.len());
    groups.extend(mass_centre.map(|(row, (name, _))| (name.clone(), vec![row])));
    let fits = |predictor: usize, rows: &[usize]| -> Option<Vec<Fit>> {
        let fits = horizon.predictors[predictor].1.fits();
        rows.iter().map(|&row| fits[row]).collect()
    };
    let rms = |predictor, rows: &[usize]| {
        let squares = fits(predictor, rows)?.into_iter();
        let square: f64 = squares.map(|fit| fit.rms * fit.rms).sum();
        Some((square / rows.len() as f64).sqrt())
    };
    let least_r2 = |(_, rows): &&(String, Vec<usize>)| -> Option<String> {
        let all = fits(0, rows)?.into_iter().map(|fit| fit.r2);
        let least = all.collect::<Option<Vec<_>>>()?.into_iter();
        Some(format!("{:.3}", least.fold(f64::INFINITY, f64::min)))
    };
    let mut table = Table::of(&groups)
        .column("coordinate", "", |(name, _)| name)
        .column("unit", "", |(_, rows)| &quantities[rows[0]].1)
        .column("least R^2", "", least_r2);
    for (predictor, (name, _)) in horizon.predictors.iter().enumerate() {
        table = table.column(name, "", |(_, rows)| rms(predictor, rows));
    }
    table
        .column("worse than", "", |(_, rows)| {
            let others = horizon.predictors.iter().enumerate().skip(1);
            let own = rms(0, rows)?;
            let better = others.filter(|(i, _)| rms(*i, rows).is_some_and(|other| other < own));
            let better: Vec<&str> = better.map(|(_, (name, _))| *name).collect();
            (!better.is_empty()).then(|| better.join(", "))
        })
        .table()
}

pub(crate) fn horizon_json(of: &Assessment<'_>, horizon: &Horizon) -> Value {
    let coordinates = quantities(of, horizon).into_iter().enumerate();
    let coordinates = coordinates.map(|(i, (name, unit))| {
        let own = horizon.predictors[0].1.fits()[i];
        let mut value = fit_json(&unit, own);
        for (predictor, sums) in &horizon.predictors[1..] {
            value[predictor.replace(' ', "_")] = json!(rms(sums.fits()[i]));
        }
        (name, value)
    });
    let own = &horizon.predictors[0].1;
    json!({
        "name": horizon.name,
        "rollouts": own.windows,
        "diverged": own.diverged,
        "coordinates": coordinates.collect::<Map<_, _>>(),
    })
}

pub(crate) fn dynamics_table(model: &ReducedModel, assessment: &Assessment<'_>) -> Table {
    let fits = assessment.pointwise.acceleration.iter().map(FitSums::fit);
    let linearised = assessment.linearised.iter().map(Option::as_ref);
    let rows = model.phases().iter().zip(linearised).zip(fits);
    let d = model.latent_dim();
    let rank = |linear: &LinearisedPhase| format!("{} of {d}", linear.input_effective_rank());
    Table::of(rows.map(|((phase, linear), fit)| (phase, linear, fit)))
        .column("phase", "", |(phase, ..)| &phase.name)
        .column("samples", "", |row| row.1.map_or(0, |of| of.samples))
        .column("active terms", "", |(phase, ..)| phase.active_count())
        .column("latent acceleration R^2", "", |(.., fit)| r2(*fit))
        .column("largest Re of eigenvalues", "1/s", |row| {
            let rate = row.1?.growth_rate()?;
            Some(if rate.abs() < ROUNDED { 0.0 } else { rate })
        })
        .column("input gain condition", "", |row| row.1?.input_condition())
        .column("input gain rank", "", |(_, linear, _)| linear.map(rank))
        .table()
}

const ROUNDED: f64 = 1e-9; // below, a difference is the rounding of zero

/// Gravity, mass and symmetries of the equations, which nothing gave them.
pub(crate) fn invariance_table(model: &ReducedModel, invariance: &Invariance) -> Table {
    let phases = invariance.phases.iter();
    let worst = |of: fn(&PhaseInvariance) -> f64| {
        let worst = phases.clone().map(of).fold(0.0, f64::max);
        Some(if worst < ROUNDED { 0.0 } else { worst })
    };
    let mass_kg = model.robot().ok().map(Robot::mass_kg);
    let (in_x, in_y) = (worst(|of| of.shift_x), worst(|of| of.shift_y));
    let rotation = invariance.rotation_rad_s2_per_nm;
    let joints = Some(invariance.joint_shift_rad_m);
    let mirrored = worst(|of| of.mirror_asymmetry);
    let (gravity, zero) = (Some(GRAVITY_M_S2), Some(0.0));
    let rows = [
        ("gravity in flight, m/s^2", invariance.gravity_m_s2, gravity),
        ("mass, kg", invariance.mass_kg, mass_kg),
        (
            "pitch acceleration per moment, rad/s^2 per N m",
            rotation,
            None,
        ),
        ("joints moved by a body 1 m further on, rad", joints, zero),
        ("acceleration changed by a shift in x, 1/s^2", in_x, zero),
        ("acceleration changed by a shift in y, 1/s^2", in_y, zero),
        ("difference between mirror images, m/s^2", mirrored, zero),
    ];
    Table::of(rows.into_iter().filter(|row| row.1.is_some()))
        .column("known physics", "", |row| row.0)
        .column("equations", "", |row| row.1.map(significant))
        .column("known value", "", |row| row.2.map(significant))
        .table()
        .captioned("Read off the equations, compared with known values")
}

type Driven<'a> = (
    &'static str,
    Option<&'a PredictionError>,
    ByContact,
    Option<f64>,
);

pub(crate) fn control_table(runs: &[NamedRun]) -> Table {
    let judged = (runs.iter()).filter_map(|(path, run)| Some((path, run.metrics.as_ref()?)));
    let rows = judged.flat_map(|(path, metrics)| driven(metrics).map(|row| (path, row)));
    let stage =
        |of: fn(&PredictionError) -> f64| move |(_, row): &(&PathBuf, Driven<'_>)| row.1.map(of);
    Table::of(rows)
        .column("recording", "", |(path, _)| file_name(path))
        .column("controller", "", |(_, row)| row.0)
        .column("x, one stage ahead", "mm", stage(|e| 1e3 * e.body_x_m))
        .column("z, one stage ahead", "mm", stage(|e| 1e3 * e.body_z_m))
        .column("joints, one stage ahead", "rad", stage(|e| e.joints_rad))
        .column("torque R^2, contact", "", |row| row.1.2.contact)
        .column("torque R^2, flight", "", |(_, row)| row.2.flight)
        .column("deviation after a push", "mm", |(_, row)| {
            row.3.map(|m| 1e3 * m)
        })
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
        ("no feedback", None, none, off),
        ("replay", None, none, replay),
    ]
}

fn of_runs(runs: &[NamedRun], fault: impl Fn(&Run) -> Option<String>) -> Vec<String> {
    let line = |(path, run): &NamedRun| Some(format!("{}: {}", file_name(path), fault(run)?));
    runs.iter().filter_map(line).collect()
}

pub(crate) fn failures(runs: &[NamedRun]) -> Vec<String> {
    of_runs(runs, |run| run.metrics.as_ref()?.failure.clone())
}

pub(crate) fn failed_runs(runs: &[NamedRun]) -> Vec<String> {
    of_runs(runs, Run::failure)
}

/// The verdict in one line, then a line for each row that is not passed, and for each in which a baseline is better.
pub fn verdict_lines(verdict: &Verdict) -> String {
    let line = |row: &VerdictRow| match (row.counts, row.passed?) {
        (true, false) => Some(format!("FAILED {}: {}\n", row.of, row.words())),
        (false, false) => {
            let (name, words) = (row.baseline_name, row.words());
            Some(format!("worse than {name}, does not count: {words}\n"))
        }
        (_, true) => {
            let (name, value, better) = (&row.name, row.value_words(), row.better_baseline()?);
            Some(format!(
                "passed, but a baseline is better: {name} {value} ({better})\n"
            ))
        }
    };
    let lines = verdict.rows.iter().filter_map(line);
    let headline = format!("verdict: {}\n", headline(verdict, false));
    std::iter::once(headline).chain(lines).collect()
}

pub(super) fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

pub(crate) fn run_table(runs: &[NamedRun]) -> Table {
    let rows = runs.iter().map(|(path, run)| (path, &run.summary));
    Table::of(rows)
        .column("recording", "", |(path, _)| file_name(path))
        .column("steps", "", |(_, run)| run.steps)
        .column("solved", "", |(_, run)| run.solved)
        .column("softened", "", |(_, run)| run.softened)
        .column("failed", "", |(_, run)| run.failed)
        .column("lift R^2 contact", "", |(_, run)| run.lift_r2.contact)
        .column("lift R^2 flight", "", |(_, run)| run.lift_r2.flight)
        .column("beyond limits", "", |(_, run)| run.limit_violations)
        .column("beyond friction", "", |row| row.1.friction_violations)
        .column("step, median, p99", "us", |(_, run)| {
            // Of one width, so that the layout does not depend on the machine.
            format!("{:5.0}, {:6.0}", run.step_us.p50, run.step_us.p99)
        })
        .table()
}

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
        "stride": assessment.stride,
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
    let sums = [&baseline.full, &baseline.restarted].map(AslipSums::rms);
    let [full, restarted] = sums.map(|[x, z]| json!({ "body.x": x, "body.z": z }));
    json!({
        "name": baseline.name,
        "constants": baseline.template.constants(),
        "rms_m": { "full": full, "restarted": restarted },
    })
}

fn rollouts_json(model: &ReducedModel, of: &Assessment<'_>, sums: &CoordinateSums) -> Value {
    let named = |fits: Vec<Option<Fit>>| -> Map<String, Value> {
        let names = of.names.iter().cloned();
        let fits = of.units.iter().zip(fits);
        names
            .zip(fits.map(|(unit, fit)| fit_json(unit, fit)))
            .collect()
    };
    json!({
        "rollouts": sums.windows,
        "diverged": sums.diverged,
        "coordinates": named(sums.fits()),
        "phases": by_phase(model, |index| json!(named(sums.phase_fits(index)))),
    })
}

/// A plan under the names of `docs/reference/plan-settings.md`.
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
