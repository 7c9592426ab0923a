//! What the plain lift `u = W_e^T u_lat` alone loses, without any controller.

use super::metrics::Mean;
use super::torque::{Comparison, is_plausible};
use crate::model::ReducedModel;
use crate::recording::Segment;
use crate::robot::JOINT_DIM;
use crate::sim::SimError;

/// Lifted force and moment, in N and N m together, below which their inconsistency means nothing.
const SMALL_FORCE_N: f64 = 1.0;

/// Torques of exactly projected and lifted inputs against the recorded ones.
///
/// Per sample `u_lat = pinv(W_e^T) s_u u`, `u_lift = W_e^T u_lat / s_u`; what the joints take at the
/// recorded velocities and accelerations is added to the lifted torques.
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

    /// Mean of `|F_lift - G tau_lift| / |F_lift|` over samples with a foot down: how far the lifted
    /// body wrench is from what the lifted torques produce.
    pub fn inconsistency(&self) -> Option<f64> {
        self.inconsistency.get()
    }
}

/// The published weight of complexity in the combined loss (29).
pub const LAMBDA: f64 = 0.001;

/// The combined loss `L_mod = 2 E_dec + 2 lambda ln |Xi|` (equation 29), of the decoder's mean square
/// (scaled units) and the number of active terms in all phases.
/// None for a model without terms.
pub fn combined_loss(decoder_mean_square: f64, active_terms: usize, lambda: f64) -> Option<f64> {
    let logarithm = (active_terms > 0).then(|| (active_terms as f64).ln())?;
    Some(2.0 * decoder_mean_square + 2.0 * lambda * logarithm)
}
