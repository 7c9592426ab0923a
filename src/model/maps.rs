//! The maps of a model between robot and latent coordinates.
//!
//! For a linear model those of `rom.rs`. In general, with the encoder `E`, the decoder `D`, their
//! Jacobians `J_E` at `s_x x` and `J_D` at `z`:
//!
//! - `z = E(s_x x)`, `dz = J_E (s_x dx)`, `ddz = J_E (s_x ddx) + dJ_E/dt (s_x dx)`;
//! - `x = D(z) / s_x`, `dx = J_D dz / s_x`, `ddx = (J_D ddz + dJ_D/dt dz) / s_x`;
//! - `u_lat = pinv(J_E^T) (s_u u)` (project), `u = (J_E^T u_lat) / s_u` (lift).
//!
//! Functions whose name ends in `_at` take the state at which `J` is meant; a linear map ignores it.
//! Those without are for linear models and refuse others with [`ModelError::Nonlinear`].

use nalgebra::{DMatrix, DVector};

use super::affine::AffineMap;
use super::error::ModelError;
use super::projection::pinv_of_jacobian;
use super::rom::ReducedModel;
use super::state_map::StateMap;
use super::statistics::LatentInputStatistics;

impl ReducedModel {
    /// Whether encoder and decoder, as far as the model has them, are single affine maps.
    pub fn is_linear(&self) -> bool {
        let maps = self.encoder.iter().chain(&self.decoder);
        maps.into_iter().all(|map| map.as_affine().is_some())
    }

    /// The encoder, linear or not, in scaled units.
    ///
    /// # Errors
    /// [`ModelError::Missing`] for a latent-only model.
    pub fn encoder_map(&self) -> Result<&StateMap, ModelError> {
        let purpose = "going from robot to latent coordinates";
        self.require(&self.encoder, "encoder", purpose)
    }

    /// The decoder, linear or not, in scaled units.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the model has none.
    pub fn decoder_map(&self) -> Result<&StateMap, ModelError> {
        let purpose = "going from latent to robot coordinates";
        self.require(&self.decoder, "decoder", purpose)
    }

    /// The encoder of a linear model, in scaled units: `W_e` is `latent_dim x state_dim`.
    ///
    /// # Errors
    /// [`ModelError::Missing`] for a latent-only model, [`ModelError::Nonlinear`].
    pub fn encoder(&self) -> Result<&AffineMap, ModelError> {
        let affine = self.encoder_map()?.as_affine();
        affine.ok_or_else(|| self.nonlinear("encoder", "one matrix for all states"))
    }

    /// The decoder of a linear model, in scaled units: `W_d` is `state_dim x latent_dim`.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the model has none, [`ModelError::Nonlinear`].
    pub fn decoder(&self) -> Result<&AffineMap, ModelError> {
        let affine = self.decoder_map()?.as_affine();
        affine.ok_or_else(|| self.nonlinear("decoder", "one matrix for all states"))
    }

    /// `pinv(W_e^T)` of a linear model, `latent_dim x state_dim`, in scaled units.
    ///
    /// # Errors
    /// [`ModelError::Missing`] for a latent-only model, [`ModelError::Nonlinear`].
    pub fn input_projection(&self) -> Result<&DMatrix<f64>, ModelError> {
        self.encoder()?;
        self.require(&self.input_projection, "encoder", "projecting inputs")
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
        if let Some(decoder) = &self.decoder
            && decoder.as_affine().is_none()
        {
            builder = builder.decoder(tangent("decoder", decoder, &z)?);
        }
        builder.build()
    }

    /// The encoder's Jacobian in SI units, `d z / d x = J_E diag(s_x)`, `latent_dim x state_dim`.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`].
    pub fn encoder_jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, ModelError> {
        let jacobian = self.encoder_map()?.jacobian(&self.scaled_state(x)?)?;
        Ok(jacobian * DMatrix::from_diagonal(&self.state_factors()?))
    }

    /// The decoder's Jacobian in SI units, `d x / d z = J_D / s_x`, `state_dim x latent_dim`.
    ///
    /// # Errors
    /// As [`ReducedModel::decode`].
    pub fn decoder_jacobian(&self, z: &DVector<f64>) -> Result<DMatrix<f64>, ModelError> {
        let jacobian = self.decoder_map()?.jacobian(z)?;
        let inverse = self.state_factors()?.map(f64::recip);
        Ok(DMatrix::from_diagonal(&inverse) * jacobian)
    }

