//! Contacts that cannot be: a foot on the ground above the floor, a body in the air that does not fall, a walk on just
//! the other feet. This file is translated to C.
//!
//! In: every measured contact with the heights of the feet and the body's vertical velocity. Out: whether contacts have
//! been impossible for too long. Read [`Contacts::are_impossible`] first.

use super::dense::{Real, greater};
use crate::robot::GRAVITY_M_S2;

/// Height above the floor at which a foot is not on it, m.
const FOOT_UP_M: Real = 0.06;
/// Time in the air after which a body has to fall, s, and the least share of gravity.
const FALL_S: f64 = 0.03;
const FALL_SHARE: Real = 0.5;
/// Longest time that a walk may be on the other feet: twice that by which feet may be early, s.
const OPPOSED_S: f64 = 0.08;

/// Times since which contacts are as they are, and the floor.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Contacts {
    /// Height of the reference's highest foot on the ground, m.
    floor_m: Real,
    /// Since when no foot is on the ground, s, and the vertical velocity then, m/s.
    is_aloft: bool,
    aloft_s: f64,
    aloft_m_s: Real,
    /// Since when contacts cannot be, s.
    is_contradicted: bool,
    contradicted_s: f64,
    /// Since when a walk is on the other feet, s.
    is_opposed: bool,
    opposed_s: f64,
}

impl Contacts {
    /// Forgets measurements, but not the floor.
    pub(super) fn forget(&mut self) {
        self.is_aloft = false;
        self.is_contradicted = false;
        self.is_opposed = false;
    }

    /// Raises the floor to the height, m, of a foot that the reference has on the ground.
    pub(super) fn raise_floor(&mut self, is_first: bool, height: Real) {
        self.floor_m = if is_first {
            height
        } else {
            greater(height, self.floor_m)
        };
    }

    /// Whether contacts have been impossible for `most_steps` steps, which disable the check if they are zero. The body
    /// rises at `rises`, m/s; `heights` are those of the feet, m, `is_down` the measured feet on the ground, `walks_on`
    /// those that a walk has there.
    pub(super) fn are_impossible(
        &mut self,
        most_steps: usize,
        time_s: f64,
        step_s: f64,
        rises: Real,
        heights: &[Real],
        is_down: &[bool],
        walks_on: &[bool],
    ) -> bool {
        self.contradicts(most_steps, time_s, step_s, rises, heights, is_down)
            || self.opposes(most_steps, time_s, is_down, walks_on)
    }

    /// Whether contacts have been impossible for too long: a foot on the ground is above the floor, or a body without a
    /// foot on the ground does not fall.
    fn contradicts(
        &mut self,
        most_steps: usize,
        time_s: f64,
        step_s: f64,
        rises: Real,
        heights: &[Real],
        is_down: &[bool],
    ) -> bool {
        let mut is_wrong = false;
        let mut is_aloft = true;
        for foot in 0..4 {
            let is_up = heights[foot] > self.floor_m + FOOT_UP_M;
            is_wrong = is_wrong || (is_down[foot] && is_up);
            is_aloft = is_aloft && !is_down[foot];
        }
        if is_aloft && !self.is_aloft {
            self.aloft_s = time_s;
            self.aloft_m_s = rises;
        }
        self.is_aloft = is_aloft;
        let passed_s = time_s - self.aloft_s;
        let least = FALL_SHARE * (GRAVITY_M_S2 as Real) * (passed_s as Real);
        let falls = rises - self.aloft_m_s < -least;
        if is_aloft && passed_s > FALL_S && !falls {
            is_wrong = true;
        }
        if is_wrong && !self.is_contradicted {
            self.contradicted_s = time_s;
        }
        self.is_contradicted = is_wrong;
        let steps = 1.0 + (time_s - self.contradicted_s) / step_s;
        let most = most_steps as f64;
        is_wrong && most > 0.0 && steps > most - 0.5
    }

    /// Whether a walk has for too long been on just the other feet than measured.
    fn opposes(
        &mut self,
        most_steps: usize,
        time_s: f64,
        is_down: &[bool],
        walks_on: &[bool],
    ) -> bool {
        let mut is_opposed = true;
        let mut changes = false;
        for foot in 0..4 {
            is_opposed = is_opposed && is_down[foot] != walks_on[foot];
            changes = changes || walks_on[foot] != walks_on[0];
        }
        is_opposed = is_opposed && changes;
        if is_opposed && !self.is_opposed {
            self.opposed_s = time_s;
        }
        self.is_opposed = is_opposed;
        is_opposed && most_steps > 0 && time_s - self.opposed_s > OPPOSED_S
    }
}
