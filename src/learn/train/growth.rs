//! A bound on the growth of deviations. About the mean state of a phase a deviation moves by
//! `A = [0 I; d ddz/dz  d ddz/d dz]`, so it grows at most at the largest real part of the eigenvalues of `A`. Through
//! phases of durations `T_1 ... T_k` it is multiplied by `M = e^(A_k T_k) ... e^(A_1 T_1)`, whose eigenvalues `mu` have
//! rates `ln|mu| / sum T`: feedback that is stable in every phase may still grow through their sequence.

use nalgebra::Complex;

use super::*;
use crate::evaluate::{eigenvalues, state_matrix, transition, usual_stride};

const STEPS: usize = 30; // of least change, before coefficients are scaled down instead
const HALVINGS: usize = 100; // after which nothing is left that could grow
const SHORTENED: i32 = 6; // of a step, until it makes growth slower
const AIM: f64 = 0.99; // share of the bound that steps aim at
const DIFFERENCE: f64 = 1e-6; // of the quotients, relative to the largest value that is moved

pub(super) struct Growth {
    bound_per_s: f64,            // infinite without a bound
    slopes: Vec<DMatrix<f64>>,   // a phase: d theta / d (z, dz) at its mean state
    sequence: Vec<(usize, f64)>, // phases and their durations in s, of a walk one stride
}

/// An eigenvalue that grows too fast, and how its rate changes with the lower half of every phase's `A`.
struct Mode {
    value: Complex<f64>,
    excess: f64, // of its rate above the target
    slopes: Vec<DMatrix<f64>>,
}

impl Growth {
    /// Of these jumps: the mean state of each phase, and the most frequent order of phases with its mean durations.
    pub(super) fn of_jumps(
        bound_per_s: Option<f64>,
        set: EncodedSet<'_>,
        features: &Features,
    ) -> Self {
        let phases = 0..set.dataset.phases.patterns.len();
        Self {
            bound_per_s: bound_per_s.unwrap_or(f64::INFINITY),
            slopes: (phases.map(|phase| slopes_at(&mean_of(phase, set), features))).collect(),
            sequence: usual_sequence(set.dataset),
        }
    }

    pub(super) fn admits(&self, xi: &[Xi]) -> bool {
        self.excess(&self.lower_halves(xi)) == [0.0; 2]
    }

    /// Changes the coefficients until they satisfy the bound, each time by the change that is least in the metric of
    /// `inverse` to first order. If such steps do not end, the terms that depend on the state are scaled down.
    pub(super) fn hold(&self, xi: &mut [Xi], inverse: impl Fn(&[Xi]) -> Vec<Xi>) {
        for _ in 0..STEPS {
            let lower = self.lower_halves(xi);
            let excess = self.excess(&lower);
            if excess == [0.0; 2] {
                return;
            }
            let change = self.least_change(&self.modes(&lower), &inverse);
            let slower = (0..SHORTENED).find_map(|halvings| {
                let share = 0.5f64.powi(halvings);
                let each = xi.iter().zip(&change);
                let moved: Vec<_> = each.map(|(xi, change)| xi - change * share).collect();
                (self.excess(&self.lower_halves(&moved)) < excess).then_some(moved)
            });
            let Some(slower) = slower else { break };
            xi.clone_from_slice(&slower);
        }
        for _ in 0..HALVINGS {
            if self.admits(xi) {
                return;
            }
            for (xi, slopes) in xi.iter_mut().zip(&self.slopes) {
                for (mut row, slopes) in xi.row_iter_mut().zip(slopes.row_iter()) {
                    if slopes.iter().any(|slope| *slope != 0.0) {
                        row *= 0.5;
                    }
                }
            }
        }
    }

    /// `d ddz / d (z, dz)` of every phase, `latent_dim x 2 latent_dim`.
    fn lower_halves(&self, xi: &[Xi]) -> Vec<DMatrix<f64>> {
        let each = xi.iter().zip(&self.slopes);
        each.map(|(xi, slopes)| xi.tr_mul(slopes)).collect()
    }

    /// By how much the fastest phase, and once all keep the bound their sequence, grows too fast, 1/s.
    fn excess(&self, lower: &[DMatrix<f64>]) -> [f64; 2] {
        if self.bound_per_s == f64::INFINITY {
            return [0.0; 2];
        }
        let above = |most: f64, rate: f64| most.max(rate - self.bound_per_s);
        let of_phases = lower.iter().flat_map(of_phase).map(|value| value.re);
        match of_phases.fold(0.0, above) {
            0.0 => {
                let values = of_sequence(&self.transitions(lower)).into_iter();
                [0.0, values.map(|value| self.rate(value)).fold(0.0, above)]
            }
            excess => [excess, f64::INFINITY],
        }
    }

