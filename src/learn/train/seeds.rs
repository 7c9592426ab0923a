//! The seeds of a training: the best is kept, those without a model are left out; how far they agree on the terms.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::error::TrainError;
use super::jumps::learn_jumps;
use super::metrics::{SeedReport, Trained};
use super::progress::Monitor;
use super::rollout::Xi;
use super::task::{Fitted, Origin, Task, provenance};
use crate::model::{LatentVariable, Library, ModelError};

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
                monitor.stage("leaving out a seed without a model");
                monitor.done(format!("seed {seed}: {error}"));
                self.failure.get_or_insert(error);
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// The model of the seed of least score, with the reports of all that have one, best first.
    pub(super) fn into_model(
        mut self,
        task: Task<'_>,
        method: &str,
        origin: &Origin,
    ) -> Result<Trained, TrainError> {
        let runs = self.finished.iter();
        let runs: Vec<_> = runs
            .map(|(_, fit)| (&fit.maps.weights, &fit.xi[..]))
            .collect();
        let overlap = support_overlap(&task.library, &runs, &task.moments.state);
        (self.finished).sort_by(|(a, _), (b, _)| a.score.total_cmp(&b.score));
        let (reports, fits): (Vec<SeedReport>, Vec<Fitted>) = self.finished.into_iter().unzip();
        let Some(best) = fits.into_iter().next() else {
            return Err(self.failure.unwrap_or(TrainError::Cancelled));
        };
        let mut report = task.report(&best, &reports[0].judged);
        // A single seed without losses has nothing that the report does not say.
        if reports.len() > 1 || reports[0].losses.is_some() {
            (report.seeds, report.support_overlap) = (reports, overlap);
        }
        let (jumps, deviations) = learn_jumps(best.maps.training_set(&task), &best.maps.encoder);
        report.deviations = deviations;
        let provenance = provenance(task.options, method, origin, &report);
        let model = task.assemble(best, jumps, provenance)?;
        Ok(Trained { model, report })
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

type Run<'a> = (&'a DMatrix<f64>, &'a [Xi]); // encoder weights, Xi of every phase

/// Mean over pairs of runs of (coefficients active in both) / (active in either), after matching latent coordinates.
fn support_overlap(
    library: &Library,
    runs: &[Run<'_>],
    state_covariance: &DMatrix<f64>,
) -> Option<f64> {
    let mut overlaps = Vec::new();
    for (i, first) in runs.iter().enumerate() {
        for second in &runs[i + 1..] {
            let partner = match_latents(first.0, second.0, state_covariance);
            overlaps.push(overlap(library, first.1, second.1, &partner));
        }
    }
    (!overlaps.is_empty()).then(|| overlaps.iter().sum::<f64>() / overlaps.len() as f64)
}

/// For every latent of `first` the one of `second` that it correlates with most, each once, the strongest first.
fn match_latents(
    first: &DMatrix<f64>,
    second: &DMatrix<f64>,
    covariance: &DMatrix<f64>,
) -> Vec<usize> {
    let d = first.nrows();
    let energy = |w: &DMatrix<f64>, i: usize| (w.row(i) * covariance).dot(&w.row(i)).sqrt();
    let shared = first * covariance * second.transpose();
    let mut pairs: Vec<(f64, usize, usize)> = (0..d * d)
        .map(|k| (k / d, k % d))
        .map(|(i, j)| {
            let scale = energy(first, i) * energy(second, j);
            let strength = shared[(i, j)].abs() / scale;
            (if scale > 0.0 { strength } else { 0.0 }, i, j)
        })
        .collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let (mut partner, mut taken) = (vec![None; d], vec![false; d]);
    for (_, i, j) in pairs {
        if partner[i].is_none() && !taken[j] {
            (partner[i], taken[j]) = (Some(j), true);
        }
    }
    let partner: Option<Vec<usize>> = partner.into_iter().collect();
    partner.expect("as many coordinates on both sides")
}

fn overlap(library: &Library, first: &[Xi], second: &[Xi], partner: &[usize]) -> f64 {
    let renamed = renamed_terms(library, partner);
    let (mut both, mut either) = (0_usize, 0_usize);
    for (a, b) in first.iter().zip(second) {
        let mut found = 0;
        for (column, &other) in partner.iter().enumerate() {
            for (row, other_row) in renamed.iter().enumerate() {
                let active = a[(row, column)] != 0.0;
                let other_active = other_row.is_some_and(|r| b[(r, other)] != 0.0);
                both += usize::from(active && other_active);
                found += usize::from(active);
            }
        }
        either += found + b.iter().filter(|xi| **xi != 0.0).count();
    }
    let either = either - both;
    match either {
        0 => 1.0,
        _ => both as f64 / either as f64,
    }
}

/// For every term the one that it becomes when latent coordinate `i` is called `partner[i]`, if the library has it.
fn renamed_terms(library: &Library, partner: &[usize]) -> Vec<Option<usize>> {
    let mut pool = library.pool().clone();
    let terms = library.terms().iter();
    let indexed = terms.clone().enumerate();
    let known: BTreeMap<_, _> = indexed.map(|(index, term)| (term.expr(), index)).collect();
    let replacements: Vec<_> = LatentVariable::all(library.latent_dim())
        .filter_map(|variable| {
            let renamed = match variable {
                LatentVariable::Z(i) => LatentVariable::Z(partner[i]),
                LatentVariable::Dz(i) => LatentVariable::Dz(partner[i]),
                LatentVariable::U(i) => LatentVariable::U(partner[i]),
            };
            let renamed = pool.symbol(&renamed.to_string());
            Some((library.symbol(variable)?, renamed))
        })
        .collect();
    let renamed = terms.map(|term| pool.substitute(term.expr(), &replacements));
    renamed.map(|term| known.get(&term).copied()).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use nalgebra::DVector;

    use super::*;
    use crate::model::{AffineMap, LibraryChoice, StandardLibrary};
    use crate::train::metrics::SetMetrics;
    use crate::train::progress::Progress;
    use crate::train::task::Maps;

    fn outcome(score: f64, coefficient: f64) -> Outcome {
        let report = SeedReport {
            seed: 1,
            score,
            losses: None,
            active: 1,
            dominant: Vec::new(),
            judged: SetMetrics::default(),
        };
        let weights = DMatrix::identity(2, 2);
        let map = AffineMap::new("map", weights.clone(), DVector::zeros(2)).expect("finite");
        let maps = Maps {
            decoder: map.clone().into(),
            encoder: map.into(),
            weights,
            training: Vec::new(),
            validation: Vec::new(),
        };
        let fitted = Fitted {
            maps,
            xi: vec![DMatrix::from_element(7, 2, coefficient)],
            choice: None,
            score: 0.0,
        };
        Ok((report, fitted))
    }

    #[test]
    fn seeds_without_a_model_are_left_out_and_the_first_reason_is_kept() {
        let (cancel, mut listener) = (AtomicBool::new(false), |_: Progress| ());
        let mut monitor = Monitor::new(&mut listener, &cancel);
        let mut seeds = Seeds::default();
        let outcomes = [
            outcome(3.0, 1.0),
            Err(TrainError::NoStableModel { candidates: 9 }),
            outcome(-1.0, f64::NAN),
            outcome(-f64::NAN, 1.0),
            outcome(2.0, 1.0),
        ];
        for (seed, outcome) in outcomes.into_iter().enumerate() {
            (seeds.add(seed as u64, outcome, &mut monitor)).expect("a fault of one seed");
        }
        let scores: Vec<f64> = (seeds.finished.iter())
            .map(|(report, _)| report.score)
            .collect();
        assert_eq!(scores, [3.0, f64::INFINITY, 2.0]);
        let failure = seeds.failure.as_ref();
        assert!(matches!(
            failure,
            Some(TrainError::NoStableModel { candidates: 9 })
        ));
        let fault = seeds.add(5, Err(TrainError::Cancelled), &mut monitor);
        assert!(matches!(fault, Err(TrainError::Cancelled)));
    }

    #[test]
    fn exchanged_coordinates_overlap_fully_and_other_terms_do_not() {
        let standard = StandardLibrary {
            degree: 2,
            trigonometric: false,
            inputs: true,
        };
        let library = Library::of(2, LibraryChoice::Standard(standard)).expect("small library");
        let with = |active: [(&str, usize); 3]| {
            let row = |text| library.terms().iter().position(|term| term.text() == text);
            let mut xi = DMatrix::zeros(library.len(), 2);
            for (text, column) in active {
                xi[(row(text).expect(text), column)] = 1.0;
            }
            [xi]
        };
        let straight = DMatrix::from_row_slice(2, 3, &[1.0, 0.1, 0.0, 0.0, 1.0, 0.0]);
        let exchanged = DMatrix::from_row_slice(2, 3, &[0.0, -1.0, 0.0, 1.0, 0.2, 0.0]);
        let first = with([("z1", 0), ("u2", 1), ("dz1^2", 1)]);
        let same = with([("z2", 1), ("u1", 0), ("dz2^2", 0)]);
        let half = with([("z1", 0), ("u2", 0), ("dz1^2", 1)]);
        let overlap = |runs: &[Run<'_>]| support_overlap(&library, runs, &DMatrix::identity(3, 3));
        let first: Run<'_> = (&straight, &first);
        assert_eq!(overlap(&[first, (&exchanged, &same)]), Some(1.0));
        assert_eq!(overlap(&[first, (&straight, &half)]), Some(0.5));
        assert_eq!(overlap(&[first]), None);
    }
}
