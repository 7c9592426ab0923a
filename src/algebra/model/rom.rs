//! The hybrid reduced-order model.
//!
//! Robot state `x` and generalised input `u = [tau; F_lin; F_ang]` are in SI units; `z`, `dz` and
//! `u_lat` in scaled units. With the scale factors `s_x`, `s_u` (scaled = factor times SI):
//!
//! - `z = W_e (s_x x) + b_e`, `dz = W_e (s_x dx)`: positions take the bias, velocities do not;
//! - `x = (W_d z + b_d) / s_x`, `dx = (W_d dz) / s_x`;
//! - `u_lat = pinv(W_e^T) (s_u u)` (project), `u = (W_e^T u_lat) / s_u` (lift);
//! - `ddz = Xi^T Theta(z, dz, u_lat)` with the Xi of the phase that the feet select.
//!
//! `project(lift(u_lat)) == u_lat`, because an encoder has full row rank; the reverse does not hold.
//!
//! These are the linear maps. A nonlinear encoder or decoder ([`StateMap`]) has a Jacobian `J` at a
//! state instead of `W`; `maps.rs` states what becomes of the equations.

use nalgebra::{DMatrix, DVector};
use serde_json::{Map, Value};

use super::builder::ModelBuilder;
use super::coordinate_names::CoordinateNames;
use super::error::ModelError;
use super::identifier::Identifier;
use super::jump_prior::JumpPrior;
use super::library::{CandidateTerm, Library};
use super::phase::Phase;
use super::scaling::Scaling;
use super::state_map::StateMap;
use super::statistics::InputStatistics;
use crate::robot::{Actuators, ContactFlags, InputRule, Robot, WrenchFrame};

/// A checked reduced-order model; made by [`ReducedModel::builder`] or read from a model file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReducedModel {
    pub(super) name: String,
    pub(super) identifier: Identifier,
    pub(super) description: String,
    pub(super) library: Library,
    pub(super) phases: Vec<Phase>,
    pub(super) phase_identifiers: Vec<Identifier>,
    pub(super) statistics: Vec<Option<InputStatistics>>,
    pub(super) state: Option<CoordinateNames>,
    pub(super) input: Option<CoordinateNames>,
    pub(super) scaling: Option<Scaling>,
    pub(super) encoder: Option<StateMap>,
    pub(super) decoder: Option<StateMap>,
    /// `pinv(W_e^T)`, `latent_dim x input_dim`; there when the encoder is, and is linear.
    pub(super) input_projection: Option<DMatrix<f64>>,
    pub(super) robot: Option<&'static Robot>,
    pub(super) actuators: Option<Actuators>,
    pub(super) wrench_frame: WrenchFrame,
    pub(super) jump_prior: Option<JumpPrior>,
    pub(super) sample_time_s: Option<f64>,
    pub(super) provenance: Map<String, Value>,
}

impl ReducedModel {
    /// Starts a model; the builder's `build` checks it.
    pub fn builder(name: impl Into<String>, library: Library) -> ModelBuilder {
        ModelBuilder::new(name.into(), library)
    }

    /// Takes the model apart for a change; `build` checks the result again.
    pub fn into_builder(self) -> ModelBuilder {
        ModelBuilder::from_model(self)
    }

    /// Name as in the model file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The name as it appears in generated code.
    pub fn identifier(&self) -> &Identifier {
        &self.identifier
    }

    /// Free text about the model; may hold any printable character, so never paste it into code.
    pub fn description(&self) -> &str {
        &self.description
    }

    /// Where the model comes from: free JSON.
    pub fn provenance(&self) -> &Map<String, Value> {
        &self.provenance
    }

    /// Number of latent coordinates, `d`.
    pub fn latent_dim(&self) -> usize {
        self.library.latent_dim()
    }

    /// Number of robot coordinates, `n`; `None` for a latent-only model.
    pub fn state_dim(&self) -> Option<usize> {
        let encoder = self.encoder.as_ref().map(StateMap::input_dim);
        let decoder = self.decoder.as_ref().map(StateMap::output_dim);
        encoder
            .or(decoder)
            .or(self.state.as_ref().map(CoordinateNames::dim))
            .or(self.input.as_ref().map(CoordinateNames::dim))
    }

    /// The candidate terms.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// The phases in the order in which their foot rules are tried.
    pub fn phases(&self) -> &[Phase] {
        &self.phases
    }

    /// A phase's name as it appears in generated code.
    pub fn phase_identifier(&self, phase: usize) -> &Identifier {
        &self.phase_identifiers[phase]
    }

    /// Index of the first phase whose rule matches the feet.
    pub fn phase_for(&self, feet: ContactFlags) -> Option<usize> {
        self.phases
            .iter()
            .position(|phase| phase.feet.matches(feet))
    }

    /// Index of the phase with this name.
    pub fn phase_named(&self, name: &str) -> Option<usize> {
        self.phases.iter().position(|phase| phase.name == name)
    }

    /// Names and units of the state, if the file has them.
    pub fn state(&self) -> Option<&CoordinateNames> {
        self.state.as_ref()
    }

    /// Names and units of the input, if the file has them.
    pub fn input(&self) -> Option<&CoordinateNames> {
        self.input.as_ref()
    }

