//! Memory and transitions of the state machine in plain numbers, translated to C.
//!
//! In: times, states, contacts. Out: the next [`Mode`], the posture of a stand, a state in the frame of the reference.
//! Read [`Routine`] first, `machine` for its use.

use super::dense::{Real, smaller};
use super::supervisor::{Bounds, NEAR};
use crate::robot::{LegShape, foot_height};

/// Speed of the body below which it stands still, m/s.
const STILL_M_S: Real = 0.1;
/// How long the joints may need, in times that they should, before they are not at the start.
const LATEST: f64 = 2.0;
/// Angle over which the height of a foot is differentiated, rad.
const SMALL_TURN: Real = 1e-3;

/// Modes of the state machine, each with its number for interfaces without enumerations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mode {
    /// The joints are damped: before a start, after a fault, or as requested.
    #[default]
    Damp,
    /// The joints move to the reference's first posture.
    StandUp,
    /// The robot stands at the reference's start.
    Ready,
    /// The controller follows the reference.
    Jump,
    /// The same after the flight, until the robot stands still after the reference's end.
    Land,
    /// The joints move back to the first posture.
    Recover,
    /// The robot walks at the commanded velocity.
    Walk,
}

/// Times of the state machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Time in which the joints move to the reference's first posture, s.
    pub stand_s: f64,
    /// How long the robot stands still before it is ready, and after the reference's end before it recovers, s.
    pub settle_s: f64,
    /// Time in which a commanded velocity goes through its range, s.
    pub range_s: f64,
}

impl Default for Timing {
    fn default() -> Self {
        Self {
            stand_s: 1.5,
            settle_s: 0.3,
            range_s: 2.0,
        }
    }
}

/// Mode of the state machine, memory of its transitions, and frame of the reference.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Routine {
    pub mode: Mode,
    /// Whether a jump was requested, or a walk.
    pub is_asked: bool,
    pub asks_walk: bool,
    /// When the mode began, s, and the joints then, rad.
    since_s: f64,
    from: [Real; 12],
    /// Where the joints move to, rad.
    pub stand: [Real; 12],
    /// Whether no foot was on the ground in this jump.
    has_flown: bool,
    /// Since when the body stands still, s.
    is_still: bool,
    still_s: f64,
    /// The robot's time minus the reference's, s.
    pub offset_s: f64,
    /// A turn about the vertical and a shift: the robot's world to the reference's.
    yaw: Real,
    cosine: Real,
    sine: Real,
    place: [Real; 2],
    start: [Real; 2],
}

impl Routine {
    /// Begins a mode at a time, from a posture.
    pub(super) fn enter(&mut self, mode: Mode, time_s: f64, joints: &[Real]) {
        self.mode = mode;
        self.is_asked = false;
        self.asks_walk = false;
        self.since_s = time_s;
        self.is_still = false;
        for i in 0..12 {
            self.from[i] = joints[i];
        }
    }

    /// Begins a jump or a walk: the reference starts now, where the robot stands and looks.
    pub(super) fn leap(
        &mut self,
        mode: Mode,
        time_s: f64,
        start_s: f64,
        x: &[Real],
        start: &[Real],
    ) {
        self.enter(mode, time_s, x);
        self.has_flown = false;
        self.offset_s = time_s - start_s;
        self.yaw = start[17] - x[17];
        self.cosine = self.yaw.cos();
        self.sine = self.yaw.sin();
        for i in 0..12 {
            self.stand[i] = start[i];
        }
        for i in 0..2 {
            self.place[i] = x[12 + i];
            self.start[i] = start[12 + i];
        }
    }

    /// Writes a state and its velocity in the frame of the reference.
    pub(super) fn write_in_frame(
        &self,
        x: &[Real],
        dx: &[Real],
        framed_x: &mut [Real],
        framed_dx: &mut [Real],
    ) {
        for i in 0..18 {
            framed_x[i] = x[i];
            framed_dx[i] = dx[i];
        }
        let along = x[12] - self.place[0];
        let aside = x[13] - self.place[1];
        framed_x[12] = self.start[0] + self.cosine * along - self.sine * aside;
        framed_x[13] = self.start[1] + self.sine * along + self.cosine * aside;
        framed_x[17] = x[17] + self.yaw;
        framed_dx[12] = self.cosine * dx[12] - self.sine * dx[13];
        framed_dx[13] = self.sine * dx[12] + self.cosine * dx[13];
    }

