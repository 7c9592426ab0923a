//! The hybrid reduced-order model.
//!
//! Robot state `x` and generalised input `u = [tau; F_lin; F_ang]` are in SI units; `z`, `dz` and `u_lat` in scaled
//! units. With the scale factors `s_x`, `s_u` (scaled = factor times SI):
//!
//! - `z = W_e (s_x x) + b_e`, `dz = W_e (s_x dx)`: the bias is added to positions, not to velocities;
//! - `x = (W_d z + b_d) / s_x`, `dx = (W_d dz) / s_x`;
//! - `u_lat = pinv(W_e^T) (s_u u)` (project), `u = (W_e^T u_lat) / s_u` (lift);
//! - `ddz = Xi^T Theta(z, dz, u_lat)` with the Xi of the phase that the feet select.
//!
//! `project(lift(u_lat)) == u_lat`, because an encoder has full row rank; the reverse does not hold. `maps.rs` has the
//! equations of nonlinear maps. A function that needs a part which the model lacks returns [`ModelError::Missing`].

use super::*;

/// One dynamics regime: `ddz = Xi^T Theta(z, dz, u_lat)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Phase {
    pub name: String,
    pub feet: FeetRule,
    /// Coefficients, `library_dim x latent_dim`, in scaled units.
    #[serde(with = "listed")]
    pub xi: DMatrix<f64>,
}

impl Phase {
    pub fn active_count(&self) -> usize {
        self.xi.iter().filter(|&&value| value != 0.0).count()
    }

    /// Indices of the active terms of one output, the rows of Xi, with their coefficients, in library order.
    pub fn active_terms(&self, output: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let coefficients = self.xi.column(output).into_iter().copied();
        (coefficients.enumerate()).filter(|&(_, value)| value != 0.0)
    }
}

/// Index of the first phase whose rule matches the feet.
pub(super) fn selected(phases: &[Phase], feet: ContactFlags) -> Option<usize> {
    phases.iter().position(|phase| phase.feet.matches(feet))
}

/// A checked reduced-order model; made by [`ReducedModel::builder`] or read from a model file.
#[derive(Clone, Debug, PartialEq)]
pub struct ReducedModel {
    /// As given, statistics in the order of the phases.
    pub(crate) parts: ModelBuilder,
    pub(super) identifier: Identifier,
    pub(super) phase_identifiers: Vec<Identifier>,
    /// `pinv(W_e^T)`, `latent_dim x input_dim`; there when the encoder is, and is linear.
    pub(super) input_projection: Option<DMatrix<f64>>,
}

impl ReducedModel {
    pub fn builder(name: impl Into<String>, library: Library) -> ModelBuilder {
        ModelBuilder::new(name.into(), library)
    }

    /// Converts the model to a builder for a change; `build` checks the result again.
    pub fn into_builder(self) -> ModelBuilder {
        self.parts
    }

    pub fn name(&self) -> &str {
        &self.parts.name
    }

    pub fn identifier(&self) -> &Identifier {
        &self.identifier
    }

    /// Free text about the model; may hold any printable character, so never paste it into code.
    pub fn description(&self) -> &str {
        &self.parts.description
    }

    /// Where the model comes from: free JSON.
    pub fn provenance(&self) -> &Map<String, Value> {
        &self.parts.provenance
    }

    pub fn latent_dim(&self) -> usize {
        self.parts.library.latent_dim()
    }

    /// Number of robot coordinates, `n`; `None` for a latent-only model.
    pub fn state_dim(&self) -> Option<usize> {
        self.parts.state_dim()
    }

    pub fn library(&self) -> &Library {
        &self.parts.library
    }

    pub fn phases(&self) -> &[Phase] {
        &self.parts.phases
    }

    pub fn phase_identifier(&self, phase: usize) -> &Identifier {
        &self.phase_identifiers[phase]
    }

    /// Index of the first phase whose rule matches the feet.
    pub fn phase_for(&self, feet: ContactFlags) -> Option<usize> {
        selected(&self.parts.phases, feet)
    }

    pub fn state(&self) -> Option<&CoordinateNames> {
        self.parts.state.as_ref()
    }

    pub fn input(&self) -> Option<&CoordinateNames> {
        self.parts.input.as_ref()
    }

