//! From an entry to a checked robot.

use nalgebra::{Rotation3, Unit, Vector3};

use super::entry::{JointEntry, LegEntry, RobotEntry};
use super::identity::namesake;
use super::read::RobotFileError;
use super::registry::{keep, word};
use crate::files::is_invisible;
use crate::robot::joints::LEG_JOINT_DIM;
use crate::robot::{ChainLeg, FOOT_DIM, JOINT_DIM, Leg, LegGeometry, Robot};

const MAX_NAME_LEN: usize = 80;
/// Largest length of a link, m.
const MAX_LINK_M: f64 = 10.0;
/// Smallest length of thigh and calf, m.
const MIN_LINK_M: f64 = 1e-3;
/// Largest sine of the angle between the axes of a leg's last two joints.
const MAX_TILT: f64 = 1e-3;
/// Smallest sine of the angle between the first axis and the second.
const MIN_ABDUCTION: f64 = 0.1;

pub(super) enum Places {
    /// By the keys of TOML and JSON.
    Keys,
    /// By the elements of a URDF, legs in the entry's order.
    Elements { robot: String, legs: Vec<LegPlaces> },
}

/// Elements of a leg, such as ``line 24: joint `knee` ``.
pub(super) struct LegPlaces {
    pub joints: Vec<String>,
    pub foot: String,
}

/// Keys of a joint as a URDF spells them.
const SPELLINGS: [(&str, &str); 5] = [
    ("at", "<origin>, xyz"),
    ("axis", "<axis>, xyz"),
    ("limits_rad", "<limit>, lower and upper"),
    ("torque_nm", "<limit>, effort"),
    ("speed_rad_s", "<limit>, velocity"),
];

impl Places {
    pub(super) fn of_robot(&self, key: &str) -> String {
        match self {
            Places::Keys => key.to_owned(),
            Places::Elements { robot, .. } if key == "name" => format!("{robot}, name"),
            Places::Elements { .. } => match key {
                "mass_kg" => "the masses of the links".to_owned(),
                _ => "the tree".to_owned(),
            },
        }
    }

    fn of_leg(&self, leg: usize) -> String {
        match self {
            Places::Keys => format!("leg[{leg}]"),
            Places::Elements { legs, .. } => format!("{}, its leg", legs[leg].joints[0]),
        }
    }

    fn of_foot(&self, leg: usize) -> String {
        match self {
            Places::Keys => format!("leg[{leg}].foot"),
            Places::Elements { legs, .. } => legs[leg].foot.clone(),
        }
    }

    /// A key of a joint; the joint itself, if it is empty.
    pub(super) fn of_joint(&self, leg: usize, joint: usize, key: &str) -> String {
        match self {
            Places::Keys if key.is_empty() => format!("leg[{leg}].joint[{joint}]"),
            Places::Keys => format!("leg[{leg}].joint[{joint}].{key}"),
            Places::Elements { legs, .. } => {
                let known = SPELLINGS.iter().find(|(name, _)| *name == key);
                let spelling = known.map_or(key, |(_, spelling)| spelling);
                let comma = if spelling.is_empty() { "" } else { ", " };
                format!("{}{comma}{spelling}", legs[leg].joints[joint])
            }
        }
    }
}

struct Reader<'f> {
    file: &'f str,
    places: &'f Places,
}

impl RobotEntry {
    /// The robot of the entry, which is `entry` of `file` in errors; equal robots are one.
    ///
    /// # Errors
    /// [`RobotFileError`] with the entry that is wrong, or a name that is another robot's.
    pub fn robot(&self, file: &str) -> Result<&'static Robot, RobotFileError> {
        let robot = build(file, self, &Places::Keys)?;
        match namesake(&robot) {
            None => Ok(keep(robot)),
            Some(differences) => {
                let found = format!(
                    "{:?} with other numbers than romc's own robot ({differences})",
                    self.name
                );
                Err(RobotFileError::at(file, "name", found, "another name"))
            }
        }
    }
}

