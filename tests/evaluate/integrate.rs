//! The adaptive integrator against closed forms and a published reference.

use crate::sim::integrate::{IntegrationMethod, IntegrationOptions, OdeSystem, integrate};
use nalgebra::DMatrix;

/// One equation in one unknown, or more, as two functions.
struct Case<F, J>(F, J);

impl<F, J> OdeSystem for Case<F, J>
where
    F: Fn(f64, &[f64], &mut [f64]),
    J: Fn(f64, &[f64], &mut DMatrix<f64>),
{
    fn rate(&mut self, time_s: f64, y: &[f64], dy: &mut [f64]) {
        assert!(y.iter().all(|value| value.is_finite()), "asked at {y:?}");
        (self.0)(time_s, y, dy);
    }

    fn jacobian(&mut self, time_s: f64, y: &[f64], jacobian: &mut DMatrix<f64>) {
        (self.1)(time_s, y, jacobian);
    }
}

fn times(count: usize, end: f64) -> Vec<f64> {
    (0..count)
        .map(|k| end * k as f64 / (count - 1) as f64)
        .collect()
}

fn oscillator() -> impl OdeSystem {
    Case(
        |_t, y: &[f64], dy: &mut [f64]| dy.copy_from_slice(&[y[1], -y[0]]),
        |_t, _y: &[f64], jacobian: &mut DMatrix<f64>| {
            jacobian.copy_from_slice(&[0.0, -1.0, 1.0, 0.0])
        },
    )
}

#[test]
fn both_methods_of_an_oscillator_follow_the_cosine() {
    use IntegrationMethod::{Explicit, Implicit};
    for (method, count, bound) in [
        (Explicit, 200, 1e-10),
        (Explicit, 2, 1e-10),
        (Implicit, 21, 1e-9),
    ] {
        let mut options = IntegrationOptions::default();
        if method == Implicit {
            options.explicit_evaluations_per_time = 0;
        }
        let times = times(count, 10.0);
        let result = integrate(&mut oscillator(), &[1.0, 0.0], &times, &options);
        assert_eq!(result.method, method);
        assert_eq!(result.states.ncols(), times.len());
        for (column, &time) in result.states.column_iter().zip(&times) {
            let error = (column[0] - time.cos()).abs();
            let error = error.max((column[1] + time.sin()).abs());
            assert!(error < bound, "{method:?} at {time}: {error:e}");
        }
    }
}

#[test]
fn integrate_of_a_stiff_problem_falls_back_to_the_implicit_method() {
    let rate = 1e7;
    let times = times(11, 1.0);
    let mut system = Case(
        |t: f64, y: &[f64], dy: &mut [f64]| dy[0] = -rate * (y[0] - t.cos()),
        |_t, _y: &[f64], jacobian: &mut DMatrix<f64>| jacobian[(0, 0)] = -rate,
    );
    let result = integrate(&mut system, &[1.0], &times, &IntegrationOptions::default());
    assert_eq!(result.method, IntegrationMethod::Implicit);
    assert_eq!(result.diverged_at_s, None);
    // y = (rate^2 cos t + rate sin t) / (rate^2 + 1) after the transient
    let expected = 1f64.cos() + 1f64.sin() / rate;
    let error = (result.states[(0, 10)] - expected).abs();
    assert!(error < 1e-11, "{error:e}");
}

#[test]
fn integrate_of_van_der_pol_in_its_stiff_regime_reproduces_the_reference() {
    // reference at t = 2: the test set for initial value problem solvers (Mazzia, Magherini)
    let epsilon = 1e-6;
    let mut system = Case(
        |_t, y: &[f64], dy: &mut [f64]| {
            dy.copy_from_slice(&[y[1], ((1.0 - y[0] * y[0]) * y[1] - y[0]) / epsilon]);
        },
        |_t, y: &[f64], jacobian: &mut DMatrix<f64>| {
            let below = [
                (-2.0 * y[0] * y[1] - 1.0) / epsilon,
                (1.0 - y[0] * y[0]) / epsilon,
            ];
            jacobian.copy_from_slice(&[0.0, below[0], 1.0, below[1]]);
        },
    );
    let options = IntegrationOptions {
        divergence_bound: 1e8,
        ..Default::default()
    };
    let result = integrate(&mut system, &[2.0, 0.0], &times(3, 2.0), &options);
    assert_eq!(result.method, IntegrationMethod::Implicit);
    let end = result.states.column(2);
    assert!((end[0] - 0.170_616_773_217_048_5e1).abs() < 1e-8, "{end}");
    assert!((end[1] + 0.892_809_701_024_797_5).abs() < 1e-7, "{end}");
}

#[test]
fn integrate_of_a_finite_time_blow_up_reports_when_it_diverged() {
    // dy/dt = y^2 from 1 has its pole at t = 1
    let times = times(21, 2.0);
    let mut system = Case(
        |_t, y: &[f64], dy: &mut [f64]| dy[0] = y[0] * y[0],
        |_t, y: &[f64], jacobian: &mut DMatrix<f64>| jacobian[(0, 0)] = 2.0 * y[0],
    );
    let result = integrate(&mut system, &[1.0], &times, &IntegrationOptions::default());
    let time = result.diverged_at_s.expect("a pole");
    assert!((0.99..=1.01).contains(&time), "{time}");
    assert_eq!(result.states.ncols(), 10, "times 0 to 0.9");
    for (column, &time) in result.states.column_iter().zip(&times) {
        assert!((column[0] * (1.0 - time) - 1.0).abs() < 1e-9, "at {time}");
    }
}

#[test]
fn integrate_of_a_rate_that_is_not_a_number_ends_where_it_begins_to_be_none() {
    let mut system = Case(
        |t: f64, _y: &[f64], dy: &mut [f64]| dy[0] = (0.55 - t).sqrt(),
        |_t, _y: &[f64], jacobian: &mut DMatrix<f64>| jacobian[(0, 0)] = 0.0,
    );
    let result = integrate(
        &mut system,
        &[0.0],
        &times(11, 1.0),
        &IntegrationOptions::default(),
    );
    let time = result.diverged_at_s.expect("no rate beyond");
    assert!((0.549..=0.5501).contains(&time), "{time}");
    assert_eq!(result.states.ncols(), 6);
}
