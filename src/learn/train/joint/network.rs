//! Networks on batches of samples, forwards and backwards, with their time derivatives and Jacobians.
//!
//! Samples are rows. A layer takes `y` to `phi(a)`, `a = y W + b`; along a trajectory its first and second time
//! derivative go to `phi' da` and `phi'' da^2 + phi' dda` with `da = dy W`, `dda = ddy W`. The three stand below one
//! another in one matrix (a *stack* of 3 n rows), so that a layer is one product. The rows of the Jacobian come from a
//! sweep in the other direction ([`Network::jacobian`]), one for each output, stacked the same way. The reverse sweeps
//! of both are exact; of elu at zero, where `phi''` jumps, the derivatives of the negative side are taken.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use crate::model::Activation;
use crate::train::features::vectorised;
use crate::train::random::Random;

const LANES: usize = 16;

/// One layer: `y -> phi(y W + b)`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Dense {
    /// `W`, inputs x outputs.
    pub weights: DMatrix<f64>,
    /// `b`, one per output.
    pub bias: DVector<f64>,
    pub activation: Activation,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Network {
    pub layers: Vec<Dense>,
}

/// Record of a forward pass for the reverse sweeps.
#[derive(Clone, Debug, Default)]
pub(super) struct Tape {
    samples: usize,
    layers: Vec<Recorded>,
}

#[derive(Clone, Debug)]
struct Recorded {
    entering: DMatrix<f64>,         // stack x inputs
    affine: DMatrix<f64>,           // stack x outputs: a, da, dda; empty for a linear layer
    derivatives: [DMatrix<f64>; 3], // samples x outputs: phi', phi'', phi'''
}

/// Jacobians of all samples, or the one of linear maps, with the records for the reverse sweep.
#[derive(Clone, Debug, Default)]
pub(super) struct Jacobians {
    /// Row `i m + s` is the gradient of output `i` at sample `s`: `(outputs m) x inputs`; `m` is 1 for linear maps, whose
    /// Jacobian is the same everywhere, and the number of samples else.
    pub rows: DMatrix<f64>,
    at_affine: Vec<DMatrix<f64>>, // per layer: derivative of every output with respect to a
    at_output: Vec<DMatrix<f64>>, // the same with respect to phi(a); empty for the last layer
}

impl Jacobians {
    /// The rows for each of `n` samples, `(outputs n) x inputs`.
    pub(super) fn at_samples(&self, n: usize, outputs: usize) -> DMatrix<f64> {
        let own = self.rows.nrows() / outputs;
        let mut rows = DMatrix::zeros(outputs * n, self.rows.ncols());
        for (mut column, from) in rows.column_iter_mut().zip(self.rows.column_iter()) {
            let blocks = column.as_mut_slice().chunks_exact_mut(n);
            for (block, from) in blocks.zip(from.as_slice().chunks_exact(own)) {
                match from {
                    [same] => block.fill(*same),
                    _ => block.copy_from_slice(from),
                }
            }
        }
        rows
    }

    /// The adjoint of [`Self::rows`], of that of the rows [at `n` samples](Self::at_samples).
    pub(super) fn of_samples<'m>(
        &self,
        adjoint: &'m DMatrix<f64>,
        n: usize,
    ) -> Cow<'m, DMatrix<f64>> {
        if self.rows.nrows() == adjoint.nrows() {
            return Cow::Borrowed(adjoint);
        }
        let sum = |i: usize, k: usize| adjoint.column(k).as_slice()[i * n..][..n].iter().sum();
        let (outputs, inputs) = self.rows.shape();
        Cow::Owned(DMatrix::from_fn(outputs, inputs, sum))
    }
}

impl Network {
    /// Layers between `widths`, all but the last with `activation`: weights uniform within `sqrt(6 / (fan in + fan
    /// out))` (Glorot and Bengio 2010), biases 0.
    pub(super) fn random(widths: &[usize], activation: Activation, random: &mut Random) -> Self {
        let last = widths.len().saturating_sub(2);
        let layers = widths.windows(2).enumerate().map(|(index, pair)| {
            let bound = (6.0 / (pair[0] + pair[1]) as f64).sqrt();
            let is_last = index == last;
            Dense {
                weights: random.matrix(pair[0], pair[1], bound),
                bias: DVector::zeros(pair[1]),
                activation: if is_last {
                    Activation::Linear
                } else {
                    activation
                },
            }
        });
        Self {
            layers: layers.collect(),
        }
    }