    fn rate(&self, value: Complex<f64>) -> f64 {
        let duration_s: f64 = self.sequence.iter().map(|(_, duration_s)| duration_s).sum();
        value.norm().max(f64::MIN_POSITIVE).ln() / duration_s.max(f64::MIN_POSITIVE)
    }

    /// `e^(A T)` of each phase of the sequence.
    fn transitions(&self, lower: &[DMatrix<f64>]) -> Vec<DMatrix<f64>> {
        let each = self.sequence.iter();
        each.map(|&(phase, duration_s)| transition(&lower[phase], duration_s))
            .collect()
    }

    /// Those of the phases, and of the sequence once every phase keeps the bound.
    fn modes(&self, lower: &[DMatrix<f64>]) -> Vec<Mode> {
        let mut all = Vec::new();
        for phase in 0..lower.len() {
            let values = |changed: &[DMatrix<f64>], _| of_phase(&changed[phase]);
            all.extend(self.fast(lower, phase..phase + 1, values, |value| value.re));
        }
        if self.excess(lower)[0] == 0.0 {
            let transitions = self.transitions(lower);
            let values = |changed: &[DMatrix<f64>], phase| {
                let mut transitions = transitions.clone();
                for (transition, &step) in transitions.iter_mut().zip(&self.sequence) {
                    if step.0 == phase {
                        *transition = self::transition(&changed[step.0], step.1);
                    }
                }
                of_sequence(&transitions)
            };
            all.extend(self.fast(lower, 0..lower.len(), values, |value| self.rate(value)));
        }
        let is_finite = |slopes: &DMatrix<f64>| slopes.iter().all(|slope| slope.is_finite());
        all.retain(|mode| mode.slopes.iter().all(is_finite));
        all
    }

    /// The eigenvalues that are too fast, one of each conjugate pair, and the derivatives of their rates by the lower
    /// halves of `phases`. These are differences to the nearest of the `values` after one phase has changed.
    fn fast(
        &self,
        lower: &[DMatrix<f64>],
        phases: Range<usize>,
        values: impl Fn(&[DMatrix<f64>], usize) -> Vec<Complex<f64>>,
        rate: impl Fn(Complex<f64>) -> f64,
    ) -> Vec<Mode> {
        let aim = AIM * self.bound_per_s;
        let each = (values(lower, phases.start).into_iter()).filter(|value| value.im >= 0.0);
        let modes = each.map(|value| Mode {
            value,
            excess: rate(value) - aim,
            slopes: lower.iter().map(|lower| lower.map(|_| 0.0)).collect(),
        });
        let is_fast = |mode: &Mode| mode.excess.is_finite() && mode.excess > 0.0;
        let mut modes: Vec<Mode> = modes.filter(is_fast).collect();
        if modes.is_empty() {
            return modes;
        }
        for phase in phases {
            let step = DIFFERENCE * lower[phase].amax().max(1.0);
            let mut changed = lower.to_vec();
            // Where no term is active there is none to change.
            let active = (0..lower[phase].len()).filter(|&place| lower[phase][place] != 0.0);
            for place in active {
                changed[phase][place] += step;
                let values = values(&changed, phase);
                changed[phase][place] = lower[phase][place];
                for mode in &mut modes {
                    let apart = |value: &Complex<f64>| (value - mode.value).norm();
                    let nearest = values.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
                    let moved = nearest.map_or(f64::NAN, |value| rate(*value));
                    mode.slopes[phase][place] = (moved - rate(mode.value)) / step;
                }
            }
        }
        modes
    }

