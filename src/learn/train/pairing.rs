//! Which legs move alike: joints of two legs as one direction of the encoder.

use std::f64::consts::FRAC_1_SQRT_2;

use super::frame::{joint_of, unit};
use super::*;
use crate::robot::{LEG_JOINT_DIM, Leg};

use Leg::{FrontLeft, FrontRight, RearLeft, RearRight};

/// Least share of a joint's energy, of torques or of motion, from which a sum or a difference over the pairs is needed.
const LEAST_SHARE: f64 = 0.1;

type Pairs = [[Leg; 2]; 2];
/// Left and right, as in jumps and bounds. A mirror maps this set of pairs to itself, and each of the others.
const BESIDE: Pairs = [[FrontRight, FrontLeft], [RearRight, RearLeft]];
/// Across, as in trots; in front and behind, as in paces.
const OTHERS: [Pairs; 2] = [
    [[FrontRight, RearLeft], [FrontLeft, RearRight]],
    [[FrontRight, RearRight], [FrontLeft, RearLeft]],
];

/// Orthonormal directions of joints with one among `active`: the sums and differences over the pairs of legs that move
/// alike which torques or motions need. None unless diagonal pairs, or front and rear legs of a side, need fewer than
/// left and right legs. If left and right legs move alike, their differences move the body sideways.
pub(super) fn paired_joints(training: &Dataset, active: &[usize]) -> Option<Vec<DVector<f64>>> {
    let moments = training.moments();
    let of_pairs = |pairs: &Pairs| {
        let joints =
            (0..LEG_JOINT_DIM).map(|joint| pairs.map(|of| of.map(|leg| joint_of(leg, joint))));
        let directions = joints.flat_map(|joints| {
            let share = |of: &DMatrix<f64>, sign: f64| {
                let each = joints
                    .iter()
                    .map(|&[a, b]| [of[(a, a)] + of[(b, b)], of[(a, b)]]);
                let [own, cross] = each.fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
                0.5 + sign * cross / own.max(f64::MIN_POSITIVE)
            };
            let is_needed = |sign: &f64| {
                [&moments.input, &moments.state]
                    .into_iter()
                    .any(|of| share(of, *sign) > LEAST_SHARE)
            };
            let signs = [1.0, -1.0].into_iter().filter(is_needed);
            let of_sign = |sign: f64| {
                let moving = joints
                    .into_iter()
                    .filter(|pair| pair.iter().any(|i| active.contains(i)));
                moving.map(move |[a, b]| (unit(a) + unit(b) * sign) * FRAC_1_SQRT_2)
            };
            signs.flat_map(of_sign).collect::<Vec<_>>()
        });
        directions.collect::<Vec<_>>()
    };
    let fewest = OTHERS.iter().map(of_pairs).min_by_key(Vec::len)?;
    (fewest.len() < of_pairs(&BESIDE).len()).then_some(fewest)
}
