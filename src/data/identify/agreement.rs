//! Whether recordings are of one robot: each jump's torques bear its weight, it falls in flight, and its mass is that
//! of the others.
//!
//! A payload that all recordings have is no contradiction; one log without torques, or of another robot, is.

use std::ops::Range;

use super::error::IdentifyError;
use super::fit::Estimate;
use super::parameters::{INVERSE_MASS, PARAMETER_DIM};
use super::windows::{Group, Windows};
use crate::recording::Recording;
use crate::recording::mismatch::{Balance, contradiction};
use crate::recording::preprocess::median;
use crate::robot::Robot;

/// Share by which the mass of a jump may differ from that of all, and the same in standard errors of that jump.
const MASS: (f64, f64) = (0.05, 4.0);
const LEAST_BLOCKS: usize = 3; // fewest blocks of a jump whose mass is compared

pub(super) fn require_physics(
    recordings: &[Recording],
    robot: &Robot,
) -> Result<(), IdentifyError> {
    let balances = (recordings.iter()).map(|recording| Balance::of(recording, robot));
    let balances: Vec<Balance> = balances.collect();
    match contradiction(&balances) {
        None => Ok(()),
        Some((at, found)) => Err(refused(&recordings[at], None, found)),
    }
}

/// Refuses jumps whose mass is not that of all; `segments` are those of each recording among the windows.
pub(super) fn require_one_robot(
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

/// Mass of each segment by its vertical acceleration in contact, the other unknowns as in all, and its standard error
/// as a share of it (jackknife over blocks).
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
