//! Steps of rollouts, many at once: the classical Runge-Kutta method with the vector units of the machine.
//!
//! Loops go over indices: iterators of several slices at once are calls in code for other vector units than the rest.

use nalgebra::DMatrix;

use super::features::{FeatureValues, Features};
use super::latent::EncodedSet;
use super::rollout::{Candidate, Change, Window};
use super::vectors::{self, Loop};

/// Magnitude of a state from which a rollout counts as diverged.
const DIVERGED: f64 = 1e6;
/// Input of the step (start, middle, end) that each stage has, and its share of the step.
const STAGES: [(usize, f64); 4] = [(0, 0.0), (1, 0.5), (1, 0.5), (2, 1.0)];

/// A window and the change that the candidate has in it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub window: Window,
    pub change: Option<Change>,
}

/// RK4 over a batch of windows. What is computed for a row does not depend on the others.
pub(super) struct Stepper<'a> {
    candidate: Candidate<'a>,
    set: EncodedSet<'a>,
    active: Vec<Vec<Vec<(usize, f64)>>>, // a phase and output: active terms and their coefficients
    rows: Vec<Row>,
    state: DMatrix<f64>, // z, dz
    values: FeatureValues,
    phase: Vec<usize>,
    step_s: Vec<f64>,
    input: [DMatrix<f64>; 3], // at the start, middle and end of the step
    variables: DMatrix<f64>,  // z, dz, u_lat
    rates: [DMatrix<f64>; 4], // dz, ddz at the four stages
}

impl<'a> Stepper<'a> {
    /// A stepper at the true latent states that the windows start from.
    pub fn new(candidate: Candidate<'a>, set: EncodedSet<'a>, rows: Vec<Row>) -> Self {
        let d = candidate.features.latent_dim();
        let active_of = |xi: &DMatrix<f64>| {
            let active = |column: usize| {
                (0..xi.nrows())
                    .map(|term| (term, xi[(term, column)]))
                    .filter(|(_, coefficient)| *coefficient != 0.0)
                    .collect()
            };
            (0..d).map(active).collect()
        };
        let state = DMatrix::from_fn(rows.len(), 2 * d, |row, i| {
            let Window { jump, start, .. } = rows[row].window;
            let latent = &set.latent[jump];
            [&latent.z, &latent.dz][i / d][(i % d, start)]
        });
        let mut stepper = Self {
            candidate,
            set,
            active: candidate.xi.iter().map(active_of).collect(),
            rows,
            state,
            values: FeatureValues::default(),
            phase: Vec::new(),
            step_s: Vec::new(),
            input: std::array::from_fn(|_| DMatrix::zeros(0, d)),
            variables: DMatrix::zeros(0, 3 * d),
            rates: std::array::from_fn(|_| DMatrix::zeros(0, 2 * d)),
        };
        stepper.make_room();
        stepper
    }

    /// Leaves out all rows but the first `n`.
    pub fn keep(&mut self, n: usize) {
        if n < self.rows.len() {
            self.rows.truncate(n);
            self.state.resize_vertically_mut(n, 0.0);
            self.make_room();
        }
    }

    /// Adds rows, which go on from the state of the first.
    pub fn join(&mut self, rows: impl Iterator<Item = Row>) {
        let before = self.rows.len();
        self.rows.extend(rows);
        let added = self.rows.len() - before;
        if added > 0 {
            self.state.resize_vertically_mut(before + added, 0.0);
            for mut column in self.state.column_iter_mut() {
                let first = column[0];
                column.rows_mut(before, added).fill(first);
            }
            self.make_room();
        }
    }

    /// Fits everything but the state to the number of rows.
    fn make_room(&mut self) {
        let (n, d) = (self.rows.len(), self.candidate.features.latent_dim());
        self.phase = vec![0; n];
        self.step_s = vec![0.0; n];
        self.input = std::array::from_fn(|_| DMatrix::zeros(n, d));
        self.variables = DMatrix::zeros(n, 3 * d);
        self.rates = std::array::from_fn(|_| DMatrix::zeros(n, 2 * d));
    }

    /// Writes the latent position of a row into a column of a prediction.
    pub fn write(&self, row: usize, prediction: &mut DMatrix<f64>, column: usize) {
        for i in 0..prediction.nrows() {
            prediction[(i, column)] = self.state[(row, i)];
        }
    }

    /// Takes step `step` of every window.
    pub fn advance(&mut self, step: usize) {
        self.load_inputs(step);
        for stage in 0..STAGES.len() {
            self.rate(stage);
        }
        vectors::run(End {
            state: self.state.as_mut_slice(),
            step_s: &self.step_s,
            rates: self.rates.each_ref().map(DMatrix::as_slice),
        });
    }

