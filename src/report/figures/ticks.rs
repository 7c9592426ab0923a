//! Round numbers along an axis.

/// Round values within `low..=high`, about `count` of them, and the decimal places that they need.
pub(crate) fn ticks(low: f64, high: f64, count: usize) -> (Vec<f64>, usize) {
    let rough = (high - low) / count.max(1) as f64;
    if !rough.is_finite() || rough <= 0.0 {
        return (vec![low], 2);
    }
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|factor| factor * power)
        .into_iter()
        .find(|step| *step >= rough * 0.999)
        .unwrap_or(10.0 * power);
    let places = (-step.log10().floor()).max(0.0) as usize;
    let first = (low / step - 1e-9).ceil() as i64;
    let last = (high / step + 1e-9).floor() as i64;
    let values = (first..=last).map(|index| index as f64 * step).collect();
    (values, places)
}

/// A value along an axis or in a title, with so many decimal places and a minus of the width of a plus.
pub(crate) fn number(value: f64, places: usize) -> String {
    format!("{value:.places$}").replace('-', "\u{2212}")
}

pub(crate) fn subscript(index: usize) -> String {
    let below = |digit: char| match digit.to_digit(10) {
        Some(value) => char::from_u32(0x2080 + value).unwrap_or(digit),
        None => digit,
    };
    index.to_string().chars().map(below).collect()
}

/// The least and the largest of some values; infinities in reverse where there is none.
pub(crate) fn range(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    let values = values.into_iter();
    values.fold(none, |(low, high), value| (low.min(value), high.max(value)))
}

/// The range of values with a margin; a range around a constant.
pub(crate) fn padded(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = range(values.filter(|value| value.is_finite()));
    if low > high {
        return (0.0, 1.0);
    }
    let margin = 0.06 * (high - low);
    if margin > 0.0 {
        (low - margin, high + margin)
    } else {
        let around = 0.05 * low.abs() + 1e-6;
        (low - around, high + around)
    }
}
