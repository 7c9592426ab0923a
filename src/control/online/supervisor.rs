//! Supervisor: faults of measurements of a robot under control, and the damping that follows. This file is translated
//! to C.
//!
//! In: every measurement with the reference's state at its time. Out: a [`Fault`], which stays until a reset, and
//! torques that fade into joint damping. A measurement beyond a bound is refused, because it may be a glitch. After
//! [`PATIENCE_S`] of such measurements, or in the first measurement, it is a fault. The clock, repeated measurements,
//! [`Contacts`] and steps without a good plan are also checked. Read [`Supervisor::watch`] first.

use super::contacts::Contacts;
use super::control_model::{clamped_joint, clamped_torque};
use super::dense::{Real, greater, smaller};

/// How long measurements are refused before they are a fault, s.
const PATIENCE_S: f64 = 0.019;
/// Tilts from half a turn on are none.
const HALF_TURN: Real = 3.1;
/// Cosine of the angle between the body's and the vertical downwards above which a robot is near upside down.
const UPSIDE_DOWN: Real = 0.5;
/// The first measurement must be within this share of the distances from the reference. Every later one must be within
/// it of a prediction: the last good measurement moved by its velocity, or by the mean of both velocities.
pub(super) const NEAR: Real = 0.5;
/// How far a clock may go back, s: measurements may be exchanged.
const CLOCK_JITTER_S: f64 = 0.005;
/// A gap of up to this many steps between two measurements is always accepted.
const LONGEST_STEPS: f64 = 1.5;
/// Time over which velocities are compared with positions, s.
const MEMORY_S: Real = 0.05;
/// How far a reference moves, rad or m, while a measurement that stays the same is not believed.
const REFERENCE_MOVES: Real = 0.01;

/// Bounds of measurements, and the damping that follows a violation; infinite bounds and counts of zero disable a
/// check. `docs/explanation/supervisor.md`, "The supervisor", defines the quantity that each bound limits.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs, reason = "the table of settings describes them")]
pub struct Bounds {
    pub tilt_rad: Real,
    pub joint_margin_rad: Real,
    pub joint_velocity: Real,
    pub distance_m: Real,
    pub posture_rad: Real,
    pub clock_gap_s: f64,
    pub frozen_steps: usize,
    pub velocity_mismatch: Real,
    pub contact_mismatch_steps: usize,
    pub poor_steps: usize,
    pub fade_s: f64,
    pub damping_nm_s_rad: Real,
    pub damping_torque_nm: Real,
}

impl Bounds {
    /// Nothing is watched.
    pub const OFF: Self = Self {
        tilt_rad: f64::INFINITY,
        joint_margin_rad: f64::INFINITY,
        joint_velocity: f64::INFINITY,
        distance_m: f64::INFINITY,
        posture_rad: f64::INFINITY,
        clock_gap_s: f64::INFINITY,
        frozen_steps: 0,
        velocity_mismatch: f64::INFINITY,
        contact_mismatch_steps: 0,
        poor_steps: 0,
        ..Self::USUAL
    };
    /// No valid recording, plan or simulated jump of the repository comes near these bounds; see `docs/explanation/supervisor.md`.
    pub(super) const USUAL: Self = Self {
        tilt_rad: 0.5,
        joint_margin_rad: 0.1,
        joint_velocity: 1.5,
        distance_m: 0.3,
        posture_rad: 0.8,
        clock_gap_s: 0.1,
        frozen_steps: 8,
        velocity_mismatch: 0.3,
        contact_mismatch_steps: 5,
        poor_steps: 10,
        fade_s: 0.1,
        damping_nm_s_rad: 1.0,
        damping_torque_nm: 10.0,
    };
}

/// A kind of fault. Each has a status.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Fault {
    #[default]
    None,
    Tilt,
    JointBeyond,
    JointSpeed,
    BodyFar,
    JointsFar,
    BodyLeap,
    JointsLeap,
    NotAtStart,
    ClockStands,
    ClockBack,
    ClockLeaps,
    Frozen,
    VelocityMismatch,
    ContactMismatch,
    PoorSteps,
}

