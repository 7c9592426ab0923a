//! Phases, plausibility and conditioning of samples; sets of files.

use nalgebra::DMatrix;
use romc::recording::check::{Finding, Implausible, check, without};
use romc::recording::{
    ConditionOptions, ImplausibleSamples, PhaseRule, Recording, RecordingError, Segment,
};
use romc::robot::{JOINT_DIM, Robot, STATE_DIM};

mod implausible {
    use super::*;

    use nalgebra::DMatrix;

    fn go1() -> &'static Robot {
        romc::robot_file::by_name("go1").unwrap()
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

    /// Findings in the smooth motion after a change.
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
        // Sample 31 is isolated between the two and is dropped as well.
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
        assert!(error.to_string().contains("found 0 consecutive samples"));
        assert_eq!(error.place.row(), Some(2));
    }

    #[test]
    fn check_sensor_noise_is_accepted_but_a_spike_in_it_is_found() {
        let mut recording = smooth(400);
        // A fixed sequence without pattern, as noise of 0.5 mm.
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
}

mod conditioning {
    use romc::recording::preprocess::SavitzkyGolay;
    use romc::recording::{Accelerations, SmoothedRows, condition};

    use super::*;

    /// A robot at rest, with noise on the accelerations, and one torque beyond every motor's limit.
    fn recording() -> Recording {
        let n = 200;
        let mut torque_nm = DMatrix::from_element(12, n, 1.0);
        torque_nm[(4, 60)] = 900.0;
        torque_nm[(4, 70)] = 900.0;
        let standing = |i: usize, _| match i {
            0..12 => [0.0, 0.7, -1.4][i % 3],
            14 => 0.3,
            _ => 0.0,
        };
        Recording::from(Segment {
            x: DMatrix::from_fn(18, n, standing),
            ddx: DMatrix::from_fn(18, n, |_, j| if j % 2 == 0 { 0.5 } else { -0.5 }),
            torque_nm,
            ..Segment::still("stand.csv", (0..n).map(|i| 0.002 * i as f64).collect())
        })
    }

    /// [`condition`] of a recording with all its findings.
    fn conditioned(
        recording: &Recording,
        options: &ConditionOptions,
    ) -> Result<(Recording, usize), RecordingError> {
        let go1 = romc::robot_file::by_name("go1").expect("a known robot");
        condition(recording.clone(), &check(recording, go1), options)
    }

    #[test]
    fn condition_by_default_changes_nothing() {
        let out = conditioned(&recording(), &ConditionOptions::default()).expect("sound");
        assert_eq!(out, (recording(), 0));
    }

    #[test]
    fn condition_leaves_out_implausible_samples_and_pieces_too_short_to_learn_from() {
        let options = ConditionOptions {
            implausible: ImplausibleSamples::LeaveOut,
            least_samples: 50,
            ..ConditionOptions::default()
        };
        let (out, left_out) = conditioned(&recording(), &options).expect("sound");
        let pieces: Vec<_> = (out.segments.iter())
            .map(|piece| (piece.first_row, piece.len()))
            .collect();
        assert_eq!(pieces, [(2, 60), (73, 129)]);
        assert_eq!(left_out, 11);

        let options = ConditionOptions {
            least_samples: 150,
            ..options
        };
        let error = conditioned(&recording(), &options).expect_err("nothing remains");
        let expected = "row 73: found 129 consecutive samples, expected at least 150";
        assert!(error.to_string().ends_with(expected), "{error}");
    }

    #[test]
    fn condition_smooths_accelerations_or_takes_them_from_velocities() {
        let filter = SavitzkyGolay::new(11, 2).expect("a filter");
        let smooth = ConditionOptions {
            smoothing: Some((filter, SmoothedRows::Accelerations)),
            ..ConditionOptions::default()
        };
        let before = recording();
        let made = |options| conditioned(&before, options).expect("sound").0;
        let out = made(&smooth);
        let ddx = |recording: &Recording| recording.segments[0].ddx.clone();
        assert!(ddx(&out).norm() < 0.3 * ddx(&before).norm());
        assert_eq!(out.segments[0].torque_nm, before.segments[0].torque_nm);

        let differences = ConditionOptions {
            accelerations: Accelerations::Differences,
            ..ConditionOptions::default()
        };
        let out = made(&differences);
        assert_eq!(ddx(&out).amax(), 0.0);
    }

