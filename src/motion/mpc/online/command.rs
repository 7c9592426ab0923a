//! The result of a control step.

use crate::robot::JOINT_DIM;

/// How a control step ended, each with its number for interfaces without enumerations: zero solved, positive a
/// fallback or a changed problem, negative refused input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Status {
    /// A plan whose optimality conditions were checked.
    Solved = 0,
    /// The same, but the plan leaves the joint limits somewhere: they cannot be kept from here.
    Softened = 1,
    /// The same, on a contact schedule that was changed: the feet are already in the phase that the
    /// reference enters later.
    ContactEarly = 2,
    /// The same: the feet are still in the phase that the reference has left.
    ContactLate = 3,
    /// The same: the feet are in a phase that the model does not have, where the reference's was used,
    /// or that the reference is not near, where it was used for the first stage.
    ContactUnknown = 4,
    /// The solver's point fails the optimality conditions.
    Inaccurate = 10,
    /// The constraints contradict each other.
    Infeasible = 11,
    /// The solver reached its iteration cap.
    IterationCap = 12,
    /// The solver broke down, or the linearisation is not finite.
    NumericalFailure = 13,
    /// The measurement is far from what the last plan predicts and is not believed yet.
    MeasurementJump = 14,
    /// No torques could be made from the latent input: a leg in contact is singular, or the lift's
    /// own program failed.
    LiftFailed = 15,
    /// A measurement, or the time, is infinite or not a number.
    NotFinite = -1,
    /// A measurement has the wrong number of values.
    WrongDimension = -2,
    /// No reference has been set.
    NoReference = -3,
}

impl Status {
    /// Every status.
    pub const ALL: [Status; 14] = [
        Status::Solved,
        Status::Softened,
        Status::ContactEarly,
        Status::ContactLate,
        Status::ContactUnknown,
        Status::Inaccurate,
        Status::Infeasible,
        Status::IterationCap,
        Status::NumericalFailure,
        Status::MeasurementJump,
        Status::LiftFailed,
        Status::NotFinite,
        Status::WrongDimension,
        Status::NoReference,
    ];

    /// Whether the command comes from this step's own plan.
    pub fn has_plan(self) -> bool {
        match self {
            Status::Solved
            | Status::Softened
            | Status::ContactEarly
            | Status::ContactLate
            | Status::ContactUnknown => true,
            Status::Inaccurate
            | Status::Infeasible
            | Status::IterationCap
            | Status::NumericalFailure
            | Status::MeasurementJump
            | Status::LiftFailed
            | Status::NotFinite
            | Status::WrongDimension
            | Status::NoReference => false,
        }
    }

    /// The status as a number.
    pub fn code(self) -> i32 {
        self as i32
    }

    /// The status in one word, as tables have it.
    pub fn word(self) -> &'static str {
        match self {
            Status::Solved => "solved",
            Status::Softened => "softened",
            Status::ContactEarly => "contact_early",
            Status::ContactLate => "contact_late",
            Status::ContactUnknown => "contact_unknown",
            Status::Inaccurate => "inaccurate",
            Status::Infeasible => "infeasible",
            Status::IterationCap => "iteration_cap",
            Status::NumericalFailure => "numerical_failure",
            Status::MeasurementJump => "measurement_jump",
            Status::LiftFailed => "lift_failed",
            Status::NotFinite => "not_finite",
            Status::WrongDimension => "wrong_dimension",
            Status::NoReference => "no_reference",
        }
    }
}

/// Where a command's numbers come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Source {
    /// This step's plan.
    Plan,
    /// The last good plan, shifted to now.
    ShiftedPlan,
    /// No plan: posture held, feed-forward torque fading, joints damped.
    Hold,
}

impl Source {
    /// The source in one word, as tables have it.
    pub fn word(self) -> &'static str {
        match self {
            Source::Plan => "plan",
            Source::ShiftedPlan => "shifted_plan",
            Source::Hold => "hold",
        }
    }
}

/// What a robot's low-level interface takes, and how it came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// Feed-forward torques, N m, within the robot's limits whatever happened.
    pub torque_nm: [f64; JOINT_DIM],
    /// What the planned motion takes of the torques in the joints, N m: `torque_nm` less this reaches the
    /// links. Zero in a hold and for a model without actuators.
    pub losses_nm: [f64; JOINT_DIM],
    /// Desired joint positions, rad, within the robot's limits: the decoded reference at 0.9 of the
    /// stage. The plan begins at the measurement, so its own posture would leave a joint PD
    /// nothing to correct.
    pub joint_position_rad: [f64; JOINT_DIM],
    /// Desired joint velocities, rad/s.
    pub joint_velocity_rad_s: [f64; JOINT_DIM],
    /// Latent input behind the torques, `latent_dim`.
    pub u_lat: Vec<f64>,
    /// How the step ended.
    pub status: Status,
    /// Where the numbers come from.
    pub source: Source,
    /// Phase that the first stage was planned in, if there was a plan.
    pub phase: Option<usize>,
    /// Interior-point iterations.
    pub iterations: u32,
    /// Wall time of the step from measurement to command, µs.
    pub solve_us: f64,
    /// Largest violation of a joint limit in the plan, in half ranges of the joint.
    pub slack: f64,
    /// `|F_lift − G τ| / |F_lift|`: how far the force that the latent input was lifted to is from
    /// the force that the commanded torques produce after the losses; none in flight or without a lifted force.
    pub inconsistency: Option<f64>,
}

impl Command {
    /// The torques that reach the links, N m.
    pub fn net_torque_nm(&self) -> [f64; JOINT_DIM] {
        std::array::from_fn(|joint| self.torque_nm[joint] - self.losses_nm[joint])
    }

    /// A command of zeros, to be filled by [`Controller::step_into`](super::Controller::step_into).
    pub fn zeros(latent_dim: usize) -> Self {
        Self {
            torque_nm: [0.0; JOINT_DIM],
            losses_nm: [0.0; JOINT_DIM],
            joint_position_rad: [0.0; JOINT_DIM],
            joint_velocity_rad_s: [0.0; JOINT_DIM],
            u_lat: vec![0.0; latent_dim],
            status: Status::NoReference,
            source: Source::Hold,
            phase: None,
            iterations: 0,
            solve_us: 0.0,
            slack: 0.0,
            inconsistency: None,
        }
    }
}
