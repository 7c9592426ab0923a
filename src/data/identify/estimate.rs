//! From recordings to an [`Identification`]: equations, fit and delay in turn until they agree. Also checks that
//! recordings are of one robot: torques bear its weight, it falls in flight, and its mass is that of the others.

use std::collections::BTreeMap;

use thiserror::Error;

use super::equations::Motion;
use super::fit::{Estimate, Iteration, explained, force_alone};
use super::identification::{ForceAlone, Samples};
use super::parameters::priors;
use super::windows::Windows;
use super::*;
use crate::recording::check::check;
use crate::recording::clock::{Timed, timed};
use crate::recording::mismatch::{Balance, contradiction};
use crate::recording::preprocess::median;

const LEAST_CONTACT_SAMPLES: usize = 100; // fewest samples with feet on the ground
const LEAST_WINDOWS: usize = 30; // fewest windows with moving legs; there are 23 unknowns
const MOST_ROUNDS: usize = 30; // most rounds; a clean recording needs about eight
const LARGEST_DELAY_CHANGE_S: f64 = 0.004; // largest change of the delay in a round, s
const LARGEST_DELAY_S: f64 = 0.06; // largest delay either way, s
const SETTLED: [f64; 2] = [2e-5, 1e-4];

/// Gravity, mass and losses by kind of joint, with standard errors. Implausible samples stay and become notes.
pub fn identify(recordings: &[Recording], robot: &Robot) -> Result<Identification, IdentifyError> {
    let mut notes = Vec::new();
    let (mut segments, mut mended_recordings, mut ranges) = (Vec::new(), Vec::new(), Vec::new());
    for recording in recordings {
        notes.extend(implausible(recording, robot));
        let timed = recording.segments.iter().map(timed);
        let timed = timed.collect::<Result<Vec<_>, _>>()?;
        notes.extend(mended(&recording.path, &timed));
        let own = timed.iter().map(|timed| timed.segment.clone()).collect();
        mended_recordings.push(recording.with_segments(own));
        ranges.push(segments.len()..segments.len() + timed.len());
        segments.extend(timed.into_iter().map(|timed| {
            let motion = Motion::of(&timed.segment, robot);
            (timed, motion)
        }));
    }
    require_physics(&mended_recordings, robot)?;
    let mut state = State::new(robot);
    let mut windows = state.windows(&segments, robot)?;
    require_enough(&windows, recordings.len())?;
    let mut settled = false;
    for _ in 0..MOST_ROUNDS {
        settled = state.improve(&windows, robot)?;
        if settled {
            break;
        }
        windows = state.windows(&segments, robot)?;
    }
    if !settled {
        notes.push(format!(
            "mass and delay still changed after {MOST_ROUNDS} rounds: they are less certain than \
             their standard errors"
        ));
    }
    notes.extend(exclusions(&windows));
    let mut found = state.result(robot, &segments, &windows, notes);
    let estimate = state.iteration.estimate.unwrap_or_default();
    require_one_robot(recordings, &ranges, &windows, &estimate)?;
    found.notes.extend(found.contradiction());
    found.notes.extend(found.doubts(robot.mass_kg()));
    Ok(found)
}

type Prepared = (Timed, Motion);

fn require_enough(windows: &Windows, recordings: usize) -> Result<(), IdentifyError> {
    let (found, expected) = (windows.contact_samples, LEAST_CONTACT_SAMPLES);
    if found < expected {
        return Err(IdentifyError::Contact {
            recordings,
            found,
            expected,
        });
    }
    let is_moving = |row: &&Row| row.moving && row.group == Group::Contact(0);
    let (found, expected) = (windows.rows.iter().filter(is_moving).count(), LEAST_WINDOWS);
    match found < expected {
        false => Ok(()),
        true => Err(IdentifyError::Still {
            recordings,
            found,
            expected,
        }),
    }
}

fn exclusions(windows: &Windows) -> Vec<String> {
    let (clipped, singular) = (windows.clipped_torques, windows.singular_samples);
    let notes = [
        (clipped > 0).then(|| {
            format!(
                "{clipped} torques are above the robot's limits: commanded rather than measured? They count as the limit"
            )
        }),
        (singular > 0).then(|| {
            format!("{singular} samples with a leg on the ground close to a singular posture are left out")
        }),
        (windows.flight_samples == 0).then(|| {
            "no flight of at least 70 ms: gravity and the legs' inertia rest on contact alone".to_owned()
        }),
    ];
    notes.into_iter().flatten().collect()
}

