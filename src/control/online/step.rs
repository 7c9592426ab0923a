//! One step of the controller: a measurement screened, a plan solved for, a command made of it.

use nalgebra::SVector;

use super::command::{Command, Source, Status};
use super::controller::{Controller, Measurement, SOFTENED_FROM};
use super::lift::StanceState;
use super::stage::unscale;
use super::trajectory::NO_PHASE;
use crate::robot::{JOINT_DIM, STATE_DIM};
use crate::solver::Outcome;

/// Lifted force, N, below which its inconsistency means nothing.
const SMALL_FORCE_N: f64 = 1.0;

impl Controller {
    /// Screens a measurement and, if it can be believed, keeps it.
    pub(super) fn take(&mut self, measurement: &Measurement<'_>) -> Result<(), Status> {
        if measurement.x.len() != STATE_DIM || measurement.dx.len() != STATE_DIM {
            return Err(Status::WrongDimension);
        }
        let values = measurement.x.iter().chain(measurement.dx);
        if !measurement.time_s.is_finite() || values.into_iter().any(|value| !value.is_finite()) {
            return Err(Status::NotFinite);
        }
        self.memory.joint_velocity = std::array::from_fn(|joint| measurement.dx[joint]);
        let Some(reference) = &self.reference else {
            // Nothing to follow yet: the robot stays as it is.
            let measured = std::array::from_fn(|joint| measurement.x[joint]);
            (self.memory.joint_position).get_or_insert(self.plant.clamp_joints(measured));
            return Err(Status::NoReference);
        };
        let (z, dz) = self.memory.measured.split_at_mut(self.plant.latent_dim());
        self.plant.encode(measurement.x, z);
        let (x, dx) = (measurement.x, measurement.dx);
        self.plant.encode_velocity(x, dx, dz);
        let (measured, deviation) = (&self.memory.measured, reference.deviation());
        let innovation = (self.plan).normalised_innovation(measurement.time_s, measured, deviation);
        let fallback = &self.settings.fallback;
        let is_jump =
            |innovation: f64| innovation.is_nan() || innovation > fallback.jump_deviations;
        if innovation.is_some_and(is_jump) {
            self.memory.disbelieved += 1;
            if self.memory.disbelieved <= fallback.jump_patience {
                return Err(Status::MeasurementJump);
            }
        }
        self.memory.disbelieved = 0;
        if let Some(settings) = &self.settings.effectiveness {
            let d = self.plant.latent_dim();
            self.effectiveness.update(
                (&self.plant, &self.plan),
                settings,
                measurement,
                &self.memory.measured[d..],
                &reference.deviation()[d..],
            );
        }
        self.stand_at(measurement.x);
        Ok(())
    }

    pub(super) fn plan_step(
        &mut self,
        measurement: &Measurement<'_>,
        command: &mut Command,
    ) -> Status {
        let phase = self.plant.phase_for(measurement.feet).unwrap_or(NO_PHASE);
        let prepared = self.prepare_stages(measurement.time_s, phase);
        let (Some(contact), Some(reference)) = (prepared, &self.reference) else {
            return Status::NoReference;
        };
        let deviation = reference.deviation();
        let (measured, last_input) = (&self.memory.measured, &self.memory.input);
        let horizon = &mut self.horizon;
        horizon.begin((measured, deviation), last_input, &self.near_rows);
        let (outcome, iterations) = self.engine.solve(&horizon.programs, &horizon.start);
        command.iterations = iterations;
        match outcome {
            Outcome::Solved => {}
            Outcome::Inaccurate => return Status::Inaccurate,
            Outcome::Infeasible => return Status::Infeasible,
            Outcome::IterationCap => return Status::IterationCap,
            Outcome::Unbounded | Outcome::NumericalFailure => return Status::NumericalFailure,
        }
        let (plan, phase) = (&mut self.plan, horizon.stages[0].phase);
        plan.begin(measurement.time_s, phase, measured);
        for (k, stage) in horizon.stages.iter().enumerate() {
            let root = self.plant.phases()[stage.phase].latent_root.as_slice();
            let (input, end) = (&mut plan.inputs[k], &mut plan.states[k + 1]);
            let (v, x) = self.engine.stage(k);
            input.copy_from_slice(&stage.input);
            end.copy_from_slice(&stage.end);
            unscale(root, deviation, stage.input.len(), v, x, input, end);
        }
        let is_grounded = self.plant.phases()[phase].is_grounded;
        let first = &self.horizon.stages[0].model;
        self.effectiveness.begin(first, is_grounded);
        command.slack = self.largest_violation();
        self.memory.stance = Some(StanceState::at(measurement.x, measurement.feet, phase));
        if !self.write_plan(0, command) {
            return Status::LiftFailed;
        }
        command.source = Source::Plan;
        match contact {
            Status::Solved if command.slack > SOFTENED_FROM => Status::Softened,
            status => status,
        }
    }

