//! Parameters of Adam, the fixed units around the maps, and the maps of a model into which these and a latent basis are
//! folded. Also latent inputs `u_lat = (J J^T)^-1 J u` of a batch, forwards and backwards.

use super::network::Network;
use super::*;

/// Parameters, or gradients with respect to them; linear maps are networks of one layer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Parameters {
    pub encoder: Network,      // from framed states to latent coordinates
    pub decoder: Network,      // and back
    pub xi: Vec<DMatrix<f64>>, // library_dim x d for each phase
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
    /// `x`, `dx` and `ddx` of samples in rows, stacked, as input of the encoder.
    pub(super) fn enter(&self, blocks: [&DMatrix<f64>; 3]) -> DMatrix<f64> {
        let n = blocks[0].nrows();
        let mut stack = DMatrix::zeros(3 * n, blocks[0].ncols());
        for (index, block) in blocks.into_iter().enumerate() {
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
    pub turn: DMatrix<f64>, // invertible, d x d
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

const DAMPING: f64 = 1e-12; // on the diagonal of J J^T

pub(super) struct InputProjections {
    pub u_lat: DMatrix<f64>, // n x d
    /// Sum over samples of `(J u) . u_lat`: the energy of the inputs that the latent inputs carry.
    pub carried: f64,
    factors: Vec<f64>, // Cholesky factors, d x d per Jacobian, row-major
}

impl InputProjections {
    /// `rows` (`(d m) x 18`) are the Jacobians', one per sample of `u` (`n x 18`) or one for all.
    pub(super) fn new(rows: &DMatrix<f64>, u: &DMatrix<f64>, d: usize) -> Self {
        let (n, m) = (u.nrows(), rows.nrows() / d);
        let mut right = DMatrix::zeros(n, d);
        let mut grams = vec![vec![0.0; m]; d * d];
        for (jacobian, input) in rows.column_iter().zip(u.column_iter()) {
            let (jacobian, input) = (jacobian.as_slice(), input.as_slice());
            for (i, row) in jacobian.chunks_exact(m).enumerate() {
                add_times(right.column_mut(i).as_mut_slice(), row, input, 1.0);
                for (k, other) in jacobian.chunks_exact(m).take(i + 1).enumerate() {
                    add_times(&mut grams[i * d + k], row, other, 1.0);
                }
            }
        }
        let mut factors = vec![0.0; m * d * d];
        for (s, factor) in factors.chunks_exact_mut(d * d).enumerate() {
            for (entry, gram) in factor.iter_mut().zip(&grams) {
                *entry = gram[s];
            }
            factorise(factor, d);
        }
        let u_lat = solved(&factors, &right);
        let pairs = (0..n).flat_map(|s| (0..d).map(move |i| (s, i)));
        Self {
            carried: pairs.fold(0.0, |sum, at| sum + right[at] * u_lat[at]),
            u_lat,
            factors,
        }
    }

    /// Adjoint of the Jacobians, given that of `u_lat`, plus `-lift` times the gradient of [`Self::carried`]: with `w =
    /// (J J^T)^-1 adjoint`, `v = u_lat` and `r = u - J^T v` it is `w r^T - v (J^T w)^T - 2 lift v r^T`.
    pub(super) fn adjoint(
        &self,
        rows: &DMatrix<f64>,
        u: &DMatrix<f64>,
        onto_u_lat: &DMatrix<f64>,
        lift: f64,
    ) -> DMatrix<f64> {
        let (n, d) = self.u_lat.shape();
        let (v, w) = (&self.u_lat, solved(&self.factors, onto_u_lat));
        let lifted = w.zip_map(v, |w, v| w - 2.0 * lift * v);
        let m = rows.nrows() / d;
        let mut onto = DMatrix::zeros(d * m, u.ncols());
        let (mut rest, mut crossed) = (vec![0.0; n], vec![0.0; n]);
        let columns = rows.column_iter().zip(u.column_iter());
        for (mut onto, (rows, input)) in onto.column_iter_mut().zip(columns) {
            rest.copy_from_slice(input.as_slice());
            crossed.fill(0.0);
            for (i, jacobian) in rows.as_slice().chunks_exact(m).enumerate() {
                add_times(&mut rest, jacobian, v.column(i).as_slice(), -1.0);
                add_times(&mut crossed, jacobian, w.column(i).as_slice(), 1.0);
            }
            for (i, onto) in onto.as_mut_slice().chunks_exact_mut(m).enumerate() {
                add_outer(onto, lifted.column(i).as_slice(), &rest, 1.0);
                add_outer(onto, v.column(i).as_slice(), &crossed, -1.0);
            }
        }
        onto
    }
}

/// Adds `sign` times the products of a row of the Jacobians, of which there may be one for all samples.
fn add_times(out: &mut [f64], row: &[f64], factors: &[f64], sign: f64) {
    let each = out.iter_mut().zip(factors);
    match row {
        [same] => each.for_each(|(out, factor)| *out += sign * same * factor),
        _ => (each.zip(row)).for_each(|((out, factor), entry)| *out += sign * entry * factor),
    }
}

/// Adds `sign` times the products to each sample's row, or their sum to the one row for all.
fn add_outer(onto: &mut [f64], left: &[f64], right: &[f64], sign: f64) {
    match onto {
        [sum] => *sum += sign * dot(left, right),
        _ => {
            for (onto, (left, right)) in onto.iter_mut().zip(left.iter().zip(right)) {
                *onto += sign * left * right;
            }
        }
    }
}

/// `(J J^T)^-1` of every sample times its row, by the factors of each or of all.
fn solved(factors: &[f64], rows: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, d) = rows.shape();
    if factors.len() == d * d && n > d {
        return product(rows, &solved(factors, &DMatrix::identity(d, d)));
    }
    let mut solved = rows.clone();
    let mut right = vec![0.0; d];
    for (s, factor) in (0..n).zip(factors.chunks_exact(d * d).cycle()) {
        (0..d).for_each(|i| right[i] = rows[(s, i)]);
        solve(factor, &mut right);
        (0..d).for_each(|i| solved[(s, i)] = right[i]);
    }
    solved
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
