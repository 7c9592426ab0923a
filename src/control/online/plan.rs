//! The last good plan, in latent units, and how long it may be trusted.

/// Share of a stage whose posture is commanded for all of it. A joint PD that holds the posture of the stage's end is
/// ahead of the motion and adds to the thrust; that of the middle takes from it.
const POSTURE_SHARE: f64 = 0.9;

/// Inputs and states of a solved horizon.
#[derive(Debug, Clone)]
pub struct Plan {
    pub(super) step_s: f64,
    /// None without a plan.
    pub(super) start_s: Option<f64>,
    pub(super) phase: usize,
    pub(super) inputs: Vec<Vec<f64>>,
    /// States at the beginning of each stage and at the end of the last.
    pub(super) states: Vec<Vec<f64>>,
}

impl Plan {
    pub(super) fn new(latent_dim: usize, horizon: usize, step_s: f64) -> Self {
        Self {
            step_s,
            start_s: None,
            phase: 0,
            inputs: vec![vec![0.0; latent_dim]; horizon],
            states: vec![vec![0.0; 2 * latent_dim]; horizon + 1],
        }
    }

    /// Begins a new plan at a time with the state measured then; inputs and states follow.
    pub(super) fn begin(&mut self, start_s: f64, phase: usize, state: &[f64]) {
        self.start_s = Some(start_s);
        self.phase = phase;
        self.states[0].copy_from_slice(state);
    }

    /// Share of the first stage that has passed at a time; none before its end plus a tenth, at its beginning, or
    /// without a plan.
    pub(super) fn share_of_first(&self, time_s: f64) -> Option<f64> {
        let share = (time_s - self.start_s?) / self.step_s;
        (share > 0.0 && share < 1.1).then_some(share)
    }

    /// The stage that a time belongs to, counted from the plan's first; none before the plan or without one.
    pub(super) fn stage_at(&self, time_s: f64) -> Option<usize> {
        let passed = (time_s - self.start_s?) / self.step_s;
        // A time that is a stage's beginning but for rounding belongs to that stage.
        (passed > -0.5).then(|| (passed + 1e-6).floor().max(0.0) as usize)
    }

    /// The instant whose posture is commanded for a stage, s; none without a plan.
    pub(super) fn posture_s(&self, stage: usize) -> Option<f64> {
        Some(self.start_s? + (stage as f64 + POSTURE_SHARE) * self.step_s)
    }

    /// Input of a stage.
    pub fn input(&self, stage: usize) -> &[f64] {
        &self.inputs[stage]
    }

    /// State at the end of a stage.
    pub fn end(&self, stage: usize) -> &[f64] {
        &self.states[stage + 1]
    }

    /// State and input that the plan has at a time, beyond its end those of its last stage; none without a plan.
    pub(super) fn at(&self, time_s: f64) -> Option<(&[f64], &[f64])> {
        let stage = self.stage_at(time_s)?.min(self.inputs.len() - 1);
        Some((&self.states[stage], &self.inputs[stage]))
    }

    /// Largest deviation of a state from the one that the plan predicts for a time, in multiples of `deviation`; none
    /// if the plan does not reach that far.
    pub(super) fn normalised_innovation(
        &self,
        time_s: f64,
        state: &[f64],
        deviation: &[f64],
    ) -> Option<f64> {
        let passed = (time_s - self.start_s?) / self.step_s;
        let stages = self.inputs.len();
        if !(passed >= 0.0 && passed <= stages as f64) {
            return None;
        }
        let before = (passed as usize).min(stages - 1);
        let share = passed - before as f64;
        let ends = self.states[before].iter().zip(self.end(before));
        let predicted = ends.map(|(a, b)| a + share * (b - a));
        let deviations = state.iter().zip(predicted).zip(deviation);
        let deviations = deviations.map(|((x, at), scale)| ((x - at) / scale).abs());
        Some(deviations.fold(0.0, f64::max))
    }
}
