//! Values of a topic at the times of another clock.

use nalgebra::DMatrix;

use crate::recording::preprocess::{differences, place};

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

const SAME: f64 = 1e-6; // times within this share of a step are the same time

/// Samples of a polynomial whose slope is that of its middle, or of its ends at the ends of a log.
const STENCIL: usize = 5;
/// How much longer than the shortest step of a stencil its longest may be: beyond, polynomials swing.
const UNEVEN: f64 = 4.0;

/// Values at `times_s`, one column a time, of rows known at `own_s`; `slopes` are their derivatives at `own_s`, those
/// of polynomials through five samples unless known. Every time is within the clock's own range.
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
            derived = slopes_of(own_s, values);
            &derived
        }
    };
    let mut out = DMatrix::zeros(values.nrows(), times_s.len());
    for (column, &time) in times_s.iter().enumerate() {
        let (left, share) = place(own_s, time);
        let (step, share) = (own_s[left + 1] - own_s[left], share.clamp(0.0, 1.0));
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

fn slopes_of(own_s: &[f64], values: &DMatrix<f64>) -> DMatrix<f64> {
    let mut slopes = differences(own_s, values);
    let n = own_s.len();
    if n < STENCIL {
        return slopes;
    }
    for sample in 0..n {
        let first = sample.saturating_sub(STENCIL / 2).min(n - STENCIL);
        let times = &own_s[first..first + STENCIL];
        let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
        let (least, most) = steps.fold((f64::INFINITY, 0.0_f64), |(least, most), step| {
            (least.min(step), most.max(step))
        });
        if most > UNEVEN * least {
            continue;
        }
        let weights = slope_weights(times, sample - first);
        let mut slope = slopes.column_mut(sample);
        slope.fill(0.0);
        for (k, weight) in weights.into_iter().enumerate() {
            slope.axpy(weight, &values.column(first + k), 1.0);
        }
    }
    slopes
}

/// By what values at the times are multiplied in the derivative of the polynomial through them, at one of the times.
fn slope_weights(times: &[f64], at: usize) -> [f64; STENCIL] {
    let others = |j: usize| (0..times.len()).filter(move |k| *k != j);
    std::array::from_fn(|j| {
        if j == at {
            return others(at).map(|k| 1.0 / (times[at] - times[k])).sum();
        }
        let above: f64 = ((others(at).filter(|k| *k != j)).map(|k| times[at] - times[k])).product();
        let below: f64 = others(j).map(|k| times[j] - times[k]).product();
        above / below
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_a_quartic_at_uneven_times_and_differences_where_they_swing() {
        let own = [0.0, 0.011, 0.019, 0.032, 0.04, 0.049, 0.062];
        let quartic = |t: f64| ((3.0 * t - 2.0) * t + 1.0) * t * t - t;
        let slope = |t: f64| ((12.0 * t - 6.0) * t + 2.0) * t - 1.0;
        let values = DMatrix::from_fn(1, own.len(), |_, i| quartic(own[i]));
        let found = slopes_of(&own, &values);
        for (i, time) in own.into_iter().enumerate() {
            assert!(
                (found[i] - slope(time)).abs() < 1e-12,
                "{time}: {}",
                found[i]
            );
        }
        let bursts = [0.0, 0.001, 0.01, 0.011, 0.02, 0.021];
        let values = DMatrix::from_fn(1, bursts.len(), |_, i| quartic(bursts[i]));
        assert_eq!(slopes_of(&bursts, &values), differences(&bursts, &values));
        let few = DMatrix::from_fn(1, 3, |_, i| quartic(own[i]));
        assert_eq!(slopes_of(&own[..3], &few), differences(&own[..3], &few));
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
