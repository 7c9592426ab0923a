//! The controller along recordings.

use std::path::Path;

use nalgebra::DMatrix;
use romc::evaluate::{ControlMetrics, ReferenceInput, along_recording, control_metrics};
use romc::mpc::{Lift, MpcSettings, Source};
use romc::recording::{Recording, Segment};

use crate::outside;
use crate::synthetic::{Equations, Trajectory, model, trajectory, unwatched};
use crate::tools::thorough_or;

fn recording(trajectory: &Trajectory) -> Recording {
    let count = trajectory.time_s.len();
    let input = DMatrix::from_column_slice(18, count, &trajectory.u);
    let segment = Segment {
        path: "synthetic.csv".into(),
        first_row: 2,
        row_stride: 1.0,
        time_s: trajectory.time_s.clone(),
        x: DMatrix::from_column_slice(18, count, &trajectory.x),
        dx: DMatrix::from_column_slice(18, count, &trajectory.dx),
        ddx: DMatrix::zeros(18, count),
        torque_nm: input.rows(0, 12).into_owned(),
        feet: trajectory.feet.clone(),
        body_wrench: Some(input.rows(12, 6).into_owned()),
        is_walk: false,
    };
    Recording {
        path: "synthetic.csv".into(),
        segments: vec![segment.slice(0..150), segment],
        ignored_columns: vec![],
    }
}

#[test]
fn run_along_a_recording_that_the_model_follows_finds_its_torques() {
    let model = model(Equations::Nonlinear);
    let recording = recording(&trajectory(&model));
    let mut controller = romc::mpc::controller(&model, unwatched()).expect("complete");
    let mut told = Vec::new();
    let run = along_recording(
        &mut controller,
        &recording,
        ReferenceInput::Recorded,
        |done, total| {
            told.push((done, total));
        },
    )
    .expect("a sound recording");
    // Two segments of 0.298 s and 0.8 s: commands whose 10 ms end inside.
    assert_eq!(run.rows.len(), 29 + 80);
    assert_eq!(told.last(), Some(&(109, 109)));
    assert_eq!(run.rows.iter().filter(|row| row.segment == 0).count(), 29);
    let summary = &run.summary;
    assert_eq!(
        (summary.steps, summary.solved, summary.failed),
        (109, 109, 0)
    );
    assert_eq!(
        (
            summary.limit_violations,
            summary.friction_violations,
            summary.implausible
        ),
        (0, None, 0)
    );
    assert!(
        summary.torque_r2.contact.expect("contact") > 0.99,
        "{summary:?}"
    );
    assert!(
        summary.torque_r2.flight.expect("flight") > 0.9,
        "{summary:?}"
    );
    assert!(summary.tracking_rms.expect("plans") < 0.05, "{summary:?}");
    // Percentiles are ranks of the sorted times.
    let mut times: Vec<f64> = run.rows.iter().map(|row| row.command.solve_us).collect();
    times.sort_by(f64::total_cmp);
    let of_steps = &summary.step_us;
    let ranks = [times[54], times[107], times[108]];
    assert_eq!([of_steps.p50, of_steps.p99, of_steps.max], ranks);
    for row in &run.rows {
        assert_eq!(row.command.source, Source::Plan);
        for joint in 0..12 {
            assert!((row.input[joint] - row.command.torque_nm[joint]).abs() < 1e-9);
        }
        for (z, reference) in row.z.iter().zip(&row.z_reference) {
            assert!((z - reference).abs() < 1e-12);
        }
    }
}

#[test]
fn torques_of_no_robot_are_left_out_and_counted() {
    let model = model(Equations::Nonlinear);
    let mut recording = recording(&trajectory(&model));
    recording.segments.remove(0);
    let mut controller = romc::mpc::controller(&model, unwatched()).expect("complete");
    recording.segments[0].torque_nm[(2, 203)] = -2.7e5;
    let run = along_recording(
        &mut controller,
        &recording,
        ReferenceInput::Recorded,
        |_, _| {},
    )
    .expect("a sound recording");
    assert_eq!(
        (run.summary.implausible, run.summary.limit_violations),
        (1, 0)
    );
    assert!(
        run.summary.torque_r2.contact.expect("contact") > 0.98,
        "{:?}",
        run.summary
    );
}

#[test]
fn lift_comparison_of_inputs_in_the_encoders_range_is_exact() {
    let model = model(Equations::Nonlinear);
    let recording = recording(&trajectory(&model));
    let mut controller = romc::mpc::controller(&model, unwatched()).expect("complete");
    let run = along_recording(
        &mut controller,
        &recording,
        ReferenceInput::Recorded,
        |_, _| {},
    );
    let r2 = run.expect("a sound recording").summary.lift_r2;
    assert!(r2.contact.expect("contact") > 1.0 - 1e-9);
    assert!(r2.flight.expect("flight") > 1.0 - 1e-9);
}

