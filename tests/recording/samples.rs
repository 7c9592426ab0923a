//! Operations on samples after reading: inputs, preprocessing, smoothing, writing, notes.

use nalgebra::DMatrix;
use romc::files::Overwrite;
use romc::recording::{Recording, RecordingFault, Segment};
use romc::robot::{JOINT_DIM, STATE_DIM};

/// A segment of a standing robot; all its entries differ.
pub fn sample_segment(n: usize) -> Segment {
    let fill = |rows: usize, offset: f64| {
        DMatrix::from_fn(rows, n, |i, j| offset + 0.01 * i as f64 + 0.001 * j as f64)
    };
    let mut x = fill(STATE_DIM, 0.0);
    for j in 0..n {
        for i in 0..JOINT_DIM {
            x[(i, j)] += [0.0, 0.7, -1.6][i % 3];
        }
    }
    Segment {
        x,
        dx: fill(STATE_DIM, 1.0),
        ddx: fill(STATE_DIM, 2.0),
        torque_nm: fill(JOINT_DIM, 3.0),
        ..Segment::still("sample.csv", (0..n).map(|j| 0.002 * j as f64).collect())
    }
}

mod inputs {
    use romc::robot::{Actuators, BODY_DIM, InputRule, RobotError, WrenchFrame};

    use super::*;

    fn published() -> InputRule {
        InputRule::published(romc::robot_file::by_name("go1").unwrap())
    }

    fn with_losses(frame: WrenchFrame) -> InputRule {
        let actuators = Actuators::of_leg([1.0, 0.6, 0.6], [0.2; 3], [0.01; 3]);
        InputRule::new(
            romc::robot_file::by_name("go1").unwrap(),
            Some(actuators),
            frame,
        )
    }

    #[test]
    fn input_stacks_torques_and_the_robots_wrench() {
        let segment = sample_segment(4);
        let u = segment.input(&published()).unwrap();
        assert_eq!(u.rows(0, 12), segment.torque_nm.rows(0, 12));
        let wrench = published().wrench(&segment.state(2), &segment.torque(2), [true; 4]);
        let wrench = wrench.unwrap();
        for axis in 0..BODY_DIM {
            assert_eq!(u[(12 + axis, 2)], wrench[axis]);
        }
    }

    #[test]
    fn input_under_the_published_rule_prefers_the_wrench_of_the_file() {
        let mut segment = sample_segment(3);
        segment.body_wrench = Some(DMatrix::from_element(6, 3, 7.5));
        let u = segment.input(&published()).unwrap();
        assert_eq!((u[(12, 0)], u[(17, 2)]), (7.5, 7.5));
        let u = segment.input(&with_losses(WrenchFrame::Body)).unwrap();
        assert!(u[(12, 0)] != 7.5 && u[(17, 2)] != 7.5);
    }

    #[test]
    fn input_with_actuators_has_the_net_torques_and_their_wrench() {
        let segment = sample_segment(30);
        for frame in WrenchFrame::ALL {
            let rule = with_losses(frame);
            let u = segment.input(&rule).unwrap();
            let (dq, ddq) = (segment.dx[(4, 15)], segment.ddx[(4, 15)]);
            // Accelerations rise linearly here, so their average equals their value.
            let expected = segment.torque_nm[(4, 15)] - 0.6 * dq - 0.2 - 0.01 * ddq;
            assert!((u[(4, 15)] - expected).abs() < 1e-12);
            let net = std::array::from_fn(|i| u[(i, 15)]);
            let wrench = rule
                .input_wrench(&segment.state(15), &net, [true; 4])
                .unwrap();
            assert_eq!(u.fixed_view::<6, 1>(12, 15), wrench);
        }
    }

    #[test]
    fn joint_accelerations_average_noise_but_not_across_lift_off() {
        let mut segment = sample_segment(60);
        segment.feet[30..].fill([false; 4]);
        segment.ddx = DMatrix::from_fn(STATE_DIM, 60, |_, j| {
            let noise = if j % 2 == 0 { 11.0 } else { -11.0 };
            noise + if j < 30 { 0.0 } else { 500.0 }
        });
        // Joints with a rotor inertia of one.
        let rotors = Actuators::of_leg([0.0; 3], [0.0; 3], [1.0; 3]);
        let robot = published().robot();
        let smooth = segment.losses(&InputRule::new(robot, Some(rotors), WrenchFrame::World));
        assert_eq!(smooth.nrows(), JOINT_DIM);
        assert!(smooth.columns(5, 20).amax() <= 1.0 + 1e-12);
        assert!(smooth.columns(0, 30).amax() <= 11.0);
        assert!(smooth.columns(30, 30).min() >= 489.0);
    }

