//! The stages of the horizon at a control step: phases, reference, linearised dynamics.

use super::control_model::ControlModel;
use super::linearise::{LatentDynamics, Lineariser, StageModel};
use super::plan::Plan;
use super::problem::StageRows;
use super::reference::Reference;
use super::settings::{Drift, Linearisation, MpcSettings};
use super::transcribe::Stage;
use crate::robot::ContactFlags;

/// How the feet's phase relates to the reference's at a control step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// The same.
    AsScheduled,
    /// The feet are already in a phase that the reference enters later: it is entered now.
    Early,
    /// The feet are still in a phase that the reference has left: it lasts for one more stage.
    Late,
    /// The feet are in a phase that the reference is not near, or in none of the model's.
    Unknown,
}

/// Stages that are kept from step to step.
#[derive(Debug, Clone)]
pub struct Horizon {
    stages: Vec<Stage>,
    /// Beginning of each stage and whether its linearisation belongs to it.
    made_for: Vec<Option<f64>>,
    /// Reference state at the end of each stage.
    ends: Vec<Vec<f64>>,
    phases: Vec<usize>,
    /// Stages by which the last preparation moved on, and those that it made.
    shift: usize,
    is_new: Vec<bool>,
    lineariser: Lineariser,
    nominal: StageModel,
}

/// What the stages are prepared from.
#[derive(Debug, Clone, Copy)]
pub struct StageInputs<'a> {
    /// The model's numbers.
    pub plant: &'a ControlModel,
    /// The settings.
    pub settings: &'a MpcSettings,
    /// What to follow.
    pub reference: &'a Reference,
    /// The last good plan.
    pub plan: &'a Plan,
    /// The rows of every stage, as far as the maps are the same at all of them.
    pub rows: &'a StageRows,
}

/// Times closer than this are the same control instant, s.
const TIME_TOLERANCE_S: f64 = 1e-9;

impl Horizon {
    /// Memory for a horizon.
    pub fn new(latent_dim: usize, length: usize) -> Self {
        Self {
            stages: vec![Stage::zeros(latent_dim); length],
            made_for: vec![None; length],
            ends: vec![vec![0.0; 2 * latent_dim]; length],
            phases: vec![0; length],
            shift: 0,
            is_new: vec![true; length],
            lineariser: Lineariser::new(latent_dim),
            nominal: StageModel::zeros(latent_dim),
        }
    }

    /// Forgets all linearisations: the reference has changed.
    pub fn forget(&mut self) {
        self.made_for.fill(None);
    }

    /// The stages of the last preparation.
    pub fn stages(&self) -> &[Stage] {
        &self.stages
    }

    /// By how many stages the last preparation moved on.
    pub fn shift(&self) -> usize {
        self.shift
    }

    /// Whether the last preparation made each stage anew.
    pub fn is_new(&self) -> &[bool] {
        &self.is_new
    }

    /// Reference state at the end of a stage.
    pub fn end(&self, stage: usize) -> &[f64] {
        &self.ends[stage]
    }

    /// Prepares all stages from a time on with the feet as measured then.
    pub fn prepare(
        &mut self,
        inputs: &StageInputs<'_>,
        dynamics: &mut dyn LatentDynamics,
        time_s: f64,
        feet: ContactFlags,
    ) -> Contact {
        let contact = self.schedule(inputs, time_s, feet);
        self.reuse(inputs.settings, time_s);
        for index in 0..self.stages.len() {
            let start_s = time_s + index as f64 * inputs.settings.step_s;
            let is_made = self.made_for[index]
                .is_some_and(|made| (made - start_s).abs() < TIME_TOLERANCE_S)
                && self.stages[index].phase == self.phases[index];
            self.is_new[index] = !is_made;
            if !is_made {
                self.make_reference(inputs, index, start_s);
                self.linearise(inputs, dynamics, index, start_s);
                self.made_for[index] = match inputs.settings.linearisation {
                    Linearisation::Reference => Some(start_s),
                    Linearisation::LastPlan => None,
                };
            }
        }
        contact
    }

