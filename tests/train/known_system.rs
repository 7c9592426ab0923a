//! Training on recordings of a known system of two latents: a driven oscillator in contact, a falling body in flight.

use nalgebra::{DMatrix, DVector, Vector2};
use romc::model::LibraryChoice;
use romc::recording::{Recording, Segment};
use romc::robot::WrenchFrame;
use romc::train::{Coordinates, ScaleOptions, TrainOptions, assess};

use super::{go1, train_with};

const SAMPLES: usize = 200;
/// Samples between contact and flight.
const LIFT_OFF: usize = 120;
const STEP_S: f64 = 0.002;
/// Rows of the state and of the input that move: forwards and upwards.
const ROWS: [usize; 2] = [12, 14];
const CONTACT: usize = 0;
const FLIGHT: usize = 1;
// Rows of Xi.
const Z1: usize = 1;
const DZ1: usize = 3;
const U1: usize = 5;
const U2: usize = 6;

/// Coefficients of contact and flight over 1, z1, z2, dz1, dz2, u1, u2.
fn known() -> [DMatrix<f64>; 2] {
    let mut contact = DMatrix::zeros(7, 2);
    let mut flight = contact.clone();
    (contact[(Z1, 0)], contact[(DZ1, 0)], contact[(U1, 0)]) = (-40.0, -3.0, 5.0);
    (contact[(U2, 1)], contact[(Z1, 1)]) = (8.0, -20.0);
    (flight[(DZ1, 0)], flight[(0, 1)]) = (-0.5, -9.81);
    [contact, flight]
}

/// A jump of the system, integrated with fine steps; `lift_off` ends its contact.
fn jump(xi: &[DMatrix<f64>; 2], number: f64, lift_off: usize) -> Recording {
    let input = |time: f64| Vector2::new((9.0 * time + number).sin(), (5.0 * time).cos());
    let acceleration = |phase: usize, z: &Vector2<f64>, dz: &Vector2<f64>, time: f64| {
        let u = input(time);
        let theta = [1.0, z.x, z.y, dz.x, dz.y, u.x, u.y, dz.x * dz.x];
        let theta = DVector::from_column_slice(&theta[..xi[phase].nrows()]);
        let ddz = xi[phase].tr_mul(&theta);
        Vector2::new(ddz[0], ddz[1])
    };
    let times = (0..SAMPLES).map(|i| i as f64 * STEP_S).collect();
    let mut segment = Segment::still("made.csv", times);
    let mut wrench = DMatrix::zeros(6, SAMPLES);
    let mut z = Vector2::new(0.1 + 0.02 * number, -0.05);
    let mut dz = Vector2::new(0.3, 0.2 - 0.1 * number);
    for i in 0..SAMPLES {
        let (phase, start) = (usize::from(i >= lift_off), segment.time_s[i]);
        let ddz = acceleration(phase, &z, &dz, start);
        for (k, row) in ROWS.into_iter().enumerate() {
            segment.x[(row, i)] = z[k];
            segment.dx[(row, i)] = dz[k];
            segment.ddx[(row, i)] = ddz[k];
            wrench[(row - ROWS[0], i)] = input(start)[k];
        }
        segment.feet[i] = [phase == CONTACT; 4];
        let (fine, h) = (50, STEP_S / 50.0);
        for k in 0..fine {
            let ddz = acceleration(phase, &z, &dz, start + f64::from(k) * h);
            z += dz * h + ddz * (0.5 * h * h);
            dz += ddz * h;
        }
    }
    segment.body_wrench = Some(wrench);
    segment.into()
}

fn jumps(xi: &[DMatrix<f64>; 2], numbers: std::ops::Range<usize>) -> Vec<Recording> {
    numbers
        .map(|number| jump(xi, number as f64, LIFT_OFF))
        .collect()
}

/// Options under which latent coordinates, up to their means, and inputs are those of the system.
fn options() -> TrainOptions {
    let mut options = TrainOptions::new("known", 2);
    options.wrench_frame = WrenchFrame::Body;
    options.scaling = ScaleOptions {
        state: 1.0,
        torque: 1.0,
        force: 1.0,
        moment: 1.0,
    };
    options.encoder.coordinates = Coordinates::Free;
    options.regression.smoothing = 1;
    options.regression.growth_per_s = None;
    options
}

fn learned(xi: &[DMatrix<f64>; 2], options: &TrainOptions) -> Vec<DMatrix<f64>> {
    let trained = train_with(&jumps(xi, 0..4), &jumps(xi, 4..6), options).expect("trains");
    let encoder = trained.model.encoder().expect("linear").weights().clone();
    for (k, row) in ROWS.into_iter().enumerate() {
        let mut unit = DVector::zeros(18);
        unit[row] = 1.0;
        assert!(
            (encoder.row(k).transpose() - unit).amax() < 1e-9,
            "{encoder}"
        );
    }
    let phases = trained.model.phases().iter();
    phases.map(|phase| phase.xi.clone()).collect()
}

/// Compares all coefficients but the constants, which hold the means of the coordinates as well.
fn assert_found(found: &[DMatrix<f64>], truth: &[DMatrix<f64>; 2]) {
    for (found, truth) in found.iter().zip(truth) {
        let terms = 1..truth.nrows();
        for (row, column) in terms.flat_map(|row| [(row, 0), (row, 1)]) {
            let (found, truth) = (found[(row, column)], truth[(row, column)]);
            let close = (found - truth).abs() <= 0.03 * truth.abs();
            assert!(close, "{row} {column}: {found} for {truth}");
        }
    }
    let constants = found[FLIGHT].row(0);
    assert!(
        constants[0] == 0.0 && (constants[1] + 9.81).abs() < 0.05,
        "{constants}"
    );
}

