//! Stick figures: a robot at a state, seen from its right, and strips of them over time.

use nalgebra::{DVector, Vector3};

use super::draw::range;
use super::figure::{Drawing, Figure, Panel, Role, StickPlot};
use crate::recording::Segment;
use crate::robot::input_rule::rotation;
use crate::robot::{FOOT_DIM, JOINT_DIM, Leg, Robot, STATE_DIM};

/// Half the height of the box that stands for a trunk, in m.
const TRUNK_HALF_HEIGHT_M: f64 = 0.05;

const MARGIN_M: f64 = 0.04;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sticks {
    /// The trunk as a closed box, then hip, knee and foot of each leg, as named in [`Sticks::NAMES`].
    pub lines: Vec<Vec<(f64, f64)>>,
}

impl Sticks {
    pub(crate) const NAMES: [&str; 1 + FOOT_DIM] = ["trunk", "fr", "fl", "rr", "rl"];

    /// `robot` at the state `x` (18: joint angles in rad, body position in m, roll, pitch and yaw in rad), projected on
    /// the vertical plane that contains the direction `heading_rad`.
    ///
    /// # Panics
    /// If `x` does not have 18 entries.
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
            let foot = robot.foot_position(leg, &q);
            vec![seen(hip), seen(hip + knee), seen(hip + foot)]
        };
        let legs = Leg::ALL.into_iter().map(leg);
        Self {
            lines: std::iter::once(trunk).chain(legs).collect(),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent {
    pub forward_m: (f64, f64),
    pub up_m: (f64, f64),
}

impl Extent {
    /// The smallest part with a margin that shows all `sticks` and the floor.
    pub(crate) fn around<'a>(sticks: impl IntoIterator<Item = &'a Sticks>, floor_m: f64) -> Self {
        let lines = sticks.into_iter().flat_map(|sticks| &sticks.lines);
        let (forward, mut up): (Vec<f64>, Vec<f64>) = lines.flatten().copied().unzip();
        up.push(floor_m);
        let margin = |(low, high): (f64, f64)| match low <= high {
            true => (low - MARGIN_M, high + MARGIN_M),
            false => (0.0, 1.0),
        };
        Self {
            forward_m: margin(range(forward)),
            up_m: margin(range(up)),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Motion {
    pub role: Role,
    pub words: String,
    /// The state (18, as [`Sticks::of`] takes it) at each time; none where there is no prediction.
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

    /// A plan at the times of the jump that follows it, from where that jump begins; none after the plan's end.
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

/// Height of the floor, in m: the median over samples of the lowest foot in contact; of the lowest foot where no sample
/// has one.
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

/// Motions at `n_frames` instants, evenly chosen from the first to the last of `time_s`, side by side to one scale, seen
/// from the right of a robot that looks along `heading_rad`.
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
    let extent = Extent::around(frames.iter().flatten().map(|(_, sticks)| sticks), floor_m);
    let start_s = time_s.first().copied().unwrap_or(0.0);
    let panels = chosen.iter().zip(frames).map(|(&sample, sticks)| Panel {
        title: format!("{:.2} s", time_s[sample] - start_s),
        drawing: Drawing::Sticks(StickPlot {
            sticks,
            extent,
            floor_m,
        }),
    });
    let width = 156.0;
    let slope = (extent.up_m.1 - extent.up_m.0) / (extent.forward_m.1 - extent.forward_m.0);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn standing(x_m: f64, yaw_rad: f64) -> DVector<f64> {
        let mut x = DVector::zeros(STATE_DIM);
        for leg in 0..FOOT_DIM {
            (x[3 * leg + 1], x[3 * leg + 2]) = (0.75, -1.5);
        }
        (x[12], x[14], x[17]) = (x_m, 0.3, yaw_rad);
        x
    }

    fn go1() -> &'static Robot {
        crate::robot_file::by_name("go1").unwrap()
    }

    #[test]
    fn links_have_their_lengths_and_feet_their_place() {
        let robot = go1();
        let sticks = Sticks::of(robot, standing(0.2, 0.0).as_slice(), 0.0);
        assert_eq!(sticks.lines.len(), Sticks::NAMES.len());
        let length = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).hypot(a.1 - b.1);
        for (leg, line) in Leg::ALL.into_iter().zip(&sticks.lines[1..]) {
            let [thigh_m, calf_m] = robot.geometry(leg).lengths();
            assert!((length(line[0], line[1]) - thigh_m).abs() < 1e-12);
            assert!((length(line[1], line[2]) - calf_m).abs() < 1e-12);
            let hip = robot.hip_position(leg);
            assert!((line[0].0 - 0.2 - hip.x).abs() < 1e-12);
            let drop = (thigh_m + calf_m) * 0.75f64.cos();
            assert!((line[2].1 - (0.3 - drop)).abs() < 1e-12);
            // a thigh that swings back puts the knee behind the hip
            assert!(line[1].0 < line[0].0);
        }
    }

    #[test]
    fn a_robot_seen_along_its_heading_looks_the_same_whatever_that_is() {
        let straight = Sticks::of(go1(), standing(0.0, 0.0).as_slice(), 0.0);
        let turned = Sticks::of(go1(), standing(0.0, 1.1).as_slice(), 1.1);
        let points = straight.lines.iter().flatten();
        for (a, b) in points.zip(turned.lines.iter().flatten()) {
            assert!((a.0 - b.0).abs() < 1e-12 && (a.1 - b.1).abs() < 1e-12);
        }
    }

    #[test]
    fn plan_starts_where_the_jump_does_and_ends_by_itself() {
        let segment = |n: usize, step_s: f64, from_m: f64| {
            let times = (0..n).map(|k| 5.0 * from_m + step_s * k as f64);
            let mut segment = Segment::still("plan.csv", times.collect());
            for k in 0..n {
                segment.x[(JOINT_DIM, k)] = from_m + step_s * k as f64;
            }
            segment
        };
        let (plan, jump) = (segment(101, 0.01, 3.0), segment(601, 0.002, 1.0));
        let planned = Motion::planned(&plan, &jump);
        assert_eq!(planned.states.len(), jump.len());
        let forward = |k: usize| planned.states[k].as_ref().map(|x| x[JOINT_DIM]);
        assert!((forward(0).unwrap() - 1.0).abs() < 1e-12);
        assert!((forward(250).unwrap() - 1.5).abs() < 1e-9);
        assert!((forward(500).unwrap() - 2.0).abs() < 1e-9);
        assert_eq!(forward(501), None);
    }
}
