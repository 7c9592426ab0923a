//! Settings of the controller and their defaults.

use super::error::ControlError;
use super::qp::QpSettings;

/// How a latent input becomes joint torques, each way with its number for interfaces without enumerations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Lift {
    /// The paper's `u = W_eᵀ u_lat`: the torques are its leading entries, the body force that it
    /// holds as well need not be the one that these torques produce.
    Transpose = 0,
    /// The torques whose own ground reaction forces come closest to the latent input, within
    /// torque limits and the friction cones of the feet in contact; see
    /// [`ConsistentLift`](super::ConsistentLift).
    Consistent = 1,
}

/// About what trajectory the dynamics are linearised, numbered as [`Lift`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Linearisation {
    /// The reference: each stage is linearised once and reused while the horizon passes over it.
    Reference = 0,
    /// The last plan, shifted by one stage (real-time iteration).
    LastPlan = 1,
}

/// What stands for the dynamics of the reference itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Drift {
    /// The reference's own finite differences if it has an input, its own or an estimate, otherwise
    /// the model.
    Automatic,
    /// The reference's own finite differences: the model is trusted for deviations only.
    Reference,
    /// The model.
    Model,
}

/// What stands for the input of a reference that comes without one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MissingInput {
    /// What the model finds behind the reference's accelerations, see
    /// [`estimate`](super::estimate).
    Estimate,
    /// The mean training input of each phase: the optimisation has to find the rest.
    Mean,
}

/// Which constraint rows a stage carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RowSelection {
    /// Those that can become active, see [`StageRows::new`](super::problem::StageRows::new).
    Needed,
    /// All of them.
    All,
}

/// What solves the quadratic program of a step, numbered as [`Lift`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Solver {
    /// clarabel, for all rows and cones.
    Clarabel = 0,
    /// The structured [`solver`](crate::solver): Riccati's recursion where no row is active, else an
    /// interior point of it; for at most [`MAX_STRUCTURED_DIM`](super::MAX_STRUCTURED_DIM) latent
    /// coordinates, with friction pyramids inside the cones.
    Riccati = 1,
}

/// What the controller does while it has no plan to trust.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FallbackSettings {
    /// How many stages of the last good plan may be used after a failure.
    pub plan_stages: usize,
    /// Time constant with which the feed-forward torque of a hold decays, s.
    pub torque_decay_s: f64,
    /// Joint damping of a hold, N m s/rad, on measured joint velocities.
    pub damping_nm_s: f64,
    /// Deviation from the predicted latent state, in standard deviations of the reference, from
    /// which a measurement is not believed at first.
    pub jump_deviations: f64,
    /// How many steps in a row a measurement is disbelieved before it is taken for true.
    pub jump_patience: usize,
}

impl Default for FallbackSettings {
    fn default() -> Self {
        Self {
            plan_stages: 5,
            torque_decay_s: 0.05,
            damping_nm_s: 1.0,
            jump_deviations: 6.0,
            jump_patience: 3,
        }
    }
}

/// How the share of the input that arrives is estimated, and what the motors add to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effectiveness {
    /// Time constant with which what was learned fades, s.
    pub time_constant_s: f64,
    /// Stiffness of the joint PD that holds the commanded posture, N m/rad; 0 without one.
    pub stiffness_nm_rad: f64,
    /// Its damping, N m s/rad.
    pub damping_nm_s_rad: f64,
}

/// Settings of the controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MpcSettings {
    /// Stages of the horizon, `N`.
    pub horizon: usize,
    /// Duration of a stage, s; the input is held over it.
    pub step_s: f64,
    /// How torques are made from the latent input.
    pub lift: Lift,
    /// Weight `w_u` of the input deviation, measured by the inverse covariance of the training
    /// inputs. Along a recording it hardly matters; in closed loop (`examples/mujoco/closed_loop.py`)
    /// a weight of one follows errors of the model into a fall, a weight of hundreds is the reference
    /// input without feedback.
    pub input_weight: f64,
    /// Weight of velocities against positions, `w_v`. In closed loop small weights let a jump that is
    /// under-powered, by a payload or weak motors, end short; see `docs/control.md`.
    pub velocity_weight: f64,
    /// Factor on the state weights of the last stage.
    pub terminal_weight: f64,
    /// About what the dynamics are linearised.
    pub linearisation: Linearisation,
    /// What stands for the reference's own dynamics.
    pub drift: Drift,
    /// What stands for the reference's input if it has none.
    pub missing_input: MissingInput,
    /// Price of leaving the joint limits by their whole half range at one stage.
    pub joint_penalty: f64,
    /// Friction coefficient of the lifted body force in contact; none leaves it free.
    pub body_friction: Option<f64>,
    /// Friction coefficient of each foot in the consistent lift.
    pub foot_friction: f64,
    /// Weight of the consistent lift's prior against its reproduction of the latent input.
    pub lift_prior_weight: f64,
    /// Largest change of a plainly lifted torque, N m/s; none leaves it free. What the consistent lift
    /// makes of the same latent input is not limited.
    pub torque_rate_nm_s: Option<f64>,
    /// Estimates how much of the input arrives, and makes up for it; none trusts the motors.
    pub effectiveness: Option<Effectiveness>,
    /// Share of the body's error of pitch that the commanded legs are turned against in flight: 0 leaves
    /// them where the reference has them from the body, 1 where it has them from the ground.
    pub swing_turn: f64,
    /// Which rows of the constraints are kept.
    pub rows: RowSelection,
    /// What solves the program of a step, and that of the consistent lift.
    pub solver: Solver,
    /// The conic solver, and cap and accepted residual of the structured one.
    pub qp: QpSettings,
    /// What happens without a plan.
    pub fallback: FallbackSettings,
}