    /// Weights and bias of every layer as slices, in a fixed order.
    pub(super) fn blocks(&self) -> impl Iterator<Item = &[f64]> {
        self.layers
            .iter()
            .flat_map(|layer| [layer.weights.as_slice(), layer.bias.as_slice()])
    }

    pub(super) fn blocks_mut(&mut self) -> impl Iterator<Item = &mut [f64]> {
        self.layers
            .iter_mut()
            .flat_map(|layer| [layer.weights.as_mut_slice(), layer.bias.as_mut_slice()])
    }

    /// Values of `samples` samples with their first and second time derivatives: `entering` stacks the three, and so
    /// does the result.
    pub(super) fn forward(
        &self,
        entering: DMatrix<f64>,
        samples: usize,
        tape: &mut Tape,
    ) -> DMatrix<f64> {
        tape.samples = samples;
        tape.layers.clear();
        let mut y = entering;
        for layer in &self.layers {
            let mut affine = product(&y, &layer.weights);
            for (mut column, bias) in affine.column_iter_mut().zip(layer.bias.iter()) {
                column.rows_mut(0, samples).add_scalar_mut(*bias);
            }
            let mut recorded = Recorded {
                entering: y,
                affine: DMatrix::zeros(0, 0),
                derivatives: std::array::from_fn(|_| DMatrix::zeros(0, 0)),
            };
            y = match layer.activation {
                Activation::Linear => affine,
                phi => {
                    let (leaving, derivatives) = activate(phi, &affine, samples);
                    (recorded.affine, recorded.derivatives) = (affine, derivatives);
                    leaving
                }
            };
            tape.layers.push(recorded);
        }
        y
    }

    /// Adds to `gradient` the share of the layers, given the adjoint of the result of [`Self::forward`]; returns the
    /// adjoint of the first layer's `a`, see [`Self::onto_input`].
    ///
    /// `at_affine` (one matrix per layer, or none) is added to the adjoint of `a`; it comes from
    /// [`Self::jacobian_adjoint`].
    pub(super) fn backward(
        &self,
        tape: &Tape,
        adjoint: DMatrix<f64>,
        at_affine: &[DMatrix<f64>],
        gradient: &mut Network,
    ) -> DMatrix<f64> {
        let mut adjoint = adjoint;
        for (index, (layer, recorded)) in self.layers.iter().zip(&tape.layers).enumerate().rev() {
            if layer.activation != Activation::Linear {
                deactivate(recorded, tape.samples, &mut adjoint);
                if let Some(extra) = at_affine.get(index) {
                    let mut values = adjoint.rows_mut(0, tape.samples);
                    values += extra;
                }
            }
            let own = &mut gradient.layers[index];
            add_transposed(&mut own.weights, &recorded.entering, &adjoint);
            for (bias, column) in own.bias.iter_mut().zip(adjoint.column_iter()) {
                *bias += column.rows(0, tape.samples).sum();
            }
            if index > 0 {
                adjoint = product(&adjoint, &layer.weights.transpose());
            }
        }
        adjoint
    }

    /// The adjoint of the input, of that of the first layer's `a`.
    pub(super) fn onto_input(&self, at_first: &DMatrix<f64>) -> DMatrix<f64> {
        product(at_first, &self.layers[0].weights.transpose())
    }

    pub(super) fn jacobian(&self, tape: &Tape) -> Jacobians {
        let is_linear = |layer: &Dense| layer.activation == Activation::Linear;
        let n = match self.layers.iter().all(is_linear) {
            true => 1,
            false => tape.samples,
        };
        let outputs = self.layers.last().map_or(0, |layer| layer.bias.len());
        let mut at_affine = vec![DMatrix::zeros(0, 0); self.layers.len()];
        let mut at_output = at_affine.clone();
        let mut sensitivity = DMatrix::zeros(outputs * n, outputs);
        for i in 0..outputs {
            sensitivity.view_mut((i * n, i), (n, 1)).fill(1.0);
        }
        for (index, (layer, recorded)) in self.layers.iter().zip(&tape.layers).enumerate().rev() {
            if layer.activation != Activation::Linear {
                let slopes = &recorded.derivatives[0];
                let sloped = times_each(&sensitivity, slopes);
                at_output[index] = std::mem::replace(&mut sensitivity, sloped);
            }
            let before = product(&sensitivity, &layer.weights.transpose());
            at_affine[index] = std::mem::replace(&mut sensitivity, before);
        }
        Jacobians {
            rows: sensitivity,
            at_affine,
            at_output,
        }
    }