    /// The least change, in the metric of `inverse`, that removes the excess of the modes to first order.
    fn least_change(
        &self,
        modes: &[Mode],
        inverse: impl Fn(&[Xi]) -> Vec<Xi>,
    ) -> Vec<DMatrix<f64>> {
        let of_xi = |mode: &Mode| -> Vec<Xi> {
            let each = self.slopes.iter().zip(&mode.slopes);
            let products = each.map(|(theta, slopes)| theta * slopes.transpose());
            products.collect()
        };
        let gradients: Vec<_> = modes.iter().map(of_xi).collect();
        let changes: Vec<_> = gradients.iter().map(|gradient| inverse(gradient)).collect();
        let n = modes.len();
        let mut system = DMatrix::from_fn(n, n, |i, j| {
            let each = gradients[i].iter().zip(&changes[j]);
            each.map(|(gradient, change)| gradient.dot(change))
                .sum::<f64>()
        });
        // Rates that change alike are as good as one.
        let least = 1e-9 * system.diagonal().amax().max(f64::MIN_POSITIVE);
        (0..n).for_each(|i| system[(i, i)] += least);
        let excess = DVector::from_iterator(n, modes.iter().map(|mode| mode.excess));
        let weights = system.cholesky().map(|system| system.solve(&excess));
        let mut total: Vec<_> = (self.slopes.iter())
            .map(|slopes| DMatrix::zeros(slopes.nrows(), slopes.ncols() / 2))
            .collect();
        for (changes, weight) in changes.iter().zip(weights.iter().flatten()) {
            for (total, change) in total.iter_mut().zip(changes) {
                *total += change * *weight;
            }
        }
        total
    }
}

/// The eigenvalues of a phase; an infinite one if they cannot be computed.
fn of_phase(lower: &DMatrix<f64>) -> Vec<Complex<f64>> {
    eigenvalues(state_matrix(lower)).unwrap_or_else(|| vec![f64::INFINITY.into()])
}

fn of_sequence(transitions: &[DMatrix<f64>]) -> Vec<Complex<f64>> {
    let product = (transitions.iter().cloned()).reduce(|before, next| next * before);
    let values = product.map_or_else(|| Some(Vec::new()), eigenvalues);
    values.unwrap_or_else(|| vec![f64::INFINITY.into()])
}

/// Mean of `z`, `dz`, `u_lat` over the samples of a phase, 0 if there are none.
fn mean_of(phase: usize, set: EncodedSet<'_>) -> Vec<f64> {
    let (variables, _) = set.regression_samples(phase);
    let samples = variables.nrows().max(1) as f64;
    let sums = (variables.column_iter()).map(|column| column.iter().fold(0.0, |sum, v| sum + v));
    sums.map(|sum| sum / samples).collect()
}

/// `d theta / d (z, dz)` (`library_dim x 2 latent_dim`) by central differences; 0 where a term has no finite one.
fn slopes_at(mean: &[f64], features: &Features) -> DMatrix<f64> {
    let d = features.latent_dim;
    let largest = mean.iter().fold(1.0, |most: f64, v| most.max(v.abs()));
    let step = DIFFERENCE * largest;
    let variables = DMatrix::from_fn(4 * d, 3 * d, |row, i| match (row / 2 == i, row % 2) {
        (true, 0) => mean[i] + step,
        (true, _) => mean[i] - step,
        (false, _) => mean[i],
    });
    let theta = features.evaluate(&variables, &mut FeatureValues::default());
    DMatrix::from_fn(theta.ncols(), 2 * d, |term, i| {
        let slope = (theta[(2 * i, term)] - theta[(2 * i + 1, term)]) / (2.0 * step);
        if slope.is_finite() { slope } else { 0.0 }
    })
}

/// The stride of a walk; else the most frequent order of the phases of a whole motion, with their mean durations.
fn usual_sequence(dataset: &Dataset) -> Vec<(usize, f64)> {
    let motions = dataset.jumps.iter().map(|motion| {
        let duration_s = |span: &Range<usize>| {
            let end = span.end.min(motion.samples() - 1);
            motion.time_s[end] - motion.time_s[span.start]
        };
        let spans = motion.spans.iter();
        spans
            .map(|(phase, span)| (*phase, duration_s(span)))
            .collect()
    });
    if let Some(stride) = usual_stride(&motions.collect::<Vec<_>>()) {
        return stride;
    }
    let mut orders: BTreeMap<Vec<usize>, (usize, Vec<f64>)> = BTreeMap::new();
    for jump in &dataset.jumps {
        let order = jump.spans.iter().map(|(phase, _)| *phase).collect();
        let (jumps, total_s) = (orders.entry(order)).or_insert((0, vec![0.0; jump.spans.len()]));
        *jumps += 1;
        for (total_s, (_, span)) in total_s.iter_mut().zip(&jump.spans) {
            *total_s += jump.time_s[span.end - 1] - jump.time_s[span.start];
        }
    }
    let all = orders.into_iter().rev();
    let usual = all.max_by_key(|(_, (jumps, _))| *jumps);
    let (order, (jumps, total_s)) = usual.unwrap_or_default();
    let mean_s = total_s.iter().map(|total_s| total_s / jumps as f64);
    order.into_iter().zip(mean_s).collect()
}

#[cfg(test)]
#[path = "../../../tests/units/learn_train_growth.rs"]
mod tests;
