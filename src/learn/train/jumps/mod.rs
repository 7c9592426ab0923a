//! Landmarks, prior and deviations of jumps. In: the training jumps and an encoder. Out: a [`JumpPrior`], or none if
//! fewer than [`LEAST_JUMPS`] of them are of one kind. `landmarks` divides jumps into parts and fits their dependence
//! on goals.

mod landmarks;

use nalgebra::RowDVector;

use super::*;
use crate::model::{self, GOAL_DIM, GoalRange, JumpPart, JumpPrior, Landmarks, complement};
use landmarks::{Cut, Fit, GoalRegression, PartNodes, intervals, of_commonest_kind, sample};

pub(super) const LEAST_JUMPS: usize = 6; // of one kind, to show how jumps depend on their goal
const STEP: f64 = 1e-3; // of differences, scaled units
const DIGITS: usize = 6; // significant, of stored numbers: more than any recording has

struct Sampled {
    goal: [f64; GOAL_DIM],
    parts: Vec<PartNodes>,
}

/// The equations of a model, of which the first `momentum` coordinates obey known physics.
pub(super) struct Dynamics<'a> {
    pub(super) candidate: Candidate<'a>,
    pub(super) momentum: usize,
}

impl Dynamics<'_> {
    /// Central differences of the momentum's accelerations by `z`, `dz`, `u_lat` about a part's mean node, `3 d x m`.
    fn slopes(&self, phase: usize, sampled: &[Sampled], part: usize) -> DMatrix<f64> {
        let nodes: Vec<&PartNodes> = sampled.iter().map(|jump| &jump.parts[part]).collect();
        let d = nodes[0].z.ncols();
        let mean_of = |of: fn(&PartNodes) -> &DMatrix<f64>| {
            let means = nodes.iter().map(|nodes| of(nodes).row_mean());
            means.fold(RowDVector::zeros(d), |sum, mean| sum + mean) / nodes.len() as f64
        };
        let parts = [mean_of(|n| &n.z), mean_of(|n| &n.dz), mean_of(|n| &n.u_lat)];
        let mean: Vec<f64> = parts.iter().flat_map(|part| part.iter().copied()).collect();
        let shifted = DMatrix::from_fn(6 * d, 3 * d, |row, k| {
            let shift = if row % (3 * d) == k { STEP } else { 0.0 };
            mean[k] + if row < 3 * d { shift } else { -shift }
        });
        let Candidate { features, xi } = self.candidate;
        let theta = features.evaluate(&shifted, &mut FeatureValues::default());
        let values = theta * xi[phase].columns(0, self.momentum);
        (values.rows(0, 3 * d) - values.rows(3 * d, 3 * d)) / (2.0 * STEP)
    }
}

/// None for a nonlinear encoder or too few jumps of one kind.
pub(super) fn learn_jumps(
    set: EncodedSet<'_>,
    encoder: &StateMap,
    dynamics: &Dynamics<'_>,
) -> (Option<JumpPrior>, Vec<PartScore>) {
    let (training, latent) = (set.dataset, set.latent);
    let nothing = (None, Vec::new());
    let Some(affine) = encoder.as_affine() else {
        return nothing;
    };
    let cuts = training.jumps.iter().filter(|jump| !jump.is_image);
    let cuts: Vec<_> = cuts.map(|jump| landmarks::cut(training, jump)).collect();
    let chosen = of_commonest_kind(&cuts);
    if chosen.len() < LEAST_JUMPS {
        return nothing;
    }
    let (kind, scale) = (&chosen[0].1.kind, &training.scaling.state);
    let sampled = sampled(set, &chosen);
    let translation = affine.weights().column(BODY_X).into_owned();
    let heights = |jump: usize| training.jumps[jump].x.row(BODY_Z) / scale[BODY_Z];
    let end_heights = chosen.iter().map(|&(jump, cut)| heights(jump)[cut.end()]);
    let landing_heights = chosen.iter().map(|&(jump, cut)| {
        let first = cut.landing().unwrap_or(cut.end());
        heights(jump).columns_range(first..cut.end() + 1).min()
    });
    let jumps: Vec<_> = sampled.iter().map(|jump| jump.goal).collect();
    let goal = GoalRange::of(&jumps);
    let (parts, scores) = (0..kind.len())
        .map(|part| {
            let known = dynamics.slopes(kind[part].phase, &sampled, part);
            let name = &kind[part].name;
            part_of(&sampled, &goal, name, (part, known), &translation)
        })
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
            start: mean_start(training, &chosen).map(rounded),
            end_height_m: range_of(end_heights),
            landing_height_m: range_of(landing_heights)[0],
        },
        state_std: state_std(latent, &chosen).map(rounded),
        parts,
    };
    (Some(prior), scores)
}

