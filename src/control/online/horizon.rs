//! The stages of the horizon at a control step: phases, reference, linearised dynamics, scaled programs.

use super::command::Status;
use super::conic::Start;
use super::control_model::ControlModel;
use super::linearise::{LatentDynamics, Lineariser, StageModel};
use super::plan::Plan;
use super::problem::{StageRows, to_upright, turn_force};
use super::reference::Reference;
use super::settings::{Drift, Linearisation, MpcSettings};
use super::stage::{CONE_ROWS, StageQp, StageScale, StageShape, trust_reference, write_defect};
use super::trajectory::{Contact, Trajectory, is_same_time, stages_between};

#[derive(Debug, Clone)]
pub(super) struct Stage {
    pub model: StageModel,
    /// `F̄ + A (x_r − x̄) + B (u_r − ū) + e − x_r⁺`: the residual of the dynamics at the reference.
    defect: Vec<f64>,
    /// Reference state at the beginning and at the end, `2 latent_dim`.
    state: Vec<f64>,
    pub end: Vec<f64>,
    pub input: Vec<f64>,
    pub phase: usize,
    /// Its beginning, if its linearisation belongs to it.
    made_for: Option<f64>,
    /// Its own rows, where they are not the same at all stages.
    rows: Option<StageRows>,
}

#[derive(Debug, Clone)]
pub(super) struct Horizon {
    pub stages: Vec<Stage>,
    /// The same in the form of the solvers.
    pub programs: Vec<StageQp>,
    phases: Vec<usize>,
    /// Stages by which the last preparation moved on, and those that it made.
    pub shift: usize,
    pub is_new: Vec<bool>,
    pub start: Start,
    /// Rows `(μ F_z, F_x, F_y)` of a cone of a stage.
    force: Vec<f64>,
    lineariser: Lineariser,
    nominal: StageModel,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct StageInputs<'a> {
    pub plant: &'a ControlModel,
    pub settings: &'a MpcSettings,
    pub reference: &'a Reference,
    pub plan: &'a Plan,
    /// The rows of every stage, as far as the maps are the same at all of them.
    pub rows: &'a StageRows,
}

impl Horizon {
    pub(super) fn new(length: usize, shape: &StageShape) -> Self {
        let latent_dim = shape.inputs;
        let zeros = || vec![0.0; 2 * latent_dim];
        let stage = Stage {
            model: StageModel::zeros(latent_dim),
            defect: zeros(),
            state: zeros(),
            end: zeros(),
            input: vec![0.0; latent_dim],
            phase: 0,
            made_for: None,
            rows: None,
        };
        Self {
            stages: vec![stage; length],
            programs: vec![StageQp::zeros(shape); length],
            phases: vec![0; length],
            shift: 0,
            is_new: vec![true; length],
            start: Start {
                state: vec![0.0; shape.states],
                link_before: vec![0.0; shape.rows.link],
            },
            force: vec![0.0; 3 * latent_dim],
            lineariser: Lineariser::new(latent_dim),
            nominal: StageModel::zeros(latent_dim),
        }
    }

    pub(super) fn forget(&mut self) {
        for stage in &mut self.stages {
            stage.made_for = None;
        }
    }

    /// Sets the initial state of the program, the measured one, and the input of the last command.
    pub(super) fn begin(
        &mut self,
        (measured, deviation): (&[f64], &[f64]),
        last_input: &[f64],
        rows: &StageRows,
    ) {
        let first = &self.stages[0];
        for (i, out) in self.start.state.iter_mut().enumerate() {
            *out = (measured[i] - first.state[i]) / deviation[i];
        }
        let rows = first.rows.as_ref().unwrap_or(rows);
        for (out, link) in self.start.link_before.iter_mut().zip(&rows.link) {
            let terms = link.row.iter().zip(last_input);
            *out = terms.fold(0.0, |sum, (entry, input)| sum + entry * input);
        }
    }

