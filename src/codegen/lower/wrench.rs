//! Generalised inputs from a robot's measured state, joint torques and contacts; and motor torques from those at the
//! links. Forces and moments as of [`InputRule::wrench`](crate::robot::InputRule::wrench), in closed form.

use super::number::Number;
use super::*;
use crate::robot::{
    BODY_DIM, DRY_SPEED_RAD_S, FOOT_DIM, GRAVITY_M_S2, InputRule, JOINT_DIM, LEG_JOINT_DIM, Leg,
    LegShape, MovingLeg, Posture, STATE_DIM, TrunkMotion, WrenchFrame,
};

/// `u = [net; F; M]` with the torques at the links `net` and the force and moment of the feet on the ground, by the
/// model's rule (equations 4 to 7, 22, 23). Inputs are `x` and `dx` (18 robot coordinates and their velocities), `tau`
/// (motor torques, 12, N m) and `feet` (4, order of [`Leg::ALL`]: 1 on the ground, 0 in the air). Output is `u` (18, N
/// m and N). `None` for a model that is not over the 18 coordinates of a known robot.
///
/// `net` is `tau` minus viscous and dry friction, without the inertia of motors and legs, because accelerations are not
/// measured. A foot's force and moment are multiplied with its element of `feet`; at 0 they are zero in every posture.
pub fn generalised_input(model: &ReducedModel) -> Result<Option<Program>> {
    rule_of(model).map(|rule| input_of(&rule)).transpose()
}

/// Torques of the motors behind torques at the links, `tau = net + b dq + c tanh(dq / v) + I ddq`. Inputs are `dx` and
/// `ddx` (velocities and accelerations of the 18 robot coordinates, of which only the joints are used) and `net` (12, N
/// m); output is `tau` (12, N m). `None` as for [`generalised_input`], of which it is the inverse at the joints for
/// `ddx = 0`.
pub fn actuator_torque(model: &ReducedModel) -> Result<Option<Program>> {
    rule_of(model).map(|rule| torque_of(&rule)).transpose()
}

/// Torques that carry and move the links of the legs on the ground ([`InputRule::leg_torques`]). Inputs are `x`, `dx`,
/// `ddx` (18 robot coordinates, their velocities and accelerations) and `feet` (4, as of [`generalised_input`]); output
/// is `own` (12, N m). `None` as for [`generalised_input`], and for a model whose rule does not subtract them.
pub fn leg_torque(model: &ReducedModel) -> Result<Option<Program>> {
    let rule = rule_of(model).filter(|rule| rule.legs().is_some());
    rule.map(|rule| leg_torque_of(&rule)).transpose()
}

fn rule_of(model: &ReducedModel) -> Option<InputRule> {
    let rule = model.input_rule().ok()?;
    (model.state_dim() == Some(STATE_DIM)).then_some(rule)
}

fn torque_of(rule: &InputRule) -> Result<Program> {
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

fn leg_torque_of(rule: &InputRule) -> Result<Program> {
    let robot = rule.robot();
    let moments = rule.legs().expect("invariant: the caller has looked");
    let mut builder = ProgramBuilder::new("leg_torque");
    let [x, dx, ddx] = ["x", "dx", "ddx"].map(|name| builder.input(name, STATE_DIM));
    let feet = builder.input("feet", FOOT_DIM);
    let sheet = &Sheet::new(&mut builder);
    let number = |id: ValueId| Number::new(sheet, id);
    let three = |values: &[ValueId], first: usize| [0, 1, 2].map(|i| number(values[first + i]));
    let (angles, attitude) = (leg_angles(rule, sheet, &x), JOINT_DIM + 3);
    let angles: Vec<ValueId> = angles
        .into_iter()
        .chain(x[attitude..].iter().copied())
        .collect();
    let (sines, cosines) = sheet.borrow_mut().sin_cos(&angles);
    let at = |angles: [usize; 3]| {
        [&sines, &cosines].map(|values| angles.map(|angle| number(values[angle])))
    };
    let [forwards, aside, up] = three(&ddx, JOINT_DIM);
    let lift = [forwards, aside, up + GRAVITY_M_S2];
    let turns = at([0, 1, 2].map(|angle| JOINT_DIM + angle));
    let trunk = TrunkMotion::of(turns, three(&dx, attitude), three(&ddx, attitude), lift);
    let of_legs = Leg::ALL.map(|leg| {
        let (k, first) = (leg.index(), LEG_JOINT_DIM * leg.index());
        let links = robot.geometry(leg).links();
        let moving = MovingLeg::of(robot, leg, &links, moments);
        let rates = [three(&dx, first), three(&ddx, first)];
        let turned = at([k, FOOT_DIM + k, 2 * FOOT_DIM + k]);
        let own = moving.torques(&trunk, turned, rates, |value| up.constant(value));
        own.map(|torque| number(feet[k]) * torque)
    });
    let own: Vec<ValueId> = of_legs.into_iter().flatten().map(Number::id).collect();
    builder.output("own", &own);
    Ok(builder.finish()?)
}

/// Abductions, then flexions, then the angles of the calves.
fn leg_angles<'b>(rule: &InputRule, sheet: &'b Sheet<'b>, x: &[ValueId]) -> Vec<ValueId> {
    let number = |id: ValueId| Number::new(sheet, id);
    let joint = |kind: usize| (0..FOOT_DIM).map(move |leg| LEG_JOINT_DIM * leg + kind);
    let mut angles: Vec<ValueId> = joint(0).chain(joint(1)).map(|k| x[k]).collect();
    for leg in Leg::ALL {
        let k = LEG_JOINT_DIM * leg.index() + 1;
        let knee = rule.robot().geometry(leg).shape.knee * number(x[k + 1]);
        angles.push((number(x[k]) + knee).id());
    }
    angles
}

