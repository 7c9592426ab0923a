//! Training on the shipped jumps, and on unsuitable input.

#[path = "train/definitions.rs"]
mod definitions;
#[path = "train/from_model.rs"]
mod from_model;
#[path = "train/known_system.rs"]
mod known_system;
mod outside;
#[path = "train/phases.rs"]
mod phases;
#[path = "train/spatial_body.rs"]
mod spatial_body;
#[path = "train/walks.rs"]
mod walks;
#[path = "train/whole_body.rs"]
mod whole_body;

use std::cell::{Cell, RefCell};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::DMatrix;
use romc::artifact;
use romc::evaluate::{Assessment, ReferenceInput, along_recording};
use romc::files::Overwrite;
use romc::lower::CompiledModel;
use romc::model::{Activation, LibraryChoice, StandardLibrary};
use romc::mpc::MpcSettings;
use romc::recording::{self, Recording};
use romc::robot::{Actuators, Robot, WrenchFrame};
use romc::sim::{LatentSegment, Restart, rollout};
use romc::train::{
    self, Coordinates, Method, Monitor, Origin, Progress, Recordings, ScaleOptions, SetMetrics,
    Split, TrainError, TrainOptions, Trained, Transfer,
};

fn jumps(set: &str, count: usize) -> Vec<Recording> {
    jumps_of("go1", set, count)
}

fn jumps_of(folder: &str, set: &str, count: usize) -> Vec<Recording> {
    (1..=count)
        .map(|i| {
            let path = format!(
                "{}/examples/recordings/{folder}/{set}_{i:02}.csv.gz",
                env!("CARGO_MANIFEST_DIR")
            );
            recording::read(Path::new(&path)).expect("checked-in recording")
        })
        .collect()
}

/// Errors of body x and z over 0.1 s and over whole jumps do not exceed these, in mm.
fn assert_predictions(test: &SetMetrics, most_mm: [f64; 4]) {
    let whole = [test.rollout_x_m, test.rollout_z_m].map(|error| error.expect("finite"));
    let errors = [test.prediction_x_m, test.prediction_z_m, whole[0], whole[1]];
    for (error, most_mm) in errors.iter().zip(most_mm) {
        assert!(1e3 * error <= most_mm, "{test:?}");
    }
}

fn go1() -> &'static Robot {
    romc::robot_file::by_name("go1").expect("known robot")
}

fn paths(recordings: &[Recording]) -> impl Iterator<Item = &Path> {
    recordings.iter().map(|recording| recording.path.as_path())
}

fn train_with(
    training: &[Recording],
    validation: &[Recording],
    options: &TrainOptions,
) -> Result<Trained, TrainError> {
    let (cancel, mut listener) = (AtomicBool::new(false), |_: Progress| ());
    let origin = Origin::new("romc train", paths(training));
    let recordings = Recordings::new(training, validation);
    Method::ClosedForm.learn(
        recordings,
        go1(),
        options,
        &origin,
        &mut Monitor::new(&mut listener, &cancel),
    )
}

fn trained(latent_dim: usize) -> Trained {
    let options = TrainOptions::new(format!("go1-d{latent_dim}"), latent_dim);
    train_with(&jumps("train", 14), &jumps("validation", 3), &options).expect("trains")
}

#[test]
fn closed_form_d4_meets_its_lines_on_jumps_it_never_saw() {
    let Trained { model, report } = trained(4);
    let test = train::assess(&model, &jumps("test", 3)).expect("the model fits the recordings");
    assert!(test.decoder_mse <= 1.2e-5, "{test:?}");
    assert!(test.torque_r2 >= 0.95, "{test:?}");
    assert_predictions(&test, [1.5, 2.5, 30.0, 25.0]);
    assert_eq!(report.encoded.len(), 15, "{:?}", report.encoded);
}

