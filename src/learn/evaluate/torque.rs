//! Agreement of torques with recorded ones: the one coefficient of determination that every command prints; and what
//! the plain lift `u = W_e^T u_lat` alone loses, without any controller.

use super::coordinates::{FitSums, Mean};
use crate::model::ReducedModel;
use crate::recording::Segment;
use crate::robot::{ContactFlags, JOINT_DIM, Robot};
use crate::sim::SimError;

const IMPLAUSIBLE: f64 = 2.0;

/// Whether recorded torques can be the robot's; samples with others count in no figure of torques.
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

    /// Coefficient of determination over all twelve joints jointly, `R² = 1 − Σ_k Σ_j (τ_kj − τ̂_kj)² / Σ_k Σ_j (τ̂_kj
    /// − mean_j)²` with `τ` predicted, `τ̂` recorded and `mean_j` the recorded mean of joint `j`, over the samples `k`
    /// in contact or in flight.
    pub fn r2(&self) -> ByContact {
        ByContact {
            contact: FitSums::jointly(&self.contact).r2(),
            flight: FitSums::jointly(&self.flight).r2(),
        }
    }

    pub fn r2_all(&self) -> Option<f64> {
        FitSums::jointly(&self.all).r2()
    }

    pub fn rms(&self) -> Option<f64> {
        FitSums::jointly(&self.all).fit().map(|fit| fit.rms)
    }
}

const SMALL_FORCE_N: f64 = 1.0;

/// Torques of exactly projected and lifted inputs against the recorded ones.
///
/// Per sample `u_lat = pinv(W_e^T) s_u u`, `u_lift = W_e^T u_lat / s_u`; what the joints take at the recorded
/// velocities and accelerations is added to the lifted torques.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LiftSums {
    pub torque: Comparison,
    inconsistency: Mean,
}

impl LiftSums {
    /// Adds every sample of a segment whose torques can be the robot's.
    pub(super) fn add(&mut self, model: &ReducedModel, segment: &Segment) -> Result<(), SimError> {
        let robot = model.robot()?;
        let rule = model.input_rule()?;
        let input = segment.input(&rule)?;
        let losses = segment.losses(&rule);
        for sample in 0..segment.len() {
            let torque = segment.torque(sample);
            if !is_plausible(robot, &torque) {
                continue;
            }
            let x = segment.x.column(sample).into_owned();
            let tangent = model.tangent(&x)?;
            let lifted = tangent.lift * (tangent.project * input.column(sample));
            let feet = segment.feet[sample];
            let of_joints = std::array::from_fn(|joint| lifted[joint] + losses[(joint, sample)]);
            self.torque.add(feet, &of_joints, &torque);
            if feet.contains(&true) {
                let torque = std::array::from_fn(|joint| lifted[joint]);
                let force = lifted.rows(JOINT_DIM, 6).into_owned();
                if let Ok(produced) = rule.wrench(&segment.state(sample), &torque, feet)
                    && force.norm() > SMALL_FORCE_N
                {
                    let off = (&force - produced).norm() / force.norm();
                    self.inconsistency.add(off);
                }
            }
        }
        Ok(())
    }

    /// Mean of `|F_lift - G tau_lift| / |F_lift|` over samples with a foot down: how far the lifted body wrench is from
    /// what the lifted torques produce.
    pub fn inconsistency(&self) -> Option<f64> {
        self.inconsistency.get()
    }
}

/// The published weight of complexity in the combined loss (29).
pub const LAMBDA: f64 = 0.001;

/// The combined loss `L_mod = 2 E_dec + 2 lambda ln |Xi|` (equation 29), of the decoder's mean square (scaled units)
/// and the number of active terms in all phases. None for a model without terms.
pub fn combined_loss(decoder_mean_square: f64, active_terms: usize, lambda: f64) -> Option<f64> {
    let logarithm = (active_terms > 0).then(|| (active_terms as f64).ln())?;
    Some(2.0 * decoder_mean_square + 2.0 * lambda * logarithm)
}
