//! The result of a control step, also of a step without a trusted plan. Such a step uses the last good plan, shifted,
//! for as many stages as the settings allow. After that the posture is held, the torques fade and the joints are
//! damped. [`Memory`] is translated to C.

use super::control_model::{clamped_joint, clamped_torque};
use super::controller::Controller;
use super::dense::{Real, first_undefined};
use super::settings::{AfterEnd, Drives, FallbackSettings, Legs};
use super::supervisor::Fault;
use crate::robot::JOINT_DIM;

/// Largest number of a measurement, SI: beyond it none is real, and a solver would iterate in vain.
const LARGEST_MEASURED: Real = 1e6;

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
    Standing = 5, "standing", "standing: the state machine moves the joints to the start, or holds them there";
    Inaccurate = 10, "inaccurate",
        "inaccurate: the solver's point fails the optimality conditions; fallback";
    Infeasible = 11, "infeasible", "infeasible: the constraints contradict each other; fallback";
    IterationCap = 12, "iteration_cap", "iteration cap: the solver reached its deadline; fallback";
    NumericalFailure = 13, "numerical_failure",
        "numerical failure: the solver broke down; fallback";
    MeasurementJump = 14, "measurement_jump",
        "measurement jump: a measurement far from the prediction; fallback";
    LiftFailed = 15, "lift_failed", "lift failed: no torques for the latent input; fallback";
    Ended = 16, "ended", "ended: the reference is over; torques fade as the settings define";
    Damped = 17, "damped", "damped: joints are damped, as requested or before a start";
    Tilt = 20, "tilt", "tilt: roll or pitch far from the reference's, or near upside down; damping until reset";
    JointBeyond = 21, "joint_beyond", "joint beyond: a joint beyond its limits; damping until reset";
    JointSpeed = 22, "joint_speed", "joint speed: a joint faster than it can be; damping until reset";
    BodyFar = 23, "body_far", "body far: the body is far from the reference; damping until reset";
    JointsFar = 24, "joints_far", "joints far: a joint is far from the reference; damping until reset";
    BodyLeap = 25, "body_leap",
        "body leap: the body is not where its last measurement leads; damping until reset";
    JointsLeap = 26, "joints_leap",
        "joints leap: a joint is not where its last measurement leads; damping until reset";
    NotAtStart = 27, "not_at_start",
        "not at start: the first measurement is far from the reference; damping until reset";
    ClockStands = 28, "clock_stands", "clock stands: times do not increase; damping until reset";
    ClockBack = 29, "clock_back", "clock back: a time before the last one; damping until reset";
    ClockLeaps = 30, "clock_leaps", "clock leaps: too long since the last time; damping until reset";
    Frozen = 31, "frozen", "frozen: the measurement of a moving robot stays the same; damping until reset";
    VelocityMismatch = 32, "velocity_mismatch",
        "velocity mismatch: the body's velocity contradicts its positions; damping until reset";
    ContactMismatch = 33, "contact_mismatch",
        "contact mismatch: heights of feet or the fall contradict the contacts; damping until reset";
    PoorSteps = 34, "poor_steps", "poor steps: too many steps without a good plan; damping until reset";
    NotFinite = -1, "not_finite",
        "not finite: a number is infinite, not a number or beyond 1e6; fallback";
    WrongDimension = -2, "wrong_dimension",
        "wrong dimension: the wrong number of values or too few samples; fallback";
    NoReference = -3, "no_reference", "no reference: none has been set; fallback";
}

impl Status {
    /// Whether the command comes from this step's own plan.
    pub fn has_plan(self) -> bool {
        (Self::Solved.code()..Self::Inaccurate.code()).contains(&self.code())
    }

    /// Whether the step has no plan, or with decoded legs a plan for unknown contacts. A walk with the reference's legs
    /// often has unknown contacts between two phases. Refused jumps of measurements are counted separately.
    fn is_poor(self, legs: Legs) -> bool {
        let is_lost = self == Self::ContactUnknown && legs == Legs::Decoded;
        let is_poor = !self.has_plan() || is_lost;
        is_poor && self != Self::MeasurementJump && self != Self::Ended
    }

    /// The status of a fault.
    pub(super) fn of(fault: Fault) -> Option<Self> {
        let code = Self::Tilt.code() - 1 + fault as i32;
        (Self::ALL.iter().copied()).find(|status| fault != Fault::None && status.code() == code)
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
    /// No plan: the posture of the state machine's stand, with the torques that carry the weight.
    Stand,
    /// The motion was left: torques and joint PD fade into joint damping.
    Damping,
}

impl Source {
    /// The source in one word, as tables have it.
    pub fn word(self) -> &'static str {
        match self {
            Source::Plan => "plan",
            Source::ShiftedPlan => "shifted_plan",
            Source::Hold => "hold",
            Source::Stand => "stand",
            Source::Damping => "damping",
        }
    }
}

