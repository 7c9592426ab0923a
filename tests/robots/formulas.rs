//! Joints, legs, forces and inputs of robots: formulas compared with differences, virtual work and a physics engine.

use nalgebra::{Matrix3, Rotation3, SVector, Unit, Vector3, Vector6};
use romc::robot::LEG_JOINT_DIM;
use romc::robot::rotation;
use romc::robot::{
    Actuators, ContactFlags, InputRule, JOINT_DIM, JOINT_NAMES, Leg, LegGeometry, LegMoments,
    Robot, RobotError, STATE_DIM, WrenchFrame,
};

#[test]
fn joint_names_start_with_the_name_of_their_leg() {
    for leg in Leg::ALL {
        for (offset, kind) in ["hx", "hy", "kn"].iter().enumerate() {
            let name = JOINT_NAMES[LEG_JOINT_DIM * leg.index() + offset];
            assert_eq!(name, format!("{leg}.{kind}"));
        }
    }
}

#[test]
fn leg_of_joints_takes_its_own_three_entries() {
    let joints: [f64; JOINT_DIM] = std::array::from_fn(|i| i as f64);
    assert_eq!(Leg::FrontRight.of_joints(&joints), [0.0, 1.0, 2.0]);
    assert_eq!(Leg::RearLeft.of_joints(&joints), [9.0, 10.0, 11.0]);
}

#[test]
fn unusable_names_the_array_and_joint_of_a_negative_value() {
    let mut actuators = Actuators::of_leg([1.0, 0.6, 0.6], [0.2; 3], [0.01; 3]);
    assert_eq!((actuators.viscous[3], actuators.viscous[5]), (1.0, 0.6));
    assert_eq!(actuators.unusable(), None);
    actuators.dry[7] = -0.1;
    assert_eq!(actuators.unusable(), Some(("dry", 7, -0.1)));
}

#[test]
fn losses_oppose_the_motion_and_are_dry_friction_alone_when_slow() {
    let actuators = Actuators {
        viscous: [0.6; JOINT_DIM],
        dry: [0.2; JOINT_DIM],
        armature: [0.01; JOINT_DIM],
        legs: None,
    };
    let (fast, still) = ([30.0; STATE_DIM], [0.0; STATE_DIM]);
    let [world, ground] = [WrenchFrame::World, WrenchFrame::Ground].map(|frame| {
        let rule = InputRule::new(go1(), Some(actuators.clone()), frame);
        move |dx: f64, ddx: &[f64; STATE_DIM], down| {
            rule.losses([&[0.0; STATE_DIM], &[dx; STATE_DIM], ddx], [down; 4])
        }
    });
    for down in [true, false] {
        assert!((world(-2.0, &fast, down)[0] - (-1.2 - 0.2 + 0.3)).abs() < 1e-12);
        let slow = world(0.5, &still, down)[3];
        assert!((slow - 0.5).abs() < 1e-8, "{slow}");
    }
    // In flight the rotors are part of the legs.
    assert_eq!(ground(-2.0, &fast, true), world(-2.0, &fast, true));
    assert_eq!(ground(-2.0, &fast, false), world(-2.0, &still, false));
}

/// A leg of point masses: in the plane of the leg at the hip, on the thigh and on the calf.
const POINTS: [(f64, f64); 3] = [(0.5, 0.0), (0.9, 0.11), (0.3, 0.15)];

/// Torques of a leg by d'Alembert's principle: weight and inertial force of each mass, times the derivative of its
/// position by each joint. Positions along a motion are differentiated by differences.
fn torques_of_points(
    robot: &Robot,
    leg: Leg,
    motion: impl Fn(f64) -> [f64; STATE_DIM],
) -> [f64; 3] {
    let geometry = robot.geometry(leg);
    let links = geometry.links();
    let (first, h) = (3 * leg.index(), 1e-4);
    let part = |link: Vector3<f64>, length: f64| link * (length / link.norm());
    let place = |x: &[f64; STATE_DIM], number: usize| {
        let none = Vector3::zeros();
        let [thigh, calf] = match number {
            0 => [none, none],
            1 => [part(links.thigh, POINTS[1].1), none],
            _ => [links.thigh, part(links.calf, POINTS[2].1)],
        };
        let axes = [links.abduction, links.flexion, links.flexion].map(Into::into);
        let point = LegGeometry::new(axes, [links.hip, thigh, calf].map(Into::into));
        let knee = geometry.shape.knee * x[first + 2];
        let in_trunk =
            robot.hip_position(leg) + point.foot_position(&[x[first], x[first + 1], knee]);
        Vector3::new(x[12], x[13], x[14]) + rotation([x[15], x[16], x[17]]) * in_trunk
    };
    let now = motion(0.0);
    let of_joint = |joint: usize| {
        let each = POINTS.iter().enumerate().map(|(number, (mass, _))| {
            let at = |time: f64| place(&motion(time), number);
            let mut acceleration = (at(h) - at(0.0) * 2.0 + at(-h)) / (h * h);
            acceleration.z += 9.81;
            let moved = |by: f64| {
                let mut x = now;
                x[first + joint] += by;
                place(&x, number)
            };
            mass * acceleration.dot(&((moved(h) - moved(-h)) / (2.0 * h)))
        });
        each.sum()
    };
    [0, 1, 2].map(of_joint)
}

