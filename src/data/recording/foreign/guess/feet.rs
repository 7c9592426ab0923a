//! Contact from forces at the feet: what a sensor shows in the air, and from where on it bears.

use nalgebra::DMatrix;

/// Share of the way from no force to the largest at which a foot counts as down; half of it for up.
const SHARE: f64 = 0.1;
/// Times the deviation of a sensor in the air that a foot on the ground shows at least.
const DEVIATIONS: f64 = 4.0;
/// Bins over the range of a sensor.
const BINS: usize = 64;
/// Share of the samples within a bin of where two groups are divided, at most.
const VALLEY: f64 = 0.02;
/// Least distance of two groups, as a share of the range.
const APART: f64 = 0.1;
/// Largest spread of a sensor in the air, as a share of what loads it.
const SPREAD: f64 = 0.35;
/// Least difference of two sensors in the air that matters, as a share of the range.
const ALIKE: f64 = 0.05;

#[derive(Debug, Clone, Copy, PartialEq)]
struct Rest {
    level: f64,
    deviation: f64,
}

/// The lines of a map for these values of four sensors, one per row, and a note where no foot is ever in the air.
pub(super) fn force_lines(values: &DMatrix<f64>) -> (Vec<String>, Option<String>) {
    let mut lines = Vec::new();
    if values.iter().all(|value| *value == 0.0 || *value == 1.0) {
        return (lines, None);
    }
    let mut values = values.clone();
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
    let rests: Vec<Option<Rest>> = (values.row_iter())
        .map(|row| resting(row.iter().copied().collect(), range))
        .collect();
    let known: Vec<Rest> = rests.iter().flatten().copied().collect();
    if known.is_empty() {
        let least = sorted(values.iter().copied())[0];
        let threshold = if least > 0.0 {
            0.5 * least
        } else {
            SHARE * high
        };
        lines.push(format!(
            "threshold = {threshold:.3}   # no foot is in the air by its force"
        ));
        let note = "feet: by their forces all feet are on the ground throughout";
        return (lines, Some(note.to_owned()));
    }
    let level = known.iter().map(|rest| rest.level).sum::<f64>() / known.len() as f64;
    let deviation = known.iter().map(|rest| rest.deviation).fold(0.0, f64::max);
    let levels = || {
        rests
            .iter()
            .map(|rest| rest.map_or(level, |rest| rest.level))
    };
    let (mut rest, mut span) = (level, high - level);
    if levels().any(|own| (own - level).abs() > ALIKE * range) {
        (rest, span) = (0.0, range);
        let offsets: Vec<String> = levels().map(|level| format!("{:.3}", -level)).collect();
        lines.push(format!(
            "offset = [{}]   # what each sensor shows in the air",
            offsets.join(", ")
        ));
    }
    let least = DEVIATIONS * deviation;
    lines.push(format!(
        "threshold = {:.3}   # a tenth of the way from no force ({:.1}) to the largest",
        rest + least.max(SHARE * span),
        level
    ));
    lines.push(format!(
        "release = {:.3}",
        rest + (0.5 * least).max(0.5 * SHARE * span)
    ));
    (lines, None)
}

/// What a sensor shows in the air: the lowest group of its values, if they fall into groups.
fn resting(values: Vec<f64>, range: f64) -> Option<Rest> {
    let mut group = sorted(values.into_iter());
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

/// How many of the values are in the lower of two groups with few values between them (Otsu's division of square roots,
/// as impacts are far above what a standing foot bears).
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
    let moment = |bins: &[usize], first: usize| -> (f64, f64) {
        let each = bins.iter().enumerate();
        each.fold((0.0, 0.0), |(count, sum), (bin, own)| {
            (
                count + *own as f64,
                sum + *own as f64 * (first + bin) as f64,
            )
        })
    };
    let between = |cut: usize| {
        let ((one, sum_one), (two, sum_two)) =
            (moment(&counts[..cut], 0), moment(&counts[cut..], cut));
        one * two * (sum_one / one.max(1.0) - sum_two / two.max(1.0)).powi(2)
    };
    let cuts = 1..BINS;
    let best = cuts.clone().map(between).fold(0.0, f64::max);
    // Where nothing lies between the groups, every division of it is as good: its middle.
    let good: Vec<usize> = cuts
        .filter(|cut| between(*cut) >= best * (1.0 - 1e-9))
        .collect();
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
    sorted
        .get((share * last).round() as usize)
        .copied()
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contact of a jump: half a second on the ground, a third of a second in the air, landing.
    fn is_down(sample: usize) -> bool {
        !(250..420).contains(&sample)
    }

    /// Forces of the four feet: `rest` in the air, `rest + load` and more on the ground, with a ripple.
    fn forces(rest: [f64; 4], load: f64, ripple: f64) -> DMatrix<f64> {
        DMatrix::from_fn(4, 700, |foot, sample| {
            let noise = ripple * ((sample * 37 + foot * 11) % 19) as f64 / 19.0;
            let impact = if (420..430).contains(&sample) {
                3.0 * load
            } else {
                0.0
            };
            let loaded = load * (1.0 + 0.3 * (0.05 * sample as f64).sin()) + impact;
            rest[foot] + noise + if is_down(sample) { loaded } else { 0.0 }
        })
    }

    fn number(lines: &[String], key: &str) -> Option<f64> {
        let line = lines.iter().find_map(|line| line.strip_prefix(key))?;
        line.trim_start_matches(" = ")
            .split(' ')
            .next()?
            .parse()
            .ok()
    }

    #[test]
    fn thresholds_lie_between_sensors_in_the_air_and_on_the_ground() {
        for rest in [0.0, 1.5, 20.0, 100.0, 400.0, -30.0] {
            for load in [30.0, 80.0, 900.0] {
                let values = forces([rest; 4], load, 3.0);
                let (lines, note) = force_lines(&values);
                let threshold = number(&lines, "threshold").expect("a threshold");
                let release = number(&lines, "release").expect("a release");
                assert!(note.is_none() && release <= threshold);
                for (at, value) in values.iter().enumerate() {
                    let down = *value >= release;
                    assert_eq!(down, is_down(at / 4), "{rest} {load}: {value} {lines:?}");
                    assert_eq!(*value >= threshold, down);
                }
            }
        }
    }

    #[test]
    fn sensors_with_zeros_of_their_own_get_offsets_and_turned_ones_a_sign() {
        let (lines, _) = force_lines(&forces([0.0, 60.0, 100.0, 5.0], 80.0, 2.0));
        assert!(lines[0].starts_with("offset = [-"), "{lines:?}");
        let (lines, _) = force_lines(&-forces([0.0; 4], 80.0, 2.0));
        assert!(lines[0].starts_with("sign = -1"), "{lines:?}");
    }

    #[test]
    fn feet_that_never_leave_the_ground_are_down_throughout() {
        let values = forces([0.0; 4], 80.0, 3.0).columns(0, 250).into_owned();
        let (lines, note) = force_lines(&values);
        let threshold = number(&lines, "threshold").expect("a threshold");
        assert!(
            note.is_some() && values.iter().all(|value| *value > threshold),
            "{lines:?}"
        );
    }
}
