//! Grammar of a robot in the TOML file and in a model file's `robot`; its name, and whether its numbers can be true.

use std::fmt::Write as _;

use super::*;

pub(super) const LARGEST_ANGLE_RAD: f64 = 4.0 * std::f64::consts::PI; // of a joint or frame: two turns either way
const USUAL_ANGLE_RAD: f64 = 9.5; // built joints do not exceed it: one and a half turns either way, as ANYmal's
/// Range of a leg's largest torque over the robot's weight times the length of thigh and calf; built ones: 0.2 to 1.
const TORQUE_SHARE: std::ops::RangeInclusive<f64> = 0.02..=3.0;
const LARGEST_SPEED_RAD_S: f64 = 100.0;
const N_LISTED: usize = 4;

#[derive(Clone, Debug)]
pub struct RobotReading {
    pub robot: &'static Robot,
    pub notes: Vec<String>, // one sentence each: the frame of the body, numbers that can hardly be true, another name
}

/// How a robot that has the name of one of romc's own differs from it; nothing, if it does not.
pub(super) fn namesake(robot: &Robot) -> Option<String> {
    let known = super::by_name(robot.name).ok()?;
    (known != robot).then(|| differences(robot, known))
}

/// The robot of an entry; numbers other than those of romc's robot of that name add the file's kind to its name.
pub(super) fn identified(
    mut entry: RobotEntry,
    places: &Places<'_>,
    chosen: Option<&str>,
    mut notes: Vec<String>,
) -> Result<RobotReading> {
    if let Some(name) = chosen {
        entry.name = name.to_owned();
    }
    let name_place = Place::from((places.of)(Part::Name));
    let of_option = |error: RobotFileError| match chosen.is_some() && error.place == name_place {
        true => Located::new("", Place::Option("--name"), error.kind),
        false => error,
    };
    let mut robot = build(&entry, places).map_err(of_option)?;
    if let Some(differences) = namesake(&robot) {
        let own = &entry.name;
        if chosen.is_some() {
            let found = format!("{own:?}, romc's own robot with other numbers ({differences})");
            return Err(RobotFileError::option("--name", found, "another name"));
        }
        let other = format!("{own}-{}", places.kind);
        notes.push(format!(
            "its numbers are not those of romc's own {own:?} ({differences}): it is called {other:?}; --name (romc \
             robot) gives it another name"
        ));
        entry.name = other;
        robot = build(&entry, places)?;
    }
    notes.extend(doubts(&robot));
    Ok(RobotReading {
        robot: keep(robot),
        notes,
    })
}

fn differences(robot: &Robot, other: &Robot) -> String {
    let fields = |robot: &Robot| {
        let entry = RobotEntry::of(robot);
        let mut fields = vec![("mass_kg".to_owned(), format!("{:?}", entry.mass_kg))];
        for leg in &entry.leg {
            for joint in &leg.joint {
                let of_joint = joint.fields().into_iter();
                fields
                    .extend(of_joint.map(|(key, value)| (format!("{} {key}", joint.name), value)));
            }
            let last = leg.joint.last().map_or("", |joint| joint.name.as_str());
            fields.push((format!("foot from {last}"), format!("{:?}", leg.foot)));
        }
        fields
    };
    let pairs = fields(robot).into_iter().zip(fields(other));
    let found = pairs.filter(|((_, own), (_, other))| own != other);
    let mut found: Vec<String> = found
        .map(|((what, own), (_, other))| format!("{what} {own} instead of {other}"))
        .collect();
    let more = found.len().saturating_sub(N_LISTED);
    found.truncate(N_LISTED);
    match more {
        0 => found.join(", "),
        more => format!("{}, and {more} more", found.join(", ")),
    }
}

