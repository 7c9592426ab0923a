//! Differences of equations: their bounds over a box, their size at recorded samples.

use nalgebra::DMatrix;
use serde::Serialize;

use super::ranges::Ranges;
use crate::symbolic::Interval;

/// How large an error is at recorded samples (scaled units per second squared).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measured {
    pub max: f64,
    pub rms: f64,
}

impl Measured {
    /// Of these errors; `None` without any.
    pub(crate) fn of(errors: impl IntoIterator<Item = f64>) -> Option<Self> {
        let (mut count, mut square, mut max) = (0usize, 0.0, 0.0f64);
        for error in errors {
            count += 1;
            square += error * error;
            max = max.max(error.abs());
        }
        (count > 0).then(|| Self {
            max,
            rms: (square / count as f64).sqrt(),
        })
    }
}

/// Rows of terms with their coefficients before and after a change.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Differences(pub Vec<(usize, f64, f64)>);

impl Differences {
    /// The rows in which two equations differ.
    pub(crate) fn between(before: &[f64], after: &[f64]) -> Self {
        let rows = before.iter().zip(after).enumerate();
        let rows = rows.map(|(row, (&before, &after))| (row, before, after));
        Self(rows.filter(|(_, before, after)| before != after).collect())
    }

    /// Contains the equation before minus the equation after at every point of the box.
    pub(crate) fn bound(&self, ranges: &mut Ranges) -> Interval {
        let parts = self
            .0
            .iter()
            .map(|&(row, before, after)| (row, Interval::point(before) - Interval::point(after)));
        ranges.combination(&parts.collect::<Vec<_>>())
    }

    /// The same at samples; `theta` has one row per sample and one column per term.
    pub(crate) fn measured(&self, theta: &DMatrix<f64>) -> Option<Measured> {
        let at = |sample: usize| -> f64 {
            let parts = self.0.iter();
            parts
                .map(|&(row, before, after)| (before - after) * theta[(sample, row)])
                .sum()
        };
        Measured::of((0..theta.nrows()).map(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measured_is_the_largest_and_the_root_mean_square() {
        let measured = Measured::of([3.0, -4.0, 0.0, 0.0]).expect("four errors");
        assert_eq!((measured.max, measured.rms), (4.0, 2.5));
        assert_eq!(Measured::of([]), None);
    }
}