/// A command for the low-level interface of a robot, with its status and source.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// Feed-forward torques, N m, always within the robot's limits.
    pub torque_nm: [f64; JOINT_DIM],
    /// Joint losses of the plan, N m: the links receive `torque_nm` minus these. Zero in a hold or without actuators.
    pub losses_nm: [f64; JOINT_DIM],
    /// Desired joint positions, rad, within the robot's limits: the decoded reference at 0.9 of the stage. The plan
    /// begins at the measurement, so its own posture would leave a joint PD nothing to correct.
    pub joint_position_rad: [f64; JOINT_DIM],
    /// Desired joint velocities, rad/s.
    pub joint_velocity_rad_s: [f64; JOINT_DIM],
    /// Gains of the joint PD on both.
    pub drives: Drives,
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
    /// `|F_lift − G τ| / |F_lift|`: the relative difference between two body forces. `F_lift` is the lifted latent
    /// input, `G τ` the force of the commanded torques after losses. None in flight or without a lifted force.
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
            drives: Drives {
                stiffness_nm_rad: 0.0,
                damping_nm_s_rad: 0.0,
            },
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

/// Controller state between steps.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Memory {
    /// Joint velocities of the present measurement, rad/s; zero if it was refused.
    pub joint_velocity: [Real; 12],
    /// Feed-forward part of the last torques, N m, without a hold's damping.
    pub feed_forward_nm: [Real; 12],
    /// Joint positions of the last plan, or those to hold, rad, if there are any.
    pub joint_position: [Real; 12],
    pub has_position: bool,
    /// Time of the last command, s, if there was one.
    pub command_s: f64,
    pub has_command: bool,
    /// Refused measurements in a row.
    pub disbelieved: usize,
}

impl Memory {
    /// Stores the joint velocities of a measurement if all its numbers are finite and plausible; returns whether they
    /// are.
    pub(super) fn accepts(&mut self, time_s: f64, x: &[Real], dx: &[Real]) -> bool {
        let mut is_accepted = time_s.is_finite();
        for i in 0..18 {
            is_accepted =
                is_accepted && x[i].abs() <= LARGEST_MEASURED && dx[i].abs() <= LARGEST_MEASURED;
        }
        for i in 0..12 {
            self.joint_velocity[i] = if is_accepted { dx[i] } else { 0.0 };
        }
        is_accepted
    }

    /// Whether a measurement is not believed: it jumps, and few did before. Its velocities must not become torques.
    pub(super) fn refuses(&mut self, is_jump: bool, patience: usize) -> bool {
        if !is_jump || self.disbelieved >= patience {
            self.disbelieved = 0;
            return false;
        }
        self.disbelieved += 1;
        self.joint_velocity = [0.0; 12];
        true
    }

    /// Stores the commanded joint positions (rad), clamped to the joint limits.
    pub(super) fn keep_posture(&mut self, joints: &[Real], lower: &[Real], upper: &[Real]) {
        for i in 0..12 {
            self.joint_position[i] = clamped_joint(joints[i], lower[i], upper[i]);
        }
        self.has_position = true;
    }

    /// Stores a share of the commanded torques (N m), within the motors' limits.
    pub(super) fn keep_torque(&mut self, torque: &[Real], share: Real, limit: &[Real]) {
        for i in 0..12 {
            self.feed_forward_nm[i] = clamped_torque(share * torque[i], limit[i]);
        }
    }

    /// Keeps the time of a command and awaits the next measurement.
    pub(super) fn keep_time(&mut self, time_s: f64, step_s: f64) {
        self.command_s = self.now_s(time_s, step_s);
        self.has_command = self.command_s.is_finite();
        self.joint_velocity = [0.0; 12];
    }

    /// A time, or where it is not known that of the last command, if there was one, and one stage.
    pub(super) fn now_s(&self, time_s: f64, step_s: f64) -> f64 {
        let next_s = self.command_s + step_s;
        let is_known = time_s.is_finite() || !self.has_command;
        if is_known { time_s } else { next_s }
    }

    /// Time since the last command, at most one stage, and one stage where it is not known or the clock stands still.
    pub(super) fn since_command(&self, time_s: f64, step_s: f64) -> f64 {
        let passed_s = time_s - self.command_s;
        let is_known = self.has_command && passed_s > 0.0 && passed_s <= step_s;
        if is_known { passed_s } else { step_s }
    }

