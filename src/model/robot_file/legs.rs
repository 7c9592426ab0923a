//! From an entry to a checked robot, and joint losses from a file or from a program's arrays.

use std::collections::BTreeMap;

use super::*;

const MAX_NAME_LEN: usize = 80;
const MAX_LINK_M: f64 = 10.0;
const MIN_LINK_M: f64 = 1e-3;
const MAX_TILT: f64 = 1e-3; // largest sine of the angle between the axes of a leg's last two joints
const MIN_ABDUCTION: f64 = 0.1; // smallest sine of the angle between the first axis and the second

/// A part of an entry, by the indices of leg and joint.
#[derive(Clone, Copy)]
pub(super) enum Part<'k> {
    Name,
    Mass,
    Legs,
    Leg(usize),
    Foot(usize),
    Joint(usize, usize, &'k str), // with a key; the joint itself, if that is empty
}

pub(super) struct Places<'f> {
    pub file: &'f str,
    pub kind: &'static str, // `toml` or `urdf`
    pub of: &'f dyn Fn(Part<'_>) -> String,
}

impl<'f> Places<'f> {
    pub(super) fn keys(file: &'f str) -> Self {
        let of = &|part: Part<'_>| match part {
            Part::Name => "name".to_owned(),
            Part::Mass => "mass_kg".to_owned(),
            Part::Legs => "leg".to_owned(),
            Part::Leg(leg) => format!("leg[{leg}]"),
            Part::Foot(leg) => format!("leg[{leg}].foot"),
            Part::Joint(leg, joint, "") => format!("leg[{leg}].joint[{joint}]"),
            Part::Joint(leg, joint, key) => format!("leg[{leg}].joint[{joint}].{key}"),
        };
        let kind = "toml";
        Self { file, kind, of }
    }
}

impl RobotEntry {
    /// The robot of the entry, which is `entry` of `file` in errors; equal robots are one.
    pub fn robot(&self, file: &str) -> Result<&'static Robot> {
        let robot = build(self, &Places::keys(file))?;
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

pub(super) fn build(entry: &RobotEntry, places: &Places<'_>) -> Result<Robot> {
    places.name(Part::Name, &entry.name)?;
    places.positive(Part::Mass, entry.mass_kg)?;
    let found = format!("{} legs", entry.leg.len());
    let expected = "four: models, inputs and controllers are those of quadrupeds";
    places.check(entry.leg.len() == FOOT_DIM, Part::Legs, found, expected)?;
    let corners = places.corners(&entry.leg)?;
    let mut robot = Robot {
        name: word(&entry.name),
        mass_kg: entry.mass_kg,
        legs: [LegGeometry::new([[0.0; 3]; 3], [[0.0; 3]; 3]); FOOT_DIM],
        hip_position_m: [[0.0; 3]; FOOT_DIM],
        joint_names: [""; JOINT_DIM],
        torque_limit_nm: [0.0; JOINT_DIM],
        joint_limit_rad: [(0.0, 0.0); JOINT_DIM],
        joint_speed_limit_rad_s: [0.0; JOINT_DIM],
    };
    let mut names: Vec<&str> = Vec::with_capacity(JOINT_DIM);
    for (index, (leg, entry)) in corners.iter().zip(&entry.leg).enumerate() {
        let k = leg.index();
        robot.legs[k] = places.geometry(index, entry)?;
        robot.hip_position_m[k] = entry.joint[0].at;
        for (offset, joint) in entry.joint.iter().enumerate() {
            let part = |key: &'static str| Part::Joint(index, offset, key);
            let at = LEG_JOINT_DIM * k + offset;
            places.name(part("name"), &joint.name)?;
            let is_new = !names.contains(&joint.name.as_str());
            let found = format!("{:?} a second time", joint.name);
            places.check(is_new, part("name"), found, "each name once")?;
            names.push(&joint.name);
            robot.joint_names[at] = word(&joint.name);
            robot.joint_limit_rad[at] = places.limits(part, joint)?;
            robot.torque_limit_nm[at] = places.positive(part("torque_nm"), joint.torque_nm)?;
            robot.joint_speed_limit_rad_s[at] =
                places.positive(part("speed_rad_s"), joint.speed_rad_s)?;
        }
    }
    Ok(robot)
}

impl Places<'_> {
    fn fault(
        &self,
        part: Part<'_>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> RobotFileError {
        RobotFileError::at(self.file, (self.of)(part), found, expected)
    }

