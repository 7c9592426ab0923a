//! One step of the controller: a measurement screened, a plan solved for, a command made of it.

use nalgebra::SVector;

use super::command::{Command, Source, Status};
use super::control_model::{ControlModel, violation};
use super::controller::{Controller, Measurement, SOFTENED_FROM, foot_height};
use super::lift::StanceState;
use super::settings::{AfterEnd, Legs};
use super::stage::unscale;
use super::supervisor::{Bounds, Fault, Supervisor};
use super::trajectory::{NO_PHASE, Trajectory};
use crate::robot::{ContactFlags, JOINT_DIM, Leg, STATE_DIM};
use crate::solver::Outcome;

/// Lifted force, N, below which its inconsistency means nothing.
const SMALL_FORCE_N: f64 = 1.0;

impl Controller {
    /// Checks a measurement and stores it if it is accepted.
    pub(super) fn take(&mut self, measurement: &Measurement<'_>) -> Result<(), Status> {
        if measurement.x.len() != STATE_DIM || measurement.dx.len() != STATE_DIM {
            return Err(Status::WrongDimension);
        }
        let &Measurement { time_s, x, dx, .. } = measurement;
        if !self.memory.accepts(time_s, x, dx) {
            return Err(Status::NotFinite);
        }
        if let Some(status) = Status::of(self.supervisor.fault) {
            return Err(status);
        }
        let Some(reference) = &self.reference else {
            // Nothing to follow yet: the robot stays as it is.
            if !self.memory.has_position {
                let [lower, upper] = self.plant.joint_limits();
                self.memory.keep_posture(x, &lower, &upper);
            }
            return Err(Status::NoReference);
        };
        if self.settings.after_end != AfterEnd::Hold && reference.is_over(time_s) {
            return Err(Status::Ended);
        }
        let walks_on = match self.settings.legs {
            Legs::Decoded => measurement.feet,
            Legs::Reference => reference.feet_at(time_s),
        };
        if !watched(
            &mut self.supervisor,
            &self.plant,
            &self.settings.bounds,
            (&reference.robot_state_at(measurement.time_s), measurement),
            walks_on,
        ) {
            // The measured velocities must not become torques.
            self.memory.joint_velocity = [0.0; JOINT_DIM];
            return Err(Status::MeasurementJump);
        }
        let (d, horizon) = (self.plant.latent_dim(), self.settings.horizon);
        let (z, dz) = self.measured.split_at_mut(d);
        self.plant.encode(x, z);
        self.plant.encode_velocity(x, dx, dz);
        let (measured, deviation) = (&self.measured, reference.deviation());
        let (plan, fallback) = (&self.plan, &self.settings.fallback);
        let (states, most) = (&plan.states, fallback.jump_deviations);
        let is_jump = (plan.time).is_jump(time_s, states, horizon, measured, deviation, d, most);
        // Every touchdown of a walk is a jump of velocities; the supervisor still watches for leaps.
        let patience = match self.settings.legs {
            Legs::Decoded => fallback.jump_patience,
            Legs::Reference => 0,
        };
        if self.memory.refuses(is_jump, patience) {
            return Err(Status::MeasurementJump);
        }
        if let Some(time_constant_s) = self.settings.effectiveness {
            let parts = (&self.plant, plan);
            let settings = (time_constant_s, &self.settings.drives);
            (self.effectiveness).update(parts, settings, measurement, measured, deviation);
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
        let (measured, deviation) = (&self.measured, reference.deviation());
        let horizon = &mut self.horizon;
        horizon.begin((measured, deviation), &self.last_input, &self.near_rows);
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
        (plan.time.is_made, plan.time.phase) = (true, phase);
        plan.time.start_s = measurement.time_s;
        let d = measured.len() / 2;
        plan.states[..2 * d].copy_from_slice(measured);
        let [lower, upper] = self.plant.joint_limits();
        for (k, stage) in horizon.stages.iter().enumerate() {
            let input = &mut plan.inputs[k * d..][..d];
            let end = &mut plan.states[2 * (k + 1) * d..][..2 * d];
            let root = self.plant.phases()[stage.phase].latent_root.as_slice();
            let (v, x) = self.engine.stage(k);
            input.copy_from_slice(&stage.input);
            end.copy_from_slice(&stage.end);
            unscale(root, deviation, d, v, x, input, end);
            let joints = self.plant.decode_joints(&end[..d]);
            command.slack = violation(&joints, &lower, &upper, command.slack);
        }
        let is_grounded = self.plant.phases()[phase].is_grounded;
        let first = &self.horizon.stages[0].model;
        self.effectiveness.begin(first, is_grounded);
        let feet = match (&self.reference, self.settings.legs) {
            (Some(reference), Legs::Reference) => {
                reference.carrying(measurement.time_s, measurement.feet)
            }
            _ => measurement.feet,
        };
        self.stance = Some(StanceState::at(measurement.x, feet, phase));
        if !self.write_plan(0, measurement.time_s, command) {
            return Status::LiftFailed;
        }
        command.source = Source::Plan;
        match contact {
            Status::Solved if command.slack > SOFTENED_FROM => Status::Softened,
            status => status,
        }
    }

    /// Writes a stage of the plan at a time into the command; false if its input cannot be lifted.
    pub(super) fn write_plan(&mut self, stage: usize, now_s: f64, command: &mut Command) -> bool {
        let (Some(reference), Some(stance)) = (&self.reference, &mut self.stance) else {
            return false;
        };
        let (plan, step_s) = (&self.plan, self.settings.step_s);
        let held_s = self.memory.since_command(now_s, step_s);
        let time_s = plan.time.posture_s(now_s, held_s);
        reference.state_at(time_s, &mut self.posture);
        let (z, dz) = self.posture.split_at(self.plant.latent_dim());
        command.u_lat.copy_from_slice(plan.input(stage));
        if reference.input.is_some() && self.near_rows.link.is_empty() {
            let stage_s = plan.time.stage_s(stage);
            reference.move_input(stage_s, step_s, now_s, held_s, &mut command.u_lat);
        }
        for input in &mut command.u_lat {
            *input /= self.effectiveness.share.estimate;
        }
        command.phase = Some(plan.time.phase);
        let of_reference = self.settings.legs == Legs::Reference;
        let mut joints = match of_reference {
            true => joints_of(&reference.robot_state_at(time_s)),
            false => self.plant.decode_joints(z),
        };
        let in_flight = !self.plant.phases()[plan.time.phase].is_grounded;
        if in_flight && self.settings.swing_turn > 0.0 {
            let error = stance.attitude_rad[1] - reference.attitude_at(time_s)[1];
            let turn_rad = self.settings.swing_turn * error;
            self.plant.robot().turn_legs(turn_rad, &mut joints);
        }
        let [lower, upper] = self.plant.joint_limits();
        let at = (plan.time.phase, stance.feet);
        if of_reference {
            command.joint_velocity_rad_s = joints_of(&reference.robot_rate_at(time_s));
            let start_s = plan.time.stage_s(stage);
            let [before, after] =
                [start_s, start_s + step_s].map(|time_s| reference.robot_rate_at(time_s));
            let x = reference.robot_state_at(start_s + 0.5 * step_s);
            let rates = [&before, &after];
            stance.losses_nm = self.plant.losses_between(at, &x, rates, step_s);
            stance.near_nm = reference.torque_at(now_s + 0.5 * held_s);
            stance.keeps_swing = true;
        } else {
            command.joint_velocity_rad_s = self.plant.decode_joint_velocities(z, dz);
            let ends = [plan.start(stage), plan.end(stage)];
            stance.losses_nm = self.plant.planned_losses(at, ends, step_s);
        }
        let stance = *stance;
        let Ok(torque) = self.lift(&command.u_lat, &stance) else {
            return false;
        };
        self.memory.keep_posture(&joints, &lower, &upper);
        let share = if in_flight {
            self.settings.flight_torque
        } else {
            1.0
        };
        let limit = self.plant.robot().torque_limit_nm();
        self.memory.keep_torque(&torque, share, limit);
        command.joint_position_rad = self.memory.joint_position;
        command.torque_nm = self.memory.feed_forward_nm;
        command.losses_nm = stance.losses_nm.map(|loss| share * loss);
        command.inconsistency = self.inconsistency(command);
        true
    }

    /// `|F_lift − G τ| / |F_lift|` of a command's torques at the links, with force and moment as they are lifted.
    fn inconsistency(&self, command: &Command) -> Option<f64> {
        let stance = self.stance.as_ref()?;
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

fn joints_of(state: &[f64; STATE_DIM]) -> [f64; JOINT_DIM] {
    std::array::from_fn(|joint| state[joint])
}

/// Whether the supervisor accepts a measurement, given the state of the reference.
pub(super) fn watched(
    supervisor: &mut Supervisor,
    plant: &ControlModel,
    bounds: &Bounds,
    (nominal, measurement): (&[f64; STATE_DIM], &Measurement<'_>),
    walks_on: ContactFlags,
) -> bool {
    let &Measurement {
        time_s,
        x,
        dx,
        ref feet,
    } = measurement;
    let robot = plant.robot();
    let heights = Leg::ALL.map(|leg| foot_height(robot, leg, x));
    let [lower, upper] = plant.joint_limits();
    let fault = supervisor.watch(
        bounds,
        time_s,
        x,
        dx,
        nominal,
        &heights,
        feet,
        &walks_on,
        &lower,
        &upper,
        &robot.joint_speed_limit_rad_s,
    );
    fault == Fault::None && !supervisor.is_doubted
}
