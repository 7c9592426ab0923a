//! Root mean square and coefficient of determination.

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Root mean square of the residuals, in the unit of the samples.
    pub rms: f64,
    /// Coefficient of determination `1 - sum (y - y_hat)^2 / sum (y - mean y)^2`; at most 1, and
    /// negative where the mean of the record would have been the better prediction. `None` when the
    /// record does not move.
    pub r2: Option<f64>,
}

/// Sums that a [`Fit`] follows from; filled sample by sample, over several recordings if wanted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FitSums {
    count: usize,
    residual_square: f64,
    mean: f64,
    deviation_square: f64,
}

impl FitSums {
    /// Adds one pair of a recorded and a predicted value (the mean is updated as by Welford, 1962).
    pub fn add(&mut self, recorded: f64, predicted: f64) {
        self.count += 1;
        self.residual_square += (recorded - predicted).powi(2);
        let from_old_mean = recorded - self.mean;
        self.mean += from_old_mean / self.count as f64;
        self.deviation_square += from_old_mean * (recorded - self.mean);
    }

    /// Adds the pairs that `other` holds; deviations are each taken from its own mean.
    ///
    /// This is how several coordinates, or several jumps, make one coefficient of determination
    /// without the differences between their means counting as explained.
    pub fn merge_keeping_means(&mut self, other: &Self) {
        self.count += other.count;
        self.residual_square += other.residual_square;
        self.deviation_square += other.deviation_square;
    }

    /// Pairs of several coordinates or phases together, see [`FitSums::merge_keeping_means`].
    pub fn jointly(parts: &[Self]) -> Self {
        let mut total = Self::default();
        parts
            .iter()
            .for_each(|part| total.merge_keeping_means(part));
        total
    }

    pub fn count(&self) -> usize {
        self.count
    }

    /// The fit of all pairs added so far; `None` before the first.
    pub fn fit(&self) -> Option<Fit> {
        (self.count > 0).then(|| Fit {
            rms: (self.residual_square / self.count as f64).sqrt(),
            r2: (self.deviation_square > 0.0)
                .then(|| 1.0 - self.residual_square / self.deviation_square),
        })
    }

    /// Coefficient of determination of all pairs added so far, see [`Fit::r2`].
    pub fn r2(&self) -> Option<f64> {
        self.fit()?.r2
    }
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Mean {
    sum: f64,
    count: usize,
}

impl Mean {
    pub(super) fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    pub(super) fn get(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }
}
