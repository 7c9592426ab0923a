//! A trajectory at any time, wherever its samples are. C is made of this file.
//!
//! In: samples, by the required methods of [`Trajectory`]. Out: states, inputs, phases, accelerations. Between samples
//! states are on the straight line; before the first and after the last the end is held at rest.

use super::dense::{MOST_LATENT, MOST_STATE, Real, add_scaled, greater};

/// Times closer than this are the same, s.
const TIME_TOLERANCE_S: f64 = 1e-9;
/// Half width of the window in which velocities are fitted by a straight line, s.
const HALF_WINDOW_S: f64 = 0.016 + 1e-9;
/// Smallest standard deviation against the largest of the same kind.
const DEVIATION_FLOOR: Real = 1e-2;
/// Share of a joint's half range within which a trajectory stands still.
const STILL_SHARE: Real = 0.02;
/// Time in which one that stands still might cover that, s.
const STILL_TIME_S: Real = 0.1;
/// Distance from the reference, in its standard deviations, within which joint limits matter.
const STATE_REACH: Real = 4.0;
/// Share of a stage from which on a command counts as held for all of it.
const WHOLE_STAGE: f64 = 0.75;
/// By how much feet may touch down too early, s.
pub(super) const EARLY_S: f64 = 0.04;
/// Phase of feet that select none.
pub const NO_PHASE: usize = 255;

/// Where a time is: the last sample at or before it, and how far it is on the way to the next one.
pub(super) struct Instant {
    pub sample: usize,
    pub share: Real,
}

/// Whether the feet are where the reference has them.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Contact {
    AsScheduled,
    Early,
    Late,
    Unknown,
}

pub(super) trait Trajectory {
    fn latent_dim(&self) -> usize;
    fn count(&self) -> usize;
    fn time_s(&self, sample: usize) -> f64;
    fn phase(&self, sample: usize) -> usize;
    fn write_position(&self, sample: usize, z: &mut [Real]);
    fn write_velocity(&self, sample: usize, dz: &mut [Real]);
    fn write_input(&self, sample: usize, input: &mut [Real]);