#[test]
fn legs_need_the_torques_that_their_masses_do() {
    let mut checked = 0;
    for name in romc::robot_file::known_names() {
        let robot = romc::robot_file::by_name(name).unwrap();
        let amplitude = |k: usize| 0.3 + 0.05 * k as f64;
        let motion = |time: f64| {
            std::array::from_fn(|k| {
                let rest = if k % 3 == 2 { -1.5 } else { 0.4 };
                rest + amplitude(k) * (5.0 * time + k as f64).sin()
            })
        };
        let wave = |k: usize| (k as f64).sin_cos();
        let dx = std::array::from_fn(|k| amplitude(k) * 5.0 * wave(k).1);
        let ddx = std::array::from_fn(|k| -amplitude(k) * 25.0 * wave(k).0);
        for leg in Leg::ALL {
            let links = robot.geometry(leg).links();
            let [(hip, _), (thigh, at_thigh), (calf, at_calf)] = POINTS;
            let length = links.thigh.norm();
            let moments = LegMoments {
                side_kg_m: (hip + thigh + calf) * links.hip.norm(),
                thigh_kg_m: thigh * at_thigh + calf * length,
                calf_kg_m: calf * at_calf,
                thigh_kg_m2: thigh * at_thigh * at_thigh + calf * length * length,
                calf_kg_m2: calf * at_calf * at_calf,
            };
            let mut actuators = Actuators::of_leg([0.0; 3], [0.0; 3], [0.0; 3]);
            actuators.legs = Some(moments);
            let rule = InputRule::new(robot, Some(actuators.clone()), WrenchFrame::Ground);
            let mut feet = [false; 4];
            assert_eq!(rule.leg_torques([&motion(0.0), &dx, &ddx], feet), [0.0; 12]);
            feet[leg.index()] = true;
            let found = rule.leg_torques([&motion(0.0), &dx, &ddx], feet);
            assert_eq!(rule.losses([&motion(0.0), &dx, &ddx], feet), found);
            let expected = torques_of_points(robot, leg, motion);
            for (joint, torque) in found.iter().enumerate() {
                let expected = match joint.checked_sub(3 * leg.index()) {
                    Some(own @ 0..3) => expected[own],
                    _ => 0.0,
                };
                assert!(
                    (torque - expected).abs() < 1e-4,
                    "{name} {leg:?} {joint}: {torque} {expected}"
                );
                checked += usize::from(expected.abs() > 0.2);
            }
            let world = InputRule::new(robot, Some(actuators), WrenchFrame::World);
            assert_eq!(
                world.leg_torques([&motion(0.0), &dx, &ddx], feet),
                [0.0; 12]
            );
        }
    }
    assert!(checked > 30, "{checked}");
}

#[test]
fn feet_that_would_pull_add_nothing_by_the_rule_of_the_ground() {
    let rule = |frame| InputRule::new(go1(), None, frame);
    let [world, ground] = [rule(WrenchFrame::World), rule(WrenchFrame::Ground)];
    let mut x = state();
    x[15..].fill(0.0);
    let alone = |leg: Leg| std::array::from_fn(|k| k == leg.index());
    let mut tau = torques();
    let mut pulling = [false; 4];
    for (leg, down) in Leg::ALL.into_iter().zip(&mut pulling) {
        *down = world.wrench(&x, &tau, alone(leg)).unwrap()[2] < 0.0;
    }
    // Opposite torques turn a pushing leg into a pulling one.
    let pushing = Leg::ALL
        .into_iter()
        .find(|leg| !pulling[leg.index()])
        .expect("one pushes");
    for torque in &mut tau[3 * pushing.index()..][..3] {
        *torque = -*torque;
    }
    pulling[pushing.index()] = true;
    let push = pulling.map(|pulls| !pulls);
    let expected = world.wrench(&x, &tau, push).unwrap();
    assert_eq!(ground.input_wrench(&x, &tau, [true; 4]).unwrap(), expected);
    let all = world.wrench(&x, &tau, [true; 4]).unwrap();
    assert_eq!(world.input_wrench(&x, &tau, [true; 4]).unwrap(), all);
    assert!((all - expected).norm() > 1.0);
    // Changes of torques have a linear effect, whichever feet push.
    assert_eq!(ground.wrench(&x, &tau, [true; 4]).unwrap(), all);
}