/// State of the supervisor between measurements.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Supervisor {
    /// The present fault; it stays until a reset.
    pub fault: Fault,
    /// Time in which torques have faded so far, s.
    faded_s: f64,
    /// Whether there was a measurement, and the latest time of one, s.
    has_time: bool,
    time_s: f64,
    /// Calls in a row without a later time.
    standing: usize,
    /// The last measurement of state and velocity, how often it was the same, and the reference when it first was.
    seen_x: [Real; 18],
    seen_dx: [Real; 18],
    frozen: usize,
    nominal: [Real; 18],
    /// The last measurement within all bounds, with its time, s.
    has_good: bool,
    good_s: f64,
    good_x: [Real; 18],
    good_dx: [Real; 18],
    /// Whether the present one is beyond a bound, and since when measurements are, s.
    pub is_doubted: bool,
    doubted_s: f64,
    /// Displacement of the body that its velocity does not explain, fading, m.
    unexplained: [Real; 3],
    pub contacts: Contacts,
    /// Time without a good plan, s, and that of a step.
    poor_s: f64,
    pub step_s: f64,
}

impl Supervisor {
    /// One without memories.
    pub(super) fn of_step(step_s: f64) -> Self {
        Self {
            step_s,
            ..Self::default()
        }
    }

    /// Forgets measurements, but neither a fault nor the floor.
    pub(super) fn forget(&mut self) {
        if self.fault == Fault::None {
            self.faded_s = 0.0;
        }
        self.has_time = false;
        self.standing = 0;
        self.frozen = 0;
        self.has_good = false;
        self.is_doubted = false;
        self.contacts.forget();
        self.poor_s = 0.0;
        for i in 0..3 {
            self.unexplained[i] = 0.0;
        }
    }

    /// Forgets measurements and the fault.
    pub(super) fn reset(&mut self) {
        self.forget();
        self.fault = Fault::None;
        self.faded_s = 0.0;
    }

    /// Checks a finite measurement of state and velocity, 18 each, and returns the fault. `nominal` is the reference's
    /// state, `heights` those of the feet (m), `is_down` the feet on the ground. `walks_on` are the feet that a walk
    /// has on the ground, for other references the measured ones.
    pub(super) fn watch(
        &mut self,
        bounds: &Bounds,
        time_s: f64,
        x: &[Real],
        dx: &[Real],
        nominal: &[Real],
        heights: &[Real],
        is_down: &[bool],
        walks_on: &[bool],
        lower: &[Real],
        upper: &[Real],
        speed: &[Real],
    ) -> Fault {
        if self.fault != Fault::None {
            return self.fault;
        }
        let is_first = !self.has_time;
        self.fault = self.clock_fault(bounds, time_s);
        if self.fault == Fault::None && self.is_frozen(bounds, x, dx, nominal) {
            self.fault = Fault::Frozen;
        }
        if self.fault != Fault::None {
            return self.fault;
        }
        let state = self.state_fault(bounds, time_s, x, dx, nominal, lower, upper, speed);
        if state != Fault::None {
            let is_far = state == Fault::BodyFar || state == Fault::JointsFar;
            if !self.is_doubted {
                self.doubted_s = time_s;
            }
            self.is_doubted = true;
            if is_first {
                self.fault = if is_far { Fault::NotAtStart } else { state };
            } else if time_s - self.doubted_s >= PATIENCE_S {
                self.fault = state;
            }
            return self.fault;
        }
        self.is_doubted = false;
        if self.is_unexplained(bounds, time_s, x, dx) {
            self.fault = Fault::VelocityMismatch;
        } else if self.contacts.are_impossible(
            bounds.contact_mismatch_steps,
            time_s,
            self.step_s,
            dx[14],
            heights,
            is_down,
            walks_on,
        ) {
            self.fault = Fault::ContactMismatch;
        }
        self.has_good = true;
        self.good_s = time_s;
        for i in 0..18 {
            self.good_x[i] = x[i];
            self.good_dx[i] = dx[i];
        }
        self.fault
    }

