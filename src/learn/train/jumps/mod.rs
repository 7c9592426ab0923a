//! What the training jumps say of jumps that were not recorded: landmarks, prior, deviations.
//!
//! In: the training jumps and an encoder. Out: a [`JumpPrior`], or none if fewer than [`LEAST_JUMPS`] of them are of
//! one kind. `landmarks` cuts each jump into parts and samples these at equal shares of their durations; `deviations`
//! fits nodes and durations over the goals, and how accelerations change about such a trajectory.

mod landmarks;

use nalgebra::{DMatrix, DVector, RowDVector};

use super::dataset::{Dataset, centred, mean};
use super::latent::{EncodedSet, Latent};
use super::metrics::{BODY_X, BODY_Z, PartScore};
use crate::model::{self, GOAL_DIM, GoalRange, JumpPart, JumpPrior, Landmarks, StateMap};
use landmarks::{
    Cut, GoalRegression, PartNodes, fit_deviations, intervals, of_commonest_kind, sample,
};

/// Fewest jumps of one kind that say how jumps depend on their goal.
pub(super) const LEAST_JUMPS: usize = 6;
/// Significant digits of what is kept: beyond those of any recording.
const DIGITS: usize = 6;

struct Sampled {
    goal: [f64; GOAL_DIM],
    parts: Vec<PartNodes>,
}

/// Landmarks and prior of the training jumps, and how well its deviations are explained in each of its parts; none for
/// a nonlinear encoder or too few jumps of one kind.
pub(super) fn learn_jumps(
    set: EncodedSet<'_>,
    encoder: &StateMap,
) -> (Option<JumpPrior>, Vec<PartScore>) {
    let (training, latent) = (set.dataset, set.latent);
    let nothing = (None, Vec::new());
    let Some(affine) = encoder.as_affine() else {
        return nothing;
    };
    let cuts = landmarks::cuts(training);
    let chosen = of_commonest_kind(&cuts);
    if chosen.len() < LEAST_JUMPS {
        return nothing;
    }
    let (kind, scale) = (&chosen[0].1.kind, &training.scaling.state);
    let counts: Vec<usize> = (0..kind.len())
        .map(|part| {
            let all = chosen.iter().map(|(_, cut)| cut.duration_s(part));
            intervals(all.sum::<f64>() / chosen.len() as f64)
        })
        .collect();
    let sampled: Vec<Sampled> = chosen
        .iter()
        .map(|&(jump, cut)| Sampled {
            goal: goal_of(training, jump, cut),
            parts: (counts.iter().enumerate())
                .map(|(part, &count)| {
                    sample(&training.jumps[jump], &latent[jump], cut, part, count)
                })
                .collect(),
        })
        .collect();
    let translation = affine.weights().column(BODY_X).into_owned();
    let heights = |jump: usize| training.jumps[jump].x.row(BODY_Z) / scale[BODY_Z];
    let mut start = DVector::zeros(scale.len());
    for &(jump, _) in &chosen {
        let first = training.jumps[jump].x.column(0);
        start += first.component_div(scale) / chosen.len() as f64;
    }
    let end_heights = chosen.iter().map(|&(jump, cut)| heights(jump)[cut.end()]);
    let landing_heights = chosen.iter().map(|&(jump, cut)| {
        let first = cut.landing().unwrap_or(cut.end());
        heights(jump).columns_range(first..cut.end() + 1).min()
    });
    let jumps: Vec<_> = sampled.iter().map(|jump| jump.goal).collect();
    let goal = GoalRange::of(&jumps);
    let (parts, scores) = (0..kind.len())
        .map(|part| part_of(&sampled, &goal, &kind[part].name, part, &translation))
        .unzip();
    let landmarks = kind.iter().enumerate().map(|(part, landmark)| {
        let durations = sampled.iter().map(|jump| jump.parts[part].duration_s);
        model::Landmark {
            name: landmark.name.clone(),
            phase: training.phases.patterns[landmark.phase].name.clone(),
            feet: landmark.feet,
            duration_range_s: range_of(durations),
        }
    });
    let prior = JumpPrior {
        landmarks: Landmarks {
            parts: landmarks.collect(),
            jumps,
            start: start.map(rounded),
            end_height_m: range_of(end_heights),
            landing_height_m: range_of(landing_heights)[0],
        },
        state_std: state_std(latent, &chosen).map(rounded),
        parts,
    };
    (Some(prior), scores)
}

/// Distance, rise of the body at the apex and height at the start of a jump, m.
fn goal_of(training: &Dataset, jump: usize, cut: &Cut) -> [f64; GOAL_DIM] {
    let x = training.jumps[jump].x.columns(0, cut.end() + 1);
    let scale = &training.scaling.state;
    let (row, forwards) = (x.row(BODY_Z) / scale[BODY_Z], x.row(BODY_X) / scale[BODY_X]);
    [
        forwards[x.ncols() - 1] - forwards[0],
        row.max() - row[0],
        row[0],
    ]
    .map(rounded)
}

