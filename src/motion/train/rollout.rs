//! Light rollouts of candidate models, many at once, for choosing between them.

use std::cmp::Reverse;

use nalgebra::DMatrix;

use super::dataset::Dataset;
use super::features::Features;
use super::latent::EncodedSet;
use super::stepper::{Row, Stepper};
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

/// The windows between restarts of every jump ([`restart_windows`]), each up to the sample that the next one starts
/// from.
pub fn windows(dataset: &Dataset, restart: Restart) -> Vec<Window> {
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

/// Latent positions predicted in every window, `latent_dim x steps` (samples `start + 1 ..= start + steps`).
///
/// RK4 with the recorded sampling; the latent input is interpolated linearly between samples, the phase is the
/// recorded one of the sample a step starts from. Values beyond 1e6 are set to infinity and stay there.
pub fn predict(
    candidate: Candidate<'_>,
    set: EncodedSet<'_>,
    windows: &[Window],
) -> Vec<DMatrix<f64>> {
    let d = candidate.features.latent_dim();
    let empty = windows.iter().map(|window| DMatrix::zeros(d, window.steps));
    let mut predictions: Vec<_> = empty.collect();
    // The longest first, so that those which still go on are the first rows.
    let mut order: Vec<usize> = (0..windows.len()).collect();
    order.sort_by_key(|&window| Reverse(windows[window].steps));
    let rows = order.iter().map(|&window| Row {
        window: windows[window],
        change: None,
    });
    let mut stepper = Stepper::new(candidate, set, rows.collect());
    let longest = order.first().map_or(0, |&window| windows[window].steps);
    for step in 0..longest {
        let going = order.partition_point(|&window| windows[window].steps > step);
        stepper.keep(going);
        stepper.advance(step);
        for (row, &window) in order[..going].iter().enumerate() {
            stepper.write(row, &mut predictions[window], step);
        }
    }
    predictions
}

/// As [`predict`] for one window, once with each of the changes.
///
/// They are computed together, each change from the first sample whose phase has it: until then the candidate is what
/// it is without.
pub fn predict_changed(
    candidate: Candidate<'_>,
    changes: &[Change],
    set: EncodedSet<'_>,
    window: Window,
) -> Vec<DMatrix<f64>> {
    let phase = &set.dataset.jumps[window.jump].phase[window.start..][..window.steps];
    let first_step = |change: &Change| phase.iter().position(|&phase| phase == change.place.0);
    let mut joining: Vec<(usize, usize)> = (changes.iter().enumerate())
        .filter_map(|(number, change)| Some((first_step(change)?, number)))
        .collect();
    joining.sort_unstable();
    let row_of = |number: Option<usize>| Row {
        window,
        change: number.map(|number| changes[number]),
    };
    let mut stepper = Stepper::new(candidate, set, vec![row_of(None)]);
    let d = candidate.features.latent_dim();
    let mut predictions = vec![DMatrix::zeros(d, window.steps); changes.len()];
    let mut rows = vec![0; changes.len()]; // of the candidate without a change until it joins
    let mut joined = 0;
    for step in 0..window.steps {
        let joins = joining.partition_point(|(first, _)| *first <= step);
        let new = &joining[joined..joins];
        stepper.join(new.iter().map(|(_, number)| row_of(Some(*number))));
        for (_, number) in new {
            joined += 1;
            rows[*number] = joined;
        }
        stepper.advance(step);
        for (prediction, row) in predictions.iter_mut().zip(&rows) {
            stepper.write(*row, prediction, step);
        }
    }
    predictions
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::oscillator;

    fn of<'a>(features: &'a Features, xi: &'a [DMatrix<f64>]) -> Candidate<'a> {
        Candidate { features, xi }
    }

    #[test]
    fn predictions_of_the_true_dynamics_follow_the_samples_through_both_phases() {
        let (dataset, latent) = oscillator::jumps(2);
        let (features, xi) = oscillator::known();
        let set = EncodedSet::new(&dataset, &latent);
        for restart in [Restart::Never, Restart::Every(0.1)] {
            let windows = windows(&dataset, restart);
            let predictions = predict(of(&features, &xi), set, &windows);
            for (window, prediction) in windows.iter().zip(predictions) {
                let z = &latent[window.jump].z;
                let truth = z.columns(window.start + 1, window.steps);
                assert!((prediction - truth).amax() < 2e-4, "{window:?}");
            }
        }
    }

    #[test]
    fn restarted_windows_cover_every_sample_once() {
        let (dataset, _) = oscillator::jumps(1);
        let windows = windows(&dataset, Restart::Every(0.1));
        let places = windows.iter().map(|window| (window.start, window.steps));
        assert!(places.eq([(0, 50), (50, 50), (100, 50), (150, 49)]));
    }

    #[test]
    fn windows_of_several_lengths_are_predicted_as_each_by_itself() {
        let (dataset, latent) = oscillator::jumps(2);
        let (features, xi) = oscillator::known();
        let candidate = of(&features, &xi);
        let window = |(jump, start, steps)| Window { jump, start, steps };
        let windows = [(0, 110, 20), (1, 0, 199), (0, 0, 1), (1, 130, 60)].map(window);
        let set = EncodedSet::new(&dataset, &latent);
        let together = predict(candidate, set, &windows);
        for (window, prediction) in windows.iter().zip(&together) {
            let alone = predict(candidate, set, &[*window]);
            assert_eq!(prediction, &alone[0], "{window:?}");
        }
        assert!(predict(candidate, set, &[]).is_empty());
    }

    #[test]
    fn changes_predict_what_the_changed_coefficients_predict() {
        let (dataset, latent) = oscillator::jumps(1);
        let (features, xi) = oscillator::known();
        let set = EncodedSet::new(&dataset, &latent);
        let predicted =
            |xi: &[DMatrix<f64>], window| predict(of(&features, xi), set, &[window]).remove(0);
        let changes = [((1, 0, 1), 0.3), ((0, 1, 0), -2.0), ((0, 2, 1), 0.5)];
        let changes = changes.map(|(place, by)| Change { place, by });
        for (start, phases) in [(0, [true, true]), (20, [true, false]), (150, [false, true])] {
            let window = Window {
                jump: 0,
                start,
                steps: if phases[1] { 199 - start } else { 50 },
            };
            let candidate = of(&features, &xi);
            let found = predict_changed(candidate, &changes, set, window);
            let unchanged = predicted(&xi, window);
            for (Change { place, by }, found) in changes.iter().zip(&found) {
                let mut changed = xi.clone();
                changed[place.0][(place.1, place.2)] += by;
                let expected = predicted(&changed, window);
                assert!((found - &expected).amax() < 1e-12, "{place:?} {window:?}");
                assert_eq!(*found != unchanged, phases[place.0], "{place:?} {window:?}");
            }
        }
    }

    #[test]
    fn diverging_dynamics_predict_infinity() {
        let (dataset, latent) = oscillator::jumps(1);
        let (features, mut xi) = oscillator::known();
        xi[0][(1, 0)] = 1e7;
        let set = EncodedSet::new(&dataset, &latent);
        let predictions = predict(of(&features, &xi), set, &windows(&dataset, Restart::Never));
        assert!(!predictions[0].iter().all(|value| value.is_finite()));
    }
}