impl Default for MpcSettings {
    fn default() -> Self {
        Self {
            horizon: 20,
            step_s: 0.01,
            lift: Lift::Transpose,
            input_weight: 10.0,
            velocity_weight: 0.1,
            terminal_weight: 1.0,
            linearisation: Linearisation::Reference,
            drift: Drift::Automatic,
            missing_input: MissingInput::Estimate,
            joint_penalty: 100.0,
            body_friction: None,
            foot_friction: 0.6,
            lift_prior_weight: 1e-3,
            torque_rate_nm_s: None,
            effectiveness: None,
            swing_turn: 1.0,
            rows: RowSelection::Needed,
            solver: Solver::Clarabel,
            qp: QpSettings::default(),
            fallback: FallbackSettings::default(),
        }
    }
}

/// Longest horizon that is accepted.
pub const MAX_HORIZON: usize = 500;

impl MpcSettings {
    /// Checks every number.
    ///
    /// # Errors
    /// [`ControlError::Setting`] names the first one that is out of its range.
    pub fn check(&self) -> Result<(), ControlError> {
        let refused = |(name, found), expected| ControlError::Setting {
            name,
            found,
            expected,
        };
        if !(1..=MAX_HORIZON).contains(&self.horizon) {
            return Err(refused(("horizon", self.horizon as f64), "1 to 500 stages"));
        }
        // Where there is none, numbers that pass the checks and are used for nothing else.
        let effectiveness = self.effectiveness.unwrap_or(Effectiveness {
            time_constant_s: 1.0,
            stiffness_nm_rad: 0.0,
            damping_nm_s_rad: 0.0,
        });
        let positive = [
            ("step_s", self.step_s),
            ("input_weight", self.input_weight),
            ("velocity_weight", self.velocity_weight),
            ("terminal_weight", self.terminal_weight),
            ("joint_penalty", self.joint_penalty),
            ("foot_friction", self.foot_friction),
            ("lift_prior_weight", self.lift_prior_weight),
            ("body_friction", self.body_friction.unwrap_or(1.0)),
            ("torque_rate_nm_s", self.torque_rate_nm_s.unwrap_or(1.0)),
            ("effectiveness_time_s", effectiveness.time_constant_s),
            ("qp.tolerance", self.qp.tolerance),
            ("qp.accepted_residual", self.qp.accepted_residual),
            ("qp.max_iterations", f64::from(self.qp.max_iterations)),
            ("fallback.torque_decay_s", self.fallback.torque_decay_s),
            ("fallback.jump_deviations", self.fallback.jump_deviations),
        ];
        let not_negative = [
            ("fallback.damping_nm_s", self.fallback.damping_nm_s),
            ("swing_turn", self.swing_turn),
            ("drive_stiffness_nm_rad", effectiveness.stiffness_nm_rad),
            ("drive_damping_nm_s_rad", effectiveness.damping_nm_s_rad),
        ];
        let is_positive = |found: f64| found.is_finite() && found > 0.0;
        if let Some(wrong) = positive.into_iter().find(|(_, found)| !is_positive(*found)) {
            return Err(refused(wrong, "a positive number"));
        }
        let is_allowed = |found: f64| found == 0.0 || is_positive(found);
        match not_negative
            .into_iter()
            .find(|(_, found)| !is_allowed(*found))
        {
            Some(wrong) => Err(refused(wrong, "zero or a positive number")),
            None => Ok(()),
        }
    }
}