#[test]
fn refinement_predicts_whole_jumps_better_and_terms_are_dropped_within_the_slack() {
    let (training, validation) = (jumps("train", 6), jumps("validation", 2));
    let messages = RefCell::new(Vec::new());
    let train_d4 = |refinements, slack| {
        let mut options = TrainOptions::new("d4", 4);
        options.regression.refinements = refinements;
        options.regression.slack = slack;
        messages.borrow_mut().clear();
        let (cancel, mut listener) = (AtomicBool::new(false), |message| {
            messages.borrow_mut().push(message)
        });
        let recordings = Recordings::new(&training, &validation);
        let origin = Origin::new("romc train", paths(&training));
        let monitor = &mut Monitor::new(&mut listener, &cancel);
        Method::ClosedForm
            .learn(recordings, go1(), &options, &origin, monitor)
            .expect("trains")
    };
    let score = |trained: &Trained| trained.report.choice.as_ref().expect("chosen").score;
    let whole_m = |trained: &Trained| {
        let metrics = trained.report.validation.as_ref().expect("validated");
        let both = [metrics.rollout_x_m, metrics.rollout_z_m].map(|error| error.expect("finite"));
        both[0].hypot(both[1])
    };
    let usual = TrainOptions::new("d4", 4).regression;
    let plain = train_d4(0, usual.slack);
    let refined = train_d4(usual.refinements, 0.0);
    assert!(score(&refined) < score(&plain));
    assert!(whole_m(&refined) < 0.9 * whole_m(&plain));
    for slack in [0.1, 0.5] {
        train_d4(usual.refinements, slack);
        // Scores of a stage's steps, relative to the first candidate's errors.
        let scores_of = |name: &str| -> Vec<f64> {
            let messages = messages.borrow();
            let mut is_in = false;
            let each = messages.iter().filter_map(|message| match message {
                Progress::Stage { name: own, .. } => {
                    is_in = own.ends_with(name);
                    None
                }
                Progress::Done { text } => {
                    text.strip_prefix("score ")?.parse().ok().filter(|_| is_in)
                }
                Progress::Step => None,
            });
            each.collect()
        };
        let refined = scores_of("by rollouts")
            .into_iter()
            .fold(f64::MAX, f64::min);
        let dropped = scores_of("rollouts do not miss");
        let rise = dropped.last().expect("terms dropped") / refined - 1.0;
        assert!(0.0 < rise && rise <= slack + 1e-4, "{refined} {dropped:?}");
    }
}

#[test]
fn closed_form_d6_is_sparse_and_accurate() {
    let Trained { model, report } = trained(6);
    let test = train::assess(&model, &jumps("test", 3)).expect("the model fits the recordings");
    assert!(
        test.decoder_mse <= 7e-6 && test.torque_r2 >= 0.95,
        "{test:?}"
    );
    assert_predictions(&test, [1.5, 2.5, 25.0, 20.0]);
    let active: Vec<usize> = report
        .active_terms
        .iter()
        .map(|phase| phase.active)
        .collect();
    assert!(active[0] <= 60 && active[1] <= 45, "{active:?}");
}

#[test]
fn named_coordinates_predict_jumps_of_another_controller_which_free_ones_do_not() {
    let (training, validation) = (jumps("train", 14), jumps("validation", 3));
    let other = jumps_of("go1-other", "jump", 8);
    let assessed = |coordinates| {
        let mut options = TrainOptions::new("d4", 4);
        options.actuators = Some(losses_of_the_simulated_go1());
        options.encoder.coordinates = coordinates;
        let trained = train_with(&training, &validation, &options).expect("trains");
        train::assess(&trained.model, &other).expect("the model fits")
    };
    let named = assessed(Coordinates::Named);
    assert_predictions(&named, [2.0, 1.5, 40.0, 30.0]);
    let free = assessed(Coordinates::Free);
    assert!(
        free.prediction_z_m > 1.5 * named.prediction_z_m,
        "{free:?} {named:?}"
    );
}

