//! Heights of the feet: while only some are on the ground, those in the air are higher, which assigns the columns of
//! contact to the feet. Feet on the ground are at height zero.

use super::stance::orders;
use super::*;

/// Least gain in the summed height of feet in the air with another order, m, and as a share of that sum. In valid
/// recordings, single samples of a foot that rolls off or touches down can favour another order by 8 mm in sum.
const LEAST_GAIN: (f64, f64) = (9e-3, 0.3);
const FLOOR_M: f64 = 0.1; // height of the feet that are on the ground, m

/// Another order of the columns, if it fits the heights of the feet clearly better than the recorded one.
pub(super) fn columns(recording: &Recording, robot: &Robot) -> Found {
    let orders = orders();
    let mut sums = vec![0.0; orders.len()];
    for segment in &recording.segments {
        for (feet, height) in segment.feet.iter().zip(&heights(segment, robot)) {
            if feet.contains(&true) && feet.contains(&false) {
                let sums = sums.iter_mut().zip(&orders);
                sums.for_each(|(sum, order)| *sum += higher_m(feet, height, order));
            }
        }
    }
    let judged = || orders.iter().zip(&sums);
    let (_, &recorded_m) = judged().find(|(order, _)| **order == Leg::ALL)?;
    let (legs, &best_m) = judged().max_by(|one, other| one.1.total_cmp(other.1))?;
    let least_m = best_m - LEAST_GAIN.0.max(LEAST_GAIN.1 * best_m.abs());
    let breach = outside(recorded_m, least_m, f64::INFINITY);
    let words = format!(
        "while some feet are on the ground, those recorded in the air are higher by {:.0} mm in sum over the \
         samples, and by {:.0} mm if the columns of the feet are of {}: are they exchanged?",
        1e3 * recorded_m,
        1e3 * best_m,
        legs.map(Leg::short_name).join(", ")
    );
    mismatch("feet_columns", breach, words)
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

pub(super) fn floor(value: f64) -> Found {
    let breach = outside(value, -FLOOR_M, FLOOR_M).map(|(value, _)| (value, FLOOR_M)); // the bound has no sign
    let words = format!(
        "feet on the ground are at a height of {value:.2} m ({FLOOR_M:.2} m are accepted): is z that of the trunk \
         over the ground?"
    );
    mismatch("floor", breach, words)
}

pub(super) fn floor_m(recording: &Recording, robot: &Robot) -> f64 {
    let mut heights = Vec::new();
    for segment in &recording.segments {
        for (sample, feet) in segment.feet.iter().enumerate() {
            let x = segment.state(sample);
            heights.extend(Leg::down(*feet).map(|leg| foot_place(robot, leg, &x, false).z));
        }
    }
    median(heights.into_iter()) // 0 where no foot ever stands
}

const TRUNK: (f64, f64) = (0.05, 1.6); // trunk's lowest height, m, and largest tilt, rad, with feet on the ground
const LIES_S: f64 = 0.1; // shortest time that it lies, s

/// Time, s, that the trunk lies on the ground, or under it, or on its back, if that is long enough.
pub(super) fn fallen(recording: &Recording, floor_m: f64) -> Found {
    let (mut lies_s, mut lowest, mut steepest) = (0.0, f64::INFINITY, 0.0_f64);
    for segment in &recording.segments {
        let grounded = (0..segment.len()).filter(|sample| segment.feet[*sample].contains(&true));
        for sample in grounded {
            let x = segment.state(sample);
            let height = x[JOINT_DIM + 2] - floor_m;
            let upright = x[JOINT_DIM + 3].cos() * x[JOINT_DIM + 4].cos();
            let tilt = upright.clamp(-1.0, 1.0).acos();
            if height < TRUNK.0 || tilt > TRUNK.1 {
                lies_s += segment.mean_step_s();
            }
            (lowest, steepest) = (lowest.min(height), steepest.max(tilt));
        }
    }
    let words = format!(
        "for {lies_s:.2} s with feet on the ground the trunk is tilted by up to {:.0} degrees and as low as \
         {lowest:.2} m: did the robot fall? `rows` in `[text]` of a map keeps the jump alone",
        steepest.to_degrees()
    );
    mismatch("fallen", outside(lies_s, 0.0, LIES_S), words)
}

fn heights(segment: &Segment, robot: &Robot) -> Vec<[f64; FOOT_DIM]> {
    let of_sample = |sample| {
        let x = segment.state(sample);
        Leg::ALL.map(|leg| foot_place(robot, leg, &x, false).z)
    };
    let mut heights: Vec<[f64; FOOT_DIM]> = (0..segment.len()).map(of_sample).collect();
    for leg in 0..FOOT_DIM {
        let standing = (heights.iter().zip(&segment.feet)).filter(|(_, feet)| feet[leg]);
        let floor = median(standing.map(|(height, _)| height[leg]));
        heights.iter_mut().for_each(|height| height[leg] -= floor);
    }
    heights
}
