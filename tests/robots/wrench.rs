//! The wrench of the ground on the body.

use nalgebra::{Vector3, Vector6};
use romc::robot::*;

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
    let force = |knee: f64| go1().foot_force(Leg::RearLeft, &[0.0, 0.2, knee], &[1.0; 3]);
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
        let error = go1().foot_force(Leg::FrontRight, &q, &tau).unwrap_err();
        assert!(error.to_string().contains(said), "{error}");
    }
}

#[test]
fn body_wrench_without_contact_is_zero_even_at_a_singular_posture() {
    let wrench = go1()
        .body_wrench(&[0.0; 12], &torques(), [false; 4])
        .unwrap();
    assert_eq!(wrench, Vector6::zeros());
    for frame in WrenchFrame::ALL {
        let map = go1().map_by_arms(frame, &[0.0; 12], [false; 4]).unwrap();
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
    // Down to a stretched knee, and a folded leg that swings its foot past the hip's height.
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
            // 30 N m of each joint: some 1 kN along a stretched leg, not more anywhere.
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
    let wrench = go1().body_wrench(&stand(), &torques(), contact).unwrap();
    let q = Leg::FrontLeft.of_joints(&stand());
    let arm = go1().foot_position(Leg::FrontLeft, &q);
    let force = Vector3::new(wrench[0], wrench[1], wrench[2]);
    let moment = Vector3::new(wrench[3], wrench[4], wrench[5]);
    assert!((moment - arm.cross(&force)).norm() < 1e-12 * moment.norm());
    assert!(moment.norm() > 1.0);
}