/// Joint losses of the simulated Go1, as in the recorder of the jumps.
fn losses_of_the_simulated_go1() -> Actuators {
    Actuators::of_leg([1.0, 0.6, 0.6], [0.2; 3], [0.01; 3])
}

#[test]
fn net_torques_predict_better_and_command_what_was_recorded() {
    let (training, validation, test) =
        (jumps("train", 14), jumps("validation", 3), jumps("test", 3));
    for frame in WrenchFrame::ALL {
        let options = |actuators| TrainOptions {
            actuators,
            wrench_frame: frame,
            scaling: ScaleOptions::in_frame(frame),
            ..TrainOptions::new("d4", 4)
        };
        let of_motors = train_with(&training, &validation, &options(None)).expect("trains");
        let losses = options(Some(losses_of_the_simulated_go1()));
        let net = train_with(&training, &validation, &losses).expect("trains");
        assert_eq!(net.model.wrench_frame(), frame);
        assert_eq!(net.model.actuators(), losses.actuators.as_ref());
        let [before, after] = [&of_motors, &net]
            .map(|trained| train::assess(&trained.model, &test).expect("the model fits"));
        assert!(
            after.torque_r2 > before.torque_r2 && after.torque_r2 > 0.97,
            "{after:?}"
        );
        assert!(
            after.prediction_x_m < 0.002 && after.prediction_z_m < 0.002,
            "{after:?}"
        );
        assert!(
            after.prediction_z_m < 0.85 * before.prediction_z_m,
            "{before:?} {after:?}"
        );
        // Simulation, control and training report the same lift accuracy, and commands include the losses.
        let assessed = Assessment::over(&net.model, &test, 0.1).expect("the model fits");
        let r2 = assessed.lift.torque.r2_all().expect("samples");
        assert!(
            (r2 - after.torque_r2).abs() < 1e-6,
            "{r2} {}",
            after.torque_r2
        );
        let mut controller =
            romc::mpc::controller(&net.model, MpcSettings::default()).expect("complete");
        let along = ReferenceInput::Recorded;
        let run = along_recording(&mut controller, &test[0], along, |_, _| {}).expect("runs");
        let found = run.summary.torque_r2.contact.expect("contact");
        assert!(
            found > 0.9 && run.summary.limit_violations == 0,
            "{:?}",
            run.summary
        );
        let ignorant = net
            .model
            .into_builder()
            .actuators(None)
            .build()
            .expect("sound");
        let mut ignorant =
            romc::mpc::controller(&ignorant, MpcSettings::default()).expect("complete");
        let run = along_recording(&mut ignorant, &test[0], along, |_, _| {}).expect("runs");
        assert!(run.summary.torque_r2.contact.expect("contact") != found);
    }
}

/// A jump with 0.2 s of rest before and after it: its first and last state, with constant torques.
fn with_rest(mut jump: Recording) -> Recording {
    let segment = &mut jump.segments[0];
    let (count, step_s) = (segment.len(), segment.mean_step_s());
    let n_rest = (0.2 / step_s).round() as usize;
    let source = |k: usize| k.saturating_sub(n_rest).min(count - 1);
    let padded = |values: &DMatrix<f64>, at_rest: f64| {
        DMatrix::from_fn(values.nrows(), count + 2 * n_rest, |row, k| {
            let moves = (n_rest..n_rest + count).contains(&k);
            values[(row, source(k))] * if moves { 1.0 } else { at_rest }
        })
    };
    segment.dx = padded(&segment.dx, 0.0);
    segment.ddx = padded(&segment.ddx, 0.0);
    segment.x = padded(&segment.x, 1.0);
    segment.torque_nm = padded(&segment.torque_nm, 1.0);
    segment.body_wrench = segment
        .body_wrench
        .as_ref()
        .map(|wrench| padded(wrench, 1.0));
    segment.feet = (0..count + 2 * n_rest)
        .map(|k| segment.feet[source(k)])
        .collect();
    let start_s = segment.time_s[0];
    segment.time_s = (0..count + 2 * n_rest)
        .map(|k| start_s + step_s * k as f64)
        .collect();
    jump
}

