//! What is known of the dynamics before any regression.

use std::ops::Range;

use nalgebra::DMatrix;

use super::dataset::Dataset;
use super::features::Features;
use super::frame::Frame;
use super::metrics::BODY_Z;
use crate::robot::{FeetRule, GRAVITY_M_S2};

/// Rows that a frame holds: the centre of mass forwards and upwards.
const HELD: usize = 2;

/// Coefficients of one phase that are known, those that a regression may choose, and those that it must keep.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Knowledge {
    /// `library_dim x latent_dim`, zero where nothing is known.
    pub known: DMatrix<f64>,
    /// Whether a coefficient is free, `library_dim x latent_dim`.
    pub free: DMatrix<bool>,
    /// Whether a free coefficient stays whatever it explains, `library_dim x latent_dim`.
    pub kept: DMatrix<bool>,
    /// Whether a free coefficient is at most 0 once it is refined, `library_dim x latent_dim`.
    pub braking: DMatrix<bool>,
}

impl Knowledge {
    pub(super) fn nothing(library_dim: usize, latent_dim: usize) -> Self {
        Self {
            known: DMatrix::zeros(library_dim, latent_dim),
            free: DMatrix::from_element(library_dim, latent_dim, true),
            kept: DMatrix::from_element(library_dim, latent_dim, false),
            braking: DMatrix::from_element(library_dim, latent_dim, false),
        }
    }

    /// Coefficients that would drive where they may only brake, set to 0.
    pub(super) fn brake(&self, xi: &mut DMatrix<f64>) {
        for (coefficient, braking) in xi.iter_mut().zip(self.braking.iter()) {
            if *braking && *coefficient > 0.0 {
                *coefficient = 0.0;
            }
        }
    }

    /// What is known of each phase in a frame that holds the centre of mass as `z1` (forwards) and `z2` (upwards),
    /// nothing in any other.
    ///
    /// The floor is the same everywhere, so no term depends on `z1`. Forces move a centre of mass and losses brake it,
    /// wherever it and the legs are (Newton's second law): no term of `ddz1` and `ddz2` depends on a position, and each
    /// keeps its own velocity, with a coefficient of at most 0. With feet on the ground `ddz2` depends on its own force
    /// and velocity alone, and keeps its constant: gravity, less what the ground carries of the legs' weight, which
    /// forces that come from torques leave out. In flight `ddz1 = 0`, `ddz2 = -g`, and there are no forces that any
    /// term could depend on. An input acts on its own coordinate.
    pub(super) fn of_phases(training: &Dataset, features: &Features, frame: &Frame) -> Vec<Self> {
        let (p, d) = (features.library_dim(), features.latent_dim());
        let each = training.phases.patterns.iter();
        if frame.held.ncols() < HELD {
            return each.map(|_| Self::nothing(p, d)).collect();
        }
        let gravity = -GRAVITY_M_S2 * training.scaling.state[BODY_Z];
        let (upwards, force_upwards) = (d + 1, 2 * d + 1);
        let one = features.constant_term();
        // Coefficients in some columns of the terms that depend on certain variables are not free.
        let fix =
            |knowledge: &mut Self, columns: Range<usize>, is_meant: &dyn Fn(usize) -> bool| {
                for variable in (0..3 * d).filter(|&i| is_meant(i)) {
                    for term in (0..p).filter(|&term| features.depends_on(term, variable)) {
                        let mut row = knowledge.free.row_mut(term);
                        row.columns_range_mut(columns.clone()).fill(false);
                    }
                }
            };
        each.map(|phase| {
            let mut knowledge = Self::nothing(p, d);
            fix(&mut knowledge, 0..d, &|i| i == 0);
            fix(&mut knowledge, 0..HELD, &|i| i < d);
            if phase.feet == FeetRule::None {
                fix(&mut knowledge, 0..d, &|i| {
                    (2 * d..2 * d + HELD).contains(&i)
                });
                knowledge.free.column_mut(0).fill(false);
                if let Some(one) = one {
                    knowledge.known[(one, 1)] = gravity;
                    knowledge.free.column_mut(1).fill(false);
                }
            } else {
                fix(&mut knowledge, 1..2, &|i| {
                    i != upwards && i != force_upwards
                });
                if let Some(one) = one {
                    knowledge.kept[(one, 1)] = true;
                }
            }
            for k in 0..d {
                if let Some(term) = features.variable_term(2 * d + k) {
                    knowledge.kept[(term, k)] = knowledge.free[(term, k)];
                }
            }
            for k in 0..HELD {
                if let Some(term) = features.variable_term(d + k) {
                    knowledge.kept[(term, k)] = knowledge.free[(term, k)];
                    knowledge.braking[(term, k)] = knowledge.free[(term, k)];
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
    use crate::robot::STATE_DIM;
    use crate::train::oscillator;
    use crate::train::sparse::{Pruning, Regression};

    #[test]
    fn centre_of_mass_is_moved_by_forces_alone_and_in_flight_by_none() {
        let (dataset, _) = oscillator::jumps(1);
        let features = Features::new(&oscillator::standard_library(3, 2, true));
        let frame = Frame {
            held: DMatrix::zeros(STATE_DIM, HELD),
            free: DMatrix::zeros(STATE_DIM, 1),
        };
        let [contact, flight] = &Knowledge::of_phases(&dataset, &features, &frame)[..] else {
            panic!("two phases");
        };
        let term = |variable| features.variable_term(variable).expect("a linear library");
        let (z2, z3, dz2, u1, u2, u3) = (term(1), term(2), term(4), term(6), term(7), term(8));
        let one = features.constant_term().expect("a standard library");
        let gravity = -GRAVITY_M_S2 * dataset.scaling.state[BODY_Z];
        assert_eq!(flight.known[(one, 1)], gravity);
        assert!(contact.known[(one, 1)] == 0.0 && contact.kept[(one, 1)]);
        for phase in [contact, flight] {
            assert!(phase.free.row(term(0)).iter().all(|free| !free));
            assert!(!phase.free[(z2, 0)] && !phase.free[(z3, 1)]);
            assert!(phase.free[(z2, 2)] && phase.free[(z3, 2)] && phase.kept[(u3, 2)]);
        }
        assert!(contact.free[(u1, 2)] && contact.free[(u2, 0)] && contact.free[(dz2, 0)]);
        let affine = features.affine_terms();
        let upwards: Vec<usize> = (0..affine.len())
            .filter(|&term| contact.free[(term, 1)] && affine[term])
            .collect();
        assert_eq!(upwards, [one, dz2, u2]);
        assert!(contact.kept[(u2, 1)] && contact.kept[(dz2, 1)] && !contact.kept[(dz2, 0)]);
        assert!(
            contact.braking[(dz2, 1)] && !contact.braking[(u2, 1)] && !flight.braking[(dz2, 1)]
        );
        assert!(!flight.free[(u1, 2)] && !flight.free[(u2, 2)]);
        assert!(!flight.free.columns(0, HELD).iter().any(|free| *free));
        let nothing = Knowledge::of_phases(&dataset, &features, &Frame::plain(&[0, 1, 2]));
        assert_eq!(nothing[0], Knowledge::nothing(features.library_dim(), 3));
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
