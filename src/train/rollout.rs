//! Light rollouts of candidate models, many at once, for choosing between them.

use nalgebra::DMatrix;

use super::dataset::Dataset;
use super::features::{FeatureValues, Features};
use super::latent::Latent;
use crate::sim::{Restart, restart_windows};

/// Latent dynamics under trial: `ddz = Xi_phase^T theta(z, dz, u_lat)`.
#[derive(Clone, Copy, Debug)]
pub struct Candidate<'a> {
    /// The library.
    pub features: &'a Features,
    /// Coefficients a phase, `library_dim x latent_dim`.
    pub xi: &'a [DMatrix<f64>],
}

/// One coefficient that is not as in the candidate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change {
    /// Phase, term and latent coordinate of the coefficient.
    pub place: (usize, usize, usize),
    /// What is added to it.
    pub by: f64,
}

/// Where a rollout starts and how many steps it takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Index of the jump.
    pub jump: usize,
    /// First sample; the rollout starts at its true latent state.
    pub start: usize,
    /// Steps to take; the window covers samples `start ..= start + steps`.
    pub steps: usize,
}

/// The windows between restarts every `duration_s` of every jump ([`restart_windows`]), each up to the sample that the
/// next one starts from.
pub fn restarted(dataset: &Dataset, duration_s: f64) -> Vec<Window> {
    let mut windows = Vec::new();
    for (jump, samples) in dataset.jumps.iter().enumerate() {
        for window in restart_windows(&samples.time_s, Restart::Every(duration_s)) {
            let (start, last) = (window.start, window.end.min(samples.len() - 1));
            if last > start {
                let steps = last - start;
                windows.push(Window { jump, start, steps });
            }
        }
    }
    windows
}

/// One window a jump, from its first to its last sample.
pub fn whole(dataset: &Dataset) -> Vec<Window> {
    dataset
        .jumps
        .iter()
        .enumerate()
        .map(|(jump, samples)| Window {
            jump,
            start: 0,
            steps: samples.len() - 1,
        })
        .collect()
}

/// Latent positions predicted in every window, `latent_dim x steps` (samples `start + 1 ..= start + steps`).
///
/// RK4 with the recorded sampling; the latent input is interpolated linearly between samples, the phase is the
/// recorded one of the sample a step starts from. Values beyond 1e6 are set to infinity and stay there.
pub fn predict(
    candidate: Candidate<'_>,
    dataset: &Dataset,
    latent: &[Latent],
    windows: &[Window],
) -> Vec<DMatrix<f64>> {
    predict_changed(
        candidate,
        &vec![None; windows.len()],
        dataset,
        latent,
        windows,
    )
}

/// As [`predict`], each window with its own change of the candidate; many at once cost less than one by one.
pub fn predict_changed(
    candidate: Candidate<'_>,
    changes: &[Option<Change>],
    dataset: &Dataset,
    latent: &[Latent],
    windows: &[Window],
) -> Vec<DMatrix<f64>> {
    let d = candidate.features.latent_dim();
    let longest = windows.iter().map(|window| window.steps).max().unwrap_or(0);
    let mut predictions: Vec<_> = windows
        .iter()
        .map(|window| DMatrix::zeros(d, window.steps))
        .collect();
    let mut state = DMatrix::zeros(windows.len(), 2 * d);
    for (row, window) in windows.iter().enumerate() {
        let start = &latent[window.jump];
        for i in 0..d {
            state[(row, i)] = start.z[(i, window.start)];
            state[(row, d + i)] = start.dz[(i, window.start)];
        }
    }
    let mut stepper = Stepper::new(candidate, changes);
    for step in 0..longest {
        stepper.load_inputs(dataset, latent, windows, step);
        stepper.advance(&mut state);
        for (row, prediction) in predictions.iter_mut().enumerate() {
            if step < windows[row].steps {
                (0..d).for_each(|i| prediction[(i, step)] = state[(row, i)]);
            }
        }
    }
    predictions
}

/// RK4 over a batch of windows; rows are windows.
struct Stepper<'a> {
    candidate: Candidate<'a>,
    active: Vec<Vec<Vec<(usize, f64)>>>, // a phase and output: active terms and their coefficients
    changes: Vec<(usize, Change)>,       // window and its change
    values: FeatureValues,
    phase: Vec<usize>,
    step_s: Vec<f64>,
    input: [DMatrix<f64>; 3], // at the start, middle and end of the step
    variables: DMatrix<f64>,  // z, dz, u_lat
    rates: [DMatrix<f64>; 4], // dz, ddz at the four stages
}

impl<'a> Stepper<'a> {
    /// A stepper for as many windows as there are `changes`.
    fn new(candidate: Candidate<'a>, changes: &[Option<Change>]) -> Self {
        let d = candidate.features.latent_dim();
        let n_windows = changes.len();
        let changed = changes.iter().enumerate();
        let active_of = |xi: &DMatrix<f64>| {
            let active = |column: usize| {
                (0..xi.nrows())
                    .map(|term| (term, xi[(term, column)]))
                    .filter(|(_, coefficient)| *coefficient != 0.0)
                    .collect()
            };
            (0..d).map(active).collect()
        };
        Self {
            candidate,
            active: candidate.xi.iter().map(active_of).collect(),
            changes: changed
                .filter_map(|(row, change)| Some((row, (*change)?)))
                .collect(),
            values: FeatureValues::default(),
            phase: vec![0; n_windows],
            step_s: vec![0.0; n_windows],
            input: std::array::from_fn(|_| DMatrix::zeros(n_windows, d)),
            variables: DMatrix::zeros(n_windows, 3 * d),
            rates: std::array::from_fn(|_| DMatrix::zeros(n_windows, 2 * d)),
        }
    }