#[test]
fn model_with_quadratic_drag_is_controlled_at_rest() {
    let drag = ["dz1*sqrt(dz1^2+dz2^2)", "dz2*sqrt(dz1^2+dz2^2)"];
    let terms = ["1", "z1", "z2", "dz1", "dz2", "u1", "u2"]
        .into_iter()
        .chain(drag);
    let options = TrainOptions {
        library: Some(LibraryChoice::Terms(terms.map(str::to_owned).collect())),
        ..TrainOptions::new("drag", 2)
    };
    let trained =
        train_with(&jumps("train", 14), &jumps("validation", 3), &options).expect("trains");
    // Whether drag is among the kept terms depends on the jumps; a model with drag must be controllable.
    let mut phases = trained.model.phases().to_vec();
    for phase in &mut phases {
        (phase.xi[(7, 0)], phase.xi[(8, 1)]) = (-0.4, -0.4);
    }
    let model = trained.model.into_builder().phases(phases).build();
    let model = model.expect("sound");
    let jump = jumps("test", 1).remove(0);
    for jump in [jump.clone(), with_rest(jump)] {
        let mut controller =
            romc::mpc::controller(&model, MpcSettings::default()).expect("complete");
        let along = ReferenceInput::Recorded;
        let run = along_recording(&mut controller, &jump, along, |_, _| {}).expect("runs");
        assert_eq!(run.summary.failed, 0, "{:?}", run.summary);
    }
}

#[test]
fn training_with_a_negative_friction_is_refused_with_its_joint() {
    let mut losses = losses_of_the_simulated_go1();
    losses.viscous[4] = -1.0;
    let options = TrainOptions {
        actuators: Some(losses),
        ..TrainOptions::new("d2", 2)
    };
    let error = train_with(&jumps("train", 1), &[], &options).expect_err("no friction drives");
    assert!(error.to_string().contains("viscous -1 at fl.hy"), "{error}");
}

#[test]
fn first_latents_are_body_x_and_z() {
    let model = trained(4).model;
    let weights = model.encoder().expect("trained").weights().clone();
    let dominant: Vec<usize> = (0..2)
        .map(|row| weights.row(row).transpose().icamax())
        .collect();
    assert_eq!(dominant, [12, 14]);
}

/// Mean and standard deviation of the acceleration along rows of scaled states over 50 ms in flight, m/s^2.
fn accelerations_in_flight(jump: &Recording, rows: &DMatrix<f64>) -> [[f64; 2]; 2] {
    const TRIM: usize = 4;
    let segment = &jump.segments[0];
    let in_air: Vec<usize> = (0..segment.len())
        .filter(|&sample| segment.feet[sample] == [false; 4])
        .collect();
    let inside = &in_air[TRIM..in_air.len() - TRIM];
    let window = (0.05 / segment.mean_step_s()).round() as usize;
    let changes = inside.windows(window + 1).map(|samples| {
        let (first, last) = (samples[0], samples[window]);
        let duration = segment.time_s[last] - segment.time_s[first];
        rows * (segment.dx.column(last) - segment.dx.column(first)) / duration
    });
    let changes = DMatrix::from_columns(&changes.collect::<Vec<_>>());
    [0, 1].map(|row| [changes.row(row).mean(), changes.row(row).variance().sqrt()])
}