#[test]
fn hardware_jump_gets_torques_within_the_limits_with_either_lift() {
    let Some(path) = outside::hardware_jump() else {
        return;
    };
    let recording = romc::recording::read(&path).expect("the file is sound");
    for lift in [Lift::Transpose, Lift::Consistent] {
        let settings = MpcSettings {
            lift,
            ..unwatched()
        };
        let mut controller =
            romc::mpc::controller(&model(Equations::Nonlinear), settings).expect("complete");
        let run = along_recording(&mut controller, &recording, ReferenceInput::None, |_, _| {})
            .expect("a sound recording");
        assert!(run.summary.steps > 100);
        assert_eq!(run.summary.limit_violations, 0);
        assert!(
            run.summary.failed * 10 < run.summary.steps,
            "{:?}",
            run.summary
        );
        match lift {
            Lift::Transpose => assert_eq!(run.summary.friction_violations, None),
            Lift::Consistent => assert_eq!(run.summary.friction_violations, Some(0)),
        }
    }
}

/// Every recording of a Go1 that is shipped with romc, and the hardware jump if present.
fn go1_recordings() -> Vec<Recording> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = ["go1", "go1-noisy"].map(|set| root.join("examples/recordings").join(set));
    let mut paths: Vec<_> = folders
        .iter()
        .flat_map(|folder| std::fs::read_dir(folder).expect("recordings come with romc"))
        .map(|entry| entry.expect("a readable folder").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "gz"))
        .collect();
    paths.sort();
    paths.extend(outside::hardware_jump());
    paths
        .iter()
        .map(|path| romc::recording::read(path).expect("a sound recording"))
        .collect()
}

#[test]
fn shipped_models_stay_within_limits_and_friction_at_every_step_of_every_recording() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let recordings = go1_recordings();
    assert!(recordings.len() >= 25);
    let taken: Vec<&Recording> = recordings.iter().step_by(thorough_or(1, 5)).collect();
    for (name, least_lift_r2) in [("go1-d4", 0.94), ("go1-d6", 0.97)] {
        let model = romc::artifact::read(&root.join(format!("models/{name}.json"))).expect("sound");
        for lift in [Lift::Transpose, Lift::Consistent] {
            let settings = MpcSettings {
                lift,
                ..unwatched()
            };
            let mut controller = romc::mpc::controller(&model, settings).expect("complete");
            let mut steps = 0;
            for &recording in &taken {
                let run = along_recording(
                    &mut controller,
                    recording,
                    ReferenceInput::Recorded,
                    |_, _| {},
                )
                .expect("a sound recording");
                let summary = run.summary;
                let path = recording.path.display();
                steps += summary.steps;
                assert_eq!(summary.limit_violations, 0, "{name} {lift:?} {path}");
                assert!(
                    summary.friction_violations.is_none_or(|count| count == 0),
                    "{name} {lift:?} {path}: {summary:?}"
                );
                let is_test = path.to_string().contains("go1/test_");
                if path.to_string().contains("go1/test_01") {
                    let r2 = summary.torque_r2.contact;
                    assert!(r2 > Some(0.85), "{name} {path}: {r2:?}");
                }
                if is_test && lift == Lift::Consistent {
                    let r2 = summary.lift_r2.contact.expect("feet touch the ground");
                    assert!(r2 >= least_lift_r2, "{name} {path}: {r2}");
                }
            }
            assert!(steps > 100 * taken.len(), "{steps}");
        }
    }
}

fn metrics_along(jump: &str, step_s: f64) -> (ControlMetrics, Option<f64>) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let model = romc::artifact::read(&root.join("models/go1-d6.json")).expect("sound");
    let path = root.join(format!("examples/recordings/{jump}.csv.gz"));
    let jump = romc::recording::read(&path).expect("a sound jump");
    let settings = MpcSettings {
        step_s,
        ..unwatched()
    };
    let mut controller = romc::mpc::controller(&model, settings).expect("complete");
    let input = ReferenceInput::Recorded;
    let run = along_recording(&mut controller, &jump, input, |_, _| {}).expect("a sound jump");
    let metrics = control_metrics(&model, &jump, settings).expect("a sound jump");
    (metrics, run.summary.tracking_rms)
}

#[test]
fn replay_moves_on_at_the_speed_of_the_push_and_feedback_does_not() {
    // after k of 100 samples of 2 ms the body has moved 0.1 m/s k 2 ms, for every control step
    let mean_square = (1..=100).map(|k| f64::from(k * k)).sum::<f64>() / 100.0;
    for step_s in [0.005, 0.02] {
        let (metrics, without_push) = metrics_along("go1/test_01", step_s);
        let baseline = &metrics.baseline;
        let replay = baseline.replay.recovery_rms_m.expect("the robot stands");
        let expected = 0.1 * 0.002 * mean_square.sqrt();
        assert!((replay - expected).abs() < 1e-9, "{step_s}: {replay}");
        let feedback_off = baseline.feedback_off.recovery_rms_m;
        assert!(metrics.recovery_rms_m < feedback_off, "{metrics:?}");
        assert!(metrics.tracking_rms > without_push, "{metrics:?}");
    }
}
