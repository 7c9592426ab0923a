//! Figures of the controller's runs: torques beside the recorded ones and the limits, latent inputs,
//! latent tracking, solve times.

use std::path::PathBuf;

use super::contents::stem;
use super::figures::{Figure, LinePlot, Panel, Role, Series};
use crate::evaluate::{Run, StepRow};
use crate::model::ReducedModel;
use crate::mpc::{Lift, MpcSettings};
use crate::robot::{JOINT_DIM, Robot};

const PANEL: (f64, f64) = (240.0, 150.0);
const WIDE_PANEL: (f64, f64) = (360.0, 170.0);

/// The figures of each run, numbered in their names: torques, latent inputs, latent tracking and
/// solve times.
pub fn control_figures(
    model: &ReducedModel,
    settings: &MpcSettings,
    runs: &[(PathBuf, Run)],
) -> Vec<Figure> {
    let figures = runs.iter().enumerate().flat_map(|(index, (path, run))| {
        let place = Place {
            suffix: (index + 1).to_string(),
            words: stem(path),
        };
        [
            torques(model, settings.lift, run, &place),
            latent_inputs(model, run, &place),
            latent_tracking(model, settings, run, &place),
            solve_times(settings, run, &place),
        ]
    });
    figures.collect()
}

/// Which jump a figure shows.
pub(super) struct Place {
    pub suffix: String,
    pub words: String,
}

/// A line over the steps of a run.
fn line(run: &Run, role: Role, value: impl Fn(&StepRow) -> Option<f64>) -> Series {
    Series {
        role,
        points: run
            .rows
            .iter()
            .map(|row| (row.time_s, value(row)))
            .collect(),
    }
}

/// Commanded torques beside the recorded ones, between the limits.
pub(super) fn torques(model: &ReducedModel, lift: Lift, run: &Run, place: &Place) -> Figure {
    let limits = model.robot().ok().map(Robot::torque_limit_nm);
    let panel = |joint: usize| {
        let mut series = vec![
            line(run, Role::Recorded, |row| {
                Some(row.recorded_torque_nm[joint])
            }),
            line(run, Role::Full, |row| Some(row.torque_nm[joint])),
        ];
        for sign in [1.0, -1.0] {
            let limit = limits.map(|limits| sign * limits[joint]);
            series.push(line(run, Role::Limit, |_| limit));
        }
        Panel::Lines(LinePlot {
            title: format!("{}, N m", Robot::state_names()[joint]),
            series,
            shaded: Vec::new(),
        })
    };
    let lift = match lift {
        Lift::Transpose => "plain",
        Lift::Consistent => "consistent",
    };
    Figure {
        id: format!("torques_{}", place.suffix),
        caption: format!(
            "Joint torques along {}: recorded, and commanded by the latent controller ({lift} lift), within the robot's limits.",
            place.words
        ),
        x_label: "time, s".to_owned(),
        panel_size: PANEL,
        columns: 3,
        panels: (0..JOINT_DIM).map(panel).collect(),
        legend: vec![
            (Role::Recorded, "recorded".to_owned()),
            (Role::Full, "commanded".to_owned()),
            (Role::Limit, "limits".to_owned()),
        ],
    }
}

/// The controller's latent inputs.
pub(super) fn latent_inputs(model: &ReducedModel, run: &Run, place: &Place) -> Figure {
    let panel = |latent: usize| {
        Panel::Lines(LinePlot {
            title: format!("u{}", latent + 1),
            series: vec![line(run, Role::Full, |row| row.u_lat.get(latent).copied())],
            shaded: Vec::new(),
        })
    };
    Figure {
        id: format!("latent_inputs_{}", place.suffix),
        caption: format!(
            "Latent inputs that the controller chose along {} (scaled units).",
            place.words
        ),
        x_label: "time, s".to_owned(),
        panel_size: PANEL,
        columns: 3,
        panels: (0..model.latent_dim()).map(panel).collect(),
        legend: vec![(Role::Full, "commanded".to_owned())],
    }
}

/// What the plans expect at the end of their horizon beside the reference there.
fn latent_tracking(
    model: &ReducedModel,
    settings: &MpcSettings,
    run: &Run,
    place: &Place,
) -> Figure {
    let horizon_s = settings.horizon as f64 * settings.step_s;
    let panel = |latent: usize| {
        let planned = run.rows.iter().map(|row| {
            let end = row.z_planned.as_ref().map(|z| z[latent]);
            (row.time_s + horizon_s, end)
        });
        Panel::Lines(LinePlot {
            title: format!("z{}", latent + 1),
            series: vec![
                line(run, Role::Recorded, |row| Some(row.z_reference[latent])),
                Series {
                    role: Role::Full,
                    points: planned.collect(),
                },
            ],
            shaded: Vec::new(),
        })
    };
    Figure {
        id: format!("latent_tracking_{}", place.suffix),
        caption: format!(
            "Latent positions along {} (scaled units): the reference, and what each plan expects \
             {horizon_s} s ahead, drawn where it expects it.",
            place.words
        ),
        x_label: "time, s".to_owned(),
        panel_size: PANEL,
        columns: 3,
        panels: (0..model.latent_dim()).map(panel).collect(),
        legend: vec![
            (Role::Recorded, "reference".to_owned()),
            (Role::Full, "end of the plan".to_owned()),
        ],
    }
}

/// Wall time and iterations of every step.
fn solve_times(settings: &MpcSettings, run: &Run, place: &Place) -> Figure {
    let panel = |title: &str, series| {
        Panel::Lines(LinePlot {
            title: title.to_owned(),
            series: vec![series],
            shaded: Vec::new(),
        })
    };
    let milliseconds = line(run, Role::Recorded, |row| Some(1e-3 * row.solve_us));
    let iterations = line(run, Role::Recorded, |row| Some(f64::from(row.iterations)));
    Figure {
        id: format!("solve_times_{}", place.suffix),
        caption: format!(
            "Steps along {}: wall time from measurement to command, {} stages of {} s each, and \
             interior-point iterations.",
            place.words, settings.horizon, settings.step_s
        ),
        x_label: "time, s".to_owned(),
        panel_size: WIDE_PANEL,
        columns: 2,
        panels: vec![
            panel("time of a step, ms", milliseconds),
            panel("iterations", iterations),
        ],
        legend: vec![(Role::Recorded, "a step".to_owned())],
    }
}