#[test]
fn centre_of_mass_of_an_encoder_falls_freely_where_the_body_does_not() {
    let encoder = trained(4)
        .model
        .encoder()
        .expect("trained")
        .weights()
        .clone();
    let rows = encoder.rows(0, 2).into_owned();
    let jump = jumps("test", 2).remove(1);
    let [[x, x_spread], [z, spread]] = accelerations_in_flight(&jump, &rows);
    assert!((z + 9.81).abs() < 0.1 && spread < 0.3, "{z} {spread}");
    assert!(x.abs() < 0.1 && x_spread < 0.3, "{x} {x_spread}");
    let body = DMatrix::from_fn(2, 18, |row, i| f64::from(i == [12, 14][row]));
    let [_, [_, of_body]] = accelerations_in_flight(&jump, &body);
    assert!(of_body > 2.0 * x_spread, "{of_body}");
    // Legs are light: one radian of a joint moves the whole robot by at most 2 cm.
    assert!(rows.columns(0, 12).amax() < 0.02, "{rows}");
}

#[test]
fn training_twice_gives_the_same_file() {
    let text = |trained: &Trained| romc::artifact::to_text(&trained.model);
    assert_eq!(text(&trained(2)), text(&trained(2)));
}

#[test]
fn hardware_jump_is_reconstructed_and_lifted() {
    let Some(path) = outside::hardware_jump() else {
        return;
    };
    let jump = recording::read(&path).expect("hardware jump");
    let figures = train::assess(&trained(4).model, &[jump]).expect("the model fits the recording");
    assert!(
        figures.decoder_mse <= 8e-5 && figures.torque_r2 >= 0.4,
        "{figures:?}"
    );
}

#[test]
fn training_without_flight_is_refused_with_what_is_missing() {
    let mut training = jumps("train", 1);
    for segment in &mut training[0].segments {
        segment.feet.fill([true; 4]);
    }
    let error = train_with(&training, &[], &TrainOptions::new("m", 2)).expect_err("no flight");
    assert!(
        matches!(&error, TrainError::PhaseSamples { phase, found: 0, .. } if phase == "flight"),
        "{error}"
    );
}

#[test]
fn training_without_recordings_is_refused() {
    let error = train_with(&[], &[], &TrainOptions::new("m", 2)).expect_err("nothing to learn");
    assert!(matches!(error, TrainError::NoRecording));
}

#[test]
fn training_on_a_stub_is_refused_with_its_place() {
    let mut training = jumps("train", 1);
    let stub = training[0].segments[0].slice(0..20);
    training[0].segments = vec![stub];
    let error = train_with(&training, &[], &TrainOptions::new("m", 2)).expect_err("too short");
    assert!(
        matches!(&error, TrainError::TooFewSamples { path, row: 2, found: 20, .. } if path.ends_with("train_01.csv.gz")),
        "{error}"
    );
}

#[test]
fn training_with_more_latents_than_coordinates_is_refused() {
    for latent_dim in [0, 16] {
        let error = train_with(&jumps("train", 1), &[], &TrainOptions::new("m", latent_dim));
        let error = error.expect_err("impossible latent dimension").to_string();
        assert!(error.contains(&latent_dim.to_string()), "{error}");
    }
}

#[test]
fn training_with_a_negative_lift_weight_is_refused() {
    let mut options = TrainOptions::new("m", 2);
    options.encoder.lift_weight = -1.0;
    let error = train_with(&jumps("train", 1), &[], &options).expect_err("negative weight");
    assert!(
        matches!(&error, TrainError::Range(refusal) if refusal.name == "lift-weight"),
        "{error}"
    );
}

#[test]
fn training_with_predictions_over_more_than_a_batch_is_refused() {
    let mut options = TrainOptions::new("m", 2);
    options.joint.unroll.window = 20;
    options.check().expect("without a weight it does not count");
    options.joint.weights.bptt = 1.0;
    for (window, stride) in [(20, 5), (1000, 5)] {
        options.joint.unroll.window = window;
        let error = options.check().expect_err("no batch has room");
        let expected = format!("{window} x {stride} with batches of 100");
        assert!(
            matches!(&error, TrainError::Option { found, .. } if *found == expected),
            "{error}"
        );
    }
    options.joint.unroll.window = 19;
    options.check().expect("a batch has room");
}

