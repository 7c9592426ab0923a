//! Regression targets over windows: what an acceleration does in the time that a prediction takes.

use nalgebra::DMatrix;

use super::error::TrainError;
use super::features::{FeatureValues, Features};
use super::latent::{EncodedSet, Latent};
use crate::model::Library;

/// Samples between the starts of two windows.
const STRIDE: usize = 5;
/// Largest magnitude of a term: sums of its squares stay finite.
const LARGEST: f64 = 1e150;

/// Complains about the first term of `library` without a finite value at a sample, or with one whose square overflows.
pub(super) fn check_terms(
    set: EncodedSet<'_>,
    features: &Features,
    library: &Library,
) -> Result<(), TrainError> {
    let bad = |value: &f64| value.is_nan() || value.abs() > LARGEST;
    let mut values = FeatureValues::default();
    for (phase, pattern) in set.dataset.phases.patterns.iter().enumerate() {
        let of_spans = set.dataset.spans(Some(phase)).filter_map(|(jump, range)| {
            let variables = set.latent[jump].variables(range.clone());
            let theta = features.evaluate(&variables, &mut values);
            (0..theta.ncols()).find_map(|term| {
                let mut samples = range.clone().zip(theta.column(term));
                let (sample, value) = samples.find(|(_, value)| bad(value))?;
                Some((term, &set.dataset.jumps[jump], sample, *value))
            })
        });
        let Some((term, jump, sample, found)) = of_spans.min_by_key(|(term, ..)| *term) else {
            continue;
        };
        return Err(TrainError::TermValue {
            path: jump.path.clone(),
            term: library.terms()[term].text().to_owned(),
            phase: pattern.name.clone(),
            sample,
            time_s: jump.time_s[sample],
            found,
            limit: LARGEST,
        });
    }
    Ok(())
}

/// Rows of `theta` and `target` of one phase, averaged over windows of `window` samples.
///
/// Integrating `ddz = theta Xi` once and twice over a window of length `T` gives two equations a window, `(dz(T) -
/// dz(0)) / T = mean of theta Xi` and `2 (z(T) - z(0) - T dz(0)) / T^2 = weighted mean of theta Xi` (the integral form
/// of Schaeffer and McCalla 2017, here of second order). They need no accelerations and weigh coefficients by what they
/// do to a prediction. A `window` of 0 gives the smoothed accelerations themselves.
pub(super) fn windowed_samples(
    set: EncodedSet<'_>,
    features: &Features,
    phase: usize,
    window: usize,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let (p, d) = (features.library_dim(), features.latent_dim());
    if window == 0 {
        let (variables, target) = set.regression_samples(phase);
        let theta = features.evaluate(&variables, &mut FeatureValues::default());
        return (theta, target);
    }
    let (mut theta_rows, mut target_rows) = (Vec::new(), Vec::new());
    let spans = set.dataset.spans(Some(phase));
    for (jump, range) in spans.filter(|(_, range)| range.len() > 4) {
        let time_s = &set.dataset.jumps[jump].time_s;
        let span = Span::new(&set.latent[jump], time_s, range.clone(), features);
        let window = window.min(range.len() - 1);
        for start in (0..range.len() - window).step_by(STRIDE) {
            span.equations(start, start + window, &mut theta_rows, &mut target_rows);
        }
    }
    let n = theta_rows.len() / p.max(1);
    (
        DMatrix::from_row_slice(n, p, &theta_rows),
        DMatrix::from_row_slice(n, d, &target_rows),
    )
}

struct Span {
    time_s: Vec<f64>,
    z: DMatrix<f64>,
    dz: DMatrix<f64>,
    once: DMatrix<f64>,  // n x library_dim
    twice: DMatrix<f64>, // n x library_dim
}

impl Span {
    fn new(
        latent: &Latent,
        time_s: &[f64],
        range: std::ops::Range<usize>,
        features: &Features,
    ) -> Self {
        let (start, n) = (range.start, range.len());
        let variables = latent.variables(range.clone());
        let theta = features.evaluate(&variables, &mut FeatureValues::default());
        let mut once = DMatrix::zeros(n, theta.ncols());
        let mut twice = once.clone();
        for i in 1..n {
            let h = time_s[start + i] - time_s[start + i - 1];
            for j in 0..theta.ncols() {
                let (before, after) = (theta[(i - 1, j)], theta[(i, j)]);
                once[(i, j)] = once[(i - 1, j)] + h * (before + after) / 2.0;
                twice[(i, j)] =
                    twice[(i - 1, j)] + h * once[(i - 1, j)] + h * h * (2.0 * before + after) / 6.0;
            }
        }
        Self {
            time_s: time_s[range].to_vec(),
            z: latent.z.columns(start, n).into_owned(),
            dz: latent.dz.columns(start, n).into_owned(),
            once,
            twice,
        }
    }

    /// Appends the velocity and the position equation of the window `from ..= to`.
    fn equations(&self, from: usize, to: usize, theta: &mut Vec<f64>, target: &mut Vec<f64>) {
        let duration = self.time_s[to] - self.time_s[from];
        let scale = 2.0 / (duration * duration);
        let (once, twice, z, dz) = (&self.once, &self.twice, &self.z, &self.dz);
        for j in 0..once.ncols() {
            theta.push((once[(to, j)] - once[(from, j)]) / duration);
        }
        for k in 0..z.nrows() {
            target.push((dz[(k, to)] - dz[(k, from)]) / duration);
        }
        for j in 0..once.ncols() {
            theta.push((twice[(to, j)] - twice[(from, j)] - duration * once[(from, j)]) * scale);
        }
        for k in 0..z.nrows() {
            target.push((z[(k, to)] - z[(k, from)] - duration * dz[(k, from)]) * scale);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::train::oscillator;
    use crate::train::sparse::Knowledge;
    use crate::train::sparse::{Pruning, Regression};

    #[test]
    fn windows_and_accelerations_recover_the_same_known_coefficients() {
        let (dataset, latent) = oscillator::jumps(4);
        let (features, truth) = oscillator::known();
        for window in [0, 20, 60] {
            let set = EncodedSet::new(&dataset, &latent);
            let (theta, target) = windowed_samples(set, &features, 0, window);
            let xi = Regression::new(&theta, &target, Knowledge::nothing(7, 2))
                .fit(1e-9, Pruning::Threshold(1e-3));
            let active = xi
                .iter()
                .zip(truth[0].iter())
                .filter(|(_, truth)| **truth != 0.0);
            for (found, expected) in active {
                let close = (found - expected).abs() < 0.02 * expected.abs();
                assert!(close, "{window}: {found} for {expected}");
            }
        }
    }
}