    /// Whether the clock stands, goes back or leaps.
    fn clock_fault(&mut self, bounds: &Bounds, time_s: f64) -> Fault {
        let passed_s = time_s - self.time_s;
        let is_first = !self.has_time;
        let is_later = is_first || passed_s > 0.0;
        self.standing = if is_later { 0 } else { self.standing + 1 };
        if is_later {
            self.time_s = time_s;
        }
        self.has_time = true;
        if is_first || bounds.clock_gap_s > 1e9 {
            return Fault::None;
        }
        if passed_s > bounds.clock_gap_s && passed_s > LONGEST_STEPS * self.step_s {
            return Fault::ClockLeaps;
        }
        if passed_s < -CLOCK_JITTER_S {
            return Fault::ClockBack;
        }
        let is_counted = bounds.frozen_steps > 0;
        if is_counted && self.standing >= bounds.frozen_steps {
            return Fault::ClockStands;
        }
        Fault::None
    }

    /// Whether a measurement was the same too often: one that moves, or while the reference does.
    fn is_frozen(&mut self, bounds: &Bounds, x: &[Real], dx: &[Real], nominal: &[Real]) -> bool {
        let mut is_same = true;
        let mut moves = false;
        for i in 0..18 {
            is_same = is_same && x[i] == self.seen_x[i] && dx[i] == self.seen_dx[i];
            let moved = (nominal[i] - self.nominal[i]).abs();
            moves = moves || dx[i] != 0.0 || moved > REFERENCE_MOVES;
        }
        for i in 0..18 {
            self.seen_x[i] = x[i];
            self.seen_dx[i] = dx[i];
            if !is_same {
                self.nominal[i] = nominal[i];
            }
        }
        self.frozen = if is_same { self.frozen + 1 } else { 0 };
        bounds.frozen_steps > 0 && moves && self.frozen >= bounds.frozen_steps
    }

    /// The first bound that a state is beyond.
    fn state_fault(
        &self,
        bounds: &Bounds,
        time_s: f64,
        x: &[Real],
        dx: &[Real],
        nominal: &[Real],
        lower: &[Real],
        upper: &[Real],
        speed: &[Real],
    ) -> Fault {
        if bounds.tilt_rad < HALF_TURN {
            let along = common_height(&x[15..], &nominal[15..]);
            let upright = x[16].cos() * x[15].cos();
            if along < bounds.tilt_rad.cos() || upright < -UPSIDE_DOWN {
                return Fault::Tilt;
            }
        }
        let mut joints: Real = 0.0;
        for i in 0..12 {
            let margin = bounds.joint_margin_rad;
            if x[i] > upper[i] + margin || x[i] < lower[i] - margin {
                return Fault::JointBeyond;
            }
            if dx[i].abs() > bounds.joint_velocity * speed[i] {
                return Fault::JointSpeed;
            }
            joints = greater((x[i] - nominal[i]).abs(), joints);
        }
        let by_reference: [Real; 3] = [nominal[12], nominal[13], nominal[14]];
        let off = distance(&x[12..], &by_reference);
        if off > bounds.distance_m {
            return Fault::BodyFar;
        }
        if joints > bounds.posture_rad {
            return Fault::JointsFar;
        }
        let is_near = off <= NEAR * bounds.distance_m && joints <= NEAR * bounds.posture_rad;
        if !self.has_good && !is_near {
            return Fault::NotAtStart;
        }
        if self.has_good {
            self.leap(bounds, time_s - self.good_s, x, dx)
        } else {
            Fault::None
        }
    }

