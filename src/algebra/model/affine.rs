//! Affine maps between robot state and latent state.

use nalgebra::{DMatrix, DVector};

use super::error::{ModelError, check_finite, check_shape};

/// The map `x -> W x + b`, in scaled units.
///
/// As an encoder `W_e` is `latent_dim x state_dim`, as a decoder `W_d` is `state_dim x latent_dim`.
/// Positions take the bias, velocities and accelerations do not.
#[derive(Clone, Debug, PartialEq)]
pub struct AffineMap {
    weights: DMatrix<f64>,
    bias: DVector<f64>,
}

impl AffineMap {
    /// The map with these weights and this bias; `tensor` names it in errors.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] unless `bias` has one entry per row of `weights`,
    /// [`ModelError::NonFinite`] if an entry is infinite or not a number.
    pub fn new(
        tensor: &str,
        weights: DMatrix<f64>,
        bias: DVector<f64>,
    ) -> Result<Self, ModelError> {
        let bias_name = format!("{tensor}.bias");
        check_shape(&bias_name, bias.shape(), (weights.nrows(), 1))?;
        check_finite(&format!("{tensor}.weights"), &weights)?;
        check_finite(&bias_name, &bias)?;
        Ok(Self { weights, bias })
    }

    /// `W`, `output_dim x input_dim`.
    pub fn weights(&self) -> &DMatrix<f64> {
        &self.weights
    }

    /// `b`, `output_dim`.
    pub fn bias(&self) -> &DVector<f64> {
        &self.bias
    }

    /// Columns of `W`.
    pub fn input_dim(&self) -> usize {
        self.weights.ncols()
    }

    /// Rows of `W`.
    pub(crate) fn output_dim(&self) -> usize {
        self.weights.nrows()
    }

    /// `W x + b`: how positions map.
    ///
    /// # Errors
    /// [`ModelError::Dimension`] if `x` is not `input_dim` long.
    pub(crate) fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        Ok(self.apply_linear(x)? + &self.bias)
    }

    /// `W dx`: how velocities and accelerations map.
    ///
    /// # Errors
    /// [`ModelError::Dimension`] if `dx` is not `input_dim` long.
    pub(crate) fn apply_linear(&self, dx: &DVector<f64>) -> Result<DVector<f64>, ModelError> {
        ModelError::check_dimension("argument of an affine map", dx.len(), self.input_dim())?;
        Ok(&self.weights * dx)
    }
}
