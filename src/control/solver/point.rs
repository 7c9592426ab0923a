//! How far a point of the iterations is from the optimum, and the numbers by which they begin and end.

use super::problem::Settings;
use super::scalar::Real;

/// Least share of the way to the boundary that a step leaves.
const LEAST_MARGIN: f64 = 1e-3;
/// Most of it.
const MOST_MARGIN: f64 = 5e-3;
/// The share between the two, in units of the mean complementarity: near the optimum steps may go further.
const MARGIN_FACTOR: f64 = 10.0;
/// Where slacks and multipliers are centred.
#[derive(Debug, Clone, Copy)]
pub(super) struct Centring {
    pub(super) slack: f64,
    pub(super) product: f64,
}

/// At a start from the gains.
pub(super) const COLD: Centring = Centring {
    slack: 3e-1,
    product: 3.0,
};
/// At a start from a guess.
pub(super) const WARM: Centring = Centring {
    slack: 1e-2,
    product: 1e-3,
};
/// At a start from a guess at the solution of quite another program.
pub(super) const FAR: Centring = Centring {
    slack: 3e-1,
    product: 1.0,
};
/// Where a guess turned out to be poor, or the iterations go round in a circle.
pub(super) const AGAIN: Centring = Centring {
    slack: 1e-1,
    product: 2e-1,
};
/// A guess is of quite another program if the optimum without rows moved further than this, in units of the input's
/// rows.
pub(super) const FAR_CHANGE: f64 = 3.0;
/// A first step from a guess that is shorter than this shows that the guess is not near a solution.
pub(super) const SHORT_STEP: f64 = 0.4;
/// Iterations after which slacks and multipliers are centred again: now and then the method goes round in a circle.
pub(super) const PATIENCE: u32 = 16;

/// Share of the residuals at the last centring, those of the gradient among them, that may be left.
const LEFT: f64 = 1e-6;

#[derive(Debug, Clone, Copy)]
pub(super) struct Point<T> {
    /// Share of the gradient that the steps since the last centring have left.
    pub(super) left: T,
    /// The same share of the rows' residuals; one where these are kept up to date.
    pub(super) kept: T,
    /// Largest residual of a row at the last centring, or the present one.
    pub(super) residual: T,
    /// Sum of the products of slacks and multipliers.
    pub(super) sum: T,
    /// The largest of them.
    pub(super) largest: T,
    /// `Σ vᵀ R v + xᵀ Q x`, one before the first step.
    pub(super) value: T,
}

impl<T: Real> Point<T> {
    #[inline(always)]
    pub(super) fn zeros() -> Self {
        Self {
            left: T::ZERO,
            kept: T::ZERO,
            residual: T::ZERO,
            sum: T::ZERO,
            largest: T::ZERO,
            value: T::ZERO,
        }
    }

    #[inline(always)]
    pub(super) fn infeasibility(&self) -> T {
        self.kept * self.residual
    }

    /// Whether the iterations may end here: gradient and rows hold, and each product, or the gap between primal and
    /// dual cost, is small.
    #[inline(always)]
    pub(super) fn is_optimal(&self, settings: &Settings<T>) -> bool {
        self.left <= T::of(LEFT)
            && self.infeasibility() <= settings.tolerance
            && (self.largest <= settings.tolerance
                || self.sum <= settings.gap * T::ONE.or_larger(self.value))
    }
}

/// Share of the way to the boundary that a step goes at a mean complementarity.
#[inline(always)]
pub(super) fn boundary_share<T: Real>(complementarity: T) -> T {
    let margin = T::of(MARGIN_FACTOR) * complementarity;
    if margin < T::of(MOST_MARGIN) {
        T::ONE - T::of(LEAST_MARGIN).or_larger(margin)
    } else {
        T::ONE - T::of(MOST_MARGIN)
    }
}
