//! The seeds of a training: the best is kept, those without a model are left out; how far they agree on the terms.

use super::jumps::{Dynamics, learn_jumps};
use super::task::{Fitted, provenance};
use super::*;

pub(super) type Outcome = Result<(SeedReport, Fitted)>;

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
    ) -> Result<()> {
        match outcome.and_then(with_finite_coefficients) {
            Ok(finished) => self.finished.push(finished),
            Err(error) if is_of_one_seed(&error) => {
                monitor.stage("leaving out a seed without a model", None);
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
    ) -> Result<Trained> {
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
        // A single seed without losses adds nothing to the report.
        if reports.len() > 1 || reports[0].losses.is_some() {
            (report.seeds, report.support_overlap) = (reports, overlap);
        }
        let candidate = Candidate {
            features: &task.features,
            xi: &best.xi,
        };
        let dynamics = Dynamics {
            candidate,
            momentum: task.frame.known_in_deviations(),
        };
        let (set, encoder) = (best.maps.training_set(&task), &best.maps.encoder);
        let (jumps, deviations) = learn_jumps(set, encoder, &dynamics);
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
        | TrainError::NothingToRefine { .. }
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
    let known: BTreeMap<_, _> = indexed.map(|(index, term)| (term.expr, index)).collect();
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
    let exprs: Vec<_> = terms.map(|term| term.expr).collect();
    let renamed = pool.substitute_all(&exprs, &replacements).into_iter();
    renamed.map(|term| known.get(&term).copied()).collect()
}

#[cfg(test)]
#[path = "../../../tests/units/learn_train_seeds.rs"]
mod tests;
