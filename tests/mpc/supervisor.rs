//! Faults along recordings: each ends in a status of the supervisor in time, and in damping; right recordings in none.

use std::path::Path;

use romc::mpc::{
    AfterEnd, Bounds, Command, Controller, Drives, Measurement, MpcSettings, ReferenceSamples,
    Source, Status,
};
use romc::recording::Segment;
use romc::robot::ContactFlags;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

const NOW_S: f64 = 0.2;

fn segment(name: &str) -> Segment {
    let path = root().join("examples/recordings").join(name);
    let recording = romc::recording::read(&path).expect("a sound recording");
    recording.segments.into_iter().next().expect("a jump")
}

fn following(segment: &Segment, settings: MpcSettings) -> Controller {
    let path = root().join("models/go1-d7.json");
    let model = romc::artifact::read(&path).expect("a sound model");
    let mut controller = romc::mpc::controller(&model, settings).expect("a complete model");
    follow(&mut controller, segment);
    controller
}

fn follow(controller: &mut Controller, segment: &Segment) {
    let input = segment
        .input(controller.plant().input_rule())
        .expect("inputs");
    let samples = ReferenceSamples {
        time_s: &segment.time_s,
        x: segment.x.as_slice(),
        dx: segment.dx.as_slice(),
        u: Some(input.as_slice()),
        feet: &segment.feet,
    };
    controller.set_reference(samples).expect("sound");
    controller.reset();
}

/// A measurement that a fault may change: time, state, velocity, feet.
struct Seen {
    time_s: f64,
    x: [f64; 18],
    dx: [f64; 18],
    feet: ContactFlags,
}

fn measured(segment: &Segment, sample: usize) -> Seen {
    let row = |of: &nalgebra::DMatrix<f64>| std::array::from_fn(|i| of[(i, sample)]);
    Seen {
        time_s: segment.time_s[sample],
        x: row(&segment.x),
        dx: row(&segment.dx),
        feet: segment.feet[sample],
    }
}

fn stepped(controller: &mut Controller, seen: &Seen) -> Command {
    controller.step(Measurement {
        time_s: seen.time_s,
        x: &seen.x,
        dx: &seen.dx,
        feet: seen.feet,
    })
}

type Change = fn(&mut Seen, &Segment, f64);

/// Faults from [`NOW_S`] on, with the statuses that may follow.
const FAULTS: &[(&str, Change, &[Status])] = &[
    (
        "on its back",
        |seen, _, _| seen.x[15] = 3.1,
        &[Status::Tilt],
    ),
    (
        "rolls over",
        |seen, _, passed| seen.x[15] += 8.0 * passed,
        &[Status::Tilt],
    ),
    (
        "body aside",
        |seen, _, _| seen.x[13] += 5.0,
        &[Status::BodyFar],
    ),
    (
        "thigh and calf exchanged",
        |seen, _, _| seen.x.swap(1, 2),
        &[Status::JointBeyond],
    ),
    (
        "signs of joints",
        |seen, _, _| (0..12).for_each(|joint| seen.x[joint] *= -1.0),
        &[Status::JointBeyond],
    ),
    (
        "encoder slips",
        |seen, _, _| seen.x[4] += 0.6,
        &[Status::JointsLeap, Status::JointsFar],
    ),
    (
        "rate of a joint",
        |seen, _, _| seen.dx[7] = 80.0,
        &[Status::JointSpeed],
    ),
    (
        "clock stands",
        |seen, _, _| seen.time_s = NOW_S,
        &[Status::ClockStands],
    ),
    (
        "clock runs back",
        |seen, _, passed| seen.time_s -= 2.0 * passed,
        &[Status::ClockBack],
    ),
    (
        "clock set back",
        |seen, _, _| seen.time_s -= 0.3,
        &[Status::ClockBack],
    ),
    (
        "clock set ahead",
        |seen, _, _| seen.time_s += 0.3,
        &[Status::ClockLeaps],
    ),
    (
        "measurement frozen",
        |seen, segment, _| {
            let first = segment.time_s.partition_point(|&time_s| time_s < NOW_S);
            let frozen = measured(segment, first);
            (seen.x, seen.dx, seen.feet) = (frozen.x, frozen.dx, frozen.feet);
        },
        &[Status::Frozen],
    ),
    (
        "all zero",
        |seen, _, _| (seen.x, seen.dx) = ([0.0; 18], [0.0; 18]),
        &[Status::JointBeyond, Status::Frozen],
    ),
    (
        "not a number",
        |seen, _, _| seen.x[3] = f64::NAN,
        &[Status::PoorSteps],
    ),
    (
        "huge",
        |seen, _, _| seen.dx[14] = 1e200,
        &[Status::PoorSteps],
    ),
];