fn doubts(robot: &Robot) -> Vec<String> {
    let (torque_nm, speed_rad_s) = (robot.torque_limit_nm(), &robot.joint_speed_limit_rad_s);
    let (limits, mass_kg) = (robot.joint_limit_rad(), robot.mass_kg());
    let share = |joint: usize| {
        let [thigh, calf] = robot.geometry(Leg::ALL[joint / LEG_JOINT_DIM]).lengths_m;
        torque_nm[joint] / (mass_kg * GRAVITY_M_S2 * (thigh + calf))
    };
    let is_weak = (0..JOINT_DIM).all(|joint| share(joint) < *TORQUE_SHARE.start());
    let turned = |joint: usize| limits[joint].0.abs().max(limits[joint].1.abs());
    let note = |is_doubtful: &dyn Fn(usize) -> bool, what: &dyn Fn(usize) -> String| {
        let mut joints = (0..JOINT_DIM).filter(|joint| is_doubtful(*joint));
        let first = joints.next()?;
        let more = match joints.count() {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        Some(format!(
            "joint `{}`{more}: {}",
            robot.joint_names[first],
            what(first)
        ))
    };
    let found = [
        far_hips(robot),
        note(&|joint| share(joint) > *TORQUE_SHARE.end(), &|joint| {
            format!(
                "a largest torque of {} N m, {:.0} times the robot's weight on a stretched leg; commands stay \
                 within it: put the motors' own limit there",
                torque_nm[joint],
                share(joint)
            )
        }),
        note(&|_| is_weak, &|joint| {
            let torque_nm = torque_nm[joint];
            format!(
                "a largest torque of {torque_nm} N m cannot carry {mass_kg} kg; are masses in kg?"
            )
        }),
        note(
            &|joint| speed_rad_s[joint] > LARGEST_SPEED_RAD_S,
            &|joint| {
                let speed_rad_s = speed_rad_s[joint];
                format!("a largest speed of {speed_rad_s} rad/s; put the motors' own limit there")
            },
        ),
        note(&|joint| turned(joint) > USUAL_ANGLE_RAD, &|joint| {
            let (low, high) = limits[joint];
            format!(
                "limits of {low} to {high} rad are more than one and a half turns; are they degrees?"
            )
        }),
    ];
    found.into_iter().flatten().collect()
}

fn far_hips(robot: &Robot) -> Option<String> {
    let hips = Leg::ALL.map(|leg| robot.hip_position(leg));
    let middle = hips.iter().sum::<Vector3<f64>>() / hips.len() as f64;
    let reach = hips
        .iter()
        .map(|hip| (hip - middle).norm())
        .fold(0.0, f64::max);
    (middle.norm() > reach).then(|| {
        let [x, y, z] = middle.map(|v| (1e3 * v).round() / 1e3).into();
        format!(
            "the middle of the hips is at {x} {y} {z} m, beyond the legs: recordings have to have the position of that \
             frame's origin, not of the trunk"
        )
    })
}

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
    pub(crate) joint: Vec<JointEntry>, // from the trunk to the foot
    pub(crate) foot: [f64; 3], // from the last joint to the foot at the zero posture, m, along the body's axes
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct JointEntry {
    pub(crate) name: String,
    pub(crate) at: [f64; 3], // from the joint before, the first from the body's origin, at the zero posture, m
    pub(crate) axis: Axis,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) sign: Option<f64>, // -1 where recorded angles count against the axis; 1, if it is not given
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) offset_rad: Option<f64>, // recorded angle at the zero posture, rad; 0, if it is not given
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
            let LegGeometry { axes, links, .. } = *robot.geometry(leg);
            let joint = (0..axes.len()).map(|index| {
                let joint = axes.len() * leg.index() + index;
                let (low, high) = robot.joint_limit_rad()[joint];
                JointEntry {
                    name: robot.joint_names[joint].to_owned(),
                    at: match index {
                        0 => robot.hip_position(leg).into(),
                        _ => links[index - 1],
                    },
                    axis: Axis::of(axes[index]),
                    sign: None,
                    offset_rad: None,
                    limits_rad: Some([low, high]),
                    limits_deg: None,
                    torque_nm: robot.torque_limit_nm()[joint],
                    speed_rad_s: robot.joint_speed_limit_rad_s[joint],
                }
            });
            LegEntry {
                joint: joint.collect(),
                foot: links[2],
            }
        });
        Self {
            name: robot.name.to_owned(),
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
