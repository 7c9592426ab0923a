//! The controller: from a measurement to a command, whatever happens.

use std::time::Instant;

use nalgebra::{DMatrix, SVector};

use super::command::{Command, Source, Status};
use super::control_model::ControlModel;
use super::dynamics::LatentDynamics;
use super::effectiveness::Effectiveness;
use super::engine::Engine;
use super::error::ControlError;
use super::fallback::Memory;
use super::horizon::{Contact, Horizon, StageInputs};
use super::lift::{ConsistentLift, LiftFailure, StanceState};
use super::plan::Plan;
use super::problem::{ROW_MARGIN, StageRows, row_selection};
use super::qp::{Outcome, QpSolver};
use super::reference::{Reference, ReferenceSamples};
use super::settings::{Lift, Linearisation, MissingInput, MpcSettings, RowSelection};
use super::transcribe::{StepData, Weights};
use crate::robot::{ContactFlags, JOINT_DIM, STATE_DIM};

/// Violation of a joint limit, in half ranges, from which a plan counts as softened: beyond what the
/// rows that were left out may hide.
pub const SOFTENED_FROM: f64 = 1.05 * ROW_MARGIN;
/// Lifted force, N, below which its inconsistency means nothing.
const SMALL_FORCE_N: f64 = 1.0;

/// Latent model-predictive controller of one model on its robot.
///
/// Built once; [`Controller::set_reference`] gives it a trajectory, [`Controller::step_into`] turns
/// each measurement into a [`Command`]. A step allocates nothing of its own and never fails: when
/// there is no plan to trust, the last good one is shifted and used for a few stages, then the
/// posture is held with fading torques and damped joints, and the status says why. As soon as
/// measurements make sense again, so do commands.
#[derive(Debug)]
pub struct Controller {
    pub(super) plant: ControlModel,
    /// The plant with its maps at the last state that was believed, if they depend on the state.
    local: Option<ControlModel>,
    dynamics: Box<dyn LatentDynamics>,
    pub(super) settings: MpcSettings,
    /// Rows for any reference, and those that matter near the present one.
    rows: StageRows,
    near_rows: StageRows,
    engine: Engine,
    input_cholesky: Vec<DMatrix<f64>>,
    horizon: Horizon,
    consistent: Option<ConsistentLift>,
    pub(super) reference: Option<Reference>,
    pub(super) plan: Plan,
    /// Latent state of the posture that is commanded.
    posture: Vec<f64>,
    pub(super) memory: Memory,
    effectiveness: Effectiveness,
}

/// One measurement.
#[derive(Debug, Clone, Copy)]
pub struct Measurement<'a> {
    /// Time, s.
    pub time_s: f64,
    /// State, 18 values in SI units.
    pub x: &'a [f64],
    /// Its velocity, 18 values.
    pub dx: &'a [f64],
    /// Feet in contact.
    pub feet: ContactFlags,
}

impl Controller {
    /// Builds a controller of a plant and its latent dynamics.
    ///
    /// # Errors
    /// [`ControlError::Setting`] for settings out of range and [`ControlError::Solver`] if the
    /// solver refuses the problem.
    pub fn with_plant(
        plant: ControlModel,
        dynamics: Box<dyn LatentDynamics>,
        settings: MpcSettings,
    ) -> Result<Self, ControlError> {
        settings.check()?;
        let d = plant.latent_dim();
        let rows = StageRows::new(&plant, &settings);
        let horizon = Horizon::new(d, settings.horizon, rows.friction.clone());
        let engine = Engine::new(d, &rows, None, &settings)?;
        let consistent = match settings.lift {
            Lift::Transpose => None,
            Lift::Consistent => Some(ConsistentLift::new(&plant, &settings)?),
        };
        Ok(Self {
            dynamics,
            engine,
            input_cholesky: input_cholesky(&plant),
            plan: Plan::new(d, settings.horizon, settings.step_s),
            posture: vec![0.0; 2 * d],
            memory: Memory::new(d),
            effectiveness: Effectiveness::full(d),
            reference: None,
            near_rows: rows.clone(),
            rows,
            horizon,
            consistent,
            local: None,
            plant,
            settings,
        })
    }

    /// The model's numbers.
    pub fn plant(&self) -> &ControlModel {
        &self.plant
    }

    /// The same with the maps at the last measured state, where they depend on the state: what
    /// inputs are projected and lifted by.
    pub fn local_plant(&self) -> &ControlModel {
        self.local.as_ref().unwrap_or(&self.plant)
    }

