//! A walk at a commanded velocity, sample by sample: strides of the training, blended. This file is translated to C.
//!
//! In: nodes of a stride over the velocity, a commanded velocity. Out: the samples of the next tenths of a second, in
//! the axes of the path: x along it, y across, yaw from its heading. Read [`Walker::advance`] first.

use super::dense::{Real, smaller};

/// Samples that a walk holds at a time.
pub const WINDOW: usize = 64;
/// Time between samples, s.
pub(super) const SPACING_S: f64 = 0.01;
/// Samples that stay when their time is over: a measurement may be late.
pub(super) const PAST: usize = 16;
/// Samples of the stand that are ahead when a walk starts.
const AHEAD: usize = 16;
/// Time that samples reach beyond the horizon, s.
pub(super) const AHEAD_S: f64 = 0.1;
/// Numbers of a node: state, torques at the links and feet (18 + 18 + 4), then their changes per m/s, m/s and rad/s.
pub(super) const NODE: usize = 160;
/// A turn, rad.
#[allow(clippy::approx_constant)]
const TURN: Real = 6.283185307179586;

/// The gait of a walk in SI units; velocities are along the heading, to the left, and of yaw.
#[derive(Debug, Clone, Copy)]
pub struct Gait {
    /// Nodes of a stride.
    pub count: usize,
    /// Strides a second.
    pub frequency_hz: Real,
    /// Velocities that can be commanded.
    pub least: [Real; 3],
    /// The largest of them.
    pub most: [Real; 3],
    /// The mean of the training.
    pub mean: [Real; 3],
    /// State and input of a robot that stands: z, roll and pitch are its own, x, y and yaw zero.
    pub stand: [Real; 36],
}

/// The samples of a walk and the state from which the next sample is computed.
#[derive(Debug, Clone)]
pub(super) struct Walker {
    /// Velocity that is commanded, and that of the last sample.
    asked: [Real; 3],
    now: [Real; 3],
    /// Whether the robot is to stand, and how many strides it has stepped in place since.
    stops: bool,
    in_place: Real,
    /// From 0, the stand, to 1, the stride; from when on it is 0 again, s.
    amplitude: Real,
    rest_s: f64,
    /// Share of the stride at the last sample.
    share: Real,
    /// Torques at the links of the last sample's stride, N m.
    pub torque: [Real; 12],
    /// Times, states, their rates, inputs and feet of all samples.
    pub time_s: [f64; WINDOW],
    pub x: [Real; 18 * WINDOW],
    pub dx: [Real; 18 * WINDOW],
    pub u: [Real; 18 * WINDOW],
    pub feet: [bool; 4 * WINDOW],
    /// For each sample the path's place (2) and heading in the axes of its beginning, its length along and across
    /// (2), and its turning rate.
    path: [f64; 6 * WINDOW],
}

impl Walker {
    /// Without samples: [`Walker::clear`] makes them.
    pub(super) fn new() -> Self {
        Self {
            asked: [0.0; 3],
            now: [0.0; 3],
            stops: false,
            in_place: 0.0,
            amplitude: 0.0,
            rest_s: 0.0,
            share: 0.0,
            torque: [0.0; 12],
            time_s: [0.0; WINDOW],
            x: [0.0; 18 * WINDOW],
            dx: [0.0; 18 * WINDOW],
            u: [0.0; 18 * WINDOW],
            feet: [true; 4 * WINDOW],
            path: [0.0; 6 * WINDOW],
        }
    }

    /// Stands where the path begins: the walk starts at time 0, the samples before it are those of the stand.
    pub(super) fn clear(&mut self, gait: &Gait) {
        for i in 0..3 {
            self.asked[i] = 0.0;
            self.now[i] = 0.0;
        }
        self.stops = false;
        self.in_place = 0.0;
        self.amplitude = 0.0;
        self.rest_s = 0.0;
        self.share = 0.0;
        for sample in 0..WINDOW {
            self.time_s[sample] = (sample as f64 - (WINDOW - AHEAD) as f64) * SPACING_S;
            for i in 0..18 {
                self.x[18 * sample + i] = gait.stand[i];
                self.dx[18 * sample + i] = 0.0;
                self.u[18 * sample + i] = gait.stand[18 + i];
            }
            for foot in 0..4 {
                self.feet[4 * sample + foot] = true;
            }
            for i in 0..6 {
                self.path[6 * sample + i] = 0.0;
            }
        }
    }

