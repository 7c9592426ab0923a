//! Contact from forces at the feet: the signal of a sensor in the air, and the threshold of contact.

use super::*;

const SHARE: f64 = 0.1; // of the way from no force to the largest at which a foot counts as down; half of it for up
const DEVIATIONS: f64 = 4.0; // times the deviation of a sensor in the air that a foot on the ground shows at least
const BINS: usize = 64; // bins over the range of a sensor
const VALLEY: f64 = 0.02; // share of the samples within a bin of where two groups are divided, at most
const APART: f64 = 0.1; // least distance of two groups, as a share of the range
const SPREAD: f64 = 0.35; // largest spread of a sensor in the air, as a share of its median under load
const ALIKE: f64 = 0.05; // least difference of two sensors in the air that matters, as a share of the range

#[derive(Debug, Clone, Copy, PartialEq)]
struct Rest {
    level: f64,
    deviation: f64,
}

/// The lines of a map for these values of four sensors, one per row, and a note where no foot is ever in the air.
pub(super) fn force_lines(mut values: DMatrix<f64>) -> (Vec<String>, Option<String>) {
    let mut lines = Vec::new();
    if values.iter().all(|value| *value == 0.0 || *value == 1.0) {
        return (lines, None);
    }
    let ends = |values: &DMatrix<f64>| {
        let sorted = sorted(values.iter().copied());
        (at_share(&sorted, 0.005), at_share(&sorted, 0.99))
    };
    let (low, high) = ends(&values);
    if low < 0.0 && high < 0.3 * -low {
        lines.push("sign = -1   # forces of the feet on the ground".to_owned());
        values.neg_mut();
    }
    let (low, high) = ends(&values);
    let range = high - low;
    let rests = Vec::from_iter((values.row_iter()).map(|row| resting(row.iter().copied(), range)));
    let known: Vec<Rest> = rests.iter().flatten().copied().collect();
    if known.is_empty() {
        let least = sorted(values.iter().copied())[0];
        let half = (least > 0.0).then_some(0.5 * least);
        let threshold = half.unwrap_or(SHARE * high);
        let why = "   # no foot is in the air by its force";
        lines.push(format!("threshold = {threshold:.3}{why}"));
        let note = "feet: by their forces all feet are on the ground throughout";
        return (lines, Some(note.to_owned()));
    }
    let level = known.iter().map(|rest| rest.level).sum::<f64>() / known.len() as f64;
    let deviation = known.iter().map(|rest| rest.deviation).fold(0.0, f64::max);
    let levels = || (rests.iter()).map(|rest| rest.map_or(level, |rest| rest.level));
    let (mut rest, mut span) = (level, high - level);
    if levels().any(|own| (own - level).abs() > ALIKE * range) {
        (rest, span) = (0.0, range);
        let offsets: Vec<String> = levels().map(|level| format!("{:.3}", -level)).collect();
        let offsets = offsets.join(", ");
        let why = "the signal of each sensor in the air";
        lines.push(format!("offset = [{offsets}]   # {why}"));
    }
    let least = DEVIATIONS * deviation;
    let threshold = rest + least.max(SHARE * span);
    lines.push(format!(
        "threshold = {threshold:.3}   # a tenth of the way from no force ({level:.1}) to the largest"
    ));
    let release = rest + (0.5 * least).max(0.5 * SHARE * span);
    lines.push(format!("release = {release:.3}"));
    (lines, None)
}

/// The signal of a sensor in the air: the lowest group of its values, if they fall into groups.
fn resting(values: impl Iterator<Item = f64>, range: f64) -> Option<Rest> {
    let mut group = sorted(values);
    let mut loaded = None;
    while let Some(count) = divided(&group, range) {
        loaded = Some(at_share(&group[count..], 0.5));
        group.truncate(count);
    }
    let level = at_share(&group, 0.5);
    // A foot that swings its load is not in the air where it bears less.
    let spread = at_share(&group, 0.95) - at_share(&group, 0.05);
    if spread > SPREAD * (loaded? - level) {
        return None;
    }
    let off = sorted(group.iter().map(|value| (value - level).abs()));
    let deviation = 1.48 * at_share(&off, 0.5);
    Some(Rest { level, deviation })
}

/// How many values are in the lower of two groups with few between them (Otsu's division of square roots).
fn divided(sorted: &[f64], range: f64) -> Option<usize> {
    let (low, high) = (sorted.first()?, at_share(sorted, 0.99));
    if high - low < APART * range || range <= 0.0 {
        return None;
    }
    let scaled = |value: f64| ((value - low) / (high - low)).clamp(0.0, 1.0).sqrt();
    let mut counts = [0_usize; BINS];
    for value in sorted {
        counts[((scaled(*value) * BINS as f64) as usize).min(BINS - 1)] += 1;
    }
    let total = sorted.len() as f64;
    let moment = |bins: std::ops::Range<usize>| {
        let count: usize = counts[bins.clone()].iter().sum();
        let sum: usize = bins.map(|bin| bin * counts[bin]).sum();
        (count as f64, sum as f64 / count.max(1) as f64)
    };
    let between = |cut: usize| {
        let ((one, mean_one), (two, mean_two)) = (moment(0..cut), moment(cut..BINS));
        one * two * (mean_one - mean_two).powi(2)
    };
    let cuts = 1..BINS;
    let best = cuts.clone().map(between).fold(0.0, f64::max);
    // Where nothing lies between the groups, every division of it is as good: its middle.
    let is_good = |cut: &usize| between(*cut) >= best * (1.0 - 1e-9);
    let good: Vec<usize> = cuts.filter(is_good).collect();
    let cut = good[good.len() / 2];
    let near = counts[cut - 1] + counts[cut];
    let lower: usize = counts[..cut].iter().sum();
    let is_apart = near as f64 <= VALLEY * total + 1.0 && 0 < lower && lower < sorted.len();
    let gap = at_share(&sorted[lower..], 0.5) - at_share(&sorted[..lower], 0.5);
    (is_apart && gap > APART * range).then_some(lower)
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

fn at_share(sorted: &[f64], share: f64) -> f64 {
    let last = sorted.len().saturating_sub(1) as f64;
    (sorted.get((share * last).round() as usize).copied()).unwrap_or_default()
}
