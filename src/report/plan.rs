//! Figures of a planned jump, and of all the jumps that can be planned.

use super::*;

const FRAMES: usize = 8;
const CROSS_M: f64 = 0.004;

pub(crate) fn plan_figures(plan: &Plan, robot: &Robot) -> Vec<Figure> {
    let motion = &plan.motion;
    let [distance_m, apex_m] = plan.goal_m;
    let goal = format!("a planned jump of {distance_m} m, {apex_m} m high");
    let planned = Motion {
        role: Role::Full,
        words: "planned".to_owned(),
        ..Motion::recorded(motion)
    };
    let names = ("plan_posture".to_owned(), format!("Posture in {goal}."));
    let seen_from = (0.0, floor_m(robot, motion));
    let strip = (motion.time_s.as_slice(), &[planned][..]);
    vec![
        film_strip(robot, names, strip, seen_from, FRAMES),
        path(plan, &goal),
        phases(plan, &goal),
        torques(plan, robot, &goal),
    ]
}

fn over_time(plan: &Plan, role: Role, value: impl Fn(usize) -> f64) -> Series {
    Series::over(role, &plan.motion.time_s, |sample| Some(value(sample)))
}

fn flights(plan: &Plan) -> Vec<(f64, f64)> {
    let motion = &plan.motion;
    let mut end = 0.0;
    let spans = plan.parts.iter().filter_map(|part| {
        let (start, middle) = (end, end + 0.5 * part.duration_s);
        end += part.duration_s;
        let sample = motion.time_s.partition_point(|time| *time < middle);
        let feet = motion.feet[sample.min(motion.len() - 1)];
        (feet == [false; 4]).then_some((start, end))
    });
    spans.collect()
}

fn panel(plan: &Plan, title: String, series: Vec<Series>) -> Panel {
    Panel::shaded(title, series, flights(plan))
}

fn path(plan: &Plan, goal: &str) -> Figure {
    let x = &plan.motion.x;
    let points = (0..plan.motion.len()).map(|k| (x[(BODY_X, k)], Some(x[(BODY_Z, k)])));
    let body = Series::through(Role::Full, points);
    let panels = vec![Panel::lines("body z, m", vec![body])];
    let caption = format!("Path of the body in {goal}.");
    let figure = Figure::over_time("plan_path", caption, panels, &[(Role::Full, "planned")]);
    figure.over("body x, m").in_columns(1, (360.0, 220.0))
}

fn phases(plan: &Plan, goal: &str) -> Figure {
    let motion = &plan.motion;
    let names = Robot::state_names();
    let panels = [BODY_X, BODY_Z, BODY_Z + 2].into_iter().flat_map(|row| {
        let position = over_time(plan, Role::Full, |k| motion.x[(row, k)]);
        let rate = over_time(plan, Role::Full, |k| motion.dx[(row, k)]);
        let unit = &Robot::state_units()[row];
        let of_rate = format!("rate of {}, {unit}/s", names[row]);
        [
            panel(plan, format!("{}, {unit}", names[row]), vec![position]),
            panel(plan, of_rate, vec![rate]),
        ]
    });
    let mut end = 0.0;
    let parts = plan.parts.iter().map(|part| {
        end += part.duration_s;
        format!("{} to {end:.3} s", part.name)
    });
    let parts = parts.collect::<Vec<_>>().join(", ");
    let caption = format!("The body in {goal}: {parts}; the flight is shaded.");
    let legend = [(Role::Full, "planned")];
    let figure = Figure::over_time("plan_phases", caption, panels.collect(), &legend);
    let size = figure.panel_size;
    figure.in_columns(2, size)
}

