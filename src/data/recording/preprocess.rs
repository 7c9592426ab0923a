//! From segments to phases ready for training: accelerations by differences, smoothing, resampling of each phase to
//! whole batches (section IV-C4). Nothing crosses the border of a segment. Scaling belongs to the model.
//!
//! Savitzky-Golay smoothing fits a polynomial to each window of equally spaced samples by least squares. Its value at
//! the centre replaces a sample; at the ends of the data its value off the centre. No sample is lost, and polynomials
//! up to the order are unchanged.

use std::str::FromStr;

use super::*;

/// Samples of a batch: every phase of a jump is resampled to a multiple (section IV-C4).
pub const BATCH_ROWS: usize = 100;

/// The phases of every segment of a recording, each with its samples resampled to a multiple of 100.
///
/// # Errors
/// [`RecordingError`] for a span of one sample, or a segment without any of the phases.
pub fn prepare(recording: &Recording, rule: &PhaseRule) -> Outcome<Vec<(PhaseSpan, Segment)>> {
    let mut out = Vec::new();
    for segment in &recording.segments {
        for span in rule.spans(segment)? {
            let part = segment.slice(span.range.clone());
            let rows = part.len().div_ceil(BATCH_ROWS).max(1) * BATCH_ROWS;
            out.push((span, resampled(&part, rows)?));
        }
    }
    Ok(out)
}

/// Slopes of each row over time: second-order differences inside, also for unequal steps, first-order at the two ends
/// (equation 21). `rows` has one column a time; a single sample has slope 0.
pub fn differences(time_s: &[f64], rows: &DMatrix<f64>) -> DMatrix<f64> {
    let n = time_s.len().min(rows.ncols());
    let mut out = DMatrix::zeros(rows.nrows(), rows.ncols());
    if n < 2 {
        return out;
    }
    for row in 0..rows.nrows() {
        let slope =
            |a: usize, b: usize| (rows[(row, b)] - rows[(row, a)]) / (time_s[b] - time_s[a]);
        out[(row, 0)] = slope(0, 1);
        out[(row, n - 1)] = slope(n - 2, n - 1);
        for j in 1..n - 1 {
            // The parabola through three samples, at the middle one.
            let (before, after) = (time_s[j] - time_s[j - 1], time_s[j + 1] - time_s[j]);
            let share = before / (before + after);
            let (left, right) = (slope(j - 1, j), slope(j, j + 1));
            out[(row, j)] = left + share * (right - left);
        }
    }
    out
}

/// Slopes of straight lines through the samples within `half_s` of each time, or of the nearest such window inside.
/// They are robust against samples that are held or noisy. Rows as of [`differences`].
pub(super) fn slopes(time_s: &[f64], rows: &Rows, half_s: f64) -> Rows {
    let n = time_s.len().min(rows.ncols());
    let mut out = DMatrix::zeros(rows.nrows(), rows.ncols());
    if n < 2 {
        return out;
    }
    let margin_s = half_s + 1e-9;
    let (first_s, last_s) = (time_s[0] + half_s, time_s[n - 1] - half_s);
    let before = |limit_s: f64| time_s[..n].partition_point(|time| *time < limit_s);
    for i in 0..n {
        let centre_s = time_s[i].min(last_s).max(first_s);
        let left = before(centre_s - margin_s).min(n - 2);
        let right = before(centre_s + margin_s).max(left + 2);
        let window = &time_s[left..right];
        let mean_s = window.iter().sum::<f64>() / window.len() as f64;
        let squares: f64 = window.iter().map(|time| (time - mean_s).powi(2)).sum();
        for row in 0..rows.nrows() {
            let products = (left..right).map(|j| (time_s[j] - mean_s) * rows[(row, j)]);
            out[(row, i)] = products.sum::<f64>() / squares;
        }
    }
    out
}

/// [`differences`] within each of the ranges alone; 0 outside them.
pub(super) fn differences_within(ranges: &[Range<usize>], time_s: &[f64], rows: &Rows) -> Rows {
    let mut out = DMatrix::zeros(rows.nrows(), rows.ncols());
    for range in ranges {
        let own = rows.columns(range.start, range.len()).into_owned();
        let slopes = differences(&time_s[range.clone()], &own);
        (out.columns_mut(range.start, range.len())).copy_from(&slopes);
    }
    out
}

