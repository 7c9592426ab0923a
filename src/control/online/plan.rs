//! The last good plan, in latent units, and how long it may be trusted. C is made of [`PlanTime`].

use super::dense::{Real, greater};

/// Lead of the commanded posture, in stages, relative to the middle of the time for which it is held. A joint PD that
/// holds the posture of the end of a stage leads the motion and adds to the thrust; with that of the middle it reduces
/// the thrust.
const POSTURE_LEAD: f64 = 0.4;

/// Times of the stages of a plan.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PlanTime {
    /// Whether there is a plan.
    pub is_made: bool,
    /// Beginning of the first stage, s.
    pub start_s: f64,
    /// Length of a stage, s.
    pub step_s: f64,
    /// Phase of the first stage.
    pub phase: usize,
}

impl PlanTime {
    /// Stages that have passed at a time; -1 without a plan.
    pub(super) fn passed(&self, time_s: f64) -> f64 {
        let passed = (time_s - self.start_s) / self.step_s;
        if self.is_made { passed } else { -1.0 }
    }

    /// Whether a time is in a stage or beyond the last. Times up to half a stage before the first count as the first,
    /// because clocks jitter.
    pub(super) fn reaches(&self, time_s: f64) -> bool {
        self.passed(time_s) > -0.5
    }

    /// The stage at a time, among the stages before `otherwise`; `otherwise` for a time outside these stages or without
    /// a plan. Pass the last stage to use it for all later times, or the number of stages to detect that there is no
    /// stage.
    pub(super) fn stage_at(&self, time_s: f64, otherwise: usize) -> usize {
        // A time that is a stage's beginning but for rounding belongs to that stage.
        let passed = self.passed(time_s) + 1e-6;
        if !self.reaches(time_s) || passed >= otherwise as f64 {
            otherwise
        } else if passed > 0.0 {
            passed as usize
        } else {
            // Up to half a step before the plan.
            0
        }
    }

    /// The instant whose posture is commanded at a time for `held_s`, s.
    pub(super) fn posture_s(&self, now_s: f64, held_s: f64) -> f64 {
        now_s + (POSTURE_LEAD * self.step_s + 0.5 * held_s)
    }

    /// Beginning of a stage, s.
    pub(super) fn stage_s(&self, stage: usize) -> f64 {
        self.start_s + stage as f64 * self.step_s
    }

    /// Whether a measured state differs from the planned one, interpolated to its time, by more than `most` standard
    /// deviations in any coordinate. False outside the plan.
    pub(super) fn is_jump(
        &self,
        time_s: f64,
        states: &[Real],
        horizon: usize,
        measured: &[Real],
        deviation: &[Real],
        d: usize,
        most: Real,
    ) -> bool {
        let passed = self.passed(time_s);
        if !(passed >= 0.0 && passed <= horizon as f64) {
            return false;
        }
        let whole = passed as usize;
        let before = if whole < horizon { whole } else { horizon - 1 };
        let share = (passed - before as f64) as Real;
        let mut largest: Real = 0.0;
        for i in 0..2 * d {
            let start = states[2 * d * before + i];
            let predicted = start + share * (states[2 * d * (before + 1) + i] - start);
            let change = (measured[i] - predicted) / deviation[i];
            largest = greater(change.abs(), largest);
        }
        largest > most
    }
}

/// Inputs and states of a solved horizon.
#[derive(Debug, Clone)]
pub struct Plan {
    pub(super) time: PlanTime,
    latent_dim: usize,
    pub(super) inputs: Vec<f64>,
    /// States at the beginning of each stage and at the end of the last.
    pub(super) states: Vec<f64>,
}

impl Plan {
    pub(super) fn new(latent_dim: usize, horizon: usize, step_s: f64) -> Self {
        Self {
            time: PlanTime {
                step_s,
                ..PlanTime::default()
            },
            latent_dim,
            inputs: vec![0.0; latent_dim * horizon],
            states: vec![0.0; 2 * latent_dim * (horizon + 1)],
        }
    }

    /// Input of a stage.
    pub fn input(&self, stage: usize) -> &[f64] {
        &self.inputs[stage * self.latent_dim..][..self.latent_dim]
    }

    /// State at the end of a stage.
    pub fn end(&self, stage: usize) -> &[f64] {
        self.start(stage + 1)
    }

    /// State at the beginning of a stage.
    pub(super) fn start(&self, stage: usize) -> &[f64] {
        let width = 2 * self.latent_dim;
        &self.states[stage * width..][..width]
    }

    /// State and input that the plan has at a time, beyond its end those of its last stage; none without a plan.
    pub(super) fn at(&self, time_s: f64) -> Option<(&[f64], &[f64])> {
        let last = self.inputs.len() / self.latent_dim - 1;
        let stage = self.time.stage_at(time_s, last);
        (self.time.reaches(time_s)).then(|| (self.start(stage), self.input(stage)))
    }
}
