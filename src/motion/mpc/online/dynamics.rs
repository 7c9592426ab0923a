//! The interface between the controller and a model's equations of motion.

use std::fmt::Debug;

use nalgebra::DMatrix;

/// The latent accelerations of every phase with their derivatives.
///
/// The interpreter's programs and the generated code of a controller both are.
pub trait LatentDynamics: Debug + Send {
    /// Writes `ddz = Xiᵀ Θ(z, dz, u_lat)` of a phase and its dense Jacobian by `(z, dz, u_lat)`,
    /// `latent_dim × 3 latent_dim`.
    ///
    /// # Panics
    /// May panic if the phase does not exist or a length does not fit.
    fn jacobian(
        &mut self,
        phase: usize,
        z: &[f64],
        dz: &[f64],
        u_lat: &[f64],
        ddz: &mut [f64],
        jacobian: &mut DMatrix<f64>,
    );
}