    /// Writes a hold: the last posture, or the middle of the joint ranges if there is none, and fading torques with
    /// damping.
    pub(super) fn hold(
        &mut self,
        fallback: &FallbackSettings,
        time_s: f64,
        step_s: f64,
        limit: &[Real],
        lower: &[Real],
        upper: &[Real],
        torque: &mut [Real],
        joints: &mut [Real],
    ) {
        let fade = (-(self.since_command(time_s, step_s) as Real) / fallback.torque_decay_s).exp();
        for i in 0..12 {
            self.feed_forward_nm[i] *= fade;
            let damping = fallback.damping_nm_s * self.joint_velocity[i];
            torque[i] = clamped_torque(self.feed_forward_nm[i] - damping, limit[i]);
            let kept = self.joint_position[i];
            let middle = 0.5 * (lower[i] + upper[i]);
            joints[i] = if self.has_position { kept } else { middle };
        }
    }
}

impl Controller {
    pub(super) fn fall_back(&mut self, time_s: f64, command: &mut Command) {
        let step_s = self.settings.step_s;
        let now_s = self.memory.now_s(time_s, step_s);
        let stages = (self.settings.fallback.plan_stages).min(self.settings.horizon);
        let stage = self.plan.time.stage_at(now_s, stages);
        if stage < stages && self.write_plan(stage, now_s, command) {
            command.source = Source::ShiftedPlan;
            return;
        }
        let [lower, upper] = self.plant.joint_limits();
        if let Some(reference) = &self.reference
            && now_s.is_finite()
            && !self.memory.has_position
        {
            reference.state_at(now_s, &mut self.posture);
            let (z, _) = self.posture.split_at(self.plant.latent_dim());
            let joints = self.plant.decode_joints(z);
            self.memory.keep_posture(&joints, &lower, &upper);
        }
        let (fallback, robot) = (&self.settings.fallback, self.plant.robot());
        let limit = robot.torque_limit_nm();
        let (torque, joints) = (&mut command.torque_nm, &mut command.joint_position_rad);
        (self.memory).hold(
            fallback, time_s, step_s, limit, &lower, &upper, torque, joints,
        );
        command.losses_nm = [0.0; JOINT_DIM];
        command.joint_velocity_rad_s = [0.0; JOINT_DIM];
        command.u_lat.fill(0.0);
        command.source = Source::Hold;
    }

    /// Counts poor steps; the status that stays.
    pub(super) fn judged(&mut self, status: Status, time_s: f64) -> Status {
        let settings = &self.settings;
        let is_poor = self.reference.is_some() && status.is_poor(settings.legs);
        let passed_s = self.memory.since_command(time_s, settings.step_s);
        let fault = self.supervisor.judge(&settings.bounds, is_poor, passed_s);
        Status::of(fault).unwrap_or(status)
    }

    /// Leaves the motion: torques and joint PD fade into damping, about the measured joints if there are any.
    pub(super) fn damp(&mut self, time_s: f64, x: &[f64], command: &mut Command) {
        let (bounds, stops) = (
            &self.settings.bounds,
            self.settings.after_end == AfterEnd::Stop,
        );
        let is_ended = self.supervisor.fault == Fault::None;
        let damping = match is_ended && stops {
            true => 0.0,
            false => bounds.damping_nm_s_rad,
        };
        let [lower, upper] = self.plant.joint_limits();
        let memory = &mut self.memory;
        let joints = match x.first_chunk::<JOINT_DIM>() {
            Some(joints) if first_undefined(joints, JOINT_DIM) == JOINT_DIM => *joints,
            _ => memory.joint_position,
        };
        if !memory.has_position {
            memory.keep_posture(&joints, &lower, &upper);
        }
        if self.supervisor.fault == Fault::Frozen {
            memory.joint_velocity = [0.0; JOINT_DIM];
        }
        let passed_s = memory.since_command(time_s, self.settings.step_s);
        let share = self.supervisor.fade(
            bounds,
            damping,
            passed_s,
            &joints,
            &memory.joint_velocity,
            self.plant.robot().torque_limit_nm(),
            &lower,
            &upper,
            &memory.feed_forward_nm,
            &memory.joint_position,
            &mut command.torque_nm,
            &mut command.joint_position_rad,
        );
        if share == 0.0 {
            // Measurements without joints find the last ones here.
            memory.keep_posture(&joints, &lower, &upper);
        }
        command.drives.stiffness_nm_rad *= share;
        command.drives.damping_nm_s_rad *= share;
        command.losses_nm = [0.0; JOINT_DIM];
        command.joint_velocity_rad_s = [0.0; JOINT_DIM];
        command.u_lat.fill(0.0);
        command.source = Source::Damping;
    }
}