    /// Adds to `gradient` the share of the layers, given the adjoint of [`Jacobians::rows`].
    ///
    /// Returns the adjoint of `a` of every layer, to be given to [`Self::backward`].
    pub(super) fn jacobian_adjoint(
        &self,
        tape: &Tape,
        jacobians: &Jacobians,
        adjoint: &DMatrix<f64>,
        gradient: &mut Network,
    ) -> Vec<DMatrix<f64>> {
        let mut onto_affine = Vec::with_capacity(self.layers.len());
        let mut adjoint = adjoint.clone();
        for (index, (layer, recorded)) in self.layers.iter().zip(&tape.layers).enumerate() {
            let own = &mut gradient.layers[index].weights;
            let at_affine = &jacobians.at_affine[index];
            add_transposed(own, &adjoint, at_affine); // rows = at_affine W^T
            adjoint = product(&adjoint, &layer.weights);
            let [slopes, curvatures, _] = &recorded.derivatives;
            if layer.activation == Activation::Linear {
                onto_affine.push(DMatrix::zeros(0, 0));
                continue;
            }
            let bent = adjoint.component_mul(&jacobians.at_output[index]);
            onto_affine.push(summed(&bent, tape.samples).component_mul(curvatures));
            adjoint = times_each(&adjoint, slopes);
        }
        onto_affine
    }
}

/// Every block of `stack` times `factors`, entry by entry.
fn times_each(stack: &DMatrix<f64>, factors: &DMatrix<f64>) -> DMatrix<f64> {
    let n = factors.nrows();
    let mut product = stack.clone();
    for (mut column, factors) in product.column_iter_mut().zip(factors.column_iter()) {
        let column = column.as_mut_slice();
        for block in column.chunks_exact_mut(n) {
            for (value, factor) in block.iter_mut().zip(factors.as_slice()) {
                *value *= factor;
            }
        }
    }
    product
}

fn summed(stack: &DMatrix<f64>, n: usize) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(n, stack.ncols());
    for start in (0..stack.nrows()).step_by(n.max(1)) {
        sum += stack.rows(start, n);
    }
    sum
}

/// `phi` on a stack, and its derivatives at the values.
fn activate(phi: Activation, affine: &DMatrix<f64>, n: usize) -> (DMatrix<f64>, [DMatrix<f64>; 3]) {
    let mut leaving = affine.clone();
    let mut derivatives: [_; 3] = std::array::from_fn(|_| DMatrix::zeros(n, affine.ncols()));
    for (index, mut column) in leaving.column_iter_mut().enumerate() {
        for s in 0..n {
            let [value, slope, curvature, third] = phi.jet(column[s]);
            let (da, dda) = (column[n + s], column[2 * n + s]);
            column[s] = value;
            column[n + s] = slope * da;
            column[2 * n + s] = curvature * da * da + slope * dda;
            let [slopes, curvatures, thirds] = &mut derivatives;
            slopes[(s, index)] = slope;
            (curvatures[(s, index)], thirds[(s, index)]) = (curvature, third);
        }
    }
    (leaving, derivatives)
}

/// The adjoint of `phi` of a stack becomes the one of the stack of `a`.
fn deactivate(recorded: &Recorded, n: usize, adjoint: &mut DMatrix<f64>) {
    let [slopes, curvatures, thirds] = &recorded.derivatives;
    for (index, mut column) in adjoint.column_iter_mut().enumerate() {
        let affine = recorded.affine.column(index);
        for s in 0..n {
            let place = (s, index);
            let (slope, curvature, third) = (slopes[place], curvatures[place], thirds[place]);
            let (da, dda) = (affine[n + s], affine[2 * n + s]);
            let (first, second) = (column[n + s], column[2 * n + s]);
            column[s] = column[s] * slope
                + (curvature * da * first + (third * da * da + curvature * dda) * second);
            column[n + s] = slope * first + 2.0 * curvature * da * second;
            column[2 * n + s] = slope * second;
        }
    }
}

