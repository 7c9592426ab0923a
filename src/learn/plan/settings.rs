//! Weights and bounds of a plan, and its goal.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::*;
use crate::lower::LowerError;

const ANY: f64 = f64::INFINITY;

/// Makes [`PlanSettings`] of a table: field, default, and the upper end of its range from zero.
macro_rules! settings {
    ($($(#[$doc:meta])* $field:ident: $type:ty = $default:expr, $most:expr;)*) => {
        /// Weights and bounds of a plan. Deviations are relative to the prior, each in standard deviations of the
        /// training, averaged over the coordinates and summed over time in units of 10 ms.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct PlanSettings {
            $($(#[$doc])* pub $field: $type,)*
            pub programs: usize,
        }

        impl Default for PlanSettings {
            fn default() -> Self {
                Self { $($field: $default,)* programs: 8 }
            }
        }

        impl PlanSettings {
            pub fn check(&self) -> Result<(), String> {
                $(check(stringify!($field), self.$field.numbers(), $most)?;)*
                if self.foot_m.contains(&0.0) || self.input == 0.0 || self.programs == 0 {
                    return Err(
                        "`foot_m`, `input` or `programs` is 0, expected a positive number".to_owned(),
                    );
                }
                Ok(())
            }
        }
    };
}

settings! {
    /// Weight of the input's deviation.
    input: f64 = 2.0, ANY;
    /// Weight of the deviation of the posture: the latent coordinates after the second.
    posture: f64 = 0.5, ANY;
    /// Weight of the deviation of the latent velocities.
    rate: f64 = 0.1, ANY;
    /// Weight of the change of the input's deviation in 10 ms.
    smoothness: f64 = 3.0, ANY;
    /// Weight of feet that leave their place, per [`Self::foot_m`].
    feet: f64 = 3.0, ANY;
    /// Weight of feet that rise differently from the prior, per [`Self::foot_m`], and the time of this cost after
    /// take-off, s.
    take_off: f64 = 3.0, ANY;
    take_off_s: f64 = 0.04, 0.1;
    /// Factors on the deviations of the input and of the velocities at the last node before a take-off.
    at_take_off: [f64; 2] = [3.0, 100.0], ANY;
    /// Displacement of a foot along and above the floor that counts one, m.
    foot_m: [f64; 2] = [0.005, 0.004], 1.0;
    /// Weight of durations, per 15 % of change: of parts on the ground, and of the flight.
    duration: [f64; 2] = [4.0, 0.0], ANY;
    /// Weight of the duration of the first part, which leads to the thrust.
    first_duration: f64 = 400.0, ANY;
    /// Share of the training jumps' ranges of goals, at either end, that the prior is kept out of.
    inset: f64 = 0.3, 0.5;
    /// Share of the torque limits that a plan may use at its nodes.
    torque_share: f64 = 0.9, 1.0;
    friction: f64 = 0.6, ANY;
    /// Force that may exceed the friction cone, N: the input's force contains noise.
    friction_slack_n: f64 = 10.0, ANY;
    /// Most speed of the body at the end, of jumps that land, m/s.
    end_speed_m_s: f64 = 0.03, ANY;
    /// Most pitch of the body at the end, of jumps that land, rad.
    end_pitch_rad: f64 = 0.06, ANY;
    /// Height below that of the training jumps' landings, and around that of their ends, m.
    height_slack_m: f64 = 0.02, ANY;
    /// Input deviation beyond which a plan comes with a warning.
    warn_deviation: f64 = 0.6, ANY;
    refuse_deviation: f64 = 1.2, ANY;
    /// Distance of goals from the range of the training jumps, in widths of it, beyond which they are not tried.
    reach: f64 = 1.5, ANY;
}

trait Numbers {
    fn numbers(&self) -> &[f64];
}

impl Numbers for f64 {
    fn numbers(&self) -> &[f64] {
        std::slice::from_ref(self)
    }
}

impl Numbers for [f64; 2] {
    fn numbers(&self) -> &[f64] {
        self
    }
}

fn check(name: &str, numbers: &[f64], most: f64) -> Result<(), String> {
    let is_out = |found: &&f64| !(found.is_finite() && (0.0..=most).contains(*found));
    let Some(found) = numbers.iter().find(is_out) else {
        return Ok(());
    };
    let expected = match most {
        ANY => "a number of at least 0".to_owned(),
        most => format!("0 to {most}"),
    };
    Err(format!("`{name}` is {found}, expected {expected}"))
}

#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    goal_m: [f64; 2],
    /// State and velocity that the jump starts from, 18 each, SI units.
    pub(super) start: Option<(DVector<f64>, DVector<f64>)>,
}

impl Goal {
    /// From the mean start of the training jumps; the body rises `apex_m` above its height there.
    pub fn new(distance_m: f64, apex_m: f64) -> Result<Self> {
        let above = " above the height at the start";
        for (what, found, above) in [("distance", distance_m, ""), ("apex", apex_m, above)] {
            if !(found.is_finite() && found > 0.0) {
                return Err(PlanError::Goal {
                    what,
                    found,
                    expected: format!("a positive number of metres{above}"),
                });
            }
        }
        Ok(Self {
            goal_m: [distance_m, apex_m],
            start: None,
        })
    }

    #[must_use]
    pub fn from_start(mut self, x: DVector<f64>, dx: DVector<f64>) -> Self {
        self.start = Some((x, dx));
        self
    }

    pub(crate) fn goal_m(&self) -> [f64; 2] {
        self.goal_m
    }

    pub(super) fn check_within(&self, prior: &JumpPrior, height_m: f64, reach: f64) -> Result<()> {
        // Heights are relative to the recordings' zero.
        let names = [
            ("distance", 0.0),
            ("apex", 0.0),
            ("height at the start", f64::NEG_INFINITY),
        ];
        let values = [self.goal_m[0], self.goal_m[1], height_m];
        for ((found, range), (what, floor)) in values.into_iter().zip(prior.ranges()).zip(names) {
            let width = (range.most - range.least).max(0.02);
            let least = (range.least - reach * width).max(floor);
            let most = range.most + reach * width;
            if !(least..=most).contains(&found) {
                let recorded = format!("{:.3} to {:.3} m", range.least, range.most);
                let expected =
                    format!("{least:.3} to {most:.3} m: the recorded jumps have {recorded}");
                return Err(PlanError::Goal {
                    what,
                    found,
                    expected,
                });
            }
        }
        Ok(())
    }

    /// Inside the ranges less a `share` at either end: a regression over few jumps is not to be trusted at its ends.
    pub(super) fn clipped(&self, prior: &JumpPrior, height_m: f64, share: f64) -> [f64; GOAL_DIM] {
        let values = [self.goal_m[0], self.goal_m[1], height_m];
        std::array::from_fn(|i| {
            let range = &prior.ranges()[i];
            let inset = share * (range.most - range.least);
            // Half a range from either end may be past the other by rounding.
            let ends = [range.least + inset, range.most - inset];
            values[i].clamp(ends[0].min(ends[1]), ends[0].max(ends[1]))
        })
    }
}

#[derive(Debug, Error)]
pub enum PlanError {
    #[error("{what}: found {found}, expected {expected}")]
    Goal {
        what: &'static str,
        found: f64,
        expected: String,
    },
    #[error("no plan for {} m with an apex of {} m: {found}", goal_m[0], goal_m[1])]
    Unsolved { goal_m: [f64; 2], found: String },
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Lower(#[from] LowerError),
    #[error(transparent)]
    Control(#[from] ControlError),
    #[error(transparent)]
    Recording(#[from] RecordingError),
}