    /// Takes the maps at a state (18, SI units), as each measurement does, if they depend on it; where
    /// the encoder's Jacobian does not have full row rank the maps stay those of the state before.
    pub fn stand_at(&mut self, x: &[f64]) {
        if !self.plant.is_nonlinear() {
            return;
        }
        let mut z = vec![0.0; self.plant.latent_dim()];
        self.plant.encode(x, &mut z);
        if let Some(local) = self.plant.tangent_at(x, &z) {
            if let Some(lift) = &mut self.consistent {
                lift.take_projection(&local);
            }
            self.local = Some(local);
        }
    }

    /// The settings.
    pub fn settings(&self) -> &MpcSettings {
        &self.settings
    }

    /// The rows of each stage that were found to matter.
    pub fn stage_rows(&self) -> &StageRows {
        &self.near_rows
    }

    /// The conic solver with the program of the last step, if that is what solves it.
    pub fn solver(&self) -> Option<&QpSolver> {
        self.engine.conic()
    }

    /// The last good plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The trajectory being followed.
    pub fn reference(&self) -> Option<&Reference> {
        self.reference.as_ref()
    }

    /// Takes a new trajectory to follow; a plan for an earlier one is forgotten.
    ///
    /// This sets up the solver anew, for the rows that matter near the trajectory.
    ///
    /// # Errors
    /// As [`Reference::new`] and [`QpSolver::new`]; the old reference stays.
    pub fn set_reference(&mut self, samples: ReferenceSamples<'_>) -> Result<(), ControlError> {
        let mut reference = Reference::new(&self.plant, samples)?;
        if self.plant.is_nonlinear() {
            self.plant.take_statistics_at(&mean_state(samples.x));
            self.input_cholesky = input_cholesky(&self.plant);
        }
        if !reference.has_input() && self.settings.missing_input == MissingInput::Estimate {
            reference.estimate_input(&self.plant, self.dynamics.as_mut());
        }
        let d = self.plant.latent_dim();
        let deviation = reference.deviation();
        let state: Vec<f64> = (0..2 * d)
            .map(|index| {
                if index < d {
                    1.0
                } else {
                    self.settings.velocity_weight
                        * (deviation[index] / deviation[index - d]).powi(2)
                }
            })
            .collect();
        let weights = Weights {
            state: &state,
            terminal: self.settings.terminal_weight,
            input: self.settings.input_weight,
            joint_penalty: self.settings.joint_penalty,
        };
        let rows = match row_selection(&self.plant, &self.settings) {
            RowSelection::All => self.rows.clone(),
            RowSelection::Needed => self.rows.clone().near(&reference),
        };
        self.engine = Engine::new(d, &rows, Some(&weights), &self.settings)?;
        self.near_rows = rows;
        self.reference = Some(reference);
        self.reset();
        Ok(())
    }

    /// Torques of the motors, N m, that this controller's lift makes of a latent input on a stance: those
    /// at the links and the stance's losses; not clamped.
    ///
    /// # Errors
    /// [`LiftFailure`] of the consistent lift; the transpose lift has none.
    pub fn lift(
        &mut self,
        u_lat: &[f64],
        stance: &StanceState,
    ) -> Result<[f64; JOINT_DIM], LiftFailure> {
        let net: [f64; JOINT_DIM] = match &mut self.consistent {
            Some(lift) => lift.lift(&self.plant, u_lat, stance)?,
            None => {
                let input = self.local_plant().lift(u_lat);
                std::array::from_fn(|joint| input[joint])
            }
        };
        Ok(std::array::from_fn(|joint| {
            net[joint] + stance.losses_nm[joint]
        }))
    }

    /// Planned minus reference positions at the end of every stage of the last plan, in standard
    /// deviations of the reference.
    pub fn planned_deviations(&self) -> impl Iterator<Item = f64> {
        let d = self.plant.latent_dim();
        let deviation = self
            .reference
            .as_ref()
            .map_or(&[][..], |reference| &reference.deviation()[..d]);
        (0..self.settings.horizon).flat_map(move |stage| {
            let pairs = self.plan.end(stage).iter().zip(self.horizon.end(stage));
            pairs
                .zip(deviation)
                .map(|((planned, reference), scale)| (planned - reference) / scale)
        })
    }

    /// Forgets plan and past measurements, but not the reference.
    pub fn reset(&mut self) {
        self.plan.clear();
        self.horizon.forget();
        self.engine.forget();
        self.memory = Memory::new(self.plant.latent_dim());
        self.effectiveness = Effectiveness::full(self.plant.latent_dim());
    }

    /// Prepares the step at a time ahead, for the feet that the reference has on the ground then: its
    /// stages are linearised and, with the Riccati solver, its gains computed. The step then does not
    /// have to; its command is the same to the bit either way. To be called while nothing waits for a
    /// command, if at all. Does nothing without a reference, or about the last plan.
    pub fn prepare(&mut self, time_s: f64) {
        let Some(reference) = &self.reference else {
            return;
        };
        if self.settings.linearisation == Linearisation::LastPlan || !time_s.is_finite() {
            return;
        }
        let middle_s = time_s + 0.5 * self.settings.step_s;
        let feet = reference.feet_at(middle_s);
        self.prepare_stages(time_s, feet);
    }

