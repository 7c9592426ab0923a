//! Faults of loggers and spreadsheets that `--clock repaired` corrects, each made on purpose.

use std::path::Path;

use nalgebra::DMatrix;
use romc::recording::mismatch::mismatches;
use romc::recording::{self, Clocks, Reader, Reading, Recording, Segment};

use crate::outside::beside;

fn go1() -> &'static romc::robot::Robot {
    romc::robot_file::by_name("go1").unwrap()
}

fn jump() -> Segment {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/recordings/go1/test_01.csv.gz");
    recording::read(&path).unwrap().segments.swap_remove(0)
}

/// A segment as it is read back from a file with repairs.
fn repaired(segment: Segment) -> Reading {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("jump.csv");
    recording::write(&path, &Recording::from(segment)).unwrap();
    let reader = Reader::new(None, Clocks::Repaired).for_robot(go1());
    reader.read(&path).unwrap()
}

fn says(reading: &Reading, words: &str) -> bool {
    reading.notes.iter().any(|note| note.contains(words))
}

fn error(a: &DMatrix<f64>, b: &DMatrix<f64>) -> f64 {
    (a - b).amax()
}

/// Legs that swing in the air for 0.2 s; knee angles cross -1 rad and rates cross 1 rad/s.
fn swing() -> Segment {
    let mut segment = Segment::still("swing", (0..101).map(|i| 0.002 * f64::from(i)).collect());
    segment.feet.fill([false; 4]);
    for i in 0..segment.len() {
        let t = segment.time_s[i];
        for joint in 0..12 {
            let (middle, phase) = ([0.02, 0.7, -1.1][joint % 3], 0.3 * joint as f64);
            let (size, speed) = ([0.02, 0.2, 0.35][joint % 3], 25.0);
            let angle = speed * t + phase;
            segment.x[(joint, i)] = middle + size * angle.sin();
            segment.dx[(joint, i)] = size * speed * angle.cos();
            segment.torque_nm[(joint, i)] = 1.5 * angle.sin();
        }
        segment.x[(14, i)] = 0.3 + 1.1 * t - 4.905 * t * t;
        segment.dx[(14, i)] = 1.1 - 9.81 * t;
        segment.x[(16, i)] = -t;
        segment.dx[(16, i)] = -1.0;
    }
    segment
}

/// A number divided by 1000, as read by a spreadsheet with points as thousands separators.
fn without_point(value: f64) -> f64 {
    let text = format!("{:.5e}", value.abs());
    let (digits, exponent) = text.split_once('e').unwrap();
    let digits = digits.trim_end_matches('0').trim_end_matches('.');
    let read = match exponent.parse::<i32>().unwrap() {
        ..-4 => digits.parse().unwrap(),
        -4..0 => return value,
        places => {
            let whole = format!("{:.*}", (5 - places) as usize, value.abs());
            let whole = whole.trim_end_matches('0').trim_end_matches('.');
            whole.replace('.', "").parse::<f64>().unwrap() / 1000.0
        }
    };
    if value < 0.0 { -read } else { read }
}

/// Values of the not-a-knot cubic spline through each row, at `rows` even places.
fn spline(samples: &DMatrix<f64>, rows: usize) -> DMatrix<f64> {
    let n = samples.ncols();
    let mut system = DMatrix::zeros(n, n);
    let mut side = DMatrix::zeros(n, samples.nrows());
    for i in 0..n {
        let (first, weights) = match i {
            0 => (0, [1.0, -2.0, 1.0]),
            i if i == n - 1 => (n - 3, [1.0, -2.0, 1.0]),
            i => (i - 1, [1.0, 4.0, 1.0]),
        };
        (0..3).for_each(|k| system[(i, first + k)] = weights[k]);
        if (1..n - 1).contains(&i) {
            let bend = samples.column(i - 1) - samples.column(i) * 2.0 + samples.column(i + 1);
            side.set_row(i, &(bend * 6.0).transpose());
        }
    }
    let second = system.lu().solve(&side).unwrap();
    DMatrix::from_fn(samples.nrows(), rows, |row, i| {
        let place = i as f64 * (n - 1) as f64 / (rows - 1) as f64;
        let left = (place as usize).min(n - 2);
        let b = place - left as f64;
        let a = 1.0 - b;
        a * samples[(row, left)]
            + b * samples[(row, left + 1)]
            + ((a.powi(3) - a) * second[(left, row)] + (b.powi(3) - b) * second[(left + 1, row)])
                / 6.0
    })
}