fn torques(plan: &Plan, robot: &Robot, goal: &str) -> Figure {
    let names = Robot::state_names();
    let panels = (0..JOINT_DIM).map(|joint| {
        let limit = robot.torque_limit_nm()[joint];
        let torque = |k: usize| plan.motion.torque_nm[(joint, k)];
        let lines = vec![
            over_time(plan, Role::Full, torque),
            over_time(plan, Role::Limit, |_| limit),
            over_time(plan, Role::Limit, |_| -limit),
        ];
        panel(plan, format!("{}, N m", names[joint]), lines)
    });
    let caption =
        format!("Torques of the motors in {goal}, within their limits; the flight is shaded.");
    let legend = [(Role::Full, "planned"), (Role::Limit, "limit")];
    Figure::over_time("plan_torques", caption, panels.collect(), &legend)
}

pub(crate) fn reach_figure(reach: &GoalMap, prior: &JumpPrior) -> Figure {
    let crosses = (prior.landmarks.jumps.iter()).flat_map(|&[distance, apex, _]| {
        let at = |x: f64, y: f64| (distance + x * CROSS_M, Some(apex + 0.25 * y * CROSS_M));
        let gap = (distance, None);
        [[-1.0, 1.0], [1.0, -1.0]]
            .map(|[from, to]| [at(-1.0, from), at(1.0, to), gap])
            .concat()
    });
    let series = vec![
        Series::through(Role::Recorded, crosses),
        border(reach, Role::Full, &["trusted"]),
        border(reach, Role::Restarted, &["trusted", "extrapolates"]),
    ];
    let caption = "Jumps that can be planned: those to be trusted, and those with a warning.";
    let panels = vec![Panel::lines("apex above the start, m", series)];
    let legend = [
        (Role::Recorded, "recorded"),
        (Role::Full, "trusted"),
        (Role::Restarted, "with a warning"),
    ];
    let figure = Figure::over_time("plan_reach", caption, panels, &legend);
    figure.over("distance, m").in_columns(1, (420.0, 280.0))
}

/// Largest torques of planned walks over the speed: straight on, and turning as much as was recorded.
pub(crate) fn walk_reach_figure(map: &WalkMap) -> Figure {
    let line = |role, yaw_rate: f64| {
        let near = |point: &&MappedWalk| (point.yaw_rate_rad_s - yaw_rate).abs() < 1e-9;
        let points = map.points.iter().filter(near);
        let points = points.map(|point| (point.speed_m_s, Some(100.0 * point.torque_share)));
        Series::through(role, points)
    };
    let rates = &map.yaw_rates_rad_s;
    let (middle, last) = (rates.len() / 2, rates.len() - 1);
    let roles = [
        (Role::Restarted, 0),
        (Role::Full, middle),
        (Role::Recorded, last),
    ];
    let names = roles.map(|(role, k)| (role, format!("{:.2} rad/s", rates[k])));
    let legend: Vec<(Role, &str)> = names
        .iter()
        .map(|(role, name)| (*role, name.as_str()))
        .collect();
    let series = roles.map(|(role, k)| line(role, rates[k])).into();
    let caption = "Largest torque of walks that can be planned, by speed and yaw rate.";
    let panels = vec![Panel::lines("torque, % of its limit", series)];
    let figure = Figure::over_time("plan_walk_reach", caption, panels, &legend);
    figure.over("speed, m/s").in_columns(1, (420.0, 280.0))
}

fn border(reach: &GoalMap, role: Role, words: &[&str]) -> Series {
    let rows = reach.points.chunks_exact(reach.distances_m.len());
    let stretches = rows.zip(&reach.apexes_m).filter_map(|(row, apex)| {
        let mut chosen = row.iter().filter(|point| words.contains(&point.status));
        let first = chosen.next()?;
        let last = chosen.next_back().unwrap_or(first);
        Some([first.goal_m[0], last.goal_m[0], *apex])
    });
    let stretches: Vec<[f64; 3]> = stretches.collect();
    let left = (stretches.iter().rev()).map(|[least, _, apex]| (*least, Some(*apex)));
    let right = stretches.iter().map(|[_, most, apex]| (*most, Some(*apex)));
    let mut points: Vec<_> = right.chain(left).collect();
    points.extend(points.first().copied());
    Series { role, points }
}
