//! The seeds of a training: one without a model is left out as long as another one has a model.

use nalgebra::DMatrix;

use super::assemble::{Origin, provenance};
use super::dynamics_fit::Fitted;
use super::error::TrainError;
use super::jumps::learn_jumps;
use super::overlap::support_overlap;
use super::progress::Monitor;
use super::report::{SeedReport, Trained};
use super::task::Task;
use crate::model::{Library, ModelError};

/// What a seed came to and its numbers, or why it has none.
pub(super) type Outcome = Result<(SeedReport, Fitted), TrainError>;

#[derive(Default)]
pub(super) struct Seeds {
    finished: Vec<(SeedReport, Fitted)>,
    failure: Option<TrainError>,
}

impl Seeds {
    /// Keeps the outcome of a seed; returns an error that other seeds would have as well.
    pub(super) fn add(
        &mut self,
        seed: u64,
        outcome: Outcome,
        monitor: &mut Monitor<'_>,
    ) -> Result<(), TrainError> {
        match outcome.and_then(with_finite_coefficients) {
            Ok(finished) => self.finished.push(finished),
            Err(error) if is_of_one_seed(&error) => {
                monitor.stage("leaving out a seed without a model", 1);
                monitor.done(1, format!("seed {seed}: {error}"));
                self.failure.get_or_insert(error);
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// The model of the best seed of `task`.
    pub(super) fn into_model(
        self,
        task: Task<'_>,
        method: &str,
        origin: &Origin,
    ) -> Result<Trained, TrainError> {
        let (best, reports, overlap) = self.best(&task.library, &task.moments.state)?;
        let maps = &best.maps;
        let set = maps.training_set(&task);
        let mut report = task.report(&best, &reports[0].judged);
        // A single seed without losses has nothing that the report does not say.
        if reports.len() > 1 || reports[0].losses.is_some() {
            (report.seeds, report.support_overlap) = (reports, overlap);
        }
        let (jumps, deviations) = learn_jumps(set, &maps.encoder);
        report.deviations = deviations;
        let provenance = provenance(task.options, method, origin, &report);
        let model = task.assemble(best, jumps, provenance)?;
        Ok(Trained { model, report })
    }

    /// The seed of least score, the reports of all that have a model, best first, and the overlap of their supports;
    /// `state_covariance` (18 x 18) is that of the training states in scaled units.
    fn best(
        mut self,
        library: &Library,
        state_covariance: &DMatrix<f64>,
    ) -> Result<(Fitted, Vec<SeedReport>, Option<f64>), TrainError> {
        let fits: Vec<&Fitted> = self.finished.iter().map(|(_, fitted)| fitted).collect();
        let overlap = support_overlap(library, &fits, state_covariance);
        self.finished
            .sort_by(|(a, _), (b, _)| a.score.total_cmp(&b.score));
        let (reports, fits): (Vec<SeedReport>, Vec<Fitted>) = self.finished.into_iter().unzip();
        match fits.into_iter().next() {
            Some(fitted) => Ok((fitted, reports, overlap)),
            None => Err(self.failure.unwrap_or(TrainError::Cancelled)),
        }
    }
}

/// Refuses coefficients that a descent has left infinite; a score that is not a number is the worst.
fn with_finite_coefficients((mut report, fitted): (SeedReport, Fitted)) -> Outcome {
    for xi in &fitted.xi {
        if let Some(index) = xi.iter().position(|value| !value.is_finite()) {
            let (row, column) = xi.vector_to_matrix_index(index);
            return Err(TrainError::Model(ModelError::NonFinite {
                tensor: "xi".to_owned(),
                row,
                column,
                found: xi[index],
            }));
        }
    }
    if report.score.is_nan() {
        report.score = f64::INFINITY;
    }
    Ok((report, fitted))
}

fn is_of_one_seed(error: &TrainError) -> bool {
    match error {
        TrainError::NoStableModel { .. } | TrainError::TermValue { .. } | TrainError::Model(_) => {
            true
        }
        TrainError::NoRecording
        | TrainError::Split { .. }
        | TrainError::TooFewSamples { .. }
        | TrainError::PhaseSamples { .. }
        | TrainError::LatentDim { .. }
        | TrainError::Option { .. }
        | TrainError::Range(_)
        | TrainError::Cancelled
        | TrainError::Recording(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::train::metrics::SetMetrics;
    use crate::train::oscillator::{fitted, standard_library};
    use crate::train::progress::Progress;

    fn outcome(score: f64, coefficient: f64) -> Outcome {
        let report = SeedReport {
            seed: 1,
            score,
            losses: None,
            active: 1,
            dominant: Vec::new(),
            judged: SetMetrics::default(),
        };
        let xi = DMatrix::from_element(7, 2, coefficient);
        Ok((report, fitted(DMatrix::identity(2, 2), xi)))
    }

    fn reports(outcomes: Vec<Outcome>) -> Result<Vec<SeedReport>, TrainError> {
        let (cancel, mut listener) = (AtomicBool::new(false), |_: Progress| ());
        let mut monitor = Monitor::new(&mut listener, &cancel);
        let mut seeds = Seeds::default();
        for (seed, outcome) in outcomes.into_iter().enumerate() {
            seeds.add(seed as u64, outcome, &mut monitor)?;
        }
        let best = seeds.best(&standard_library(2, 1, false), &DMatrix::identity(2, 2))?;
        Ok(best.1)
    }

    fn unstable(candidates: usize) -> Outcome {
        Err(TrainError::NoStableModel { candidates })
    }

    #[test]
    fn seeds_some_without_a_model_give_the_best_of_the_others() {
        let outcomes = vec![
            outcome(3.0, 1.0),
            unstable(9),
            outcome(-1.0, f64::NAN),
            outcome(-f64::NAN, 1.0),
            outcome(2.0, 1.0),
        ];
        let found = reports(outcomes).expect("three seeds have a model");
        let scores: Vec<f64> = found.iter().map(|report| report.score).collect();
        assert_eq!(scores, [2.0, 3.0, f64::INFINITY]);
        let found = reports(vec![unstable(9), outcome(1.0, f64::INFINITY)]);
        let first = matches!(found, Err(TrainError::NoStableModel { candidates: 9 }));
        assert!(first, "{found:?}");
    }
}
