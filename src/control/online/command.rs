//! The result of a control step, and that of one without a trusted plan: first the last good plan, shifted, for as many
//! stages as the settings allow; then a hold, in which the posture stays, the torque fades, the joints are damped.

use super::controller::Controller;
use super::lift::StanceState;
use crate::robot::JOINT_DIM;

/// Makes [`Status`] of a table: code, word, and text that begins with the word.
macro_rules! statuses {
    ($($name:ident = $code:literal, $word:literal, $text:literal;)*) => {
        /// How a control step ended, each with its number for interfaces without enumerations: zero solved, positive a
        /// fallback or a changed problem, negative refused input.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Status {
            $(#[doc = $text] $name = $code,)*
        }

        impl Status {
            /// Every status.
            pub const ALL: &[Self] = &[$(Self::$name),*];

            /// The status in one word, as tables have it.
            pub fn word(self) -> &'static str {
                match self {
                    $(Self::$name => $word,)*
                }
            }

            /// The status in words, with a final nul.
            pub(super) fn text(self) -> &'static str {
                match self {
                    $(Self::$name => concat!($text, "\0"),)*
                }
            }
        }
    };
}

statuses! {
    Solved = 0, "solved", "solved: a plan whose optimality conditions were checked";
    Softened = 1, "softened", "softened: a checked plan that leaves the joint limits somewhere";
    ContactEarly = 2, "contact_early",
        "contact early: a checked plan, the feet are in the reference's next phase";
    ContactLate = 3, "contact_late",
        "contact late: a checked plan, the feet are in the reference's last phase";
    ContactUnknown = 4, "contact_unknown",
        "contact unknown: a checked plan, the feet are in no phase of the model or in one far from the reference";
    Inaccurate = 10, "inaccurate",
        "inaccurate: the solver's point fails the optimality conditions; fallback";
    Infeasible = 11, "infeasible", "infeasible: the constraints contradict each other; fallback";
    IterationCap = 12, "iteration_cap", "iteration cap: the solver reached its deadline; fallback";
    NumericalFailure = 13, "numerical_failure",
        "numerical failure: the solver broke down; fallback";
    MeasurementJump = 14, "measurement_jump",
        "measurement jump: a measurement far from the prediction; fallback";
    LiftFailed = 15, "lift_failed", "lift failed: no torques for the latent input; fallback";
    NotFinite = -1, "not_finite",
        "not finite: a number is infinite or not a number; fallback";
    WrongDimension = -2, "wrong_dimension",
        "wrong dimension: the wrong number of values or too few samples; fallback";
    NoReference = -3, "no_reference", "no reference: none has been set; fallback";
}

impl Status {
    /// Whether the command comes from this step's own plan.
    pub fn has_plan(self) -> bool {
        (Self::Solved.code()..Self::Inaccurate.code()).contains(&self.code())
    }

    /// The status as a number.
    pub fn code(self) -> i32 {
        self as i32
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
    /// Joint losses of the plan, N m: `torque_nm` less them reaches the links; zero in a hold or without actuators.
    pub losses_nm: [f64; JOINT_DIM],
    /// Desired joint positions, rad, within the robot's limits: the decoded reference at 0.9 of the stage. The plan
    /// begins at the measurement, so its own posture would leave a joint PD nothing to correct.
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
    /// `|F_lift − G τ| / |F_lift|`: how far the force that the latent input was lifted to is from the force that the
    /// commanded torques produce after the losses; none in flight or without a lifted force.
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

#[derive(Debug, Clone, Default)]
pub(super) struct Memory {
    pub measured: Vec<f64>,
    pub input: Vec<f64>,
    pub stance: Option<StanceState>,
    pub joint_velocity: [f64; JOINT_DIM],
    /// Feed-forward part of the last torques, without a hold's damping.
    pub feed_forward_nm: [f64; JOINT_DIM],
    /// Posture of the last plan, or the one to hold.
    pub joint_position: Option<[f64; JOINT_DIM]>,
    pub command_s: Option<f64>,
    /// Measurements in a row that were not believed.
    pub disbelieved: usize,
}

impl Memory {
    pub(super) fn new(latent_dim: usize) -> Self {
        Self {
            measured: vec![0.0; 2 * latent_dim],
            input: vec![0.0; latent_dim],
            ..Self::default()
        }
    }
}

impl Controller {
    pub(super) fn fall_back(&mut self, time_s: f64, command: &mut Command) {
        let now = self.time_or_one_stage_on(time_s);
        let stages = (self.settings.fallback.plan_stages).min(self.settings.horizon);
        let stage = now.and_then(|now| self.plan.stage_at(now));
        match stage.filter(|&stage| stage < stages) {
            Some(stage) if self.write_plan(stage, command) => command.source = Source::ShiftedPlan,
            Some(_) | None => self.hold(now, self.since_last_command(time_s), command),
        }
    }

    /// A time, or where it is not known that of the last command and one stage.
    pub(super) fn time_or_one_stage_on(&self, time_s: f64) -> Option<f64> {
        match time_s.is_finite() {
            true => Some(time_s),
            false => Some(self.memory.command_s? + self.settings.step_s),
        }
    }

    /// Time since the last command, at most one stage, and one stage where it is not known or the clock stands still.
    fn since_last_command(&self, time_s: f64) -> f64 {
        let step_s = self.settings.step_s;
        let passed_s = (self.memory.command_s).map_or(step_s, |last_s| time_s - last_s);
        match passed_s > 0.0 && passed_s <= step_s {
            true => passed_s,
            false => step_s,
        }
    }

    fn hold(&mut self, now: Option<f64>, passed_s: f64, command: &mut Command) {
        let fallback = &self.settings.fallback;
        let fade = (-passed_s / fallback.torque_decay_s).exp();
        // Velocities of a measurement that was refused must not become torques.
        let damping = match command.status {
            Status::NotFinite | Status::WrongDimension | Status::MeasurementJump => 0.0,
            _ => fallback.damping_nm_s,
        };
        for torque in &mut self.memory.feed_forward_nm {
            *torque *= fade;
        }
        let torque = std::array::from_fn(|joint| {
            self.memory.feed_forward_nm[joint] - damping * self.memory.joint_velocity[joint]
        });
        command.torque_nm = self.plant.clamp_torque(torque);
        command.losses_nm = [0.0; JOINT_DIM];
        if self.memory.joint_position.is_none() {
            self.memory.joint_position = now.and_then(|now| self.reference_posture(now));
        }
        let middle = |(lower, upper): (f64, f64)| 0.5 * (lower + upper);
        command.joint_position_rad = match self.memory.joint_position {
            Some(position) => position,
            None => self.plant.robot().joint_limit_rad().map(middle),
        };
        command.joint_velocity_rad_s = [0.0; JOINT_DIM];
        command.u_lat.fill(0.0);
        command.source = Source::Hold;
    }

    fn reference_posture(&mut self, now: f64) -> Option<[f64; JOINT_DIM]> {
        let d = self.plant.latent_dim();
        let reference = self.reference.as_ref()?;
        reference.state_at(now, &mut self.memory.measured);
        let joints = self.plant.decode_joints(&self.memory.measured[..d]);
        Some(self.plant.clamp_joints(joints))
    }
}
