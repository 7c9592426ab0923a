//! Generalised inputs from what a robot measures: its state, joint torques and contacts; and back, from torques at the
//! links to those of the motors.
//!
//! The same forces and moments as [`InputRule::wrench`](crate::robot::InputRule::wrench), in closed form. With `fwd`
//! and `up` the foot in the plane of the leg, `c_fwd` and `c_up` the calf's share of them, `h` the signed hip offset,
//! and the right-handed axes `x`, `e = (0, sin hx, -cos hx)`, `n = (0, cos hx, sin hx)`, the leg's Jacobian has the
//! columns `-h e - up n`, `up x + fwd e` and `c_up x + c_fwd e`, and the foot is at `p = fwd x - up e + h n`. From `J^T
//! F = -tau` (equation 4) follow the force and its moment about the hip
//!
//! ```text
//! F_x = (fwd tau_2 - c_fwd tau_1) / det        (p x F)_x = -up F_n - h F_e
//! F_e = (c_up tau_1 - up tau_2) / det          (p x F)_e = h F_x - fwd F_n
//! F_n = (tau_0 - h F_e) / up                   (p x F)_n = fwd F_e + up F_x
//! det = up c_fwd - fwd c_up
//! ```
//!
//! for a leg of the usual shape; other legs move as [`Moved`] says. `1 / d` of both divisors is `d / max(d^2,
//! least^2)`, see [`LegGeometry::least_levers`](crate::robot::LegGeometry::least_levers).

use super::dynamics::LowerError;
use super::number::{Number, Sheet};
use crate::ir::{Program, ProgramBuilder, Unary, ValueId};
use crate::model::ReducedModel;
use crate::robot::chain::least_levers;
use crate::robot::chain::{Moved, cross, dot, sum};
use crate::robot::input_rule::DRY_SPEED_RAD_S;
use crate::robot::joints::LEG_JOINT_DIM;
use crate::robot::{
    BODY_DIM, ChainLeg, FOOT_DIM, InputRule, JOINT_DIM, Leg, LegGeometry, PlanarLeg, STATE_DIM,
    WrenchFrame,
};

/// Sine and cosine of each joint's angle.
type JointAngles<'b> = [(Number<'b>, Number<'b>); 3];

/// `u = [net; F; M]` with the torques at the links `net` and the force and moment of the feet on the ground, by the
/// model's rule (equations 4 to 7, 22 and 23): inputs `x` and `dx` (18 robot coordinates and their velocities), `tau`
/// (torques of the motors, 12, N m), `feet` (4, order of [`Leg::ALL`]: 1 on the ground, 0 in the air); output `u` (18,
/// N m and N). `None` for a model that is not over the 18 coordinates of a robot that romc knows.
///
/// `net` is `tau` less viscous and dry friction; the inertia of the motors needs accelerations, which are not measured,
/// and is left out. A foot's force and moment are multiplied with its element of `feet`; at 0 they are zero in every
/// posture.
///
/// # Errors
/// [`LowerError::Program`] if the program breaks one of its promises.
pub fn generalised_input(model: &ReducedModel) -> Result<Option<Program>, LowerError> {
    rule_of(model).map(|rule| input_of(&rule)).transpose()
}

/// Torques of the motors behind torques at the links, `tau = net + b dq + c tanh(dq / v) + I ddq`: inputs `dx` and
/// `ddx` (velocities and accelerations of the 18 robot coordinates, of which the joints count), `net` (12, N m); output
/// `tau` (12, N m). `None` as for [`generalised_input`], of which it is the inverse at the joints for `ddx = 0`.
///
/// # Errors
/// As [`generalised_input`].
pub fn actuator_torque(model: &ReducedModel) -> Result<Option<Program>, LowerError> {
    rule_of(model).map(|rule| torque_of(&rule)).transpose()
}

fn rule_of(model: &ReducedModel) -> Option<InputRule> {
    let rule = model.input_rule().ok()?;
    (model.state_dim() == Some(STATE_DIM)).then_some(rule)
}

fn torque_of(rule: &InputRule) -> Result<Program, LowerError> {
    let mut builder = ProgramBuilder::new("actuator_torque");
    let dx = builder.input("dx", STATE_DIM);
    let ddx = builder.input("ddx", STATE_DIM);
    let net = builder.input("net", JOINT_DIM);
    let sheet = &Sheet::new(&mut builder);
    let tau = (0..JOINT_DIM).map(|joint| {
        let [dx, ddx, net] = [dx[joint], ddx[joint], net[joint]].map(|id| Number::new(sheet, id));
        let armature = rule.actuators().map_or(0.0, |a| a.armature[joint]);
        (net + (friction(rule, joint, dx) + armature * ddx)).id()
    });
    let tau: Vec<ValueId> = tau.collect();
    builder.output("tau", &tau);
    Ok(builder.finish()?)
}

