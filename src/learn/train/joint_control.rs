//! Joint position control that recorded torques of legs in flight do not contain, as on a robot that also receives
//! commanded postures. It is `ddz = -2 w dz - w^2 z` with one rate `w` for all equations, which is critically damped.

use nalgebra::{DVector, Matrix2, Vector2};

use super::equation_change::{Family, Sums};

const RATES: i32 = 60; // tried, from 1/s on
const STEP: f64 = 1.1; // from one to the next

/// An equation whose variable follows the control: its number, coefficients, and the terms `dz`, `z` of its variable.
pub(super) struct Controlled {
    pub(super) k: usize,
    pub(super) xi: DVector<f64>,
    pub(super) terms: [usize; 2],
}

/// Coefficients of `dz` and `z` that fit best if each equation is also multiplied and shifted; none if none is better.
pub(super) fn coefficients(
    equations: &[Controlled],
    sums: &Sums,
    constant: usize,
) -> Option<[f64; 2]> {
    let (mut gram, mut slopes) = (Matrix2::zeros(), Vector2::zeros());
    for Controlled { k, xi, terms } in equations {
        let family = Family::share(xi, Some(constant));
        let (own_gram, own_slopes) = family.without_its_changes(sums, *k, xi, *terms)?;
        gram += own_gram;
        slopes += own_slopes;
    }
    let gain = |of: &Vector2<f64>| slopes.dot(of) - 0.5 * of.dot(&(gram * of));
    let of_rate = |step: i32| {
        let rate = STEP.powi(step);
        Vector2::new(-2.0 * rate, -rate * rate)
    };
    let all = (0..RATES).map(of_rate);
    let best = all.max_by(|a, b| gain(a).total_cmp(&gain(b)))?;
    (gain(&best) > 0.0).then_some([best[0], best[1]])
}