/// A leg of the usual shape, with its hip to one side and its foot in front of the calf.
fn usual(hip_m: f64, forward_m: f64) -> LegGeometry {
    let [x, y] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let links = [
        [0.0, hip_m, 0.0],
        [0.0, 0.0, -0.213],
        [forward_m, 0.0, -0.21],
    ];
    LegGeometry::new([x, y, y], links)
}

fn postures() -> Vec<[f64; 3]> {
    let mut out = Vec::new();
    for hx in [-0.8, -0.1, 0.0, 0.6] {
        for hy in [-0.6, 0.3, 1.2, 3.0] {
            for kn in [-2.7, -1.5, -0.9] {
                out.push([hx, hy, kn]);
            }
        }
    }
    out
}

/// Tilted axes, the last two parallel, of the same or of opposite directions, links in all directions.
fn odd(knee: f64) -> LegGeometry {
    let bend = Vector3::new(0.1, -0.9, 0.3).normalize();
    let axes = [
        Vector3::new(0.8, 0.1, -0.4).normalize().into(),
        bend.into(),
        (knee * bend).into(),
    ];
    LegGeometry::new(
        axes,
        [[0.06, 0.09, -0.01], [0.02, 0.1, -0.28], [0.08, 0.01, -0.3]],
    )
}

fn legs() -> [LegGeometry; 5] {
    [
        usual(0.08, 0.0),
        usual(-0.08, 0.0),
        usual(0.08, -0.03),
        odd(1.0),
        odd(-1.0),
    ]
}

#[test]
fn foot_and_jacobian_are_those_of_turns_about_one_axis_after_the_other() {
    for (leg, q) in legs()
        .iter()
        .flat_map(|leg| postures().into_iter().map(move |q| (leg, q)))
    {
        let (mut foot, mut turned) = (Vector3::zeros(), Rotation3::identity());
        let mut joints = Vec::new();
        for ((axis, link), angle) in leg.axes.iter().zip(&leg.links).zip(q) {
            let axis = Vector3::from(*axis);
            joints.push((turned * axis, foot));
            turned *= Rotation3::from_axis_angle(&Unit::new_normalize(axis), angle);
            foot += turned * Vector3::from(*link);
        }
        let columns: Vec<_> = (joints.iter())
            .map(|(axis, joint)| axis.cross(&(foot - joint)))
            .collect();
        assert!((leg.foot_position(&q) - foot).norm() < 1e-14, "{q:?}");
        let jacobian = Matrix3::from_columns(&columns);
        assert!((leg.foot_jacobian(&q) - jacobian).norm() < 1e-14, "{q:?}");
    }
}

#[test]
fn damping_begins_where_the_exact_inverse_ends() {
    for leg in legs() {
        let exact = |q: &[f64; 3]| -leg.foot_jacobian(q).transpose().try_inverse().unwrap();
        // From bent to stretched: the first damped posture is almost undamped.
        let mut last = None;
        for k in 0..4000 {
            let q = [
                0.2,
                0.3,
                leg.shape.knee * (-1.5 + 1.5 * f64::from(k) / 4000.0),
            ];
            let map = leg.force_map(&q, false).unwrap();
            match leg.spans(&q)[0] >= 0.3 && leg.spans(&q)[1] >= 0.12 {
                true => assert_eq!(map, exact(&q)),
                false => {
                    last = Some((map - exact(&q)).norm() / map.norm());
                    break;
                }
            }
        }
        assert!(last.is_some_and(|change| change < 0.02), "{last:?}");
    }
}

#[test]
fn manipulability_is_the_normalised_determinant() {
    for leg in legs() {
        for q in postures() {
            let expected = leg.foot_jacobian(&q).determinant().abs() / leg.shape.volume;
            assert!((leg.manipulability(&q) - expected).abs() < 1e-13, "{q:?}");
        }
    }
}

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
            .geometry(leg)
            .foot_position(&q);
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

fn go1() -> &'static Robot {
    romc::robot_file::by_name("go1").unwrap()
}

fn stand() -> [f64; JOINT_DIM] {
    std::array::from_fn(|i| [0.05, 0.7, -1.3][i % 3] + 0.01 * i as f64)
}

fn torques() -> [f64; JOINT_DIM] {
    std::array::from_fn(|i| 3.0 - 0.7 * i as f64 + 0.2 * (i * i) as f64)
}

#[test]
fn foot_force_of_a_leg_beyond_the_singular_bound_is_an_error_with_leg_and_angles() {
    let force = |knee: f64| go1().foot_force_map(Leg::RearLeft, &[0.0, 0.2, knee]);
    for knee in [0.0, -1e-4] {
        let Err(RobotError::SingularLeg {
            leg, joints_rad, ..
        }) = force(knee)
        else {
            panic!("{knee}: {:?}", force(knee));
        };
        assert_eq!((leg, joints_rad), (Leg::RearLeft, [0.0, 0.2, knee]));
    }
    let text = force(0.0).unwrap_err().to_string();
    assert!(text.contains("go1: leg rl is singular"), "{text}");
    assert!(text.contains("kn 0.0000"), "{text}");
    assert!(force(-2e-2).is_ok());
}