/// A segment at `rows` equally spaced times over the same duration, by straight lines between samples; contact is that
/// of the nearest sample.
///
/// # Errors
/// [`RecordingFault::Unexpected`] if it has one sample or `rows` is below 2.
pub fn resampled(segment: &Segment, rows: usize) -> Outcome<Segment> {
    let n = segment.len();
    if n < 2 || rows < 2 {
        return Err(RecordingFault::too_short(n.min(rows), 2).at(&segment.path, segment.row(0)));
    }
    let own_s = &segment.time_s;
    let (start, end) = (own_s[0], own_s[n - 1]);
    let even = |i: usize| start + (end - start) * (i as f64 / (rows - 1) as f64);
    let time_s: Vec<f64> = (0..rows).map(|i| even(i).clamp(start, end)).collect();
    let places: Vec<_> = time_s.iter().map(|&time| place(own_s, time)).collect();
    let nearest = |&(left, share): &(usize, f64)| segment.feet[left + usize::from(share >= 0.5)];
    let feet = places.iter().map(nearest).collect();
    let at_places = |m: &DMatrix<f64>| {
        DMatrix::from_fn(m.nrows(), rows, |row, i| {
            let (left, share) = places[i];
            let (a, b) = (m[(row, left)], m[(row, left + 1)]);
            a + share * (b - a)
        })
    };
    Ok(Segment {
        row_stride: segment.row_stride * (n - 1) as f64 / (rows - 1) as f64,
        ..segment.remade(time_s, feet, at_places)
    })
}

/// The sample on the left of a time, never the last, and the time's share of the way to the next.
pub(super) fn place(own_s: &[f64], time_s: f64) -> (usize, f64) {
    let after = own_s.partition_point(|own| *own <= time_s);
    let left = after.clamp(1, own_s.len() - 1) - 1;
    let step_s = own_s[left + 1] - own_s[left];
    (left, (time_s - own_s[left]) / step_s)
}

pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// A smoothing filter; as text its window and order, such as `11,2`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct SavitzkyGolay {
    pub(crate) window: usize,
    order: usize,
    values: DMatrix<f64>, // row `r`: weights of the window's samples for the value at its place `r`
}

impl SavitzkyGolay {
    /// A filter over an odd `window` of samples with polynomials of degree `order`.
    ///
    /// # Errors
    /// [`RecordingError`] for an even window or one not above the order.
    pub fn new(window: usize, order: usize) -> Outcome<Self> {
        const LARGEST: (usize, usize) = (1001, 12);
        if window.is_multiple_of(2) || window <= order || window > LARGEST.0 || order > LARGEST.1 {
            let words = format!(
                "smoothing window {window} with order {order}: expected an odd window above the order, \
                 at most {}, and an order of at most {}",
                LARGEST.0, LARGEST.1
            );
            return Err(text(words).of(Path::new("")));
        }
        let half = (window / 2) as f64;
        let place = |r: usize| (r as f64 - half) / half.max(1.0); // scaled to -1..1: keeps the powers well conditioned
        let powers = DMatrix::from_fn(window, order + 1, |r, k| place(r).powi(k as i32));
        let q = powers.qr().q();
        let values = &q * q.transpose();
        Ok(SavitzkyGolay {
            window,
            order,
            values,
        })
    }

    /// Each row of `rows` smoothed along its samples (columns); `None` if these are fewer than the window's.
    pub fn smooth(&self, rows: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let n = rows.ncols();
        if n < self.window {
            return None;
        }
        let half = self.window / 2;
        let mut out = DMatrix::zeros(rows.nrows(), n);
        for sample in 0..n {
            let first = sample.saturating_sub(half).min(n - self.window);
            let weights = self.values.row(sample - first);
            let window = rows.columns(first, self.window);
            let mut to = out.column_mut(sample);
            to.gemv(1.0, &window, &weights.transpose(), 0.0);
        }
        Some(out)
    }
}

impl FromStr for SavitzkyGolay {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refused =
            || format!("found `{text}`, expected an odd window and an order such as 11,2");
        let (window, order) = text.split_once(',').ok_or_else(refused)?;
        let number = |text: &str| text.trim().parse::<usize>().map_err(|_| refused());
        Self::new(number(window)?, number(order)?).map_err(|error| error.to_string())
    }
}

impl TryFrom<String> for SavitzkyGolay {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<SavitzkyGolay> for String {
    fn from(filter: SavitzkyGolay) -> String {
        format!("{},{}", filter.window, filter.order)
    }
}

/// Mean over a centred window of `window` samples (columns), shortened symmetrically at both ends. Spikes of landing
/// and lift-off, which would outweigh the rest of a jump, then carry the change of momentum that they stand for.
pub fn moving_average(samples: &DMatrix<f64>, window: usize) -> DMatrix<f64> {
    let n = samples.ncols();
    let half = window / 2;
    let mut smooth = DMatrix::zeros(samples.nrows(), n);
    for i in 0..n {
        let reach = half.min(i).min(n - 1 - i);
        let sum = samples.columns(i - reach, 2 * reach + 1).column_sum();
        smooth.set_column(i, &(sum / (2 * reach + 1) as f64));
    }
    smooth
}