pub(super) fn build(
    file: &str,
    entry: &RobotEntry,
    places: &Places,
) -> Result<Robot, RobotFileError> {
    let reader = Reader { file, places };
    reader.name(&places.of_robot("name"), &entry.name)?;
    reader.positive(&places.of_robot("mass_kg"), entry.mass_kg)?;
    let found = format!("{} legs", entry.leg.len());
    let expected = "four: models, inputs and controllers are those of quadrupeds";
    reader.check(entry.leg.len() == FOOT_DIM, "leg", found, expected)?;
    let corners = reader.corners(&entry.leg)?;
    let mut robot = Robot {
        name: word(&entry.name),
        mass_kg: entry.mass_kg,
        legs: [LegGeometry::Chain(ChainLeg {
            axes: [[0.0; 3]; 3],
            links: [[0.0; 3]; 3],
        }); FOOT_DIM],
        hip_position_m: [[0.0; 3]; FOOT_DIM],
        joint_names: [""; JOINT_DIM],
        torque_limit_nm: [0.0; JOINT_DIM],
        joint_limit_rad: [(0.0, 0.0); JOINT_DIM],
        joint_speed_limit_rad_s: [0.0; JOINT_DIM],
    };
    let mut names: Vec<&str> = Vec::with_capacity(JOINT_DIM);
    for (index, (leg, entry)) in corners.iter().zip(&entry.leg).enumerate() {
        let k = leg.index();
        robot.legs[k] = LegGeometry::of_chain(reader.chain(index, entry)?);
        robot.hip_position_m[k] = entry.joint[0].at;
        for (offset, joint) in entry.joint.iter().enumerate() {
            let place = |key: &str| places.of_joint(index, offset, key);
            let at = LEG_JOINT_DIM * k + offset;
            reader.name(&place("name"), &joint.name)?;
            let is_new = !names.contains(&joint.name.as_str());
            let found = format!("{:?} a second time", joint.name);
            reader.check(is_new, &place("name"), found, "each name once")?;
            names.push(&joint.name);
            robot.joint_names[at] = word(&joint.name);
            robot.joint_limit_rad[at] = reader.limits(place, joint)?;
            robot.torque_limit_nm[at] = reader.positive(&place("torque_nm"), joint.torque_nm)?;
            robot.joint_speed_limit_rad_s[at] =
                reader.positive(&place("speed_rad_s"), joint.speed_rad_s)?;
        }
    }
    Ok(robot)
}

