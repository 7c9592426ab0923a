use super::*;
use nalgebra::DMatrix;

fn go1() -> &'static Robot {
    Robot::by_name("go1").unwrap()
}

/// A smooth motion whose rates are exact.
fn smooth(n: usize) -> Recording {
    let time_s: Vec<f64> = (0..n).map(|j| 0.002 * j as f64).collect();
    let centre = |i: usize| {
        if i < JOINT_DIM {
            [0.0, 0.8, -1.6][i % 3]
        } else {
            0.2
        }
    };
    let wave = |j: usize, derivative: u32| {
        let omega = 9.0_f64;
        let phase = omega * time_s[j] + f64::from(derivative) * std::f64::consts::FRAC_PI_2;
        0.2 * omega.powi(derivative as i32) * phase.sin()
    };
    Recording::from(Segment {
        x: DMatrix::from_fn(STATE_DIM, n, |i, j| centre(i) + wave(j, 0)),
        dx: DMatrix::from_fn(STATE_DIM, n, |_, j| wave(j, 1)),
        ddx: DMatrix::from_fn(STATE_DIM, n, |_, j| wave(j, 2)),
        torque_nm: DMatrix::from_element(JOINT_DIM, n, 10.0),
        ..Segment::still("wave.csv", time_s.clone())
    })
}

/// What is found in the smooth motion after a change.
fn found_after(n: usize, change: impl FnOnce(&mut Segment)) -> Vec<Finding> {
    let mut recording = smooth(n);
    change(&mut recording.segments[0]);
    findings(&recording)
}

fn findings(recording: &Recording) -> Vec<Finding> {
    check(recording, go1())
}

#[test]
fn check_huge_torques_are_one_finding_with_worst_row_and_bound() {
    let found = found_after(100, |segment| {
        for (sample, torque) in [(40, 50.0), (41, -1e5), (42, 60.0)] {
            segment.torque_nm[(2, sample)] = torque;
        }
    });
    assert_eq!(found.len(), 1, "{found:?}");
    let finding = &found[0];
    assert_eq!(finding.kind, Implausible::Torque);
    assert_eq!((finding.first_row, finding.worst_row), (42, 43));
    assert_eq!((finding.samples.clone(), finding.value), (40..43, -1e5));
    assert!((finding.bound + 35.55 * 1.1).abs() < 1e-12);
    assert_eq!(
        finding.to_string(),
        "row 42 and 2 more, column `fr.kn Torque`: torque above the joint's limit: \
         -100000.000000 against -39.105000 at row 43"
    );
}

#[test]
fn check_joint_outside_its_limits_is_found() {
    let found = found_after(100, |segment| {
        segment.x.row_mut(5).fill(-0.7);
        segment.dx.row_mut(5).fill(0.0);
        segment.ddx.row_mut(5).fill(0.0);
    });
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].kind, Implausible::JointAngle);
    assert_eq!(found[0].column, "fl.kn Position");
    assert_eq!(found[0].samples, 0..100);
    assert!((found[0].bound - (-0.888 + 0.05)).abs() < 1e-12);
}

#[test]
fn check_jump_of_a_position_is_found_at_its_row() {
    let found = found_after(100, |s| (60..100).for_each(|j| s.x[(17, j)] -= 6.0));
    let jump = found.iter().find(|f| f.kind == Implausible::Jump).unwrap();
    assert_eq!((jump.first_row, jump.samples.len()), (62, 1));
    assert_eq!(jump.column, "Body angular Position z");
    assert!(jump.value < -2900.0);
}

#[test]
fn check_rates_that_disagree_with_differences_are_found() {
    let found = found_after(100, |segment| segment.dx.row_mut(14).scale_mut(2.0));
    let kinds: Vec<_> = found.iter().map(|f| f.kind).collect();
    assert!(kinds.contains(&Implausible::Velocity), "{kinds:?}");
    let found = found_after(100, |segment| segment.ddx[(3, 50)] = 4000.0);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].kind, Implausible::Acceleration);
    assert_eq!((found[0].first_row, found[0].value), (52, 4000.0));
}

