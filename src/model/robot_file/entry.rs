//! The grammar of a robot: of the TOML file, and of `robot` in a model file.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use crate::robot::{Leg, Robot};

/// A robot as files describe it, its legs in any order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotEntry {
    pub(crate) name: String,
    pub(crate) mass_kg: f64,
    pub(crate) leg: Vec<LegEntry>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LegEntry {
    /// Its three joints, from the trunk to the foot.
    pub(crate) joint: Vec<JointEntry>,
    /// From the last joint to the foot at the zero posture, m, along the body's axes.
    pub(crate) foot: [f64; 3],
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct JointEntry {
    pub(crate) name: String,
    /// From the joint before, the first from the body's origin, at the zero posture, m.
    pub(crate) at: [f64; 3],
    pub(crate) axis: Axis,
    /// -1 where recorded angles count against the axis; 1, if it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) sign: Option<f64>,
    /// Recorded angle at the zero posture, rad; 0, if it is not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) offset_rad: Option<f64>,
    /// Lowest and highest recorded angle, rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) limits_rad: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) limits_deg: Option<[f64; 2]>,
    pub(crate) torque_nm: f64,
    pub(crate) speed_rad_s: f64,
}

/// `"x"`, `"-y"` and so on, or a vector of any length.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub(crate) enum Axis {
    Name(String),
    Vector([f64; 3]),
}

const NAMED: [(&str, [f64; 3]); 6] = [
    ("x", [1.0, 0.0, 0.0]),
    ("y", [0.0, 1.0, 0.0]),
    ("z", [0.0, 0.0, 1.0]),
    ("-x", [-1.0, 0.0, 0.0]),
    ("-y", [0.0, -1.0, 0.0]),
    ("-z", [0.0, 0.0, -1.0]),
];

impl Axis {
    pub(crate) fn of(vector: [f64; 3]) -> Self {
        match NAMED.iter().find(|(_, known)| *known == vector) {
            Some((name, _)) => Axis::Name((*name).to_owned()),
            None => Axis::Vector(vector),
        }
    }

    pub(crate) fn vector(&self) -> Option<[f64; 3]> {
        match self {
            Axis::Vector(vector) => Some(*vector),
            Axis::Name(name) => {
                let known = NAMED.iter().find(|(known, _)| known == name);
                known.map(|(_, vector)| *vector)
            }
        }
    }
}

impl JointEntry {
    /// Keys and values as TOML spells them, of a joint made by [`RobotEntry::of`].
    pub(super) fn fields(&self) -> [(&'static str, String); 6] {
        let axis = match &self.axis {
            Axis::Name(name) => format!("{name:?}"),
            Axis::Vector(vector) => format!("{vector:?}"),
        };
        let limits = self.limits_rad.expect("a robot's limits are in rad");
        [
            ("name", format!("{:?}", self.name)),
            ("at", format!("{:?}", self.at)),
            ("axis", axis),
            ("limits_rad", format!("{limits:?}")),
            ("torque_nm", format!("{:?}", self.torque_nm)),
            ("speed_rad_s", format!("{:?}", self.speed_rad_s)),
        ]
    }
}

impl RobotEntry {
    /// The entry that gives this robot again, bit for bit: signs and offsets are in its axes and links.
    pub fn of(robot: &Robot) -> Self {
        let leg = Leg::ALL.map(|leg| {
            let chain = robot.geometry(leg).chain();
            let joint = (0..chain.axes.len()).map(|index| {
                let joint = chain.axes.len() * leg.index() + index;
                let (low, high) = robot.joint_limit_rad()[joint];
                JointEntry {
                    name: robot.joint_names()[joint].to_owned(),
                    at: match index {
                        0 => robot.hip_position(leg).into(),
                        _ => chain.links[index - 1],
                    },
                    axis: Axis::of(chain.axes[index]),
                    sign: None,
                    offset_rad: None,
                    limits_rad: Some([low, high]),
                    limits_deg: None,
                    torque_nm: robot.torque_limit_nm()[joint],
                    speed_rad_s: robot.joint_speed_limit_rad_s()[joint],
                }
            });
            LegEntry {
                joint: joint.collect(),
                foot: chain.links[2],
            }
        });
        Self {
            name: robot.name().to_owned(),
            mass_kg: robot.mass_kg(),
            leg: leg.to_vec(),
        }
    }
}

/// The file that gives this robot again, bit for bit.
pub fn to_toml(robot: &Robot) -> String {
    let entry = RobotEntry::of(robot);
    let mut text = format!("name = {:?}\nmass_kg = {:?}\n", entry.name, entry.mass_kg);
    for leg in &entry.leg {
        text.push_str("\n[[leg]]\njoint = [\n");
        for joint in &leg.joint {
            let fields = joint
                .fields()
                .map(|(key, value)| format!("{key} = {value}"));
            let _ = writeln!(text, "  {{ {} }},", fields.join(", "));
        }
        let _ = writeln!(text, "]\nfoot = {:?}", leg.foot);
    }
    text
}
