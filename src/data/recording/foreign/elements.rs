//! The quantities of a recording, the names of their elements in romc's order, and units with their factors to SI. Also
//! converts quaternions to roll, pitch and yaw, and angular velocities to the rates of these angles.

use std::f64::consts::{PI, TAU};

use nalgebra::Matrix3;

use super::*;
use crate::robot::JOINT_DIM as BODY;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Quantity {
    JointPosition,
    JointVelocity,
    JointAcceleration,
    JointTorque,
    BodyPosition,
    Orientation, // attitude of the trunk: a quaternion, or roll, pitch and yaw
    BodyVelocity,
    AngularVelocity, // angular velocity of the trunk, or rates of roll, pitch and yaw
    BodyAcceleration,
    AngularAcceleration, // second derivatives of roll, pitch and yaw
    Feet,
}

impl Quantity {
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

    pub(crate) const ACCELERATIONS: [(Self, Self); 3] = [
        (Self::JointAcceleration, Self::JointVelocity),
        (Self::BodyAcceleration, Self::BodyVelocity),
        (Self::AngularAcceleration, Self::AngularVelocity),
    ];

    /// Its table in a map, the dimension of its units, the recording's columns, and the first of them.
    fn facts(self) -> (&'static str, Dimension, fn(usize) -> Column, usize) {
        use Column::{Acceleration, Foot, Position, Velocity};
        use Dimension::{Angle, Force, Length, Torque};
        const TURN: usize = BODY + 3;
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

    pub(crate) fn key(self) -> &'static str {
        self.facts().0
    }

    pub(crate) fn at(self, key: &str) -> String {
        format!("{}.{key}", self.key())
    }

    pub(crate) fn dimension(self) -> Dimension {
        self.facts().1
    }

    pub(crate) fn column(self, element: usize) -> Column {
        let (_, _, column, first) = self.facts();
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

pub(super) const QUATERNION: [&str; 4] = ["w", "x", "y", "z"]; // the real part first

/// The elements that words name: names, names with `*` (`*.hx`, `fl.*`), or single letters (`wxyz`, `rpy`, `xyz`).
pub(super) fn ordered(words: &[&str], elements: &[&str]) -> Result<Vec<usize>, String> {
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
    let found = Vec::from_iter((0..elements.len()).filter(|i| matches(elements[*i])));
    let has_letters = ["x", "roll"].iter().any(|axis| elements.contains(axis));
    if !found.is_empty() || !word.is_ascii() || !has_letters {
        return found;
    }
    let of_letter = |letter: char| elements.iter().position(|e| e.starts_with(letter));
    let letters: Option<_> = word.chars().map(of_letter).collect();
    letters.unwrap_or_default() // none: the caller names the word and the elements
}

/// The dimension of a unit; rates and accelerations have the same per s and s^2.
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
        let is_base = |c: &char| self == Dimension::Time || *c != '/';
        let base: String = folded.take_while(is_base).collect();
        let known = self.units().iter().find(|(name, _)| *name == base);
        known.map(|(_, factor)| *factor)
    }

    pub(crate) fn names(self) -> String {
        let names: Vec<&str> = self.units().iter().map(|(name, _)| *name).collect();
        names.join(", ")
    }
}

const UPRIGHT: f64 = 1e-6; // cosine of the pitch below which roll and yaw cannot be distinguished

/// Roll, pitch and yaw of quaternions (w, x, y, z), R = Rz Ry Rx; the length of a quaternion does not matter.
pub(crate) fn angles_of_quaternions(quaternions: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(3, quaternions.ncols());
    for (mut angles, q) in out.column_iter_mut().zip(quaternions.column_iter()) {
        let norm = q.norm();
        let (w, x, y, z) = (q[0] / norm, q[1] / norm, q[2] / norm, q[3] / norm);
        let sine = 2.0 * (w * y - x * z);
        let (forward, side) = (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z));
        angles[0] = (2.0 * (y * z + w * x)).atan2(1.0 - 2.0 * (x * x + y * y));
        angles[1] = sine.atan2(forward.hypot(side));
        angles[2] = side.atan2(forward);
    }
    out
}

/// Subtracts whole turns from rows of angles where they jump by more than half a turn; returns whether any did.
pub(super) fn unwrap(angles: &mut DMatrix<f64>) -> bool {
    let mut any = false;
    for mut row in angles.row_iter_mut() {
        let mut turns = 0.0;
        for i in 1..row.len() {
            let now = row[i] + turns;
            let jump = now - row[i - 1];
            if jump.abs() > PI {
                turns -= TAU * (jump / TAU).round();
                any = true;
            }
            row[i] += turns;
        }
    }
    any
}

pub(super) fn in_world(angles: &DMatrix<f64>, velocities: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = velocities.clone();
    for (i, mut velocity) in out.column_iter_mut().enumerate() {
        let turn: Matrix3<f64> = rotation([angles[(0, i)], angles[(1, i)], angles[(2, i)]]);
        velocity.copy_from(&(turn * velocities.fixed_view::<3, 1>(0, i)));
    }
    out
}

/// Rates of roll, pitch and yaw from an angular velocity; an error is the first sample with the trunk upright.
pub(super) fn angle_rates(angles: &Rows, angular: &Rows, frame: Frame) -> Result<Rows, usize> {
    let mut out = angular.clone();
    for (i, mut rates) in out.column_iter_mut().enumerate() {
        let [(s_r, c_r), (s_p, c_p), (s_y, c_y)] = [0, 1, 2].map(|row| angles[(row, i)].sin_cos());
        if c_p.abs() < UPRIGHT {
            return Err(i);
        }
        // Columns of the matrices one below the other.
        let map = match frame {
            Frame::Body => Matrix3::from([
                [1.0, 0.0, 0.0],
                [s_r * (s_p / c_p), c_r, s_r / c_p],
                [c_r * (s_p / c_p), -s_r, c_r / c_p],
            ]),
            Frame::World => Matrix3::from([
                [c_y / c_p, -s_y, c_y * s_p / c_p],
                [s_y / c_p, c_y, s_y * s_p / c_p],
                [0.0, 0.0, 1.0],
            ]),
            Frame::Angles => break,
        };
        rates.copy_from(&(map * angular.fixed_view::<3, 1>(0, i)));
    }
    Ok(out)
}