#[test]
fn training_with_terms_that_are_not_finite_is_refused_with_their_place() {
    for (refused, undefined) in [("exp(10000*dz1)", false), ("log(z1)", true)] {
        let terms = ["1", "z1", "dz1", "u1", refused];
        let mut options = TrainOptions::new("m", 1);
        options.library = Some(LibraryChoice::Terms(terms.map(str::to_owned).to_vec()));
        let mut networks = options.clone();
        (networks.joint.schedule, networks.joint.maps) = {
            let few = few_epochs(Activation::Tanh).joint;
            (few.schedule, few.maps)
        };
        let methods = [
            (Method::ClosedForm, &options),
            (Method::Joint, &options),
            (Method::Joint, &networks),
        ];
        for (method, options) in methods {
            let error = cancelled_at(method, options, |_| false).expect_err("no finite value");
            let place = error.to_string();
            let TrainError::TermValue { term, found, .. } = error else {
                panic!("{place}")
            };
            assert_eq!((term.as_str(), found.is_nan()), (refused, undefined));
            let named = [
                "train_01.csv.gz: term `",
                "at sample ",
                "in phase `contact`",
            ];
            assert!(named.iter().all(|part| place.contains(part)), "{place}");
        }
    }
}

#[test]
fn cancelled_training_ends_without_a_model_when_none_is_complete() {
    let (cancel, mut listener) = (AtomicBool::new(true), |_: Progress| ());
    let training = jumps("train", 1);
    let result = Method::ClosedForm.learn(
        Recordings::new(&training, &[]),
        go1(),
        &TrainOptions::new("m", 2),
        &Origin::new("romc train", paths(&training)),
        &mut Monitor::new(&mut listener, &cancel),
    );
    assert!(matches!(result, Err(TrainError::Cancelled)));
}

/// Trains on two jumps and cancels at the first progress report for which `ends` is true.
fn cancelled_at(
    method: Method,
    options: &TrainOptions,
    ends: impl Fn(&Progress) -> bool,
) -> Result<Trained, TrainError> {
    let cancel = AtomicBool::new(false);
    let mut listener = |progress: Progress| {
        if ends(&progress) {
            cancel.store(true, Ordering::Relaxed);
        }
    };
    let training = jumps("train", 2);
    let recordings = Recordings::new(&training, &[]);
    let mut monitor = Monitor::new(&mut listener, &cancel);
    method.learn(recordings, go1(), options, &Origin::default(), &mut monitor)
}

fn is_done_with(progress: &Progress, part: &str) -> bool {
    matches!(progress, Progress::Done { text, .. } if text.contains(part))
}

#[test]
fn joint_training_cancelled_during_descent_gives_a_model() {
    let mut options = TrainOptions::new("m", 2);
    options.joint.threads = 1;
    options.n_seeds = 2;
    let networks = few_epochs(Activation::Tanh);
    for transfer in [Transfer::Chosen, Transfer::Published] {
        for mut options in [options.clone(), networks.clone()] {
            options.joint.transfer = transfer;
            let ended = cancelled_at(Method::Joint, &options, |progress| {
                is_done_with(progress, "epoch 4:")
            });
            let Trained { model, report } = ended.expect("the best so far");
            assert_eq!(report.seeds.len(), 1, "{transfer:?}");
            let training = jumps("train", 1);
            train::assess(&model, &training).expect("the model fits the recordings");
        }
    }
}

#[test]
fn joint_training_cancelled_during_descent_of_a_curved_library_gives_a_model() {
    let mut options = TrainOptions::new("m", 2);
    options.library = Some(LibraryChoice::Standard(StandardLibrary {
        degree: 3,
        trigonometric: false,
        inputs: true,
    }));
    let ended = cancelled_at(Method::Joint, &options, |progress| {
        is_done_with(progress, "epoch 4:")
    });
    let report = ended.expect("the best so far").report;
    assert!(report.choice.is_some_and(|choice| choice.score.is_finite()));
}

