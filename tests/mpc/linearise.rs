//! The step of a stage and its derivatives.

use crate::online::LatentDynamics;
use crate::online::linearise::{Lineariser, StageModel};
use nalgebra::DVector;

/// Accelerations with all entries of their Jacobian, row by row.
#[derive(Debug)]
struct Dense(usize, fn(&[f64], &[f64], &[f64], &mut [f64], &mut [f64]));

impl LatentDynamics for Dense {
    fn accelerate(
        &mut self,
        _: usize,
        z: &[f64],
        dz: &[f64],
        u: &[f64],
        ddz: &mut [f64],
        entries: &mut [f64],
    ) -> usize {
        self.1(z, dz, u, ddz, entries);
        entries.len()
    }

    fn row(&self, _: usize, entry: usize) -> usize {
        entry / (3 * self.0)
    }

    fn column(&self, _: usize, entry: usize) -> usize {
        entry % (3 * self.0)
    }
}

/// A stiff, nonlinear pair of oscillators with inputs inside and outside the sine.
fn sample(z: &[f64], dz: &[f64], u: &[f64], ddz: &mut [f64], jacobian: &mut [f64]) {
    ddz[0] = -40.0 * z[0].sin() + z[1] * dz[0] + u[0];
    ddz[1] = -3.0 * dz[1] + (z[0] * u[1]).cos() + 2.0 * u[0];
    let slope = -(z[0] * u[1]).sin();
    let rows = [
        [-40.0 * z[0].cos(), dz[0], z[1], 0.0, 1.0, 0.0],
        [slope * u[1], 0.0, 0.0, -3.0, 2.0, slope * z[0]],
    ];
    jacobian.copy_from_slice(&rows.concat());
}

fn stage_at(x: &[f64], u: &[f64]) -> StageModel {
    let mut stage = StageModel::zeros(2);
    let mut dynamics = Dense(2, sample);
    Lineariser::new(2).stage((&mut dynamics, 0), x, u, 0.02, &mut stage);
    stage
}

#[test]
fn sensitivities_match_central_differences_of_the_step() {
    let x = [0.3, -0.7, 1.1, 0.4];
    let u = [0.9, -1.3];
    let stage = stage_at(&x, &u);
    let delta = 1e-5;
    for col in 0..6 {
        let moved = |sign: f64| {
            let (mut x, mut u) = (x, u);
            if col < 4 {
                x[col] += sign * delta
            } else {
                u[col - 4] += sign * delta
            }
            DVector::from_vec(stage_at(&x, &u).next)
        };
        let difference = (moved(1.0) - moved(-1.0)) / (2.0 * delta);
        for row in 0..4 {
            let exact = match col < 4 {
                true => stage.a(row, col),
                false => stage.b(row, col - 4),
            };
            let off = (exact - difference[row]).abs();
            assert!(off < 1e-8, "row {row}, column {col}");
        }
    }
}

#[test]
fn step_of_a_linear_oscillator_is_the_taylor_polynomial_of_order_four() {
    let mut stage = StageModel::zeros(1);
    let mut oscillator = Dense(1, |z, _, u, ddz, jacobian| {
        ddz[0] = -z[0] + u[0];
        jacobian.copy_from_slice(&[-1.0, 0.0, 1.0]);
    });
    let h: f64 = 0.5;
    Lineariser::new(1).stage((&mut oscillator, 0), &[2.0, 0.0], &[0.0], h, &mut stage);
    let (cosine, sine) = (
        1.0 - h.powi(2) / 2.0 + h.powi(4) / 24.0,
        h - h.powi(3) / 6.0,
    );
    let found = [stage.a(0, 0), stage.a(0, 1), stage.next[0], stage.b(0, 0)];
    for (found, exact) in found
        .into_iter()
        .zip([cosine, sine, 2.0 * cosine, 1.0 - cosine])
    {
        assert!((found - exact).abs() < 1e-15, "{found} {exact}");
    }
}