    #[test]
    fn input_that_is_not_finite_names_its_row() {
        let mut segment = sample_segment(5);
        segment.torque_nm[(5, 3)] = f64::NAN;
        let error = segment.input(&published()).unwrap_err();
        let RecordingFault::Wrench(source) = &error.kind else {
            panic!("{error:?}");
        };
        assert_eq!(error.place.row(), Some(5));
        assert!(matches!(**source, RobotError::NotFinite { .. }));
        segment.feet[3][1] = false;
        assert!(segment.input(&published()).is_ok());
    }

    #[test]
    fn slice_keeps_rows_of_the_file() {
        let segment = sample_segment(6);
        let part = segment.slice(2..5);
        assert_eq!((part.len(), part.first_row, part.row(1)), (3, 4, 5));
        assert_eq!(part.x.column(0), segment.x.column(2));
        assert_eq!(part.time_s, segment.time_s[2..5]);
    }
}

mod writing {
    use std::fs;

    use romc::recording::{Notation, WriteOptions, write_to};
    use romc::recording::{read_from_bytes, write};

    use super::*;

    fn awkward() -> Recording {
        let mut first = sample_segment(7);
        first.x[(0, 0)] = 1.0 / 3.0;
        first.x[(1, 1)] = -5e-324;
        first.dx[(2, 2)] = f64::MAX;
        first.ddx[(3, 3)] = -0.0;
        first.torque_nm[(4, 4)] = 1e-7;
        first.feet[5] = [true, false, true, false];
        let mut second = sample_segment(3);
        second.first_row = 9;
        let mut recording = Recording::from(first);
        recording.segments.push(second);
        recording
    }

    fn text(recording: &Recording, options: &WriteOptions) -> Vec<u8> {
        let mut out = Vec::new();
        write_to(&mut out, recording, None, options).unwrap();
        out
    }

    fn bits(m: &DMatrix<f64>) -> Vec<u64> {
        m.iter().map(|v| v.to_bits()).collect()
    }

    #[test]
    fn write_then_read_returns_the_same_bits_in_both_notations() {
        let recording = awkward();
        for notation in [Notation::Semicolon, Notation::Comma] {
            let options = WriteOptions {
                notation,
                ..WriteOptions::default()
            };
            let back = read_from_bytes("sample.csv", &text(&recording, &options)).unwrap();
            assert_eq!(back, recording);
            for (a, b) in back.segments.iter().zip(&recording.segments) {
                assert_eq!(bits(&a.x), bits(&b.x));
                assert_eq!(bits(&a.ddx), bits(&b.ddx));
            }
        }
    }

    #[test]
    fn write_wrench_of_every_segment_is_kept() {
        let mut recording = awkward();
        for segment in &mut recording.segments {
            let n = segment.len();
            segment.body_wrench = Some(DMatrix::from_fn(6, n, |i, j| i as f64 - 0.1 * j as f64));
        }
        let bytes = text(&recording, &WriteOptions::default());
        assert_eq!(read_from_bytes("sample.csv", &bytes).unwrap(), recording);
    }

    #[test]
    fn write_below_a_file_is_an_error_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("file"), "").unwrap();
        let path = folder.path().join("file/place.csv");
        let error = write(&path, &awkward()).unwrap_err();
        assert!(error.to_string().ends_with("cannot write"), "{error}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn write_gzip_by_extension_is_packed_and_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("jump.csv.gz");
        write(&path, &awkward()).unwrap();
        assert_eq!(fs::read(&path).unwrap()[..2], [0x1f, 0x8b]);
        let back = romc::recording::read(&path).unwrap();
        assert_eq!(back.segments[0].x, awkward().segments[0].x);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}

