//! From trained networks to the maps of a model: frames and a change of the latent basis folded into the layers.

use nalgebra::{DMatrix, DVector};

use super::network::Network;
use super::parameters::{Frame, Parameters};
use crate::model::{AffineMap, Layer, ModelError, StateMap};

/// Another basis of the latent space: `z_new = turn z + shift`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LatentBasis {
    /// Invertible, `d x d`.
    pub turn: DMatrix<f64>,
    pub back: DMatrix<f64>,
    pub shift: DVector<f64>,
}

impl LatentBasis {
    pub(super) fn unchanged(latent_dim: usize) -> Self {
        Self {
            turn: DMatrix::identity(latent_dim, latent_dim),
            back: DMatrix::identity(latent_dim, latent_dim),
            shift: DVector::zeros(latent_dim),
        }
    }
}

/// Encoder and decoder between scaled states and latent coordinates in `basis`.
pub(super) fn folded(
    parameters: &Parameters,
    frame: &Frame,
    basis: &LatentBasis,
) -> Result<(StateMap, StateMap), ModelError> {
    let factors = DMatrix::from_diagonal(&frame.factors);
    let offset = -frame.factors.component_mul(&frame.mean);
    let (before, turn) = ((&factors, &offset), &basis.turn * frame.latent);
    let encoder = between(
        "encoder",
        &parameters.encoder,
        before,
        (&turn, &basis.shift),
    )?;
    let back = &basis.back / frame.latent;
    let offset = -(&back * &basis.shift);
    let spread = DMatrix::from_diagonal(&frame.spread);
    let after = (&spread, &frame.mean);
    Ok((
        encoder,
        between("decoder", &parameters.decoder, (&back, &offset), after)?,
    ))
}

/// `y -> after(network(before(y)))` as layers; both are affine, matrix and offset.
fn between(
    tensor: &str,
    network: &Network,
    before: (&DMatrix<f64>, &DVector<f64>),
    after: (&DMatrix<f64>, &DVector<f64>),
) -> Result<StateMap, ModelError> {
    let last = network.layers.len() - 1;
    let mut layers = Vec::with_capacity(network.layers.len());
    for (index, layer) in network.layers.iter().enumerate() {
        let (mut weights, mut bias) = (layer.weights.transpose(), layer.bias.clone());
        if index == 0 {
            bias += &weights * before.1;
            weights *= before.0;
        }
        if index == last {
            bias = after.0 * bias + after.1;
            weights = after.0 * weights;
        }
        layers.push(Layer {
            map: AffineMap::new(tensor, weights, bias)?,
            activation: layer.activation,
        });
    }
    StateMap::new(tensor, layers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Activation;
    use crate::train::joint::batch::Batch;
    use crate::train::joint::network::Tape;
    use crate::train::random::Random;

    #[test]
    fn folded_maps_are_the_networks_in_their_frames() {
        let mut random = Random::new(31);
        let spread = DVector::from_fn(6, |_, _| 1.0 + 0.5 * random.signed());
        let frame = Frame {
            mean: DVector::from_fn(6, |_, _| random.signed()),
            factors: spread.map(f64::recip),
            spread,
            latent: 0.4,
        };
        let turn = random.matrix(2, 2, 1.0) + DMatrix::identity(2, 2) * 2.0;
        let basis = LatentBasis {
            back: turn.clone().try_inverse().expect("dominant diagonal"),
            turn,
            shift: DVector::from_fn(2, |_, _| random.signed()),
        };
        let batch = Batch::new(0, std::array::from_fn(|_| random.matrix(3, 6, 1.0)), 0.002);
        for widths in [&[6, 5, 2][..], &[6, 2]] {
            let network = Network::random(widths, Activation::Tanh, &mut random);
            let mut back: Vec<usize> = widths.to_vec();
            back.reverse();
            let decoding = Network::random(&back, Activation::Tanh, &mut random);
            let parameters = Parameters {
                encoder: network.clone(),
                decoder: decoding.clone(),
                xi: Vec::new(),
            };
            let maps = folded(&parameters, &frame, &basis);
            let (folded, unfolded) = maps.expect("finite");
            let mut tape = Tape::default();
            let stack = network.forward(frame.enter(&batch), 3, &mut tape);
            let decoded = decoding.forward(stack.rows(0, 3).into_owned(), 3, &mut tape);
            for s in 0..3 {
                let z = folded.apply(&batch.x.row(s).transpose()).expect("six");
                let plain = stack.row(s).transpose() * frame.latent;
                assert!((&z - (&basis.turn * plain + &basis.shift)).amax() < 1e-13);
                let x = unfolded.apply(&z).expect("two");
                let expected =
                    &frame.mean + frame.spread.component_mul(&decoded.row(s).transpose());
                assert!((x - expected).amax() < 1e-12);
            }
        }
    }
}