#[test]
fn joint_training_cancelled_before_its_start_ends_without_a_model() {
    let ended = cancelled_at(Method::Joint, &TrainOptions::new("m", 2), |_| true);
    assert!(matches!(ended, Err(TrainError::Cancelled)), "{ended:?}");
}

#[test]
fn closed_form_cancelled_during_a_later_seed_keeps_the_seeds_begun() {
    let mut options = TrainOptions::new("m", 2);
    options.n_seeds = 4;
    for (stage, begun) in [
        ("searching the latent space", 2),
        ("fitting the dynamics", 2),
    ] {
        let seen = Cell::new(0);
        let ended = cancelled_at(Method::ClosedForm, &options, |news| {
            seen.set(
                seen.get()
                    + usize::from(matches!(news, Progress::Stage { name, .. } if *name == stage)),
            );
            seen.get() == begun
        });
        let report = ended.expect("the best so far").report;
        assert_eq!(report.seeds.len(), begun, "{stage}");
    }
}

fn joint(training: &[Recording], options: &TrainOptions, news: &mut Vec<String>) -> Trained {
    joint_with([training, &[]], options, news).expect("trains")
}

/// Trains on recordings, with others for validation.
fn joint_with(
    [training, validation]: [&[Recording]; 2],
    options: &TrainOptions,
    news: &mut Vec<String>,
) -> Result<Trained, TrainError> {
    let cancel = AtomicBool::new(false);
    let mut listener = |progress: Progress| {
        if let Progress::Done { text, .. } = progress {
            news.push(text);
        }
    };
    let recordings = Recordings::new(training, validation);
    let origin = Origin::new("romc train", paths(training));
    let mut monitor = Monitor::new(&mut listener, &cancel);
    Method::Joint.learn(recordings, go1(), options, &origin, &mut monitor)
}

fn few_epochs(activation: Activation) -> TrainOptions {
    let mut options = TrainOptions::new("curved", 2);
    options.joint.schedule.epochs = 6;
    options.joint.schedule.refinement = 2;
    options.joint.maps.encoder_layers = vec![8, 6];
    options.joint.maps.decoder_layers = vec![6, 8];
    options.joint.maps.activation = activation;
    options
}

/// The loss of an epoch in a progress line.
fn loss(news: &str) -> f64 {
    let after = news.split("loss ").nth(1).expect("the loss is told");
    let number = after.split(',').next().expect("a number");
    number.parse().expect("a number")
}

#[test]
fn joint_training_of_networks_lowers_the_loss_and_gives_a_model_that_simulates() {
    let training = jumps("train", 3);
    for activation in [Activation::Elu, Activation::Tanh, Activation::Sigmoid] {
        let mut news = Vec::new();
        let Trained { model, report } = joint(&training, &few_epochs(activation), &mut news);
        let epochs: Vec<&String> = news.iter().filter(|text| text.contains("epoch")).collect();
        assert_eq!(epochs.len(), 8, "{news:?}");
        assert!(
            loss(epochs[7]) < 0.9 * loss(epochs[0]),
            "{activation}: {epochs:?}"
        );

        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("curved.json");
        artifact::write(&path, &model, Overwrite::Refuse).expect("writable");
        let read = artifact::read(&path).expect("a model file");
        let encoder = read.encoder_map().expect("trained");
        assert_eq!(
            encoder.summary(),
            format!("18 -> 8 {activation} -> 6 {activation} -> 2")
        );
        assert_eq!(encoder, model.encoder_map().expect("trained"));
        let figures = train::assess(&read, &training).expect("fits the recordings");
        let close = (figures.decoder_mse / report.training.decoder_mse - 1.0).abs() < 1e-9;
        assert!(close, "{figures:?} {:?}", report.training);

        let compiled = CompiledModel::new(&read).expect("compiles");
        let latent = LatentSegment::encode(&read, &training[0].segments[0]).expect("encodes");
        let predicted = rollout(&compiled, &latent, Restart::Every(0.1));
        assert_eq!(predicted.diverged_at_s(), None);
    }
}

