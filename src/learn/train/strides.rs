//! Strides of the training walks as a function of gait parameters, from which new gaits are planned.

use super::*;
use crate::model::{GAIT_DIM, GoalRange, STRIDE_WIDTH, StridePrior};
use crate::recording::{about_vertical, between};
use crate::robot::FOOT_DIM;

const NODES: usize = 40;
const LEAST_HALVES: usize = 20; // half strides that a regression needs, mirror images included
const RIDGE: f64 = 3.0; // on features of unit variance, against one half stride
const LEAST_SWING_S: f64 = 0.04; // of a pair in the air; shorter ones are chatter of its contacts
const HALF_S: [f64; 2] = [0.1, 0.4]; // duration of half a stride

/// Half strides of all motions by ridge regression over their gaits, each from a touchdown of the front right foot's
/// pair to the next of the other. The other half of a stride is the mirror image of the first. None if there are fewer
/// than [`LEAST_HALVES`], as in jumps, or without mirror images.
pub(super) fn learn_strides(training: &Dataset) -> Option<StridePrior> {
    let has_images = training.jumps.iter().any(|motion| motion.is_image);
    let halves: Vec<Half> = (training.jumps.iter())
        .flat_map(|motion| halves_of(training, motion))
        .collect();
    if !has_images || halves.len() < LEAST_HALVES {
        return None;
    }
    let gaits: Vec<[f64; GAIT_DIM]> = halves.iter().map(|half| half.gait).collect();
    let gait = GoalRange::of(&gaits);
    let features = DMatrix::from_fn(halves.len(), 1 + GAIT_DIM, |row, k| {
        match k.checked_sub(1) {
            None => 1.0,
            Some(i) => gait[i].normalised(gaits[row][i]),
        }
    });
    let mut gram = features.tr_mul(&features);
    (1..=GAIT_DIM).for_each(|k| gram[(k, k)] += RIDGE);
    let factor = gram.cholesky()?;
    let mut nodes = DMatrix::zeros(NODES, (1 + GAIT_DIM) * STRIDE_WIDTH);
    for node in 0..NODES {
        let target = DMatrix::from_fn(halves.len(), STRIDE_WIDTH, |row, i| {
            halves[row].nodes[(node, i)]
        });
        let weights = factor.solve(&features.tr_mul(&target));
        for (feature, row) in weights.row_iter().enumerate() {
            let mut to = nodes.row_mut(node);
            to.columns_mut(feature * STRIDE_WIDTH, STRIDE_WIDTH)
                .copy_from(&row);
        }
    }
    Some(StridePrior { gait, nodes })
}

struct Half {
    gait: [f64; GAIT_DIM],
    nodes: DMatrix<f64>, // NODES x STRIDE_WIDTH, SI units
}

fn halves_of(training: &Dataset, motion: &Jump) -> Vec<Half> {
    let [first, second] = [[0, 3], [1, 2]].map(|pair| touchdowns(motion, pair));
    let after_s = |from: usize, to: usize| motion.time_s[to] - motion.time_s[from];
    let halves = first.iter().filter_map(|&start| {
        let end = second.iter().copied().find(|end| *end > start)?;
        // The pairs alternate: all feet of a pronk come down together.
        let is_together = |other: &usize| after_s(start, *other).abs() < HALF_S[0];
        let fits = !second.iter().any(is_together) && after_s(start, end) <= HALF_S[1];
        fits.then(|| half(training, motion, start..end))
    });
    halves.collect()
}

/// Samples at which a foot of a pair comes down after both were in the air.
fn touchdowns(motion: &Jump, pair: [usize; 2]) -> Vec<usize> {
    let in_air = |sample: usize| pair.iter().all(|foot| !motion.feet[sample][*foot]);
    let (mut lifted_s, mut found) = (f64::INFINITY, Vec::new());
    for sample in 1..motion.samples() {
        match (in_air(sample - 1), in_air(sample)) {
            (false, true) => lifted_s = motion.time_s[sample],
            (true, false) if motion.time_s[sample] - lifted_s >= LEAST_SWING_S => {
                found.push(sample)
            }
            _ => {}
        }
    }
    found
}

fn half(training: &Dataset, motion: &Jump, range: Range<usize>) -> Half {
    let Range { start, end } = range;
    let (start_s, duration_s) = (
        motion.time_s[start],
        motion.time_s[end] - motion.time_s[start],
    );
    let factors = &training.scaling;
    let heading = 0.5 * (motion.x[(YAW, start)] + motion.x[(YAW, end)]) / factors.state[YAW];
    let mut nodes = DMatrix::zeros(NODES, STRIDE_WIDTH);
    let share = |node: usize| node as f64 / (NODES - 1) as f64;
    for node in 0..NODES {
        let time_s = start_s + share(node) * duration_s;
        let (left, right, between) = between(&motion.time_s, time_s);
        let at = |rows: &DMatrix<f64>, i: usize| {
            rows[(i, left)] + between * (rows[(i, right)] - rows[(i, left)])
        };
        for i in 0..STATE_DIM {
            nodes[(node, i)] = at(&motion.x, i) / factors.state[i];
            nodes[(node, STATE_DIM + i)] = at(&motion.u, i) / factors.input[i];
        }
        for x in [BODY_X, STATE_DIM + BODY_X] {
            let turned = about_vertical([nodes[(node, x)], nodes[(node, x + 1)]], -heading);
            [nodes[(node, x)], nodes[(node, x + 1)]] = turned;
        }
        for foot in 0..FOOT_DIM {
            let down = |sample: usize| f64::from(u8::from(motion.feet[sample][foot]));
            nodes[(node, 2 * STATE_DIM + foot)] = down(left) + between * (down(right) - down(left));
        }
    }
    // Steady motion along x, y and of yaw is subtracted.
    let rate = |i: usize| (nodes[(NODES - 1, i)] - nodes[(0, i)]) / duration_s;
    let rates = [BODY_X, BODY_X + 1, YAW].map(rate);
    for (i, rate) in [BODY_X, BODY_X + 1, YAW].into_iter().zip(rates) {
        let mean = nodes.column(i).mean();
        for node in 0..NODES {
            nodes[(node, i)] -= mean + rate * duration_s * (share(node) - 0.5);
        }
    }
    let stood = (start..motion.samples())
        .find(|&sample| sample > start && [0, 3].iter().all(|foot| !motion.feet[sample][*foot]));
    let stance_s = motion.time_s[stood.unwrap_or(end)] - start_s;
    let [forward, sideways, yaw_rate] = rates;
    let height = nodes.column(BODY_Z).mean();
    let duty = stance_s / (2.0 * duration_s);
    let gait = [forward, sideways, yaw_rate, 0.5 / duration_s, duty, height];
    Half { gait, nodes }
}
