//! The maps of a model to first order at a state, in SI units.
//!
//! For a linear model they are the same at every state. In general, with the encoder `E`, the decoder `D` and their
//! Jacobians `J_E` at `s_x x` and `J_D` at `z`:
//!
//! - `dz = J_E (s_x dx)`, `dx = J_D dz / s_x`;
//! - `u_lat = pinv(J_E^T) (s_u u)` (project), `u = (J_E^T u_lat) / s_u` (lift).

use nalgebra::{DMatrix, DVector};

use super::error::ModelError;
use super::projection::pinv_of_transpose;
use super::rom::ReducedModel;

/// Velocities and inputs between robot and latent coordinates at one state.
#[derive(Clone, Debug, PartialEq)]
pub struct Tangent {
    /// `dz = encode dx`: `J_E s_x`, `latent_dim x state_dim`.
    pub encode: DMatrix<f64>,
    /// `u_lat = project u`: `pinv(J_E^T) s_u`, `latent_dim x state_dim`.
    pub project: DMatrix<f64>,
    /// `u = lift u_lat`: `J_E^T / s_u`, `state_dim x latent_dim`. From the power balance under `dz = encode dx`; joint
    /// torques (N m) are the leading entries.
    pub lift: DMatrix<f64>,
}

impl ReducedModel {
    /// The maps that the encoder's Jacobian at the state `x` (SI units) gives.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`], and [`ModelError::RankDeficient`] where the Jacobian does not have full row
    /// rank.
    pub fn tangent(&self, x: &DVector<f64>) -> Result<Tangent, ModelError> {
        let jacobian = self.encoder_map()?.jacobian(&self.scaled_state(x)?)?;
        let (s_x, s_u) = (self.state_factors()?, self.input_factors()?);
        let projection = match &self.input_projection {
            Some(projection) => projection,
            None => &pinv_of_transpose(&jacobian, "Jacobian of the encoder at this state")?,
        };
        Ok(Tangent {
            // divided by the factors, not multiplied by inverses, which round
            lift: (jacobian.transpose()).map_with_location(|row, _, value| value / s_u[row]),
            project: projection.map_with_location(|_, column, value| value * s_u[column]),
            encode: jacobian.map_with_location(|_, column, value| value * s_x[column]),
        })
    }

    /// `d z / d x = J_E s_x` at the state `x`, `latent_dim x state_dim`, SI units; of any rank.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`].
    pub fn encoder_jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, ModelError> {
        let jacobian = self.encoder_map()?.jacobian(&self.scaled_state(x)?)?;
        let s_x = self.state_factors()?;
        Ok(jacobian.map_with_location(|_, column, value| value * s_x[column]))
    }

    /// `d x / d z = J_D / s_x` at the latent state `z`, `state_dim x latent_dim`, SI units.
    ///
    /// # Errors
    /// As [`ReducedModel::decode`].
    pub fn decoder_jacobian(&self, z: &DVector<f64>) -> Result<DMatrix<f64>, ModelError> {
        let jacobian = self.decoder_map()?.jacobian(z)?;
        let s_x = self.state_factors()?;
        Ok(jacobian.map_with_location(|row, _, value| value / s_x[row]))
    }
}