#[test]
fn check_speed_above_the_joints_limit_is_found() {
    let found = found_after(100, |segment| segment.dx[(2, 10)] = -25.0);
    let speed = found.iter().find(|f| f.kind == Implausible::Speed).unwrap();
    assert_eq!((speed.value, speed.first_row), (-25.0, 12));
    assert!((speed.bound + 20.06 * 1.1).abs() < 1e-12);
}

#[test]
fn check_clipped_velocity_is_found() {
    let clipped = |least: f64| {
        let found = found_after(400, |segment| {
            let mut row = segment.dx.row_mut(16);
            row.apply(|rate| *rate = rate.clamp(least, 1.6));
            row[399] = 1.6;
        });
        let of_clips = found.into_iter().find(|f| f.kind == Implausible::Clipped);
        of_clips.map(|clipped| clipped.value.abs())
    };
    assert_eq!(clipped(-2.0), None, "1.6 is not the extreme");
    assert_eq!(clipped(-1.6), Some(1.6));
}

#[test]
fn check_sideways_velocity_may_stay_at_its_extreme_in_flight_alone() {
    let mut recording = smooth(400);
    let segment = &mut recording.segments[0];
    (100..110).for_each(|j| segment.dx[(13, j)] = 5.0);
    let clips = |recording: &Recording| {
        let found = findings(recording);
        found.iter().any(|f| f.kind == Implausible::Clipped)
    };
    assert!(clips(&recording));
    recording.segments[0].feet[95..115].fill([false; 4]);
    assert!(!clips(&recording));
    let segment = &mut recording.segments[0];
    (100..110).for_each(|j| segment.dx[(14, j)] = 5.0);
    assert!(clips(&recording));
}

#[test]
fn check_lost_sample_is_found_as_a_time_step() {
    let found = found_after(100, |segment| {
        segment.time_s[70..]
            .iter_mut()
            .for_each(|time| *time += 0.002);
    });
    assert_eq!(found[0].kind, Implausible::TimeStep);
    assert_eq!(found[0].first_row, 72);
    assert!((found[0].value - 0.004).abs() < 1e-12 && (found[0].bound - 0.002).abs() < 1e-12);
}

#[test]
fn without_divides_segments_and_counts_what_it_left_out() {
    let mut recording = smooth(100);
    recording.segments[0].torque_nm[(0, 30)] = 1e5;
    recording.segments[0].torque_nm[(7, 32)] = 1e5;
    let found = findings(&recording);
    let (rest, dropped) = without(&recording, &found).unwrap();
    // Sample 31 stands alone between the two and goes as well.
    assert_eq!(dropped, 3);
    let lengths: Vec<_> = rest.segments.iter().map(Segment::len).collect();
    assert_eq!(lengths, [30, 67]);
    assert_eq!(rest.segments[1].first_row, 35);
    assert_eq!(findings(&rest), []);
}

#[test]
fn without_nothing_left_is_an_error() {
    let mut recording = smooth(10);
    recording.segments[0].torque_nm.fill(1e5);
    let found = findings(&recording);
    let error = without(&recording, &found).unwrap_err();
    assert!(matches!(
        error.kind,
        RecordingFault::TooShort { found: 0, .. }
    ));
    assert_eq!(error.place.row(), Some(2));
}

#[test]
fn check_sensor_noise_is_accepted_but_a_spike_in_it_is_found() {
    let mut recording = smooth(400);
    // A fixed sequence without pattern stands for noise of 0.5 mm.
    let mut state = 1_u64;
    for value in recording.segments[0].x.iter_mut() {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        *value += 1e-3 * ((state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5);
    }
    assert_eq!(findings(&recording), []);
    recording.segments[0].dx[(13, 200)] = 9.0;
    let found = findings(&recording);
    assert!(!found.is_empty() && found.iter().all(|f| f.column == "Body linear Velocity y"));
    assert!(
        found
            .iter()
            .any(|f| (f.kind, f.first_row) == (Implausible::Velocity, 202))
    );
}
