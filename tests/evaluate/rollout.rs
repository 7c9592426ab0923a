//! Rollouts of a small hybrid model against closed forms and fine steps.

use crate::lower::CompiledModel;
use crate::model::{FeetRule, Library, Phase, ReducedModel};
use crate::sim::{LatentSegment, Restart, rollout};
use nalgebra::DMatrix;

/// A damped, driven oscillator in contact; constant acceleration in flight.
fn compiled() -> CompiledModel {
    let terms = ["1", "z1", "dz1", "u1"].map(str::to_owned);
    let library = Library::from_terms(1, &terms).expect("terms parse");
    let phase = |name: &str, feet, xi: [f64; 4]| Phase {
        name: name.to_owned(),
        feet,
        xi: DMatrix::from_column_slice(4, 1, &xi),
    };
    let model = ReducedModel::builder("hopper", library)
        .phase(phase("contact", FeetRule::Any, [0.0, -40.0, -0.5, 3.0]))
        .phase(phase("flight", FeetRule::None, [-9.81, 0.0, 0.0, 0.0]))
        .build()
        .expect("a valid model");
    CompiledModel::new(&model).expect("lowers")
}

/// Samples every 2 ms; flight from 40 on; a latent record that the model does not follow.
fn recorded(count: usize) -> LatentSegment {
    let row = |f: &dyn Fn(f64) -> f64| DMatrix::from_fn(1, count, |_, k| f(0.002 * k as f64));
    LatentSegment {
        time_s: (0..count).map(|k| 0.002 * k as f64).collect(),
        z: row(&|t| 0.3 + t),
        dz: row(&|_| 1.0),
        ddz: row(&|_| 0.0),
        u_lat: row(&|t| (20.0 * t).sin()),
        phase: (0..count).map(|k| usize::from(k >= 40)).collect(),
    }
}

#[test]
fn rollout_in_flight_is_the_parabola_from_the_switch() {
    let recorded = recorded(101);
    let whole = rollout(&compiled(), &recorded, Restart::Never);
    let window = &whole.windows[0];
    assert_eq!((whole.windows.len(), window.z.ncols()), (1, 101));
    let (z, dz) = (window.z[(0, 40)], window.dz[(0, 40)]);
    for k in 40..101 {
        let t = 0.002 * (k - 40) as f64;
        let expected = z + dz * t - 0.5 * 9.81 * t * t;
        assert!((window.z[(0, k)] - expected).abs() < 1e-8, "sample {k}");
    }
}

#[test]
fn rollout_in_contact_agrees_with_fine_runge_kutta_steps() {
    let recorded = recorded(41);
    let mut model = compiled();
    let whole = rollout(&model, &recorded, Restart::Never);
    let window = &whole.windows[0];
    let (mut z, mut dz, mut u) = ([recorded.z[(0, 0)]], [recorded.dz[(0, 0)]], [0.0]);
    let h = 1e-6;
    for step in 0..80_000 {
        // the input at the middle of a step makes holding it second order accurate
        recorded.input_at((step as f64 + 0.5) * h, &mut u);
        model.rk4_step(0, &mut z, &mut dz, &u, h);
    }
    assert!(
        (window.z[(0, 40)] - z[0]).abs() < 1e-7,
        "{} {}",
        window.z[(0, 40)],
        z[0]
    );
    assert!((window.dz[(0, 40)] - dz[0]).abs() < 1e-6);
}

#[test]
fn restarts_begin_at_the_recorded_state_and_cover_every_sample_once() {
    let recorded = recorded(101);
    let restarted = rollout(&compiled(), &recorded, Restart::Every(0.05));
    let starts: Vec<usize> = restarted.windows.iter().map(|w| w.samples.start).collect();
    assert_eq!(starts, [0, 25, 50, 75, 100]);
    for window in &restarted.windows {
        assert_eq!(window.z[(0, 0)], recorded.z[(0, window.samples.start)]);
    }
    let covered: Vec<usize> = restarted
        .predictions()
        .map(|(sample, _, _)| sample)
        .collect();
    assert_eq!(covered, (0..101).collect::<Vec<_>>());
}

#[test]
fn input_between_samples_is_linear_and_held_outside() {
    let recorded = recorded(3);
    let mut u = [0.0];
    recorded.input_at(0.003, &mut u);
    let between = 0.5 * (recorded.u_lat[(0, 1)] + recorded.u_lat[(0, 2)]);
    assert!((u[0] - between).abs() < 1e-15);
    recorded.input_at(9.0, &mut u);
    assert_eq!(u[0], recorded.u_lat[(0, 2)]);
    recorded.input_at(-1.0, &mut u);
    assert_eq!(u[0], recorded.u_lat[(0, 0)]);
}