    /// The scale factors.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the model has none.
    pub fn scaling(&self) -> Result<&Scaling, ModelError> {
        self.require(
            &self.scaling,
            "scaling",
            "going between SI and scaled units",
        )
    }

    /// `s_x`, one factor a robot coordinate.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the model has no scaling, or neither encoder nor decoder.
    pub fn state_factors(&self) -> Result<DVector<f64>, ModelError> {
        Ok(self.scaling()?.state.expand(self.require_state_dim()?))
    }

    /// `s_u`, one factor an input coordinate.
    ///
    /// # Errors
    /// As [`ReducedModel::state_factors`].
    pub fn input_factors(&self) -> Result<DVector<f64>, ModelError> {
        Ok(self.scaling()?.input.expand(self.require_state_dim()?))
    }

    /// The robot whose coordinates the model speaks of.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the file names none.
    pub fn robot(&self) -> Result<&'static Robot, ModelError> {
        self.require(&self.robot, "robot", "kinematics and limits")
            .copied()
    }

    /// What the joints take of the motors' torques before they count as input; none if the model's
    /// inputs are the motors' torques.
    pub fn actuators(&self) -> Option<&Actuators> {
        self.actuators.as_ref()
    }

    /// Axes of the force and moment in the model's inputs.
    pub fn wrench_frame(&self) -> WrenchFrame {
        self.wrench_frame
    }

    /// How samples of the robot become the model's inputs: what everything that feeds recorded
    /// torques to the model, or makes commands of its inputs, goes by.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the file names no robot.
    pub fn input_rule(&self) -> Result<InputRule, ModelError> {
        let robot = self.robot()?;
        Ok(InputRule::new(
            robot,
            self.actuators.clone(),
            self.wrench_frame,
        ))
    }

    /// Sampling period of the recordings behind the model, s.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the file does not tell.
    pub fn sample_time_s(&self) -> Result<f64, ModelError> {
        self.require(&self.sample_time_s, "sample_time_s", "sampling")
            .copied()
    }

    /// Landmarks and prior of the training jumps.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the file has none.
    pub fn jump_prior(&self) -> Result<&JumpPrior, ModelError> {
        let purpose = "planning; `romc train` on jumps of one kind with a linear encoder makes it";
        self.require(&self.jump_prior, "prior", purpose)
    }

    /// Mean and covariance of the training inputs of one phase, SI units.
    ///
    /// # Errors
    /// [`ModelError::Missing`] if the file has none for the phase, [`ModelError::PhaseIndex`].
    pub fn input_statistics(&self, phase: usize) -> Result<&InputStatistics, ModelError> {
        self.phase(phase)?;
        self.require(
            &self.statistics[phase],
            "input_statistics",
            "weighing inputs in control; `romc import --inputs-from` takes it from recordings",
        )
    }

    /// Latent acceleration `ddz = Xi^T Theta(z, dz, u_lat)` of one phase, term by term in library
    /// order: the slow and plain evaluation which compiled programs are tested against.
    ///
    /// # Errors
    /// [`ModelError::PhaseIndex`], [`ModelError::Dimension`].
    pub fn ddz(
        &self,
        phase: usize,
        z: &DVector<f64>,
        dz: &DVector<f64>,
        u_lat: &DVector<f64>,
    ) -> Result<DVector<f64>, ModelError> {
        let xi = &self.phase(phase)?.xi;
        let theta = self.library.evaluate(z, dz, u_lat)?;
        Ok(DVector::from_fn(self.latent_dim(), |output, _| {
            let mut sum = 0.0;
            for (&coefficient, &value) in xi.column(output).iter().zip(theta.iter()) {
                if coefficient != 0.0 {
                    sum += coefficient * value;
                }
            }
            sum
        }))
    }

    /// Active terms of one output of a phase with their coefficients, in library order (the order
    /// in which the paper prints them).
    ///
    /// # Errors
    /// [`ModelError::PhaseIndex`]; [`ModelError::Dimension`] if `output` is not below `latent_dim`.
    pub fn active_terms(
        &self,
        phase: usize,
        output: usize,
    ) -> Result<Vec<(f64, &CandidateTerm)>, ModelError> {
        let phase = self.phase(phase)?;
        if output >= self.latent_dim() {
            return Err(ModelError::Dimension {
                what: "index of a latent coordinate",
                found: output,
                expected: self.latent_dim(),
            });
        }
        Ok(phase
            .active_terms(output)
            .map(|(term, coefficient)| (coefficient, self.library.term(term)))
            .collect())
    }

    /// The phase with this index.
    ///
    /// # Errors
    /// [`ModelError::PhaseIndex`].
    pub fn phase(&self, phase: usize) -> Result<&Phase, ModelError> {
        self.phases.get(phase).ok_or(ModelError::PhaseIndex {
            found: phase,
            count: self.phases.len(),
        })
    }

    fn require_state_dim(&self) -> Result<usize, ModelError> {
        let dim = self.state_dim();
        self.require(&dim, "encoder", "a vector in robot coordinates")
            .copied()
    }

    pub(super) fn require<'a, T>(
        &self,
        part: &'a Option<T>,
        name: &'static str,
        purpose: &'static str,
    ) -> Result<&'a T, ModelError> {
        part.as_ref().ok_or_else(|| ModelError::Missing {
            model: self.name.clone(),
            part: name,
            purpose,
        })
    }
}