struct State {
    gravity_m_s2: f64,
    mass_kg: f64,
    delay_s: f64,
    losses: [f64; PARAMETER_DIM],
    iteration: Iteration,
    rounds: usize,
}

impl State {
    fn new(robot: &Robot) -> Self {
        Self {
            gravity_m_s2: GRAVITY_M_S2, // for the weight of the links in the first round
            mass_kg: robot.mass_kg(),
            delay_s: 0.0,
            losses: [0.0; PARAMETER_DIM],
            iteration: Iteration::default(),
            rounds: 0,
        }
    }

    fn windows(&self, segments: &[Prepared], robot: &Robot) -> Result<Windows, IdentifyError> {
        let mut windows = Windows::default();
        for (Timed { segment, lost, .. }, motion) in segments {
            let equations =
                SampleEquations::of(segment, motion, robot, self.gravity_m_s2, self.delay_s);
            windows.add(segment, &equations, lost)?;
        }
        Ok(windows)
    }

    fn improve(&mut self, windows: &Windows, robot: &Robot) -> Result<bool, IdentifyError> {
        const LEAST_ROUNDS: usize = 6;
        let priors = priors(robot.geometry(Leg::FrontLeft), self.mass_kg, &self.losses);
        let solved = self.iteration.step(&windows.rows, &priors, self.mass_kg);
        let estimate = solved.and(self.iteration.estimate).unwrap_or_default();
        let inverse = estimate[INVERSE_MASS];
        // Ten times lighter or heavier than the robot is no robot: signs, units or order are wrong.
        let expected = 1.0 / robot.mass_kg();
        if !(inverse > 0.1 * expected && inverse < 10.0 * expected) {
            return Err(IdentifyError::Mass {
                inverse,
                expected,
                robot: robot.name.to_owned(),
            });
        }
        let mass_kg = 1.0 / inverse;
        let change_s =
            (estimate[DELAY] * mass_kg).clamp(-LARGEST_DELAY_CHANGE_S, LARGEST_DELAY_CHANGE_S);
        let delay_s = (self.delay_s + change_s).clamp(-LARGEST_DELAY_S, LARGEST_DELAY_S);
        let settled = (delay_s - self.delay_s).abs() < SETTLED[0]
            && (mass_kg / self.mass_kg - 1.0).abs() < SETTLED[1];
        self.losses = std::array::from_fn(|i| estimate[i] * mass_kg);
        (self.gravity_m_s2, self.mass_kg, self.delay_s) = (estimate[GRAVITY], mass_kg, delay_s);
        self.rounds += 1;
        Ok(settled && self.rounds >= LEAST_ROUNDS)
    }

