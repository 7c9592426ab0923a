//! Regression targets over windows: the effect of an acceleration over the time of a prediction.

use super::*;

const STRIDE: usize = 5; // samples between the starts of two windows
pub(super) const FLIGHT_WINDOW: usize = 50; // samples
const MOTION_WINDOW_S: f64 = 0.2; // about a step of a trot; errors of forces average out over it
const WHOLE_FLIGHTS: f64 = 10.0; // weight of the errors of whole flights against those of windows
const LARGEST: f64 = 1e150; // magnitude of a term: sums of its squares stay finite

/// Complains about the first term of `library` without a finite value at a sample, or with one whose square overflows.
pub(super) fn check_terms(
    set: EncodedSet<'_>,
    features: &Features,
    library: &Library,
) -> Result<()> {
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
            term: library.terms()[term].text.clone(),
            phase: pattern.name.clone(),
            sample,
            time_s: jump.time_s[sample],
            found,
            limit: LARGEST,
        });
    }
    Ok(())
}

/// Rows of `theta` and `target` of one phase, averaged over windows of `window` samples. Integrating `ddz = theta Xi`
/// once and twice over a window of length `T` gives `(dz(T) - dz(0)) / T = mean of theta Xi` and `2 (z(T) - z(0) - T
/// dz(0)) / T^2 = weighted mean of theta Xi` (the integral form of Schaeffer and McCalla 2017, here of second order). A
/// `window` of 0 gives the smoothed accelerations themselves.
pub(super) fn windowed_samples(
    set: EncodedSet<'_>,
    features: &Features,
    phase: usize,
    window: usize,
) -> (DMatrix<f64>, DMatrix<f64>) {
    if window == 0 {
        let (variables, target) = set.regression_samples(phase);
        let theta = features.evaluate(&variables, &mut FeatureValues::default());
        return (theta, target);
    }
    windows_of(set, features, set.dataset.spans(Some(phase)), window)
}

/// The same over whole motions, with windows of [`MOTION_WINDOW_S`] across phases.
pub(super) fn samples_of_all_phases(
    set: EncodedSet<'_>,
    features: &Features,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let motions = set.dataset.jumps.iter().enumerate();
    let motions = motions.map(|(index, motion)| (index, 0..motion.samples()));
    let window = (MOTION_WINDOW_S / set.dataset.median_step_s()).round();
    windows_of(set, features, motions, window.max(1.0) as usize)
}

fn windows_of(
    set: EncodedSet<'_>,
    features: &Features,
    spans: impl Iterator<Item = (usize, Range<usize>)>,
    window: usize,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let (p, d) = (features.library_dim(), features.latent_dim);
    let (mut theta_rows, mut target_rows) = (Vec::new(), Vec::new());
    for (jump, range) in spans.filter(|(_, range)| range.len() > 4) {
        let time_s = &set.dataset.jumps[jump].time_s[range.clone()];
        let latent = &set.latent[jump];
        let theta = latent.variables(range.clone());
        let (once, twice) = integrals(time_s, &features.evaluate(&theta, &mut Default::default()));
        let [z, dz] = [&latent.z, &latent.dz].map(|rows| rows.columns_range(range.clone()));
        let window = window.min(range.len() - 1);
        for from in (0..range.len() - window).step_by(STRIDE) {
            let to = from + window;
            let duration = time_s[to] - time_s[from];
            let scale = 2.0 / (duration * duration);
            theta_rows.extend((0..p).map(|j| (once[(to, j)] - once[(from, j)]) / duration));
            target_rows.extend((0..d).map(|k| (dz[(k, to)] - dz[(k, from)]) / duration));
            theta_rows.extend(
                (0..p).map(|j| {
                    (twice[(to, j)] - twice[(from, j)] - duration * once[(from, j)]) * scale
                }),
            );
            target_rows.extend(
                (0..d).map(|k| (z[(k, to)] - z[(k, from)] - duration * dz[(k, from)]) * scale),
            );
        }
    }
    let n = theta_rows.len() / p.max(1);
    (
        DMatrix::from_row_slice(n, p, &theta_rows),
        DMatrix::from_row_slice(n, d, &target_rows),
    )
}

/// Rows of a phase over windows of [`FLIGHT_WINDOW`] samples and over whole spans. The root mean square of the latter
/// counts [`WHOLE_FLIGHTS`] times as much, however many they are.
pub(super) fn flight_samples(
    set: EncodedSet<'_>,
    features: &Features,
    phase: usize,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let parts = windowed_samples(set, features, phase, FLIGHT_WINDOW);
    let whole = windowed_samples(set, features, phase, usize::MAX);
    let share = parts.0.nrows() as f64 / whole.0.nrows().max(1) as f64;
    let weight = WHOLE_FLIGHTS * share.sqrt();
    let stacked = |part: DMatrix<f64>, whole: DMatrix<f64>| {
        let (above, below) = (part.nrows(), whole.nrows());
        let mut rows = part.resize_vertically(above + below, 0.0);
        rows.rows_mut(above, below).copy_from(&(whole * weight));
        rows
    };
    (stacked(parts.0, whole.0), stacked(parts.1, whole.1))
}

/// Theta integrated once and twice from the first sample on, `n x library_dim`.
fn integrals(time_s: &[f64], theta: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut once = DMatrix::zeros(theta.nrows(), theta.ncols());
    let mut twice = once.clone();
    for i in 1..theta.nrows() {
        let h = time_s[i] - time_s[i - 1];
        for j in 0..theta.ncols() {
            let (before, after) = (theta[(i - 1, j)], theta[(i, j)]);
            once[(i, j)] = once[(i - 1, j)] + h * (before + after) / 2.0;
            twice[(i, j)] =
                twice[(i - 1, j)] + h * once[(i - 1, j)] + h * h * (2.0 * before + after) / 6.0;
        }
    }
    (once, twice)
}
