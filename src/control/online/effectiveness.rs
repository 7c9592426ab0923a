//! How much of the commanded input arrives.
//!
//! Weak motors deliver a share of the torques; under a payload the same forces accelerate the body
//! less. Either way the velocities change by `γ B u` where the plan has `B u`, with `B` the change of
//! velocities by the input over the time that has passed. The joint PD of the motors adds its own
//! torques to the commanded ones, whose latent input `p` follows from the measurements at the
//! beginning and the end of that time. With `e = dz − dz_plan` and `φ = B (u + p)`, each velocity in
//! standard deviations of the reference, a step on the ground says
//!
//! ```text
//! γ = γ̂ (1 + φᵀ (e − B p) / φᵀ φ),
//! ```
//!
//! and the estimate `γ̂` is the weighted mean of what steps said and of a one from before the motion.
//! The weight of a step is `φᵀ φ` in units of the first step's, at most [`LARGEST_WEIGHT`], so that
//! the thrust, where models err most, does not outweigh what came before; it fades by
//! `exp(−age/T)`. Inputs are divided by `γ̂` before they are lifted.

use super::control_model::ControlModel;
use super::controller::Measurement;
use super::linearise::StageModel;
use super::plan::Plan;
use super::settings::Effectiveness as Settings;
use crate::robot::{JOINT_DIM, STATE_DIM};

/// Weight of the one from before the motion, in first steps.
pub const PRIOR_WEIGHT: f64 = 10.0;
/// Largest weight of a step, in first steps.
pub const LARGEST_WEIGHT: f64 = 2.0;
/// Smallest and largest estimate.
pub const RANGE: (f64, f64) = (0.7, 1.3);

/// The estimate and the sums behind it.
#[derive(Debug, Clone, Default)]
pub(super) struct Effectiveness {
    estimate: f64,
    /// Weights, and weights times what they say, of the steps so far.
    weight: f64,
    weighted: f64,
    /// `φᵀ φ` of the first step.
    unit: Option<f64>,
    /// Whether the plan's first stage has feet on the ground, and the change of the velocities at its
    /// end by its input.
    is_grounded: bool,
    by_input: Vec<f64>,
    /// Posture and joint velocities that the motors' PD holds; none before a command.
    held: Option<[[f64; JOINT_DIM]; 2]>,
    /// Latent input of the PD at the last command, and at the present measurement.
    at_command: Vec<f64>,
    drives: Vec<f64>,
}

impl Effectiveness {
    /// All of it, as known before a motion.
    pub(super) fn full(latent_dim: usize) -> Self {
        Self {
            estimate: 1.0,
            by_input: vec![0.0; latent_dim * latent_dim],
            at_command: vec![0.0; latent_dim],
            drives: vec![0.0; latent_dim],
            ..Self::default()
        }
    }

    /// `γ̂`.
    pub(super) fn estimate(&self) -> f64 {
        self.estimate
    }

    pub(super) fn begin(&mut self, model: &StageModel, is_grounded: bool) {
        self.is_grounded = is_grounded;
        let d = self.drives.len();
        for i in 0..d {
            for k in 0..d {
                self.by_input[i * d + k] = model.b(d + i, k);
            }
        }
    }

    /// Keeps what was commanded at a measurement: posture and joint velocities.
    pub(super) fn keep(
        &mut self,
        plant: &ControlModel,
        settings: &Settings,
        measurement: &Measurement<'_>,
        held: [[f64; JOINT_DIM]; 2],
    ) {
        self.held = Some(held);
        if self.take_drives(plant, settings, measurement) {
            self.at_command.copy_from_slice(&self.drives);
        } else {
            self.held = None;
        }
    }

    pub(super) fn interrupt(&mut self) {
        self.held = None;
    }

    /// Takes a measurement with its latent velocities; `deviation` are the reference's standard
    /// deviations of them.
    pub(super) fn update(
        &mut self,
        (plant, plan): (&ControlModel, &Plan),
        settings: &Settings,
        measurement: &Measurement<'_>,
        velocity: &[f64],
        deviation: &[f64],
    ) {
        let Some(share) = plan.share_of_first(measurement.time_s) else {
            return;
        };
        if !self.is_grounded || !self.take_drives(plant, settings, measurement) {
            return;
        }
        let d = self.drives.len();
        let (start, end, input) = (&plan.start(0)[d..], &plan.end(0)[d..], plan.input(0));
        let (mut size, mut agreement) = (0.0, 0.0);
        for i in 0..d {
            let (mut by_plan, mut by_drives) = (0.0, 0.0);
            for k in 0..d {
                let by_input = share * self.by_input[i * d + k] / deviation[i];
                by_plan += by_input * input[k];
                by_drives += by_input * (0.5 * (self.at_command[k] + self.drives[k]));
            }
            let planned = start[i] + share * (end[i] - start[i]);
            let missed = (velocity[i] - planned) / deviation[i] - by_drives;
            let change = by_plan + by_drives;
            size += change * change;
            agreement += change * missed;
        }
        if !(size > 0.0 && size.is_finite() && agreement.is_finite()) {
            return;
        }
        let weight = (size / *self.unit.get_or_insert(size)).min(LARGEST_WEIGHT);
        let kept = (-share * plan.step_s() / settings.time_constant_s).exp();
        self.weight = kept * self.weight + weight;
        self.weighted = kept * self.weighted + weight * self.estimate * (1.0 + agreement / size);
        let mean = (PRIOR_WEIGHT + self.weighted) / (PRIOR_WEIGHT + self.weight);
        self.estimate = mean.clamp(RANGE.0, RANGE.1);
    }

    /// The latent input of the motors' PD at a measurement; false if there is none to tell.
    fn take_drives(
        &mut self,
        plant: &ControlModel,
        settings: &Settings,
        measurement: &Measurement<'_>,
    ) -> bool {
        let Some([joints, rates]) = &self.held else {
            return false;
        };
        let (x, dx) = (measurement.x, measurement.dx);
        let torque: [f64; JOINT_DIM] = std::array::from_fn(|joint| {
            settings.stiffness_nm_rad * (joints[joint] - x[joint])
                + settings.damping_nm_s_rad * (rates[joint] - dx[joint])
        });
        let state: [f64; STATE_DIM] = std::array::from_fn(|i| x[i]);
        let rule = plant.input_rule();
        let Ok(wrench) = rule.wrench(&state, &torque, measurement.feet) else {
            return false;
        };
        let input: [f64; STATE_DIM] = std::array::from_fn(|i| match i.checked_sub(JOINT_DIM) {
            None => torque[i],
            Some(axis) => wrench[axis],
        });
        plant.project(x, &input, &mut self.drives);
        true
    }
}
