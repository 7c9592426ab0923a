//! Stick figures: a robot at a state, seen from its right; strips of them over time, and animations.

use std::fmt::Write as _;

use nalgebra::{DVector, Vector3};

use super::*;
use crate::recording::Segment;
use crate::robot::rotation;
use crate::robot::{FOOT_DIM, JOINT_DIM, Leg, Robot, STATE_DIM};

const TRUNK_HALF_HEIGHT_M: f64 = 0.05;
const MARGIN_M: f64 = 0.04;

pub(crate) struct Sticks {
    /// The trunk as a closed box, then hip, knee and foot of each leg, as named in [`Sticks::NAMES`].
    pub lines: Vec<Vec<(f64, f64)>>,
}

impl Sticks {
    pub(crate) const NAMES: [&str; 1 + FOOT_DIM] = ["trunk", "fr", "fl", "rr", "rl"];

    /// `robot` at the state `x` (18), projected on the vertical plane that contains the direction `heading_rad`.
    pub(crate) fn of(robot: &Robot, x: &[f64], heading_rad: f64) -> Self {
        assert_eq!(x.len(), STATE_DIM, "a state of the robot");
        let joints: [f64; JOINT_DIM] = std::array::from_fn(|joint| x[joint]);
        let [px, py, pz, roll, pitch, yaw]: [f64; 6] = std::array::from_fn(|k| x[JOINT_DIM + k]);
        let (origin, turn) = (Vector3::new(px, py, pz), rotation([roll, pitch, yaw]));
        let (sin, cos) = heading_rad.sin_cos();
        let seen = |in_body: Vector3<f64>| {
            let point = origin + turn * in_body;
            (point.x * cos + point.y * sin, point.z)
        };
        let [front, rear] = [Leg::FrontRight, Leg::RearRight].map(|leg| robot.hip_position(leg).x);
        let corner = |(x, z): (f64, f64)| seen(Vector3::new(x, 0.0, z * TRUNK_HALF_HEIGHT_M));
        let first = (rear, -1.0);
        let corners = [first, (front, -1.0), (front, 1.0), (rear, 1.0), first];
        let trunk = corners.map(corner).into();
        let leg = |leg: Leg| {
            let (hip, q) = (robot.hip_position(leg), leg.of_joints(&joints));
            let knee = robot.geometry(leg).knee_position(&q);
            let foot = robot.geometry(leg).foot_position(&q);
            vec![seen(hip), seen(hip + knee), seen(hip + foot)]
        };
        let legs = Leg::ALL.into_iter().map(leg);
        Self {
            lines: std::iter::once(trunk).chain(legs).collect(),
        }
    }
}

/// Ranges forwards and upwards that hold sticks and floor.
fn extent_m<'a>(sticks: impl Iterator<Item = &'a Sticks>, floor_m: f64) -> [(f64, f64); 2] {
    let lines = sticks.flat_map(|sticks| &sticks.lines);
    let (forward, mut up): (Vec<f64>, Vec<f64>) = lines.flatten().copied().unzip();
    up.push(floor_m);
    [forward, up].map(|values| match range(values) {
        (low, high) if low <= high => (low - MARGIN_M, high + MARGIN_M),
        _ => (0.0, 1.0),
    })
}

pub(crate) struct Motion {
    pub role: Role,
    pub words: String,
    pub states: Vec<Option<DVector<f64>>>,
}

impl Motion {
    pub(crate) fn recorded(segment: &Segment) -> Self {
        Self {
            role: Role::Recorded,
            words: "recorded".to_owned(),
            states: (segment.x.column_iter().map(|x| Some(x.into_owned()))).collect(),
        }
    }

