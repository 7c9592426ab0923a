//! The robot's own joints in generated files: a table for the headers, names for arrays and parameters.

use super::*;
use crate::robot::{JOINT_NAMES, LEG_JOINT_DIM};

/// Joints as generated files list them.
pub(in crate::deploy) struct JointTexts {
    /// Lines of a table in a comment, its head first.
    pub(in crate::deploy) table: Vec<String>,
    /// Where the feet are with all angles zero.
    pub(in crate::deploy) zero: String,
    /// Quoted names of each leg's joints, as C, Python and YAML have them.
    pub(in crate::deploy) names: Vec<String>,
    /// A name for the foot of each leg, which models do not have: `FR_foot` of `FR_hip_joint`.
    pub(in crate::deploy) feet: Vec<String>,
}

impl JointTexts {
    pub(super) fn new(robot: &Robot) -> Self {
        let chars = |name: &&str| name.chars().count();
        let width = robot.joint_names.iter().map(chars).max().unwrap_or(0);
        let row = |i: usize| {
            let (least, most) = robot.joint_limit_rad()[i];
            let numbers = [
                least,
                most,
                robot.torque_limit_nm()[i],
                robot.joint_speed_limit_rad_s[i],
            ];
            let numbers = numbers.map(|number| format!("{:>9}", short(number)));
            let axis = axis(robot.legs[i / LEG_JOINT_DIM].axes[i % LEG_JOINT_DIM]);
            let (own, name) = (JOINT_NAMES[i], robot.joint_names[i]);
            format!("{i:>2}  {own}  {name:<width$}{}  {axis}", numbers.concat())
        };
        let head = format!(
            " i  x      {:<width$}{:>9}{:>9}{:>9}{:>9}  axis",
            "robot", "from rad", "to rad", "N m", "rad/s"
        );
        let foot = |leg: Leg| {
            let at = robot.geometry(leg).foot_position(&[0.0; 3]);
            let [x, y, z] = [at.x, at.y, at.z].map(short);
            format!("{} ({x} {y} {z})", leg.short_name())
        };
        let quoted = |name: &&str| format!("\"{}\"", name.replace('"', "\\\""));
        let of_leg = |leg: &[&str]| leg.iter().map(quoted).collect::<Vec<_>>().join(", ");
        Self {
            table: [head].into_iter().chain((0..JOINT_DIM).map(row)).collect(),
            zero: Leg::ALL.map(foot).join(", "),
            names: (robot.joint_names.chunks(LEG_JOINT_DIM).map(of_leg)).collect(),
            feet: Leg::ALL.map(|leg| foot_name(robot, leg)).into(),
        }
    }
}

fn short(number: f64) -> f64 {
    (number * 1e4).round() / 1e4 + 0.0 // no -0.0
}

fn axis(of_joint: [f64; 3]) -> String {
    let along = |i: usize| of_joint[i].abs() == 1.0;
    match (0..3).find(|&i| along(i)) {
        Some(i) => format!(
            "{}{}",
            if of_joint[i] < 0.0 { "-" } else { "" },
            ["x", "y", "z"][i]
        ),
        None => format!(
            "({})",
            of_joint.map(|share| short(share).to_string()).join(" ")
        ),
    }
}

/// The common beginning, up to a `_`, of the names of the leg's joints and of no others, otherwise the leg's name; with
/// `foot`.
fn foot_name(robot: &Robot, leg: Leg) -> String {
    let names = &robot.joint_names;
    let first = names[LEG_JOINT_DIM * leg.index()];
    let is_of_leg = |beginning: &&str| {
        let is_own = |i: usize| i / LEG_JOINT_DIM == leg.index();
        (0..JOINT_DIM).all(|i| names[i].starts_with(beginning) == is_own(i))
    };
    let mut beginnings = first.rmatch_indices('_').map(|(end, _)| &first[..end]);
    let beginning = beginnings.find(is_of_leg).unwrap_or(leg.short_name());
    format!("{}_foot", beginning.replace('"', "\\\""))
}
