//! Legs in flight: turned against a pitch error, limited by a share of the torques.

use crate::synthetic::unwatched;
use std::path::PathBuf;

use nalgebra::{Rotation3, Vector3};
use romc::artifact;
use romc::model::ReducedModel;
use romc::mpc::{Command, Measurement, MpcSettings, ReferenceSamples};
use romc::recording::Segment;
use romc::robot::Leg;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn shipped() -> ReducedModel {
    artifact::read(&root().join("models/go1-d6.json")).expect("shipped")
}

fn jump() -> Segment {
    let path = root().join("examples/recordings/go1/test_01.csv.gz");
    let recording = romc::recording::read(&path).expect("a sound recording");
    recording.segments.into_iter().next().expect("a segment")
}

/// The command at a sample of a jump for a body that has turned `error_rad` too far forwards.
fn command(swing_turn: f64, sample: usize, error_rad: f64) -> Command {
    let settings = MpcSettings {
        swing_turn,
        ..unwatched()
    };
    command_with(settings, sample, error_rad)
}

fn command_with(settings: MpcSettings, sample: usize, error_rad: f64) -> Command {
    let (model, segment) = (shipped(), jump());
    let mut controller = romc::mpc::controller(&model, settings).expect("a complete model");
    let reference = ReferenceSamples {
        time_s: &segment.time_s,
        x: segment.x.as_slice(),
        dx: segment.dx.as_slice(),
        u: None,
        feet: &segment.feet,
    };
    controller.set_reference(reference).expect("sound");
    let mut x: Vec<f64> = segment.x.column(sample).iter().copied().collect();
    x[16] += error_rad;
    let dx: Vec<f64> = segment.dx.column(sample).iter().copied().collect();
    controller.step(Measurement {
        time_s: segment.time_s[sample],
        x: &x,
        dx: &dx,
        feet: segment.feet[sample],
    })
}

fn in_flight(segment: &Segment) -> usize {
    let flight: Vec<usize> = (0..segment.len())
        .filter(|&sample| segment.feet[sample] == [false; 4])
        .collect();
    flight[flight.len() / 2]
}

/// Feet from the body's origin, in axes that have turned by a pitch.
fn feet(command: &Command, pitch_rad: f64) -> Vec<Vector3<f64>> {
    let robot = romc::robot_file::by_name("go1").expect("known robot");
    let turned = Rotation3::from_euler_angles(0.0, pitch_rad, 0.0);
    let foot = |leg: Leg| {
        let q = leg.of_joints(&command.joint_position_rad);
        turned * (robot.hip_position(leg) + robot.geometry(leg).foot_position(&q))
    };
    Leg::ALL.into_iter().map(foot).collect()
}

#[test]
fn feet_in_flight_are_where_the_reference_has_them_from_the_ground() {
    let segment = jump();
    let sample = in_flight(&segment);
    // The posture is the reference's 0.9 of a stage later, with its pitch there.
    let later = (sample as f64 + 4.5) as usize;
    let drift = segment.x[(16, sample)] - segment.x[(16, later)];
    let right = command(0.0, sample, 0.0);
    for error in [-0.15, -0.05, 0.05, 0.15] {
        let total = error + drift;
        let turned = command(1.0, sample, error);
        let stiff = command(0.0, sample, error);
        assert_eq!(stiff.joint_position_rad, right.joint_position_rad);
        let wanted = feet(&right, 0.0);
        let off = |found: Vec<Vector3<f64>>| {
            let pairs = found.iter().zip(&wanted);
            pairs.fold(0.0_f64, |most, (a, b)| most.max((a - b).norm()))
        };
        let (without, with) = (off(feet(&stiff, total)), off(feet(&turned, total)));
        // First order: the remainder grows with the square of the angle.
        assert!(with < 0.5 * total * total + 1e-4, "{error}: {with}");
        assert!(without > 0.2 * total.abs(), "{error}: {without}");
    }
}

#[test]
fn feet_on_the_ground_are_left_alone() {
    for sample in [20, 100] {
        let [turned, stiff] = [1.0, 0.0].map(|swing_turn| command(swing_turn, sample, 0.1));
        assert_eq!(turned.joint_position_rad, stiff.joint_position_rad);
    }
}

#[test]
fn an_absurd_error_of_pitch_turns_no_leg_further_than_a_large_one() {
    let sample = in_flight(&jump());
    let [large, absurd] = [0.6, 3.0].map(|error| command(1.0, sample, error));
    assert_eq!(large.joint_position_rad, absurd.joint_position_rad);
}

#[test]
fn share_of_torques_acts_in_flight_alone() {
    for (sample, scale) in [(20, 1.0), (100, 1.0), (in_flight(&jump()), 0.3)] {
        let [whole, part] = [1.0, 0.3].map(|flight_torque| {
            let settings = MpcSettings {
                flight_torque,
                ..unwatched()
            };
            command_with(settings, sample, 0.0)
        });
        assert!(whole.torque_nm.iter().any(|torque| torque.abs() > 0.1));
        assert_eq!(part.torque_nm, whole.torque_nm.map(|torque| scale * torque));
        assert_eq!(part.losses_nm, whole.losses_nm.map(|loss| scale * loss));
        assert_eq!(part.joint_position_rad, whole.joint_position_rad);
        assert_eq!(part.u_lat, whole.u_lat);
    }
}

#[test]
fn share_of_torques_beyond_one_is_refused() {
    for flight_torque in [-0.1, 1.1, f64::NAN] {
        let settings = MpcSettings {
            flight_torque,
            ..unwatched()
        };
        let refused = romc::mpc::controller(&shipped(), settings).map(drop);
        let error = refused.expect_err("outside 0 to 1").to_string();
        assert!(error.contains("flight_torque"), "{error}");
    }
}