mod reading {
    use romc::recording::{Mended, Reader, Reading, ReadingNotes, WriteOptions, write_as};

    use super::*;

    fn reading(elapsed_ratio: Option<f64>, note: &str) -> Reading {
        Reading {
            recording: Recording::from(sample_segment(3)),
            notes: vec![note.to_owned()],
            mended: vec![Mended {
                elapsed_ratio,
                resampled: true,
                rates_replaced: false,
            }],
        }
    }

    #[test]
    fn lines_say_each_thing_once_with_its_count() {
        let mut notes = ReadingNotes::default();
        notes.add(&reading(Some(1.1), "a"));
        notes.add(&reading(Some(1.24), "a"));
        notes.add(&reading(None, "b"));
        let lines = notes.lines();
        assert_eq!(lines.len(), 3);
        assert!(lines[0].contains("1.10 to 1.24 s per recorded second in 2 of 3 recordings"));
        assert!(lines[0].contains("uneven steps are resampled in 1 of 3 recordings"));
        assert_eq!(lines[1], "a in 2 of 3 recordings");
    }

    #[test]
    fn accelerations_that_a_file_does_not_have_are_noted() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("jump.csv");
        let recording = Recording::from(sample_segment(3));
        for accelerations in [true, false] {
            let options = WriteOptions {
                accelerations,
                ..WriteOptions::default()
            };
            write_as(&path, &recording, None, &options, Overwrite::Replace).unwrap();
            let notes = Reader::default().read(&path).unwrap().notes;
            let expected = ["accelerations are differences of velocities"];
            assert_eq!(notes, expected[usize::from(accelerations)..]);
        }
    }

    #[test]
    fn a_folder_without_a_map_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let error = Reader::default().read(folder.path()).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("found a folder, expected a file")
        );
    }
}

mod preprocessing {
    use romc::recording::PhaseRule;
    use romc::recording::preprocess::{differences, prepare, resampled};

    use super::*;

    fn unequal_times(n: usize) -> Vec<f64> {
        (0..n)
            .map(|i| 0.002 * i as f64 + 0.0004 * (i as f64).sin())
            .collect()
    }

    #[test]
    fn differences_parabola_is_exact_inside_for_unequal_steps() {
        let time = unequal_times(20);
        let rows = DMatrix::from_fn(1, 20, |_, j| 3.0 * time[j] * time[j] - time[j]);
        let slopes = differences(&time, &rows);
        for j in 1..19 {
            assert!((slopes[j] - (6.0 * time[j] - 1.0)).abs() < 1e-10, "{j}");
        }
        assert!((slopes[0] - (rows[1] - rows[0]) / (time[1] - time[0])).abs() < 1e-12);
    }

    #[test]
    fn differences_single_sample_is_zero() {
        assert_eq!(
            differences(&[0.0], &DMatrix::from_element(2, 1, 5.0)),
            DMatrix::zeros(2, 1)
        );
    }

    #[test]
    fn resampled_same_count_returns_the_samples() {
        let segment = sample_segment(50);
        let same = resampled(&segment, 50).unwrap();
        assert!((&same.x - &segment.x).amax() < 1e-12);
        assert!((&same.torque_nm - &segment.torque_nm).amax() < 1e-12);
        assert_eq!(same.feet, segment.feet);
    }

    #[test]
    fn resampled_straight_lines_are_exact_for_unequal_steps() {
        let mut segment = sample_segment(40);
        segment.time_s = unequal_times(40);
        let time = segment.time_s.clone();
        segment.x = DMatrix::from_fn(18, 40, |i, j| i as f64 + time[j]);
        let fine = resampled(&segment, 173).unwrap();
        for (j, t) in fine.time_s.iter().enumerate() {
            assert!((fine.x[(3, j)] - (3.0 + t)).abs() < 1e-12);
        }
        assert_eq!((fine.time_s[0], fine.time_s[172]), (time[0], time[39]));
    }

    #[test]
    fn resampled_rows_point_into_the_file() {
        let segment = sample_segment(119);
        let out = resampled(&segment, 200).unwrap();
        assert_eq!((out.row(0), out.row(199)), (2, 120));
        assert!((out.mean_step_s() - 0.002 * 118.0 / 199.0).abs() < 1e-15);
    }

