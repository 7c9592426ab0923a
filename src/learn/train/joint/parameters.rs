//! What Adam moves, the fixed units around the maps, and the maps of a model in which these units and a change of the
//! latent basis are part of the layers.
//!
//! Latent inputs of a batch, forwards and backwards: `u_lat = pinv(J^T) u = (J J^T)^-1 J u` with the Jacobian `J` of
//! the encoder at every sample. The Gram matrices, as small as the latent space, are factored one by one; directions
//! that are nearly dependent are damped.

use nalgebra::{DMatrix, DVector};

use super::loss::Batch;
use super::network::Network;
use crate::model::{Activation, AffineMap, Layer, ModelError, StateMap};
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

/// Added to the diagonal of `J J^T`.
const DAMPING: f64 = 1e-12;

#[derive(Clone, Debug)]
pub(super) struct InputProjections {
    /// `n x d`.
    pub u_lat: DMatrix<f64>,
    /// Sum over samples of `(J u) . u_lat`: the energy of the inputs that the latent inputs carry.
    pub carried: f64,
    factors: Vec<f64>, // Cholesky factors, d x d per sample, row-major
}

impl InputProjections {
    /// Projects `u` (`n x 18`) by the Jacobians whose rows are stacked in `rows` (`(d n) x 18`).
    pub(super) fn new(rows: &DMatrix<f64>, u: &DMatrix<f64>) -> Self {
        let n = u.nrows();
        let d = rows.nrows() / n.max(1);
        let mut u_lat = DMatrix::zeros(n, d);
        let mut grams = vec![DMatrix::zeros(n, 1); d * d];
        for (jacobian, input) in rows.column_iter().zip(u.column_iter()) {
            let (jacobian, input) = (jacobian.as_slice(), input.as_slice());
            for (i, row) in jacobian.chunks_exact(n).enumerate() {
                for (sum, (j, u)) in u_lat.column_mut(i).iter_mut().zip(row.iter().zip(input)) {
                    *sum += j * u;
                }
                for (k, other) in jacobian.chunks_exact(n).take(i + 1).enumerate() {
                    let gram = grams[i * d + k].as_mut_slice();
                    for (sum, (a, b)) in gram.iter_mut().zip(row.iter().zip(other)) {
                        *sum += a * b;
                    }
                }
            }
        }
        let (mut factors, mut carried) = (vec![0.0; n * d * d], 0.0);
        let mut right = vec![0.0; d];
        for (s, factor) in factors.chunks_exact_mut(d * d).enumerate() {
            for (entry, gram) in factor.iter_mut().zip(&grams) {
                *entry = gram[s];
            }
            factorise(factor, d);
            (0..d).for_each(|i| right[i] = u_lat[(s, i)]);
            solve(factor, &mut right);
            for (i, value) in right.iter().enumerate() {
                carried += u_lat[(s, i)] * value;
                u_lat[(s, i)] = *value;
            }
        }
        Self {
            u_lat,
            carried,
            factors,
        }
    }

    /// Adjoint of the Jacobians (`(d n) x 18`), given the one of `u_lat` (`n x d`), plus `-lift` times the gradient of
    /// [`Self::carried`].
    ///
    /// With `w = (J J^T)^-1 adjoint`, `v = u_lat` and the rest `r = u - J^T v` it is
    /// `w r^T - v (J^T w)^T - 2 lift v r^T`.
    pub(super) fn adjoint(
        &self,
        rows: &DMatrix<f64>,
        u: &DMatrix<f64>,
        onto_u_lat: &DMatrix<f64>,
        lift: f64,
    ) -> DMatrix<f64> {
        let (n, d) = self.u_lat.shape();
        let mut solved = onto_u_lat.clone();
        let mut right = vec![0.0; d];
        for (s, factor) in self.factors.chunks_exact(d * d).enumerate() {
            (0..d).for_each(|i| right[i] = onto_u_lat[(s, i)]);
            solve(factor, &mut right);
            (0..d).for_each(|i| solved[(s, i)] = right[i]);
        }
        let mut onto = DMatrix::zeros(d * n, u.ncols());
        let (mut rest, mut crossed) = (vec![0.0; n], vec![0.0; n]);
        for ((mut onto, row), input) in onto
            .column_iter_mut()
            .zip(rows.column_iter())
            .zip(u.column_iter())
        {
            rest.copy_from_slice(input.as_slice());
            crossed.fill(0.0);
            for (i, jacobian) in row.as_slice().chunks_exact(n).enumerate() {
                let (v, w) = (self.u_lat.column(i), solved.column(i));
                for s in 0..n {
                    rest[s] -= jacobian[s] * v[s];
                    crossed[s] += jacobian[s] * w[s];
                }
            }
            for (i, onto) in onto.as_mut_slice().chunks_exact_mut(n).enumerate() {
                let (v, w) = (self.u_lat.column(i), solved.column(i));
                for s in 0..n {
                    onto[s] = (w[s] - 2.0 * lift * v[s]) * rest[s] - v[s] * crossed[s];
                }
            }
        }
        onto
    }
}

/// Cholesky factor in place of a Gram matrix whose lower triangle is given, row-major; damped.
fn factorise(matrix: &mut [f64], d: usize) {
    for i in 0..d {
        matrix[i * d + i] += DAMPING;
        for k in 0..=i {
            let known: f64 = (0..k).map(|m| matrix[i * d + m] * matrix[k * d + m]).sum();
            let left = matrix[i * d + k] - known;
            matrix[i * d + k] = if i == k {
                left.max(DAMPING).sqrt()
            } else {
                left / matrix[k * d + k]
            };
        }
    }
}

/// Solves `L L^T x = right` in place.
fn solve(factor: &[f64], right: &mut [f64]) {
    let d = right.len();
    for i in 0..d {
        let known: f64 = (0..i).map(|k| factor[i * d + k] * right[k]).sum();
        right[i] = (right[i] - known) / factor[i * d + i];
    }
    for i in (0..d).rev() {
        let known: f64 = (i + 1..d).map(|k| factor[k * d + i] * right[k]).sum();
        right[i] = (right[i] - known) / factor[i * d + i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::joint::network::Tape;

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
        let batch = Batch::random(0, (3, 6), 1.0, &mut random);
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
            let decoded = decoding.forward(stack.clone(), 3, &mut tape);
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
