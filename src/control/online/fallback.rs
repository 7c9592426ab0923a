//! Commands of a step without a trusted plan.
//!
//! First the last good plan, shifted, for as many stages as the settings allow; then a hold: the posture stays, the
//! feed-forward torque fades, the joints are damped.

use super::command::{Command, Source, Status};
use super::controller::Controller;
use super::lift::StanceState;
use crate::robot::JOINT_DIM;

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
    /// Time of the last command.
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

    /// Posture held, torque fading, joints damped.
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
