//! What Adam moves: encoder, decoder and Xi.

use nalgebra::{DMatrix, DVector};

use crate::train::random::Random;

/// Parameters, or gradients with respect to them; samples are rows, so maps act from the right.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters {
    /// `W_e^T`, `18 x d`: `z = x W_e^T + b_e^T`.
    pub encoder: DMatrix<f64>,
    /// `b_e`, `d`.
    pub encoder_bias: DVector<f64>,
    /// `W_d^T`, `d x 18`.
    pub decoder: DMatrix<f64>,
    /// `b_d`, 18.
    pub decoder_bias: DVector<f64>,
    /// `library_dim x d`.
    pub xi: DMatrix<f64>,
}

impl Parameters {
    /// All zero, of the given dimensions.
    pub fn zeros(state_dim: usize, latent_dim: usize, library_dim: usize) -> Self {
        Self {
            encoder: DMatrix::zeros(state_dim, latent_dim),
            encoder_bias: DVector::zeros(latent_dim),
            decoder: DMatrix::zeros(latent_dim, state_dim),
            decoder_bias: DVector::zeros(state_dim),
            xi: DMatrix::zeros(library_dim, latent_dim),
        }
    }

    /// A random start: weights uniform within `sqrt(6 / (fan in + fan out))` (Glorot and Bengio 2010), biases 0,
    /// Xi everywhere `xi`.
    pub fn random(
        state_dim: usize,
        latent_dim: usize,
        library_dim: usize,
        xi: f64,
        random: &mut Random,
    ) -> Self {
        let bound = (6.0 / (state_dim + latent_dim) as f64).sqrt();
        Self {
            encoder: random.matrix(state_dim, latent_dim, bound),
            decoder: random.matrix(latent_dim, state_dim, bound),
            xi: DMatrix::from_element(library_dim, latent_dim, xi),
            ..Self::zeros(state_dim, latent_dim, library_dim)
        }
    }

    /// The five blocks as slices, in a fixed order.
    pub fn blocks(&self) -> [&[f64]; 5] {
        [
            self.encoder.as_slice(),
            self.encoder_bias.as_slice(),
            self.decoder.as_slice(),
            self.decoder_bias.as_slice(),
            self.xi.as_slice(),
        ]
    }

    /// The five blocks, to be changed.
    pub fn blocks_mut(&mut self) -> [&mut [f64]; 5] {
        [
            self.encoder.as_mut_slice(),
            self.encoder_bias.as_mut_slice(),
            self.decoder.as_mut_slice(),
            self.decoder_bias.as_mut_slice(),
            self.xi.as_mut_slice(),
        ]
    }
}