    fn locate(&self, time_s: f64) -> Instant {
        let count = self.count();
        let mut low: usize = 0;
        let mut high: usize = count;
        while low < high {
            let middle = low + (high - low) / 2;
            // Never so, but analysers of the C do not see it.
            if middle >= count {
                break;
            }
            if self.time_s(middle) <= time_s + TIME_TOLERANCE_S {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        let before = if low > 0 && low <= count { low - 1 } else { 0 };
        let mut share = 0.0;
        if before + 1 < count {
            let start_s = self.time_s(before);
            share = (time_s - start_s) / (self.time_s(before + 1) - start_s);
            share = if share < 0.0 {
                0.0
            } else if share > 1.0 {
                1.0
            } else {
                share
            };
        }
        Instant {
            sample: before,
            share: share as Real,
        }
    }

    /// Writes `(z, dz)` of a sample.
    fn write_state(&self, sample: usize, state: &mut [Real]) {
        self.write_position(sample, state);
        self.write_velocity(sample, &mut state[self.latent_dim()..]);
    }

    /// Writes `(z, dz)` at a time.
    fn state_at(&self, time_s: f64, state: &mut [Real]) {
        let d = self.latent_dim();
        let last = self.count() - 1;
        let at = self.locate(time_s);
        self.write_state(at.sample, state);
        if at.sample < last {
            let mut later: [Real; MOST_STATE] = [0.0; MOST_STATE];
            self.write_state(at.sample + 1, &mut later);
            for i in 0..2 * d {
                state[i] += at.share * (later[i] - state[i]);
            }
        }
        if time_s < self.time_s(0) || time_s > self.time_s(last) {
            for i in d..2 * d {
                state[i] = 0.0;
            }
        }
    }

    fn phase_at(&self, time_s: f64) -> usize {
        let at = self.locate(time_s);
        self.phase(at.sample)
    }

    /// Writes the mean latent input over a time: between two samples their mean, beyond the ends the end's.
    fn mean_input(&self, time_s: f64, duration_s: f64, mean: &mut [Real]) {
        let d = self.latent_dim();
        let last = self.count() - 1;
        let first_s = self.time_s(0);
        let last_s = self.time_s(last);
        let end_s = time_s + duration_s;
        let mut input: [Real; MOST_LATENT] = [0.0; MOST_LATENT];
        let mut next: [Real; MOST_LATENT] = [0.0; MOST_LATENT];
        for i in 0..d {
            mean[i] = 0.0;
        }
        let before_s = (if first_s < end_s { first_s } else { end_s }) - time_s;
        if before_s > 0.0 {
            self.write_input(0, &mut input);
            add_scaled(before_s as Real, &input, d, mean);
        }
        let at = self.locate(time_s);
        let mut has_input = false;
        for sample in at.sample..last {
            let start_s = self.time_s(sample);
            let stop_s = self.time_s(sample + 1);
            if start_s >= end_s {
                break;
            }
            let from_s = if start_s > time_s { start_s } else { time_s };
            let span_s = (if stop_s < end_s { stop_s } else { end_s }) - from_s;
            if span_s > 0.0 {
                let half_s = (0.5 * span_s) as Real;
                if !has_input {
                    self.write_input(sample, &mut input);
                }
                self.write_input(sample + 1, &mut next);
                add_scaled(half_s, &input, d, mean);
                add_scaled(half_s, &next, d, mean);
                input = next;
                has_input = true;
            }
        }
        let after_s = end_s - (if last_s > time_s { last_s } else { time_s });
        if after_s > 0.0 {
            self.write_input(last, &mut input);
            add_scaled(after_s as Real, &input, d, mean);
        }
        for i in 0..d {
            mean[i] /= duration_s as Real;
        }
    }

    /// Shifts the input of a stage to the time for which a command is held. The shift is the difference of the
    /// trajectory's own mean inputs over that time and over the stage. Does nothing for commands that are held for
    /// whole stages.
    fn move_input(&self, stage_s: f64, step_s: f64, now_s: f64, held_s: f64, input: &mut [Real]) {
        if held_s > WHOLE_STAGE * step_s {
            return;
        }
        let mut held: [Real; MOST_LATENT] = [0.0; MOST_LATENT];
        let mut whole: [Real; MOST_LATENT] = [0.0; MOST_LATENT];
        self.mean_input(now_s, held_s, &mut held);
        self.mean_input(stage_s, step_s, &mut whole);
        for i in 0..self.latent_dim() {
            input[i] += held[i] - whole[i];
        }
    }

    /// Writes the standard deviation of each of `(z, dz)`, never below a hundredth of the largest of its kind; `still`
    /// if that is a motion within which the trajectory stands still.
    fn write_deviations(&self, still: &[Real], deviation: &mut [Real]) {
        let d = self.latent_dim();
        let mut mean: [Real; MOST_STATE] = [0.0; MOST_STATE];
        let mut state: [Real; MOST_STATE] = [0.0; MOST_STATE];
        for sample in 0..self.count() {
            self.write_state(sample, &mut state);
            add_scaled(1.0, &state, 2 * d, &mut mean);
        }
        for i in 0..2 * d {
            mean[i] /= self.count() as Real;
            deviation[i] = 0.0;
        }
        for sample in 0..self.count() {
            self.write_state(sample, &mut state);
            for i in 0..2 * d {
                deviation[i] += (state[i] - mean[i]) * (state[i] - mean[i]);
            }
        }
        let mut is_still = true;
        for i in 0..2 * d {
            deviation[i] = (deviation[i] / self.count() as Real).sqrt();
            is_still = is_still && (i >= d || deviation[i] < still[i]);
        }
        for half in 0..2 {
            let mut least: Real = 0.0;
            for i in half * d..(half + 1) * d {
                least = greater(deviation[i], least);
            }
            let lowest = DEVIATION_FLOOR * least;
            least = if least > 0.0 { lowest } else { 1.0 };
            for i in half * d..(half + 1) * d {
                let own = greater(deviation[i], least);
                deviation[i] = if is_still { still[i] } else { own };
            }
        }
    }

    /// Replaces the scales of latent coordinates along x, y and yaw by the given ones that are positive. `place`
    /// contains for each coordinate the displacement with each of the three (`3 d`), SI.
    fn write_place_scales(
        &self,
        place: &[Real],
        place_m: Real,
        heading_rad: Real,
        deviation: &mut [Real],
    ) {
        for i in 0..self.latent_dim() {
            let path = place[3 * i].abs() + place[3 * i + 1].abs();
            let turn = place[3 * i + 2].abs();
            if place_m > 0.0 && path > 0.0 {
                deviation[i] = place_m * path;
            }
            if heading_rad > 0.0 && turn > 0.0 && path <= 0.0 {
                deviation[i] = heading_rad * turn;
            }
        }
    }

    /// Whether a state within `STATE_REACH` standard deviations of some state of the trajectory reaches `row · z =
    /// bound`.
    fn comes_near(&self, row: &[Real], bound: Real, deviation: &[Real]) -> bool {
        let d = self.latent_dim();
        let mut z: [Real; MOST_LATENT] = [0.0; MOST_LATENT];
        let mut spread: Real = 0.0;
        let mut farthest: Real = 0.0;
        for i in 0..d {
            spread += (row[i] * deviation[i]) * (row[i] * deviation[i]);
        }
        for sample in 0..self.count() {
            self.write_position(sample, &mut z);
            let mut along: Real = 0.0;
            for i in 0..d {
                along += z[i] * row[i];
            }
            let is_less = sample > 0 && farthest > along;
            farthest = if is_less { farthest } else { along };
        }
        farthest + STATE_REACH * spread.sqrt() >= bound
    }

    /// Whether a sample is in the window around another one: in its phase and near in time.
    fn is_beside(&self, sample: usize, other: usize) -> bool {
        let off_s = self.time_s(other) - self.time_s(sample);
        self.phase(other) == self.phase(sample) && off_s <= HALF_WINDOW_S && off_s >= -HALF_WINDOW_S
    }

    /// Writes the slope of the straight line through the velocities around a sample, within its phase.
    fn write_acceleration(&self, sample: usize, slope: &mut [Real]) {
        let d = self.latent_dim();
        let mut first = sample;
        let mut last = sample;
        while first > 0 && self.is_beside(sample, first - 1) {
            first -= 1;
        }
        while last + 1 < self.count() && self.is_beside(sample, last + 1) {
            last += 1;
        }
        // A lone sample of its phase: its neighbours are all there is.
        let is_lone = first == last;
        if is_lone && first > 0 {
            first -= 1;
        }
        if is_lone && last + 1 < self.count() {
            last += 1;
        }
        let mut mean_s = 0.0;
        for other in first..=last {
            mean_s += self.time_s(other);
        }
        mean_s /= (last - first + 1) as f64;
        for i in 0..d {
            slope[i] = 0.0;
        }
        let mut spread = 0.0;
        let mut velocity: [Real; MOST_LATENT] = [0.0; MOST_LATENT];
        for other in first..=last {
            let off_s = self.time_s(other) - mean_s;
            spread += off_s * off_s;
            self.write_velocity(other, &mut velocity);
            add_scaled(off_s as Real, &velocity, d, slope);
        }
        for i in 0..d {
            slope[i] /= spread as Real;
        }
    }

    /// Writes the phases of the stages from a time on: the trajectory's, changed where the feet disagree.
    fn schedule(
        &self,
        time_s: f64,
        step_s: f64,
        measured: usize,
        horizon: usize,
        phases: &mut [usize],
    ) -> Contact {
        for k in 0..horizon {
            phases[k] = self.phase_at(time_s + (k as f64 + 0.5) * step_s);
        }
        if measured == NO_PHASE {
            return Contact::Unknown;
        }
        if measured == phases[0] || measured == self.phase_at(time_s) {
            return Contact::AsScheduled;
        }
        let mut next = horizon;
        let mut last: usize = 0;
        for k in (0..horizon).rev() {
            if phases[k] == measured {
                next = k;
            }
            if self.phase_at(time_s - (k + 1) as f64 * step_s) == measured {
                last = k + 1;
            }
        }
        if next < horizon && (last == 0 || next <= last) {
            for k in 0..next {
                phases[k] = measured;
            }
            return Contact::Early;
        }
        phases[0] = measured;
        if last > 0 {
            Contact::Late
        } else {
            Contact::Unknown
        }
    }
}

/// Interpolates linearly between two states of the robot, or between other quantities.
pub(super) fn write_between(
    earlier: &[Real],
    later: &[Real],
    share: Real,
    count: usize,
    state: &mut [Real],
) {
    for i in 0..count {
        state[i] = earlier[i] + share * (later[i] - earlier[i]);
    }
}

/// Whether times are the same but for rounding.
pub(super) fn is_same_time(time_s: f64, other_s: f64) -> bool {
    let off_s = time_s - other_s;
    off_s < TIME_TOLERANCE_S && off_s > -TIME_TOLERANCE_S
}

/// By how many of its stages a horizon that begins at a time moves on to begin at another: 0 unless they are whole.
pub(super) fn stages_between(from_s: f64, to_s: f64, step_s: f64, horizon: usize) -> usize {
    let passed = (to_s - from_s) / step_s;
    let whole = (passed + 0.5).floor();
    let is_whole = is_same_time((passed - whole) * step_s, 0.0);
    let is_within = is_whole && whole >= 1.0 && whole < horizon as f64;
    if is_within { whole as usize } else { 0 }
}

/// Scale of `(z, dz)` for a trajectory that stands still. For a position it is the change of this latent alone that
/// moves some joint by `STILL_SHARE` of half its range. For a velocity it is that change within `STILL_TIME_S`;
/// `decoder` has `d` columns.
pub(super) fn write_still(
    decoder: &[Real],
    lower: &[Real],
    upper: &[Real],
    d: usize,
    still: &mut [Real],
) {
    for i in 0..d {
        let mut largest: Real = 0.0;
        for joint in 0..12 {
            let share = decoder[joint * d + i].abs() / (0.5 * (upper[joint] - lower[joint]));
            largest = greater(share, largest);
        }
        still[i] = if largest > 0.0 {
            STILL_SHARE / largest
        } else {
            1.0
        };
        still[d + i] = still[i] / STILL_TIME_S;
    }
}
