//! Interpretations of columns, tried on one recording read without scales. Units, order and signs of positions: feet on
//! the ground stay in place. Signs and unit of torques: they carry the body. Scales of velocities: they are
//! derivatives.

use super::*;
use crate::recording::Segment;
use crate::recording::check::quantile;
use crate::recording::mismatch::{foot_place, hip_torque, median_place, stances};
use crate::recording::preprocess::differences_within;
use crate::recording::segment::stretches;

const MOST: (usize, usize) = (40, 24); // most stances of a leg, and most samples of a stance, that are looked at
const OUTSIDE_M: f64 = 4e-3; // that a joint outside of its limits counts as
const TURNED_M: f64 = 1e-4; // that each sign other than the first choice counts as
const BETTER: (f64, f64) = (0.75, 5e-4); // share and difference, m, by which a reading has to beat a plainer one
const LEAST_MOTION_M: f64 = 3e-3; // least movement of feet on stiff legs that shows anything, m
const BLOCK_S: f64 = 0.08; // length of the times over which forces and changes of velocity are summed, s
const OTHER_SIGNS: f64 = 0.5; // share of the unexplained by which other signs have to be better than one sign for all
const UNCARRIED: f64 = 0.8; // share of weight and change of velocity that torques may leave unexplained
const HIP_SHARE: f64 = 0.3; // slope of the hips' torques over those that hold the feet on their side
const FITS_M: f64 = 0.05; // largest movement of feet on the ground in a reading that fits, m

