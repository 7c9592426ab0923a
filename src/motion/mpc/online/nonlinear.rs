//! Maps of nonlinear encoders and decoders, which depend on the state.

use std::fmt::Debug;

use nalgebra::DMatrix;

use super::control_model::ControlPhase;
use crate::robot::STATE_DIM;

/// The maps between inputs and latent inputs at one state, in SI units on the robot's side.
#[derive(Debug, Clone)]
pub struct InputMaps {
    /// `J_Eᵀ / s_u`, `18 × latent_dim`.
    pub lift: DMatrix<f64>,
    /// `pinv(J_Eᵀ) s_u`, `latent_dim × 18`.
    pub projection: DMatrix<f64>,
}

/// A nonlinear encoder and decoder with their Jacobians, in SI units on the robot's side.
///
/// The matrices of a [`ControlModel`](super::ControlModel) are then those at one state, and
/// [`ControlModel::tangent_at`](super::ControlModel::tangent_at) gives the plant of another.
pub trait NonlinearMaps: Debug + Send + Sync {
    /// Writes `z = E(s_x x)`.
    fn encode(&self, x: &[f64], z: &mut [f64]);

    /// `x = D(z) / s_x`.
    fn decode(&self, z: &[f64]) -> [f64; STATE_DIM];

    /// `J_E s_x` at `x`, `latent_dim × 18`.
    fn encoder_jacobian(&self, x: &[f64]) -> DMatrix<f64>;

    /// `J_D / s_x` at `z`, `18 × latent_dim`.
    fn decoder_jacobian(&self, z: &[f64]) -> DMatrix<f64>;

    /// Lift and projection at `x`; none where the Jacobian does not have full row rank.
    fn inputs(&self, x: &[f64]) -> Option<InputMaps>;

    /// The phases with the statistics of the training inputs projected at `x`; none as for
    /// [`NonlinearMaps::inputs`].
    fn phases(&self, x: &[f64]) -> Option<Vec<ControlPhase>>;
}
