//! A walk at a commanded velocity as the reference of a controller, which moves on with the time.
//!
//! In: [`Strides`] of a model. Out: the controller's reference, a window of samples. Read `walker` first.

use super::controller::Controller;
use super::error::ControlError;
use super::reference::ReferenceSamples;
use super::walker::{AHEAD_S, Gait, NODE, PAST, SPACING_S, WINDOW, Walker};
use crate::robot::{ContactFlags, FOOT_DIM, JOINT_DIM, STATE_DIM};

/// A stride over the velocity.
#[derive(Debug, Clone)]
pub struct Strides {
    /// The gait of all strides.
    pub gait: Gait,
    /// 160 numbers per node: 18 states, 12 torques at the links and 6 zeros, 4 feet at rest. Then follow the changes of
    /// these 40 with the velocity forwards (m/s), to the left (m/s) and of yaw (rad/s).
    pub nodes: Vec<f64>,
}

#[derive(Debug)]
pub(super) struct Walk {
    pub strides: Strides,
    pub walker: Box<Walker>,
}

impl Walk {
    /// Makes a controller follow the strides, beginning with the stand. Scales and limits are those of the mean gait.
    pub(super) fn new(strides: Strides, controller: &mut Controller) -> Result<Self, ControlError> {
        let expected = strides.gait.count * NODE;
        if strides.nodes.len() != expected || expected == 0 {
            return Err(ControlError::ReferenceShape {
                name: "nodes",
                found: strides.nodes.len(),
                expected,
            });
        }
        let settings = controller.settings();
        let reach_s = settings.horizon as f64 * settings.step_s + AHEAD_S;
        let needed = (reach_s / SPACING_S).ceil() as usize + PAST;
        if needed > WINDOW {
            return Err(ControlError::ReferenceLen {
                found: WINDOW,
                expected: needed,
            });
        }
        let patterns =
            (0..1 << FOOT_DIM).map(|bits| std::array::from_fn(|foot| bits >> foot & 1 == 1));
        for (sample, feet) in patterns.enumerate() {
            if controller.plant().phase_for(feet).is_none() {
                return Err(ControlError::ReferencePhase { sample, feet });
            }
        }
        let mut walk = Self {
            strides,
            walker: Box::new(Walker::new()),
        };
        walk.walker.clear(&walk.strides.gait);
        walk.walker.set_to_mean(&walk.strides.gait);
        // The first ones come from the stand.
        for _ in 0..2 * WINDOW {
            walk.advance(controller, 1.0);
        }
        let feet: Vec<ContactFlags> = (0..WINDOW).map(|i| walk.feet(i)).collect();
        controller.set_reference(ReferenceSamples {
            time_s: &walk.walker.time_s,
            x: &walk.walker.x,
            dx: &walk.walker.dx,
            u: Some(&walk.walker.u),
            feet: &feet,
        })?;
        walk.stand(controller);
        Ok(walk)
    }

    /// Begins anew with the stand, at time 0.
    pub(super) fn stand(&mut self, controller: &mut Controller) {
        self.walker.clear(&self.strides.gait);
        controller.take_window(self, WINDOW);
    }

    /// Samples for a horizon that begins at a time.
    pub(super) fn extend(&mut self, controller: &mut Controller, time_s: f64, range_s: f64) {
        let settings = controller.settings();
        let horizon_s = settings.horizon as f64 * settings.step_s;
        let mut new = 0;
        while self.walker.lacks(time_s, horizon_s) {
            self.advance(controller, range_s);
            new += 1;
        }
        if new > 0 {
            controller.take_window(self, new);
        }
    }

    fn advance(&mut self, controller: &Controller, range_s: f64) {
        let Strides { gait, nodes } = &self.strides;
        self.walker.advance(gait, nodes, range_s);
        let (last, torque) = (WINDOW - 1, self.walker.torque);
        let x: [f64; STATE_DIM] = std::array::from_fn(|i| self.walker.x[STATE_DIM * last + i]);
        let mut input = [0.0; STATE_DIM];
        input.copy_from_slice(&gait.stand[STATE_DIM..]);
        let rule = controller.plant().input_rule();
        if let Ok(wrench) = rule.input_wrench(&x, &torque, self.feet(last)) {
            input[..JOINT_DIM].copy_from_slice(&torque);
            input[JOINT_DIM..].copy_from_slice(wrench.as_slice());
        }
        self.walker.keep_input(gait, &input);
    }

    pub(super) fn feet(&self, sample: usize) -> ContactFlags {
        std::array::from_fn(|foot| self.walker.feet[FOOT_DIM * sample + foot])
    }
}