    /// The matrix of [`ReducedModel::project_input_at`]: `pinv(J_E^T) diag(s_u)`,
    /// `latent_dim x state_dim`.
    ///
    /// # Errors
    /// As [`ReducedModel::project_input_at`].
    pub fn projection_matrix_at(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, ModelError> {
        let factors = DMatrix::from_diagonal(&self.input_factors()?);
        if let Some(projection) = &self.input_projection {
            return Ok(projection * factors);
        }
        let jacobian = self.encoder_map()?.jacobian(&self.scaled_state(x)?)?;
        Ok(pinv_of_jacobian(&jacobian)? * factors)
    }

    /// The matrix of [`ReducedModel::lift_input_at`]: `J_E^T / s_u`, `state_dim x latent_dim`.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`].
    pub fn lift_matrix_at(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, ModelError> {
        let jacobian = self.encoder_map()?.jacobian(&self.scaled_state(x)?)?;
        let inverse = self.input_factors()?.map(f64::recip);
        Ok(DMatrix::from_diagonal(&inverse) * jacobian.transpose())
    }

    /// Mean and covariance of `u_lat` in one phase: those of `u` through `pinv(W_e^T) s_u`.
    ///
    /// # Errors
    /// As [`ReducedModel::input_statistics`] and [`ReducedModel::project_input`].
    pub fn latent_input_statistics(
        &self,
        phase: usize,
    ) -> Result<LatentInputStatistics, ModelError> {
        let statistics = self.input_statistics(phase)?;
        let projection = self.input_projection()? * DMatrix::from_diagonal(&self.input_factors()?);
        Ok(LatentInputStatistics {
            mean: &projection * &statistics.mean,
            covariance: &projection * &statistics.covariance * projection.transpose(),
        })
    }

    /// As [`ReducedModel::latent_input_statistics`] with the projection at the state `x`.
    ///
    /// # Errors
    /// As [`ReducedModel::input_statistics`] and [`ReducedModel::project_input_at`].
    pub fn latent_input_statistics_at(
        &self,
        phase: usize,
        x: &DVector<f64>,
    ) -> Result<LatentInputStatistics, ModelError> {
        let statistics = self.input_statistics(phase)?;
        let projection = self.projection_matrix_at(x)?;
        Ok(LatentInputStatistics {
            mean: &projection * &statistics.mean,
            covariance: &projection * &statistics.covariance * projection.transpose(),
        })
    }

    /// `z = E(s_x x)`, for a linear model `W_e (s_x x) + b_e`; `x` in SI units.
    ///
    /// # Errors
    /// [`ModelError::Missing`] for a latent-only model, [`ModelError::Dimension`].
    pub fn encode(&self, x: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        self.encoder_map()?.apply(&self.scaled_state(x)?)
    }

    /// `dz = W_e (s_x dx)`, and the same for accelerations; `dx` in SI units.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`].
    pub fn encode_velocity(&self, dx: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        self.encoder()?.apply_linear(&self.scaled_state(dx)?)
    }

    /// `x = D(z) / s_x`, for a linear model `(W_d z + b_d) / s_x`, SI units.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the model has no decoder or scaling, [`ModelError::Dimension`].
    pub fn decode(&self, z: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        let scaled = self.decoder_map()?.apply(z)?;
        Ok(scaled.component_div(&self.state_factors()?))
    }

    /// `dx = (W_d dz) / s_x`, SI units, and the same for accelerations.
    ///
    /// # Errors
    /// As [`ReducedModel::decode`].
    pub fn decode_velocity(&self, dz: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        let scaled = self.decoder()?.apply_linear(dz)?;
        Ok(scaled.component_div(&self.state_factors()?))
    }

    /// Projects a generalised input: `u_lat = pinv(W_e^T) (s_u u)`; `u` in SI units.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`].
    pub fn project_input(&self, u: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        let projection = self.input_projection()?;
        ModelError::check_dimension("generalised input u", u.len(), projection.ncols())?;
        Ok(projection * u.component_mul(&self.input_factors()?))
    }

    /// Lifts a latent input to a generalised input: `u = (W_e^T u_lat) / s_u`, SI units.
    ///
    /// From the power balance under `dz = W_e dx`; joint torques (N m) are the leading entries.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`].
    pub fn lift_input(&self, u_lat: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        let weights = self.encoder()?.weights();
        ModelError::check_dimension("latent input u_lat", u_lat.len(), weights.nrows())?;
        Ok(weights.tr_mul(u_lat).component_div(&self.input_factors()?))
    }

    /// `dz = J_E (s_x dx)` at the state `x`; both in SI units.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`].
    pub fn encode_velocity_at(
        &self,
        x: &DVector<f64>,
        dx: &DVector<f64>,
    ) -> Result<DVector<f64>, ModelError> {
        let (x, dx) = (self.scaled_state(x)?, self.scaled_state(dx)?);
        self.encoder_map()?.apply_velocity(&x, &dx)
    }

    /// `ddz = J_E (s_x ddx) + dJ_E/dt (s_x dx)` at the state `x`; all in SI units.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`].
    pub fn encode_acceleration_at(
        &self,
        x: &DVector<f64>,
        dx: &DVector<f64>,
        ddx: &DVector<f64>,
    ) -> Result<DVector<f64>, ModelError> {
        let (x, dx) = (self.scaled_state(x)?, self.scaled_state(dx)?);
        let ddx = self.scaled_state(ddx)?;
        self.encoder_map()?.apply_acceleration(&x, &dx, &ddx)
    }

    /// `dx = J_D dz / s_x` at the latent state `z`, SI units.
    ///
    /// # Errors
    /// As [`ReducedModel::decode`].
    pub fn decode_velocity_at(
        &self,
        z: &DVector<f64>,
        dz: &DVector<f64>,
    ) -> Result<DVector<f64>, ModelError> {
        let scaled = self.decoder_map()?.apply_velocity(z, dz)?;
        Ok(scaled.component_div(&self.state_factors()?))
    }

    /// `ddx = (J_D ddz + dJ_D/dt dz) / s_x` at the latent state `z`, SI units.
    ///
    /// # Errors
    /// As [`ReducedModel::decode`].
    pub fn decode_acceleration_at(
        &self,
        z: &DVector<f64>,
        dz: &DVector<f64>,
        ddz: &DVector<f64>,
    ) -> Result<DVector<f64>, ModelError> {
        let scaled = self.decoder_map()?.apply_acceleration(z, dz, ddz)?;
        Ok(scaled.component_div(&self.state_factors()?))
    }

    /// Projects a generalised input at the state `x`: `u_lat = pinv(J_E^T) (s_u u)`, SI units.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`], and [`ModelError::SingularJacobian`].
    pub fn project_input_at(
        &self,
        x: &DVector<f64>,
        u: &DVector<f64>,
    ) -> Result<DVector<f64>, ModelError> {
        if self.input_projection.is_some() {
            return self.project_input(u);
        }
        let projection = self.projection_matrix_at(x)?;
        ModelError::check_dimension("generalised input u", u.len(), projection.ncols())?;
        Ok(projection * u)
    }

    /// Lifts a latent input at the state `x`: `u = (J_E^T u_lat) / s_u`, SI units.
    ///
    /// From the power balance under `dz = J_E dx`; joint torques (N m) are the leading entries.
    ///
    /// # Errors
    /// As [`ReducedModel::encode`].
    pub fn lift_input_at(
        &self,
        x: &DVector<f64>,
        u_lat: &DVector<f64>,
    ) -> Result<DVector<f64>, ModelError> {
        ModelError::check_dimension("latent input u_lat", u_lat.len(), self.latent_dim())?;
        let jacobian = self.encoder_map()?.jacobian(&self.scaled_state(x)?)?;
        Ok(jacobian.tr_mul(u_lat).component_div(&self.input_factors()?))
    }

    fn scaled_state(&self, x: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        let factors = self.state_factors()?;
        ModelError::check_dimension("robot state", x.len(), factors.len())?;
        Ok(x.component_mul(&factors))
    }

    fn nonlinear(&self, part: &'static str, purpose: &'static str) -> ModelError {
        ModelError::Nonlinear {
            model: self.name.clone(),
            part,
            purpose,
        }
    }
}

/// `y -> J(at) y + (map(at) - J(at) at)`.
fn tangent(tensor: &str, map: &StateMap, at: &DVector<f64>) -> Result<AffineMap, ModelError> {
    let jacobian = map.jacobian(at)?;
    let bias = map.apply(at)? - &jacobian * at;
    AffineMap::new(tensor, jacobian, bias)
}
