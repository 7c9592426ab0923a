//! The quantities of a recording, the names of their elements in romc's order, and units with their factors to SI.

use crate::recording::columns::Column;
use crate::robot::{JOINT_DIM, JOINT_NAMES, STATE_DIM};

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Quantity {
    JointPosition,
    JointVelocity,
    JointAcceleration,
    JointTorque,
    BodyPosition,
    /// Attitude of the trunk: a quaternion, or roll, pitch and yaw.
    Orientation,
    BodyVelocity,
    /// Angular velocity of the trunk, or rates of roll, pitch and yaw.
    AngularVelocity,
    BodyAcceleration,
    /// Second derivatives of roll, pitch and yaw.
    AngularAcceleration,
    Feet,
}

impl Quantity {
    /// In the order of a map.
    pub(crate) const ALL: [Self; 11] = [
        Self::JointPosition,
        Self::JointVelocity,
        Self::JointAcceleration,
        Self::JointTorque,
        Self::BodyPosition,
        Self::Orientation,
        Self::BodyVelocity,
        Self::AngularVelocity,
        Self::BodyAcceleration,
        Self::AngularAcceleration,
        Self::Feet,
    ];

    /// Accelerations, each with the velocity whose derivative it is.
    pub(crate) const ACCELERATIONS: [(Self, Self); 3] = [
        (Self::JointAcceleration, Self::JointVelocity),
        (Self::BodyAcceleration, Self::BodyVelocity),
        (Self::AngularAcceleration, Self::AngularVelocity),
    ];

    /// Its table in a map, what its units measure, the recording's columns, and the first of them.
    const fn facts(self) -> (&'static str, Dimension, fn(usize) -> Column, usize) {
        use Column::{Acceleration, Foot, Position, Velocity};
        use Dimension::{Angle, Force, Length, Torque};
        const BODY: usize = JOINT_DIM;
        const TURN: usize = JOINT_DIM + 3;
        match self {
            Self::JointPosition => ("joint.position", Angle, Position, 0),
            Self::JointVelocity => ("joint.velocity", Angle, Velocity, 0),
            Self::JointAcceleration => ("joint.acceleration", Angle, Acceleration, 0),
            Self::JointTorque => ("joint.torque", Torque, Column::Torque, 0),
            Self::BodyPosition => ("body.position", Length, Position, BODY),
            Self::Orientation => ("body.orientation", Angle, Position, TURN),
            Self::BodyVelocity => ("body.velocity", Length, Velocity, BODY),
            Self::AngularVelocity => ("body.angular_velocity", Angle, Velocity, TURN),
            Self::BodyAcceleration => ("body.acceleration", Length, Acceleration, BODY),
            Self::AngularAcceleration => ("body.angular_acceleration", Angle, Acceleration, TURN),
            Self::Feet => ("feet", Force, Foot, 0),
        }
    }

    /// Its table in a map.
    pub(crate) const fn key(self) -> &'static str {
        self.facts().0
    }

    pub(crate) fn at(self, key: &str) -> String {
        format!("{}.{key}", self.key())
    }

    /// What its units measure.
    pub(crate) const fn dimension(self) -> Dimension {
        self.facts().1
    }

    pub(crate) fn column(self, element: usize) -> Column {
        let (_, _, column, first) = self.facts();
        debug_assert!(first + element < STATE_DIM, "w of a quaternion");
        column(first + element)
    }

    pub(crate) fn is_required(self) -> bool {
        use Quantity::{BodyPosition, Feet, JointPosition, JointTorque, Orientation};
        [JointPosition, JointTorque, BodyPosition, Orientation, Feet].contains(&self)
    }

    pub(crate) fn is_of_joints(self) -> bool {
        self.key().starts_with("joint.")
    }

    pub(crate) fn is_by_leg(self) -> bool {
        self.is_of_joints() || self == Self::Feet
    }

    pub(crate) fn elements(self) -> &'static [&'static str] {
        match self {
            _ if self.is_of_joints() => &JOINT_NAMES,
            Self::Orientation | Self::AngularAcceleration => &["roll", "pitch", "yaw"],
            Self::Feet => &["fr", "fl", "rr", "rl"],
            _ => &["x", "y", "z"],
        }
    }
}

