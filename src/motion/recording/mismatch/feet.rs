//! Which column of contact belongs to which foot: while only some feet are on the ground, those in the air are higher.

use super::stance::{foot_place, orders};
use crate::recording::preprocess::median;
use crate::recording::{Recording, Segment};
use crate::robot::{ContactFlags, FOOT_DIM, Leg, Robot};

/// By how much feet in the air have to be higher in sum in another order, m, and as a share of that sum.
///
/// In right recordings single samples of a foot that rolls off or touches down can favour another order by 8 mm in sum.
const LEAST_GAIN: (f64, f64) = (9e-3, 0.3);

/// An order of the columns that fits the heights of the feet better.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BetterOrder {
    /// The leg that each column seems to be of.
    pub legs: [Leg; FOOT_DIM],
    /// Sum over the samples of how much higher feet in the air are, as recorded, m.
    pub recorded_m: f64,
    /// The least that would have been accepted, m.
    pub least_m: f64,
    /// The same sum in the better order, m.
    pub best_m: f64,
}

/// The order that fits best, if it fits clearly better than the recorded one.
pub(super) fn better_order(recording: &Recording, robot: &Robot) -> Option<BetterOrder> {
    let orders = orders();
    let mut sums = vec![0.0; orders.len()];
    for segment in &recording.segments {
        let heights = heights(segment, robot);
        for (feet, height) in segment.feet.iter().zip(&heights) {
            if feet.contains(&true) && feet.contains(&false) {
                for (sum, order) in sums.iter_mut().zip(&orders) {
                    *sum += higher_m(feet, height, order);
                }
            }
        }
    }
    let recorded_m = (orders.iter().zip(&sums))
        .find(|(order, _)| **order == Leg::ALL)?
        .1;
    let (legs, best_m) =
        (orders.iter().zip(&sums)).max_by(|one, other| one.1.total_cmp(other.1))?;
    let least_m = best_m - LEAST_GAIN.0.max(LEAST_GAIN.1 * best_m.abs());
    (*recorded_m < least_m).then_some(BetterOrder {
        legs: *legs,
        recorded_m: *recorded_m,
        least_m,
        best_m: *best_m,
    })
}

/// How much higher feet in the air are than those on the ground if the columns are of these legs, m.
fn higher_m(feet: &ContactFlags, height: &[f64; FOOT_DIM], legs: &[Leg; FOOT_DIM]) -> f64 {
    let mean = |down: bool| {
        let chosen = feet.iter().zip(legs).filter(|(foot, _)| **foot == down);
        let heights: Vec<f64> = chosen.map(|(_, leg)| height[leg.index()]).collect();
        heights.iter().sum::<f64>() / heights.len() as f64
    };
    mean(false) - mean(true)
}

/// Median height of the feet that are on the ground, m; none if no foot ever is.
pub(super) fn floor_m(recording: &Recording, robot: &Robot) -> Option<f64> {
    let mut heights = Vec::new();
    for segment in &recording.segments {
        for (sample, feet) in segment.feet.iter().enumerate() {
            let x = segment.state(sample);
            let standing = Leg::ALL.into_iter().filter(|leg| feet[leg.index()]);
            heights.extend(standing.map(|leg| foot_place(robot, leg, &x, false).z));
        }
    }
    (!heights.is_empty()).then(|| median(heights.into_iter()))
}

/// Height of each foot over where it stands, m.
fn heights(segment: &Segment, robot: &Robot) -> Vec<[f64; FOOT_DIM]> {
    let mut heights: Vec<[f64; FOOT_DIM]> = (0..segment.len())
        .map(|sample| {
            let x = segment.state(sample);
            Leg::ALL.map(|leg| foot_place(robot, leg, &x, false).z)
        })
        .collect();
    for leg in 0..FOOT_DIM {
        let standing = (heights.iter().zip(&segment.feet)).filter(|(_, feet)| feet[leg]);
        let floor = median(standing.map(|(height, _)| height[leg]));
        heights.iter_mut().for_each(|height| height[leg] -= floor);
    }
    heights
}
