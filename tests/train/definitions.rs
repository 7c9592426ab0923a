//! Trained models compared with definitions: of the losses, of the row space, of the known physics.

use nalgebra::{DMatrix, DVector};
use romc::artifact;
use romc::model::{Activation, LibraryChoice, ReducedModel};
use romc::recording::Recording;
use romc::recording::preprocess::{moving_average, prepare};
use romc::robot::{GRAVITY_M_S2, Robot};
use romc::train::{Coordinates, TrainError, TrainOptions, Trained, Transfer};

use super::{few_epochs, go1, joint, joint_with, jumps, train_with, trained};

/// Samples of a batch in columns: `x`, `dx`, `ddx` and `u` (scaled), and `z`, `dz`, `u_lat` stacked.
struct Batch {
    phase: usize,
    step_s: f64,
    blocks: [DMatrix<f64>; 4],
    ddz: DMatrix<f64>,
    variables: DMatrix<f64>,
    lifted: DMatrix<f64>,
}

fn columns(n: usize, of: impl Fn(usize) -> DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_columns(&(0..n).map(of).collect::<Vec<_>>())
}

fn stacked(parts: [DVector<f64>; 3]) -> DVector<f64> {
    let values = parts.iter().flatten().copied().collect();
    DVector::from_vec(values)
}

fn batches(model: &ReducedModel, options: &TrainOptions, jump: &Recording) -> Vec<Batch> {
    let rule = options.input_rule(go1());
    let state = DMatrix::from_diagonal(&model.state_factors().expect("trained"));
    let input = DMatrix::from_diagonal(&model.input_factors().expect("trained"));
    let encoder = model.encoder_map().expect("trained");
    let mut all = Vec::new();
    for (span, samples) in prepare(jump, &options.phases).expect("phases") {
        let u = samples.input(&rule).expect("inputs");
        let ddx = moving_average(&samples.ddx, options.regression.smoothing);
        let whole = [
            &state * &samples.x,
            &state * &samples.dx,
            &state * ddx,
            &input * u,
        ];
        for start in (0..samples.len()).step_by(100) {
            let blocks = whole
                .each_ref()
                .map(|rows| rows.columns(start, 100).into_owned());
            let at = |block: usize, k: usize| blocks[block].column(k).into_owned();
            let rates = |k| {
                encoder
                    .apply_rates(&at(0, k), &at(1, k), &at(2, k))
                    .expect("fits")
            };
            let jacobian = |k| encoder.jacobian(&at(0, k)).expect("fits");
            let u_lat = |k| {
                let lift = jacobian(k).transpose();
                lift.pseudo_inverse(1e-12).expect("positive") * at(3, k)
            };
            all.push(Batch {
                phase: span.phase,
                step_s: samples.mean_step_s(),
                ddz: columns(100, |k| rates(k)[2].clone()),
                variables: columns(100, |k| {
                    let [z, dz, _] = rates(k);
                    stacked([z, dz, u_lat(k)])
                }),
                lifted: columns(100, |k| jacobian(k).transpose() * u_lat(k)),
                blocks,
            });
        }
    }
    all
}

/// `ddz` of a phase, evaluated by the library, for variables in columns.
fn accelerations(model: &ReducedModel, phase: usize, variables: &DMatrix<f64>) -> DMatrix<f64> {
    let theta = model.library().evaluate_points(variables).expect("fits");
    (theta * &model.phases()[phase].xi).transpose()
}

/// Mean square of predictions by the midpoint rule over a window, see equation (41).
fn prediction_loss(model: &ReducedModel, options: &TrainOptions, batch: &Batch) -> f64 {
    let unroll = &options.joint.unroll;
    let (d, stride, n) = (model.latent_dim(), unroll.stride, batch.variables.ncols());
    let (starts, h) = (n - unroll.window * stride, batch.step_s * stride as f64);
    let mut state = batch.variables.view((0, 0), (2 * d, starts)).into_owned();
    let slope = |state: &DMatrix<f64>, first: usize| {
        let mut variables = state.clone().resize_vertically(3 * d, 0.0);
        let inputs = batch.variables.view((2 * d, first), (d, starts));
        variables.rows_mut(2 * d, d).copy_from(&inputs);
        let mut slope = state.clone();
        slope.rows_mut(0, d).copy_from(&state.rows(d, d));
        slope
            .rows_mut(d, d)
            .copy_from(&accelerations(model, batch.phase, &variables));
        slope
    };
    let mut loss = 0.0;
    for step in 0..unroll.window {
        let half = &state + slope(&state, step * stride) * (0.5 * h);
        state += slope(&half, step * stride + stride / 2) * h;
        let truth = batch.variables.view((0, (step + 1) * stride), (d, starts));
        loss += unroll.decay.powi(step as i32) * (state.rows(0, d) - truth).norm_squared();
    }
    loss / (unroll.window * starts * d) as f64
}