fn part_of(
    sampled: &[Sampled],
    goal: &[GoalRange; GOAL_DIM],
    name: &str,
    part: usize,
    translation: &DVector<f64>,
) -> (JumpPart, PartScore) {
    let regression = GoalRegression::of(sampled, goal);
    let all: Vec<&PartNodes> = sampled.iter().map(|jump| &jump.parts[part]).collect();
    let table = |pick: fn(&PartNodes) -> &DMatrix<f64>| {
        let values = all.iter().copied().map(pick);
        regression.table(values).map(rounded)
    };
    let durations: Vec<f64> = all.iter().map(|nodes| nodes.duration_s).collect();
    let deviations = fit_deviations(sampled, goal, part, translation);
    let score = PartScore {
        part: name.to_owned(),
        ddz_r2: deviations.ddz_r2,
    };
    let part = JumpPart {
        duration_s: regression.numbers(&durations).map(rounded),
        z: table(|nodes| &nodes.z),
        dz: table(|nodes| &nodes.dz),
        u_lat: table(|nodes| &nodes.u_lat),
        xi: Some(deviations.xi.map(rounded)),
        input_covariance: input_covariance(&all).map(rounded),
        acceleration_std: deviations.acceleration_std.map(rounded),
    };
    (part, score)
}

/// Covariance of the inputs at the nodes of a part over all jumps, with a floor for directions in which they never
/// moved.
fn input_covariance(all: &[&PartNodes]) -> DMatrix<f64> {
    /// Share of the mean variance that is added to every variance.
    const FLOOR: f64 = 1e-4;
    let inputs = all.iter().flat_map(|nodes| nodes.u_lat.row_iter());
    let inputs: Vec<_> = inputs.map(|row| row.transpose()).collect();
    let inputs = DMatrix::from_columns(&inputs);
    let (d, n) = inputs.shape();
    let deviations = centred(&inputs, &mean(&inputs));
    let covariance = &deviations * deviations.transpose() / n as f64;
    let floor = FLOOR * (covariance.trace() / d as f64).max(f64::MIN_POSITIVE.sqrt());
    covariance + DMatrix::identity(d, d) * floor
}

fn range_of(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let nothing = [f64::INFINITY, f64::NEG_INFINITY];
    let range = values.fold(nothing, |[least, most], v| [least.min(v), most.max(v)]);
    range.map(rounded)
}

/// Standard deviations of `z` and `dz` over the samples of the jumps.
fn state_std(latent: &[Latent], chosen: &[(usize, &Cut)]) -> DVector<f64> {
    let states = chosen.iter().flat_map(|&(jump, _)| {
        let Latent { z, dz, .. } = &latent[jump];
        let pairs = z.column_iter().zip(dz.column_iter());
        pairs.map(|(z, dz)| DVector::from_iterator(2 * z.len(), z.iter().chain(&dz).copied()))
    });
    let states = DMatrix::from_columns(&states.collect::<Vec<_>>());
    let deviations = centred(&states, &mean(&states));
    let std = |row: RowDVector<f64>| (row.norm_squared() / row.len() as f64).sqrt();
    let rows = deviations.row_iter().map(|row| std(row.into_owned()));
    DVector::from_iterator(deviations.nrows(), rows).map(|std| std.max(f64::EPSILON))
}

/// The value at [`DIGITS`] significant digits.
fn rounded(value: f64) -> f64 {
    let text = format!("{value:.*e}", DIGITS - 1);
    text.parse().expect("a printed number")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::AffineMap;
    use crate::robot::STATE_DIM;
    use crate::train::oscillator::go1;

    /// Score of the thrust, with an encoder of the body's x and z and the front right thigh and knee.
    fn score(training: &Dataset) -> f64 {
        let rows = [BODY_X, BODY_Z, 1, 2];
        let weights = DMatrix::from_fn(4, STATE_DIM, |i, j| f64::from(rows[i] == j));
        let encoder = AffineMap::new("encoder", weights, DVector::zeros(4));
        let encoder = encoder.expect("finite").into();
        let latent = Latent::of(training, &encoder);
        let (_, scores) = learn_jumps(EncodedSet::new(training, &latent), &encoder);
        let thrust = scores.iter().find(|score| score.part == "thrust");
        thrust.expect("a thrust").ddz_r2
    }

    #[test]
    fn score_of_deviations_falls_when_inputs_belong_to_other_jumps() {
        let mut training = go1((1..=8).map(|k| format!("train_{k:02}")));
        let right = score(&training);
        let inputs: Vec<DMatrix<f64>> = training.jumps.iter().map(|jump| jump.u.clone()).collect();
        for (k, jump) in training.jumps.iter_mut().enumerate() {
            let other = &inputs[(k + 3) % inputs.len()];
            let last = other.ncols() - 1;
            jump.u = DMatrix::from_fn(STATE_DIM, jump.u.ncols(), |i, sample| {
                other[(i, sample.min(last))]
            });
        }
        let wrong = score(&training);
        assert!(right > 0.3 && wrong < right - 0.1, "{right} {wrong}");
    }
}
