//! Which robot a file describes, and whether its numbers can be true.

use super::entry::{JointEntry, RobotEntry};
use super::error::{RobotFileError, RobotFileFault};
use super::legs::{Places, build};
use super::registry::keep;
use crate::files::{Located, Place};
use crate::robot::{GRAVITY_M_S2, Leg, Robot};

/// Largest angle of a joint, rad: two turns either way.
const LARGEST_ANGLE_RAD: f64 = 4.0 * std::f64::consts::PI;
/// Angle beyond which a joint turns more than once either way, rad.
const FULL_TURN_RAD: f64 = 2.0 * std::f64::consts::PI;
/// Range of a leg's largest torque as a part of the robot's weight times the length of thigh and calf; robots that are
/// built have 0.2 to 1.
const TORQUE_SHARE: std::ops::RangeInclusive<f64> = 0.02..=3.0;
/// Largest speed of a joint, rad/s.
const LARGEST_SPEED_RAD_S: f64 = 100.0;
/// How many differences a message lists.
const N_LISTED: usize = 4;

/// A robot of a file, and what a user should know of it.
#[derive(Clone, Debug)]
pub struct RobotReading {
    /// The robot.
    pub robot: &'static Robot,
    /// One sentence each: the frame of the body, numbers that can hardly be true, another name.
    pub notes: Vec<String>,
}

/// How a robot that has the name of one of romc's own differs from it; nothing, if it does not.
pub(super) fn namesake(robot: &Robot) -> Option<String> {
    let known = Robot::by_name(robot.name()).ok()?;
    (known != robot).then(|| differences(robot, known))
}

/// The robot of an entry from a file. Numbers other than those of romc's robot of that name make it another robot,
/// with the kind of the file in its name.
///
/// # Errors
/// [`RobotFileError`] with the part that is wrong, or for a name that a user `chose` and romc's own robot has.
pub(super) fn identified(
    file: &str,
    mut entry: RobotEntry,
    places: &Places,
    chosen: Option<&str>,
    mut notes: Vec<String>,
) -> Result<RobotReading, RobotFileError> {
    if let Some(name) = chosen {
        entry.name = name.to_owned();
    }
    let mut robot = build(file, &entry, places)?;
    if let Some(differences) = namesake(&robot) {
        if chosen.is_some() {
            let found = format!(
                "{:?}, romc's own robot with other numbers ({differences})",
                entry.name
            );
            let expected = "another name".to_owned();
            let fault = RobotFileFault::Unexpected { found, expected };
            return Err(Located::new("", Place::Option("--name"), fault));
        }
        let kind = match places {
            Places::Keys => "toml",
            Places::Elements { .. } => "urdf",
        };
        let (own, other) = (&entry.name, format!("{}-{kind}", entry.name));
        notes.push(format!(
            "its numbers are not those of romc's own {own:?} ({differences}): it is called {other:?}; --name (romc \
             robot) gives it another name"
        ));
        entry.name = other;
        robot = build(file, &entry, places)?;
    }
    refuse_degrees(file, &entry, places)?;
    notes.extend(doubts(&robot));
    Ok(RobotReading {
        robot: keep(robot),
        notes,
    })
}