impl Reader<'_> {
    fn check(
        &self,
        is_fine: bool,
        place: &str,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> Result<(), RobotFileError> {
        match is_fine {
            true => Ok(()),
            false => Err(RobotFileError::at(self.file, place, found, expected)),
        }
    }

    fn name(&self, place: &str, name: &str) -> Result<(), RobotFileError> {
        // Comments and pages of generated files list names.
        let is_fine = !name.trim().is_empty()
            && name.len() <= MAX_NAME_LEN
            && !name.chars().any(|c| is_invisible(c) || "\\`".contains(c))
            && !["*/", "/*", "??"].iter().any(|sign| name.contains(sign));
        let expected = format!(
            "a name of at most {MAX_NAME_LEN} bytes that are seen, without \\, `, /*, */ and ??"
        );
        self.check(is_fine, place, format!("{name:?}"), expected)
    }

    fn positive(&self, place: &str, value: f64) -> Result<f64, RobotFileError> {
        let is_fine = value.is_finite() && value > 0.0;
        self.check(is_fine, place, value.to_string(), "a finite number above 0")?;
        Ok(value)
    }

    fn vector(&self, place: &str, vector: [f64; 3]) -> Result<(), RobotFileError> {
        let is_fine = vector.iter().all(|v| v.abs() <= MAX_LINK_M);
        let expected = format!("three lengths of at most {MAX_LINK_M} m");
        self.check(is_fine, place, format!("{vector:?}"), expected)
    }

    fn limits(
        &self,
        place: impl Fn(&str) -> String,
        joint: &JointEntry,
    ) -> Result<(f64, f64), RobotFileError> {
        let (key, [low, high]) = match (joint.limits_rad, joint.limits_deg) {
            (Some(limits), None) => ("limits_rad", limits),
            (None, Some(limits)) => ("limits_deg", limits.map(f64::to_radians)),
            (found, _) => {
                let found = if found.is_some() { "both" } else { "neither" };
                let expected = "one of limits_rad and limits_deg";
                return Err(RobotFileError::at(self.file, place(""), found, expected));
            }
        };
        let is_fine = low.is_finite() && high.is_finite() && low < high;
        let (place, found) = (place(key), format!("{low} to {high}"));
        self.check(is_fine, &place, found, "the lower limit first")?;
        Ok((low, high))
    }

    /// Which leg each entry is, by where its first joint stands.
    fn corners(&self, legs: &[LegEntry]) -> Result<[Leg; FOOT_DIM], RobotFileError> {
        for (index, leg) in legs.iter().enumerate() {
            let (place, count) = (
                format!("{}.joint", self.places.of_leg(index)),
                leg.joint.len(),
            );
            let found = format!("{count} joints");
            let expected = "three, from the trunk to the foot";
            self.check(count == LEG_JOINT_DIM, &place, found, expected)?;
        }
        let hips: Vec<[f64; 3]> = legs.iter().map(|leg| leg.joint[0].at).collect();
        let middle =
            |axis: usize| hips.iter().map(|hip| hip[axis]).sum::<f64>() / hips.len() as f64;
        let (x, y) = (middle(0), middle(1));
        let leg_at = |hip: &[f64; 3]| match (hip[0] > x, hip[1] > y) {
            (true, false) => Leg::FrontRight,
            (true, true) => Leg::FrontLeft,
            (false, false) => Leg::RearRight,
            (false, true) => Leg::RearLeft,
        };
        let found: Vec<Leg> = hips.iter().map(leg_at).collect();
        let is_one_each = Leg::ALL.iter().all(|leg| found.contains(leg));
        match <[Leg; FOOT_DIM]>::try_from(found) {
            Ok(found) if is_one_each => Ok(found),
            _ => {
                let hips = hips.iter().map(|hip| format!("({}, {})", hip[0], hip[1]));
                let hips = hips.collect::<Vec<_>>().join(", ");
                let found = format!("first joints at (x, y) = {hips} m");
                let expected = "one at each corner of the trunk: x forward, y left";
                Err(RobotFileError::at(
                    self.file,
                    self.places.of_robot("leg"),
                    found,
                    expected,
                ))
            }
        }
    }

    fn axis(&self, place: String, joint: &JointEntry) -> Result<Vector3<f64>, RobotFileError> {
        let Some(given) = joint.axis.vector() else {
            let found = format!("{:?}", joint.axis);
            let expected = "\"x\", \"y\", \"z\", \"-x\", \"-y\", \"-z\" or three numbers";
            return Err(RobotFileError::at(self.file, place, found, expected));
        };
        let vector = Vector3::from(given);
        let norm = vector.norm();
        let is_fine = norm.is_finite() && norm > 1e-6;
        self.check(is_fine, &place, format!("{given:?}"), "a direction")?;
        let is_fine = joint.sign.abs() == 1.0 && joint.offset_rad.is_finite();
        let found = format!("sign {} and offset_rad {}", joint.sign, joint.offset_rad);
        self.check(is_fine, &place, found, "sign 1 or -1, offset_rad finite")?;
        // What is a unit vector already stays as it is, to the last bit.
        let unit = match (norm - 1.0).abs() < 1e-12 {
            true => vector,
            false => vector / norm,
        };
        // No -0.0, so that the usual axes are recognised.
        Ok((unit * joint.sign).map(|v| v + 0.0))
    }

    fn chain(&self, index: usize, leg: &LegEntry) -> Result<ChainLeg, RobotFileError> {
        let mut axes = [Vector3::zeros(); LEG_JOINT_DIM];
        for (offset, joint) in leg.joint.iter().enumerate() {
            let place = |key: &str| self.places.of_joint(index, offset, key);
            axes[offset] = self.axis(place("axis"), joint)?;
            self.vector(&place("at"), joint.at)?;
        }
        self.vector(&self.places.of_foot(index), leg.foot)?;
        let mut links = [leg.joint[1].at, leg.joint[2].at, leg.foot].map(Vector3::from);
        // At the recorded zero each joint is turned back by its offset.
        for joint in (0..LEG_JOINT_DIM).rev() {
            let offset = leg.joint[joint].offset_rad;
            if offset != 0.0 {
                let turn = Rotation3::from_axis_angle(&Unit::new_unchecked(axes[joint]), -offset);
                for later in joint..LEG_JOINT_DIM {
                    links[later] = turn * links[later];
                    if later > joint {
                        axes[later] = turn * axes[later];
                    }
                }
            }
        }
        let chain = ChainLeg {
            axes: axes.map(Into::into),
            links: links.map(|link| link.map(|v| v + 0.0).into()),
        };
        let place = &self.places.of_leg(index);
        let names = |a: usize, b: usize| {
            let [a, b] = [a, b].map(|joint| leg.joint[joint].name.as_str());
            format!("the axes of {a} and {b}")
        };
        let is_tilted = axes[1].cross(&axes[2]).norm() > MAX_TILT;
        let found = format!("{} in different directions", names(1, 2));
        let expected = "a leg whose last two joints turn about parallel axes";
        self.check(!is_tilted, place, found, expected)?;
        let is_stiff = axes[0].cross(&axes[1]).norm() < MIN_ABDUCTION;
        let found = format!("{} almost parallel", names(0, 1));
        let expected = "a first joint that moves the plane of the leg";
        self.check(!is_stiff, place, found, expected)?;
        let lengths = chain.lengths();
        let is_short = lengths.iter().any(|length| *length < MIN_LINK_M);
        let found = format!("thigh and calf of {} and {} m", lengths[0], lengths[1]);
        let expected = "lengths across the axes of the last two joints";
        self.check(!is_short, place, found, expected)?;
        Ok(chain)
    }
}
