//! In which units generated functions take and give robot coordinates.

use crate::lower::LowerError;
use crate::model::{ReducedModel, Scaling};

/// Units of `x`, `dx` and `u` at the interface of generated code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Units {
    /// SI units; the model's scaling factors are folded into the maps.
    #[default]
    Si,
    /// Scaled values as the model was learned with: `s_x x`, `s_x dx`, `s_u u`; the maps are the
    /// encoder's and the decoder's very weights.
    Scaled,
}

impl Units {
    /// The units of robot coordinates in words.
    pub(super) fn of_robot(self) -> &'static str {
        match self {
            Self::Si => "SI units",
            Self::Scaled => "scaled units (s_x and s_u times SI units)",
        }
    }

    /// The model whose maps take these units.
    pub(super) fn convert(self, model: &ReducedModel) -> Result<ReducedModel, LowerError> {
        match (self, model.scaling()) {
            (Self::Scaled, Ok(_)) => {
                let builder = model.clone().into_builder();
                Ok(builder.scaling(Scaling::uniform(1.0)).build()?)
            }
            // A model without robot coordinates has no maps either.
            (Self::Si, _) | (Self::Scaled, Err(_)) => Ok(model.clone()),
        }
    }
}
