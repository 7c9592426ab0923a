//! Figures of the controller's runs: torques beside the recorded ones and the limits, latent inputs, latent tracking,
//! solve times.

use super::jump::JumpName;
use super::*;
use crate::evaluate::{Run, StepRow};
use crate::mpc::{Lift, MpcSettings};

pub(crate) fn control_figures(
    model: &ReducedModel,
    settings: &MpcSettings,
    runs: &[NamedRun],
) -> Vec<Figure> {
    let figures = runs.iter().enumerate().flat_map(|(index, (path, run))| {
        let place = JumpName::of_recording(index, path);
        [
            torques(model, settings.lift, run, &place),
            latent_inputs(model, run, &place),
            latent_tracking(model, settings, run, &place),
            solve_times(settings, run, &place),
        ]
    });
    figures.collect()
}

/// The first phase without input statistics, by which the controller weighs inputs.
pub(crate) fn without_statistics(model: &ReducedModel) -> Option<&str> {
    let mut phases = model.phases().iter().enumerate();
    let without = phases.find(|&(index, _)| model.input_statistics(index).is_err());
    without.map(|(_, phase)| phase.name.as_str())
}

fn line(run: &Run, role: Role, value: impl Fn(&StepRow) -> Option<f64>) -> Series {
    let points = run.rows.iter().map(|row| (row.time_s, value(row)));
    Series::through(role, points)
}

pub(super) fn torques(model: &ReducedModel, lift: Lift, run: &Run, place: &JumpName) -> Figure {
    let limits = model.robot().ok().map(Robot::torque_limit_nm);
    let panel = |joint: usize| {
        let limit = |sign: f64| limits.map(|limits| sign * limits[joint]);
        let recorded = |row: &StepRow| Some(row.recorded_torque_nm[joint]);
        let lines = vec![
            line(run, Role::Recorded, recorded),
            line(run, Role::Full, |row| Some(row.command.torque_nm[joint])),
            line(run, Role::Limit, |_| limit(1.0)),
            line(run, Role::Limit, |_| limit(-1.0)),
        ];
        Panel::lines(format!("{}, N m", Robot::state_names()[joint]), lines)
    };
    let lift = match lift {
        Lift::Transpose => "plain",
        Lift::Consistent => "consistent",
    };
    let caption = format!(
        "Joint torques along {}: recorded, and commanded by the latent controller ({lift} lift), within the robot's limits.",
        place.words
    );
    let legend = [
        (Role::Recorded, "recorded"),
        (Role::Full, "commanded"),
        (Role::Limit, "limits"),
    ];
    let panels = (0..JOINT_DIM).map(panel).collect();
    Figure::over_time(place.id("torques"), caption, panels, &legend)
}

pub(super) fn latent_inputs(model: &ReducedModel, run: &Run, place: &JumpName) -> Figure {
    let panel = |latent: usize| {
        let chosen = |row: &StepRow| row.command.u_lat.get(latent).copied();
        let title = format!("u{}", latent + 1);
        Panel::lines(title, vec![line(run, Role::Full, chosen)])
    };
    let words = &place.words;
    let caption = format!("Latent inputs that the controller chose along {words} (scaled units).");
    let panels = (0..model.latent_dim()).map(panel).collect();
    let legend = [(Role::Full, "commanded")];
    Figure::over_time(place.id("latent_inputs"), caption, panels, &legend)
}

fn latent_tracking(
    model: &ReducedModel,
    settings: &MpcSettings,
    run: &Run,
    place: &JumpName,
) -> Figure {
    let horizon_s = settings.horizon as f64 * settings.step_s;
    let panel = |latent: usize| {
        let planned = run.rows.iter().map(|row| {
            let end = row.z_planned.as_ref().map(|z| z[latent]);
            (row.time_s + horizon_s, end)
        });
        let planned = Series::through(Role::Full, planned);
        let reference = line(run, Role::Recorded, |row| Some(row.z_reference[latent]));
        Panel::lines(format!("z{}", latent + 1), vec![reference, planned])
    };
    let caption = format!(
        "Latent positions along {} (scaled units): the reference, and what each plan expects \
         {horizon_s} s ahead, drawn where it expects it.",
        place.words
    );
    let panels = (0..model.latent_dim()).map(panel).collect();
    let legend = [
        (Role::Recorded, "reference"),
        (Role::Full, "end of the plan"),
    ];
    Figure::over_time(place.id("latent_tracking"), caption, panels, &legend)
}

fn solve_times(settings: &MpcSettings, run: &Run, place: &JumpName) -> Figure {
    let line = |value: fn(&StepRow) -> f64| line(run, Role::Recorded, |row| Some(value(row)));
    let milliseconds = line(|row| 1e-3 * row.command.solve_us);
    let iterations = line(|row| f64::from(row.command.iterations));
    let panels = vec![
        Panel::lines("time of a step, ms", vec![milliseconds]),
        Panel::lines("iterations", vec![iterations]),
    ];
    let caption = format!(
        "Steps along {}: wall time from measurement to command, {} stages of {} s each, and \
         interior-point iterations.",
        place.words, settings.horizon, settings.step_s
    );
    let legend = [(Role::Recorded, "one step")];
    let figure = Figure::over_time(place.id("solve_times"), caption, panels, &legend);
    figure.in_columns(2, (360.0, 170.0))
}
