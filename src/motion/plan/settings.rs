//! Weights and bounds of a plan.

use serde::{Deserialize, Serialize};

/// What a plan is weighed and bounded by. Deviations are those from the prior, each in standard
/// deviations of the training, averaged over the coordinates and summed over time in units of 10 ms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlanSettings {
    /// Weight of the input's deviation.
    pub input: f64,
    /// Weight of the deviation of the posture: the latent coordinates after the second.
    pub posture: f64,
    /// Weight of the deviation of the latent velocities.
    pub rate: f64,
    /// Weight of the change of the input's deviation in 10 ms.
    pub smoothness: f64,
    /// Weight of feet that leave their place, per [`Self::foot_m`].
    pub feet: f64,
    /// Displacement of a foot along and above the floor that counts one, m.
    pub foot_m: [f64; 2],
    /// Weight of durations, per 15 % of change: of parts on the ground, and of the flight.
    pub duration: [f64; 2],
    /// Weight of the duration of the first part, which leads to the thrust.
    pub first_duration: f64,
    /// Share of the training jumps' ranges of goals, at either end, that the prior is kept out of.
    pub inset: f64,
    /// Share of the torque limits that a plan may use at its nodes.
    pub torque_share: f64,
    /// Friction between feet and floor.
    pub friction: f64,
    /// Force that may exceed the friction cone, N: the input's force is not free of noise.
    pub friction_slack_n: f64,
    /// Most speed of the body at the end, of jumps that land, m/s.
    pub end_speed_m_s: f64,
    /// Most pitch of the body at the end, of jumps that land, rad.
    pub end_pitch_rad: f64,
    /// Height below that of the training jumps' landings, and around that of their ends, m.
    pub height_slack_m: f64,
    /// Convex programs at most.
    pub programs: usize,
    /// Input deviation beyond which a plan comes with a warning.
    pub warn_deviation: f64,
    /// Input deviation beyond which a plan is refused.
    pub refuse_deviation: f64,
    /// Distance of goals from the range of the training jumps, in widths of it, beyond which they
    /// are not tried.
    pub reach: f64,
}

impl Default for PlanSettings {
    fn default() -> Self {
        Self {
            input: 2.0,
            posture: 0.5,
            rate: 0.1,
            smoothness: 3.0,
            feet: 3.0,
            foot_m: [0.005, 0.004],
            duration: [4.0, 0.0],
            first_duration: 400.0,
            inset: 0.3,
            torque_share: 0.9,
            friction: 0.6,
            friction_slack_n: 10.0,
            end_speed_m_s: 0.03,
            end_pitch_rad: 0.06,
            height_slack_m: 0.02,
            programs: 8,
            warn_deviation: 0.6,
            refuse_deviation: 1.2,
            reach: 1.5,
        }
    }
}

impl PlanSettings {
    /// Complains about the first number that no plan can be made with.
    ///
    /// # Errors
    /// The name with what was found and expected.
    pub fn check(&self) -> Result<(), String> {
        let at_least_zero = [
            ("input", self.input),
            ("posture", self.posture),
            ("rate", self.rate),
            ("smoothness", self.smoothness),
            ("feet", self.feet),
            ("duration", self.duration[0]),
            ("duration", self.duration[1]),
            ("first_duration", self.first_duration),
            ("friction", self.friction),
            ("friction_slack_n", self.friction_slack_n),
            ("end_speed_m_s", self.end_speed_m_s),
            ("end_pitch_rad", self.end_pitch_rad),
            ("height_slack_m", self.height_slack_m),
            ("warn_deviation", self.warn_deviation),
            ("refuse_deviation", self.refuse_deviation),
            ("reach", self.reach),
        ];
        for (name, found) in at_least_zero {
            if !(found.is_finite() && found >= 0.0) {
                return Err(format!(
                    "`{name}` is {found}, expected a number of at least 0"
                ));
            }
        }
        let inside = [
            ("inset", self.inset, 0.5),
            ("torque_share", self.torque_share, 1.0),
            ("foot_m", self.foot_m[0], 1.0),
            ("foot_m", self.foot_m[1], 1.0),
        ];
        for (name, found, most) in inside {
            if !(0.0..=most).contains(&found) {
                return Err(format!("`{name}` is {found}, expected 0 to {most}"));
            }
        }
        if self.foot_m.contains(&0.0) || self.input == 0.0 || self.programs == 0 {
            return Err(
                "`foot_m`, `input` or `programs` is 0, expected a positive number".to_owned(),
            );
        }
        Ok(())
    }
}