    /// Sets the commanded velocity, clamped to the allowed range.
    pub(super) fn command(&mut self, gait: &Gait, velocity: &[Real]) {
        self.stops = false;
        for i in 0..3 {
            let enough = if velocity[i] < gait.least[i] {
                gait.least[i]
            } else {
                velocity[i]
            };
            self.asked[i] = smaller(enough, gait.most[i]);
        }
    }

    /// Slows down, then stands.
    pub(super) fn stop(&mut self) {
        self.stops = true;
        for i in 0..3 {
            self.asked[i] = 0.0;
        }
    }

    /// At once the training's mean gait.
    pub(super) fn set_to_mean(&mut self, gait: &Gait) {
        for i in 0..3 {
            self.asked[i] = gait.mean[i];
            self.now[i] = gait.mean[i];
        }
        self.amplitude = 1.0;
    }

    /// Whether the samples end before a horizon of a time does. Not so for times beyond them: the clock has leapt.
    pub(super) fn lacks(&self, time_s: f64, horizon_s: f64) -> bool {
        let last_s = self.time_s[WINDOW - 1];
        time_s <= last_s && last_s < time_s + (horizon_s + AHEAD_S)
    }

    /// Whether a walk stands at a time: it was stopped, or it has no samples left because the clock leapt without a
    /// supervisor.
    pub(super) fn rests(&self, time_s: f64) -> bool {
        let stands = self.stops && self.amplitude <= 0.0 && time_s >= self.rest_s;
        stands || time_s > self.time_s[WINDOW - 1]
    }

    /// Moves all samples by one to the front.
    fn shift(&mut self) {
        for sample in 0..WINDOW - 1 {
            self.time_s[sample] = self.time_s[sample + 1];
        }
        for i in 0..18 * (WINDOW - 1) {
            self.x[i] = self.x[i + 18];
            self.dx[i] = self.dx[i + 18];
            self.u[i] = self.u[i + 18];
        }
        for i in 0..4 * (WINDOW - 1) {
            self.feet[i] = self.feet[i + 4];
        }
        for i in 0..6 * (WINDOW - 1) {
            self.path[i] = self.path[i + 6];
        }
        self.time_s[WINDOW - 1] = self.time_s[WINDOW - 2] + SPACING_S;
    }

    /// Velocity, amplitude and share of the stride of one more sample. A velocity changes at most by its range in
    /// `range_s`.
    fn pace(&mut self, gait: &Gait, range_s: f64) {
        let part = (SPACING_S / range_s) as Real;
        let mut is_slow = true;
        for i in 0..3 {
            let most = part * (gait.most[i] - gait.least[i]);
            let missing = self.asked[i] - self.now[i];
            self.now[i] = if missing > most {
                self.now[i] + most
            } else if missing < -most {
                self.now[i] - most
            } else {
                self.asked[i]
            };
            is_slow = is_slow && self.now[i].abs() <= 0.0;
        }
        let stride = (SPACING_S as Real) * gait.frequency_hz;
        let had = self.amplitude;
        self.in_place = if self.stops && is_slow {
            self.in_place + stride
        } else {
            0.0
        };
        // A stride in place brings the feet below the hips.
        let ends = self.in_place > 1.0;
        let changed = if ends { had - stride } else { had + stride };
        let least: Real = if changed > 0.0 { changed } else { 0.0 };
        self.amplitude = smaller(least, 1.0);
        if self.amplitude <= 0.0 && had > 0.0 {
            self.rest_s = self.time_s[WINDOW - 1];
        }
        self.share += stride;
        if self.share >= 1.0 {
            self.share -= 1.0;
        }
        if self.amplitude <= 0.0 {
            self.share = 0.0;
        }
    }

