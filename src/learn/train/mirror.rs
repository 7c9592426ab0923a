//! Phases that are each other's mirror images, such as the two of a trot. The equations of one are those of the other
//! with the signs that a mirror changes.

use super::*;
use crate::robot::{ContactFlags, FOOT_DIM};

/// The mirror image of the dynamics, for latent coordinates that each stay or change sign in a mirror.
#[derive(Clone, Debug, Default)]
pub(super) struct Mirror {
    images: Vec<Option<usize>>, // of each phase, if its image is a phase
    /// Of a coefficient, library_dim x latent_dim; none if the image of a term is no multiple of it.
    signs: Option<DMatrix<f64>>,
}

impl Mirror {
    /// `parity` is 1 for each latent coordinate that stays, -1 for each that changes sign.
    pub(super) fn of(phases: &PhaseRule, features: &Features, parity: &[f64]) -> Self {
        let d = features.latent_dim;
        let mut signs = Some(DMatrix::zeros(features.library_dim(), d));
        for (term, variables) in features.variables() {
            let has_sign = features.affine[term] || variables.len() == 2;
            signs = signs.filter(|_| has_sign);
            let sign: f64 = variables.iter().map(|v| parity[v % d]).product();
            for signs in signs.iter_mut() {
                (0..d).for_each(|k| signs[(term, k)] = sign * parity[k]);
            }
        }
        let image = |phase: usize| {
            let feet =
                FeetRule::all_patterns().filter(|feet| phases.phase_of(*feet) == Some(phase));
            let mut images = feet.map(|feet| phases.phase_of(mirrored(feet)));
            let first = images.next()??;
            images.all(|image| image == Some(first)).then_some(first)
        };
        let images = (0..phases.patterns.len()).map(image).collect();
        Self { images, signs }
    }

    /// Whether a phase is its own image: its equations keep no term that a mirror turns around.
    pub(super) fn is_own_image(&self, phase: usize) -> bool {
        self.images.get(phase) == Some(&Some(phase))
    }

    /// Makes the later of two phases that are images of each other the image of the earlier, to the last bit.
    pub(super) fn copy(&self, xi: &mut [Xi]) {
        let Some(signs) = &self.signs else { return };
        for (phase, image) in self.images.iter().enumerate() {
            let Some(image) = *image else { continue };
            if image > phase && self.images[image] == Some(phase) {
                xi[image] = xi[phase].component_mul(signs);
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

#[cfg(test)]
#[path = "../../../tests/units/learn_train_mirror.rs"]
mod tests;