    /// Largest violation of a joint limit at the ends of the plan's stages, in half ranges, whichever rows it has.
    fn largest_violation(&self) -> f64 {
        let d = self.plant.latent_dim();
        let limits = self.plant.robot().joint_limit_rad();
        let mut largest = 0.0_f64;
        for stage in 0..self.settings.horizon {
            let joints = self.plant.decode_joints(&self.plan.end(stage)[..d]);
            for (position, &(lower, upper)) in joints.iter().zip(limits) {
                let outside = (position - upper).max(lower - position);
                largest = largest.max(outside / (0.5 * (upper - lower)));
            }
        }
        largest
    }

    /// Writes a stage of the plan into the command; false if its input cannot be lifted.
    pub(super) fn write_plan(&mut self, stage: usize, command: &mut Command) -> bool {
        let (Some(reference), Some(stance), Some(time_s)) = (
            &self.reference,
            &mut self.memory.stance,
            self.plan.posture_s(stage),
        ) else {
            return false;
        };
        reference.state_at(time_s, &mut self.posture);
        let (z, dz) = self.posture.split_at(self.plant.latent_dim());
        command.u_lat.copy_from_slice(self.plan.input(stage));
        for input in &mut command.u_lat {
            *input /= self.effectiveness.share.estimate;
        }
        command.phase = Some(self.plan.phase);
        let mut joints = self.plant.decode_joints(z);
        let in_flight = !self.plant.phases()[self.plan.phase].is_grounded;
        if in_flight && self.settings.swing_turn > 0.0 {
            let error = stance.attitude_rad[1] - reference.attitude_at(time_s)[1];
            let turn_rad = self.settings.swing_turn * error;
            joints = self.plant.turned_legs(&joints, turn_rad);
        }
        command.joint_position_rad = self.plant.clamp_joints(joints);
        command.joint_velocity_rad_s = self.plant.decode_joint_velocities(z, dz);
        let (start, end) = (&self.plan.states[stage], self.plan.end(stage));
        stance.losses_nm = self.plant.planned_losses(start, end, self.settings.step_s);
        let stance = *stance;
        let Ok(torque) = self.lift(&command.u_lat, &stance) else {
            return false;
        };
        command.torque_nm = self.plant.clamp_torque(torque);
        command.losses_nm = stance.losses_nm;
        self.memory.feed_forward_nm = command.torque_nm;
        self.memory.joint_position = Some(command.joint_position_rad);
        command.inconsistency = self.inconsistency(command);
        true
    }

    /// `|F_lift − G τ| / |F_lift|` of a command's torques at the links, with force and moment as they are lifted.
    fn inconsistency(&self, command: &Command) -> Option<f64> {
        let stance = self.memory.stance.as_ref()?;
        if !stance.feet.contains(&true) {
            return None;
        }
        let rule = self.plant.input_rule();
        let map = rule.wrench_map(&stance.joints_rad, stance.attitude_rad, stance.feet);
        let produced = map.ok()? * SVector::<f64, JOINT_DIM>::from(command.net_torque_nm());
        let lifted = self.local_plant().lift(&command.u_lat);
        let force = SVector::<f64, 6>::from_fn(|axis, _| lifted[JOINT_DIM + axis]);
        (force.norm() > SMALL_FORCE_N).then(|| (force - produced).norm() / force.norm())
    }
}
