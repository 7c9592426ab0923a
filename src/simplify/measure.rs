//! Errors at recorded samples.

use nalgebra::DMatrix;

/// How large an error is at recorded samples (scaled units per second squared).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Largest magnitude.
    pub max: f64,
    /// Root mean square.
    pub rms: f64,
}

impl Measured {
    /// Of these errors; `None` without any.
    pub fn of(errors: impl IntoIterator<Item = f64>) -> Option<Self> {
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

/// `sum delta_j theta_j` at every sample; `theta` has one row per sample and one column per term.
pub(super) fn at_samples<'a>(
    theta: &'a DMatrix<f64>,
    parts: &'a [(usize, f64)],
) -> impl Iterator<Item = f64> + 'a {
    (0..theta.nrows()).map(move |k| {
        parts
            .iter()
            .map(|&(row, delta)| delta * theta[(k, row)])
            .sum()
    })
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