    fn result(
        &self,
        robot: &Robot,
        segments: &[Prepared],
        windows: &Windows,
        notes: Vec<String>,
    ) -> Identification {
        let priors = priors(robot.geometry(Leg::FrontLeft), self.mass_kg, &self.losses);
        let estimate = self.iteration.estimate.unwrap_or_default();
        let alone = force_alone(&windows.rows).unwrap_or_default();
        // When within a step a torque acts is not recorded: uniform over it.
        let steps = (segments.iter()).map(|(timed, _)| timed.segment.mean_step_s());
        let within_step_s = steps.fold(0.0, f64::max) / 12_f64.sqrt();
        let (rows, groupings) = (&windows.rows, windows.groupings());
        let variances =
            (self.iteration).variances(rows, &groupings, &priors, self.mass_kg, within_step_s);
        let deviation = |i: usize| variances.map_or(f64::INFINITY, |all| all[i].sqrt());
        let per_mass = |i: usize| deviation(i) * self.mass_kg;
        let kinds = |first: usize, of: &dyn Fn(usize) -> f64| {
            PerKind::from_array(std::array::from_fn(|kind| of(first + kind)))
        };
        let legs = |of: &dyn Fn(usize) -> f64| LegMoments {
            side_kg_m: of(LEG_SIDE),
            thigh_kg_m: of(THIGH),
            calf_kg_m: of(CALF),
            thigh_kg_m2: of(THIGH_SECOND),
            calf_kg_m2: of(CALF_SECOND),
        };
        let value = |i: usize| estimate[i] * self.mass_kg;
        let joints = |first: usize| -> [f64; JOINT_DIM] {
            std::array::from_fn(|joint| value(first + joint % 3))
        };
        Identification {
            robot: robot.name.to_owned(),
            gravity_m_s2: self.gravity_m_s2,
            mass_kg: self.mass_kg,
            delay_s: self.delay_s,
            actuators: Actuators {
                viscous: joints(VISCOUS),
                dry: joints(DRY),
                armature: joints(ARMATURE),
                legs: None,
            },
            legs: legs(&value),
            standard_error: StandardError {
                gravity_m_s2: deviation(GRAVITY),
                mass_kg: deviation(INVERSE_MASS) * self.mass_kg.powi(2),
                delay_s: per_mass(DELAY),
                viscous_nm_s_rad: kinds(VISCOUS, &per_mass),
                dry_nm: kinds(DRY, &per_mass),
                armature_kg_m2: kinds(ARMATURE, &per_mass),
                legs: legs(&per_mass),
            },
            r2: fit_of(windows, &estimate),
            force_alone: ForceAlone {
                gravity_m_s2: alone[GRAVITY],
                mass_kg: 1.0 / alone[INVERSE_MASS],
                r2: fit_of(windows, &alone),
            },
            samples: Samples {
                contact: windows.contact_samples,
                flight: windows.flight_samples,
            },
            notes,
        }
    }
}

fn fit_of(windows: &Windows, estimate: &Estimate) -> Fit {
    Fit {
        x: explained(&windows.rows, estimate, 0),
        z: explained(&windows.rows, estimate, 2),
    }
}

fn implausible(recording: &Recording, robot: &Robot) -> Option<String> {
    let mut counts: BTreeMap<&'static str, usize> = BTreeMap::new();
    for finding in check(recording, robot) {
        *counts.entry(finding.kind.description()).or_default() += finding.samples.len();
    }
    let listed = (counts.iter()).map(|(kind, count)| format!("{kind} ({count})"));
    let listed = listed.collect::<Vec<_>>().join(", ");
    let path = recording.path.display();
    (!listed.is_empty()).then(|| {
        format!("{path}: implausible samples stay in: {listed}; `romc inspect` lists them")
    })
}

fn mended(path: &Path, segments: &[Timed]) -> Option<String> {
    let mut faults = Vec::new();
    let rebuilt = (segments.iter()).filter_map(|timed| timed.mended.elapsed_ratio);
    if let Some(longest) = rebuilt.reduce(f64::max) {
        faults.push(format!(
            "{longest:.2} s of motion pass in a recorded second (displacements against velocities; \
             samples lost?), times were rebuilt"
        ));
    }
    let lost = |timed: &Timed| timed.lost.iter().filter(|lost| **lost).count();
    let lost: usize = segments.iter().map(lost).sum();
    if lost > 0 {
        faults.push(format!("{lost} samples between distant ones are left out"));
    }
    if segments.iter().any(|timed| timed.mended.rates_replaced) {
        faults.push("angular rates disagree with the angles and were replaced".to_owned());
    }
    (!faults.is_empty()).then(|| format!("{}: {}", path.display(), faults.join("; ")))
}

const MASS: (f64, f64) = (0.05, 4.0);
const LEAST_BLOCKS: usize = 3; // fewest blocks of a jump whose mass is compared

fn require_physics(recordings: &[Recording], robot: &Robot) -> Result<(), IdentifyError> {
    let balances = (recordings.iter()).map(|recording| Balance::of(recording, robot));
    let balances: Vec<Balance> = balances.collect();
    match contradiction(&balances) {
        None => Ok(()),
        Some((at, found)) => Err(refused(&recordings[at], None, found)),
    }
}