    pub fn scaling(&self) -> Result<&Scaling> {
        let purpose = "going between SI and scaled units";
        self.require(self.parts.scaling.as_ref(), "scaling", purpose)
    }

    pub fn state_factors(&self) -> Result<DVector<f64>> {
        Ok(self.scaling()?.state.expand(self.require_state_dim()?))
    }

    pub fn input_factors(&self) -> Result<DVector<f64>> {
        Ok(self.scaling()?.input.expand(self.require_state_dim()?))
    }

    pub fn robot(&self) -> Result<&'static Robot> {
        self.require(self.parts.robot, "robot", "kinematics and limits")
    }

    /// Losses of the joints, subtracted from the motors' torques; none if these are the model's inputs.
    pub fn actuators(&self) -> Option<&Actuators> {
        self.parts.actuators.as_ref()
    }

    pub fn wrench_frame(&self) -> WrenchFrame {
        self.parts.wrench_frame
    }

    /// How samples of the robot become the model's inputs, and its inputs commands.
    pub fn input_rule(&self) -> Result<InputRule> {
        let (robot, actuators) = (self.robot()?, self.parts.actuators.clone());
        Ok(InputRule::new(robot, actuators, self.parts.wrench_frame))
    }

    pub fn sample_time_s(&self) -> Result<f64> {
        self.require(self.parts.sample_time_s, "sample_time_s", "sampling")
    }

    pub fn jump_prior(&self) -> Result<&JumpPrior> {
        let purpose = "planning; `romc train` on jumps of one kind with a linear encoder makes it";
        self.require(self.parts.jump_prior.as_ref(), "prior", purpose)
    }

    pub fn stride_prior(&self) -> Result<&StridePrior> {
        let purpose = "planning of walks; `romc train --phases trot` makes them";
        self.require(self.parts.stride_prior.as_ref(), "strides", purpose)
    }

    /// Mean and covariance of the training inputs of one phase, SI units.
    pub fn input_statistics(&self, phase: usize) -> Result<&InputStatistics> {
        let phase = &self.phase(phase)?.name;
        let mut statistics = self.parts.statistics.iter();
        let found = statistics.find_map(|(name, found)| (name == phase).then_some(found));
        let purpose =
            "weighing inputs in control; `romc import --inputs-from` computes it from recordings";
        self.require(found, "input_statistics", purpose)
    }

    /// `Xi^T Theta(z, dz, u_lat)`, term by term: the slow evaluation that compiled programs are tested against.
    pub fn ddz(
        &self,
        phase: usize,
        z: &DVector<f64>,
        dz: &DVector<f64>,
        u_lat: &DVector<f64>,
    ) -> Result<DVector<f64>> {
        let phase = self.phase(phase)?;
        let theta = self.parts.library.evaluate(z, dz, u_lat)?;
        Ok(DVector::from_fn(self.latent_dim(), |output, _| {
            let terms = phase.active_terms(output);
            terms.fold(0.0, |sum, (term, coefficient)| {
                sum + coefficient * theta[term]
            })
        }))
    }

    /// In library order, in which the paper prints them.
    pub fn active_terms(&self, phase: usize, output: usize) -> Result<Vec<(f64, &CandidateTerm)>> {
        let (phase, dim) = (self.phase(phase)?, self.latent_dim());
        let place = "index of a latent coordinate";
        check(output < dim, place, || output, format!("below {dim}"))?;
        let terms = phase.active_terms(output);
        Ok(terms
            .map(|(term, coefficient)| (coefficient, &self.library().terms()[term]))
            .collect())
    }

    pub(crate) fn phase(&self, phase: usize) -> Result<&Phase> {
        self.phases().get(phase).ok_or(ModelError::PhaseIndex {
            found: phase,
            count: self.phases().len(),
        })
    }

    fn require_state_dim(&self) -> Result<usize> {
        let purpose = "a vector in robot coordinates";
        self.require(self.state_dim(), "encoder", purpose)
    }

    pub(super) fn require<T>(
        &self,
        part: Option<T>,
        name: &'static str,
        purpose: &'static str,
    ) -> Result<T> {
        part.ok_or_else(|| ModelError::Missing {
            model: self.parts.name.clone(),
            part: name,
            purpose,
        })
    }
}