    fn check(
        &self,
        is_fine: bool,
        part: Part<'_>,
        found: impl Into<Box<str>>,
        expected: impl Into<Box<str>>,
    ) -> Result<()> {
        match is_fine {
            true => Ok(()),
            false => Err(self.fault(part, found, expected)),
        }
    }

    fn name(&self, part: Part<'_>, name: &str) -> Result<()> {
        // Comments and pages of generated files list names.
        let is_fine = !name.trim().is_empty()
            && name.len() <= MAX_NAME_LEN
            && !name.chars().any(|c| is_invisible(c) || "\\`".contains(c))
            && !["*/", "/*", "??"].iter().any(|sign| name.contains(sign));
        let expected = format!(
            "a name of at most {MAX_NAME_LEN} bytes that are seen, without \\, `, /*, */ and ??"
        );
        self.check(is_fine, part, format!("{name:?}"), expected)
    }

    fn positive(&self, part: Part<'_>, value: f64) -> Result<f64> {
        let is_fine = value.is_finite() && value > 0.0;
        self.check(is_fine, part, value.to_string(), "a finite number above 0")?;
        Ok(value)
    }

    fn vector(&self, part: Part<'_>, vector: [f64; 3]) -> Result<()> {
        let is_fine = vector.iter().all(|v| v.abs() <= MAX_LINK_M);
        let expected = format!("three lengths of at most {MAX_LINK_M} m");
        self.check(is_fine, part, format!("{vector:?}"), expected)
    }

    fn limits(
        &self,
        part: impl Fn(&'static str) -> Part<'static>,
        joint: &JointEntry,
    ) -> Result<(f64, f64)> {
        let (key, unit, given, [low, high]) = match (joint.limits_rad, joint.limits_deg) {
            (Some(limits), None) => ("limits_rad", "rad", limits, limits),
            (None, Some(limits)) => {
                let radians = limits.map(f64::to_radians);
                ("limits_deg", "degrees", limits, radians)
            }
            (found, _) => {
                let found = if found.is_some() { "both" } else { "neither" };
                let expected = "one of limits_rad and limits_deg";
                return Err(self.fault(part(""), found, expected));
            }
        };
        let is_fine = low.is_finite() && high.is_finite() && low < high;
        let found = format!("{low} to {high}");
        self.check(is_fine, part(key), found, "the lower limit first")?;
        // Beyond two turns limits are degrees, or bounds of a joint that has none.
        let is_fine = low.abs().max(high.abs()) <= LARGEST_ANGLE_RAD;
        let found = format!("{} to {} {unit}", given[0], given[1]);
        let expected = match self.kind {
            "toml" => "at most two turns either way; limits_deg is in degrees",
            _ => {
                "at most two turns either way: rad, not degrees; type=\"continuous\" for a joint without bounds"
            }
        };
        self.check(is_fine, part(key), found, expected)?;
        Ok((low, high))
    }

    /// Which leg each entry is, by where its first joint stands.
    fn corners(&self, legs: &[LegEntry]) -> Result<[Leg; FOOT_DIM]> {
        for (index, leg) in legs.iter().enumerate() {
            if leg.joint.len() != LEG_JOINT_DIM {
                let place = format!("{}.joint", (self.of)(Part::Leg(index)));
                let found = format!("{} joints", leg.joint.len());
                let expected = "three, from the trunk to the foot";
                return Err(RobotFileError::at(self.file, place, found, expected));
            }
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
                Err(self.fault(Part::Legs, found, expected))
            }
        }
    }