fn require_one_robot(
    recordings: &[Recording],
    segments: &[Range<usize>],
    windows: &Windows,
    estimate: &Estimate,
) -> Result<(), IdentifyError> {
    let jumps = masses(windows, estimate);
    let pooled_kg = 1.0 / estimate[INVERSE_MASS];
    let differs = |(_, mass_kg, error): &(usize, f64, f64)| {
        (mass_kg / pooled_kg - 1.0).abs() > MASS.0.max(MASS.1 * error)
    };
    if !jumps.iter().any(differs) {
        return Ok(());
    }
    // Of two robots the one with fewer jumps is the stranger.
    let most_kg = median(jumps.iter().map(|(_, mass_kg, _)| *mass_kg));
    let far = |(_, mass_kg, _): &(usize, f64, f64)| (mass_kg / most_kg).ln().abs();
    let worst = (jumps.iter()).max_by(|one, other| far(one).total_cmp(&far(other)));
    let &(segment, mass_kg, error) = worst.expect("invariant: one differs");
    let at = segments.iter().position(|range| range.contains(&segment));
    let at = at.expect("invariant: a segment of a recording");
    let words = format!(
        "its mass is {mass_kg:.2} ± {:.2} kg, and that of most of these jumps {most_kg:.2} kg",
        mass_kg * error
    );
    let number = (segments[at].len() > 1).then(|| segment - segments[at].start);
    Err(refused(&recordings[at], number, words))
}

fn refused(recording: &Recording, segment: Option<usize>, found: String) -> IdentifyError {
    let place = segment.map_or(String::new(), |segment| format!(", segment {segment}"));
    IdentifyError::Contradiction {
        recording: format!("{}{place}", recording.path.display()),
        found,
    }
}

/// Mass of each segment by its vertical acceleration in contact, and its standard error as a share (jackknife).
fn masses(windows: &Windows, estimate: &Estimate) -> Vec<(usize, f64, f64)> {
    let mut blocks = vec![(0.0, 0.0); windows.blocks.len()];
    let upwards = (windows.rows.iter()).filter(|row| row.group == Group::Contact(2));
    for row in upwards {
        let others = (0..PARAMETER_DIM).filter(|unknown| *unknown != INVERSE_MASS);
        let others = others.map(|unknown| row.coefficients[unknown] * estimate[unknown]);
        let rest = row.left - others.sum::<f64>();
        let force = row.coefficients[INVERSE_MASS];
        blocks[row.block].0 += force * rest;
        blocks[row.block].1 += force * force;
    }
    let segments = windows.blocks.last().map_or(0, |last| last + 1);
    let of_segment = |segment: usize| {
        let own = blocks.iter().zip(&windows.blocks);
        let own = own.filter(|((_, square), of)| **of == segment && *square > 0.0);
        let own: Vec<(f64, f64)> = own.map(|(sums, _)| *sums).collect();
        let add = |sum: (f64, f64), block: &(f64, f64)| (sum.0 + block.0, sum.1 + block.1);
        let (product, square) = own.iter().fold((0.0, 0.0), add);
        let inverse = product / square;
        let changed = |block: &(f64, f64)| (product - block.0) / (square - block.1) - inverse;
        let without = own.iter().map(changed);
        let count = own.len() as f64;
        let variance = (count - 1.0) / count * without.map(|change| change * change).sum::<f64>();
        let is_known = own.len() >= LEAST_BLOCKS && inverse > 0.0;
        is_known.then(|| (segment, 1.0 / inverse, variance.sqrt() / inverse))
    };
    (0..segments).filter_map(of_segment).collect()
}

#[derive(Debug, Error)]
pub enum IdentifyError {
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(
        "{recordings} recordings: found {found} samples with feet on the ground that are 20 ms \
         away from a change of feet and from a singular leg, expected at least {expected}"
    )]
    Contact {
        recordings: usize,
        found: usize,
        expected: usize,
    },
    #[error(
        "{recordings} recordings: found {found} windows of 30 ms in which the legs move, expected \
         at least {expected}; a robot that stands still does not show its losses"
    )]
    Still {
        recordings: usize,
        found: usize,
        expected: usize,
    },
    #[error(
        "the trunk's acceleration does not follow the feet's forces: found {inverse:.3e} as \
         1/mass, expected about {expected:.3e} 1/kg; are signs, units and order of the \
         torques those of `{robot}`?"
    )]
    Mass {
        inverse: f64,
        expected: f64,
        robot: String,
    },
    #[error(
        "{recording}: {found}; expected recordings of one robot with its torques: leave this one out, or use it alone"
    )]
    Contradiction { recording: String, found: String },
    #[error(transparent)]
    File(#[from] Located<Fault>),
}
