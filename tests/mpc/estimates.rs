//! Estimates of the input of a reference without recorded inputs.

use crate::synthetic::unwatched;
use nalgebra::{DMatrix, DVector};
use romc::mpc::{
    ControlModel, ControlPhase, Controller, InputGivenState, LatentDynamics, Measurement,
    MpcSettings, ReferenceSamples, Solver,
};
use romc::robot::{InputRule, WrenchFrame};

/// The height of a body with forces of gain two, in contact and in flight.
#[derive(Debug)]
struct Hopper;

impl LatentDynamics for Hopper {
    fn accelerate(
        &mut self,
        _: usize,
        _: &[f64],
        _: &[f64],
        u: &[f64],
        ddz: &mut [f64],
        entries: &mut [f64],
    ) -> usize {
        (ddz[0], entries[0]) = (2.0 * u[0], 2.0);
        1
    }

    fn row(&self, _: usize, _: usize) -> usize {
        0
    }

    fn column(&self, _: usize, _: usize) -> usize {
        2
    }
}

/// Commanded inputs from one sample of a motion to the next: the mean of the estimates at both samples. The robot is on
/// a reference without inputs. `given` predicts the input from the state.
fn estimated(
    step_s: f64,
    velocity: &[f64],
    is_down: impl Fn(usize) -> bool,
    given: Option<InputGivenState>,
) -> Vec<f64> {
    let row = |value: f64| DMatrix::from_fn(1, 18, |_, i| if i == 14 { value } else { 0.0 });
    let phase = |name: &str, is_grounded: bool| ControlPhase {
        name: name.to_owned(),
        is_grounded,
        latent_mean: DVector::from_element(1, 0.5),
        latent_root: DMatrix::from_element(1, 1, 0.2),
        given_state: given.clone(),
        torque_mean: nalgebra::zero(),
        torque_precision: nalgebra::one(),
    };
    let mut phase_of_feet = [None; 16];
    (phase_of_feet[15], phase_of_feet[0]) = (Some(0), Some(1));
    let go1 = romc::robot_file::by_name("go1").expect("shipped");
    let plant = ControlModel {
        input_rule: InputRule::new(go1, None, WrenchFrame::Body),
        encoder: row(1.0),
        encoder_bias: DVector::zeros(1),
        decoder: row(1.0).transpose(),
        decoder_bias: DVector::zeros(18),
        lift: row(1.0).transpose(),
        projection: row(1.0),
        phases: vec![phase("contact", true), phase("flight", false)],
        phase_of_feet,
        nonlinear: None,
    };
    let settings = MpcSettings {
        step_s,
        horizon: 2,
        solver: Solver::Riccati,
        ..unwatched()
    };
    let plant = plant.checked().expect("a sound model");
    let mut controller =
        Controller::with_plant(plant, Box::new(Hopper), settings).expect("sound settings");
    let count = velocity.len();
    let time_s: Vec<f64> = (0..count).map(|k| step_s * k as f64).collect();
    let x = vec![0.0; 18 * count];
    let mut dx = vec![0.0; 18 * count];
    for (k, speed) in velocity.iter().enumerate() {
        dx[18 * k + 14] = *speed;
    }
    let feet: Vec<_> = (0..count).map(|k| [is_down(k); 4]).collect();
    let reference = ReferenceSamples {
        time_s: &time_s,
        x: &x,
        dx: &dx,
        u: None,
        feet: &feet,
    };
    controller.set_reference(reference).expect("a sound motion");
    let input_after = |k: usize| {
        controller.reset();
        let command = controller.step(Measurement {
            time_s: time_s[k],
            x: &x[18 * k..][..18],
            dx: &dx[18 * k..][..18],
            feet: feet[k],
        });
        command.u_lat[0]
    };
    (0..count - 1).map(input_after).collect()
}

#[test]
fn states_set_what_input_is_expected_and_accelerations_within_a_phase_correct_it() {
    // dz = t^2 before the edge at sample 20, 5 after it, every 2 ms. The slope is 2 t inside, before the edge that of
    // the middle of the eight samples there, and zero after it.
    let velocity: Vec<f64> = (0..40)
        .map(|k| {
            if k < 20 {
                (0.002 * f64::from(k)).powi(2)
            } else {
                5.0
            }
        })
        .collect();
    let number = |value: f64| DMatrix::from_element(1, 1, value);
    let given = InputGivenState {
        mean: DMatrix::from_row_slice(1, 3, &[0.5, 1.0, -2.0]),
        covariance: number(0.5),
        acceleration_error: number(2.0),
    };
    let found = estimated(0.002, &velocity, |k| k < 20, Some(given));
    // S B / (B S B + R) = 0.5 * 2 / (2 + 2), times the part of the slope that the expected input m does not explain.
    let estimate = |k: usize, slope: f64| {
        let expected = 0.5 - 2.0 * velocity[k];
        expected + 0.25 * (slope - 2.0 * expected)
    };
    let inside = 0.5 * (estimate(10, 0.040) + estimate(11, 0.044));
    assert!((found[10] - inside).abs() < 1e-9, "{} {inside}", found[10]);
    let at_edge = 0.5 * (estimate(19, 0.060) + estimate(20, 0.0));
    assert!(
        (found[19] - at_edge).abs() < 1e-9,
        "{} {at_edge}",
        found[19]
    );
}

#[test]
fn accelerations_that_inputs_do_not_explain_count_less() {
    // Samples so far apart that slopes are differences of neighbours: for dz = c t^2 / 2 they are c t.
    for (c, is_explained) in [(60.0, false), (0.0, true)] {
        let velocity: Vec<f64> = (0..12)
            .map(|k| 0.5 * c * (0.02 * f64::from(k)).powi(2))
            .collect();
        let found = estimated(0.02, &velocity, |_| true, None);
        let slope = |k: usize| c * 0.02 * (k as f64).clamp(0.5, 10.5);
        let left: Vec<f64> = (0..12).map(|k| slope(k) - 2.0 * 0.5).collect();
        let mean = left.iter().sum::<f64>() / 12.0;
        let variance = left.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / 12.0;
        // Var(y) = B S B + R with B S B = 4 * 0.04; R explains the rest, at least three hundredths of B S B.
        let size = if is_explained { 1.03 * 0.16 } else { variance };
        assert!(is_explained || variance > 1.03 * 0.16);
        let estimate = |k: usize| 0.5 + 2.0 * 0.04 / size * left[k];
        let expected = 0.5 * (estimate(5) + estimate(6));
        assert!(
            (found[5] - expected).abs() < 1e-9,
            "{} {expected}",
            found[5]
        );
    }
}
