//! Moving averages, and Savitzky-Golay smoothing: a polynomial through each window by least squares.
//!
//! Inside, each sample takes the value of the polynomial fitted to the window centred on it; at the ends, the first and
//! last window's polynomial is evaluated off centre, so no sample is lost and polynomials up to the order pass
//! unchanged everywhere. Samples count as equally spaced.

use std::str::FromStr;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::error::{RecordingError, RecordingFault};

/// A smoothing filter; as text its window and order, such as `11,2`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct SavitzkyGolay {
    window: usize,
    order: usize,
    /// Row `r`: weights of the window's samples for the value at its place `r`.
    values: DMatrix<f64>,
}

impl SavitzkyGolay {
    /// A filter over an odd `window` of samples with polynomials of degree `order`.
    ///
    /// # Errors
    /// [`RecordingFault::Text`] for an even window or one not above the order.
    pub fn new(window: usize, order: usize) -> Result<Self, RecordingError> {
        const LARGEST: (usize, usize) = (1001, 12);
        if window.is_multiple_of(2) || window <= order || window > LARGEST.0 || order > LARGEST.1 {
            let text = format!(
                "smoothing window {window} with order {order}: expected an odd window above the order, \
                 at most {}, and an order of at most {}",
                LARGEST.0, LARGEST.1
            );
            return Err(RecordingFault::Text(text).of_argument());
        }
        let half = (window / 2) as f64;
        // Places scaled to -1..1 keep the powers well conditioned.
        let place = |r: usize| (r as f64 - half) / half.max(1.0);
        let powers = DMatrix::from_fn(window, order + 1, |r, k| place(r).powi(k as i32));
        let q = powers.qr().q();
        Ok(SavitzkyGolay {
            window,
            order,
            values: &q * q.transpose(),
        })
    }

    /// Samples of the window.
    pub(crate) fn window(&self) -> usize {
        self.window
    }

    /// Each row of `rows` smoothed along its samples (columns).
    ///
    /// `None` if there are fewer samples than the window has.
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
            out.column_mut(sample)
                .gemv(1.0, &window, &weights.transpose(), 0.0);
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

/// Mean over a centred window of `window` samples (columns), shortened symmetrically at both ends.
///
/// Landing and lift-off spikes in accelerations weigh a regression more than the whole rest of a jump; averaged over 11
/// samples (20 ms) they carry the momentum change they stand for. A window of 0 or 1 returns the samples.
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