/// Differences of a robot from another, the first few of them.
fn differences(robot: &Robot, other: &Robot) -> String {
    let [own, other] = [robot, other].map(RobotEntry::of);
    let mut found = Vec::new();
    let mut compare = |what: String, own: String, other: String| {
        if own != other {
            found.push(format!("{what} {own} instead of {other}"));
        }
    };
    let number = |value: f64| value.to_string();
    compare(
        "mass_kg".to_owned(),
        number(own.mass_kg),
        number(other.mass_kg),
    );
    for (leg, other) in own.leg.iter().zip(&other.leg) {
        for (joint, other) in leg.joint.iter().zip(&other.joint) {
            for ((key, own), (_, other)) in facts(joint).into_iter().zip(facts(other)) {
                compare(format!("{} {key}", joint.name), own, other);
            }
        }
        let last = leg.joint.last().map_or("", |joint| joint.name.as_str());
        let place = format!("foot from {last}");
        compare(
            place,
            format!("{:?}", leg.foot),
            format!("{:?}", other.foot),
        );
    }
    let more = found.len().saturating_sub(N_LISTED);
    found.truncate(N_LISTED);
    let more = match more {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    found.join(", ") + &more
}

fn facts(joint: &JointEntry) -> [(&'static str, String); 6] {
    let axis = joint.axis.vector().unwrap_or_default();
    [
        ("name", joint.name.clone()),
        ("at", format!("{:?}", joint.at)),
        ("axis", format!("{axis:?}")),
        (
            "limits_rad",
            format!("{:?}", joint.limits_rad.unwrap_or_default()),
        ),
        ("torque_nm", joint.torque_nm.to_string()),
        ("speed_rad_s", joint.speed_rad_s.to_string()),
    ]
}

/// Refuses limits of more than two turns, which are degrees, or bounds of a joint that has none.
fn refuse_degrees(file: &str, entry: &RobotEntry, places: &Places) -> Result<(), RobotFileError> {
    for (leg, limbs) in entry.leg.iter().enumerate() {
        for (index, joint) in limbs.joint.iter().enumerate() {
            let Some([low, high]) = joint.limits_rad else {
                continue;
            };
            if low.abs().max(high.abs()) > LARGEST_ANGLE_RAD {
                let (degrees, key) = (format!("{low} to {high} rad"), "limits_rad");
                let expected = match places {
                    Places::Keys => "at most two turns either way; limits_deg takes degrees",
                    Places::Elements { .. } => {
                        "at most two turns either way: rad, not degrees; type=\"continuous\" for a joint without bounds"
                    }
                };
                let place = places.of_joint(leg, index, key);
                return Err(RobotFileError::at(file, place, degrees, expected));
            }
        }
    }
    Ok(())
}

/// Numbers that can hardly be true, one sentence each kind.
fn doubts(robot: &Robot) -> Vec<String> {
    let mut notes = Vec::new();
    let mut note = |joints: &[usize], what: String| {
        if let [first, rest @ ..] = joints {
            let more = match rest.len() {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            notes.push(format!(
                "joint `{}`{more}: {what}",
                robot.joint_names()[*first]
            ));
        }
    };
    let joints =
        |is: &dyn Fn(usize) -> bool| (0..12).filter(|joint| is(*joint)).collect::<Vec<_>>();
    let weight_n = robot.mass_kg() * GRAVITY_M_S2;
    let share = |joint: usize| {
        let lengths = robot.geometry(Leg::ALL[joint / 3]).lengths();
        robot.torque_limit_nm()[joint] / (weight_n * (lengths[0] + lengths[1]))
    };
    let strong = joints(&|joint| share(joint) > *TORQUE_SHARE.end());
    if let Some(first) = strong.first() {
        let (torque, share) = (robot.torque_limit_nm()[*first], share(*first));
        note(
            &strong,
            format!(
                "a largest torque of {torque} N m, {share:.0} times the robot's weight on a stretched leg; commands stay within \
             it: put the motors' own limit there"
            ),
        );
    }
    let weak = joints(&|joint| share(joint) < *TORQUE_SHARE.start());
    if weak.len() == 12 {
        let (torque, mass) = (robot.torque_limit_nm()[0], robot.mass_kg());
        note(
            &weak,
            format!("a largest torque of {torque} N m cannot carry {mass} kg; are masses in kg?"),
        );
    }
    let fast = joints(&|joint| robot.joint_speed_limit_rad_s()[joint] > LARGEST_SPEED_RAD_S);
    if let Some(first) = fast.first() {
        let speed = robot.joint_speed_limit_rad_s()[*first];
        note(
            &fast,
            format!("a largest speed of {speed} rad/s; put the motors' own limit there"),
        );
    }
    let wide = joints(&|joint| {
        let (low, high) = robot.joint_limit_rad()[joint];
        low.abs().max(high.abs()) > FULL_TURN_RAD
    });
    if let Some(first) = wide.first() {
        let (low, high) = robot.joint_limit_rad()[*first];
        note(
            &wide,
            format!("limits of {low} to {high} rad are more than a turn; are they degrees?"),
        );
    }
    notes
}
