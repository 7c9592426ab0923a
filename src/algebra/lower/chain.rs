//! Force and moment of a leg with any axes, see [`crate::robot::ChainLeg`].

use std::ops::{Add, Mul, Sub};

use super::number::Number;
use super::wrench::damped;
use crate::robot::kinematics::least_levers;
use crate::robot::{BODY_DIM, ChainLeg};

/// A number that is known, or a value of the program; what is known costs no operation.
#[derive(Clone, Copy)]
enum Scalar<'b> {
    Known(f64),
    Value(Number<'b>),
}
use Scalar::{Known, Value};

type Vector<'b> = [Scalar<'b>; 3];

/// Sine and cosine of each joint's angle.
pub(super) type JointAngles<'b> = [(Number<'b>, Number<'b>); 3];

/// Force and moment of one leg about its first joint, in axes parallel to the body's.
pub(super) fn chain_wrench<'b>(
    leg: &ChainLeg,
    angles: JointAngles<'b>,
    torques: [Number<'b>; 3],
    foot: Number<'b>,
) -> [Number<'b>; BODY_DIM] {
    let known = |vector: [f64; 3]| vector.map(Known);
    let value = |scalar: Scalar<'b>| match scalar {
        Known(number) => foot.constant(number),
        Value(value) => value,
    };
    let turned = |joint: usize, vector| turned_about(known(leg.axes[joint]), angles[joint], vector);
    let [first, second, third] = leg.axes.map(known);
    let [hip, thigh, calf] = leg.links.map(known);
    let beyond_knee = turned(0, turned(1, turned(2, calf)));
    let thigh = turned(0, turned(1, thigh));
    let beyond_second = sum(thigh, beyond_knee);
    let position = sum(turned(0, hip), beyond_second);
    let normal = turned(0, second);
    let knee_axis = turned(0, turned(1, third));
    let columns = [
        cross(first, position),
        cross(normal, beyond_second),
        cross(knee_axis, beyond_knee),
    ];
    // F = -J^-T tau by area and lever, as ChainLeg::damped_force_map.
    let across = cross(columns[1], columns[2]);
    let [area, lever] = [dot(across, normal), dot(columns[0], normal)].map(value);
    let [least_area, least_lever] = least_levers(leg.lengths());
    let one = foot.constant(1.0);
    let of_area = Value(damped(one, area, least_area));
    let of_lever = Value(damped(one, lever, least_lever));
    let torques = torques.map(|torque| Value(foot * torque));
    // In the plane: (c_2 x n) tau_1 + (n x c_1) tau_2 over the area.
    let (of_second, of_third) = (cross(columns[2], normal), cross(normal, columns[1]));
    let in_plane = sum(times(torques[1], of_second), times(torques[2], of_third));
    let in_plane = times(of_area, in_plane);
    // Along the normal: tau_0 - c_0 . (the force in the plane, reversed) over the lever.
    let along = (torques[0] - dot(columns[0], in_plane)) * of_lever;
    let force = sum(in_plane, times(along, normal));
    let force = times(Known(-1.0), force);
    let moment = cross(position, force);
    let [f_x, f_y, f_z] = force.map(value);
    let [m_x, m_y, m_z] = moment.map(value);
    [f_x, f_y, f_z, m_x, m_y, m_z]
}

impl Add for Scalar<'_> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        match (self, other) {
            (Known(a), Known(b)) => Known(a + b),
            (Known(0.0), other) | (other, Known(0.0)) => other,
            (Known(a), Value(b)) => Value(a + b),
            (Value(a), Known(b)) => Value(a + b),
            (Value(a), Value(b)) => Value(a + b),
        }
    }
}

impl Sub for Scalar<'_> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        match (self, other) {
            (Known(a), Known(b)) => Known(a - b),
            (_, Known(0.0)) => self,
            (Known(0.0), Value(b)) => Value(-b),
            (Known(a), Value(b)) => Value(a - b),
            (Value(a), Known(b)) => Value(a - b),
            (Value(a), Value(b)) => Value(a - b),
        }
    }
}

impl Mul for Scalar<'_> {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        match (self, other) {
            (Known(a), Known(b)) => Known(a * b),
            (Known(0.0), _) | (_, Known(0.0)) => Known(0.0),
            (Known(1.0), other) | (other, Known(1.0)) => other,
            (Known(-1.0), Value(b)) | (Value(b), Known(-1.0)) => Value(-b),
            (Known(a), Value(b)) => Value(a * b),
            (Value(a), Known(b)) => Value(a * b),
            (Value(a), Value(b)) => Value(a * b),
        }
    }
}

fn sum<'b>(a: Vector<'b>, b: Vector<'b>) -> Vector<'b> {
    std::array::from_fn(|i| a[i] + b[i])
}

fn times<'b>(factor: Scalar<'b>, vector: Vector<'b>) -> Vector<'b> {
    vector.map(|component| factor * component)
}

fn dot<'b>(a: Vector<'b>, b: Vector<'b>) -> Scalar<'b> {
    let pairs = a.into_iter().zip(b);
    pairs.fold(Known(0.0), |sum, (a, b)| sum + a * b)
}

fn cross<'b>(a: Vector<'b>, b: Vector<'b>) -> Vector<'b> {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

/// `v cos + (a x v) sin + a (a . v) (1 - cos)` about an axis.
fn turned_about<'b>(
    axis: Vector<'b>,
    (sin, cos): (Number<'b>, Number<'b>),
    vector: Vector<'b>,
) -> Vector<'b> {
    let (sin, cos) = (Value(sin), Value(cos));
    let across = cross(axis, vector);
    let along = dot(axis, vector);
    let along = along * (Known(1.0) - cos);
    std::array::from_fn(|i| vector[i] * cos + across[i] * sin + axis[i] * along)
}
