//! Models with momentum rows of all body coordinates, mirror images, equations of the body common to all phases.

use std::path::Path;
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;

use nalgebra::{DMatrix, DVector};
use romc::evaluate::Invariance;
use romc::model::ReducedModel;
use romc::recording::{PhaseRule, Recording};
use romc::robot::{InputRule, JOINT_DIM, Robot, STATE_DIM, WrenchFrame};
use romc::robot_file;
use romc::train::{
    BodyEquations, Method, MirrorImages, Monitor, Origin, Progress, Recordings, TrainError,
    TrainOptions,
};

use super::whole_body::{fits, negated, weights};
use super::{go1, jumps, jumps_of, losses_of_the_simulated_go1, train_with};

const Y: usize = JOINT_DIM + 1;
const ROLL: usize = JOINT_DIM + 3;
const YAW: usize = JOINT_DIM + 5;
/// Entries of a state or an input that change sign in a mirror image, except joints.
const LATERAL: [usize; 3] = [Y, ROLL, YAW];

fn options_of_all(latent_dim: usize) -> TrainOptions {
    let mut options = TrainOptions::new("go1-all", latent_dim);
    options.actuators = Some(losses_of_the_simulated_go1());
    options.set_body("all".parse().expect("known rows"));
    options
}

static SPATIAL: LazyLock<ReducedModel> = LazyLock::new(|| {
    let trained = train_with(
        &jumps("train", 14),
        &jumps("validation", 3),
        &options_of_all(10),
    );
    trained.expect("trains").model
});

#[test]
fn rows_of_all_of_the_body_are_those_of_mechanics() {
    let weights = weights(&SPATIAL);
    // From the mass matrix at the mean posture of the training jumps: row, joint (front right, rear right), weight.
    let mechanics = [
        (4, 0, 0.156),
        (4, 1, -0.039),
        (4, 6, 0.152),
        (4, 7, -0.038),
        (5, 0, 0.023),
        (5, 1, -0.018),
        (5, 6, -0.028),
        (5, 7, -0.018),
    ];
    for (row, joint, expected) in mechanics {
        let found = weights[(row, joint)];
        assert!(
            (found - expected).abs() < 0.03,
            "{row} {joint}: {found} {expected}"
        );
    }
    // The same rows mirrored: rows in the plane are equal, the others change sign.
    for (row, parity) in [1.0, 1.0, 1.0, -1.0, -1.0, -1.0].into_iter().enumerate() {
        let x: DVector<f64> = weights.row(row).transpose();
        for joint in 0..JOINT_DIM {
            let other = joint + if joint / 3 % 2 == 0 { 3 } else { 0 }
                - if joint / 3 % 2 == 1 { 3 } else { 0 };
            let image = parity * go1().mirror_sign(joint) * x[other];
            assert!((x[joint] - image).abs() < 1e-12, "{row} {joint}");
        }
        for (coordinate, unit) in [12, 14, 16, 13, 15, 17].into_iter().enumerate() {
            assert_eq!(x[unit], f64::from(u8::from(coordinate == row)));
        }
    }
}

#[test]
fn equations_of_all_of_the_body_obey_what_is_known() {
    let model = &*SPATIAL;
    let texts = model.library().terms().iter().map(|term| &term.text[..]);
    let texts: Vec<&str> = texts.collect();
    let [contact, flight] = [0, 1].map(|phase| &model.phases()[phase].xi);
    for (index, &text) in texts.iter().enumerate() {
        for (k, own) in [
            (3, &["u4"][..]),
            (4, &["u4", "u5", "u6"]),
            (5, &["u4", "u5", "u6"]),
        ] {
            assert_eq!(
                contact[(index, k)] != 0.0,
                own.contains(&text),
                "{text} of z{}",
                k + 1
            );
        }
        let is_lateral = ["4", "5", "6"].iter().any(|k| text.ends_with(k));
        for k in 0..3 {
            assert!(
                !is_lateral || contact[(index, k)] == 0.0,
                "{text} of z{}",
                k + 1
            );
        }
        for k in 0..6 {
            let falls = k == 1 && text == "1";
            assert_eq!(flight[(index, k)] != 0.0, falls, "{text} of z{}", k + 1);
        }
    }
    // Forces accelerate a mass equally in all directions.
    let gain = |k: usize| {
        let term = texts.iter().position(|text| *text == format!("u{}", k + 1));
        contact[(term.expect("a term"), k)]
    };
    for (k, most) in [(0, 0.1), (3, 0.2)] {
        let ratio = gain(k) / gain(1);
        assert!((ratio - 1.0).abs() < most, "{k}: {ratio}");
    }
}

