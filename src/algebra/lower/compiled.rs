//! A model's programs, ready to run: what integration and control evaluate.

use nalgebra::DMatrix;

use super::{Form, JacobianPattern, LowerError};
use crate::equations::Equations;
use crate::ir::Interpreter;
use crate::lower;
use crate::model::ReducedModel;

/// The accelerations, Jacobians and Runge-Kutta steps of all phases of a model, run by
/// the interpreter with the very arithmetic of the generated code. Evaluation
/// allocates nothing; clone it for another thread.
///
/// All vectors have `latent_dim` elements, in scaled units.
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
    /// Result of a step before it replaces the state: z, then dz.
    next: Vec<f64>,
}

impl CompiledModel {
    /// Lowers all phases of a model.
    ///
    /// # Errors
    /// As [`lower::dynamics_jacobian`].
    pub fn new(model: &ReducedModel) -> Result<Self, LowerError> {
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
            .collect::<Result<_, LowerError>>()?;
        Ok(Self {
            latent_dim: model.latent_dim(),
            phases,
        })
    }

    /// Number of latent coordinates.
    pub fn latent_dim(&self) -> usize {
        self.latent_dim
    }

    /// Number of phases, in the order of the model's.
    pub fn n_phases(&self) -> usize {
        self.phases.len()
    }

    /// `ddz = Xi^T Theta(z, dz, u_lat)`.
    ///
    /// # Panics
    /// If `phase` does not exist or a slice is not `latent_dim` long.
    pub fn ddz(&mut self, phase: usize, z: &[f64], dz: &[f64], u_lat: &[f64], ddz: &mut [f64]) {
        let dynamics = &mut self.phases[phase].dynamics;
        dynamics.run(&[z, dz, u_lat], &mut [ddz]);
    }

    /// `ddz` and the full `latent_dim x 3 latent_dim` Jacobian by `(z, dz, u_lat)`.
    ///
    /// # Panics
    /// If `phase` does not exist or a length does not fit.
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
        let phase = &mut self.phases[phase];
        if phase.pattern.is_empty() {
            phase.jacobian.run(&[z, dz, u_lat], &mut [ddz]);
        } else {
            let outputs = &mut [ddz, phase.entries.as_mut_slice()];
            phase.jacobian.run(&[z, dz, u_lat], outputs);
        }
        jacobian.fill(0.0);
        for (place, &entry) in phase.pattern.places().zip(&phase.entries) {
            jacobian[place] = entry;
        }
    }

    /// Advances `(z, dz)` by `h` seconds with the classical Runge-Kutta method under
    /// constant `u_lat`.
    ///
    /// # Panics
    /// If `phase` does not exist or a slice is not `latent_dim` long.
    pub fn rk4_step(&mut self, phase: usize, z: &mut [f64], dz: &mut [f64], u_lat: &[f64], h: f64) {
        let phase = &mut self.phases[phase];
        let (z_next, dz_next) = phase.next.split_at_mut(self.latent_dim);
        phase
            .step
            .run(&[z, dz, u_lat, &[h]], &mut [&mut *z_next, &mut *dz_next]);
        z.copy_from_slice(z_next);
        dz.copy_from_slice(dz_next);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;
    use crate::model::{FeetRule, Library, Phase};

    /// A pendulum with damping and torque, and a free flight with constant acceleration.
    fn pendulum() -> ReducedModel {
        let terms = ["1", "dz1", "sin(z1)", "u1"].map(str::to_owned);
        let library = Library::from_terms(1, &terms).expect("terms parse");
        let phase = |name: &str, feet, xi: [f64; 4]| Phase {
            name: name.to_owned(),
            feet,
            xi: DMatrix::from_column_slice(4, 1, &xi),
        };
        ReducedModel::builder("pendulum", library)
            .phase(phase("contact", FeetRule::Any, [0.0, -0.3, -9.81, 2.0]))
            .phase(phase("flight", FeetRule::None, [-9.81, 0.0, 0.0, 0.0]))
            .build()
            .expect("a valid model")
    }

    #[test]
    fn ddz_equals_the_models_own_evaluation() {
        let model = pendulum();
        let mut compiled = CompiledModel::new(&model).expect("lowers");
        let mut ddz = [0.0];
        for phase in 0..2 {
            compiled.ddz(phase, &[0.7], &[-1.5], &[0.25], &mut ddz);
            let at = |value| DVector::from_element(1, value);
            let expected = model.ddz(phase, &at(0.7), &at(-1.5), &at(0.25)).unwrap();
            assert!((ddz[0] - expected[0]).abs() < 1e-14, "{ddz:?} {expected}");
        }
    }

    #[test]
    fn jacobian_is_dense_and_zero_where_the_phase_is_constant() {
        let mut compiled = CompiledModel::new(&pendulum()).expect("lowers");
        let (mut ddz, mut jacobian) = ([0.0], DMatrix::from_element(1, 3, f64::NAN));
        compiled.jacobian(0, &[0.7], &[-1.5], &[0.25], &mut ddz, &mut jacobian);
        let expected = [-9.81 * 0.7f64.cos(), -0.3, 2.0];
        for (found, expected) in jacobian.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-14, "{found} {expected}");
        }
        compiled.jacobian(1, &[0.7], &[-1.5], &[0.25], &mut ddz, &mut jacobian);
        assert_eq!((ddz[0], jacobian.as_slice()), (-9.81, [0.0; 3].as_slice()));
        assert!(compiled.phases[1].pattern.is_empty());
    }

    #[test]
    fn rk4_step_has_fifth_order_local_error() {
        let mut compiled = CompiledModel::new(&pendulum()).expect("lowers");
        let mut advance = |h: f64, n: usize| {
            let (mut z, mut dz) = ([0.7], [-1.5]);
            for _ in 0..n {
                compiled.rk4_step(0, &mut z, &mut dz, &[0.25], h);
            }
            z[0]
        };
        let reference = advance(1e-4, 2000);
        let coarse = (advance(0.02, 10) - reference).abs();
        let fine = (advance(0.01, 20) - reference).abs();
        assert!(coarse < 1e-6, "{coarse}");
        assert!(
            (10.0..25.0).contains(&(coarse / fine)),
            "order: {coarse} {fine}"
        );
    }
}