#[test]
fn each_fault_ends_in_its_status_and_in_damping_until_a_reset() {
    let jump = segment("go1/test_01.csv.gz");
    for &stride in &[5, 1] {
        for &(name, change, expected) in FAULTS {
            let mut controller = following(&jump, MpcSettings::default());
            let mut found = None;
            for sample in (0..jump.len()).step_by(stride) {
                let mut seen = measured(&jump, sample);
                let (recorded_s, velocity) = (seen.time_s, seen.dx);
                let passed_s = recorded_s - NOW_S;
                if passed_s >= 0.0 {
                    change(&mut seen, &jump, passed_s);
                }
                let command = stepped(&mut controller, &seen);
                let is_supervised = command.status.code() >= Status::Tilt.code();
                assert!(
                    !(is_supervised && passed_s < 0.0),
                    "{name}: {:?}",
                    command.status
                );
                if is_supervised && found.is_none() {
                    found = Some((command.status, recorded_s));
                }
                let Some((status, since_s)) = found else {
                    continue;
                };
                assert_eq!(
                    (command.status, command.source),
                    (status, Source::Damping),
                    "{name}"
                );
                if recorded_s - since_s < 0.3 {
                    continue;
                }
                assert!(
                    command.drives.stiffness_nm_rad == 0.0,
                    "{name}: {:?}",
                    command.drives
                );
                for joint in 0..12 {
                    let damped = match seen.x.iter().chain(&seen.dx).all(|v| v.abs() <= 1e6) {
                        true if status != Status::Frozen => -seen.dx[joint],
                        _ => 0.0,
                    };
                    let off = command.torque_nm[joint] - damped.clamp(-10.0, 10.0);
                    assert!(off.abs() < 1e-9, "{name}: {off} N m, {}", velocity[joint]);
                }
            }
            let (status, since_s) = found.unwrap_or_else(|| panic!("{name}: no status"));
            assert!(expected.contains(&status), "{name}: {status:?}");
            assert!(since_s - NOW_S <= 0.12 + 1e-9, "{name}: {since_s}");
            let again = measured(&jump, jump.len() - 1);
            assert_eq!(stepped(&mut controller, &again).status, status, "{name}");
            controller.reset();
            assert!(stepped(&mut controller, &again).status.has_plan(), "{name}");
        }
    }
}

