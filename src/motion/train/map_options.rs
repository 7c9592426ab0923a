//! Layers of the maps to be trained.

use super::error::TrainError;
use crate::model::{Activation, MAX_LAYER_WIDTH, MAX_LAYERS};

/// Layers of encoder and decoder; without hidden layers both are affine maps.
#[derive(Clone, Debug, PartialEq)]
pub struct MapOptions {
    /// Widths of the encoder's hidden layers; a linear layer to the latent coordinates follows.
    pub encoder_layers: Vec<usize>,
    /// Widths of the decoder's hidden layers; a linear layer to the state follows.
    pub decoder_layers: Vec<usize>,
    /// Activation of the hidden layers.
    pub activation: Activation,
}

impl Default for MapOptions {
    /// Affine maps.
    fn default() -> Self {
        Self {
            encoder_layers: Vec::new(),
            decoder_layers: Vec::new(),
            activation: Activation::Elu,
        }
    }
}

impl MapOptions {
    /// Whether encoder and decoder are affine maps.
    pub fn is_linear(&self) -> bool {
        self.encoder_layers.is_empty() && self.decoder_layers.is_empty()
    }

    pub(super) fn check(&self, latent_dim: usize) -> Result<(), TrainError> {
        let each = [
            ("encoder-layers", &self.encoder_layers, latent_dim.max(1)),
            ("decoder-layers", &self.decoder_layers, 1),
        ];
        for (option, widths, least) in each {
            let refused = |expected| TrainError::Option {
                option,
                found: format!("{widths:?}"),
                expected,
            };
            if widths.len() >= MAX_LAYERS {
                return Err(refused("at most 15 hidden layers"));
            }
            if widths.iter().any(|width| *width > MAX_LAYER_WIDTH) {
                return Err(refused("layers of at most 1024 units"));
            }
            if widths.iter().any(|width| *width < least) {
                return Err(refused("layers at least as wide as the latent space"));
            }
        }
        Ok(())
    }
}
