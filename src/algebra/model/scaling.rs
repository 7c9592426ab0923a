//! Scale factors between SI units and the units in which a model was trained.

use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::error::{ModelError, check_shape};

/// Factors of one kind of quantity: `scaled value = factor * SI value`.
#[derive(Clone, Debug, PartialEq)]
pub enum ScaleFactors {
    /// One factor for all coordinates.
    Uniform(f64),
    /// One factor per coordinate.
    PerCoordinate(DVector<f64>),
}

impl ScaleFactors {
    /// One factor per coordinate, whichever way they are stored.
    pub fn expand(&self, dim: usize) -> DVector<f64> {
        match self {
            ScaleFactors::Uniform(factor) => DVector::from_element(dim, *factor),
            ScaleFactors::PerCoordinate(factors) => factors.clone(),
        }
    }

    /// Complains unless there are `dim` positive factors (or one) with finite reciprocals.
    pub(super) fn check(&self, tensor: &'static str, dim: Option<usize>) -> Result<(), ModelError> {
        if let ScaleFactors::PerCoordinate(factors) = self {
            let expected = dim.unwrap_or(factors.len());
            check_shape(&format!("scaling.{tensor}"), factors.shape(), (expected, 1))?;
        }
        let factors = self.expand(1);
        let usable = |f: f64| f.is_finite() && f > 0.0 && (1.0 / f).is_finite();
        match factors.iter().position(|&f| !usable(f)) {
            None => Ok(()),
            Some(index) => {
                let place = format!("`scaling.{tensor}`[{index}]");
                let expected = "a positive number with a finite reciprocal";
                Err(ModelError::invalid(place, factors[index], expected))
            }
        }
    }
}

/// Scale factors of state and input.
///
/// The paper trains on all quantities times 0.1 (its "normalisation 1/10"): factor 0.1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scaling {
    /// `s_x`, for `x`, `dx`, `ddx`.
    pub state: ScaleFactors,
    /// `s_u`, for `u`.
    pub input: ScaleFactors,
}

impl Scaling {
    /// One factor for everything.
    pub fn uniform(factor: f64) -> Self {
        Self {
            state: ScaleFactors::Uniform(factor),
            input: ScaleFactors::Uniform(factor),
        }
    }
}