    /// Writes the horizon from a time on and its gains; none without a reference.
    fn prepare_stages(&mut self, time_s: f64, feet: ContactFlags) -> Option<Contact> {
        let inputs = StageInputs {
            plant: &self.plant,
            settings: &self.settings,
            reference: self.reference.as_ref()?,
            plan: &self.plan,
            rows: &self.near_rows,
        };
        let dynamics = self.dynamics.as_mut();
        let contact = self.horizon.prepare(&inputs, dynamics, time_s, feet);
        let step = step_data(
            &self.horizon,
            &self.memory,
            inputs.reference,
            &self.input_cholesky,
        );
        self.engine.prepare(&step, &self.horizon);
        Some(contact)
    }

    /// Like [`Controller::step_into`], with a command of its own.
    pub fn step(&mut self, measurement: Measurement<'_>) -> Command {
        let mut command = Command::zeros(self.plant.latent_dim());
        self.step_into(measurement, &mut command);
        command
    }

    /// Computes the command for a measurement.
    pub fn step_into(&mut self, measurement: Measurement<'_>, command: &mut Command) {
        let started = Instant::now();
        command.iterations = 0;
        command.slack = 0.0;
        command.phase = None;
        command.inconsistency = None;
        let status = match self.take(&measurement) {
            Ok(()) => self.plan_step(&measurement, command),
            Err(status) => status,
        };
        command.status = status;
        if !status.has_plan() {
            self.fall_back(measurement.time_s, command);
        }
        if let Some(settings) = &self.settings.effectiveness {
            let held = [command.joint_position_rad, command.joint_velocity_rad_s];
            match status.has_plan() {
                true => (self.effectiveness).keep(&self.plant, settings, &measurement, held),
                false => self.effectiveness.interrupt(),
            }
        }
        self.memory.joint_position = Some(command.joint_position_rad);
        self.memory.input.copy_from_slice(&command.u_lat);
        command.solve_us = started.elapsed().as_secs_f64() * 1e6;
    }