    /// Phases of all stages: the reference's, changed where the feet disagree.
    fn schedule(&mut self, inputs: &StageInputs<'_>, time_s: f64, feet: ContactFlags) -> Contact {
        let (plant, step_s) = (inputs.plant, inputs.settings.step_s);
        let scheduled = |time_s: f64| {
            let phase = plant.phase_for(inputs.reference.feet_at(time_s));
            phase.expect("reference was checked for its phases")
        };
        for (index, phase) in self.phases.iter_mut().enumerate() {
            *phase = scheduled(time_s + (index as f64 + 0.5) * step_s);
        }
        let Some(measured) = plant.phase_for(feet) else {
            return Contact::Unknown;
        };
        if measured == scheduled(time_s) || measured == self.phases[0] {
            return Contact::AsScheduled;
        }
        let length = self.phases.len();
        let next = self.phases.iter().position(|&phase| phase == measured);
        let last = (1..=length).find(|&back| scheduled(time_s - back as f64 * step_s) == measured);
        match (next, last) {
            (None, None) => {
                self.phases[0] = measured;
                Contact::Unknown
            }
            (Some(next), last) if last.is_none_or(|last| next <= last) => {
                self.phases[..next].fill(measured);
                Contact::Early
            }
            (_, _) => {
                self.phases[0] = measured;
                Contact::Late
            }
        }
    }

    /// Moves stages that the last step made for the instants of this one to their new places.
    fn reuse(&mut self, settings: &MpcSettings, time_s: f64) {
        self.shift = 0;
        let Some(first) = self.made_for.first().copied().flatten() else {
            return;
        };
        let passed = (time_s - first) / settings.step_s;
        let shift = passed.round();
        let is_whole = (passed - shift).abs() * settings.step_s < TIME_TOLERANCE_S;
        if is_whole && shift >= 1.0 && shift < self.stages.len() as f64 {
            let shift = shift as usize;
            self.shift = shift;
            self.stages.rotate_left(shift);
            self.made_for.rotate_left(shift);
            self.ends.rotate_left(shift);
        }
    }

    fn make_reference(&mut self, inputs: &StageInputs<'_>, index: usize, start_s: f64) {
        let (plant, settings, reference) = (inputs.plant, inputs.settings, inputs.reference);
        let stage = &mut self.stages[index];
        stage.phase = self.phases[index];
        reference.state_at(start_s, &mut stage.state);
        reference.state_at(start_s + settings.step_s, &mut self.ends[index]);
        if !reference.mean_input(start_s, settings.step_s, &mut stage.input) {
            let mean = &plant.phases()[stage.phase].latent_mean;
            stage.input.copy_from_slice(mean.as_slice());
        }
        stage.losses_nm = plant.planned_losses(&stage.state, &self.ends[index], settings.step_s);
        stage.rows = reference.robot_state_at(start_s).and_then(|x| {
            let z = &self.ends[index][..plant.latent_dim()];
            let local = plant.tangent_at(&x, z)?;
            inputs.rows.with_maps_of(&local, settings)
        });
        let rows = stage.rows.as_ref().unwrap_or(inputs.rows);
        if let Some(friction) = &rows.friction {
            let middle_s = start_s + 0.5 * settings.step_s;
            if plant.phases()[stage.phase].is_grounded {
                friction.turned(reference.attitude_at(middle_s), &mut stage.force);
            } else {
                stage.force.fill(0.0);
            }
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
            Drift::Automatic => inputs.reference.has_input(),
            Drift::Reference => true,
            Drift::Model => false,
        };
        let point = match settings.linearisation {
            Linearisation::Reference => None,
            Linearisation::LastPlan => inputs.plan.at(start_s),
        };
        let stage = &mut self.stages[index];
        let phase = stage.phase;
        let mut evaluate = |z: &[f64], dz: &[f64], u: &[f64], ddz: &mut [f64], jacobian: &mut _| {
            dynamics.jacobian(phase, z, dz, u, ddz, jacobian);
        };
        let (end, lineariser) = (&self.ends[index], &mut self.lineariser);
        if let Some((state, input)) = point {
            lineariser.stage(state, input, step_s, &mut evaluate, &mut stage.model);
            for (row, defect) in stage.defect.iter_mut().enumerate() {
                *defect = stage.model.next[row] - end[row];
                for (col, value) in state.iter().enumerate() {
                    *defect += stage.model.a[(row, col)] * (stage.state[col] - value);
                }
                for (col, value) in input.iter().enumerate() {
                    *defect += stage.model.b[(row, col)] * (stage.input[col] - value);
                }
            }
            if trusts_reference {
                let (state, input, nominal) = (&stage.state, &stage.input, &mut self.nominal);
                lineariser.stage(state, input, step_s, &mut evaluate, nominal);
                for (row, defect) in stage.defect.iter_mut().enumerate() {
                    *defect += end[row] - nominal.next[row];
                }
            }
        } else {
            let (state, input, model) = (&stage.state, &stage.input, &mut stage.model);
            lineariser.stage(state, input, step_s, &mut evaluate, model);
            for (row, defect) in stage.defect.iter_mut().enumerate() {
                *defect = match trusts_reference {
                    true => 0.0,
                    false => stage.model.next[row] - end[row],
                };
            }
        }
    }
}
