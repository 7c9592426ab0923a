//! The controller: from a measurement to a command, in every case.

use std::time::Instant;

use super::command::{Command, Memory, Status};
use super::conic::StageSolver;
use super::control_model::ControlModel;
use super::dense::Real;
use super::effectiveness::Effectiveness;
use super::error::ControlError;
use super::estimate::estimate_input;
use super::horizon::{Horizon, StageInputs};
use super::lift::{ConsistentLift, LiftFailure, StanceState};
use super::linearise::LatentDynamics;
use super::plan::Plan;
use super::problem::{ROW_MARGIN, StageRows, row_selection, stage_cost};
use super::qp::QpSolver;
use super::reference::{Reference, ReferenceSamples};
use super::settings::{Lift, Linearisation, MissingInput, MpcSettings, RowSelection};
use super::stage::{StageShape, write_weights};
use super::supervisor::{Fault, Supervisor};
use super::trajectory::Trajectory;
use super::walk::Walk;
use crate::robot::{ContactFlags, JOINT_DIM, LEG_JOINT_DIM, Leg, Robot, STATE_DIM};

/// Violation of a joint limit, in half ranges, above which a plan counts as softened. It is larger than the violation
/// that omitted rows may hide.
pub(super) const SOFTENED_FROM: Real = 1.05 * ROW_MARGIN;

