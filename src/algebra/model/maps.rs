//! The maps of a model between robot and latent coordinates.
//!
//! With the encoder `E` and the decoder `D`, the Jacobian `J_E` of `E` at `s_x x`:
//!
//! - `z = E(s_x x)`, `ddz = J_E (s_x ddx) + dJ_E/dt (s_x dx)`;
//! - `x = D(z) / s_x`.
//!
//! Velocities and inputs: [`ReducedModel::tangent`].

use nalgebra::{DMatrix, DVector};

use super::affine::AffineMap;
use super::error::ModelError;
use super::rom::ReducedModel;
use super::state_map::StateMap;

impl ReducedModel {
    /// Whether encoder and decoder, as far as the model has them, are single affine maps.
    pub fn is_linear(&self) -> bool {
        let mut maps = self.parts.encoder.iter().chain(&self.parts.decoder);
        maps.all(|map| map.as_affine().is_some())
    }

    /// The encoder, linear or not, in scaled units.
    ///
    /// # Errors
    /// [`ModelError::Missing`] for a latent-only model.
    pub fn encoder_map(&self) -> Result<&StateMap, ModelError> {
        let purpose = "going from robot to latent coordinates";
        self.require(self.parts.encoder.as_ref(), "encoder", purpose)
    }

    /// The decoder, linear or not, in scaled units.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the model has none.
    pub fn decoder_map(&self) -> Result<&StateMap, ModelError> {
        let purpose = "going from latent to robot coordinates";
        self.require(self.parts.decoder.as_ref(), "decoder", purpose)
    }

    /// The encoder of a linear model, in scaled units: `W_e` is `latent_dim x state_dim`.
    ///
    /// # Errors
    /// [`ModelError::Missing`] for a latent-only model, [`ModelError::Nonlinear`].
    pub fn encoder(&self) -> Result<&AffineMap, ModelError> {
        self.affine("encoder", self.encoder_map()?)
    }

    /// The decoder of a linear model, in scaled units: `W_d` is `state_dim x latent_dim`.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the model has none, [`ModelError::Nonlinear`].
    pub fn decoder(&self) -> Result<&AffineMap, ModelError> {
        self.affine("decoder", self.decoder_map()?)
    }

    /// `pinv(W_e^T)` of a linear model, `latent_dim x state_dim`, in scaled units.
    ///
    /// # Errors
    /// [`ModelError::Missing`] for a latent-only model, [`ModelError::Nonlinear`].
    pub(crate) fn input_projection(&self) -> Result<&DMatrix<f64>, ModelError> {
        self.encoder()?;
        let projection = self.input_projection.as_ref();
        self.require(projection, "encoder", "projecting inputs")
    }

    /// The linear model whose maps have the same value and the same Jacobian at the state `x` (SI
    /// units) and, for the decoder, at `z = E(s_x x)`; the dynamics are the same. A linear map
    /// stays as it is.
    ///
    /// Positions, velocities and inputs of the two models agree at `x` and drift apart away from
    /// it as the maps curve.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`], and [`ModelError::RankDeficient`] where the encoder's Jacobian
    /// has not full row rank.
    pub fn linearised_at(&self, x: &DVector<f64>) -> Result<ReducedModel, ModelError> {
        let scaled = self.scaled_state(x)?;
        let encoder = self.encoder_map()?;
        let z = encoder.apply(&scaled)?;
        let mut builder = self.clone().into_builder();
        if encoder.as_affine().is_none() {
            builder = builder.encoder(tangent("encoder", encoder, &scaled)?);
        }
        if let Some(decoder) = &self.parts.decoder
            && decoder.as_affine().is_none()
        {
            builder = builder.decoder(tangent("decoder", decoder, &z)?);
        }
        builder.build()
    }

    /// `z = E(s_x x)`, for a linear model `W_e (s_x x) + b_e`; `x` in SI units.
    ///
    /// # Errors
    /// [`ModelError::Missing`] for a latent-only model, [`ModelError::Dimension`].
    pub fn encode(&self, x: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        self.encoder_map()?.apply(&self.scaled_state(x)?)
    }

    /// `x = D(z) / s_x`, for a linear model `(W_d z + b_d) / s_x`, SI units.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the model has no decoder or scaling, [`ModelError::Dimension`].
    pub fn decode(&self, z: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        let scaled = self.decoder_map()?.apply(z)?;
        Ok(scaled.component_div(&self.state_factors()?))
    }

    /// `ddz = J_E (s_x ddx) + dJ_E/dt (s_x dx)` at the state `x`; all in SI units.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`].
    pub fn encode_acceleration(
        &self,
        x: &DVector<f64>,
        dx: &DVector<f64>,
        ddx: &DVector<f64>,
    ) -> Result<DVector<f64>, ModelError> {
        let (x, dx) = (self.scaled_state(x)?, self.scaled_state(dx)?);
        let ddx = self.scaled_state(ddx)?;
        let [_, _, ddz] = self.encoder_map()?.apply_rates(&x, &dx, &ddx)?;
        Ok(ddz)
    }

    pub(super) fn scaled_state(&self, x: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        let factors = self.state_factors()?;
        ModelError::check_dimension("robot state", x.len(), factors.len())?;
        Ok(x.component_mul(&factors))
    }

    fn affine<'m>(
        &self,
        part: &'static str,
        map: &'m StateMap,
    ) -> Result<&'m AffineMap, ModelError> {
        map.as_affine().ok_or_else(|| ModelError::Nonlinear {
            model: self.parts.name.clone(),
            part,
            purpose: "one matrix for all states",
        })
    }
}

/// `y -> J(at) y + (map(at) - J(at) at)`.
fn tangent(tensor: &str, map: &StateMap, at: &DVector<f64>) -> Result<AffineMap, ModelError> {
    let jacobian = map.jacobian(at)?;
    let bias = map.apply(at)? - &jacobian * at;
    AffineMap::new(tensor, jacobian, bias)
}
