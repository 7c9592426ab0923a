//! romc's own robots: limits, mirrored joints, feet.

use nalgebra::Vector3;
use romc::robot::RobotError;
use romc::robot::*;

#[test]
fn mirrored_joints_of_known_robots_are_abductions_against_and_flexions_alike() {
    for name in romc::robot_file::known_names() {
        let robot = romc::robot_file::by_name(name).unwrap();
        let signs = (0..JOINT_DIM).map(|joint| robot.mirror_sign(joint));
        assert!(signs.eq([-1.0, 1.0, 1.0].repeat(4)), "{name}");
    }
}

#[test]
fn by_name_unknown_robot_lists_the_known_ones() {
    let error = romc::robot_file::by_name("spot").unwrap_err();
    let RobotError::UnknownRobot { found, known } = &error else {
        panic!("{error:?}");
    };
    assert_eq!(found, "spot");
    assert_eq!(known, &romc::robot_file::known_names().join(", "));
    assert!(error.to_string().contains("`spot`; known: go1"));
}

#[test]
fn state_and_input_names_are_in_the_order_of_the_contract() {
    let [state, input] = [Robot::state_names(), Robot::input_names()];
    let ends = |names: &[String]| [0, 11, 12, 17].map(|i| names[i].clone());
    assert_eq!(ends(&state), ["fr.hx", "rl.kn", "body.x", "body.yaw"]);
    assert_eq!(ends(&input), ["fr.hx", "rl.kn", "force.x", "moment.z"]);
    assert_eq!(input[..12], state[..12]);
    assert_eq!(Robot::state_units()[14], "m");
    assert_eq!(Robot::input_units()[14..16], ["N", "N m"]);
}

#[test]
fn registered_robots_stand_inside_their_limits_with_an_invertible_jacobian() {
    for name in romc::robot_file::known_names() {
        let robot = romc::robot_file::by_name(name).unwrap();
        for (joint, (low, high)) in robot.joint_limit_rad().iter().enumerate() {
            let stand = [0.0, 0.8, -1.5][joint % 3];
            assert!(*low < stand && stand < *high, "{name} joint {joint}");
        }
        let leg = robot.geometry(Leg::RearLeft);
        assert!(leg.manipulability(&[0.0, 0.8, -1.5]) > 0.3);
        assert!(robot.torque_limit_nm().iter().all(|limit| *limit > 0.0));
    }
}

#[test]
fn foot_positions_agree_with_a_physics_engine() {
    // Foot sphere minus hip body in MuJoCo's Go1 and Go2, trunk upright.
    let postures = [
        (Leg::FrontRight, [0.31, 0.72, -1.43]),
        (Leg::RearLeft, [-0.2, 1.1, -2.0]),
    ];
    let expected = [
        [-0.001608342, 0.021940214, -0.330737735],
        [-0.022978536, 0.032906295, -0.240347313],
        [-0.003125066, 0.007576739, -0.33670767],
        [-0.024221756, 0.047786081, -0.244962113],
    ];
    let legs = ["go1", "go2"].map(|name| postures.map(|(leg, q)| (name, leg, q)));
    for ((name, leg, q), expected) in legs.into_iter().flatten().zip(expected) {
        let foot = romc::robot_file::by_name(name)
            .unwrap()
            .foot_position(leg, &q);
        let error = (foot - Vector3::from(expected)).norm();
        assert!(error < 2e-9, "{name} {leg}: {error:e}");
    }
}

#[test]
fn hip_positions_lie_on_the_side_of_their_leg() {
    let go1 = romc::robot_file::by_name("go1").unwrap();
    for leg in Leg::ALL {
        let hip = go1.hip_position(leg);
        assert!(hip.y * leg.side() > 0.0);
        assert_eq!(hip.x > 0.0, leg.is_front());
    }
}
