//! Numbers as several commands take them.

use std::str::FromStr;

/// A positive, finite number of seconds.
pub(super) fn positive_seconds(text: &str) -> Result<f64, String> {
    number(
        text,
        |value: &f64| value.is_finite() && *value > 0.0,
        "a positive number of seconds",
    )
}

/// A whole number of at least 1.
pub(super) fn at_least_one(text: &str) -> Result<usize, String> {
    number(text, |value| *value > 0, "a whole number of at least 1")
}

/// A number that is in range, or what was expected.
pub(super) fn number<T: FromStr>(
    text: &str,
    is_in_range: impl Fn(&T) -> bool,
    expected: &str,
) -> Result<T, String> {
    let parsed = text.parse().ok().filter(is_in_range);
    parsed.ok_or_else(|| format!("expected {expected}"))
}

/// A finite number.
pub(super) fn finite(text: &str) -> Result<f64, String> {
    number(text, |value: &f64| value.is_finite(), "a finite number")
}
