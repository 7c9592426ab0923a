//! Force and moment of a leg with any axes, see [`crate::robot::ChainLeg`].

use super::number::Number;
use super::wrench::{JointAngles, damped};
use crate::robot::kinematics::least_levers;
use crate::robot::{BODY_DIM, ChainLeg};

type Vector<'b> = [Number<'b>; 3];

/// Force and moment of one leg about its first joint, in axes parallel to the body's.
pub(super) fn chain_wrench<'b>(
    leg: &ChainLeg,
    angles: JointAngles<'b>,
    torques: [Number<'b>; 3],
    foot: Number<'b>,
) -> [Number<'b>; BODY_DIM] {
    let known = |vector: [f64; 3]| vector.map(|component| foot.constant(component));
    let axes = leg.axes.map(known);
    let turned = |joint: usize, vector| turned_about(axes[joint], angles[joint], vector);
    let [hip, thigh, calf] = leg.links.map(known);
    let beyond_knee = turned(0, turned(1, turned(2, calf)));
    let thigh = turned(0, turned(1, thigh));
    let beyond_second = sum(thigh, beyond_knee);
    let position = sum(turned(0, hip), beyond_second);
    let normal = turned(0, axes[1]);
    let knee_axis = turned(0, turned(1, axes[2]));
    let columns = [
        cross(axes[0], position),
        cross(normal, beyond_second),
        cross(knee_axis, beyond_knee),
    ];
    // F = -J^-T tau by area and lever, as ChainLeg::damped_force_map.
    let across = cross(columns[1], columns[2]);
    let [area, lever] = [dot(across, normal), dot(columns[0], normal)];
    let [least_area, least_lever] = least_levers(leg.lengths());
    let one = foot.constant(1.0);
    let of_area = damped(one, area, least_area);
    let of_lever = damped(one, lever, least_lever);
    let torques = torques.map(|torque| foot * torque);
    // In the plane: (c_2 x n) tau_1 + (n x c_1) tau_2 over the area.
    let (of_second, of_third) = (cross(columns[2], normal), cross(normal, columns[1]));
    let in_plane = sum(times(torques[1], of_second), times(torques[2], of_third));
    let in_plane = times(of_area, in_plane);
    // Along the normal: tau_0 - c_0 . (the force in the plane, reversed) over the lever.
    let along = (torques[0] - dot(columns[0], in_plane)) * of_lever;
    let force = sum(in_plane, times(along, normal)).map(|component| -component);
    let ([f_x, f_y, f_z], [m_x, m_y, m_z]) = (force, cross(position, force));
    [f_x, f_y, f_z, m_x, m_y, m_z]
}

fn sum<'b>(a: Vector<'b>, b: Vector<'b>) -> Vector<'b> {
    std::array::from_fn(|i| a[i] + b[i])
}

fn times<'b>(factor: Number<'b>, vector: Vector<'b>) -> Vector<'b> {
    vector.map(|component| factor * component)
}

fn dot<'b>(a: Vector<'b>, b: Vector<'b>) -> Number<'b> {
    (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]
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
    let across = cross(axis, vector);
    let along = dot(axis, vector) * (1.0 - cos);
    std::array::from_fn(|i| vector[i] * cos + across[i] * sin + axis[i] * along)
}
