//! What a run comes to: counts, times and the agreement of torques.

use crate::mpc::{Command, Status};
use crate::robot::{ContactFlags, JOINT_DIM};

/// A figure for steps with and without ground contact; none where there were too few steps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ByContact {
    /// At least one foot on the ground.
    pub contact: Option<f64>,
    /// No foot on the ground.
    pub flight: Option<f64>,
}

/// Times of steps, µs.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepTimes {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Largest.
    pub max: f64,
}

/// Summary of a run along a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Control steps.
    pub steps: usize,
    /// Steps with a checked plan within all limits.
    pub solved: usize,
    /// Steps with a checked plan that leaves joint limits.
    pub softened: usize,
    /// Steps without a plan of their own.
    pub failed: usize,
    /// Wall times of the steps.
    pub step_us: StepTimes,
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
    /// Steps with a torque beyond the robot's limits.
    pub limit_violations: usize,
    /// Steps that leave a friction cone by more than a thousandth of the weight; none if the
    /// controller constrains none.
    pub friction_violations: Option<usize>,
    /// Mean of `|F_lift − G τ| / |F_lift|` over the steps where it is defined.
    pub inconsistency: Option<f64>,
    /// Steps left out of the comparison of torques: the recording's are no torques of the robot.
    pub implausible: usize,
}

/// Running sums of a comparison of torques, contact and flight apart.
#[derive(Debug, Clone, Default)]
pub struct Comparison {
    contact: Sums,
    flight: Sums,
}

#[derive(Debug, Clone)]
struct Sums {
    count: usize,
    error: f64,
    sum: [f64; JOINT_DIM],
    square: f64,
}

impl Default for Sums {
    fn default() -> Self {
        Self {
            count: 0,
            error: 0.0,
            sum: [0.0; JOINT_DIM],
            square: 0.0,
        }
    }
}

impl Sums {
    fn r2(&self) -> Option<f64> {
        let explained =
            self.sum.iter().map(|sum| sum * sum).sum::<f64>() / self.count.max(1) as f64;
        let variance = self.square - explained;
        (self.count > 1 && variance > 0.0).then(|| 1.0 - self.error / variance)
    }
}

impl Comparison {
    /// Adds one step.
    pub fn add(
        &mut self,
        feet: ContactFlags,
        commanded: &[f64; JOINT_DIM],
        recorded: &[f64; JOINT_DIM],
    ) {
        let sums = if feet.contains(&true) {
            &mut self.contact
        } else {
            &mut self.flight
        };
        sums.count += 1;
        for joint in 0..JOINT_DIM {
            sums.error += (commanded[joint] - recorded[joint]).powi(2);
            sums.sum[joint] += recorded[joint];
            sums.square += recorded[joint].powi(2);
        }
    }

    /// Coefficient of determination over all twelve joints jointly,
    /// `R² = 1 − Σ_k Σ_j (τ_kj − τ̂_kj)² / Σ_k Σ_j (τ̂_kj − mean_j)²`
    /// with `τ` commanded, `τ̂` recorded and `mean_j` the recorded mean of joint `j`, over the steps
    /// `k` in contact or in flight.
    pub fn r2(&self) -> ByContact {
        ByContact {
            contact: self.contact.r2(),
            flight: self.flight.r2(),
        }
    }

    /// Root mean square of the difference over all steps and joints, N m.
    pub fn rms(&self) -> Option<f64> {
        let count = (self.contact.count + self.flight.count) * JOINT_DIM;
        (count > 0).then(|| ((self.contact.error + self.flight.error) / count as f64).sqrt())
    }
}

/// Everything that a summary is made of.
#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    solved: usize,
    softened: usize,
    failed: usize,
    times_us: Vec<f64>,
    inconsistency: (f64, usize),
    pub(super) torque: Comparison,
    pub(super) lift: Comparison,
    pub(super) tracking: MeanSquare,
    pub(super) limit_violations: usize,
    pub(super) friction_violations: Option<usize>,
    pub(super) implausible: usize,
}

/// A running mean of squares.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct MeanSquare {
    sum: f64,
    count: usize,
}

impl Extend<f64> for MeanSquare {
    fn extend<T: IntoIterator<Item = f64>>(&mut self, values: T) {
        for value in values {
            self.sum += value * value;
            self.count += 1;
        }
    }
}

impl Tally {
    pub(super) fn count(&mut self, command: &Command) {
        match command.status {
            Status::Softened => self.softened += 1,
            status if status.has_plan() => self.solved += 1,
            _ => self.failed += 1,
        }
        self.times_us.push(command.solve_us);
        if let Some(value) = command.inconsistency {
            self.inconsistency.0 += value;
            self.inconsistency.1 += 1;
        }
    }

    pub(super) fn summary(mut self) -> Summary {
        self.times_us.sort_by(f64::total_cmp);
        let (sum, count) = self.inconsistency;
        Summary {
            steps: self.times_us.len(),
            solved: self.solved,
            softened: self.softened,
            failed: self.failed,
            step_us: step_times(&self.times_us),
            torque_r2: self.torque.r2(),
            lift_r2: self.lift.r2(),
            torque_rms_nm: self.torque.rms(),
            tracking_rms: (self.tracking.count > 0)
                .then(|| (self.tracking.sum / self.tracking.count as f64).sqrt()),
            limit_violations: self.limit_violations,
            friction_violations: self.friction_violations,
            inconsistency: (count > 0).then(|| sum / count as f64),
            implausible: self.implausible,
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
    fn r2_is_one_for_equal_torques_and_zero_for_the_mean() {
        let recorded = [[1.0; JOINT_DIM], [3.0; JOINT_DIM]];
        let mut equal = Comparison::default();
        let mut mean = Comparison::default();
        for torque in &recorded {
            equal.add([true; 4], torque, torque);
            mean.add([false; 4], &[2.0; JOINT_DIM], torque);
        }
        assert_eq!(
            equal.r2(),
            ByContact {
                contact: Some(1.0),
                flight: None
            }
        );
        assert_eq!(
            mean.r2(),
            ByContact {
                contact: None,
                flight: Some(0.0)
            }
        );
        assert_eq!(mean.rms(), Some(1.0));
    }

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