fn input_of(rule: &InputRule) -> Result<Program, LowerError> {
    let robot = rule.robot();
    let mut builder = ProgramBuilder::new("generalised_input");
    let x = builder.input("x", STATE_DIM);
    let dx = builder.input("dx", STATE_DIM);
    let tau = builder.input("tau", JOINT_DIM);
    let feet = builder.input("feet", FOOT_DIM);
    let sheet = &Sheet::new(&mut builder);
    let number = |id: ValueId| Number::new(sheet, id);
    let net: [Number; JOINT_DIM] =
        std::array::from_fn(|joint| number(tau[joint]) - friction(rule, joint, number(dx[joint])));
    let joint = |kind: usize| (0..FOOT_DIM).map(move |leg| LEG_JOINT_DIM * leg + kind);
    // Abductions, then flexions, then of planar legs the angles of the calves, flexion plus knee, of others those of
    // the knees.
    let mut angles: Vec<ValueId> = joint(0).chain(joint(1)).map(|k| x[k]).collect();
    for leg in Leg::ALL {
        let k = LEG_JOINT_DIM * leg.index() + 1;
        angles.push(match robot.geometry(leg) {
            LegGeometry::Planar(_) => (number(x[k]) + number(x[k + 1])).id(),
            LegGeometry::Chain(_) => x[k + 1],
        });
    }
    let frame = rule.wrench_frame();
    if frame == WrenchFrame::World {
        angles.extend(&x[STATE_DIM - 3..]);
    }
    let (sines, cosines) = sheet.borrow_mut().sin_cos(&angles);
    let at = |angle: usize| (number(sines[angle]), number(cosines[angle]));
    let of_legs = Leg::ALL.map(|leg| {
        let k = leg.index();
        let angles = [at(k), at(FOOT_DIM + k), at(2 * FOOT_DIM + k)];
        let torques = std::array::from_fn(|i| net[LEG_JOINT_DIM * k + i]);
        let foot = number(feet[k]);
        let wrench = match robot.geometry(leg) {
            LegGeometry::Planar(planar) => leg_wrench(planar, angles, torques, foot),
            LegGeometry::Chain(chain) => chain_wrench(chain, angles, torques, foot),
        };
        match frame {
            WrenchFrame::Body => wrench,
            WrenchFrame::World => about_body(robot.hip_position(leg).into(), wrench),
        }
    });
    let [fr, fl, rr, rl] = of_legs;
    let wrench = std::array::from_fn(|i| (fr[i] + fl[i]) + (rr[i] + rl[i]));
    let wrench = match frame {
        WrenchFrame::Body => wrench,
        WrenchFrame::World => in_world([0, 1, 2].map(|angle| at(JOINT_DIM + angle)), wrench),
    };
    let u: Vec<ValueId> = net.into_iter().chain(wrench).map(Number::id).collect();
    builder.output("u", &u);
    Ok(builder.finish()?)
}

fn friction<'b>(rule: &InputRule, joint: usize, velocity: Number<'b>) -> Number<'b> {
    let of = rule.actuators().map(|a| (a.viscous[joint], a.dry[joint]));
    match of {
        None => velocity.constant(0.0),
        Some((viscous, 0.0)) => viscous * velocity,
        Some((viscous, dry)) => {
            let slow = (velocity / DRY_SPEED_RAD_S).unary(Unary::Tanh);
            viscous * velocity + dry * slow
        }
    }
}

/// `numerator / divisor`, with `divisor / max(divisor^2, least^2)` for the reciprocal.
fn damped<'b>(numerator: Number<'b>, divisor: Number<'b>, least: f64) -> Number<'b> {
    let (square, floor) = (divisor * divisor, divisor.constant(least * least));
    let twice_larger = (square + floor) + (square - floor).abs();
    2.0 * (numerator * divisor) / twice_larger
}

/// The same wrench with its moment about the body's origin instead of the hip `[x, y, z]`.
fn about_body<'b>(hip: [f64; 3], wrench: [Number<'b>; BODY_DIM]) -> [Number<'b>; BODY_DIM] {
    let mut moved = wrench;
    for axis in 0..3 {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        for (lever, force) in [(hip[next], wrench[last]), (-hip[last], wrench[next])] {
            moved[3 + axis] = moved[3 + axis] + lever * force;
        }
    }
    moved
}

