//! Inputs of a model from torques and feet.

use nalgebra::{SVector, Vector3};
use romc::robot::*;

use romc::robot::input_rule::rotation;
use romc::robot::joints::LEG_JOINT_DIM;

const CONTACTS: [ContactFlags; 3] = [
    [true; 4],
    [false, false, true, true],
    [true, false, false, true],
];

fn rule(name: &str) -> InputRule {
    InputRule::new(
        romc::robot_file::by_name(name).unwrap(),
        None,
        WrenchFrame::World,
    )
}

fn state() -> [f64; STATE_DIM] {
    std::array::from_fn(|i| match i {
        0..JOINT_DIM => [0.1, 0.8, -1.5][i % 3] + 0.02 * i as f64,
        12..=14 => 0.3 * i as f64 - 3.0,
        15 => 0.3,
        16 => -0.9,
        _ => 0.7,
    })
}

fn torques() -> [f64; JOINT_DIM] {
    std::array::from_fn(|i| 3.0 - 0.7 * i as f64 + 0.2 * (i * i) as f64)
}

#[test]
fn world_wrench_does_the_work_of_the_feet_on_the_bodys_coordinates() {
    // Virtual work: F_k . d(foot k)/dx_i over the feet in contact is -tau_i for a joint of a leg
    // in contact, and the generalised force for a coordinate of the body.
    for name in romc::robot_file::known_names() {
        let rule = rule(name);
        let (x, tau) = (state(), torques());
        for contact in CONTACTS {
            let wrench = rule.wrench(&x, &tau, contact).unwrap();
            let joints = std::array::from_fn(|i| x[i]);
            let turn = rotation([x[15], x[16], x[17]]);
            let legs = Leg::down(contact);
            let forces: Vec<(Leg, Vector3<f64>)> = legs
                .map(|leg| {
                    let (q, tau) = (leg.of_joints(&joints), leg.of_joints(&tau));
                    (leg, turn * rule.robot().foot_force(leg, &q, &tau).unwrap())
                })
                .collect();
            for i in 0..STATE_DIM {
                let step = 1e-6;
                let (mut lower, mut upper) = (x, x);
                lower[i] -= step;
                upper[i] += step;
                let work: f64 = (forces.iter())
                    .map(|(leg, force)| {
                        let foot = |x| rule.robot().foot_in_world(*leg, x);
                        force.dot(&(foot(&upper) - foot(&lower))) / (2.0 * step)
                    })
                    .sum();
                let expected = match i {
                    0..JOINT_DIM if contact[i / LEG_JOINT_DIM] => -tau[i],
                    0..JOINT_DIM => 0.0,
                    _ => wrench[i - JOINT_DIM],
                };
                assert!(
                    (work - expected).abs() < 1e-6 * wrench.norm(),
                    "{name} {contact:?} {i}: {work} {expected}"
                );
            }
        }
    }
}

#[test]
fn wrench_is_the_wrench_map_times_torques_in_both_frames() {
    let (x, tau) = (state(), torques());
    for frame in WrenchFrame::ALL {
        let rule = InputRule::new(romc::robot_file::by_name("go2").unwrap(), None, frame);
        for contact in CONTACTS {
            let joints = std::array::from_fn(|i| x[i]);
            let map = rule.wrench_map(&joints, [x[15], x[16], x[17]], contact);
            let product = map.unwrap() * SVector::<f64, JOINT_DIM>::from(tau);
            let wrench = rule.wrench(&x, &tau, contact).unwrap();
            assert!(
                (wrench - product).norm() < 1e-12 * wrench.norm(),
                "{frame:?}"
            );
        }
    }
}

#[test]
fn world_and_body_force_agree_for_a_level_robot_that_looks_along_x() {
    let mut x = state();
    x[15..].fill(0.0);
    let world = rule("go1").wrench(&x, &torques(), [true; 4]).unwrap();
    let body = InputRule::published(romc::robot_file::by_name("go1").unwrap());
    let body = body.wrench(&x, &torques(), [true; 4]).unwrap();
    assert!((world - body).rows(0, 3).norm() < 1e-12 * body.norm());
    // The arms differ: about the body's origin a front foot that pushes up pitches it back.
    assert!((world - body).rows(3, 3).norm() > 1.0);
}

#[test]
fn names_of_frames_are_read_back() {
    for frame in WrenchFrame::ALL {
        assert_eq!(WrenchFrame::by_name(frame.name()), Some(frame));
    }
    assert_eq!(WrenchFrame::by_name("World"), None);
}
