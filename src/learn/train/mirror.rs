//! Phases that are each other's mirror images, such as the two of a trot: the equations of one are those of the other with the
//! signs that a mirror changes.

use super::*;
use crate::robot::{ContactFlags, FOOT_DIM};

/// The mirror image of the dynamics, for latent coordinates that each stay or change sign in a mirror.
#[derive(Clone, Debug, Default)]
pub(super) struct Mirror {
    images: Vec<usize>,  // of each phase; none where nothing is known
    signs: DMatrix<f64>, // of a coefficient, library_dim x latent_dim
}

impl Mirror {
    /// Nothing is known of phases whose image is no phase, or of a library with terms whose image is no multiple of them.
    /// `parity` is 1 for each latent coordinate that stays, -1 for each that changes sign.
    pub(super) fn of(phases: &PhaseRule, features: &Features, parity: &[f64]) -> Self {
        let d = features.latent_dim;
        let mut signs = DMatrix::zeros(features.library_dim(), d);
        for (term, variables) in features.variables() {
            if !features.affine[term] && variables.len() != 2 {
                return Self::default();
            }
            let sign: f64 = variables.iter().map(|v| parity[v % d]).product();
            (0..d).for_each(|k| signs[(term, k)] = sign * parity[k]);
        }
        let image = |phase: usize| {
            let feet =
                FeetRule::all_patterns().filter(|feet| phases.phase_of(*feet) == Some(phase));
            let mut images = feet.map(|feet| phases.phase_of(mirrored(feet)));
            let first = images.next()??;
            images.all(|image| image == Some(first)).then_some(first)
        };
        let images: Option<Vec<usize>> = (0..phases.patterns.len()).map(image).collect();
        let images = images.unwrap_or_default();
        Self { images, signs }
    }

    /// Whether a phase is its own image: its equations keep no term that a mirror turns around.
    pub(super) fn is_own_image(&self, phase: usize) -> bool {
        self.images.get(phase) == Some(&phase)
    }

    /// Makes the later of two phases that are images of each other the image of the earlier, to the last bit.
    pub(super) fn copy(&self, xi: &mut [Xi]) {
        for (phase, &image) in self.images.iter().enumerate() {
            if image > phase && self.images[image] == phase {
                xi[image] = xi[phase].component_mul(&self.signs);
            }
        }
    }
}

fn mirrored(feet: ContactFlags) -> ContactFlags {
    let mut image = [false; FOOT_DIM];
    for (foot, down) in feet.into_iter().enumerate() {
        image[foot ^ 1] = down;
    }
    image
}
