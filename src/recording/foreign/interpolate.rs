//! Values of a topic at the times of another clock.

use nalgebra::DMatrix;

use crate::recording::preprocess::differences;

/// How values run between two samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Between {
    /// Cubic polynomials: motion.
    Smooth,
    /// Straight lines: torques, which may step.
    Straight,
    /// The nearest sample: contact.
    Nearest,
}

/// Times within this share of a step are the same time.
const SAME: f64 = 1e-6;

/// Values at `times_s`, one column a time, of rows known at `own_s`; `slopes` are their derivatives at `own_s`,
/// differences unless known. Every time is within the clock's own range.
pub(super) fn at_times(
    own_s: &[f64],
    values: &DMatrix<f64>,
    slopes: Option<&DMatrix<f64>>,
    times_s: &[f64],
    between: Between,
) -> DMatrix<f64> {
    let derived;
    let slopes = match slopes {
        Some(slopes) => slopes,
        None => {
            derived = differences(own_s, values);
            &derived
        }
    };
    let mut out = DMatrix::zeros(values.nrows(), times_s.len());
    let last = own_s.len() - 1;
    for (column, &time) in times_s.iter().enumerate() {
        let left = own_s.partition_point(|own| *own <= time).clamp(1, last) - 1;
        let step = own_s[left + 1] - own_s[left];
        let share = ((time - own_s[left]) / step).clamp(0.0, 1.0);
        let (a, b) = (values.column(left), values.column(left + 1));
        let exact = match share {
            _ if share < SAME => Some(a),
            _ if share > 1.0 - SAME => Some(b),
            _ if between == Between::Nearest => Some(if share < 0.5 { a } else { b }),
            _ => None,
        };
        if let Some(exact) = exact {
            out.set_column(column, &exact);
            continue;
        }
        let line = a + (b - a) * share;
        if between == Between::Straight {
            out.set_column(column, &line);
            continue;
        }
        let rest = 1.0 - share;
        let bend = (slopes.column(left) * step - (b - a)) * (share * rest * rest)
            + ((b - a) - slopes.column(left + 1) * step) * (share * share * rest);
        out.set_column(column, &(line + bend));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(times_s: &[f64]) -> DMatrix<f64> {
        DMatrix::from_fn(1, times_s.len(), |_, i| (20.0 * times_s[i]).sin())
    }

    #[test]
    fn at_times_motion_at_5_ms_is_found_again_to_1e_4() {
        let own: Vec<f64> = (0..80).map(|i| 0.005 * f64::from(i)).collect();
        let times: Vec<f64> = (1..190).map(|i| 0.002 * f64::from(i)).collect();
        let slopes = DMatrix::from_fn(1, 80, |_, i| 20.0 * (20.0 * own[i]).cos());
        for (slopes, bound) in [(None, 2e-4), (Some(&slopes), 1e-6)] {
            let found = at_times(&own, &sine(&own), slopes, &times, Between::Smooth);
            // The first and last interval have differences of one side only.
            let inside = 3..184;
            let error = (found - sine(&times))
                .columns(inside.start, inside.len())
                .amax();
            assert!(error < bound, "{error}");
        }
    }

    #[test]
    fn at_times_of_the_own_clock_are_the_samples_themselves() {
        let own = [0.0, 0.1, 0.25, 0.3];
        let values = DMatrix::from_row_slice(1, 4, &[1.0, -2.0, 7.0, 0.5]);
        for between in [Between::Smooth, Between::Straight, Between::Nearest] {
            assert_eq!(at_times(&own, &values, None, &own, between), values);
        }
        let found = at_times(&own, &values, None, &[0.14], Between::Nearest);
        assert_eq!(found[0], -2.0);
    }
}