#[test]
fn foot_force_not_finite_argument_is_an_error() {
    let (q, nan) = ([0.0, 0.7, -1.4], f64::NAN);
    for (q, tau, said) in [
        (q, [0.0, nan, 0.0], "leg fr has the torque NaN"),
        ([f64::INFINITY, 0.7, -1.4], [0.0; 3], "joint angle inf"),
    ] {
        let x = std::array::from_fn(|i| if i < 3 { q[i] } else { 0.0 });
        let torques = std::array::from_fn(|i| if i < 3 { tau[i] } else { 0.0 });
        let down = [true, false, false, false];
        let error = InputRule::published(go1())
            .wrench(&x, &torques, down)
            .unwrap_err();
        assert!(error.to_string().contains(said), "{error}");
    }
}

#[test]
fn body_wrench_without_contact_is_zero_even_at_a_singular_posture() {
    let wrench = InputRule::published(go1())
        .wrench(&[0.0; 18], &torques(), [false; 4])
        .unwrap();
    assert_eq!(wrench, Vector6::zeros());
    for frame in WrenchFrame::ALL {
        let rule = InputRule::new(go1(), None, frame);
        let map = rule.wrench_map(&[0.0; 12], [0.0; 3], [false; 4]).unwrap();
        assert!(map.iter().all(|entry| *entry == 0.0));
    }
}

#[test]
fn damped_force_map_is_the_exact_one_away_from_singularities() {
    for leg in Leg::ALL {
        for q in [[0.1, 0.8, -1.6], [-0.3, 1.2, -2.4], [0.0, 0.3, -0.4]] {
            let exact = go1().foot_force_map(leg, &q).unwrap();
            assert_eq!(go1().damped_force_map(leg, &q).unwrap(), exact);
        }
    }
}

#[test]
fn damped_force_map_is_continuous_and_bounded_through_both_singularities() {
    // To a stretched knee, and a folded leg that swings its foot past the hip's height.
    let stretch = |t: f64| [0.1, 0.5, -0.6 * (1.0 - t)];
    let swing = |t: f64| [0.1, 1.6 + 1.6 * t, -2.6];
    let paths: [&dyn Fn(f64) -> [f64; 3]; 2] = [&stretch, &swing];
    let geometry = go1().geometry(Leg::RearLeft);
    for (path, singular) in paths.into_iter().zip([0, 1]) {
        let mut nearest = f64::INFINITY;
        let mut before = go1().damped_force_map(Leg::RearLeft, &path(0.0)).unwrap();
        for k in 1..=4000 {
            let q = path(f64::from(k) / 4000.0);
            let map = go1().damped_force_map(Leg::RearLeft, &q).unwrap();
            assert!((map - before).norm() < 0.2, "{q:?}: {map} {before}");
            // 30 N m of each joint: about 1 kN along a stretched leg, and no more anywhere.
            assert!((map * Vector3::repeat(30.0)).norm() < 1500.0, "{q:?}");
            nearest = nearest.min(geometry.spans(&q)[singular]);
            before = map;
        }
        assert!(nearest < 1e-3, "the path passes the singularity: {nearest}");
    }
}

#[test]
fn body_wrench_moment_is_arm_cross_force() {
    let contact = [false, true, false, false];
    let mut x = [0.0; STATE_DIM];
    x[..JOINT_DIM].copy_from_slice(&stand());
    let wrench = InputRule::published(go1())
        .wrench(&x, &torques(), contact)
        .unwrap();
    let q = Leg::FrontLeft.of_joints(&stand());
    let arm = go1().geometry(Leg::FrontLeft).foot_position(&q);
    let force = Vector3::new(wrench[0], wrench[1], wrench[2]);
    let moment = Vector3::new(wrench[3], wrench[4], wrench[5]);
    assert!((moment - arm.cross(&force)).norm() < 1e-12 * moment.norm());
    assert!(moment.norm() > 1.0);
}

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
                    let map = rule.robot().foot_force_map(leg, &q).unwrap();
                    (leg, turn * map * Vector3::from(tau))
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
    // The lever arms differ: about the body's origin a front foot that pushes up pitches the body back.
    assert!((world - body).rows(3, 3).norm() > 1.0);
}

#[test]
fn names_of_frames_are_read_back() {
    for frame in WrenchFrame::ALL {
        assert_eq!(frame.name().parse(), Ok(frame));
    }
    assert_eq!("World".parse::<WrenchFrame>(), Err(()));
}
