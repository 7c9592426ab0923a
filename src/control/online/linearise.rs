//! Discrete dynamics of one stage with exact sensitivities.
//!
//! The latent equations `d/dt (z, dz) = (dz, f(z, dz, u))` are integrated over a stage of length `h` by the classical
//! Runge-Kutta method with the input held,
//!
//! ```text
//! x⁺ = F(x, u),   x = (z, dz),
//! ```
//!
//! and the method itself is differentiated: with `S_i` the derivative of the i-th internal state by `(z, dz, u)` and
//! `K_i` that of the i-th slope,
//!
//! ```text
//! S_1 = (I 0),   S_{i+1} = S_1 + a_i h K_i,
//! K_i = ( rows of S_i that belong to dz ;  f_z S_i^z + f_dz S_i^dz + f_u ),
//! (A B) = S_1 + h/6 (K_1 + 2 K_2 + 2 K_3 + K_4).
//! ```
//!
//! So `A` and `B` are derivatives of the discrete map to rounding, not approximations of a matrix exponential.

use std::fmt::Debug;

use super::dense::{Real, add_scaled};

/// Nodes of the classical Runge-Kutta method: the internal state is `x + node · h · previous slope`.
const NODES: [Real; 4] = [0.0, 0.5, 0.5, 1.0];
/// Weights of its slopes.
const WEIGHTS: [Real; 4] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0];

/// The latent accelerations of every phase with their derivatives. Methods may panic if the phase does not exist or a
/// length does not fit.
///
/// The interpreter's programs and the generated code of a controller both are.
pub trait LatentDynamics: Debug + Send {
    /// Writes `ddz = Xiᵀ Θ(z, dz, u)` of a phase and the entries of its Jacobian by `(z, dz, u)` that need not be zero;
    /// how many there are, at most `3 latent_dim²`.
    fn accelerate(
        &mut self,
        phase: usize,
        z: &[Real],
        dz: &[Real],
        u: &[Real],
        ddz: &mut [Real],
        entries: &mut [Real],
    ) -> usize;
    /// Row of an entry: the component of `ddz`.
    fn row(&self, phase: usize, entry: usize) -> usize;
    /// Column of an entry: `z` in the first `latent_dim`, then `dz`, then `u`.
    fn column(&self, phase: usize, entry: usize) -> usize;

    /// Writes `F(x, u)` and `(A B)`, row by row, for a stage of `step_s`. The memory holds two states, two matrices of
    /// the size of `(A B)` and the entries of a Jacobian.
    fn step(
        &mut self,
        phase: usize,
        x: &[Real],
        u: &[Real],
        d: usize,
        step_s: Real,
        next: &mut [Real],
        by: &mut [Real],
        memory: &mut [Real],
    ) {
        let width = 3 * d;
        let (state, rest) = memory.split_at_mut(2 * d);
        let (slope, others) = rest.split_at_mut(2 * d);
        let (sensitivity, last) = others.split_at_mut(2 * d * width);
        let (slope_sensitivity, entries) = last.split_at_mut(2 * d * width);
        for i in 0..2 * d {
            slope[i] = 0.0;
            next[i] = 0.0;
        }
        for i in 0..2 * d * width {
            slope_sensitivity[i] = 0.0;
            by[i] = 0.0;
        }
        for node in 0..4 {
            let scale = NODES[node] * step_s;
            for i in 0..2 * d {
                state[i] = x[i] + scale * slope[i];
            }
            for i in 0..2 * d * width {
                sensitivity[i] = scale * slope_sensitivity[i];
            }
            for i in 0..2 * d {
                sensitivity[i * width + i] += 1.0;
            }
            for i in 0..d {
                slope[i] = state[d + i];
            }
            let count =
                self.accelerate(phase, &state[..d], &state[d..], u, &mut slope[d..], entries);
            for i in 0..d * width {
                slope_sensitivity[i] = sensitivity[d * width + i];
                slope_sensitivity[d * width + i] = 0.0;
            }
            for entry in 0..count {
                let row = (d + self.row(phase, entry)) * width;
                let column = self.column(phase, entry);
                if column < 2 * d {
                    let by_column = &sensitivity[column * width..];
                    add_scaled(
                        entries[entry],
                        by_column,
                        width,
                        &mut slope_sensitivity[row..],
                    );
                } else {
                    slope_sensitivity[row + column] += entries[entry];
                }
            }
            add_scaled(WEIGHTS[node], slope, 2 * d, next);
            add_scaled(WEIGHTS[node], slope_sensitivity, 2 * d * width, by);
        }
        for i in 0..2 * d {
            next[i] = x[i] + step_s * next[i];
        }
        for i in 0..2 * d * width {
            by[i] *= step_s;
        }
        for i in 0..2 * d {
            by[i * width + i] += 1.0;
        }
    }

    /// Writes `∂ddz/∂u`, row by row, of so many entries.
    fn write_gain(
        &self,
        phase: usize,
        count: usize,
        entries: &[Real],
        d: usize,
        gain: &mut [Real],
    ) {
        for i in 0..d * d {
            gain[i] = 0.0;
        }
        for entry in 0..count {
            let column = self.column(phase, entry);
            if column >= 2 * d {
                gain[self.row(phase, entry) * d + column - 2 * d] = entries[entry];
            }
        }
    }
}

/// Runge-Kutta step of one stage and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StageModel {
    /// `F(x̄, ū)`, `2 latent_dim`: positions first.
    pub next: Vec<f64>,
    /// `(∂F/∂x ∂F/∂u)`, `2 latent_dim × 3 latent_dim`, row-major.
    pub(super) by: Vec<f64>,
}

impl StageModel {
    /// A stage of zeros.
    pub(crate) fn zeros(latent_dim: usize) -> Self {
        Self {
            next: vec![0.0; 2 * latent_dim],
            by: vec![0.0; 6 * latent_dim * latent_dim],
        }
    }

    /// Entry of `∂F/∂x`.
    #[cfg(test)]
    pub(crate) fn a(&self, row: usize, col: usize) -> f64 {
        self.by[row * 3 * (self.next.len() / 2) + col]
    }

    /// Entry of `∂F/∂u`.
    #[cfg(test)]
    pub(crate) fn b(&self, row: usize, col: usize) -> f64 {
        self.a(row, self.next.len() + col)
    }
}

/// Working memory of [`Lineariser::stage`].
#[derive(Debug, Clone)]
pub(crate) struct Lineariser(Vec<f64>);

impl Lineariser {
    /// Memory for a latent dimension.
    pub(crate) fn new(latent_dim: usize) -> Self {
        Self(vec![0.0; (4 + 15 * latent_dim) * latent_dim])
    }

    /// Writes `F(x, u)`, `A` and `B` at `x = (z, dz)` and `u` for a stage of `step_s` in a phase into `stage`.
    pub(crate) fn stage(
        &mut self,
        (dynamics, phase): (&mut dyn LatentDynamics, usize),
        x: &[f64],
        u: &[f64],
        step_s: f64,
        stage: &mut StageModel,
    ) {
        let (next, by, memory) = (&mut stage.next, &mut stage.by, &mut self.0);
        dynamics.step(phase, x, u, u.len(), step_s, next, by, memory);
    }
}