#[test]
fn all_of_the_body_is_predicted_out_of_the_plane() {
    let model = &*SPATIAL;
    for recordings in [jumps("test", 3), jumps_of("go1-other", "jump", 8)] {
        let predicted = fits(model, &recordings);
        assert!(predicted[Y].rms < 0.4e-3, "{predicted:?}");
        assert!(predicted[YAW].r2.expect("moves") > 0.98, "{predicted:?}");
        let pushed_back = fits(&negated(model, "u4", 3), &recordings);
        assert!(
            pushed_back[Y].rms > 1.5 * predicted[Y].rms,
            "{pushed_back:?}"
        );
    }
}

fn mirrored(recording: &Recording) -> Recording {
    let mut image = recording.clone();
    for segment in &mut image.segments {
        *segment = segment.mirrored(go1());
    }
    image
}

#[test]
fn mirror_image_of_a_mirror_image_is_the_recording() {
    let recording = &jumps("train", 1)[0];
    let image = mirrored(recording);
    assert_ne!(image, *recording);
    assert_eq!(mirrored(&image), *recording);
}

/// Forces and moments computed from a mirror image are the mirror images of the recording's.
#[test]
fn inputs_of_a_mirror_image_are_mirrored() {
    for frame in WrenchFrame::ALL {
        let rule = InputRule::new(go1(), Some(losses_of_the_simulated_go1()), frame);
        let recording = &jumps_of("go1-other", "jump", 1)[0];
        for segment in &recording.segments {
            let input = |of: &romc::recording::Segment| of.input(&rule).expect("known forces");
            let (own, image) = (input(segment), input(&segment.mirrored(go1())));
            for row in JOINT_DIM..STATE_DIM {
                let sign = if LATERAL.contains(&row) { -1.0 } else { 1.0 };
                let apart = (image.row(row) * sign - own.row(row)).amax();
                assert!(
                    apart < 1e-9 * own.row(row).amax().max(1.0),
                    "{frame:?} {row}: {apart}"
                );
            }
        }
    }
}

/// With mirror images, coordinates that change sign are decoded only from rows that change sign. Models in the plane
/// get the same data twice.
#[test]
fn mirror_images_count_where_left_and_right_may_differ() {
    let (training, validation) = (jumps("train", 5), jumps("validation", 1));
    let decoder_with = |mut options: TrainOptions, images| {
        options.encoder.mirror_images = images;
        let trained = train_with(&training, &validation, &options).expect("trains");
        let decoder = trained.model.decoder_map().expect("trained").as_affine();
        decoder.expect("linear").weights().clone()
    };
    let across = |images| {
        let decoder = decoder_with(options_of_all(6), images);
        decoder.select_rows(&LATERAL).columns(0, 3).amax()
    };
    assert!(across(None) < 1e-9, "{}", across(None));
    assert!(across(Some(MirrorImages::None)) > 1e-4);
    let plane = |images| decoder_with(TrainOptions::new("d2", 2), images);
    let of_joints = |decoder: DMatrix<f64>| decoder.rows(0, 3) + decoder.rows(3, 3);
    let [once, twice] = [MirrorImages::None, MirrorImages::Added].map(|images| plane(Some(images)));
    assert_eq!(plane(None), once);
    let flexion = |decoder: DMatrix<f64>| of_joints(decoder).row(1).into_owned();
    assert!((flexion(once) - flexion(twice)).amax() < 1e-9);
}

#[test]
fn one_set_of_equations_of_the_body_is_that_of_all_phases_on_the_ground() {
    let training = jumps_of("go2-asynchronous", "train", 6);
    let validation = jumps_of("go2-asynchronous", "validation", 2);
    let train = |equations| {
        let mut options = TrainOptions::new("go2", 5);
        options.phases = PhaseRule::three_phase().with_min_samples(options.phases.min_samples);
        options.regression.body_equations = equations;
        let trained = train_with(&training, &validation, &options).expect("trains");
        trained.model
    };
    let [shared, own] = [BodyEquations::AllPhases, BodyEquations::PerPhase].map(train);
    let body =
        |model: &ReducedModel, phase: usize| model.phases()[phase].xi.columns(0, 3).into_owned();
    assert_eq!(body(&shared, 0), body(&shared, 1));
    assert_ne!(body(&own, 0), body(&own, 1));
    assert_ne!(shared.phases()[0].xi, shared.phases()[1].xi);
    let columns = body(&shared, 0);
    let terms = shared.library().terms().iter().zip(columns.row_iter());
    let active: Vec<String> = terms
        .flat_map(|(term, row)| {
            let row: Vec<usize> = (0..3).filter(|&k| row[k] != 0.0).collect();
            row.into_iter()
                .map(move |k| format!("{} {}", k + 1, term.text))
        })
        .collect();
    assert_eq!(
        active,
        ["2 1", "3 1", "1 u1", "3 u1", "2 u2", "3 u2", "3 u3"]
    );
}

