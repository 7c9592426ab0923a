//! Networks on batches of samples, forwards and backwards, with their time derivatives and Jacobians. Samples are rows.
//! A layer maps `y` to `phi(a)`, `a = y W + b`, and its time derivatives to `phi' da` and `phi'' da^2 + phi' dda`. The
//! three are stacked below one another (a *stack* of 3 n rows), so that a layer is one product. Rows of the Jacobian,
//! one for each output, are stacked the same way. Derivatives of elu at zero are those of the negative side.

use super::*;
use crate::train::features::vectorised;

const LANES: usize = 16;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Dense {
    pub weights: DMatrix<f64>, // W, inputs x outputs
    pub bias: DVector<f64>,    // b, one per output
    pub activation: Activation,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Network {
    pub layers: Vec<Dense>,
}

/// Record of a forward pass for the reverse sweeps.
#[derive(Default)]
pub(super) struct Tape {
    samples: usize,
    layers: Vec<Recorded>,
}

struct Recorded {
    entering: DMatrix<f64>,         // stack x inputs; empty for the first layer
    affine: DMatrix<f64>,           // stack x outputs: a, da, dda; empty for a linear layer
    derivatives: [DMatrix<f64>; 3], // samples x outputs: phi', phi'', phi'''
}

/// Jacobians of all samples, or the one of linear maps, with the records for the reverse sweep.
pub(super) struct Jacobians {
    /// Row `i m + s` is the gradient of output `i` at sample `s`; `m` is the number of samples, of linear maps 1.
    pub rows: DMatrix<f64>,
    at_affine: Vec<DMatrix<f64>>, // per layer: derivative of every output with respect to a
    at_output: Vec<DMatrix<f64>>, // the same with respect to phi(a); empty for the last layer
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

    /// Values of `samples` samples and, if `entering` stacks them below, their first and second time derivatives.
    pub(super) fn forward(
        &self,
        entering: &DMatrix<f64>,
        samples: usize,
        tape: &mut Tape,
    ) -> DMatrix<f64> {
        tape.samples = samples;
        tape.layers.clear();
        let mut y = DMatrix::default();
        for (index, layer) in self.layers.iter().enumerate() {
            let mut affine = product(if index == 0 { entering } else { &y }, &layer.weights);
            for (mut column, bias) in affine.column_iter_mut().zip(layer.bias.iter()) {
                column.rows_mut(0, samples).add_scalar_mut(*bias);
            }
            let mut recorded = Recorded {
                entering: y,
                affine: DMatrix::default(),
                derivatives: Default::default(),
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

    /// Adds the layers' share to `gradient`, given the adjoint of the result of [`Self::forward`] and those of every
    /// `a` from [`Self::jacobian_adjoint`]. Returns the adjoint of the first layer's `a`.
    pub(super) fn backward(
        &self,
        (tape, entering): (&Tape, &DMatrix<f64>),
        mut adjoint: DMatrix<f64>,
        at_affine: &[DMatrix<f64>],
        gradient: &mut Network,
    ) -> DMatrix<f64> {
        for (index, (layer, recorded)) in self.layers.iter().zip(&tape.layers).enumerate().rev() {
            if layer.activation != Activation::Linear {
                deactivate(recorded, tape.samples, &mut adjoint);
                if let Some(extra) = at_affine.get(index) {
                    let mut values = adjoint.rows_mut(0, tape.samples);
                    values += extra;
                }
            }
            let own = &mut gradient.layers[index];
            let entering = if index == 0 {
                entering
            } else {
                &recorded.entering
            };
            add_transposed(&mut own.weights, entering, &adjoint);
            for (bias, column) in own.bias.iter_mut().zip(adjoint.column_iter()) {
                *bias += column.rows(0, tape.samples).sum();
            }
            if index > 0 {
                adjoint = product(&adjoint, &layer.weights.transpose());
            }
        }
        adjoint
    }

    pub(super) fn jacobian(&self, tape: &Tape) -> Jacobians {
        let is_linear = |layer: &Dense| layer.activation == Activation::Linear;
        let n = match self.layers.iter().all(is_linear) {
            true => 1,
            false => tape.samples,
        };
        let outputs = self.layers.last().map_or(0, |layer| layer.bias.len());
        let mut at_affine = vec![DMatrix::default(); self.layers.len()];
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

    /// Adds the layers' share to `gradient`, given the adjoint of [`Jacobians::rows`]; returns those of every `a`.
    pub(super) fn jacobian_adjoint(
        &self,
        tape: &Tape,
        jacobians: &Jacobians,
        mut adjoint: DMatrix<f64>,
        gradient: &mut Network,
    ) -> Vec<DMatrix<f64>> {
        let mut onto_affine = Vec::with_capacity(self.layers.len());
        for (index, (layer, recorded)) in self.layers.iter().zip(&tape.layers).enumerate() {
            let own = &mut gradient.layers[index].weights;
            let at_affine = &jacobians.at_affine[index];
            add_transposed(own, &adjoint, at_affine); // rows = at_affine W^T
            adjoint = product(&adjoint, &layer.weights);
            let [slopes, curvatures, _] = &recorded.derivatives;
            if layer.activation == Activation::Linear {
                onto_affine.push(DMatrix::default());
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
    let has_rates = affine.nrows() > n;
    for (index, mut column) in leaving.column_iter_mut().enumerate() {
        for s in 0..n {
            let [value, slope, curvature, third] = phi.jet(column[s]);
            column[s] = value;
            if has_rates {
                let (da, dda) = (column[n + s], column[2 * n + s]);
                column[n + s] = slope * da;
                column[2 * n + s] = curvature * da * da + slope * dda;
            }
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
    let has_rates = adjoint.nrows() > n;
    for (index, mut column) in adjoint.column_iter_mut().enumerate() {
        let affine = recorded.affine.column(index);
        for s in 0..n {
            let place = (s, index);
            let (slope, curvature, third) = (slopes[place], curvatures[place], thirds[place]);
            if !has_rates {
                column[s] *= slope;
                continue;
            }
            let (da, dda) = (affine[n + s], affine[2 * n + s]);
            let (first, second) = (column[n + s], column[2 * n + s]);
            column[s] = column[s] * slope
                + (curvature * da * first + (third * da * da + curvature * dda) * second);
            column[n + s] = slope * first + 2.0 * curvature * da * second;
            column[2 * n + s] = slope * second;
        }
    }
}

/// `a b` of a batch and a small matrix: too short for general kernels, which pack their operands first.
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
pub(super) fn dot(left: &[f64], right: &[f64]) -> f64 {
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