#[test]
fn terms_and_coefficients_of_the_system_are_found_and_no_others() {
    let truth = known();
    let mut options = options();
    assert_found(&learned(&truth, &options), &truth);
    options.regression.refinements = 0;
    assert_found(&learned(&truth, &options), &truth);
}

#[test]
fn term_that_is_not_affine_is_found_among_those_that_are() {
    let mut truth = known().map(|xi| xi.insert_row(7, 0.0));
    truth[CONTACT][(7, 0)] = -4.0;
    let terms = ["1", "z1", "z2", "dz1", "dz2", "u1", "u2", "dz1^2"];
    let mut options = options();
    options.library = Some(LibraryChoice::Terms(terms.map(str::to_owned).to_vec()));
    assert_found(&learned(&truth, &options), &truth);
}

/// Rate of the fastest mode of each phase and of their sequence, 1/s.
fn rates(xi: &[DMatrix<f64>]) -> [f64; 3] {
    let matrices = [CONTACT, FLIGHT].map(|phase| {
        let mut matrix = DMatrix::zeros(4, 4);
        matrix.view_mut((0, 2), (2, 2)).fill_with_identity();
        let lower = xi[phase].rows(Z1, 4).transpose();
        matrix.rows_mut(2, 2).copy_from(&lower);
        matrix
    });
    let fastest = |matrix: &DMatrix<f64>, rate: &dyn Fn(nalgebra::Complex<f64>) -> f64| {
        let values = matrix.complex_eigenvalues();
        values
            .iter()
            .map(|value| rate(*value))
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let of_phase = |phase: usize| fastest(&matrices[phase], &|value| value.re);
    let [first, second] = [LIFT_OFF - 1, SAMPLES - LIFT_OFF - 1].map(|steps| steps as f64 * STEP_S);
    let through = (&matrices[FLIGHT] * second).exp() * (&matrices[CONTACT] * first).exp();
    let of_both = fastest(&through, &|value| value.norm().ln() / (first + second));
    [of_phase(CONTACT), of_phase(FLIGHT), of_both]
}

#[test]
fn dynamics_that_grow_keep_the_bound_in_every_phase_and_through_their_sequence() {
    let mut truth = known();
    (truth[CONTACT][(Z1, 0)], truth[CONTACT][(DZ1, 0)]) = (0.0, 4.0);
    let mut options = options();
    let unbounded = rates(&learned(&truth, &options));
    assert!((unbounded[CONTACT] - 4.0).abs() < 0.2, "{unbounded:?}");
    options.regression.growth_per_s = Some(1.0);
    let bounded = learned(&truth, &options);
    let found = rates(&bounded);
    assert!(found.iter().all(|rate| *rate <= 1.0 + 1e-9), "{found:?}");
    // Inputs do not grow: their coefficients stay near.
    assert!(
        (bounded[CONTACT][(U2, 1)] - 8.0).abs() < 1.0,
        "{}",
        bounded[CONTACT]
    );
    // Each phase is stable by itself, their sequence is not.
    let turn = std::f64::consts::FRAC_PI_2;
    let mut switched = known();
    for (phase, samples) in [(CONTACT, LIFT_OFF), (FLIGHT, SAMPLES - LIFT_OFF)] {
        switched[phase][(Z1, 0)] = -(turn / (samples as f64 * STEP_S)).powi(2);
        switched[phase][(DZ1, 0)] = 0.0;
    }
    options.regression.growth_per_s = Some(0.5);
    let [contact, flight, both] = rates(&switched);
    assert!(contact < 1e-3 && flight < 1e-3 && both > 0.5, "{both}");
    let found = rates(&learned(&switched, &options));
    assert!(found.iter().all(|rate| *rate <= 0.5 + 1e-9), "{found:?}");
}

#[test]
fn metrics_of_jumps_of_several_lengths_are_those_of_each_together() {
    let truth = known();
    let trained = train_with(&jumps(&truth, 0..4), &[], &options()).expect("trains");
    let first = jump(&truth, 7.0, LIFT_OFF);
    let mut second = jump(&truth, 8.0, 100);
    second.segments[0] = second.segments[0].slice(0..170);
    let set = |recordings: &[Recording]| assess(&trained.model, recordings).expect("fits");
    let [one, two, both] = [&[first.clone()][..], &[second.clone()], &[first, second]].map(set);
    // Predictions begin after the first sample of a jump.
    let joined = |pick: fn(&romc::train::SetMetrics) -> f64| {
        let square = 199.0 * pick(&one).powi(2) + 169.0 * pick(&two).powi(2);
        let expected = (square / 368.0).sqrt();
        assert!((pick(&both) - expected).abs() < 1e-9 * expected, "{both:?}");
        assert!(expected < 1e-3, "{both:?}");
    };
    joined(|m| m.prediction_x_m);
    joined(|m| m.prediction_z_m);
    joined(|m| m.rollout_x_m.expect("bounded"));
    joined(|m| m.rollout_z_m.expect("bounded"));
    assert!(
        both.decoder_mse < 1e-20 && both.ddz_r2.iter().all(|r2| *r2 > 0.99),
        "{both:?}"
    );
    assert_eq!(trained.model.robot().expect("known"), go1());
}