pub(super) type NamedUnit = (&'static str, f64);
pub(super) type Torques = ([f64; JOINT_DIM], NamedUnit); // sign of each joint's torque in romc's order, and their unit

/// How columns are read: units, whether joints are grouped by their kind, and signs in romc's order.
#[derive(Debug, Clone)]
pub(super) struct Reading {
    pub position: NamedUnit,
    pub joint: NamedUnit,
    pub by_kind: bool,
    pub signs: [f64; JOINT_DIM],
    pub slip_m: f64,  // how far feet on the ground move in it, root mean square, m
    motion_m: f64,    // how far they would on stiff legs, small for units that are too small
    shown: [bool; 3], // for each kind of joint whether feet on the ground show its sign
    pub torques: Option<Torques>, // none if they carry no weight
    pub as_well: Vec<Reading>, // others that fit as well
}

impl Reading {
    pub(crate) fn plain(position: NamedUnit, joint: NamedUnit, by_kind: bool) -> Self {
        Self {
            position,
            joint,
            by_kind,
            signs: [1.0; JOINT_DIM],
            slip_m: 0.0,
            motion_m: 0.0,
            shown: [false; 3],
            torques: None,
            as_well: Vec::new(),
        }
    }

    /// Whether feet move clearly less than in a plainer interpretation, relative to their movement on stiff legs.
    pub(crate) fn beats(&self, other: &Self) -> bool {
        let figure = |reading: &Self| match reading.motion_m > LEAST_MOTION_M {
            true => reading.slip_m / reading.motion_m,
            false => 1.0,
        };
        figure(self) < BETTER.0 * figure(other)
    }

    pub(crate) fn fits(&self) -> bool {
        self.slip_m < FITS_M
    }

    pub(crate) fn row(&self, joint: usize) -> usize {
        match self.by_kind {
            true => 4 * (joint % 3) + joint / 3,
            false => joint,
        }
    }
}

pub(super) struct View<'a> {
    robot: &'a Robot,
    recording: &'a Recording,
    stances: Vec<(&'a Segment, Leg, Vec<usize>)>,
}

impl<'a> View<'a> {
    pub(crate) fn of(recording: &'a Recording, robot: &'a Robot) -> Self {
        let of_segment = |segment| stances(segment).into_iter().map(move |own| (segment, own));
        let all: Vec<_> = recording.segments.iter().flat_map(of_segment).collect();
        let every = all.len().div_ceil(4 * MOST.0).max(1);
        let chosen = all.into_iter().step_by(every);
        let thinned = chosen.map(|(segment, (leg, samples))| {
            let step = samples.len().div_ceil(MOST.1).max(1);
            (segment, leg, samples.step_by(step).collect())
        });
        Self {
            robot,
            recording,
            stances: thinned.collect(),
        }
    }

    /// The best interpretation: the first choice of each unit and order unless another is clearly better; none without
    /// stances.
    pub(crate) fn best(&self, units: [&[NamedUnit]; 2], orders: &[bool]) -> Option<Reading> {
        let mut all = Vec::new();
        for position in units[0] {
            for joint in units[1] {
                for by_kind in orders {
                    all.push(self.signed(Reading::plain(*position, *joint, *by_kind))?);
                }
            }
        }
        let better = |best: usize, at: usize| if all[at].beats(&all[best]) { at } else { best };
        let best = (0..all.len()).reduce(better)?;
        let mut chosen = all.swap_remove(best);
        all.retain(|other| other.fits() && !chosen.beats(other));
        chosen.as_well = all;
        Some(chosen)
    }

    /// A plain reading with the signs under which feet stay best in place.
    fn signed(&self, mut reading: Reading) -> Option<Reading> {
        let combination = |code: usize| -> [f64; 3] {
            std::array::from_fn(|kind| if code >> kind & 1 == 1 { -1.0 } else { 1.0 })
        };
        // Sums of squares and counts by leg, with equal signs on all legs.
        let tried = (0..8).map(|code| {
            let signs = combination(code);
            reading.signs = std::array::from_fn(|i| signs[i % 3]);
            Leg::ALL.map(|leg| self.moved(&reading, leg))
        });
        let tried: Vec<[(f64, usize); 4]> = tried.collect();
        let rms = |parts: &[(f64, usize)]| {
            let add = |all: (f64, usize), part: &(f64, usize)| (all.0 + part.0, all.1 + part.1);
            let (sum, count) = parts.iter().fold((0.0, 0), add);
            (count > 0).then(|| (sum / count as f64).sqrt())
        };
        let least = |figures: &[f64]| {
            let best = (0..8).min_by(|a, b| figures[*a].total_cmp(&figures[*b]));
            best.expect("invariant: eight figures")
        };
        let whole = tried.iter().map(|parts| rms(parts));
        let whole: Vec<f64> = whole.collect::<Option<_>>()?;
        let best = least(&whole);
        reading.shown = std::array::from_fn(|kind| {
            let turned = whole[best ^ (1 << kind)];
            whole[best] < BETTER.0 * turned && whole[best] + BETTER.1 < turned
        });
        let shown_kinds = (0..3).filter(|kind| reading.shown[*kind]); // a sign without evidence is the plain one
        let common = shown_kinds.fold(0, |code, kind| code | best & (1 << kind));
        let mut codes = [common; 4];
        reading.slip_m = whole[common];
        // Each leg with its own axes, if those are clearly better.
        let own = Leg::ALL.map(|leg| {
            let figures = (tried.iter()).map(|parts| rms(&parts[leg.index()..=leg.index()]));
            let figures: Option<Vec<f64>> = figures.collect();
            figures.map_or(common, |figures| least(&figures))
        });
        let parts = Leg::ALL.map(|leg| tried[own[leg.index()]][leg.index()]);
        if rms(&parts)? < BETTER.0 * whole[common] - BETTER.1 {
            (codes, reading.slip_m) = (own, rms(&parts)?);
        }
        reading.signs = std::array::from_fn(|i| combination(codes[i / 3])[i % 3]);
        reading.motion_m = self.motion_m(&reading);
        Some(reading)
    }

    /// How far feet on the ground would move on legs that stay as at the beginning of each stance, root mean square, m.
    fn motion_m(&self, reading: &Reading) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for (segment, leg, samples) in &self.stances {
            let mut states = states(segment, samples, reading);
            if let Some((first, others)) = states.split_first_mut() {
                for x in others {
                    x[..JOINT_DIM].copy_from_slice(&first[..JOINT_DIM]);
                }
            }
            sum += self.about_median(*leg, &states);
            count += samples.len();
        }
        (sum / count.max(1) as f64).sqrt()
    }

    fn moved(&self, reading: &Reading, leg: Leg) -> (f64, usize) {
        let (mut sum, mut count) = (0.0, 0);
        let of_leg = 3 * leg.index()..3 * leg.index() + 3;
        let limits = &self.robot.joint_limit_rad()[of_leg.clone()];
        for (segment, _, samples) in self.stances.iter().filter(|(_, own, _)| *own == leg) {
            let states = states(segment, samples, reading);
            let angles = (states.iter()).flat_map(|x| joints_of(leg, x).into_iter().zip(limits));
            let outside = angles.filter(|(q, (low, high))| !(low - 0.1..=high + 0.1).contains(q));
            sum += self.about_median(leg, &states);
            sum += OUTSIDE_M * OUTSIDE_M * outside.count() as f64;
            count += samples.len();
        }
        let turned = reading.signs[of_leg].iter().filter(|sign| **sign < 0.0);
        sum += TURNED_M * TURNED_M * (turned.count() * count) as f64;
        (sum, count)
    }

    /// Squared distances of the places of a leg's foot in these states from their median, summed.
    fn about_median(&self, leg: Leg, states: &[[f64; STATE_DIM]]) -> f64 {
        let places = Vec::from_iter(states.iter().map(|x| foot_place(self.robot, leg, x, true)));
        let stands = median_place(&places);
        let square = |place: &Vector3<f64>| (place - stands).norm_squared();
        places.iter().map(square).sum()
    }

    /// Signs and unit of the torques under which feet carry the body; decides signs that feet in place do not show.
    pub(crate) fn torques(&self, reading: &mut Reading) -> Option<Torques> {
        let blocks = self.blocks(reading);
        let explained = |signs: [f64; 2]| {
            let mut sums = [0.0; 3];
            for (forces, needed) in &blocks {
                let force = forces[0] * signs[0] + forces[1] * signs[1];
                sums[0] += force.dot(needed);
                sums[1] += force.norm_squared();
                sums[2] += needed.norm_squared();
            }
            let [product, square, whole] = sums;
            let left = 1.0 - product * product / (square * whole);
            (product > 0.0 && left < UNCARRIED).then_some((left, product / square))
        };
        let best = |all: [[f64; 2]; 2]| {
            let known = (all.into_iter()).filter_map(|signs| Some((signs, explained(signs)?)));
            known.min_by(|one, other| one.1.0.total_cmp(&other.1.0))
        };
        let common = best([[1.0, 1.0], [-1.0, -1.0]]);
        // Flexions alone carry little: their sign is decided by chance, above all in short recordings.
        let is_shown = reading.shown[1] && reading.shown[2];
        let other = best([[1.0, -1.0], [-1.0, 1.0]]).filter(|_| !is_shown);
        let (signs, (_, scale)) = match (common, other) {
            (Some(common), Some(other)) if other.1.0 < OTHER_SIGNS * common.1.0 => other,
            (common, other) => common.or(other)?,
        };
        let hips = self.hips(reading, signs);
        let torque = std::array::from_fn(|i| {
            let of_kind = [hips[i / 3], signs[0], signs[1]];
            reading.signs[i] * of_kind[i % 3]
        });
        // An opposite axis changes angles and torques; a common sign of all torques is a matter of action or reaction.
        if !reading.shown[0] && signs[0] == signs[1] {
            for leg in 0..4 {
                reading.signs[3 * leg] *= hips[leg] * signs[1];
            }
        }
        let units = ["N m", "N cm", "N mm"];
        let units = units.map(|unit| (unit, Dimension::Torque.factor(unit).unwrap_or(1.0)));
        let off = |unit: &NamedUnit| (unit.1 / scale).ln().abs();
        let nearest = |one: &NamedUnit, other: &NamedUnit| off(one).total_cmp(&off(other));
        Some((torque, units.into_iter().min_by(nearest)?))
    }

    /// Over times with feet on the ground, impulses of flexions and knees, and the impulse for weight and change of
    /// velocity.
    fn blocks(&self, reading: &Reading) -> Vec<([Vector3<f64>; 2], Vector3<f64>)> {
        let mut out = Vec::new();
        let forwards_and_up = |v: Vector3<f64>| Vector3::new(v.x, 0.0, v.z);
        for segment in &self.recording.segments {
            let step_s = segment.mean_step_s();
            let length = ((BLOCK_S / step_s).round() as usize).max(2);
            let velocity = |sample: usize| -> Vector3<f64> {
                segment.dx.fixed_view::<3, 1>(JOINT_DIM, sample) * reading.position.1
            };
            let contacts = (segment.contacts().into_iter()).filter(|(_, grounded)| *grounded);
            let starts = contacts.flat_map(|(run, _)| {
                let starts = run.clone().step_by(length);
                starts.filter(move |start| start + length < run.end)
            });
            for start in starts {
                let mut forces = [Vector3::zeros(); 2];
                for sample in start..start + length {
                    let x = state(segment, sample, reading);
                    let turn = rotation([15, 16, 17].map(|i| x[i]));
                    for leg in Leg::down(segment.feet[sample]) {
                        if let Some((map, tau)) = self.leg(segment, sample, leg, &x, reading) {
                            for kind in [1, 2] {
                                forces[kind - 1] += turn * map.column(kind) * (tau[kind] * step_s);
                            }
                        }
                    }
                }
                let time_s = segment.time_s[start + length] - segment.time_s[start];
                let mut needed = velocity(start + length) - velocity(start);
                needed.z += GRAVITY_M_S2 * time_s;
                let needed = forwards_and_up(self.robot.mass_kg() * needed);
                out.push((forces.map(forwards_and_up), needed));
            }
        }
        out
    }

    /// Map from a leg's torques to the force of its foot on the body, in the body's axes, and those torques.
    fn leg(
        &self,
        segment: &Segment,
        sample: usize,
        leg: Leg,
        x: &[f64; STATE_DIM],
        reading: &Reading,
    ) -> Option<(Matrix3<f64>, [f64; 3])> {
        let map = (self.robot.damped_force_map(leg, &joints_of(leg, x))).ok()?;
        let torque = |kind: usize| {
            let joint = 3 * leg.index() + kind;
            reading.signs[joint] * segment.torque_nm[(reading.row(joint), sample)]
        };
        Some((map, std::array::from_fn(torque)))
    }

    /// Signs of the hips' torques by leg: feet are held on their own side of the body; those of the knees where that is
    /// not clear. Axes of the hips may be mirrored from right to left; other patterns come from feet that stick.
    fn hips(&self, reading: &Reading, signs: [f64; 2]) -> [f64; 4] {
        let mut sums = [(0.0, 0.0); 4];
        for (segment, leg, samples) in &self.stances {
            let (product, square) = &mut sums[leg.index()];
            for &sample in samples {
                let x = state(segment, sample, reading);
                let Some((map, tau)) = self.leg(segment, sample, *leg, &x, reading) else {
                    continue;
                };
                let given = Vector3::new(0.0, signs[0] * tau[1], signs[1] * tau[2]);
                let force = map.column(1) * given[1] + map.column(2) * given[2];
                // The force of flexion and knee is in the leg's plane.
                let lever = hip_torque(self.robot, *leg, &joints_of(*leg, &x), &force);
                *product += tau[0] * lever;
                *square += lever * lever;
            }
        }
        let sign = |legs: &[usize]| -> Option<f64> {
            let product: f64 = legs.iter().map(|leg| sums[*leg].0).sum();
            let square: f64 = legs.iter().map(|leg| sums[*leg].1).sum();
            let share = product / square;
            (share.abs() > HIP_SHARE).then_some(share.signum())
        };
        let common = sign(&[0, 1, 2, 3]).unwrap_or(signs[1]);
        match (sign(&[0, 2]), sign(&[1, 3])) {
            (Some(right), Some(left)) => [right, left, right, left],
            _ => [common; 4],
        }
    }
}

