//! Agreement of torques with recorded ones: the one coefficient of determination that every command prints.

use super::metrics::FitSums;
use crate::robot::{ContactFlags, JOINT_DIM, Robot};

/// Recorded torques beyond this multiple of the robot's limits are no torques of the robot.
const IMPLAUSIBLE: f64 = 2.0;

/// Whether recorded torques can be the robot's: none beyond twice its limit. Samples with others count in no figure of
/// torques.
pub fn is_plausible(robot: &Robot, torque_nm: &[f64; JOINT_DIM]) -> bool {
    !exceeds(torque_nm, robot.torque_limit_nm(), IMPLAUSIBLE)
}

pub(super) fn exceeds(
    torque_nm: &[f64; JOINT_DIM],
    limits: &[f64; JOINT_DIM],
    factor: f64,
) -> bool {
    let mut pairs = torque_nm.iter().zip(limits);
    pairs.any(|(torque, limit)| torque.is_nan() || torque.abs() > factor * limit)
}

/// A figure for samples with and without ground contact; none where there were too few.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct ByContact {
    pub contact: Option<f64>,
    pub flight: Option<f64>,
}

type JointSums = [FitSums; JOINT_DIM];

/// Running sums of a comparison of torques, contact and flight apart and together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Comparison {
    contact: JointSums,
    flight: JointSums,
    all: JointSums,
}

impl Comparison {
    pub fn add(
        &mut self,
        feet: ContactFlags,
        predicted: &[f64; JOINT_DIM],
        recorded: &[f64; JOINT_DIM],
    ) {
        let of_phase = match feet.contains(&true) {
            true => &mut self.contact,
            false => &mut self.flight,
        };
        for sums in [of_phase, &mut self.all] {
            for ((sums, recorded), predicted) in sums.iter_mut().zip(recorded).zip(predicted) {
                sums.add(*recorded, *predicted);
            }
        }
    }

    /// Coefficient of determination over all twelve joints jointly,
    /// `R² = 1 − Σ_k Σ_j (τ_kj − τ̂_kj)² / Σ_k Σ_j (τ̂_kj − mean_j)²`
    /// with `τ` predicted, `τ̂` recorded and `mean_j` the recorded mean of joint `j`, over the samples
    /// `k` in contact or in flight.
    pub fn r2(&self) -> ByContact {
        ByContact {
            contact: FitSums::jointly(&self.contact).r2(),
            flight: FitSums::jointly(&self.flight).r2(),
        }
    }

    /// The same over all samples, with the mean over all samples.
    pub fn r2_all(&self) -> Option<f64> {
        FitSums::jointly(&self.all).r2()
    }

    /// Root mean square of the difference over all samples and joints, N m.
    pub fn rms(&self) -> Option<f64> {
        FitSums::jointly(&self.all).fit().map(|fit| fit.rms)
    }
}