    #[test]
    fn smoothing_longer_than_a_segment_is_an_error() {
        let mut short = recording();
        short.segments[0] = short.segments[0].slice(0..5);
        let filter = SavitzkyGolay::new(11, 2).expect("a filter");
        let options = ConditionOptions {
            smoothing: Some((filter, SmoothedRows::All)),
            ..ConditionOptions::default()
        };
        let error = conditioned(&short, &options).expect_err("five samples");
        let expected = "found 5 consecutive samples, expected at least 11";
        assert!(error.to_string().ends_with(expected), "{error}");
    }
}

mod phases {
    use romc::recording::{PhasePattern, PhaseSpan};
    use romc::robot::{ContactFlags, FeetRule};

    use super::*;
    use crate::samples::sample_segment;

    fn pattern(name: &str, feet: FeetRule) -> PhasePattern {
        let name = name.to_owned();
        PhasePattern { name, feet }
    }

    /// Feet sample after sample: `2x0011` for two samples with the rear feet down.
    fn segment(runs: &str) -> Segment {
        let run = |run: &str| -> Vec<ContactFlags> {
            let (count, feet) = run.split_once('x').unwrap();
            let feet = std::array::from_fn(|foot| feet.as_bytes()[foot] == b'1');
            vec![feet; count.parse().unwrap()]
        };
        let feet: Vec<ContactFlags> = runs.split(' ').flat_map(run).collect();
        Segment {
            feet: feet.clone(),
            ..sample_segment(feet.len())
        }
    }

    /// The spans in words: `0 Launch 0..13` for phase, place and samples.
    fn brief(rule: &PhaseRule, segment: &Segment) -> Vec<String> {
        let spans = rule.spans(segment).unwrap();
        assert_eq!(spans.first().map(|s| s.range.start), Some(0));
        assert_eq!(spans.last().map(|s| s.range.end), Some(segment.len()));
        let text = |span: PhaseSpan| format!("{} {:?} {:?}", span.phase, span.kind, span.range);
        spans.into_iter().map(text).collect()
    }

    #[test]
    fn spans_join_what_is_no_phase_or_too_short_to_a_neighbour() {
        let exact = |name: &str, feet: [u8; 4]| {
            pattern(name, FeetRule::Patterns(vec![feet.map(|f| f == 1)]))
        };
        let exact = PhaseRule::new(vec![
            exact("all", [1; 4]),
            exact("rear", [0, 0, 1, 1]),
            exact("none", [0; 4]),
        ]);
        for (rule, runs, expected) in [
            // samples in transition join launch and landing
            (
                PhaseRule::two_phase(),
                "10x1111 2x0011 1x0001 20x0000 3x0100 9x1111",
                &["0 Launch 0..13", "1 Flight 13..33", "0 Landing 33..45"][..],
            ),
            // three phases separate the rear stance
            (
                PhaseRule::three_phase(),
                "10x1111 2x0111 30x0011 1x0010 20x0000",
                &["0 Launch 0..12", "1 Launch 12..43", "2 Flight 43..63"],
            ),
            // a trot: feet that leave or land late belong to their pair or, briefly, to the previous span
            (
                PhaseRule::trot().with_min_samples(3),
                "6x1111 8x1001 1x0001 5x0000 2x0111 7x0110 4x0111 9x1001",
                &[
                    "2 Launch 0..6",
                    "0 Launch 6..15",
                    "3 Flight 15..22",
                    "1 Landing 22..29",
                    "2 Landing 29..33",
                    "0 Landing 33..42",
                ],
            ),
            // a crawl: one foot after the other
            (
                PhaseRule::crawl(),
                "5x1111 6x0111 3x1111 6x1110 2x1001",
                &[
                    "4 Launch 0..5",
                    "0 Launch 5..11",
                    "4 Launch 11..14",
                    "3 Launch 14..20",
                    "4 Launch 20..22",
                ],
            ),
            // exact patterns give transitions to the side with more feet
            (
                exact,
                "1x1011 5x1111 2x0111 5x0011 1x0001 5x0000 2x1000 5x1111 1x1100",
                &[
                    "0 Launch 0..8",
                    "1 Launch 8..14",
                    "2 Flight 14..19",
                    "0 Landing 19..27",
                ],
            ),
            // chatter shorter than the minimum joins its neighbour
            (
                PhaseRule::two_phase().with_min_samples(3),
                "1x0000 9x1111 2x0000 4x1111 20x0000 1x1111 2x0000",
                &["0 Launch 0..16", "1 Flight 16..39"],
            ),
            // a single sample is one span
            (
                PhaseRule::two_phase().with_min_samples(10),
                "1x1111",
                &["0 Launch 0..1"],
            ),
        ] {
            assert_eq!(brief(&rule, &segment(runs)), expected, "{runs}");
        }
        let chatter = segment("1x0000 9x1111 2x0000 4x1111 20x0000 1x1111 2x0000");
        assert_eq!(PhaseRule::two_phase().spans(&chatter).unwrap().len(), 7);
    }

