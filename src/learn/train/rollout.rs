//! Rollouts of candidate models, many at once, by the classical Runge-Kutta method. Loops go over indices: iterators of
//! several slices at once are calls in code for other vector units than the rest.

use std::cmp::Reverse;

use super::features::vectorised;
use super::*;
use crate::sim::restart_windows;

const DIVERGED: f64 = 1e6; // magnitude of a state from which a rollout counts as diverged
/// Input of the step (start, middle, end) that each stage has, and its share of the step.
const STAGES: [(usize, f64); 4] = [(0, 0.0), (1, 0.5), (1, 0.5), (2, 1.0)];

pub(super) type Xi = DMatrix<f64>; // of one phase, library_dim x latent_dim
pub(super) type CoefficientIndex = (usize, usize, usize); // phase, term, latent coordinate

/// Latent dynamics under trial: `ddz = Xi_phase^T theta(z, dz, u_lat)`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate<'a> {
    pub features: &'a Features,
    pub xi: &'a [Xi],
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Change {
    pub place: CoefficientIndex,
    pub by: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Window {
    pub jump: usize,
    pub start: usize, // first sample: the rollout starts at its true latent state
    pub steps: usize, // the window covers samples start ..= start + steps
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub window: Window,
    pub change: Option<Change>,
}

pub(super) fn plain(windows: &[Window]) -> Vec<Row> {
    let change = None;
    let rows = windows.iter().map(|&window| Row { window, change });
    rows.collect()
}

/// The windows between restarts of every jump, each up to the sample that the next one starts from.
pub(super) fn windows(dataset: &Dataset, restart: Restart) -> Vec<Window> {
    let mut windows = Vec::new();
    for (jump, samples) in dataset.jumps.iter().enumerate() {
        for window in restart_windows(&samples.time_s, restart) {
            let (start, last) = (window.start, window.end.min(samples.time_s.len() - 1));
            if last > start {
                let steps = last - start;
                windows.push(Window { jump, start, steps });
            }
        }
    }
    windows
}

/// Latent positions predicted in every row, `latent_dim x steps` (samples `start + 1 ..= start + steps`), independent
/// of the other rows. The latent input is interpolated linearly; a step has the phase of its first sample. Values
/// beyond 1e6 are infinite from there on.
pub(super) fn predict(
    candidate: Candidate<'_>,
    set: EncodedSet<'_>,
    rows: &[Row],
) -> Vec<DMatrix<f64>> {
    let d = candidate.features.latent_dim;
    let empty = rows.iter().map(|row| DMatrix::zeros(d, row.window.steps));
    let mut predictions: Vec<_> = empty.collect();
    // The longest first, so that those which still go on are the first rows.
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by_key(|&row| Reverse(rows[row].window.steps));
    let longest = order.first().map_or(0, |&row| rows[row].window.steps);
    let mut stepper = Stepper::new(candidate, set, order.iter().map(|&row| rows[row]).collect());
    for step in 0..longest {
        let going = order.partition_point(|&row| rows[row].window.steps > step);
        stepper.keep(going);
        stepper.advance(step);
        for (from, &to) in order[..going].iter().enumerate() {
            for i in 0..d {
                predictions[to][(i, step)] = stepper.state[(from, i)];
            }
        }
    }
    predictions
}

/// As [`predict`], every window once with each of the changes.
pub(super) fn predict_changed(
    candidate: Candidate<'_>,
    changes: &[Change],
    set: EncodedSet<'_>,
    windows: &[Window],
) -> Vec<Vec<DMatrix<f64>>> {
    let counts = |window: Window, change: &Change| {
        let phases = &set.dataset.jumps[window.jump].phase[window.start..][..window.steps];
        phases.contains(&change.place.0)
    };
    let mut rows = Vec::new();
    for &window in windows {
        let counted = changes.iter().filter(|change| counts(window, change));
        let each = std::iter::once(None).chain(counted.copied().map(Some));
        rows.extend(each.map(|change| Row { window, change }));
    }
    let mut predictions = predict(candidate, set, &rows).into_iter();
    let mut next = || predictions.next().expect("invariant: one per row");
    let of_windows = windows.iter().map(|&window| {
        let unchanged = next();
        let each = changes.iter().map(|change| match counts(window, change) {
            true => next(),
            false => unchanged.clone(),
        });
        each.collect()
    });
    of_windows.collect()
}

struct Stepper<'a> {
    candidate: Candidate<'a>,
    set: EncodedSet<'a>,
    active: Vec<ActiveTerms>, // of every phase
    rows: Vec<Row>,
    state: DMatrix<f64>, // z, dz
    values: FeatureValues,
    phase: Vec<usize>,
    step_s: Vec<f64>,
    input: [DMatrix<f64>; 3], // at the start, middle and end of the step
    variables: DMatrix<f64>,  // z, dz, u_lat
    rates: [DMatrix<f64>; 4], // dz, ddz at the four stages
}

type ActiveTerms = Vec<Vec<(usize, f64)>>;

