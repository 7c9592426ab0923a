//! What a jump is to reach.

use nalgebra::DVector;

use super::error::PlanError;
use crate::model::{GOAL_DIM, JumpPrior};

/// A wanted jump.
#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    goal_m: [f64; 2],
    /// State and velocity that the jump starts from, 18 each, SI units.
    pub(super) start: Option<(DVector<f64>, DVector<f64>)>,
}

impl Goal {
    /// A jump forwards by `distance_m`, during which the body rises `apex_m` above its height at the start; from the
    /// mean start of the model's training jumps.
    pub fn new(distance_m: f64, apex_m: f64) -> Result<Self, PlanError> {
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

    /// The same jump from another state and velocity, 18 each, SI units.
    #[must_use]
    pub fn from_start(mut self, x: DVector<f64>, dx: DVector<f64>) -> Self {
        self.start = Some((x, dx));
        self
    }

    pub(crate) fn goal_m(&self) -> [f64; 2] {
        self.goal_m
    }

    /// Refuses goals that are out of all proportion to the training jumps, so that no time is spent on them: farther
    /// from their range than `reach` times its width.
    pub(super) fn check_within(
        &self,
        prior: &JumpPrior,
        start_height_m: f64,
        reach: f64,
    ) -> Result<(), PlanError> {
        // Heights count from wherever the recordings have their zero.
        let names = [
            ("distance", 0.0),
            ("apex", 0.0),
            ("height at the start", f64::NEG_INFINITY),
        ];
        let values = [self.goal_m[0], self.goal_m[1], start_height_m];
        for ((found, range), (what, floor)) in values.into_iter().zip(prior.ranges()).zip(names) {
            let width = (range.most - range.least).max(0.02);
            let least = (range.least - reach * width).max(floor);
            let most = range.most + reach * width;
            if !(least..=most).contains(&found) {
                let expected = format!(
                    "{least:.3} to {most:.3} m: the recorded jumps have {:.3} to {:.3} m",
                    range.least, range.most
                );
                return Err(PlanError::Goal {
                    what,
                    found,
                    expected,
                });
            }
        }
        Ok(())
    }

    /// The goal inside the ranges of the training jumps less a `share` of them at either end: the goal of the
    /// trajectory that the plan starts from. A regression over few jumps is not to be trusted at its ends.
    pub(super) fn clipped(
        &self,
        prior: &JumpPrior,
        start_height_m: f64,
        share: f64,
    ) -> [f64; GOAL_DIM] {
        let values = [self.goal_m[0], self.goal_m[1], start_height_m];
        std::array::from_fn(|i| {
            let range = &prior.ranges()[i];
            let inset = share * (range.most - range.least);
            // Half a range from either end may be past the other by rounding.
            let ends = [range.least + inset, range.most - inset];
            values[i].clamp(ends[0].min(ends[1]), ends[0].max(ends[1]))
        })
    }
}