    /// Inputs, phases and step lengths of step `step`; finished windows stand still.
    fn load_inputs(
        &mut self,
        dataset: &Dataset,
        latent: &[Latent],
        windows: &[Window],
        step: usize,
    ) {
        for (row, window) in windows.iter().enumerate() {
            let sample = window.start + step;
            if step >= window.steps {
                self.step_s[row] = 0.0;
                continue;
            }
            let jump = &dataset.jumps[window.jump];
            self.phase[row] = jump.phase[sample];
            self.step_s[row] = jump.time_s[sample + 1] - jump.time_s[sample];
            let u = &latent[window.jump].u_lat;
            for i in 0..u.nrows() {
                let (first, last) = (u[(i, sample)], u[(i, sample + 1)]);
                self.input[0][(row, i)] = first;
                self.input[1][(row, i)] = 0.5 * (first + last);
                self.input[2][(row, i)] = last;
            }
        }
    }

    fn advance(&mut self, state: &mut DMatrix<f64>) {
        self.rate(state, 0, 0, 0.0);
        self.rate(state, 1, 1, 0.5);
        self.rate(state, 2, 1, 0.5);
        self.rate(state, 3, 2, 1.0);
        let [k1, k2, k3, k4] = &self.rates;
        for column in 0..state.ncols() {
            for row in 0..state.nrows() {
                let at = (row, column);
                let mean = (k1[at] + 2.0 * k2[at] + 2.0 * k3[at] + k4[at]) / 6.0;
                let next = state[at] + self.step_s[row] * mean;
                state[at] = if next.abs() < 1e6 {
                    next
                } else {
                    f64::INFINITY
                };
            }
        }
    }

    /// Rates `[dz; ddz]` of stage `stage`, taken `share` of the step along the rates of the stage before.
    fn rate(&mut self, state: &DMatrix<f64>, stage: usize, input: usize, share: f64) {
        let d = self.candidate.features.latent_dim();
        for column in 0..2 * d {
            for row in 0..state.nrows() {
                let moved = match stage {
                    0 => 0.0,
                    _ => share * self.step_s[row] * self.rates[stage - 1][(row, column)],
                };
                self.variables[(row, column)] = state[(row, column)] + moved;
            }
        }
        self.variables
            .columns_mut(2 * d, d)
            .copy_from(&self.input[input]);
        self.candidate
            .features
            .forward(&self.variables, &mut self.values);
        let rates = &mut self.rates[stage];
        rates
            .columns_mut(0, d)
            .copy_from(&self.variables.columns(d, d));
        for row in 0..state.nrows() {
            for (output, active) in self.active[self.phase[row]].iter().enumerate() {
                let products = active.iter().map(|&(term, coefficient)| {
                    coefficient * self.candidate.features.term(&self.values, term)[row]
                });
                rates[(row, d + output)] = products.sum();
            }
        }
        for &(row, Change { place, by }) in &self.changes {
            let (phase, term, output) = place;
            if self.phase[row] == phase {
                rates[(row, d + output)] +=
                    by * self.candidate.features.term(&self.values, term)[row];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::oscillator;

    #[test]
    fn predictions_of_the_true_dynamics_follow_the_samples_through_both_phases() {
        let (dataset, latent) = oscillator::jumps(2);
        let (features, xi) = oscillator::known();
        let candidate = Candidate {
            features: &features,
            xi: &xi,
        };
        for windows in [whole(&dataset), restarted(&dataset, 0.1)] {
            for (window, prediction) in windows
                .iter()
                .zip(predict(candidate, &dataset, &latent, &windows))
            {
                let truth = latent[window.jump]
                    .z
                    .columns(window.start + 1, window.steps);
                assert!((prediction - truth).amax() < 2e-4, "{window:?}");
            }
        }
    }

    #[test]
    fn restarted_windows_cover_every_sample_once() {
        let (dataset, _) = oscillator::jumps(1);
        let windows = restarted(&dataset, 0.1);
        assert_eq!(
            windows
                .iter()
                .map(|window| window.steps)
                .collect::<Vec<_>>(),
            [50, 50, 50, 49]
        );
        assert_eq!(
            windows
                .iter()
                .map(|window| window.start)
                .collect::<Vec<_>>(),
            [0, 50, 100, 150]
        );
    }

    #[test]
    fn diverging_dynamics_predict_infinity() {
        let (dataset, latent) = oscillator::jumps(1);
        let (features, mut xi) = oscillator::known();
        xi[0][(1, 0)] = 1e7;
        let prediction = &predict(
            Candidate {
                features: &features,
                xi: &xi,
            },
            &dataset,
            &latent,
            &whole(&dataset),
        )[0];
        assert!(!prediction.iter().all(|value| value.is_finite()));
    }
}
