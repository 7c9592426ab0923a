//! Estimate of the share of the commanded input that acts on the robot.
//!
//! With weak motors or a payload, velocities change by `γ B u` instead of the planned `B u`. `B` is the change by the
//! input over the time that has passed. The joint PD of the motors adds torques, whose latent input `p` follows from
//! the measurements at both ends of that time. With `e = dz − dz_plan` and `φ = B (u + p)`, each velocity divided by
//! its standard deviation over the reference, a step on the ground gives the value
//! ```text
//! γ = γ̂ (1 + φᵀ (e − B p) / φᵀ φ),
//! ```
//!
//! The estimate `γ̂` is the weighted mean of the values of all steps and of a prior value of one. The weight of a step
//! is `φᵀ φ` relative to the first step's, at most [`LARGEST_WEIGHT`], so that the thrust, where models err most, does
//! not dominate. Weights decay by `exp(−age/T)`. Inputs are divided by `γ̂` before they are lifted.

use super::control_model::ControlModel;
use super::controller::Measurement;
use super::dense::{Real, greater, smaller};
use super::linearise::StageModel;
use super::plan::Plan;
use super::settings::Drives;
use crate::robot::{JOINT_DIM, STATE_DIM};

/// Weight of the one from before the motion, in first steps.
const PRIOR_WEIGHT: Real = 10.0;
/// Largest weight of a step, in first steps.
const LARGEST_WEIGHT: Real = 2.0;
/// Smallest and largest estimate.
const LEAST: Real = 0.7;
const LARGEST: Real = 1.3;

/// Estimate of the share of the commanded input that arrives.
#[derive(Debug, Clone)]
pub(super) struct Share {
    /// `γ̂`, which inputs are divided by.
    pub estimate: Real,
    /// Sum of the faded weights of the steps so far.
    weight: Real,
    /// Sum of these weights, each times the share that its step suggests.
    weighted: Real,
    /// `φᵀ φ` of the first step, which weights are relative to; zero before.
    unit: Real,
}

impl Share {
    fn unknown() -> Self {
        Self {
            estimate: 1.0,
            weight: 0.0,
            weighted: 0.0,
            unit: 0.0,
        }
    }

    /// Updates the estimate from a measurement at `passed` stages into the plan, up to 1.1. `states` are the states at
    /// the beginning and end of the first stage, `input` is its input. `at_command` and `drives` are the latent inputs
    /// of the joint PD at the command and now.
    fn update(
        &mut self,
        passed: f64,
        step_s: Real,
        time_constant_s: Real,
        by_input: &[Real],
        input: &[Real],
        states: &[Real],
        measured: &[Real],
        deviation: &[Real],
        at_command: &[Real],
        drives: &[Real],
        d: usize,
    ) {
        if !(passed > 0.0 && passed < 1.1) {
            return;
        }
        let part = passed as Real;
        let mut size: Real = 0.0;
        let mut agreement: Real = 0.0;
        for i in 0..d {
            let mut by_plan: Real = 0.0;
            let mut by_drives: Real = 0.0;
            for k in 0..d {
                let effect = part * by_input[i * d + k] / deviation[d + i];
                by_plan += effect * input[k];
                by_drives += effect * (0.5 * (at_command[k] + drives[k]));
            }
            let start = states[d + i];
            let planned = start + part * (states[3 * d + i] - start);
            let missed = (measured[d + i] - planned) / deviation[d + i] - by_drives;
            let change = by_plan + by_drives;
            size += change * change;
            agreement += change * missed;
        }
        if !(size > 0.0 && size.is_finite() && agreement.is_finite()) {
            return;
        }
        let unit = if self.unit == 0.0 { size } else { self.unit };
        let own = smaller(size / unit, LARGEST_WEIGHT);
        let kept = (-part * step_s / time_constant_s).exp();
        let weight = kept * self.weight + own;
        let weighted = kept * self.weighted + own * self.estimate * (1.0 + agreement / size);
        let mean = (PRIOR_WEIGHT + weighted) / (PRIOR_WEIGHT + weight);
        // The quotient of a large and a tiny number may be infinite: such a step is ignored.
        if mean.is_finite() {
            self.unit = unit;
            self.weight = weight;
            self.weighted = weighted;
            self.estimate = greater(LEAST, smaller(mean, LARGEST));
        }
    }
}