fn joints_of(leg: Leg, x: &[f64; STATE_DIM]) -> [f64; 3] {
    std::array::from_fn(|kind| x[3 * leg.index() + kind])
}

fn states(segment: &Segment, samples: &[usize], reading: &Reading) -> Vec<[f64; STATE_DIM]> {
    let of = |sample: &usize| state(segment, *sample, reading);
    samples.iter().map(of).collect()
}

fn state(segment: &Segment, sample: usize, reading: &Reading) -> [f64; STATE_DIM] {
    let raw = segment.state(sample);
    std::array::from_fn(|i| match i {
        0..JOINT_DIM => reading.signs[i] * reading.joint.1 * raw[reading.row(i)],
        12..15 => reading.position.1 * raw[i],
        _ => raw[i],
    })
}

const UNEXPLAINED: f64 = 0.5; // share of a derivative that a velocity leaves unexplained at most
const AS_GOOD: f64 = 1.1; // times the least residual below which a plainer explanation is preferred

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    pub unit: &'static str,
    pub sign: f64,
    pub frame: Frame,
    pub left: f64, // squared residual as a share of the derivative
}

/// Slopes without the samples at which time jumps.
pub(super) fn slopes(times_s: &[f64], rows: &DMatrix<f64>) -> DMatrix<f64> {
    let ranges = stretches(0..times_s.len(), |before, at| times_s[at] > times_s[before]);
    differences_within(&ranges, times_s, rows)
}

