//! Stick figures in motion: one drawing for a page, and the lines of each instant for the page's script.

use std::fmt::Write as _;

use super::figure::Role;
use super::sticks::{Extent, Motion, Sticks};
use crate::robot::Robot;
use crate::typeset::mathml::HtmlText;

const MOST_FRAMES: usize = 72;

/// An animation: the drawing at its first instant in sight, and the lines of every instant.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Film {
    /// An `svg` element with a `g` for each motion, which holds a polyline for each of [`Sticks::NAMES`].
    pub svg: String,
    /// JSON: `{"time": [s], "lines": [[motion][instant]]}` with the points of all lines of a motion at an instant, joined
    /// by semicolons as `polyline` takes them; empty where there is no prediction.
    pub frames: String,
    /// The instant that the drawing shows: the highest point of the first motion.
    pub shown: usize,
    pub count: usize,
    /// Time of the instant that is shown, from the first sample, in s.
    pub shown_s: f64,
    pub legend: Vec<(Role, String)>,
}

/// A line in mm, y downwards.
fn points(line: impl IntoIterator<Item = (f64, f64)>) -> String {
    let points = line.into_iter();
    let points = points.map(|(forward, up)| format!("{:.0},{:.0}", 1e3 * forward, -1e3 * up));
    points.collect::<Vec<_>>().join(" ")
}

/// All lines of a robot; none where there is no robot.
fn lines(sticks: &Option<Sticks>) -> Vec<String> {
    let lines = sticks.iter().flat_map(|sticks| &sticks.lines);
    lines.map(|line| points(line.iter().copied())).collect()
}

/// Middle of the trunk: forward and up, in m.
fn middle(sticks: &Sticks) -> (f64, f64) {
    let (one, other) = (sticks.lines[0][0], sticks.lines[0][2]);
    (0.5 * (one.0 + other.0), 0.5 * (one.1 + other.1))
}

/// The animation of `motions` over `time_s`, seen from the right of a robot that looks along `heading_rad`.
pub(crate) fn film(
    robot: &Robot,
    (time_s, motions): (&[f64], &[Motion]),
    (heading_rad, floor_m): (f64, f64),
) -> Film {
    let stride = time_s.len().div_ceil(MOST_FRAMES).max(1);
    let chosen: Vec<usize> = (0..time_s.len()).step_by(stride).collect();
    let of_motion = |motion: &Motion| {
        let samples = chosen.iter();
        let sticks = samples.map(|&sample| motion.sticks(robot, heading_rad, sample));
        sticks.collect()
    };
    let sticks: Vec<Vec<Option<Sticks>>> = motions.iter().map(of_motion).collect();
    let height = |sticks: &Option<Sticks>| sticks.as_ref().map_or(f64::MIN, |s| middle(s).1);
    let first = sticks.first().map_or(&[][..], Vec::as_slice);
    let shown = (0..first.len())
        .max_by(|&a, &b| height(&first[a]).total_cmp(&height(&first[b])))
        .unwrap_or(0);
    let extent = Extent::around(sticks.iter().flatten().flatten(), floor_m);
    let start_s = time_s.first().copied().unwrap_or(0.0);
    let times: Vec<f64> = (chosen.iter())
        .map(|&sample| (1e3 * (time_s[sample] - start_s)).round() / 1e3)
        .collect();
    let joined = |sticks| lines(sticks).join(";");
    let lines: Vec<Vec<String>> = (sticks.iter())
        .map(|motion| motion.iter().map(joined).collect())
        .collect();
    let roles: Vec<Role> = motions.iter().map(|motion| motion.role).collect();
    Film {
        svg: svg(&roles, &sticks, shown, extent, floor_m),
        frames: serde_json::json!({ "time": times, "lines": lines }).to_string(),
        shown,
        count: chosen.len(),
        shown_s: times.get(shown).copied().unwrap_or(0.0),
        legend: Motion::legend(motions),
    }
}

fn svg(
    roles: &[Role],
    sticks: &[Vec<Option<Sticks>>],
    shown: usize,
    extent: Extent,
    floor_m: f64,
) -> String {
    let (x, z) = (extent.forward_m, extent.up_m);
    let millimetres = |value: f64| (1e3 * value).round();
    let (left, top) = (millimetres(x.0), -millimetres(z.1));
    let (width, height) = (millimetres(x.1 - x.0), millimetres(z.1 - z.0));
    let floor = -millimetres(floor_m);
    let mut text = format!(
        "<svg class=\"sticks\" viewBox=\"{left} {top} {width} {height}\" role=\"img\" aria-label=\"{}\">\
         <line class=\"floor\" x1=\"{left}\" y1=\"{floor}\" x2=\"{}\" y2=\"{floor}\"/>",
        HtmlText("The robot from its right, recorded and predicted"),
        left + width
    );
    for (role, motion) in roles.iter().zip(sticks) {
        let (class, path) = (role.class(), points(motion.iter().flatten().map(middle)));
        let _ = write!(text, "<polyline class=\"{class} path\" points=\"{path}\"/>");
    }
    for (role, motion) in roles.iter().zip(sticks) {
        let _ = write!(text, "<g class=\"{}\">", role.class());
        let now = motion.get(shown).map(lines).unwrap_or_default();
        for line in 0..Sticks::NAMES.len() {
            let points = now.get(line).map_or("", String::as_str);
            let _ = write!(text, "<polyline points=\"{points}\"/>");
        }
        text.push_str("</g>");
    }
    text + "</svg>"
}