#[test]
fn lost_decimal_points_come_back_also_after_a_resampling() {
    let right = swing();
    let mut broken = right.clone();
    for matrix in [&mut broken.x, &mut broken.dx, &mut broken.torque_nm] {
        matrix.apply(|value| *value = without_point(*value));
    }
    let rows = 180;
    let end_s = right.duration_s();
    let even = |i: usize| end_s * i as f64 / (rows - 1) as f64;
    let mut resampled = Segment::still("resampled", (0..rows).map(even).collect());
    resampled.feet.fill([false; 4]);
    resampled.x = spline(&broken.x, rows);
    resampled.dx = spline(&broken.dx, rows);
    resampled.torque_nm = spline(&broken.torque_nm, rows);
    for (segment, words) in [
        (broken, "decimal points are lost"),
        (resampled, "samples 2 ms apart"),
    ] {
        let reading = repaired(segment);
        assert!(says(&reading, words), "{:?}", reading.notes);
        let found = &reading.recording.segments[0];
        assert_eq!(found.len(), right.len());
        let errors = [
            error(&found.x, &right.x),
            error(&found.torque_nm, &right.torque_nm),
        ];
        assert!(errors.iter().all(|error| *error < 1e-3), "{errors:?}");
    }
}

#[test]
fn angles_that_no_decimal_point_mends_are_left_out_by_name() {
    let (whole, mut broken) = (swing(), swing());
    for i in (0..broken.len()).filter(|i| i % 4 < 2) {
        broken.x[(2, i)] = 200.0 + 7.0 * i as f64;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.csv");
    let both = Recording {
        segments: vec![whole.clone(), broken],
        ..Recording::from(whole.clone())
    };
    recording::write(&path, &both).unwrap();
    let reader = Reader::new(None, Clocks::Repaired).for_robot(go1());
    let reading = reader.read(&path).unwrap();
    assert_eq!(reading.recording.segments.len(), 1);
    assert!(
        says(&reading, "the segment from row 103 is left out"),
        "{:?}",
        reading.notes
    );
}

#[test]
fn late_rates_become_slopes_of_the_angles() {
    let right = jump();
    let mut late = right.clone();
    for i in 5..right.len() {
        for joint in 0..12 {
            late.dx[(joint, i)] = right.dx[(joint, i - 5)];
        }
    }
    let spoiled = error(&late.dx, &right.dx);
    let reading = repaired(late);
    assert!(
        says(&reading, "joint rates are 10 ms late"),
        "{:?}",
        reading.notes
    );
    let found = &reading.recording.segments[0];
    let rms = |a: &DMatrix<f64>| (a - &right.dx).norm();
    assert!(rms(&found.dx) < spoiled * 10.0, "{}", rms(&found.dx));
    assert!(found.dx.rows(12, 3) == right.dx.rows(12, 3));
}

#[test]
fn clipped_rates_and_differences_of_held_angles_are_recognised() {
    let right = jump();
    let mut clipped = right.clone();
    let limit = 0.6 * right.dx.row(16).amax();
    clipped
        .dx
        .row_mut(16)
        .apply(|rate| *rate = rate.clamp(-limit, limit));
    let reading = repaired(clipped);
    assert!(
        says(&reading, "angular rates of the body clip at"),
        "{:?}",
        reading.notes
    );
    assert!(reading.recording.segments[0].dx.row(16).amax() > 1.1 * limit);

    let mut held = right.clone();
    for i in (1..right.len()).step_by(3) {
        for row in 15..18 {
            held.x[(row, i)] = held.x[(row, i - 1)];
        }
    }
    let slopes = romc::recording::preprocess::differences(&held.time_s, &held.x);
    held.dx.rows_mut(15, 3).copy_from(&slopes.rows(15, 3));
    let reading = repaired(held);
    assert!(
        says(&reading, "are differences of held samples"),
        "{:?}",
        reading.notes
    );
}

#[test]
fn rates_that_repeat_while_the_angle_turns_no_faster_do_not_clip() {
    let mut still = jump();
    for row in [0, 3] {
        let extreme = still.dx.row(row).amax();
        // A coarse encoder of a joint that turns at one speed for a while.
        for i in 40..50 {
            still.dx[(row, i)] = extreme;
            still.x[(row, i)] =
                still.x[(row, i - 1)] + extreme * (still.time_s[i] - still.time_s[i - 1]);
        }
        let end = still.x[(row, 49)] - still.x[(row, 50)];
        still
            .x
            .row_mut(row)
            .columns_mut(50, still.time_s.len() - 50)
            .add_scalar_mut(end);
    }
    let reading = repaired(still);
    assert!(!says(&reading, "clip"), "{:?}", reading.notes);
}

#[test]
fn late_place_of_the_body_is_advanced_until_feet_stay() {
    let right = jump();
    let mut late = right.clone();
    for i in 7..right.len() {
        for row in 12..15 {
            late.x[(row, i)] = right.x[(row, i - 7)];
            late.dx[(row, i)] = right.dx[(row, i - 7)];
        }
    }
    let reading = repaired(late);
    assert!(
        says(&reading, "the body's places are 14 ms late"),
        "{:?}",
        reading.notes
    );
    let found = &reading.recording.segments[0];
    let place = right.x.view((12, 0), (3, found.len()));
    assert!((found.x.rows(12, 3) - place).amax() < 1e-6);
}

#[test]
fn sound_jumps_stay_as_they_are() {
    let right = jump();
    let reading = repaired(right.clone());
    assert!(reading.notes.is_empty(), "{:?}", reading.notes);
    let found = &reading.recording.segments[0];
    assert_eq!((&found.x, &found.dx), (&right.x, &right.dx));
}

/// If all rates are a tenth too small, the clock seems to run slow; the free fall proves that it does not.
#[test]
fn clock_under_which_bodies_fall_as_they_do_stays() {
    let mut slow = jump();
    slow.dx *= 0.9;
    let reading = repaired(slow);
    assert!(reading.mended[0].elapsed_ratio.is_none());
}

#[test]
fn stance_that_torques_do_not_carry_is_named_with_its_times() {
    let mut segment = jump();
    let carried = |segment: &Segment| {
        let found = mismatches(&Recording::from(segment.clone()), go1());
        found.into_iter().find(|found| found.kind == "carried")
    };
    assert!(carried(&segment).is_none());
    segment.torque_nm.columns_mut(200, 60).fill(0.0); // from 0.4 s to the thrust
    let found = carried(&segment).expect("a stance without torques");
    assert!(found.words.contains("0.39 to 0.5"), "{}", found.words);
}

#[test]
fn flights_of_a_real_go1_are_all_read() {
    let Some(path) = beside("go1_hardware_flights.csv.gz") else {
        return;
    };
    let reader = Reader::new(None, Clocks::Repaired).for_robot(go1());
    let reading = reader.read(&path).unwrap();
    let segments = &reading.recording.segments;
    assert_eq!(segments.len(), 14);
    for segment in segments {
        assert!(segment.x.amax() < 3.0 && segment.torque_nm.amax() < 5.0);
        assert!((segment.mean_step_s() - 0.002).abs() < 1e-9);
    }
}