/// SI units.
fn mean_start(training: &Dataset, chosen: &[(usize, &Cut)]) -> DVector<f64> {
    let scale = &training.scaling.state;
    let first = |(jump, _): &(usize, &Cut)| training.jumps[*jump].x.column(0).component_div(scale);
    let sum = chosen
        .iter()
        .map(first)
        .fold(DVector::zeros(scale.len()), |sum, x| sum + x);
    sum / chosen.len() as f64
}

fn sampled(set: EncodedSet<'_>, chosen: &[(usize, &Cut)]) -> Vec<Sampled> {
    let count = |part: usize| {
        let all = chosen.iter().map(|(_, cut)| cut.duration_s(part));
        (part, intervals(all.sum::<f64>() / chosen.len() as f64))
    };
    let counts: Vec<(usize, usize)> = (0..chosen[0].1.kind.len()).map(count).collect();
    let of_jump = |&(jump, cut): &(usize, &Cut)| {
        let (samples, latent) = (&set.dataset.jumps[jump], &set.latent[jump]);
        let parts = counts.iter();
        let parts = parts.map(|&(part, count)| sample(samples, latent, cut, part, count));
        Sampled {
            goal: goal_of(set.dataset, jump, cut),
            parts: parts.collect(),
        }
    };
    chosen.iter().map(of_jump).collect()
}

/// Distance, rise of the body at the apex and height at the start of a jump, m.
fn goal_of(training: &Dataset, jump: usize, cut: &Cut) -> [f64; GOAL_DIM] {
    let x = training.jumps[jump].x.columns(0, cut.end() + 1);
    let scale = &training.scaling.state;
    let (row, forwards) = (x.row(BODY_Z) / scale[BODY_Z], x.row(BODY_X) / scale[BODY_X]);
    let distance = forwards[x.ncols() - 1] - forwards[0];
    [distance, row.max() - row[0], row[0]].map(rounded)
}

/// A part of the prior, and how well deviations from it are explained. Each jump is left out of prior and fit in turn,
/// but not of `known`, the first columns of Xi of deviations. `translation` is the change of `z` by a shift forwards.
fn part_of(
    sampled: &[Sampled],
    goal: &[GoalRange; GOAL_DIM],
    name: &str,
    (part, known): (usize, DMatrix<f64>),
    translation: &DVector<f64>,
) -> (JumpPart, PartScore) {
    let fit = Fit {
        goal,
        part,
        known,
        projector: complement(&DMatrix::from_columns(&[translation.column(0)])),
    };
    let all: Vec<&Sampled> = sampled.iter().collect();
    let mut square = DVector::zeros(translation.len());
    let (mut unexplained, mut total) = (0.0, 0.0);
    for left_out in 0..sampled.len() {
        let mut others = all.clone();
        others.remove(left_out);
        let prior = fit.prior(&others);
        let xi = fit.xi(&prior, &others);
        let (variables, target) = fit.deviations(&prior, all[left_out]);
        total += target.norm_squared();
        let residual = target - variables * xi;
        unexplained += residual.norm_squared();
        let mean = residual.row_mean().transpose();
        square += mean.component_mul(&mean);
    }
    let score = PartScore {
        part: name.to_owned(),
        ddz_r2: 1.0 - unexplained / f64::max(total, f64::MIN_POSITIVE),
    };
    let nodes: Vec<&PartNodes> = sampled.iter().map(|jump| &jump.parts[part]).collect();
    let durations: Vec<f64> = nodes.iter().map(|nodes| nodes.duration_s).collect();
    let prior = fit.prior(&all);
    let xi = fit.xi(&prior, &all).map(rounded);
    let [z, dz, u_lat, _] = prior.map(|table| table.map(rounded));
    let part = JumpPart {
        duration_s: (GoalRegression::of(sampled, goal).numbers(&durations)).map(rounded),
        z,
        dz,
        u_lat,
        xi: Some(xi),
        input_covariance: input_covariance(&nodes).map(rounded),
        acceleration_std: (square / sampled.len() as f64).map(|square| rounded(square.sqrt())),
    };
    (part, score)
}

/// Covariance of the inputs at all nodes of a part, with a floor for directions in which they never moved.
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

fn rounded(value: f64) -> f64 {
    let text = format!("{value:.*e}", DIGITS - 1);
    text.parse().expect("a printed number")
}