/// Latent model-predictive controller of one model on its robot. It is built once: [`Controller::set_reference`] gives
/// it a trajectory, [`Controller::step_into`] turns each measurement into a [`Command`].
///
/// A step allocates nothing of its own and never fails. Without a trusted plan it uses the last good one, shifted, for
/// a few stages. After that it holds the posture with fading torques and damped joints until measurements are valid
/// again. The status gives the reason.
#[derive(Debug)]
pub struct Controller {
    pub(super) plant: ControlModel,
    /// The plant with its maps at the last state that was not refused, if they depend on the state.
    local: Option<ControlModel>,
    dynamics: Box<dyn LatentDynamics>,
    pub(super) settings: MpcSettings,
    /// Rows for any reference, and those that matter near the present one.
    rows: StageRows,
    pub(super) near_rows: StageRows,
    pub(super) engine: Box<dyn StageSolver>,
    pub(super) horizon: Horizon,
    pub(super) consistent: Option<ConsistentLift>,
    pub(super) reference: Option<Reference>,
    pub(super) plan: Plan,
    /// Latent state of the posture that is commanded.
    pub(super) posture: Vec<f64>,
    pub(super) memory: Memory,
    /// Latent state of the last measurement, also of a refused jump, and latent input of the last command.
    pub(super) measured: Vec<f64>,
    pub(super) last_input: Vec<f64>,
    /// Stance for which the plan's inputs are lifted; none without a plan.
    pub(super) stance: Option<StanceState>,
    pub(super) effectiveness: Effectiveness,
    pub(super) supervisor: Supervisor,
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
    pub fn with_plant(
        plant: ControlModel,
        dynamics: Box<dyn LatentDynamics>,
        settings: MpcSettings,
    ) -> Result<Self, ControlError> {
        settings.check()?;
        let d = plant.latent_dim();
        let rows = StageRows::new(&plant, &settings);
        // No program is solved before a reference sets the weights.
        let (horizon, engine) = program(d, &rows, &vec![1.0; 2 * d], &settings)?;
        let consistent = match settings.lift {
            Lift::Transpose => None,
            Lift::Consistent => Some(ConsistentLift::new(&plant, &settings)?),
        };
        Ok(Self {
            dynamics,
            engine,
            plan: Plan::new(d, settings.horizon, settings.step_s),
            posture: vec![0.0; 2 * d],
            memory: Memory::default(),
            measured: vec![0.0; 2 * d],
            last_input: vec![0.0; d],
            stance: None,
            effectiveness: Effectiveness::full(d),
            supervisor: Supervisor::of_step(settings.step_s),
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

    /// The same with the maps at the last measured state, where they depend on it: inputs are lifted by them.
    pub fn local_plant(&self) -> &ControlModel {
        self.local.as_ref().unwrap_or(&self.plant)
    }

    /// Evaluates the maps at a state (18, SI units), as for each measurement; without full row rank the last ones stay.
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

    /// The conic solver with the program of the last step, if the settings select it.
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

    /// Sets a new trajectory and prepares the solver for the constraint rows near it; a plan for an earlier one is
    /// discarded.
    pub fn set_reference(&mut self, samples: ReferenceSamples<'_>) -> Result<(), ControlError> {
        let mut reference = Reference::new(&self.plant, samples, &self.settings)?;
        if self.plant.is_nonlinear() {
            self.plant.take_statistics_at(&mean_state(samples.x));
        }
        if reference.input.is_none() && self.settings.missing_input == MissingInput::Estimate {
            let found = estimate_input(&self.plant, self.dynamics.as_mut(), &reference);
            reference.input = Some(found);
        }
        let d = self.plant.latent_dim();
        let (deviation, weight) = (reference.deviation(), self.settings.velocity_weight);
        let mut state_weights = vec![1.0; 2 * d];
        write_weights(deviation, weight, d, &mut state_weights);
        let rows = match row_selection(&self.plant, &self.settings) {
            RowSelection::All => self.rows.clone(),
            RowSelection::Needed => self.rows.clone().near(&reference),
        };
        (self.horizon, self.engine) = program(d, &rows, &state_weights, &self.settings)?;
        self.near_rows = rows;
        let grounded = reference.robot_states().zip(samples.feet);
        let mut is_first = true;
        for (x, feet) in grounded {
            for leg in Leg::down(*feet) {
                let height = foot_height(self.plant.robot(), leg, x);
                self.supervisor.contacts.raise_floor(is_first, height);
                is_first = false;
            }
        }
        self.reference = Some(reference);
        self.forget();
        Ok(())
    }

    /// Moves the reference on along a walk that it already is.
    pub(super) fn take_window(&mut self, walk: &Walk, new: usize) {
        if let Some(reference) = &mut self.reference {
            reference.take_window(&self.plant, walk, new);
        }
    }

    /// Torques of the motors, N m, that this lift makes of a latent input on a stance: links plus losses, unclamped.
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
        let losses = &stance.losses_nm;
        Ok(std::array::from_fn(|joint| net[joint] + losses[joint]))
    }

    /// Last plan minus reference positions at the end of each stage, in standard deviations of the reference.
    pub fn planned_deviations(&self) -> impl Iterator<Item = f64> {
        let d = self.plant.latent_dim();
        let reference = self.reference.as_ref();
        let deviation = reference.map_or(&[][..], |reference| &reference.deviation()[..d]);
        (0..self.settings.horizon).flat_map(move |stage| {
            let end = &self.horizon.stages[stage].end;
            let scaled = self.plan.end(stage).iter().zip(end).zip(deviation);
            scaled.map(|((planned, reference), scale)| (planned - reference) / scale)
        })
    }

    /// Forgets plan, past measurements and the supervisor's fault, but not the reference.
    pub fn reset(&mut self) {
        self.supervisor.reset();
        self.forget();
    }

    /// Resets the fields that a step without a plan does not set, and sets the gains.
    pub(super) fn begin(&self, command: &mut Command) {
        command.iterations = 0;
        command.slack = 0.0;
        command.phase = None;
        command.inconsistency = None;
        command.drives = self.settings.drives;
    }

    pub(super) fn forget(&mut self) {
        self.supervisor.forget();
        self.plan.time.is_made = false;
        self.horizon.forget();
        self.engine.forget();
        (self.memory, self.stance) = (Memory::default(), None);
        self.measured.fill(0.0);
        self.last_input.fill(0.0);
        self.effectiveness = Effectiveness::full(self.plant.latent_dim());
    }

    /// Prepares the step at `time_s`, with the reference's contacts at that time: the stages and, with the Riccati
    /// solver, the gains. The command is bit-identical with and without this call. After a refused measurement or an
    /// early change of feet it is equal up to rounding. Call it when no command is due. Without a reference, or when
    /// linearised about the last plan, it does nothing.
    pub fn prepare(&mut self, time_s: f64) {
        let Some(reference) = &self.reference else {
            return;
        };
        if self.settings.linearisation == Linearisation::LastPlan || !time_s.is_finite() {
            return;
        }
        let middle_s = time_s + 0.5 * self.settings.step_s;
        let phase = reference.phase_at(middle_s);
        self.prepare_stages(time_s, phase);
    }

    /// Writes the horizon from a time on and its gains; none without a reference.
    pub(super) fn prepare_stages(&mut self, time_s: f64, phase: usize) -> Option<Status> {
        let inputs = StageInputs {
            plant: &self.plant,
            settings: &self.settings,
            reference: self.reference.as_ref()?,
            plan: &self.plan,
            rows: &self.near_rows,
        };
        let dynamics = self.dynamics.as_mut();
        let contact = self.horizon.prepare(&inputs, dynamics, time_s, phase);
        let made = &self.horizon;
        (self.engine).prepare(&made.programs, made.shift, &made.is_new);
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
        self.begin(command);
        let status = match self.take(&measurement) {
            Ok(()) => self.plan_step(&measurement, command),
            Err(status) => status,
        };
        let status = self.judged(status, measurement.time_s);
        command.status = status;
        if status == Status::Ended || self.supervisor.fault != Fault::None {
            self.damp(measurement.time_s, measurement.x, command);
        } else if !status.has_plan() {
            self.fall_back(measurement.time_s, command);
        }
        if self.settings.effectiveness.is_some() {
            let (held, drives) = (
                [command.joint_position_rad, command.joint_velocity_rad_s],
                &self.settings.drives,
            );
            match status.has_plan() {
                true => (self.effectiveness).keep(&self.plant, drives, &measurement, held),
                false => self.effectiveness.held = None,
            }
        }
        (self.memory).keep_time(measurement.time_s, self.settings.step_s);
        self.last_input.copy_from_slice(&command.u_lat);
        command.solve_us = started.elapsed().as_secs_f64() * 1e6;
    }
}

fn program(
    latent_dim: usize,
    rows: &StageRows,
    state_weights: &[f64],
    settings: &MpcSettings,
) -> Result<(Horizon, Box<dyn StageSolver>), ControlError> {
    let (solver, length) = (settings.solver, settings.horizon);
    let shape = StageShape::of(latent_dim, rows, solver);
    let cost = stage_cost(state_weights, settings);
    let engine = solver.of_horizon(length, shape, &cost, settings.qp)?;
    Ok((Horizon::new(length, &shape), engine))
}

/// Height of a foot above the origin of the measurements at a state of the robot, m.
pub(super) fn foot_height(robot: &Robot, leg: Leg, x: &[f64]) -> f64 {
    let (shape, hip) = (&robot.geometry(leg).shape, robot.hip_position(leg));
    let q = &x[leg.index() * LEG_JOINT_DIM..][..LEG_JOINT_DIM];
    crate::robot::foot_height(shape, hip.as_slice(), x, q)
}

fn mean_state(x: &[f64]) -> [f64; STATE_DIM] {
    let count = (x.len() / STATE_DIM).max(1) as f64;
    std::array::from_fn(|i| x.iter().skip(i).step_by(STATE_DIM).sum::<f64>() / count)
}