    pub(crate) fn planned(plan: &Segment, followed: &Segment) -> Self {
        let (starts, times) = ([plan, followed].map(|s| s.time_s.first()), &followed.time_s);
        let state = |time: f64| {
            let [Some(plan_start), Some(start)] = starts else {
                return None;
            };
            let since = time - start + plan_start;
            let after = plan.time_s.partition_point(|&planned| planned < since);
            let sample = match after {
                0 => 0,
                _ if after == plan.len() && since > plan.time_s[after - 1] + 1e-9 => return None,
                _ => after.min(plan.len() - 1),
            };
            let mut x = plan.x.column(sample).into_owned();
            for axis in [JOINT_DIM, JOINT_DIM + 1] {
                x[axis] += followed.x[(axis, 0)] - plan.x[(axis, 0)];
            }
            Some(x)
        };
        Self {
            role: Role::Restarted,
            words: "planned".to_owned(),
            states: times.iter().map(|&time| state(time)).collect(),
        }
    }

    pub(crate) fn sticks(&self, robot: &Robot, heading_rad: f64, sample: usize) -> Option<Sticks> {
        let state = self.states.get(sample)?.as_ref()?;
        Some(Sticks::of(robot, state.as_slice(), heading_rad))
    }

    pub(super) fn legend(motions: &[Self]) -> Vec<(Role, String)> {
        let entry = |motion: &Self| (motion.role, motion.words.clone());
        motions.iter().map(entry).collect()
    }
}

/// Median over samples of the lowest foot in contact, or of the lowest foot, in m.
pub(crate) fn floor_m(robot: &Robot, segment: &Segment) -> f64 {
    let lowest = |k: usize, all: bool| {
        let sticks = Sticks::of(robot, segment.x.column(k).as_slice(), 0.0);
        let feet = sticks.lines[1..].iter().zip(segment.feet[k]);
        let down = feet.filter(|(_, down)| all || *down);
        down.map(|(leg, _)| leg[2].1).min_by(f64::total_cmp)
    };
    let heights = |all: bool| (0..segment.len()).filter_map(move |k| lowest(k, all));
    let mut feet: Vec<f64> = heights(false).collect();
    if feet.is_empty() {
        feet = heights(true).collect();
    }
    feet.sort_by(f64::total_cmp);
    feet.get(feet.len() / 2).copied().unwrap_or(0.0)
}

/// Side by side to one scale, seen from the right of a robot that looks along `heading_rad`.
pub(crate) fn film_strip(
    robot: &Robot,
    (id, caption): (String, String),
    (time_s, motions): (&[f64], &[Motion]),
    (heading_rad, floor_m): (f64, f64),
    n_frames: usize,
) -> Figure {
    let last = time_s.len().saturating_sub(1);
    let of_frame = |frame: usize| frame * last / n_frames.saturating_sub(1).max(1);
    let chosen: Vec<usize> = (0..n_frames.min(time_s.len())).map(of_frame).collect();
    let sticks_at = |sample: usize| {
        let sticks = |motion: &Motion| {
            let sticks = motion.sticks(robot, heading_rad, sample);
            sticks.map(|sticks| (motion.role, sticks))
        };
        motions.iter().filter_map(sticks).collect::<Vec<_>>()
    };
    let frames: Vec<_> = chosen.iter().map(|&sample| sticks_at(sample)).collect();
    let extent_m = extent_m(frames.iter().flatten().map(|(_, sticks)| sticks), floor_m);
    let [forward, up] = extent_m;
    let start_s = time_s.first().copied().unwrap_or(0.0);
    let panels = chosen.iter().zip(frames).map(|(&sample, sticks)| Panel {
        title: format!("{:.2} s", time_s[sample] - start_s),
        drawing: Drawing::Sticks(StickPlot {
            sticks,
            extent_m,
            floor_m,
        }),
    });
    let width = 156.0;
    let slope = (up.1 - up.0) / (forward.1 - forward.0);
    Figure {
        id,
        caption,
        x_label: String::new(),
        panel_size: (width, (slope * width + 18.0).clamp(60.0, 300.0)),
        columns: 5,
        panels: panels.collect(),
        legend: Motion::legend(motions),
    }
}

const MOST_FRAMES: usize = 72;

pub(crate) struct Film {
    /// An `svg` element with a `g` for each motion, which holds a polyline for each of [`Sticks::NAMES`].
    pub svg: String,
    /// JSON `{"time": [s], "lines": [[motion][instant]]}`: points for `polyline`, or an empty text.
    pub frames: String,
    pub shown: usize,
    pub count: usize,
    pub shown_s: f64,
    pub legend: Vec<(Role, String)>,
}