/// Force and moment in the body's axes as the generalised forces of the body's coordinates, with sine and cosine of
/// roll, pitch and yaw.
fn in_world<'b>(
    [(s_r, c_r), (s_p, c_p), (s_y, c_y)]: JointAngles<'b>,
    [f_x, f_y, f_z, m_x, m_y, m_z]: [Number<'b>; BODY_DIM],
) -> [Number<'b>; BODY_DIM] {
    // R_x, then R_y, then R_z on the force.
    let (across, up) = (c_r * f_y - s_r * f_z, s_r * f_y + c_r * f_z);
    let (along, up) = (c_p * f_x + s_p * up, c_p * up - s_p * f_x);
    let force_x = c_y * along - s_y * across;
    let force_y = s_y * along + c_y * across;
    // The axis of the pitch rate is e_y turned by the roll alone, that of the yaw rate is vertical.
    let pitch = c_r * m_y - s_r * m_z;
    let about_up = s_r * m_y + c_r * m_z;
    let yaw = c_p * about_up - s_p * m_x;
    [force_x, force_y, up, m_x, pitch, yaw]
}

/// Force and moment of one leg about its hip, in axes parallel to the body's; the third angle is that of the calf,
/// flexion plus knee.
fn leg_wrench<'b>(
    geometry: &PlanarLeg,
    [abduction, (thigh_sin, thigh_cos), (calf_sin, calf_cos)]: JointAngles<'b>,
    torques: [Number<'b>; LEG_JOINT_DIM],
    foot: Number<'b>,
) -> [Number<'b>; BODY_DIM] {
    let (thigh, calf, forward) = (geometry.thigh_m, geometry.calf_m, geometry.foot_forward_m);
    let calf_forward = -calf * calf_sin + forward * calf_cos;
    let calf_up = -calf * calf_cos + -forward * calf_sin;
    let (thigh_forward, thigh_up) = (-thigh * thigh_sin, -thigh * thigh_cos);
    let (fwd, up) = (thigh_forward + calf_forward, thigh_up + calf_up);
    // The same as up c_fwd - fwd c_up, without what cancels.
    let det = thigh_up * calf_forward - thigh_forward * calf_up;
    let [least_det, least_up] = least_levers([thigh, calf]);

    let [tau_0, tau_1, tau_2] = torques.map(|torque| foot * torque);
    let hip = foot.constant(geometry.hip_m);
    let f_x = damped(fwd * tau_2 - calf_forward * tau_1, det, least_det);
    let f_e = damped(calf_up * tau_1 - up * tau_2, det, least_det);
    let f_n = damped(tau_0 - hip * f_e, up, least_up);
    let m_x = -(up * f_n + hip * f_e);
    let m_e = hip * f_x - fwd * f_n;
    let m_n = fwd * f_e + up * f_x;

    let [f_y, f_z] = turned(abduction, f_e, f_n);
    let [m_y, m_z] = turned(abduction, m_e, m_n);
    [f_x, f_y, f_z, m_x, m_y, m_z]
}

/// The components along y and z of `a e + b n`.
fn turned<'b>((s, c): (Number<'b>, Number<'b>), a: Number<'b>, b: Number<'b>) -> [Number<'b>; 2] {
    [a * s + b * c, b * s - a * c]
}

/// Force and moment of a leg with any axes about its first joint, in axes parallel to the body's.
fn chain_wrench<'b>(
    leg: &ChainLeg,
    angles: JointAngles<'b>,
    torques: [Number<'b>; 3],
    foot: Number<'b>,
) -> [Number<'b>; BODY_DIM] {
    let known = |vector: [f64; 3]| vector.map(|component| foot.constant(component));
    let one = foot.constant(1.0);
    let moved = Moved::new(leg.axes.map(known), leg.links.map(known), angles, one);
    let (columns, normal) = (moved.columns, moved.normal);
    // F = -J^-T tau by area and lever, as ChainLeg::damped_force_map.
    let [area, lever] = moved.levers();
    let [least_area, least_lever] = least_levers(leg.lengths());
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
    let ([f_x, f_y, f_z], [m_x, m_y, m_z]) = (force, cross(moved.foot, force));
    [f_x, f_y, f_z, m_x, m_y, m_z]
}

fn times<'b>(factor: Number<'b>, vector: [Number<'b>; 3]) -> [Number<'b>; 3] {
    vector.map(|component| factor * component)
}