    /// Inputs, phases and step lengths of step `step`.
    fn load_inputs(&mut self, step: usize) {
        let (n, mut first) = (self.rows.len(), 0);
        for of_window in self.rows.chunk_by(|a, b| a.window == b.window) {
            let Window { jump, start, .. } = of_window[0].window;
            let rows = first..first + of_window.len();
            first = rows.end;
            let (sample, samples) = (start + step, &self.set.dataset.jumps[jump]);
            self.phase[rows.clone()].fill(samples.phase[sample]);
            self.step_s[rows.clone()].fill(samples.time_s[sample + 1] - samples.time_s[sample]);
            let u = &self.set.latent[jump].u_lat;
            for i in 0..u.nrows() {
                let (before, after) = (u[(i, sample)], u[(i, sample + 1)]);
                let values = [before, 0.5 * (before + after), after];
                for (input, value) in self.input.iter_mut().zip(values) {
                    input.as_mut_slice()[i * n..][rows.clone()].fill(value);
                }
            }
        }
    }

    /// Rates `[dz; ddz]` of a stage.
    fn rate(&mut self, stage: usize) {
        let (features, n) = (self.candidate.features, self.rows.len());
        let d = features.latent_dim();
        let (input, share) = STAGES[stage];
        let (before, rates) = self.rates.split_at_mut(stage);
        let (moved, inputs) = self.variables.as_mut_slice().split_at_mut(2 * d * n);
        vectors::run(Along {
            moved,
            state: self.state.as_slice(),
            rates: before.last().map(DMatrix::as_slice),
            step_s: &self.step_s,
            share,
        });
        inputs.copy_from_slice(self.input[input].as_slice());
        features.forward(&self.variables, &mut self.values);
        let (dz, ddz) = rates[0].as_mut_slice().split_at_mut(d * n);
        dz.copy_from_slice(&self.variables.as_slice()[d * n..2 * d * n]);
        vectors::run(Accelerations {
            features,
            values: &self.values,
            active: &self.active,
            phase: &self.phase,
            ddz,
        });
        for (row, own) in self.rows.iter().enumerate() {
            if let Some(Change { place, by }) = own.change
                && place.0 == self.phase[row]
            {
                ddz[place.2 * n + row] += by * features.term(&self.values, place.1)[row];
            }
        }
    }
}

/// States that are some of the step from `state` along `rates`; `state` itself without rates.
struct Along<'a> {
    moved: &'a mut [f64],
    state: &'a [f64],
    rates: Option<&'a [f64]>,
    step_s: &'a [f64],
    share: f64,
}

impl Loop for Along<'_> {
    #[inline(always)]
    fn run(self) {
        let Some(rates) = self.rates else {
            self.moved.copy_from_slice(self.state);
            return;
        };
        for (column, moved) in self.moved.chunks_exact_mut(self.step_s.len()).enumerate() {
            let n = moved.len();
            let (state, rates) = (&self.state[column * n..][..n], &rates[column * n..][..n]);
            let step_s = &self.step_s[..n];
            for row in 0..n {
                moved[row] = state[row] + self.share * step_s[row] * rates[row];
            }
        }
    }
}

/// `ddz = Xi_phase^T theta` of all rows.
struct Accelerations<'a> {
    features: &'a Features,
    values: &'a FeatureValues,
    active: &'a [Vec<Vec<(usize, f64)>>],
    phase: &'a [usize],
    ddz: &'a mut [f64],
}

impl Loop for Accelerations<'_> {
    #[inline(always)]
    fn run(self) {
        let n = self.phase.len();
        let mut first = 0;
        for run in self.phase.chunk_by(|a, b| a == b) {
            let rows = first..first + run.len();
            first = rows.end;
            for (output, active) in self.active[run[0]].iter().enumerate() {
                let ddz = &mut self.ddz[output * n..][rows.clone()];
                ddz.fill(0.0);
                for &(term, coefficient) in active {
                    let theta = &self.features.term(self.values, term)[rows.clone()];
                    for row in 0..ddz.len().min(theta.len()) {
                        ddz[row] += coefficient * theta[row];
                    }
                }
            }
        }
    }
}

/// The state at the end of a step; infinite where it diverges.
struct End<'a> {
    state: &'a mut [f64],
    step_s: &'a [f64],
    rates: [&'a [f64]; 4],
}

impl Loop for End<'_> {
    #[inline(always)]
    fn run(self) {
        for (column, state) in self.state.chunks_exact_mut(self.step_s.len()).enumerate() {
            let n = state.len();
            let [k1, k2, k3, k4] = self.rates.map(|rates| &rates[column * n..][..n]);
            let step_s = &self.step_s[..n];
            for row in 0..n {
                let mean = (k1[row] + 2.0 * k2[row] + 2.0 * k3[row] + k4[row]) / 6.0;
                let next = state[row] + step_s[row] * mean;
                state[row] = if next.abs() < DIVERGED {
                    next
                } else {
                    f64::INFINITY
                };
            }
        }
    }
}
