//! Phases: regimes of the dynamics and the foot patterns that select them.

use nalgebra::DMatrix;

use crate::robot::{ContactFlags, FeetRule};

/// All foot patterns, from no foot to four feet.
pub(super) fn all_patterns() -> impl Iterator<Item = ContactFlags> {
    (0u8..16).map(|bits| std::array::from_fn(|foot| bits >> foot & 1 == 1))
}

/// Index of the first phase whose rule matches the feet.
pub(super) fn selected(phases: &[Phase], feet: ContactFlags) -> Option<usize> {
    phases.iter().position(|phase| phase.feet.matches(feet))
}

/// One dynamics regime: `ddz = Xi^T Theta(z, dz, u_lat)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    /// Name, such as `contact`.
    pub name: String,
    /// Foot patterns that select it; the first phase that matches wins.
    pub feet: FeetRule,
    /// Coefficients, `library_dim x latent_dim`, in scaled units.
    pub xi: DMatrix<f64>,
}

impl Phase {
    /// Number of coefficients that are not zero.
    pub fn active_count(&self) -> usize {
        self.xi.iter().filter(|&&value| value != 0.0).count()
    }

    /// Indices of the active terms of one output, the rows of Xi, with their coefficients, in library order.
    pub fn active_terms(&self, output: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let coefficients = self.xi.column(output).into_iter().copied();
        (coefficients.enumerate()).filter(|&(_, value)| value != 0.0)
    }
}