    fn axis(&self, part: Part<'_>, joint: &JointEntry) -> Result<Vector3<f64>> {
        let Some(given) = joint.axis.vector() else {
            let found = format!("{:?}", joint.axis);
            let expected = "\"x\", \"y\", \"z\", \"-x\", \"-y\", \"-z\" or three numbers";
            return Err(self.fault(part, found, expected));
        };
        let vector = Vector3::from(given);
        let norm = vector.norm();
        let is_fine = norm.is_finite() && norm > 1e-6;
        self.check(is_fine, part, format!("{given:?}"), "a direction")?;
        let (sign, offset_rad) = (joint.sign.unwrap_or(1.0), joint.offset_rad.unwrap_or(0.0));
        let is_fine = sign.abs() == 1.0 && offset_rad.is_finite();
        let found = format!("sign {sign} and offset_rad {offset_rad}");
        self.check(is_fine, part, found, "sign 1 or -1, offset_rad finite")?;
        // A vector that is already a unit vector stays unchanged, to the last bit.
        let unit = match (norm - 1.0).abs() < 1e-12 {
            true => vector,
            false => vector / norm,
        };
        Ok((unit * sign).map(|v| v + 0.0)) // no -0.0, so that the usual axes are recognised
    }

    fn geometry(&self, index: usize, leg: &LegEntry) -> Result<LegGeometry> {
        let mut axes = [Vector3::zeros(); LEG_JOINT_DIM];
        for (offset, joint) in leg.joint.iter().enumerate() {
            axes[offset] = self.axis(Part::Joint(index, offset, "axis"), joint)?;
            self.vector(Part::Joint(index, offset, "at"), joint.at)?;
        }
        self.vector(Part::Foot(index), leg.foot)?;
        let mut links = [leg.joint[1].at, leg.joint[2].at, leg.foot].map(Vector3::from);
        // At the recorded zero each joint is turned back by its offset.
        for joint in (0..LEG_JOINT_DIM).rev() {
            let offset = leg.joint[joint].offset_rad.unwrap_or(0.0);
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
        let links = links.map(|link| link.map(|v| v + 0.0).into());
        let geometry = LegGeometry::new(axes.map(Into::into), links);
        let part = Part::Leg(index);
        let names = |a: usize, b: usize| {
            let [a, b] = [a, b].map(|joint| leg.joint[joint].name.as_str());
            format!("the axes of {a} and {b}")
        };
        let is_tilted = axes[1].cross(&axes[2]).norm() > MAX_TILT;
        let found = format!("{} in different directions", names(1, 2));
        let expected = "a leg whose last two joints turn about parallel axes";
        self.check(!is_tilted, part, found, expected)?;
        let is_stiff = axes[0].cross(&axes[1]).norm() < MIN_ABDUCTION;
        let found = format!("{} almost parallel", names(0, 1));
        let expected = "a first joint that moves the plane of the leg";
        self.check(!is_stiff, part, found, expected)?;
        let lengths = geometry.lengths_m;
        let is_short = lengths.iter().any(|length| *length < MIN_LINK_M);
        let found = format!("thigh and calf of {} and {} m", lengths[0], lengths[1]);
        let expected = "lengths across the axes of the last two joints";
        self.check(!is_short, part, found, expected)?;
        Ok(geometry)
    }
}

const COUNT: &str = "12, or 3 for hx, hy, kn";

/// The table that is read; a file of `romc identify` has others as well.
#[derive(Deserialize)]
struct File {
    robot: Option<String>,
    gravity_m_s2: Option<f64>,
    actuators: ActuatorsEntry,
    legs: Option<LegMoments>,
}

const GRAVITY_SHARE: f64 = 0.25; // by which gravity identified with the losses may differ from the earth's

/// Joint losses as files and programs write them: twelve numbers each, or three (hx, hy, kn) that hold for every leg.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ActuatorsEntry {
    viscous: Vec<f64>,
    dry: Vec<f64>,
    armature: Vec<f64>,
}