#[test]
fn joint_training_of_networks_is_the_same_on_any_number_of_threads() {
    let training = jumps("train", 2);
    let with = |threads: usize, transfer: Transfer| {
        let mut options = few_epochs(Activation::Tanh);
        options.n_seeds = 3;
        options.joint.threads = threads;
        options.joint.transfer = transfer;
        artifact::to_text(&joint(&training, &options, &mut Vec::new()).model)
    };
    for transfer in [Transfer::Chosen, Transfer::Published] {
        assert_eq!(with(1, transfer), with(3, transfer), "{transfer:?}");
    }
}

#[test]
fn hidden_layers_are_refused_where_they_make_no_sense() {
    let refused = |options: &TrainOptions, name: &str| {
        let error = train_with(&jumps("train", 1), &[], options).expect_err("no sense");
        let expected = matches!(&error, TrainError::Option { option, .. } if *option == name);
        assert!(expected, "{error}");
    };
    let mut options = few_epochs(Activation::Elu);
    refused(&options, "encoder-layers or decoder-layers");
    options.joint.maps.encoder_layers = vec![8, 1];
    let training = jumps("train", 1);
    let (cancel, mut listener) = (AtomicBool::new(false), |_: Progress| ());
    let recordings = Recordings::new(&training, &[]);
    let mut monitor = Monitor::new(&mut listener, &cancel);
    let narrow = Method::Joint.learn(
        recordings,
        go1(),
        &options,
        &Origin::default(),
        &mut monitor,
    );
    assert!(
        matches!(&narrow, Err(TrainError::Option { option: "encoder-layers", found, .. }) if found == "[8, 1]"),
        "{narrow:?}"
    );
}

fn split(text: &str) -> Split {
    text.parse().expect("shares")
}

#[test]
fn split_takes_every_jump_into_one_set_and_depends_on_the_seed_alone() {
    let sets = split("14,3,3").of(20, 5).expect("enough jumps");
    assert_eq!(sets.each_ref().map(Vec::len), [14, 3, 3]);
    assert!(sets.iter().all(|set| set.is_sorted()));
    let mut all = sets.concat();
    all.sort_unstable();
    assert_eq!(all, (0..20).collect::<Vec<_>>());
    assert_eq!(sets, split("14,3,3").of(20, 5).expect("enough"));
    assert_ne!(sets, split("14,3,3").of(20, 6).expect("enough"));
}

#[test]
fn split_gives_each_set_its_share_and_none_without_one() {
    for (shares, jumps, expected) in [
        ("14,3,3", 20, [14, 3, 3]),
        ("70,15,15", 20, [14, 3, 3]),
        ("70,15,15", 3, [1, 1, 1]),
        ("1,1,1", 5, [2, 2, 1]),
        ("98,1,1", 10, [8, 1, 1]),
        ("4,1", 10, [8, 2, 0]),
        ("1,0,1", 4, [2, 0, 2]),
    ] {
        let sets = split(shares).of(jumps, 1).expect("enough jumps");
        assert_eq!(sets.map(|set| set.len()), expected, "{shares} of {jumps}");
    }
    assert!(matches!(
        split("14,3,3").of(2, 1),
        Err(TrainError::Split {
            found: 2,
            expected: 3
        })
    ));
}

#[test]
fn shares_that_are_not_two_or_three_numbers_are_refused() {
    for text in ["14", "0,3,3", "14,3,3,3", "14,-3", "a,b", ""] {
        let message = text.parse::<Split>().expect_err("refused");
        assert!(message.contains("14,3,3"), "{text}: {message}");
    }
}