/// Equation (20) on a batch, by equations (16) to (19), the lift loss and (41).
fn combined_loss(model: &ReducedModel, options: &TrainOptions, batch: &Batch) -> f64 {
    let weights = &options.joint.weights;
    let (decoder, d) = (model.decoder_map().expect("trained"), model.latent_dim());
    let predicted = accelerations(model, batch.phase, &batch.variables);
    let decoded = |k: usize| {
        let block = |start: usize| {
            batch
                .variables
                .view((start, k), (d, 1))
                .column(0)
                .into_owned()
        };
        let ddz = predicted.column(k).into_owned();
        decoder
            .apply_rates(&block(0), &block(d), &ddz)
            .expect("fits")
    };
    let n = batch.variables.ncols();
    let mut missed = columns(n, |k| decoded(k)[0].clone()) - &batch.blocks[0];
    missed
        .rows_mut(12, 3)
        .scale_mut(options.encoder.body_weight.sqrt());
    let mean_square = |m: DMatrix<f64>| m.norm_squared() / m.len() as f64;
    let xi = &model.phases()[batch.phase].xi;
    let u = &batch.blocks[3];
    mean_square(missed)
        + weights.ddz * mean_square(&predicted - &batch.ddz)
        + weights.ddx * mean_square(columns(n, |k| decoded(k)[2].clone()) - &batch.blocks[2])
        + weights.l1 * xi.abs().mean()
        + weights.lift * (u - &batch.lifted).norm_squared() / u.norm_squared()
        + weights.bptt * prediction_loss(model, options, batch)
}

#[test]
fn score_of_a_published_training_is_the_combined_loss_by_its_definition() {
    let terms = [
        "1",
        "z1",
        "dz2",
        "u1",
        "z1*dz1*u2",
        "sin(z1 + 2*z2)",
        "cos(dz1)*z2",
        "exp(-z1^2)",
        "tanh(u1)/(2 + z2^2)",
        "sqrt(2 + z1^2)",
        "abs(z2)",
        "log(3 + dz2^2)",
        "tan(0.1*z1)",
        "(2 + z1^2)^sin(z2)",
        "z1^3",
    ];
    let (training, validation) = (jumps("train", 2), jumps("validation", 1));
    for activation in Activation::ALL {
        let mut options = few_epochs(activation);
        options.library = Some(LibraryChoice::Terms(terms.map(str::to_owned).to_vec()));
        if activation == Activation::Linear {
            options.joint.maps.encoder_layers.clear();
            options.joint.maps.decoder_layers.clear();
        }
        options.joint.transfer = Transfer::Published;
        let weights = &mut options.joint.weights;
        (weights.ddz, weights.ddx, weights.l1) = (0.5, 0.3, 0.1);
        (weights.lift, weights.bptt) = (0.2, 0.4);
        (options.joint.unroll.window, options.joint.unroll.stride) = (3, 4);
        let trained = joint_with([&training, &validation], &options, &mut Vec::new());
        let Trained { model, report } = trained.expect("trains");
        let batches = batches(&model, &options, &validation[0]);
        let losses = batches
            .iter()
            .map(|batch| combined_loss(&model, &options, batch));
        let expected = losses.sum::<f64>() / batches.len() as f64;
        let found = report.seeds[0].score;
        assert!(
            (found - expected).abs() < 1e-8 * expected,
            "{activation}: {found} {expected}"
        );
    }
}

