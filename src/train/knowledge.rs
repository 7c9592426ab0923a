//! What is known of the dynamics before any regression.

use nalgebra::DMatrix;

use super::dataset::Dataset;
use super::features::Features;
use super::frame::Frame;
use super::metrics::BODY_Z;
use crate::robot::{FeetRule, GRAVITY_M_S2};

/// Coefficients of one phase that are known, those that a regression may choose, and those that it must keep.
#[derive(Clone, Debug, PartialEq)]
pub struct Knowledge {
    /// `library_dim x latent_dim`, zero where nothing is known.
    pub known: DMatrix<f64>,
    /// Whether a coefficient is free, `library_dim x latent_dim`.
    pub free: DMatrix<bool>,
    /// Whether a free coefficient stays whatever it explains, `library_dim x latent_dim`.
    pub kept: DMatrix<bool>,
}

impl Knowledge {
    /// Nothing is known.
    pub fn nothing(library_dim: usize, latent_dim: usize) -> Self {
        Self {
            known: DMatrix::zeros(library_dim, latent_dim),
            free: DMatrix::from_element(library_dim, latent_dim, true),
            kept: DMatrix::from_element(library_dim, latent_dim, false),
        }
    }

    /// What is known of each phase in a frame that holds the centre of mass as `z1` (forwards) and `z2` (upwards),
    /// nothing in any other.
    ///
    /// The floor is the same everywhere, so no term depends on `z1`; in flight `ddz1 = 0` and `ddz2 = -g`; with feet
    /// on the ground the constant of `ddz2` is `-g`; and an input acts on its own coordinate.
    pub fn of_phases(training: &Dataset, features: &Features, frame: &Frame) -> Vec<Self> {
        let (p, d) = (features.library_dim(), features.latent_dim());
        let each = training.phases.patterns.iter();
        if frame.held.ncols() < 2 {
            return each.map(|_| Self::nothing(p, d)).collect();
        }
        let gravity = -GRAVITY_M_S2 * training.scaling.state[BODY_Z];
        let shifted = features.depend_on(0);
        let one = features.constant_term();
        each.map(|phase| {
            let mut knowledge = Self::nothing(p, d);
            for term in (0..p).filter(|&term| shifted[term]) {
                knowledge.free.row_mut(term).fill(false);
            }
            if let Some(one) = one {
                knowledge.known[(one, 1)] = gravity;
                knowledge.free[(one, 1)] = false;
            }
            let flies = phase.feet == FeetRule::None;
            if flies {
                knowledge.free.column_mut(0).fill(false);
            }
            if flies && one.is_some() {
                knowledge.free.column_mut(1).fill(false);
            }
            for coordinate in 0..d {
                if let Some(term) = features.variable_term(2 * d + coordinate) {
                    knowledge.kept[(term, coordinate)] = knowledge.free[(term, coordinate)];
                }
            }
            knowledge
        })
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Library, StandardLibrary};
    use crate::train::sparse::{Pruning, Regression};

    /// Terms 1, z1, z2, dz1, dz2, u1, u2.
    fn features() -> Features {
        let standard = StandardLibrary {
            degree: 1,
            trigonometric: false,
            inputs: true,
        };
        Features::new(&Library::standard(2, standard).expect("small library"))
    }

    #[test]
    fn terms_are_found_by_what_they_depend_on() {
        let features = features();
        assert_eq!(features.constant_term(), Some(0));
        assert_eq!(features.variable_term(4), Some(5));
        assert_eq!(
            features.depend_on(0),
            [false, true, false, false, false, false, false]
        );
        let terms = ["sin(z1+z2)".to_owned(), "z2^2".to_owned()];
        let curved = Features::new(&Library::from_terms(2, &terms).expect("two terms"));
        assert_eq!(
            (curved.depend_on(0), curved.constant_term()),
            (vec![true, false], None)
        );
    }

    #[test]
    fn regression_keeps_what_is_known_and_never_takes_what_is_not_free() {
        let theta = DMatrix::from_fn(60, 7, |i, j| match j {
            0 => 1.0,
            _ => ((1 + i) as f64 * (0.3 + 0.17 * j as f64)).sin(),
        });
        let mut truth = DMatrix::zeros(7, 2);
        (truth[(0, 1)], truth[(5, 0)], truth[(6, 1)], truth[(1, 0)]) = (-0.9, 2.0, 3.0, 1.0);
        let mut knowledge = Knowledge::nothing(7, 2);
        knowledge.known[(0, 1)] = -0.981;
        knowledge.free[(0, 1)] = false;
        knowledge.free[(1, 0)] = false;
        knowledge.kept[(6, 0)] = true; // explains nothing
        let regression = Regression::new(&theta, &(&theta * &truth), knowledge);
        for pruning in [Pruning::Threshold(0.05), Pruning::Elimination(0.02)] {
            let xi = regression.fit(1e-6, pruning);
            assert_eq!((xi[(0, 1)], xi[(1, 0)]), (-0.981, 0.0));
            assert!(xi[(6, 0)] != 0.0 && (xi[(6, 1)] - 3.0).abs() < 0.2, "{xi}");
            let support = xi.map(|value| value != 0.0);
            assert_eq!(regression.fit_column(1, &support, 1e-6)[0], -0.981);
            let may_go = regression.losses(0, &support, 1e-6);
            assert!(may_go.iter().all(|(term, _)| *term != 6 && *term != 1));
        }
    }
}