#[test]
fn more_rows_than_latent_coordinates_are_refused() {
    let refused = train_with(&jumps("train", 1), &[], &options_of_all(5));
    let Err(TrainError::Option { option, found, .. }) = refused else {
        panic!("trained with six rows in five coordinates");
    };
    assert_eq!(
        (option, &found[..]),
        ("body", "6 rows with 5 latent coordinates")
    );
}

/// Mass and response to a moment are identified from the recordings: another mass in the robot's file changes nothing.
#[test]
fn mass_and_rotation_do_not_come_from_the_file_of_the_robot() {
    let text = robot_file::to_toml(go1());
    let text = text
        .replace("\"go1\"", "\"heavier\"")
        .replace("12.01", "15.613");
    let heavier = robot_file::from_text("heavier.toml", &text, &Default::default());
    let heavier: &'static Robot = heavier.expect("a robot").robot;
    assert!((heavier.mass_kg() / go1().mass_kg() - 1.3).abs() < 1e-3);
    let (training, validation) = (jumps("train", 14), jumps("validation", 3));
    let mut options = TrainOptions::new("d5", 5);
    options.actuators = Some(losses_of_the_simulated_go1());
    let found = [go1(), heavier].map(|robot| {
        let paths = training.iter().map(|recording| recording.path.as_path());
        let origin = Origin::new("romc train", paths.collect::<Vec<&Path>>());
        let (cancel, mut listener) = (AtomicBool::new(false), |_: Progress| ());
        let monitor = &mut Monitor::new(&mut listener, &cancel);
        let recordings = Recordings::new(&training, &validation);
        let trained = Method::ClosedForm.learn(recordings, robot, &options, &origin, monitor);
        let model = trained.expect("trains").model;
        let invariance = Invariance::of(&model).expect("finite").expect("complete");
        (
            invariance.mass_kg.expect("a mass"),
            invariance.rotation_rad_s2_per_nm.expect("a rotation"),
        )
    });
    assert_eq!(found[0], found[1]);
    assert!((found[0].0 / 12.74 - 1.0).abs() < 0.1, "{found:?}");
}

/// The recordings before the first flight.
fn launches(recordings: &[Recording]) -> Vec<Recording> {
    let launch = |recording: &Recording| {
        let segment = &recording.segments[0];
        let grounded = |sample: &usize| segment.feet[*sample].contains(&true);
        let count = (0..segment.len()).take_while(grounded).count();
        Recording::from(segment.slice(0..count))
    };
    recordings.iter().map(launch).collect()
}

/// Without flights the rows are fitted to forces and moments: mass and rotation are those of the simulated robot, and
/// the whole body is predicted.
#[test]
fn robot_that_does_not_fly_is_learned_from_forces_and_moments() {
    let (training, validation) = (
        launches(&jumps("train", 14)),
        launches(&jumps("validation", 3)),
    );
    let mut options = options_of_all(10);
    let contact = PhaseRule::two_phase().patterns.swap_remove(0);
    options.phases = PhaseRule::new(vec![contact]);
    let model = train_with(&training, &validation, &options)
        .expect("trains")
        .model;
    let found = Invariance::of(&model).expect("finite").expect("complete");
    let mass = found.mass_kg.expect("a mass") / 12.74;
    let rotation = found.rotation_rad_s2_per_nm.expect("a rotation") / 2.60;
    assert!(
        (mass - 1.0).abs() < 0.1 && (rotation - 1.0).abs() < 0.2,
        "{mass} {rotation}"
    );
    let predicted = fits(&model, &launches(&jumps("test", 3)));
    for coordinate in JOINT_DIM..STATE_DIM {
        let r2 = predicted[coordinate].r2.expect("moves");
        assert!(r2 > 0.9, "{coordinate} {predicted:?}");
    }
    let turned_back = fits(&negated(&model, "u3", 2), &launches(&jumps("test", 3)));
    assert!(
        turned_back[JOINT_DIM + 4].r2.expect("moves") < 0.9,
        "{turned_back:?}"
    );
}