fn points(line: impl IntoIterator<Item = (f64, f64)>) -> String {
    let points = line.into_iter();
    let points = points.map(|(forward, up)| format!("{:.0},{:.0}", 1e3 * forward, -1e3 * up));
    points.collect::<Vec<_>>().join(" ")
}

fn middle(sticks: &Sticks) -> (f64, f64) {
    let (one, other) = (sticks.lines[0][0], sticks.lines[0][2]);
    (0.5 * (one.0 + other.0), 0.5 * (one.1 + other.1))
}

pub(crate) fn film(
    robot: &Robot,
    (time_s, motions): (&[f64], &[Motion]),
    (heading_rad, floor_m): (f64, f64),
) -> Film {
    let stride = time_s.len().div_ceil(MOST_FRAMES).max(1);
    let chosen = (0..time_s.len()).step_by(stride);
    let of_motion = |motion: &Motion| {
        let sticks = chosen.clone().map(|k| motion.sticks(robot, heading_rad, k));
        sticks.collect()
    };
    let sticks: Vec<Vec<Option<Sticks>>> = motions.iter().map(of_motion).collect();
    let height = |sticks: &Option<Sticks>| sticks.as_ref().map_or(f64::MIN, |s| middle(s).1);
    let first = sticks.first().map_or(&[][..], Vec::as_slice);
    let heights = first.iter().map(height).enumerate();
    let highest = heights.max_by(|(_, a), (_, b)| a.total_cmp(b));
    let shown = highest.map_or(0, |(instant, _)| instant);
    let start_s = time_s.first().copied().unwrap_or(0.0);
    let times = (chosen.clone()).map(|k| (1e3 * (time_s[k] - start_s)).round() / 1e3);
    let times: Vec<f64> = times.collect();
    let joined = |sticks: &Option<Sticks>| {
        let lines = sticks.iter().flat_map(|sticks| &sticks.lines);
        let lines = lines.map(|line| points(line.iter().copied()));
        lines.collect::<Vec<_>>().join(";")
    };
    let lines = sticks
        .iter()
        .map(|motion| motion.iter().map(joined).collect());
    let lines: Vec<Vec<String>> = lines.collect();
    let [x, z] = extent_m(sticks.iter().flatten().flatten(), floor_m);
    let millimetres = |value: f64| (1e3 * value).round();
    let (left, top) = (millimetres(x.0), -millimetres(z.1));
    let (width, height) = (millimetres(x.1 - x.0), millimetres(z.1 - z.0));
    let floor = -millimetres(floor_m);
    let mut svg = format!(
        "<svg class=\"sticks\" viewBox=\"{left} {top} {width} {height}\" role=\"img\" aria-label=\"{}\">\
         <line class=\"floor\" x1=\"{left}\" y1=\"{floor}\" x2=\"{}\" y2=\"{floor}\"/>",
        HtmlText("The robot from its right, recorded and predicted"),
        left + width
    );
    for (motion, sticks) in motions.iter().zip(&sticks) {
        let class = motion.role.class();
        let path = points(sticks.iter().flatten().map(middle));
        let _ = write!(svg, "<polyline class=\"{class} path\" points=\"{path}\"/>");
    }
    for (motion, lines) in motions.iter().zip(&lines) {
        let now = lines.get(shown).map_or("", String::as_str);
        let now = now.split(';').chain(std::iter::repeat(""));
        let lines = now.map(|points| format!("<polyline points=\"{points}\"/>"));
        let lines: String = lines.take(Sticks::NAMES.len()).collect();
        let _ = write!(svg, "<g class=\"{}\">{lines}</g>", motion.role.class());
    }
    Film {
        svg: svg + "</svg>",
        frames: serde_json::json!({ "time": times, "lines": lines }).to_string(),
        shown,
        count: chosen.len(),
        shown_s: times.get(shown).copied().unwrap_or(0.0),
        legend: Motion::legend(motions),
    }
}