    /// Prepares all stages from a time on with the feet as measured then; the status of a plan for them.
    pub(super) fn prepare(
        &mut self,
        inputs: &StageInputs<'_>,
        dynamics: &mut dyn LatentDynamics,
        time_s: f64,
        measured: usize,
    ) -> Status {
        let (step_s, phases) = (inputs.settings.step_s, &mut self.phases);
        let (reference, horizon) = (inputs.reference, phases.len());
        let contact = reference.schedule(time_s, step_s, measured, horizon, phases);
        // Stages that the last step made for the instants of this one move to their new places.
        let made = self.stages[0].made_for;
        let shift = made.map(|made_s| stages_between(made_s, time_s, step_s, horizon));
        self.shift = shift.unwrap_or(0);
        self.stages.rotate_left(self.shift);
        self.programs.rotate_left(self.shift);
        for index in 0..self.stages.len() {
            let start_s = time_s + index as f64 * inputs.settings.step_s;
            let stage = &self.stages[index];
            let is_near = |made_s| is_same_time(made_s, start_s);
            let is_made = stage.made_for.is_some_and(is_near) && stage.phase == self.phases[index];
            self.is_new[index] = !is_made;
            if !is_made {
                self.make_reference(inputs, index, start_s);
                self.linearise(inputs, dynamics, index, start_s);
                self.write_program(inputs, index, start_s);
                self.stages[index].made_for = match inputs.settings.linearisation {
                    Linearisation::Reference => Some(start_s),
                    Linearisation::LastPlan => None,
                };
            }
        }
        match contact {
            Contact::AsScheduled => Status::Solved,
            Contact::Early => Status::ContactEarly,
            Contact::Late => Status::ContactLate,
            Contact::Unknown => Status::ContactUnknown,
        }
    }

    fn make_reference(&mut self, inputs: &StageInputs<'_>, index: usize, start_s: f64) {
        let (plant, settings, reference) = (inputs.plant, inputs.settings, inputs.reference);
        let stage = &mut self.stages[index];
        stage.phase = self.phases[index];
        reference.state_at(start_s, &mut stage.state);
        reference.state_at(start_s + settings.step_s, &mut stage.end);
        if reference.input.is_some() {
            reference.mean_input(start_s, settings.step_s, &mut stage.input);
        } else {
            let mean = &plant.phases()[stage.phase].latent_mean;
            stage.input.copy_from_slice(mean.as_slice());
        }
        let z = &stage.end[..plant.latent_dim()];
        let local = plant.tangent_at(&reference.robot_state_at(start_s), z);
        stage.rows = local.and_then(|local| inputs.rows.with_maps_of(&local, settings));
    }

    fn write_program(&mut self, inputs: &StageInputs<'_>, index: usize, start_s: f64) {
        let (plant, step_s) = (inputs.plant, inputs.settings.step_s);
        let (stage, program) = (&self.stages[index], &mut self.programs[index]);
        let phase = &plant.phases()[stage.phase];
        let scale = StageScale {
            root: phase.latent_root.as_slice(),
            input: &stage.input,
            deviation: inputs.reference.deviation(),
        };
        program.write_dynamics(&stage.model, &stage.defect, &scale);
        let rows = stage.rows.as_ref().unwrap_or(inputs.rows);
        let feet = plant.feet_of_phase(stage.phase);
        let losses_nm =
            plant.planned_losses((stage.phase, feet), [&stage.state, &stage.end], step_s);
        program.write_rows(rows, &losses_nm, &stage.end, &scale);
        let (cones, _) = rows.cones.as_chunks::<CONE_ROWS>();
        for (number, [x, y, z]) in cones.iter().enumerate() {
            let force = &mut self.force;
            force.fill(0.0);
            if phase.is_grounded {
                let attitude = inputs.reference.attitude_at(start_s + 0.5 * step_s);
                let rotation = to_upright(plant.input_rule().wrench_frame(), attitude);
                let (rotation, d) = (rotation.as_flattened(), stage.input.len());
                turn_force(rotation, &x.row, &y.row, &z.row, x.bound, d, force);
            }
            program.write_cone((number, cones.len()), force, &scale);
        }
    }

    fn linearise(
        &mut self,
        inputs: &StageInputs<'_>,
        dynamics: &mut dyn LatentDynamics,
        index: usize,
        start_s: f64,
    ) {
        let (settings, step_s) = (inputs.settings, inputs.settings.step_s);
        let trusts_reference = match settings.drift {
            Drift::Automatic => inputs.reference.input.is_some(),
            Drift::Reference => true,
            Drift::Model => false,
        };
        let point = match settings.linearisation {
            Linearisation::Reference => None,
            Linearisation::LastPlan => inputs.plan.at(start_s),
        };
        let of = &mut self.stages[index];
        let (model, defect, phase) = (&mut of.model, &mut of.defect, of.phase);
        let (state, input, end) = (&of.state, &of.input, &of.end);
        let (x, u) = point.unwrap_or((state, input));
        let mut stage = |x: &[f64], u: &[f64], model: &mut StageModel| {
            (self.lineariser).stage((dynamics, phase), x, u, step_s, model);
        };
        stage(x, u, model);
        let (next, by, d) = (&model.next, &model.by, input.len());
        write_defect(next, by, x, u, state, input, end, d, defect);
        if trusts_reference && point.is_some() {
            stage(state, input, &mut self.nominal);
        }
        if trusts_reference {
            trust_reference(point.is_some(), &self.nominal.next, end, d, defect);
        }
    }
}