/// Elements of a quaternion, the real part first.
pub(super) const QUATERNION: [&str; 4] = ["w", "x", "y", "z"];

/// The elements that the words of an order name, in that order: single names, names with `*` for every leg or joint
/// (`*.hx`, `fl.*`), a word of single letters (`wxyz`, `rpy`, `xyz`).
pub(super) fn ordered(words: &[String], elements: &[&str]) -> Result<Vec<usize>, String> {
    let mut out = Vec::new();
    for word in words {
        let found = named(word, elements);
        if found.is_empty() {
            return Err(format!("`{word}`, which is none of {}", elements.join(" ")));
        }
        for element in found {
            if out.contains(&element) {
                return Err(format!("`{}` twice", elements[element]));
            }
            out.push(element);
        }
    }
    Ok(out)
}

pub(super) fn named(word: &str, elements: &[&str]) -> Vec<usize> {
    let word = word.trim().to_lowercase();
    let matches = |element: &str| match word.split_once('*') {
        Some((start, end)) => element.starts_with(start) && element.ends_with(end),
        None => element == word,
    };
    let found = (0..elements.len()).filter(|i| matches(elements[*i]));
    let found: Vec<usize> = found.collect();
    // Letters: `wxyz`, or the first letters of roll, pitch and yaw.
    let has_letters = ["x", "roll"].iter().any(|axis| elements.contains(axis));
    if !found.is_empty() || !word.is_ascii() || !has_letters {
        return found;
    }
    let of_letter = |letter: char| elements.iter().position(|e| e.starts_with(letter));
    let letters = word.chars().map(of_letter);
    letters.collect::<Option<Vec<usize>>>().unwrap_or_default()
}

/// What a unit measures; rates and accelerations are the same per s and s^2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dimension {
    Angle,
    Length,
    Torque,
    Force,
    Time,
}

impl Dimension {
    /// Units with their factors to rad, m, N m, N or s.
    pub(crate) const fn units(self) -> &'static [(&'static str, f64)] {
        const DEGREE: f64 = std::f64::consts::PI / 180.0;
        const TURN: f64 = 2.0 * std::f64::consts::PI;
        match self {
            Dimension::Angle => &[
                ("rad", 1.0),
                ("deg", DEGREE),
                ("mrad", 1e-3),
                ("turn", TURN),
                ("rpm", TURN / 60.0),
                ("degree", DEGREE),
                ("degrees", DEGREE),
                ("radians", 1.0),
                ("°", DEGREE),
            ],
            Dimension::Length => &[("m", 1.0), ("mm", 1e-3), ("cm", 1e-2)],
            Dimension::Torque => &[("nm", 1.0), ("nmm", 1e-3), ("mnm", 1e-3), ("ncm", 1e-2)],
            Dimension::Force => &[("n", 1.0), ("kn", 1e3), ("kgf", 9.80665)],
            Dimension::Time => &[
                ("s", 1.0),
                ("ms", 1e-3),
                ("us", 1e-6),
                ("µs", 1e-6),
                ("ns", 1e-9),
                ("min", 60.0),
                ("iso", 1.0),
            ],
        }
    }

    /// The factor of a unit such as `deg/s`, `mm`, `N mm`; case, blanks and `/s` do not matter.
    pub(crate) fn factor(self, text: &str) -> Option<f64> {
        let is_said = |c: &char| !c.is_whitespace() && !matches!(c, '*' | '.' | '·');
        let folded = text.chars().filter(is_said).flat_map(char::to_lowercase);
        let folded: String = folded.collect();
        let base = match self {
            Dimension::Time => &folded[..],
            _ => folded.split('/').next().unwrap_or_default(),
        };
        let known = self.units().iter().find(|(name, _)| *name == base);
        known.map(|(_, factor)| *factor)
    }

    pub(crate) fn names(self) -> String {
        let names: Vec<&str> = self.units().iter().map(|(name, _)| *name).collect();
        names.join(", ")
    }
}