impl<'a> Stepper<'a> {
    fn new(candidate: Candidate<'a>, set: EncodedSet<'a>, rows: Vec<Row>) -> Self {
        let d = candidate.features.latent_dim;
        let active = |xi: &DMatrix<f64>| {
            let columns = xi.column_iter().map(|column| {
                let terms = column.iter().copied().enumerate();
                terms.filter(|(_, value)| *value != 0.0).collect()
            });
            columns.collect()
        };
        let state = DMatrix::from_fn(rows.len(), 2 * d, |row, i| {
            let Window { jump, start, .. } = rows[row].window;
            let latent = &set.latent[jump];
            [&latent.z, &latent.dz][i / d][(i % d, start)]
        });
        let mut stepper = Self {
            candidate,
            set,
            active: candidate.xi.iter().map(active).collect(),
            rows,
            state,
            values: FeatureValues::default(),
            phase: Vec::new(),
            step_s: Vec::new(),
            input: Default::default(),
            variables: DMatrix::default(),
            rates: Default::default(),
        };
        stepper.make_room();
        stepper
    }

    fn keep(&mut self, n: usize) {
        if n < self.rows.len() {
            self.rows.truncate(n);
            self.state.resize_vertically_mut(n, 0.0);
            self.make_room();
        }
    }

    fn make_room(&mut self) {
        let (n, d) = (self.rows.len(), self.candidate.features.latent_dim);
        self.phase = vec![0; n];
        self.step_s = vec![0.0; n];
        self.input = std::array::from_fn(|_| DMatrix::zeros(n, d));
        self.variables = DMatrix::zeros(n, 3 * d);
        self.rates = std::array::from_fn(|_| DMatrix::zeros(n, 2 * d));
    }

    fn advance(&mut self, step: usize) {
        self.load_inputs(step);
        for stage in 0..STAGES.len() {
            self.rate(stage);
        }
        let rates = self.rates.each_ref().map(DMatrix::as_slice);
        finish_step(self.state.as_mut_slice(), &self.step_s, rates);
    }

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

    fn rate(&mut self, stage: usize) {
        let (features, n) = (self.candidate.features, self.rows.len());
        let d = features.latent_dim;
        let (input, share) = STAGES[stage];
        let (before, rates) = self.rates.split_at_mut(stage);
        let (moved, inputs) = self.variables.as_mut_slice().split_at_mut(2 * d * n);
        let state = self.state.as_slice();
        match before.last() {
            None => moved.copy_from_slice(state),
            Some(rates) => move_along(moved, state, rates.as_slice(), &self.step_s, share),
        }
        inputs.copy_from_slice(self.input[input].as_slice());
        features.forward(&self.variables, &mut self.values);
        let (dz, ddz) = rates[0].as_mut_slice().split_at_mut(d * n);
        dz.copy_from_slice(&self.variables.as_slice()[d * n..2 * d * n]);
        accelerate(ddz, features, &self.values, &self.active, &self.phase);
        for (row, own) in self.rows.iter().enumerate() {
            if let Some(Change { place, by }) = own.change
                && place.0 == self.phase[row]
            {
                ddz[place.2 * n + row] += by * features.term(&self.values, place.1)[row];
            }
        }
    }
}

vectorised! {
    fn move_along(moved: &mut [f64], state: &[f64], rates: &[f64], step_s: &[f64], share: f64) {
        for (column, moved) in moved.chunks_exact_mut(step_s.len()).enumerate() {
            let n = moved.len();
            let (state, rates) = (&state[column * n..][..n], &rates[column * n..][..n]);
            let step_s = &step_s[..n];
            for row in 0..n {
                moved[row] = state[row] + share * step_s[row] * rates[row];
            }
        }
    }
}

vectorised! {
    fn accelerate(
        ddz: &mut [f64],
        features: &Features,
        values: &FeatureValues,
        active: &[ActiveTerms],
        phase: &[usize],
    ) {
        let n = phase.len();
        let mut first = 0;
        for run in phase.chunk_by(|a, b| a == b) {
            let rows = first..first + run.len();
            first = rows.end;
            for (output, active) in active[run[0]].iter().enumerate() {
                let ddz = &mut ddz[output * n..][rows.clone()];
                ddz.fill(0.0);
                for &(term, coefficient) in active {
                    let theta = &features.term(values, term)[rows.clone()];
                    for row in 0..ddz.len().min(theta.len()) {
                        ddz[row] += coefficient * theta[row];
                    }
                }
            }
        }
    }
}

vectorised! {
    /// The states at the end of a step; infinite where they diverge.
    fn finish_step(state: &mut [f64], step_s: &[f64], rates: [&[f64]; 4]) {
        for (column, state) in state.chunks_exact_mut(step_s.len()).enumerate() {
            let n = state.len();
            let [k1, k2, k3, k4] = rates.map(|rates| &rates[column * n..][..n]);
            let step_s = &step_s[..n];
            for row in 0..n {
                let mean = (k1[row] + 2.0 * k2[row] + 2.0 * k3[row] + k4[row]) / 6.0;
                let next = state[row] + step_s[row] * mean;
                let is_bounded = next.abs() < DIVERGED;
                state[row] = if is_bounded { next } else { f64::INFINITY };
            }
        }
    }
}
