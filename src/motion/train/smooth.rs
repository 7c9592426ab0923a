//! Moving averages of sample columns.

use nalgebra::DMatrix;

/// Mean over a centred window of `window` samples (columns), shortened symmetrically at both ends.
///
/// Landing and lift-off spikes in accelerations weigh a regression more than the whole rest of a jump; averaged over
/// 11 samples (20 ms) they carry the momentum change they stand for. A window of 0 or 1 returns the samples.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_average_keeps_straight_lines_and_flattens_spikes() {
        let line = DMatrix::from_fn(1, 9, |_, i| 3.0 * i as f64 - 1.0);
        assert!((moving_average(&line, 5) - &line).amax() < 1e-12);
        let mut spike = DMatrix::zeros(1, 9);
        spike[(0, 4)] = 5.0;
        let smooth = moving_average(&spike, 5);
        assert_eq!(
            smooth.row(0).iter().copied().collect::<Vec<_>>(),
            [0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0]
        );
    }
}
