//! A model's programs, ready to run, for integration and control.

use super::*;
use crate::lower;

/// The accelerations, Jacobians and Runge-Kutta steps of all phases of a model, run by the interpreter with the
/// arithmetic of the generated code. Evaluation allocates nothing; clone it for another thread. All vectors have
/// `latent_dim` elements, in scaled units. Methods panic where a phase does not exist or a length does not fit.
#[derive(Clone, Debug)]
pub struct CompiledModel {
    latent_dim: usize,
    phases: Vec<CompiledPhase>,
}

#[derive(Clone, Debug)]
struct CompiledPhase {
    dynamics: Interpreter,
    jacobian: Interpreter,
    pattern: JacobianPattern,
    entries: Vec<f64>,
    step: Interpreter,
    next: Vec<f64>, // z, then dz, before they replace the state
}

impl CompiledModel {
    pub fn new(model: &ReducedModel) -> Result<Self> {
        let system = &Equations::of(model);
        let form = Form::default();
        let phases = (0..model.phases().len())
            .map(|phase| {
                let (jacobian, pattern) = lower::dynamics_jacobian(system, phase, form)?;
                Ok(CompiledPhase {
                    dynamics: Interpreter::new(&lower::dynamics(system, phase, form)?),
                    jacobian: Interpreter::new(&jacobian),
                    entries: vec![0.0; pattern.len()],
                    pattern,
                    step: Interpreter::new(&lower::rk4_step(system, phase, form)?),
                    next: vec![0.0; 2 * model.latent_dim()],
                })
            })
            .collect::<Result<_>>()?;
        Ok(Self {
            latent_dim: model.latent_dim(),
            phases,
        })
    }

    pub fn latent_dim(&self) -> usize {
        self.latent_dim
    }

    pub fn n_phases(&self) -> usize {
        self.phases.len()
    }

    /// `ddz = Xi^T Theta(z, dz, u_lat)`.
    pub fn ddz(&mut self, phase: usize, z: &[f64], dz: &[f64], u_lat: &[f64], ddz: &mut [f64]) {
        let dynamics = &mut self.phases[phase].dynamics;
        dynamics.run(&[z, dz, u_lat], &mut [ddz]);
    }

    /// `ddz` and the entries of its Jacobian that [`CompiledModel::pattern`] names; returns their number.
    ///
    /// # Panics
    /// If `phase` does not exist, a vector does not fit or there is no room for the entries.
    pub fn accelerate(
        &mut self,
        phase: usize,
        z: &[f64],
        dz: &[f64],
        u_lat: &[f64],
        ddz: &mut [f64],
        entries: &mut [f64],
    ) -> usize {
        let CompiledPhase {
            jacobian, pattern, ..
        } = &mut self.phases[phase];
        let count = pattern.len();
        match count {
            0 => jacobian.run(&[z, dz, u_lat], &mut [ddz]),
            _ => jacobian.run(&[z, dz, u_lat], &mut [ddz, &mut entries[..count]]),
        }
        count
    }

    /// Rows and columns of the entries of a phase's Jacobian.
    pub fn pattern(&self, phase: usize) -> &JacobianPattern {
        &self.phases[phase].pattern
    }

    /// `ddz` and the full `latent_dim x 3 latent_dim` Jacobian by `(z, dz, u_lat)`.
    pub fn jacobian(
        &mut self,
        phase: usize,
        z: &[f64],
        dz: &[f64],
        u_lat: &[f64],
        ddz: &mut [f64],
        jacobian: &mut DMatrix<f64>,
    ) {
        let d = self.latent_dim;
        assert_eq!(jacobian.shape(), (d, 3 * d), "shape of the Jacobian");
        let mut entries = std::mem::take(&mut self.phases[phase].entries);
        self.accelerate(phase, z, dz, u_lat, ddz, &mut entries);
        jacobian.fill(0.0);
        for (place, &entry) in self.pattern(phase).places().zip(&entries) {
            jacobian[place] = entry;
        }
        self.phases[phase].entries = entries;
    }

    /// Advances `(z, dz)` by `h` seconds with the classical Runge-Kutta method under constant `u_lat`.
    pub fn rk4_step(&mut self, phase: usize, z: &mut [f64], dz: &mut [f64], u_lat: &[f64], h: f64) {
        let phase = &mut self.phases[phase];
        let (z_next, dz_next) = phase.next.split_at_mut(self.latent_dim);
        let outputs = &mut [&mut *z_next, &mut *dz_next];
        phase.step.run(&[z, dz, u_lat, &[h]], outputs);
        z.copy_from_slice(z_next);
        dz.copy_from_slice(dz_next);
    }
}