/// Writes torques, N m, of a joint PD with two gains that holds a posture and, behind it, joint velocities.
fn write_drives(gains: &[Real; 2], held: &[Real], x: &[Real], dx: &[Real], torque: &mut [Real]) {
    for i in 0..12 {
        torque[i] = gains[0] * (held[i] - x[i]) + gains[1] * (held[12 + i] - dx[i]);
    }
}

/// The estimate with the posture and velocities that the motors' PD holds.
#[derive(Debug, Clone)]
pub(super) struct Effectiveness {
    pub(super) share: Share,
    /// Whether the plan's first stage has feet on the ground, and the change of the velocities at its end by its input.
    is_grounded: bool,
    by_input: Vec<f64>,
    /// Posture and joint velocities that the motors' PD holds; none before a command.
    pub(super) held: Option<[[f64; JOINT_DIM]; 2]>,
    /// Latent input of the PD at the last command, and at the present measurement.
    at_command: Vec<f64>,
    drives: Vec<f64>,
}

impl Effectiveness {
    pub(super) fn full(latent_dim: usize) -> Self {
        Self {
            share: Share::unknown(),
            is_grounded: false,
            by_input: vec![0.0; latent_dim * latent_dim],
            held: None,
            at_command: vec![0.0; latent_dim],
            drives: vec![0.0; latent_dim],
        }
    }

    pub(super) fn begin(&mut self, model: &StageModel, is_grounded: bool) {
        self.is_grounded = is_grounded;
        let d = self.drives.len();
        for (i, row) in self.by_input.chunks_exact_mut(d).enumerate() {
            row.copy_from_slice(&model.by[(d + i) * 3 * d + 2 * d..][..d]);
        }
    }

    /// Stores the posture and joint velocities commanded at a measurement.
    pub(super) fn keep(
        &mut self,
        plant: &ControlModel,
        drives: &Drives,
        measurement: &Measurement<'_>,
        held: [[f64; JOINT_DIM]; 2],
    ) {
        self.held = Some(held);
        match self.take_drives(plant, drives, measurement) {
            true => self.at_command.copy_from_slice(&self.drives),
            false => self.held = None,
        }
    }

    /// Updates the estimate from a measurement and its latent state; `deviation` is the reference's standard deviation.
    pub(super) fn update(
        &mut self,
        (plant, plan): (&ControlModel, &Plan),
        (time_constant_s, drives): (f64, &Drives),
        measurement: &Measurement<'_>,
        measured: &[f64],
        deviation: &[f64],
    ) {
        if !self.is_grounded || !self.take_drives(plant, drives, measurement) {
            return;
        }
        let (time, d) = (plan.time, self.drives.len());
        self.share.update(
            time.passed(measurement.time_s),
            time.step_s,
            time_constant_s,
            &self.by_input,
            plan.input(0),
            &plan.states,
            measured,
            deviation,
            &self.at_command,
            &self.drives,
            d,
        );
    }

    /// Computes the latent input of the motors' PD at a measurement; false if it is undefined.
    fn take_drives(
        &mut self,
        plant: &ControlModel,
        drives: &Drives,
        measurement: &Measurement<'_>,
    ) -> bool {
        let Some(held) = &self.held else {
            return false;
        };
        let (x, dx, mut torque) = (measurement.x, measurement.dx, [0.0; JOINT_DIM]);
        let gains = [drives.stiffness_nm_rad, drives.damping_nm_s_rad];
        write_drives(&gains, held.as_flattened(), x, dx, &mut torque);
        let state: [f64; STATE_DIM] = std::array::from_fn(|i| x[i]);
        let rule = plant.input_rule();
        let Ok(wrench) = rule.wrench(&state, &torque, measurement.feet) else {
            return false;
        };
        let mut input = [0.0; STATE_DIM];
        input[..JOINT_DIM].copy_from_slice(&torque);
        input[JOINT_DIM..].copy_from_slice(wrench.as_slice());
        plant.project(x, &input, &mut self.drives);
        true
    }
}
