//! What Adam moves, and the fixed units around the maps.

use nalgebra::{DMatrix, DVector};

use super::batch::Batch;
use super::network::Network;
use crate::model::Activation;
use crate::train::random::Random;

/// Parameters, or gradients with respect to them; linear maps are networks of one layer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Parameters {
    /// From framed states to latent coordinates.
    pub encoder: Network,
    /// From latent coordinates to framed states.
    pub decoder: Network,
    /// `library_dim x d` for each phase.
    pub xi: Vec<DMatrix<f64>>,
}

impl Parameters {
    /// A random start: see [`Network::random`]; Xi everywhere `xi`.
    pub(super) fn random(
        (encoder, decoder): (&[usize], &[usize]),
        activation: Activation,
        (library_dim, phases, xi): (usize, usize, f64),
        random: &mut Random,
    ) -> Self {
        Self {
            encoder: Network::random(encoder, activation, random),
            decoder: Network::random(decoder, activation, random),
            xi: vec![DMatrix::from_element(library_dim, decoder[0], xi); phases],
        }
    }

    pub(super) fn clear(&mut self) {
        self.maps_mut().for_each(|block| block.fill(0.0));
        self.xi.iter_mut().for_each(|xi| xi.fill(0.0));
    }

    /// Weights and biases of encoder and decoder as slices, in a fixed order.
    pub(super) fn maps(&self) -> impl Iterator<Item = &[f64]> {
        self.encoder.blocks().chain(self.decoder.blocks())
    }

    pub(super) fn maps_mut(&mut self) -> impl Iterator<Item = &mut [f64]> {
        self.encoder.blocks_mut().chain(self.decoder.blocks_mut())
    }
}

/// Fixed affine maps around encoder and decoder, so that networks see and give numbers of order one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Frame {
    /// State that enters the encoder and leaves the decoder as 0, 18.
    pub mean: DVector<f64>,
    /// State for one unit of the decoder's output, 18.
    pub spread: DVector<f64>,
    /// Factors before the encoder, 18: the inverse of the spread, 0 for masked coordinates.
    pub factors: DVector<f64>,
    /// Latent coordinate for one unit of the encoder's output and of the decoder's input.
    pub latent: f64,
}

impl Frame {
    /// No change of units; `mask` (18) is true for coordinates that the encoder may use.
    pub(super) fn plain(mask: &[bool]) -> Self {
        let n = mask.len();
        Self {
            mean: DVector::zeros(n),
            spread: DVector::from_element(n, 1.0),
            factors: DVector::from_fn(n, |i, _| f64::from(mask[i])),
            latent: 1.0,
        }
    }

    /// `x`, `dx` and `ddx` of a batch, stacked, as the encoder takes them.
    pub(super) fn enter(&self, batch: &Batch) -> DMatrix<f64> {
        let n = batch.samples();
        let mut stack = DMatrix::zeros(3 * n, batch.x.ncols());
        for (index, block) in [&batch.x, &batch.dx, &batch.ddx].into_iter().enumerate() {
            stack.rows_mut(index * n, n).copy_from(block);
        }
        for (i, mut column) in stack.column_iter_mut().enumerate() {
            column.rows_mut(0, n).add_scalar_mut(-self.mean[i]);
            column *= self.factors[i];
        }
        stack
    }

    /// The stacked Jacobians of the network as those of the map between `x` and `z`, or a gradient the other way.
    pub(super) fn scale_jacobian(&self, rows: &mut DMatrix<f64>) {
        for (mut column, factor) in rows.column_iter_mut().zip(self.factors.iter()) {
            column *= self.latent * factor;
        }
    }
}
