//! Ranges of numbers, and ranges of what functions make of them.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::roundoff::TINY;

/// The numbers from `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Least number.
    pub low: f64,
    /// Largest number.
    pub high: f64,
}

impl Range {
    pub(super) const fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// From `-magnitude` to `magnitude`.
    pub fn within(magnitude: f64) -> Self {
        Self::new(-magnitude, magnitude)
    }

    /// One number.
    pub fn point(value: f64) -> Self {
        Self::new(value, value)
    }

    /// Largest absolute value.
    pub fn magnitude(self) -> f64 {
        self.low.abs().max(self.high.abs())
    }

    pub(super) fn hull(self, other: Self) -> Self {
        Self::new(self.low.min(other.low), self.high.max(other.high))
    }

    pub(super) fn has_zero(self) -> bool {
        self.low <= 0.0 && self.high >= 0.0
    }

    /// Each end moved outwards by a share of itself, so that signs stay.
    pub(super) fn widened(self, share: f64) -> Self {
        let (below, above) = (share * self.low.abs(), share * self.high.abs());
        Self::new(self.low - below, self.high + above)
    }

    /// With zero, if an end is so small that a processor may flush it.
    pub(super) fn flushed(self) -> Self {
        let end = |x: f64| if x.abs() < TINY { 0.0 } else { x };
        self.hull(Self::new(end(self.low), end(self.high)))
    }

    pub(super) fn sum(self, other: Self) -> Self {
        Self::new(self.low + other.low, self.high + other.high)
    }

    pub(super) fn product(self, other: Self) -> Self {
        let corners = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        Self::new(
            corners.into_iter().fold(f64::INFINITY, f64::min),
            corners.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    pub(super) fn absolute(self) -> Self {
        let least = match self.has_zero() {
            true => 0.0,
            false => self.low.abs().min(self.high.abs()),
        };
        Self::new(least, self.magnitude())
    }

    pub(super) fn squared(self) -> Self {
        self.absolute().mapped(|x| x * x)
    }

    /// `1 / self`, which must not hold zero.
    pub(super) fn reciprocal(self) -> Self {
        Self::new(1.0 / self.high, 1.0 / self.low)
    }

    pub(super) fn mapped(self, increasing: impl Fn(f64) -> f64) -> Self {
        Self::new(increasing(self.low), increasing(self.high))
    }

    pub(super) fn negated(self) -> Self {
        Self::new(-self.high, -self.low)
    }

    /// All cosines of the range.
    pub(super) fn cosine(self) -> Self {
        let (first, last) = (self.low / TAU, self.high / TAU);
        let mut range = Self::point(self.low.cos()).hull(Self::point(self.high.cos()));
        let slack = 1e-9;
        if (last + slack).floor() > (first - slack).floor() {
            range.high = 1.0;
        }
        if (last + 0.5 + slack).floor() > (first + 0.5 - slack).floor() {
            range.low = -1.0;
        }
        range
    }

    pub(super) fn sine(self) -> Self {
        self.sum(Self::point(-FRAC_PI_2)).cosine()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_sines_hold_their_extrema() {
        let range = Range::new;
        assert_eq!(range(-0.5, 0.5).cosine().high, 1.0);
        assert!(range(-0.5, 0.5).cosine().low > 0.87);
        assert_eq!(range(1.0, 2.0).sine().high, 1.0);
        assert_eq!(range(4.0, 5.0).sine().low, -1.0);
        assert_eq!(range(-30.0, 30.0).sine(), range(-1.0, 1.0));
    }
}