/// `a b` of a batch and a small matrix.
///
/// A batch is a hundred rows and a product a microsecond: too short for general kernels, which pack their operands
/// first. Every loop here runs down columns.
pub(super) fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut product = DMatrix::zeros(a.nrows(), b.ncols());
    add_columns(product.as_mut_slice(), a, b);
    product
}

vectorised! {
    fn add_columns(out: &mut [f64], a: &DMatrix<f64>, b: &DMatrix<f64>) {
        assert_eq!(a.ncols(), b.nrows());
        let rows = a.nrows();
        let each = b.as_slice().chunks_exact(b.nrows());
        for (out, factors) in out.chunks_exact_mut(rows).zip(each) {
            let mut pairs = factors.chunks_exact(2);
            let mut columns = a.as_slice().chunks_exact(2 * rows);
            for (factor, columns) in pairs.by_ref().zip(columns.by_ref()) {
                let (first, second) = columns.split_at(rows);
                for ((o, x), y) in out.iter_mut().zip(first).zip(second) {
                    *o += factor[0] * x + factor[1] * y;
                }
            }
            for factor in pairs.remainder() {
                for (o, x) in out.iter_mut().zip(columns.remainder()) {
                    *o += factor * x;
                }
            }
        }
    }
}

vectorised! {
    /// `out += a^T b`.
    pub(super) fn add_transposed(out: &mut DMatrix<f64>, a: &DMatrix<f64>, b: &DMatrix<f64>) {
        assert_eq!((out.shape(), a.nrows()), ((a.ncols(), b.ncols()), b.nrows()));
        let mut entries = out.as_mut_slice().iter_mut();
        for right in b.as_slice().chunks_exact(b.nrows()) {
            for (left, entry) in a.as_slice().chunks_exact(a.nrows()).zip(entries.by_ref()) {
                *entry += dot(left, right);
            }
        }
    }
}

#[inline(always)]
fn dot(left: &[f64], right: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let ((a, left), (b, right)) = (left.as_chunks::<LANES>(), right.as_chunks::<LANES>());
    for (index, a) in a.iter().enumerate() {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[index][lane];
        }
    }
    let mut rest = 0.0;
    for (index, x) in left.iter().enumerate() {
        rest += x * right[index];
    }
    rest + sums.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{AffineMap, Layer, StateMap};

    const N: usize = 3;

    fn networks() -> Vec<Network> {
        let mut random = Random::new(3);
        let mut all = Vec::new();
        for phi in Activation::ALL {
            all.push(Network::random(&[5, 6, 4, 2], phi, &mut random));
            let mut last_nonlinear = Network::random(&[5, 4, 2], phi, &mut random);
            last_nonlinear.layers[1].activation = phi;
            all.push(last_nonlinear);
        }
        for network in &mut all {
            for layer in &mut network.layers {
                // Off zero, where the second derivative of elu jumps.
                layer.bias.iter_mut().for_each(|b| *b = random.signed());
            }
        }
        all
    }

    fn as_map(network: &Network) -> StateMap {
        let layers = network.layers.iter().map(|layer| Layer {
            map: AffineMap::new("m", layer.weights.transpose(), layer.bias.clone()).unwrap(),
            activation: layer.activation,
        });
        StateMap::new("m", layers.collect()).unwrap()
    }

    #[test]
    fn forward_and_jacobian_equal_those_of_the_model() {
        let mut random = Random::new(4);
        for network in networks() {
            let map = as_map(&network);
            let stack = random.matrix(3 * N, 5, 1.0);
            let mut tape = Tape::default();
            let leaving = network.forward(stack.clone(), N, &mut tape);
            let jacobians = network.jacobian(&tape);
            for s in 0..N {
                let [x, dx, ddx] = [0, 1, 2].map(|k| stack.row(k * N + s).transpose());
                let row = |k: usize| leaving.row(k * N + s).transpose();
                let [y, dy, ddy] = map.apply_rates(&x, &dx, &ddx).unwrap();
                assert!((row(0) - y).amax() < 1e-14);
                assert!((row(1) - dy).amax() < 1e-14);
                assert!((row(2) - ddy).amax() < 1e-13);
                let jacobian = map.jacobian(&x).unwrap();
                let samples = jacobians.rows.nrows() / 2;
                for i in 0..2 {
                    let row = jacobians.rows.row(i * samples + s % samples);
                    assert!((row - jacobian.row(i)).amax() < 1e-14);
                }
            }
        }
    }
}
