//! The reference of walks: the strides of a model over the velocity, and settings for walks.

use super::*;
use crate::model::{ReducedModel, STRIDE_WIDTH};
use crate::robot::{BODY_X, FOOT_DIM, JOINT_DIM, LEG_JOINT_DIM, Robot, STATE_DIM, YAW};

/// Along a walk the legs are those of the plan, and deviations count by lengths that do not grow with the way.
pub fn walk_settings(robot: &Robot) -> MpcSettings {
    MpcSettings {
        lift: Lift::Consistent,
        legs: Legs::Reference,
        input_weight: 2.0,
        terminal_weight: 100.0,
        velocity_weight: 0.02,
        place_scale_m: Some(0.03),
        heading_scale_rad: Some(0.05),
        drives: Drives::of(robot),
        ..MpcSettings::default()
    }
}

/// Settings of a walk for a model with strides, otherwise the default ones.
pub fn settings_for(model: &ReducedModel) -> MpcSettings {
    match (model.stride_prior(), model.robot()) {
        (Ok(_), Ok(robot)) => walk_settings(robot),
        _ => MpcSettings::default(),
    }
}

/// The model's strides at the training's mean frequency, duty and height, which are affine in the velocity. The stand
/// has the mean posture of each leg on the ground and the mean input.
///
/// # Errors
/// Those of a model without strides or robot, and of a node whose legs have no forces.
pub fn walk_strides(model: &ReducedModel) -> Result<Strides, MpcError> {
    let (prior, rule) = (model.stride_prior()?, model.input_rule()?);
    let [.., frequency_hz, duty, height] = prior.gait.map(|range| range.mean);
    let stride = |velocity: [f64; 3]| {
        let [forward, left, yaw_rate] = velocity;
        let gait = [forward, left, yaw_rate, frequency_hz, duty, height];
        prior.stride(rule.robot(), &gait)
    };
    let rest = stride([0.0; 3]);
    let units = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let changes = units.map(|unit| stride(unit) - &rest);
    let count = rest.nrows();
    let mut nodes = Vec::with_capacity(4 * STRIDE_WIDTH * count);
    for node in 0..count {
        nodes.extend(rest.row(node).iter());
        for change in &changes {
            nodes.extend(change.row(node).iter());
        }
    }
    let mut stand = [0.0; 2 * STATE_DIM];
    for i in 0..STATE_DIM {
        let is_down = |node: &usize| match i < JOINT_DIM {
            true => rest[(*node, 2 * STATE_DIM + i / LEG_JOINT_DIM)] > 0.5,
            false => true,
        };
        let down: Vec<usize> = (0..count).filter(is_down).collect();
        let sum: f64 = down.iter().map(|&node| rest[(node, i)]).sum();
        stand[i] = sum / down.len().max(1) as f64;
    }
    for of_symmetry in [BODY_X, BODY_X + 1, BODY_X + 3, YAW] {
        stand[of_symmetry] = 0.0;
    }
    for node in 0..count {
        let number = |i: usize| rest[(node, i)];
        let x: [f64; STATE_DIM] = std::array::from_fn(number);
        let net: [f64; JOINT_DIM] = std::array::from_fn(|joint| number(STATE_DIM + joint));
        let feet: [bool; FOOT_DIM] = std::array::from_fn(|foot| number(2 * STATE_DIM + foot) > 0.5);
        let wrench = rule.input_wrench(&x, &net, feet)?;
        let input = net.iter().chain(wrench.iter());
        for (mean, number) in stand[STATE_DIM..].iter_mut().zip(input) {
            *mean += number / count as f64;
        }
    }
    let reach = std::array::from_fn(|i| prior.reach(i));
    let gait = Gait {
        count,
        frequency_hz,
        least: reach.map(|[least, _]: [f64; 2]| least),
        most: reach.map(|[_, most]| most),
        mean: std::array::from_fn(|i| prior.gait[i].mean),
        stand,
    };
    Ok(Strides { gait, nodes })
}