impl ActuatorsEntry {
    pub fn of_arrays(mut arrays: BTreeMap<String, Vec<f64>>) -> Result<Self> {
        let mut take = |name: &str| {
            let missing = || RobotFileError::at("", format!("actuators.{name}"), "nothing", COUNT);
            arrays.remove(name).ok_or_else(missing)
        };
        let entry = Self {
            viscous: take("viscous")?,
            dry: take("dry")?,
            armature: take("armature")?,
        };
        match arrays.into_keys().next() {
            None => Ok(entry),
            Some(name) => {
                let place = format!("actuators.{name}");
                let expected = "viscous, dry and armature alone";
                Err(RobotFileError::at("", place, "an unknown array", expected))
            }
        }
    }

    pub fn actuators(&self, file: &str) -> Result<Actuators> {
        let joints = |name: &str, values: &[f64]| match values.len() {
            found @ (3 | JOINT_DIM) => Ok(std::array::from_fn(|joint| values[joint % found])),
            found => {
                let (place, found) = (format!("actuators.{name}"), format!("{found} numbers"));
                Err(RobotFileError::at(file, place, found, COUNT))
            }
        };
        let actuators = Actuators {
            viscous: joints("viscous", &self.viscous)?,
            dry: joints("dry", &self.dry)?,
            armature: joints("armature", &self.armature)?,
            legs: None,
        };
        match actuators.unusable() {
            None => Ok(actuators),
            Some((name, joint, found)) => {
                let place = format!("actuators.{name}, joint {}", JOINT_NAMES[joint]);
                let (found, expected) = (found.to_string(), "a number of at least 0");
                Err(RobotFileError::at(file, place, found, expected))
            }
        }
    }
}

/// Moments of a leg by name, as programs give them.
pub fn leg_moments(mut values: BTreeMap<String, f64>) -> Result<LegMoments> {
    let fault = |name: &str, found: &str, expected: &str| {
        RobotFileError::at(
            "",
            format!("actuators.legs.{name}"),
            found.to_owned(),
            expected,
        )
    };
    let mut take = |name: &str| {
        let value = values.remove(name);
        value.ok_or_else(|| fault(name, "nothing", "a number"))
    };
    let moments = LegMoments {
        side_kg_m: take("side_kg_m")?,
        thigh_kg_m: take("thigh_kg_m")?,
        calf_kg_m: take("calf_kg_m")?,
        thigh_kg_m2: take("thigh_kg_m2")?,
        calf_kg_m2: take("calf_kg_m2")?,
    };
    match (values.into_keys().next(), moments.unusable()) {
        (Some(name), _) => Err(fault(&name, "an unknown moment", "the five of a leg alone")),
        (None, Some((name, found))) => Err(fault(name, &found.to_string(), LegMoments::ACCEPTED)),
        (None, None) => Ok(moments),
    }
}

/// Reads the tables `[actuators]` and, if there is one, `[legs]` of a TOML file, such as one of `romc identify`.
/// `robot` is the robot of the actuators, if known.
pub fn read_actuators(path: &Path, robot: Option<&Robot>) -> Result<Actuators> {
    let file = path.display().to_string();
    let File {
        robot: of,
        gravity_m_s2: gravity,
        actuators,
        legs,
    } = from_toml_text(&file, &text_of(path)?)?;
    if let Some((name, found)) = legs.and_then(|legs| legs.unusable()) {
        let (place, found) = (format!("legs.{name}"), found.to_string());
        return Err(RobotFileError::at(
            &file,
            place,
            found,
            LegMoments::ACCEPTED,
        ));
    }
    let is_off = |gravity: &f64| (gravity / GRAVITY_M_S2 - 1.0).abs() > GRAVITY_SHARE;
    if let Some(gravity) = gravity.filter(is_off) {
        let expected = format!(
            "about {GRAVITY_M_S2}: the recordings of this file do not show the robot's losses"
        );
        return Err(RobotFileError::at(
            &file,
            "gravity_m_s2",
            gravity.to_string(),
            expected,
        ));
    }
    match (of, robot.map(|robot| robot.name)) {
        (Some(found), Some(expected)) if found != expected => {
            let expected = format!("{expected}, whose recordings these are, or no such line");
            Err(RobotFileError::at(&file, "robot", found, expected))
        }
        _ => Ok(Actuators {
            legs,
            ..actuators.actuators(&file)?
        }),
    }
}