#[test]
fn coefficients_that_thresholding_drops_stay_zero() {
    let mut options = few_epochs(Activation::Linear);
    options.joint.maps.encoder_layers.clear();
    options.joint.maps.decoder_layers.clear();
    options.joint.transfer = Transfer::Published;
    options.joint.xi_start = 0.02;
    let schedule = &mut options.joint.schedule;
    (schedule.epochs, schedule.threshold_every) = (30, 5);
    (schedule.threshold, schedule.learning_rate) = (0.04, 2e-3);
    let mut news = Vec::new();
    let model = joint(&jumps("train", 2), &options, &mut news).model;
    let count = |text: &String| -> Option<usize> {
        let (_, active) = text.strip_suffix(" terms")?.rsplit_once(", ")?;
        active.parse().ok()
    };
    let counts: Vec<usize> = news.iter().filter_map(count).collect();
    assert_eq!(counts.len(), 32, "{news:?}");
    assert!(
        counts[31] < counts[0] && counts.is_sorted_by(|a, b| a >= b),
        "{counts:?}"
    );
    for phase in model.phases() {
        let left = phase.xi.iter().filter(|value| **value != 0.0).count();
        assert!(left > 0 && left < phase.xi.len(), "{}", phase.xi);
    }
}

#[test]
fn seeds_that_end_in_numbers_that_are_not_finite_give_no_model() {
    let mut options = few_epochs(Activation::Tanh);
    options.joint.transfer = Transfer::Published;
    options.joint.schedule.learning_rate = 1e300;
    let training = jumps("train", 1);
    let ended = joint_with([&training, &[]], &options, &mut Vec::new());
    assert!(matches!(ended, Err(TrainError::Model(_))), "{ended:?}");
}

#[test]
fn seed_of_least_score_is_kept_and_its_model_is_that_of_this_seed_alone() {
    let training = jumps("train", 2);
    let mut options = few_epochs(Activation::Tanh);
    options.n_seeds = 3;
    let several = joint(&training, &options, &mut Vec::new());
    let scores: Vec<f64> = several.report.seeds.iter().map(|seed| seed.score).collect();
    assert!(scores.len() == 3 && scores.is_sorted(), "{scores:?}");
    let overlap = several.report.support_overlap.expect("several seeds");
    assert!(overlap > 0.0 && overlap < 1.0, "{overlap}");
    (options.seed, options.n_seeds) = (several.report.seeds[0].seed, 1);
    let alone = joint(&training, &options, &mut Vec::new());
    let text = |model: ReducedModel| {
        let model = model.into_builder().provenance(Default::default()).build();
        artifact::to_text(&model.expect("sound"))
    };
    assert_eq!(text(several.model), text(alone.model));
}

#[test]
fn seeds_of_the_closed_form_agree_on_every_term() {
    let mut options = TrainOptions::new("m", 2);
    options.n_seeds = 2;
    let trained = train_with(&jumps("train", 2), &[], &options).expect("trains");
    assert_eq!(trained.report.support_overlap, Some(1.0));
}

#[test]
fn coordinates_that_rest_without_torque_do_not_enter_the_encoder() {
    let training = jumps("train", 2);
    let networks = joint(&training, &few_epochs(Activation::Elu), &mut Vec::new());
    let mut options = TrainOptions::new("m", 4);
    options.encoder.coordinates = Coordinates::Free;
    let linear = train_with(&training, &[], &options).expect("trains");
    for Trained { model, report } in [networks, linear] {
        let first = model.encoder_map().expect("trained").layers()[0]
            .map
            .weights();
        for (name, column) in Robot::state_names().iter().zip(first.column_iter()) {
            assert_eq!(column.amax() > 0.0, report.encoded.contains(name), "{name}");
        }
        // A hip that a torque holds at rest is kept.
        assert!(report.encoded.len() < 18 && report.encoded.contains(&"fr.hx".to_owned()));
    }
}

/// Scaled states of all samples.
fn states(recordings: &[Recording], options: &TrainOptions) -> DMatrix<f64> {
    let segments = recordings.iter().flat_map(|recording| &recording.segments);
    let columns = segments.flat_map(|segment| segment.x.column_iter().map(|x| x.into_owned()));
    DMatrix::from_columns(&columns.collect::<Vec<_>>()) * options.scaling.state
}

#[test]
fn without_lift_and_weights_the_space_is_that_of_the_principal_components() {
    let training = jumps("train", 3);
    let mut options = TrainOptions::new("m", 3);
    options.encoder.coordinates = Coordinates::Free;
    (options.encoder.lift_weight, options.encoder.body_weight) = (0.0, 1.0);
    options.encoder.least_std = 0.0;
    let report = train_with(&training, &[], &options).expect("trains").report;
    let x = states(&training, &options);
    let mean = x.column_mean();
    let deviations = columns(x.ncols(), |k| x.column(k) - &mean);
    let covariance = &deviations * deviations.transpose() / x.ncols() as f64;
    let mut eigenvalues = covariance.symmetric_eigenvalues();
    eigenvalues.as_mut_slice().sort_by(f64::total_cmp);
    let (found, least) = (
        report.training.decoder_mse,
        eigenvalues.rows(0, 15).sum() / 18.0,
    );
    assert!((found - least).abs() < 1e-6 * least, "{found} {least}");
}

