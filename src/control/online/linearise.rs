//! Discrete dynamics of one stage with exact sensitivities.
//!
//! The latent equations `d/dt (z, dz) = (dz, f(z, dz, u))` are integrated over a stage of length
//! `h` by the classical Runge-Kutta method with the input held,
//!
//! ```text
//! x⁺ = F(x, u),   x = (z, dz),
//! ```
//!
//! and the method itself is differentiated: with `S_i` the derivative of the i-th internal state by
//! `(z, dz, u)` and `K_i` that of the i-th slope,
//!
//! ```text
//! S_1 = (I 0),   S_{i+1} = S_1 + a_i h K_i,
//! K_i = ( rows of S_i that belong to dz ;  f_z S_i^z + f_dz S_i^dz + f_u ),
//! (A B) = S_1 + h/6 (K_1 + 2 K_2 + 2 K_3 + K_4).
//! ```
//!
//! So `A` and `B` are derivatives of the discrete map to rounding, not approximations of a matrix
//! exponential.

use std::fmt::Debug;

use nalgebra::DMatrix;

/// The latent accelerations of every phase with their derivatives.
///
/// The interpreter's programs and the generated code of a controller both are.
pub trait LatentDynamics: Debug + Send {
    /// Writes `ddz = Xiᵀ Θ(z, dz, u_lat)` of a phase and its dense Jacobian by `(z, dz, u_lat)`,
    /// `latent_dim × 3 latent_dim`.
    ///
    /// # Panics
    /// May panic if the phase does not exist or a length does not fit.
    fn jacobian(
        &mut self,
        phase: usize,
        z: &[f64],
        dz: &[f64],
        u_lat: &[f64],
        ddz: &mut [f64],
        jacobian: &mut DMatrix<f64>,
    );
}

/// Runge-Kutta step of one stage and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct StageModel {
    /// `F(x̄, ū)`, `2 latent_dim`: positions first.
    pub next: Vec<f64>,
    /// `(∂F/∂x ∂F/∂u)`, `2 latent_dim × 3 latent_dim`, row-major.
    by: Vec<f64>,
}

impl StageModel {
    /// A stage of zeros.
    pub fn zeros(latent_dim: usize) -> Self {
        Self {
            next: vec![0.0; 2 * latent_dim],
            by: vec![0.0; 6 * latent_dim * latent_dim],
        }
    }

    /// Entry of `∂F/∂x`.
    pub fn a(&self, row: usize, col: usize) -> f64 {
        self.by[row * 3 * (self.next.len() / 2) + col]
    }

    /// Entry of `∂F/∂u`.
    pub fn b(&self, row: usize, col: usize) -> f64 {
        self.a(row, self.next.len() + col)
    }
}

/// Working memory of [`Lineariser::stage`].
#[derive(Debug, Clone)]
pub struct Lineariser {
    state: Vec<f64>,
    slope: Vec<f64>,
    jacobian: DMatrix<f64>,
    /// `S_i` and `K_i`, `2d × 3d`, row-major.
    sensitivity: Vec<f64>,
    slope_sensitivity: Vec<f64>,
}

/// Nodes of the classical Runge-Kutta method: the internal state is `x + node · h · previous slope`.
const NODES: [f64; 4] = [0.0, 0.5, 0.5, 1.0];
/// Weights of its slopes.
const WEIGHTS: [f64; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

impl Lineariser {
    /// Memory for a latent dimension.
    pub fn new(latent_dim: usize) -> Self {
        let (state_dim, point_dim) = (2 * latent_dim, 3 * latent_dim);
        Self {
            state: vec![0.0; state_dim],
            slope: vec![0.0; state_dim],
            jacobian: DMatrix::zeros(latent_dim, point_dim),
            sensitivity: vec![0.0; state_dim * point_dim],
            slope_sensitivity: vec![0.0; state_dim * point_dim],
        }
    }

    /// Writes `F(x, u)`, `A` and `B` at `x = (z, dz)` and `u` for a stage of `step_s` into `stage`.
    ///
    /// `dynamics(z, dz, u, ddz, jacobian)` writes `ddz = f(z, dz, u)` and its dense Jacobian by
    /// `(z, dz, u)`, `latent_dim × 3 latent_dim`.
    pub fn stage(
        &mut self,
        x: &[f64],
        u: &[f64],
        step_s: f64,
        mut dynamics: impl FnMut(&[f64], &[f64], &[f64], &mut [f64], &mut DMatrix<f64>),
        stage: &mut StageModel,
    ) {
        let (d, point_dim) = (u.len(), 3 * u.len());
        self.slope.fill(0.0);
        self.slope_sensitivity.fill(0.0);
        stage.next.fill(0.0);
        stage.by.fill(0.0);
        for (node, weight) in NODES.into_iter().zip(WEIGHTS) {
            let scale = node * step_s;
            for i in 0..2 * d {
                self.state[i] = x[i] + scale * self.slope[i];
            }
            for (sensitivity, slope) in self.sensitivity.iter_mut().zip(&self.slope_sensitivity) {
                *sensitivity = scale * slope;
            }
            for row in 0..2 * d {
                self.sensitivity[row * point_dim + row] += 1.0;
            }
            let (z, dz) = self.state.split_at(d);
            let (velocity, acceleration) = self.slope.split_at_mut(d);
            velocity.copy_from_slice(dz);
            dynamics(z, dz, u, acceleration, &mut self.jacobian);
            self.differentiate_slope();
            for (sum, slope) in stage.next.iter_mut().zip(&self.slope) {
                *sum += weight * slope;
            }
            for (sum, slope) in stage.by.iter_mut().zip(&self.slope_sensitivity) {
                *sum += weight * slope;
            }
        }
        for row in 0..2 * d {
            stage.next[row] = x[row] + step_s * stage.next[row];
            for entry in &mut stage.by[row * point_dim..][..point_dim] {
                *entry *= step_s;
            }
            stage.by[row * point_dim + row] += 1.0;
        }
    }

    /// `K` from `S` and the Jacobian of `f`.
    fn differentiate_slope(&mut self) {
        let (d, point_dim) = self.jacobian.shape();
        let (velocity, acceleration) = self.slope_sensitivity.split_at_mut(d * point_dim);
        velocity.copy_from_slice(&self.sensitivity[d * point_dim..]);
        for (row, out) in acceleration.chunks_exact_mut(point_dim).enumerate() {
            out.fill(0.0);
            for (col, sensitivity) in self.sensitivity.chunks_exact(point_dim).enumerate() {
                let factor = self.jacobian[(row, col)];
                if factor != 0.0 {
                    for (out, sensitivity) in out.iter_mut().zip(sensitivity) {
                        *out += factor * sensitivity;
                    }
                }
            }
            for col in 2 * d..point_dim {
                out[col] += self.jacobian[(row, col)];
            }
        }
    }
}