    /// Screens a measurement and, if it can be believed, keeps it.
    fn take(&mut self, measurement: &Measurement<'_>) -> Result<(), Status> {
        if measurement.x.len() != STATE_DIM || measurement.dx.len() != STATE_DIM {
            return Err(Status::WrongDimension);
        }
        let values = measurement.x.iter().chain(measurement.dx);
        if !measurement.time_s.is_finite() || values.into_iter().any(|value| !value.is_finite()) {
            return Err(Status::NotFinite);
        }
        self.memory.time_s = Some(measurement.time_s);
        self.memory.joint_velocity = std::array::from_fn(|joint| measurement.dx[joint]);
        let Some(reference) = &self.reference else {
            return Err(Status::NoReference);
        };
        let (z, dz) = self.memory.measured.split_at_mut(self.plant.latent_dim());
        self.plant.encode(measurement.x, z);
        self.plant
            .encode_velocity(measurement.x, measurement.dx, dz);
        let normalised_innovation = self.plan.normalised_innovation(
            measurement.time_s,
            &self.memory.measured,
            reference.deviation(),
        );
        let fallback = &self.settings.fallback;
        if normalised_innovation.is_some_and(|normalised_innovation| {
            normalised_innovation.is_nan() || normalised_innovation > fallback.jump_deviations
        }) {
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

    /// Solves for a plan and makes the command from it.
    fn plan_step(&mut self, measurement: &Measurement<'_>, command: &mut Command) -> Status {
        let prepared = self.prepare_stages(measurement.time_s, measurement.feet);
        let (Some(contact), Some(reference)) = (prepared, &self.reference) else {
            return Status::NoReference;
        };
        let step = step_data(&self.horizon, &self.memory, reference, &self.input_cholesky);
        let (outcome, iterations) = self.engine.solve(&step);
        command.iterations = iterations;
        match outcome {
            Outcome::Solved => {}
            Outcome::Inaccurate => return Status::Inaccurate,
            Outcome::Infeasible => return Status::Infeasible,
            Outcome::IterationCap => return Status::IterationCap,
            Outcome::Unbounded | Outcome::NumericalFailure => return Status::NumericalFailure,
        }
        let phase = step.stages[0].phase;
        self.plan
            .begin(measurement.time_s, phase, &self.memory.measured);
        for stage in 0..self.settings.horizon {
            self.engine.input(stage, &step, self.plan.input_mut(stage));
            let end = self.horizon.end(stage);
            self.engine
                .state(stage, &step, end, self.plan.end_mut(stage));
        }
        let is_grounded = self.plant.phases()[phase].is_grounded;
        self.effectiveness
            .begin(&step.stages[0].model.b, is_grounded);
        command.slack = self.largest_violation();
        self.memory.stance = Some(StanceState {
            joints_rad: std::array::from_fn(|joint| measurement.x[joint]),
            attitude_rad: std::array::from_fn(|angle| measurement.x[15 + angle]),
            feet: measurement.feet,
            phase,
            losses_nm: [0.0; JOINT_DIM],
        });
        if !self.write_plan(0, command) {
            return Status::LiftFailed;
        }
        command.source = Source::Plan;
        match contact {
            Contact::Early => Status::ContactEarly,
            Contact::Late => Status::ContactLate,
            Contact::Unknown => Status::ContactUnknown,
            Contact::AsScheduled if command.slack > SOFTENED_FROM => Status::Softened,
            Contact::AsScheduled => Status::Solved,
        }
    }

    /// Largest violation of a joint limit at the ends of the plan's stages, in half ranges of the
    /// joint, whichever rows the program has.
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
        let (Some(reference), Some(end_s)) = (&self.reference, self.plan.end_s(stage)) else {
            return false;
        };
        reference.state_at(end_s, &mut self.posture);
        let (z, dz) = self.posture.split_at(self.plant.latent_dim());
        command.u_lat.copy_from_slice(self.plan.input(stage));
        for input in &mut command.u_lat {
            *input /= self.effectiveness.estimate();
        }
        let input = command.u_lat.as_slice();
        command.phase = Some(self.plan.phase());
        command.joint_position_rad = self.plant.clamp_joints(self.plant.decode_joints(z));
        command.joint_velocity_rad_s = self.plant.decode_joint_velocities(z, dz);
        let lifted = self.local_plant().lift(input);
        let (start, end) = (self.plan.start(stage), self.plan.end(stage));
        let losses = self.plant.planned_losses(start, end, self.settings.step_s);
        if let Some(stance) = &mut self.memory.stance {
            stance.losses_nm = losses;
        }
        let net: [f64; JOINT_DIM] = match (&mut self.consistent, &self.memory.stance) {
            (None, _) => std::array::from_fn(|joint| lifted[joint]),
            (Some(lift), Some(stance)) => match lift.lift(&self.plant, input, stance) {
                Ok(torque) => torque,
                Err(_) => return false,
            },
            (Some(_), None) => return false,
        };
        let torque = std::array::from_fn(|joint| net[joint] + losses[joint]);
        command.torque_nm = self.plant.clamp_torque(torque);
        command.losses_nm = losses;
        self.memory.feed_forward_nm = command.torque_nm;
        command.inconsistency = self.inconsistency(&lifted, &command.net_torque_nm());
        true
    }

    /// `|F_lift − G τ| / |F_lift|` of torques at the links, with force and moment as they are lifted.
    fn inconsistency(&self, lifted: &[f64; STATE_DIM], net_nm: &[f64; JOINT_DIM]) -> Option<f64> {
        let stance = self.memory.stance.as_ref()?;
        if !stance.feet.contains(&true) {
            return None;
        }
        let map = self
            .plant
            .input_rule()
            .wrench_map(&stance.joints_rad, stance.attitude_rad, stance.feet)
            .ok()?;
        let produced = map * SVector::<f64, JOINT_DIM>::from(*net_nm);
        let force = SVector::<f64, 6>::from_fn(|axis, _| lifted[JOINT_DIM + axis]);
        (force.norm() > SMALL_FORCE_N).then(|| (force - produced).norm() / force.norm())
    }
}

/// The horizon's numbers as the engine takes them.
fn step_data<'a>(
    horizon: &'a Horizon,
    memory: &'a Memory,
    reference: &'a Reference,
    input_cholesky: &'a [DMatrix<f64>],
) -> StepData<'a> {
    let stages = horizon.stages();
    let latent_dim = memory.input.len();
    StepData {
        stages,
        last_position: &horizon.end(stages.len() - 1)[..latent_dim],
        measured: &memory.measured,
        last_input: &memory.input,
        deviation: reference.deviation(),
        input_cholesky,
    }
}

/// Scales of the inputs by phase.
fn input_cholesky(plant: &ControlModel) -> Vec<DMatrix<f64>> {
    let phases = plant.phases().iter();
    phases.map(|phase| phase.latent_root.clone()).collect()
}

/// Mean of states, 18 values per sample.
fn mean_state(x: &[f64]) -> [f64; STATE_DIM] {
    let count = (x.len() / STATE_DIM).max(1) as f64;
    std::array::from_fn(|i| x.iter().skip(i).step_by(STATE_DIM).sum::<f64>() / count)
}