    /// Writes where the joints should be at a time, rad, and how fast they should move, rad/s; the share of the weight
    /// that they carry.
    pub(super) fn write_posture(
        &self,
        timing: &Timing,
        time_s: f64,
        joints: &mut [Real],
        velocity: &mut [Real],
    ) -> Real {
        let moves = self.mode == Mode::StandUp || self.mode == Mode::Recover;
        let passed = ((time_s - self.since_s) / timing.stand_s) as Real;
        let begun: Real = if passed > 0.0 {
            smaller(passed, 1.0)
        } else {
            0.0
        };
        let done: Real = if moves { begun } else { 1.0 };
        let share = done * done * (3.0 - 2.0 * done);
        let rate = 6.0 * done * (1.0 - done) / (timing.stand_s as Real);
        for i in 0..12 {
            let way = self.stand[i] - self.from[i];
            joints[i] = self.from[i] + share * way;
            velocity[i] = rate * way;
        }
        if self.mode == Mode::StandUp {
            share
        } else {
            1.0
        }
    }

    /// The mode after a measurement of joints that move to the stand: [`Mode::Ready`] when they are there,
    /// [`Mode::Damp`] if they do not arrive.
    pub(super) fn after_standing(
        &mut self,
        bounds: &Bounds,
        timing: &Timing,
        time_s: f64,
        x: &[Real],
        dx: &[Real],
        is_down: &[bool],
    ) -> Mode {
        let passed_s = time_s - self.since_s;
        let mut is_there = passed_s >= timing.stand_s;
        for i in 0..12 {
            let off = (x[i] - self.stand[i]).abs();
            is_there = is_there && off <= NEAR * bounds.posture_rad;
        }
        let rests = self.rests(timing, time_s, is_there, dx, is_down);
        if self.mode == Mode::Ready {
            return self.mode;
        }
        if rests {
            return Mode::Ready;
        }
        if passed_s > LATEST * timing.stand_s {
            Mode::Damp
        } else {
            self.mode
        }
    }

    /// The mode after a measurement of a robot that follows the reference, which may be over.
    pub(super) fn after_jump(
        &mut self,
        timing: &Timing,
        time_s: f64,
        is_over: bool,
        dx: &[Real],
        is_down: &[bool],
    ) -> Mode {
        let mut down = 0;
        for foot in 0..4 {
            if is_down[foot] {
                down += 1;
            }
        }
        self.has_flown = self.has_flown || down == 0;
        let has_landed = is_over || (self.has_flown && down > 0);
        if self.mode == Mode::Jump && has_landed {
            self.mode = Mode::Land;
        }
        let is_done = self.mode == Mode::Land && is_over;
        if self.rests(timing, time_s, is_done, dx, is_down) {
            Mode::Recover
        } else {
            self.mode
        }
    }

    /// Whether a motion that is done has left the body still on four feet for long enough.
    fn rests(
        &mut self,
        timing: &Timing,
        time_s: f64,
        is_done: bool,
        dx: &[Real],
        is_down: &[bool],
    ) -> bool {
        let mut is_still = is_done;
        for foot in 0..4 {
            is_still = is_still && is_down[foot];
        }
        for i in 12..15 {
            is_still = is_still && dx[i].abs() < STILL_M_S;
        }
        if is_still && !self.is_still {
            self.still_s = time_s;
        }
        self.is_still = is_still;
        is_still && time_s - self.still_s >= timing.settle_s
    }
}

/// Writes the torques, N m, with which a leg at a state of the robot presses on the ground with a vertical force. They
/// are the force times minus the gradient of the foot's height.
pub(super) fn write_support(
    leg: &LegShape,
    hip: &[Real],
    x: &[Real],
    q: &[Real],
    force: Real,
    torque: &mut [Real],
) {
    let mut turned: [Real; 3] = [q[0], q[1], q[2]];
    for i in 0..3 {
        turned[i] = q[i] + SMALL_TURN;
        let above = foot_height(leg, hip, x, &turned);
        turned[i] = q[i] - SMALL_TURN;
        let below = foot_height(leg, hip, x, &turned);
        turned[i] = q[i];
        torque[i] = -force * (above - below) / (2.0 * SMALL_TURN);
    }
}
