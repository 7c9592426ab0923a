//! The maps of a model between robot and latent coordinates, and these maps to first order at a state.
//!
//! With the encoder `E` and the decoder `D`, their Jacobians `J_E` at `s_x x` and `J_D` at `z`:
//!
//! - `z = E(s_x x)`, `dz = J_E (s_x dx)`, `ddz = J_E (s_x ddx) + dJ_E/dt (s_x dx)`;
//! - `x = D(z) / s_x`, `dx = J_D dz / s_x`;
//! - `u_lat = pinv(J_E^T) (s_u u)` (project), `u = (J_E^T u_lat) / s_u` (lift).
//!
//! For a linear model the Jacobians are the same at every state. All of `x`, `dx`, `ddx` and `u` are in SI units.

use nalgebra::{DMatrix, DVector};

use super::error::{ModelError, check_finite};
use super::rom::ReducedModel;
use super::state_map::{AffineMap, StateMap};

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
    /// Whether encoder and decoder, as far as the model has them, are single affine maps.
    pub fn is_linear(&self) -> bool {
        let mut maps = self.parts.encoder.iter().chain(&self.parts.decoder);
        maps.all(|map| map.as_affine().is_some())
    }

    pub fn encoder_map(&self) -> Result<&StateMap, ModelError> {
        let purpose = "going from robot to latent coordinates";
        self.require(self.parts.encoder.as_ref(), "encoder", purpose)
    }

    pub fn decoder_map(&self) -> Result<&StateMap, ModelError> {
        let purpose = "going from latent to robot coordinates";
        self.require(self.parts.decoder.as_ref(), "decoder", purpose)
    }

    /// The encoder of a linear model, in scaled units: `W_e` is `latent_dim x state_dim`.
    pub fn encoder(&self) -> Result<&AffineMap, ModelError> {
        self.affine("encoder", self.encoder_map()?)
    }

    /// The decoder of a linear model, in scaled units: `W_d` is `state_dim x latent_dim`.
    pub fn decoder(&self) -> Result<&AffineMap, ModelError> {
        self.affine("decoder", self.decoder_map()?)
    }

    /// `pinv(W_e^T)` of a linear model, `latent_dim x state_dim`, in scaled units.
    pub fn input_projection(&self) -> Result<&DMatrix<f64>, ModelError> {
        self.encoder()?;
        let projection = self.input_projection.as_ref();
        self.require(projection, "encoder", "projecting inputs")
    }

    /// The model with encoder and decoder linearised: the encoder about the state `x`, the decoder about `z = E(s_x
    /// x)`. The dynamics and linear maps stay the same.
    ///
    /// Positions, velocities and inputs of the two models agree at `x` and differ elsewhere.
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

    /// `z = E(s_x x)`, for a linear model `W_e (s_x x) + b_e`.
    pub fn encode(&self, x: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        self.encoder_map()?.apply(&self.scaled_state(x)?)
    }

    /// `x = D(z) / s_x`, for a linear model `(W_d z + b_d) / s_x`.
    pub fn decode(&self, z: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        let scaled = self.decoder_map()?.apply(z)?;
        Ok(scaled.component_div(&self.state_factors()?))
    }

    /// `ddz = J_E (s_x ddx) + dJ_E/dt (s_x dx)` at the state `x`.
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

    /// The maps that the encoder's Jacobian at the state `x` gives.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] where the Jacobian does not have full row rank.
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

    /// `d z / d x = J_E s_x` at the state `x`, `latent_dim x state_dim`; of any rank.
    pub fn encoder_jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, ModelError> {
        let jacobian = self.encoder_map()?.jacobian(&self.scaled_state(x)?)?;
        let s_x = self.state_factors()?;
        Ok(jacobian.map_with_location(|_, column, value| value * s_x[column]))
    }

    /// `d x / d z = J_D / s_x` at the latent state `z`, `state_dim x latent_dim`.
    pub fn decoder_jacobian(&self, z: &DVector<f64>) -> Result<DMatrix<f64>, ModelError> {
        let jacobian = self.decoder_map()?.jacobian(z)?;
        let s_x = self.state_factors()?;
        Ok(jacobian.map_with_location(|row, _, value| value / s_x[row]))
    }

    fn scaled_state(&self, x: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
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

/// An encoder has full row rank if its smallest singular value is above this share of the largest.
pub(crate) const RANK_TOLERANCE: f64 = 1e-10;

/// `pinv(W_e^T)`, `latent_dim x state_dim`, from the singular values of `W_e = U S V^T`: `pinv(W_e^T) = U S^-1 V^T`.
pub(super) fn pinv_of_transpose(
    weights: &DMatrix<f64>,
    matrix: &str,
) -> Result<DMatrix<f64>, ModelError> {
    let dim = weights.nrows();
    let deficient = |smallest: f64, largest: f64| {
        let found = format!("singular values from {smallest:e} to {largest:e}");
        let expected =
            format!("full row rank {dim} (smallest above {RANK_TOLERANCE:e} times the largest)");
        ModelError::invalid(matrix, found, expected)
    };
    let largest_entry = weights.amax();
    if largest_entry == 0.0 {
        return Err(deficient(0.0, 0.0));
    }
    // Divided by the largest entry first, so that no intermediate product overflows.
    let normalised = weights / largest_entry;
    let max_iterations = 1_000 * weights.ncols();
    let svd = nalgebra::SVD::try_new(normalised, true, true, f64::EPSILON, max_iterations)
        .filter(|svd| svd.singular_values.iter().all(|value| value.is_finite()))
        .ok_or_else(|| ModelError::no_decomposition("encoder.weights"))?;
    let smallest = svd.singular_values.min();
    let largest = svd.singular_values.max();
    if smallest <= RANK_TOLERANCE * largest {
        return Err(deficient(smallest * largest_entry, largest * largest_entry));
    }
    let u = svd.u.expect("asked for the left singular vectors");
    let v_t = svd.v_t.expect("asked for the right singular vectors");
    let inverse = svd.singular_values.map(|value| 1.0 / value);
    let projection = u * DMatrix::from_diagonal(&inverse) * v_t / largest_entry;
    let projection = refined(projection, weights);
    check_finite("pinv(encoder.weights^T)", &projection)?;
    Ok(projection)
}

/// Reduces the error of the iterative SVD, which can be 1e-10 even for well-conditioned matrices, by one Newton step on
/// `P W_e^T = I`, which squares the residual.
fn refined(projection: DMatrix<f64>, weights: &DMatrix<f64>) -> DMatrix<f64> {
    const NEGLIGIBLE: f64 = 1e-13;
    let dim = projection.nrows();
    let residual = DMatrix::identity(dim, dim) - &projection * weights.transpose();
    if residual.amax() <= NEGLIGIBLE {
        return projection;
    }
    let step = &residual * &projection;
    projection + step
}

/// The projector on what is orthogonal to the columns: `I` without columns that are zero.
pub fn complement(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let d = columns.nrows();
    let mut projector = DMatrix::identity(d, d);
    for column in columns.column_iter() {
        let direction = &projector * column;
        let square = direction.norm_squared();
        if square > f64::EPSILON * column.norm_squared() {
            projector -= &direction * direction.transpose() / square;
        }
    }
    projector
}
