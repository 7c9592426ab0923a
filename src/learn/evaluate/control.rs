//! What a run comes to: counts, times and the agreement of torques.

use serde::Serialize;

use super::metrics::Mean;
use super::torque::{ByContact, Comparison};
use crate::mpc::{Command, Status};

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct StepTimes {
    pub p50: f64,
    pub p99: f64,
    pub max: f64,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Summary {
    pub steps: usize,
    /// Steps with a checked plan within all limits.
    pub solved: usize,
    /// Steps with a checked plan that leaves joint limits.
    pub softened: usize,
    /// Steps without a plan of their own.
    pub failed: usize,
    pub step_us: StepTimes,
    /// Wall times of the preparations between steps, which no command waits for:
    /// [`Controller::prepare`](crate::mpc::Controller::prepare).
    pub prepare_us: StepTimes,
    /// Agreement of commanded and recorded torques, see [`Comparison::r2`].
    pub torque_r2: ByContact,
    /// The same for torques that the lift alone makes of projected recorded inputs, at every sample;
    /// see [`lift_comparison`](super::lift_comparison).
    pub lift_r2: ByContact,
    /// Root mean square of commanded minus recorded torques over all steps and joints, N m.
    pub torque_rms_nm: Option<f64>,
    /// Root mean square over all steps, stages and latents of planned minus reference position, in
    /// standard deviations of the reference.
    pub tracking_rms: Option<f64>,
    pub limit_violations: usize,
    /// Steps that leave a friction cone by more than a thousandth of the weight; none if the
    /// controller constrains none.
    pub friction_violations: Option<usize>,
    /// Mean of `|F_lift − G τ| / |F_lift|` over the steps where it is defined.
    pub inconsistency: Option<f64>,
    /// Steps left out of the comparison of torques: the recording's are no torques of the robot.
    #[serde(rename = "implausible_steps")]
    pub implausible: usize,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    /// The counts; [`Self::summary`] fills in the rest.
    pub(super) summary: Summary,
    times_us: Vec<f64>,
    pub(super) preparations_us: Vec<f64>,
    inconsistency: Mean,
    pub(super) torque: Comparison,
    pub(super) lift: Comparison,
    pub(super) tracking: Mean,
}

impl Tally {
    pub(super) fn count(&mut self, command: &Command) {
        let counts = &mut self.summary;
        counts.steps += 1;
        match command.status {
            Status::Softened => counts.softened += 1,
            status if status.has_plan() => counts.solved += 1,
            _ => counts.failed += 1,
        }
        self.times_us.push(command.solve_us);
        if let Some(value) = command.inconsistency {
            self.inconsistency.add(value);
        }
    }

    pub(super) fn summary(mut self) -> Summary {
        self.times_us.sort_by(f64::total_cmp);
        self.preparations_us.sort_by(f64::total_cmp);
        Summary {
            step_us: step_times(&self.times_us),
            prepare_us: step_times(&self.preparations_us),
            torque_r2: self.torque.r2(),
            lift_r2: self.lift.r2(),
            torque_rms_nm: self.torque.rms(),
            tracking_rms: self.tracking.get().map(f64::sqrt),
            inconsistency: self.inconsistency.get(),
            ..self.summary
        }
    }
}

/// Percentiles of sorted times: the smallest value that so many percent do not exceed.
fn step_times(sorted_us: &[f64]) -> StepTimes {
    let rank = |share: f64| {
        let rank = (share * sorted_us.len() as f64).ceil() as usize;
        sorted_us.get(rank.max(1) - 1).copied().unwrap_or(0.0)
    };
    StepTimes {
        p50: rank(0.5),
        p99: rank(0.99),
        max: sorted_us.last().copied().unwrap_or(0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn step_times_are_ranks_of_the_sorted_list() {
        let times: Vec<f64> = (1..=200).map(f64::from).collect();
        assert_eq!(
            step_times(&times),
            StepTimes {
                p50: 100.0,
                p99: 198.0,
                max: 200.0
            }
        );
        assert_eq!(step_times(&[]), StepTimes::default());
    }
}
