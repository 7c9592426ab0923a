//! Which robot a file describes, and whether its numbers can be true.

use nalgebra::Vector3;

use super::entry::RobotEntry;
use super::legs::{Part, Places, build};
use super::read::RobotFileError;
use super::registry::keep;
use crate::files::{Located, Place};
use crate::robot::joints::LEG_JOINT_DIM;
use crate::robot::{GRAVITY_M_S2, JOINT_DIM, Leg, Robot};

/// Largest angle of a joint or frame, rad: two turns either way.
pub(super) const LARGEST_ANGLE_RAD: f64 = 4.0 * std::f64::consts::PI;
/// Angle that joints which are built do not exceed, rad: one and a half turns either way, as ANYmal's.
const USUAL_ANGLE_RAD: f64 = 9.5;
/// Range of a leg's largest torque as a part of the robot's weight times the length of thigh and calf; robots that are
/// built have 0.2 to 1.
const TORQUE_SHARE: std::ops::RangeInclusive<f64> = 0.02..=3.0;
const LARGEST_SPEED_RAD_S: f64 = 100.0;
const N_LISTED: usize = 4;

/// A robot of a file, and notes for the user.
#[derive(Clone, Debug)]
pub struct RobotReading {
    pub robot: &'static Robot,
    /// One sentence each: the frame of the body, numbers that can hardly be true, another name.
    pub notes: Vec<String>,
}

/// How a robot that has the name of one of romc's own differs from it; nothing, if it does not.
pub(super) fn namesake(robot: &Robot) -> Option<String> {
    let known = super::by_name(robot.name()).ok()?;
    (known != robot).then(|| differences(robot, known))
}

/// The robot of an entry from a file. Numbers other than those of romc's robot of that name make it another robot, with
/// the kind of the file in its name.
pub(super) fn identified(
    mut entry: RobotEntry,
    places: &Places<'_>,
    chosen: Option<&str>,
    mut notes: Vec<String>,
) -> Result<RobotReading, RobotFileError> {
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
    let (torque_nm, speed_rad_s) = (robot.torque_limit_nm(), robot.joint_speed_limit_rad_s());
    let (limits, mass_kg) = (robot.joint_limit_rad(), robot.mass_kg());
    let share = |joint: usize| {
        let [thigh, calf] = robot.geometry(Leg::ALL[joint / LEG_JOINT_DIM]).lengths();
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
            robot.joint_names()[first],
            what(first)
        ))
    };
    let hips = Leg::ALL.map(|leg| robot.hip_position(leg));
    let middle = hips.iter().sum::<Vector3<f64>>() / hips.len() as f64;
    let reach = hips
        .iter()
        .map(|hip| (hip - middle).norm())
        .fold(0.0, f64::max);
    let far = (middle.norm() > reach).then(|| {
        let [x, y, z] = middle.map(|v| (1e3 * v).round() / 1e3).into();
        format!(
            "the middle of the hips is at {x} {y} {z} m, beyond the legs: recordings have to have the position of that \
             frame's origin, not of the trunk"
        )
    });
    let found = [
        far,
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