    /// The path's next place, by the velocity along the heading in the middle of the step.
    fn move_along(&mut self) {
        let step = SPACING_S as Real;
        let at = 6 * (WINDOW - 1);
        let before = at - 6;
        let turn = step * self.now[2];
        let middle = (self.path[before + 2] as Real) + 0.5 * turn;
        let along = step * self.now[0];
        let across = step * self.now[1];
        let x = middle.cos() * along - middle.sin() * across;
        let y = middle.sin() * along + middle.cos() * across;
        self.path[at] = self.path[before] + (x as f64);
        self.path[at + 1] = self.path[before + 1] + (y as f64);
        self.path[at + 2] = self.path[before + 2] + (turn as f64);
        self.path[at + 3] = self.path[before + 3] + (along as f64);
        self.path[at + 4] = self.path[before + 4] + (across as f64);
        self.path[at + 5] = self.now[2] as f64;
    }

    /// A number of a node at the velocity of the last sample.
    fn at_node(&self, nodes: &[Real], node: usize, i: usize) -> Real {
        let mut value = nodes[NODE * node + i];
        for k in 0..3 {
            value += self.now[k] * nodes[NODE * node + 40 * (k + 1) + i];
        }
        value
    }

    /// One more sample at the end, in place of the first. Its torques are in `torque`; pass the input that they produce
    /// to [`Walker::keep_input`].
    pub(super) fn advance(&mut self, gait: &Gait, nodes: &[Real], range_s: f64) {
        self.shift();
        self.pace(gait, range_s);
        self.move_along();
        let place = self.share * (gait.count as Real);
        let whole = place as usize;
        let node = if whole < gait.count { whole } else { 0 };
        let next = if node + 1 < gait.count { node + 1 } else { 0 };
        let between = place - (whole as Real);
        let mut row: [Real; 40] = [0.0; 40];
        for i in 0..40 {
            let from = self.at_node(nodes, node, i);
            row[i] = from + between * (self.at_node(nodes, next, i) - from);
        }
        let last = WINDOW - 1;
        for i in 0..18 {
            let at = 18 * last + i;
            self.x[at] = gait.stand[i] + self.amplitude * (row[i] - gait.stand[i]);
        }
        for i in 0..2 {
            self.x[18 * last + 12 + i] += self.path[6 * last + 3 + i] as Real;
        }
        let step = SPACING_S as Real;
        for i in 18 * last..18 * (last + 1) {
            self.dx[i - 18] = (self.x[i] - self.x[i - 36]) / (2.0 * step);
            self.dx[i] = (self.x[i] - self.x[i - 18]) / step;
        }
        for joint in 0..12 {
            self.torque[joint] = row[18 + joint];
        }
        for foot in 0..4 {
            self.feet[4 * last + foot] = self.amplitude <= 0.0 || row[36 + foot] > 0.5;
        }
    }

    /// Stores the generalised input (18) of the last sample's stride.
    pub(super) fn keep_input(&mut self, gait: &Gait, u: &[Real]) {
        for i in 0..18 {
            let stand = gait.stand[18 + i];
            self.u[18 * (WINDOW - 1) + i] = stand + self.amplitude * (u[i] - stand);
        }
    }

    /// Moves a state and its velocity from where the walk began to the axes of the path at a time.
    pub(super) fn move_to_path(&self, time_s: f64, x: &mut [Real], dx: &mut [Real]) {
        let passed = (time_s - self.time_s[0]) / SPACING_S;
        let mut sample: usize = 0;
        let mut share: Real = 0.0;
        if passed > 0.0 {
            let is_within = passed < ((WINDOW - 1) as f64);
            sample = if is_within {
                passed as usize
            } else {
                WINDOW - 2
            };
            let within = (passed - (sample as f64)) as Real;
            share = smaller(within, 1.0);
        }
        let mut at: [Real; 6] = [0.0; 6];
        for i in 0..6 {
            let from = self.path[6 * sample + i];
            at[i] = (from + (share as f64) * (self.path[6 * (sample + 1) + i] - from)) as Real;
        }
        let cosine = at[2].cos();
        let sine = at[2].sin();
        let along = x[12] - at[0];
        let across = x[13] - at[1];
        x[12] = at[3] + (cosine * along + sine * across);
        x[13] = at[4] + (cosine * across - sine * along);
        let turned = x[17] - at[2];
        let turns = (turned / TURN) as f64;
        x[17] = turned - TURN * ((turns + 0.5).floor() as Real);
        let forward = dx[12];
        dx[12] = cosine * forward + sine * dx[13];
        dx[13] = cosine * dx[13] - sine * forward;
        dx[17] -= at[5];
    }
}