/// Right recordings are far from every bound: none is a fault or refused at 60 % of the bounds, and at other rates of control.
#[test]
fn no_right_recording_is_a_fault() {
    let usual = MpcSettings::default().bounds;
    let tight = Bounds {
        tilt_rad: 0.6 * usual.tilt_rad,
        joint_velocity: 0.6 * usual.joint_velocity,
        distance_m: 0.6 * usual.distance_m,
        posture_rad: 0.6 * usual.posture_rad,
        clock_gap_s: 0.6 * usual.clock_gap_s,
        velocity_mismatch: 0.6 * usual.velocity_mismatch,
        ..usual
    };
    let sets = [
        ("go1-d7", "examples/recordings/go1"),
        ("go1-d7", "examples/recordings/go1-noisy"),
        ("go1-d7", "examples/recordings/go1-other"),
        ("go2-async-d4", "examples/recordings/go2-asynchronous"),
    ];
    let mut steps = 0;
    for (model, folder) in sets {
        let path = root().join("models").join(format!("{model}.json"));
        let model = romc::artifact::read(&path).expect("a sound model");
        for (bounds, step_s) in [(tight, 0.01), (usual, 0.002), (usual, 0.05)] {
            let settings = MpcSettings {
                solver: romc::mpc::Solver::Riccati,
                step_s,
                bounds,
                ..Default::default()
            };
            let mut controller = romc::mpc::controller(&model, settings).expect("complete");
            for entry in std::fs::read_dir(root().join(folder)).expect("a folder") {
                let path = entry.expect("a file").path();
                if path.extension().is_none_or(|ending| ending != "gz") {
                    continue;
                }
                let recording = romc::recording::read(&path).expect("a sound recording");
                for segment in &recording.segments {
                    follow(&mut controller, segment);
                    let stride = (step_s / segment.mean_step_s()).round().max(1.0) as usize;
                    for sample in (0..segment.len()).step_by(stride) {
                        let status = stepped(&mut controller, &measured(segment, sample)).status;
                        assert!(
                            status.code() < Status::MeasurementJump.code(),
                            "{path:?} {sample}: {status:?}"
                        );
                        steps += 1;
                    }
                }
            }
        }
    }
    assert!(steps > 30_000, "{steps}");
}

#[test]
fn single_glitch_is_refused_and_is_no_fault() {
    let jump = segment("go1/test_01.csv.gz");
    let mut controller = following(&jump, MpcSettings::default());
    for sample in (0..jump.len()).step_by(5) {
        let mut seen = measured(&jump, sample);
        let is_glitch = sample == 100;
        if is_glitch {
            seen.x[15] = 2.0;
            seen.x[12] += 1.0;
        }
        let status = stepped(&mut controller, &seen).status;
        let expected = if is_glitch {
            Status::MeasurementJump
        } else {
            Status::Solved
        };
        assert_eq!(status, expected, "sample {sample}");
    }
}

#[test]
fn first_measurement_is_expected_at_the_start() {
    let jump = segment("go1/test_01.csv.gz");
    for (coordinate, off) in [(12, 0.5), (4, 0.9), (14, -0.4)] {
        let mut controller = following(&jump, MpcSettings::default());
        let mut seen = measured(&jump, 0);
        seen.x[coordinate] += off;
        assert_eq!(stepped(&mut controller, &seen).status, Status::NotAtStart);
    }
}

#[test]
fn end_of_the_reference_is_held_damped_or_stopped() {
    let jump = segment("go1/test_01.csv.gz");
    for after_end in [AfterEnd::Hold, AfterEnd::Damp, AfterEnd::Stop] {
        let settings = MpcSettings {
            after_end,
            ..Default::default()
        };
        let mut controller = following(&jump, settings);
        let mut command = None;
        for step in 0..jump.len() / 5 + 40 {
            let mut seen = measured(&jump, (5 * step).min(jump.len() - 1));
            seen.time_s = jump.time_s[0] + 0.01 * step as f64;
            seen.dx[2] += 0.5 + 0.01 * (step % 2) as f64; // a robot is never still
            command = Some(stepped(&mut controller, &seen));
        }
        let command = command.expect("steps");
        match after_end {
            AfterEnd::Hold => assert!(command.status.has_plan(), "{:?}", command.status),
            AfterEnd::Damp => {
                assert_eq!(command.status, Status::Ended);
                assert!(command.torque_nm[2] < -0.4, "{:?}", command.torque_nm);
            }
            AfterEnd::Stop => {
                assert_eq!(command.torque_nm, [0.0; 12]);
                let none = Drives {
                    stiffness_nm_rad: 0.0,
                    damping_nm_s_rad: 0.0,
                };
                assert_eq!(command.drives, none);
            }
        }
    }
}