/// Unit, sign and axes in which velocities are these derivatives: of the `frames` the first that fits nearly best.
pub(super) fn scale(rates: &Rows, frames: &[(Frame, Rows)], units: &[NamedUnit]) -> Option<Scale> {
    let whole = rates.norm_squared().max(1e-30);
    let best = |(frame, raw): &(Frame, DMatrix<f64>)| {
        let signed = units.iter().flat_map(|unit| [(*unit, 1.0), (*unit, -1.0)]);
        let scales = signed.map(|((unit, factor), sign)| Scale {
            unit,
            sign,
            frame: *frame,
            left: (rates - raw * (sign * factor)).norm_squared() / whole,
        });
        let best = scales.min_by(|a, b| a.left.total_cmp(&b.left));
        best.filter(|scale| scale.left < UNEXPLAINED)
    };
    let found: Vec<Scale> = frames.iter().filter_map(best).collect();
    let least = (found.iter().map(|scale| scale.left)).fold(f64::INFINITY, f64::min);
    (found.into_iter()).find(|scale| scale.left <= AS_GOOD * least + 1e-12)
}

/// The largest value, the 99th percentile of absolute values, so that single spikes do not count.
pub(super) fn reach(values: impl Iterator<Item = f64>) -> f64 {
    quantile(values.map(f64::abs), 0.99)
}