#[test]
fn latent_basis_is_as_simple_as_varimax_makes_it() {
    let training = jumps("train", 3);
    let mut options = TrainOptions::new("m", 4);
    options.encoder.coordinates = Coordinates::Free;
    let std = states(&training, &options).column_variance().map(f64::sqrt);
    let criterion = |loadings: &DMatrix<f64>| -> f64 {
        let squares = loadings.component_mul(loadings);
        squares.column_iter().map(|column| column.variance()).sum()
    };
    let loadings = |options: &TrainOptions| {
        let model = train_with(&training, &[], options).expect("trains").model;
        DMatrix::from_diagonal(&std) * model.encoder().expect("linear").weights().transpose()
    };
    let rotated = loadings(&options);
    options.encoder.rotate = false;
    assert!(criterion(&rotated) > 1.001 * criterion(&loadings(&options)));
    for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
        for angle in [-1e-3_f64, 1e-3] {
            let mut turn = DMatrix::identity(4, 4);
            (turn[(a, a)], turn[(b, b)]) = (angle.cos(), angle.cos());
            (turn[(a, b)], turn[(b, a)]) = (angle.sin(), -angle.sin());
            assert!(
                criterion(&(&rotated * turn)) < criterion(&rotated),
                "{a} {b}"
            );
        }
    }
}

#[test]
fn named_coordinates_obey_what_is_known_of_them() {
    let Trained { model, .. } = trained(4);
    // 1, z1 to z4, dz1 to dz4, u1 to u4.
    let (z, dz, u) = (1..5, 5, 9);
    let [contact, flight] = [0, 1].map(|phase| &model.phases()[phase].xi);
    for xi in [contact, flight] {
        assert_eq!(
            xi.row(z.start).amax(),
            0.0,
            "the floor is the same everywhere"
        );
        assert_eq!(
            xi.view((z.start, 0), (4, 2)).amax(),
            0.0,
            "forces move a centre of mass"
        );
        assert!(
            xi[(dz, 0)] <= 0.0 && xi[(dz + 1, 1)] <= 0.0,
            "losses brake: {xi}"
        );
    }
    let gravity = -GRAVITY_M_S2 * 0.1;
    assert_eq!((flight[(0, 1)], flight.column(0).amax()), (gravity, 0.0));
    assert_eq!(
        flight.view((1, 1), (12, 1)).amax(),
        0.0,
        "nothing pushes in flight"
    );
    assert_eq!(flight.rows(u, 2).amax(), 0.0, "{flight}");
    // Kept: the own force of every coordinate, and the constant vertical term for the weight carried by the ground.
    assert!(
        (0..4).all(|k| contact[(u + k, k)] != 0.0) && contact[(0, 1)] != 0.0,
        "{contact}"
    );
    let others = (0..13).filter(|&term| contact[(term, 1)] != 0.0);
    assert!(others.eq([0, dz + 1, u + 1]), "{contact}");
}

#[test]
fn deviations_of_a_jump_are_explained_by_its_own_inputs_alone() {
    let mut training = jumps("train", 8);
    let score = |training: &[Recording]| {
        let trained = train_with(training, &[], &TrainOptions::new("m", 4)).expect("trains");
        let mut parts = trained.report.deviations.into_iter();
        let thrust = parts.find(|score| score.part == "thrust");
        thrust.expect("a thrust").ddz_r2
    };
    let right = score(&training);
    let torques: Vec<_> = training
        .iter()
        .map(|jump| jump.segments[0].torque_nm.clone())
        .collect();
    for (k, jump) in training.iter_mut().enumerate() {
        let (own, other) = (&mut jump.segments[0], &torques[(k + 3) % torques.len()]);
        let sample = |i: usize| i.min(other.ncols() - 1);
        own.torque_nm = DMatrix::from_fn(12, own.len(), |row, i| other[(row, sample(i))]);
        own.body_wrench = None;
    }
    let wrong = score(&training);
    assert!(right > 0.3 && wrong < right - 0.1, "{right} {wrong}");
}