    #[test]
    fn resampled_single_sample_is_an_error_with_its_row() {
        let one = sample_segment(5).slice(3..4);
        let error = resampled(&one, 100).unwrap_err();
        let expected = "row 5: found 1 consecutive samples, expected at least 2";
        assert!(error.to_string().ends_with(expected), "{error}");
    }

    #[test]
    fn prepare_keeps_segments_apart_and_fills_batches() {
        let mut jump = sample_segment(300);
        jump.feet[150..240].fill([false; 4]);
        let second = sample_segment(120);
        let mut recording = Recording::from(jump);
        recording.segments.push(second);
        let phases = prepare(&recording, &PhaseRule::two_phase()).unwrap();
        let found = phases.iter();
        let found = found.map(|(span, samples)| (span.phase, samples.len()));
        let found: Vec<_> = found.collect();
        assert_eq!(found, [(0, 200), (1, 100), (0, 100), (0, 200)]);
        let flight = &phases[1].1;
        assert!(flight.feet.iter().all(|feet| *feet == [false; 4]));
        assert_eq!(flight.x.column(0), recording.segments[0].x.column(150));
    }
}

mod smoothing {
    use romc::recording::preprocess::{SavitzkyGolay, moving_average};

    use super::*;

    #[test]
    fn moving_average_keeps_straight_lines_and_flattens_spikes() {
        let line = DMatrix::from_fn(1, 9, |_, i| 3.0 * i as f64 - 1.0);
        assert!((moving_average(&line, 5) - &line).amax() < 1e-12);
        let mut spike = DMatrix::zeros(1, 9);
        spike[(0, 4)] = 5.0;
        let smooth = moving_average(&spike, 5);
        assert_eq!(
            smooth.row(0).iter().copied().collect::<Vec<_>>(),
            [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0]
        );
    }

    #[test]
    fn new_even_window_or_order_too_high_is_refused() {
        for (window, order) in [(10, 2), (3, 3), (0, 0), (5, 13), (1 << 40, 1)] {
            let error = SavitzkyGolay::new(window, order).unwrap_err();
            let expected = format!("smoothing window {window} with order {order}: ");
            assert!(error.to_string().starts_with(&expected), "{error}");
        }
    }

    #[test]
    fn smooth_five_point_quadratic_has_the_classical_weights() {
        let filter = SavitzkyGolay::new(5, 2).unwrap();
        // Row i has the weights of sample i.
        let weights = filter.smooth(&DMatrix::identity(5, 5)).unwrap();
        for (place, expected) in [-3.0, 12.0, 17.0, 12.0, -3.0].iter().enumerate() {
            assert!((weights[(place, 2)] - expected / 35.0).abs() < 1e-14);
        }
        for (place, expected) in [31.0, 9.0, -3.0, -5.0, 3.0].iter().enumerate() {
            assert!((weights[(place, 0)] - expected / 35.0).abs() < 1e-14);
        }
    }

    #[test]
    fn smooth_polynomial_of_its_order_is_unchanged_up_to_the_ends() {
        let cubic = |t: f64| 1.0 - 2.0 * t + 0.3 * t * t + 0.01 * t * t * t;
        let rows = DMatrix::from_fn(2, 40, |i, j| cubic(j as f64 * 0.1) * (i + 1) as f64);
        for (window, order) in [(11, 3), (7, 4), (5, 3)] {
            let smooth = SavitzkyGolay::new(window, order)
                .unwrap()
                .smooth(&rows)
                .unwrap();
            assert!((&smooth - &rows).amax() < 1e-12);
        }
    }

    #[test]
    fn smooth_fewer_samples_than_the_window_is_none() {
        let filter = SavitzkyGolay::new(11, 2).unwrap();
        assert!(filter.smooth(&DMatrix::zeros(3, 10)).is_none());
        assert!(filter.smooth(&DMatrix::zeros(3, 11)).is_some());
    }

    #[test]
    fn smooth_window_of_one_returns_the_samples() {
        let rows = DMatrix::from_fn(1, 5, |_, j| j as f64);
        assert_eq!(
            SavitzkyGolay::new(1, 0).unwrap().smooth(&rows).unwrap(),
            rows
        );
    }
}