fn input_of(rule: &InputRule) -> Result<Program> {
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
    let mut angles = leg_angles(rule, sheet, &x);
    let frame = rule.wrench_frame();
    if frame != WrenchFrame::Body {
        angles.extend(&x[STATE_DIM - 3..]);
    }
    let (sines, cosines) = sheet.borrow_mut().sin_cos(&angles);
    let at = |angles: [usize; 3]| {
        [&sines, &cosines].map(|values| angles.map(|angle| number(values[angle])))
    };
    let attitude = [0, 1, 2].map(|angle| JOINT_DIM + angle);
    let of_legs = Leg::ALL.map(|leg| {
        let k = leg.index();
        let turned = at([k, FOOT_DIM + k, 2 * FOOT_DIM + k]);
        let torques = std::array::from_fn(|i| number(feet[k]) * net[LEG_JOINT_DIM * k + i]);
        let arm_from = match frame {
            WrenchFrame::Body => [0.0; 3],
            WrenchFrame::World | WrenchFrame::Ground => robot.hip_position(leg).into(),
        };
        let wrench = leg_wrench(&robot.geometry(leg).shape, arm_from, turned, torques);
        match frame {
            WrenchFrame::Body | WrenchFrame::World => wrench,
            WrenchFrame::Ground => pushed(at(attitude), wrench),
        }
    });
    let [fr, fl, rr, rl] = of_legs;
    let wrench = std::array::from_fn(|i| (fr[i] + fl[i]) + (rr[i] + rl[i]));
    let wrench = match frame {
        WrenchFrame::Body => wrench,
        WrenchFrame::World | WrenchFrame::Ground => in_world(at(attitude), wrench),
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

/// A foot's force and moment in the body's axes, zero where the force is downwards in the world.
fn pushed<'b>(
    [[s_r, s_p, _], [c_r, c_p, _]]: [[Number<'b>; 3]; 2],
    wrench: [Number<'b>; BODY_DIM],
) -> [Number<'b>; BODY_DIM] {
    let [f_x, f_y, f_z, ..] = wrench;
    let up = c_p * (s_r * f_y + c_r * f_z) - s_p * f_x;
    let pushes = 0.5 + 0.5 * up.unary(Unary::Sign);
    wrench.map(|entry| pushes * entry)
}

/// From the body's axes to the generalised forces of its coordinates; sines and cosines of roll, pitch and yaw.
fn in_world<'b>(
    [[s_r, s_p, s_y], [c_r, c_p, c_y]]: [[Number<'b>; 3]; 2],
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

/// Force and moment of one leg's torques in axes parallel to the body's, at sines and cosines of its angles, of which
/// the third is that of the calf. The arm of the moment is from a point relative to the hip's origin.
fn leg_wrench<'b>(
    leg: &LegShape,
    arm_from: [f64; 3],
    [sines, cosines]: [[Number<'b>; 3]; 2],
    [tau_0, tau_1, tau_2]: [Number<'b>; LEG_JOINT_DIM],
) -> [Number<'b>; BODY_DIM] {
    let zero = tau_0.constant(0.0);
    let mut posture = Posture::filled(zero);
    posture.foot[1] = zero.constant(leg.hip[1]);
    posture.turn(leg, &sines, &cosines);
    let (by_first, limb, calf) = (posture.by_first, posture.limb, posture.calf);
    let (tau_2, [least_area, least_lever]) = (leg.knee * tau_2, leg.least);
    let [forward, up] = [0, 1].map(|k| {
        damped(
            limb[k] * tau_2 - calf[k] * tau_1,
            posture.area(),
            least_area,
        )
    });
    let by_plane = by_first[0] * forward + by_first[2] * up;
    let normal = damped(tau_0 + by_plane, posture.lever(), least_lever);
    let [foot, force] = [posture.foot, [forward, normal, up]].map(|vector| {
        let mut turned = [zero; 3];
        posture.write_in_body(&vector, &mut turned);
        turned
    });
    let arm: [Number; 3] = std::array::from_fn(|i| foot[i] + arm_from[i]);
    std::array::from_fn(|i| match i {
        0..3 => force[i],
        _ => {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            arm[j] * force[k] - arm[k] * force[j]
        }
    })
}