    /// Whether a state leaps from its prediction, a time after the last good measurement.
    fn leap(&self, bounds: &Bounds, passed_s: f64, x: &[Real], dx: &[Real]) -> Fault {
        if passed_s > bounds.clock_gap_s {
            return Fault::None;
        }
        let passed = passed_s as Real;
        let mut by_last: [Real; 3] = [0.0; 3];
        let mut by_mean: [Real; 3] = [0.0; 3];
        for i in 0..3 {
            let mean = 0.5 * (self.good_dx[12 + i] + dx[12 + i]);
            by_last[i] = self.good_x[12 + i] + passed * self.good_dx[12 + i];
            by_mean[i] = self.good_x[12 + i] + passed * mean;
        }
        let off = smaller(distance(&x[12..], &by_last), distance(&x[12..], &by_mean));
        if off > NEAR * bounds.distance_m {
            return Fault::BodyLeap;
        }
        for i in 0..12 {
            let moved = x[i] - self.good_x[i];
            let from_last = (moved - passed * self.good_dx[i]).abs();
            let from_mean = (moved - 0.5 * passed * (self.good_dx[i] + dx[i])).abs();
            if smaller(from_last, from_mean) > NEAR * bounds.posture_rad {
                return Fault::JointsLeap;
            }
        }
        Fault::None
    }

    /// Whether the body's velocity contradicts its positions since the last good measurement.
    fn is_unexplained(&mut self, bounds: &Bounds, time_s: f64, x: &[Real], dx: &[Real]) -> bool {
        let passed = (time_s - self.good_s) as Real;
        if !self.has_good || passed <= 0.0 {
            return false;
        }
        let share = passed / MEMORY_S;
        let kept: Real = if share < 1.0 { 1.0 - share } else { 0.0 };
        let mut largest: Real = 0.0;
        for i in 0..3 {
            let moved = x[12 + i] - self.good_x[12 + i];
            let by_velocity = 0.5 * (dx[12 + i] + self.good_dx[12 + i]) * passed;
            let unexplained = kept * self.unexplained[i] + (moved - by_velocity);
            self.unexplained[i] = unexplained;
            largest = greater(unexplained.abs(), largest);
        }
        largest / MEMORY_S > bounds.velocity_mismatch
    }

    /// Adds up the time of steps without a good plan, `passed_s` after the last one; returns the fault.
    pub(super) fn judge(&mut self, bounds: &Bounds, is_poor: bool, passed_s: f64) -> Fault {
        self.poor_s = if is_poor { self.poor_s + passed_s } else { 0.0 };
        let most = bounds.poor_steps as f64;
        let is_counted = most > 0.0 && self.fault == Fault::None;
        if is_counted && self.poor_s / self.step_s > most - 0.5 {
            self.fault = Fault::PoorSteps;
        }
        self.fault
    }

    /// Writes torques that fade from the last ones into the damping of joint velocities, and a posture that fades into
    /// the measured one. Returns the remaining share of the joint PD. `passed_s` is the time since the last command.
    pub(super) fn fade(
        &mut self,
        bounds: &Bounds,
        damping: Real,
        passed_s: f64,
        joints: &[Real],
        velocity: &[Real],
        limit: &[Real],
        lower: &[Real],
        upper: &[Real],
        last_torque: &[Real],
        last_posture: &[Real],
        torque: &mut [Real],
        posture: &mut [Real],
    ) -> Real {
        let passed = (self.faded_s / bounds.fade_s) as Real;
        let share: Real = if passed < 1.0 { 1.0 - passed } else { 0.0 };
        self.faded_s += passed_s;
        for i in 0..12 {
            let damped = clamped_torque(-damping * velocity[i], bounds.damping_torque_nm);
            let faded = share * last_torque[i] + (1.0 - share) * damped;
            torque[i] = clamped_torque(faded, limit[i]);
            let moved = share * last_posture[i] + (1.0 - share) * joints[i];
            posture[i] = clamped_joint(moved, lower[i], upper[i]);
        }
        share
    }
}

/// Cosine of the angle between the verticals of two attitudes, each roll and pitch, rad.
fn common_height(attitude: &[Real], other: &[Real]) -> Real {
    let turned = attitude[1].cos() * other[1].cos();
    let along = attitude[1].sin() * other[1].sin();
    let aside = turned * (attitude[0].sin() * other[0].sin());
    let above = turned * (attitude[0].cos() * other[0].cos());
    along + aside + above
}

fn distance(place: &[Real], other: &[Real; 3]) -> Real {
    let x = place[0] - other[0];
    let y = place[1] - other[1];
    let z = place[2] - other[2];
    (x * x + y * y + z * z).sqrt()
}