    #[test]
    fn three_phase_rule_matches_every_contact_exactly_once() {
        let rule = PhaseRule::three_phase();
        for bits in 0..16_u8 {
            let feet = std::array::from_fn(|foot| bits & (1 << foot) != 0);
            let matching = rule.patterns.iter().filter(|p| p.feet.matches(feet));
            assert_eq!(matching.count(), 1, "{feet:?}");
        }
    }

    #[test]
    fn spans_no_pattern_matches_is_an_error_with_row_and_feet() {
        let rule = PhaseRule::new(vec![pattern("flight", FeetRule::None)]);
        let error = rule.spans(&segment("3x1100")).unwrap_err();
        let text = error.to_string();
        assert_eq!(error.place.row(), Some(2));
        assert!(text.contains("none of the phases `flight`"), "{text}");
    }
}

mod sets {
    use std::path::Path;

    use romc::recording::{Reader, RecordingFile, RecordingSet};

    use super::*;

    fn read(names: &[&str], segments: Option<Vec<usize>>) -> (RecordingSet, Result<(), String>) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/recordings/go1-noisy");
        let file = |name: &&str| RecordingFile {
            path: folder.join(name),
            segments: segments.clone(),
        };
        let files: Vec<_> = names.iter().map(file).collect();
        let go1 = romc::robot_file::by_name("go1").expect("known");
        let mut set = RecordingSet::default();
        let read = set.read(
            &files,
            go1,
            &ConditionOptions::default(),
            &Reader::default(),
        );
        (set, read.map_err(|error| error.to_string()))
    }

    #[test]
    fn recordings_come_in_the_order_of_their_files() {
        let names = [1, 2, 3].map(|i| format!("train_0{i}.csv.gz"));
        let (set, read) = read(&names.each_ref().map(String::as_str), Some(vec![0]));
        assert_eq!(read, Ok(()));
        assert_eq!(set.recordings.len(), 3);
        for (recording, name) in set.recordings.iter().zip(&names) {
            assert!(recording.path.ends_with(name));
            assert_eq!(recording.segments.len(), 1);
        }
    }

    #[test]
    fn a_file_that_cannot_be_read_ends_the_reading_at_its_place() {
        let names = ["train_01.csv.gz", "missing.csv", "train_02.csv.gz"];
        let (set, read) = read(&names, None);
        let error = read.expect_err("no such file");
        assert!(error.ends_with("missing.csv: no such file"), "{error}");
        assert_eq!(set.recordings.len(), 1);
    }
}
