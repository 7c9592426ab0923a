//! A robot as TOML.

use std::fmt::Write as _;

use super::entry::{Axis, RobotEntry};
use crate::robot::Robot;

/// The file that gives this robot again, bit for bit.
pub fn to_toml(robot: &Robot) -> String {
    let entry = RobotEntry::of(robot);
    let mut text = format!("name = {:?}\nmass_kg = {:?}\n", entry.name, entry.mass_kg);
    for leg in &entry.leg {
        text.push_str("\n[[leg]]\njoint = [\n");
        for joint in &leg.joint {
            let axis = match &joint.axis {
                Axis::Name(name) => format!("{name:?}"),
                Axis::Vector(vector) => format!("{vector:?}"),
            };
            let limits = joint.limits_rad.unwrap_or_default();
            let _ = writeln!(
                text,
                "  {{ name = {:?}, at = {:?}, axis = {axis}, limits_rad = {limits:?}, torque_nm = \
                 {:?}, speed_rad_s = {:?} }},",
                joint.name, joint.at, joint.torque_nm, joint.speed_rad_s
            );
        }
        let _ = writeln!(text, "]\nfoot = {:?}", leg.foot);
    }
    text
}
