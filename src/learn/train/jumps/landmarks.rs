//! Parts of jumps at equal shares of their durations, and how accelerations change about a trajectory of the prior. One
//! interval between nodes of a jump has the equation `delta (dz_(k+1) - dz_k) / h = Xi^T (bar delta z, bar delta dz,
//! bar delta u_lat)`. `delta` is the difference to the prior at the jump's own goal and a bar is the mean of both ends.
//! Plans use the same equation. Shifting the robot forwards changes nothing, so that direction of `delta z` is left
//! out.

use super::*;
use crate::model::FEATURE_DIM;
use crate::robot::ContactFlags;

/// The thrust begins when the body last rises more slowly than this before the feet leave, m/s.
const THRUST_SPEED_M_S: f64 = 0.1;
const LEAST_LANDING_S: f64 = 0.1; // a jump recorded for less than this after touch-down ends with its flight
const LEAST_SAMPLES: usize = 8; // of a part

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Landmark {
    pub name: String,
    pub phase: usize,
    /// Feet on the ground: those that select the phase, as many as it allows.
    pub feet: ContactFlags,
}

pub(super) struct Cut {
    pub kind: Vec<Landmark>,
    /// First sample of each part, and the last sample of the last.
    borders: Vec<usize>,
    times_s: Vec<f64>,
}

impl Cut {
    /// Samples from the first to the last of a part, both borders included.
    pub(super) fn samples(&self, part: usize) -> Range<usize> {
        self.borders[part]..self.borders[part + 1] + 1
    }

    pub(super) fn duration_s(&self, part: usize) -> f64 {
        self.times_s[part + 1] - self.times_s[part]
    }

    /// First sample after touch-down; none for a jump that ends with its flight.
    pub(super) fn landing(&self) -> Option<usize> {
        let lands = self.kind.last()?.feet.contains(&true);
        lands.then(|| self.borders[self.kind.len() - 1])
    }

    pub(super) fn end(&self) -> usize {
        self.borders[self.kind.len()]
    }
}

/// None where a jump has no flight with contact before it.
pub(super) fn cut(training: &Dataset, jump: &Jump) -> Option<Cut> {
    let scale = training.scaling.state[BODY_Z];
    let rising = |sample: usize| jump.dx[(BODY_Z, sample)] / scale > THRUST_SPEED_M_S;
    let patterns = &training.phases.patterns;
    let flies = |phase: usize| patterns[phase].feet == FeetRule::None;
    let spans = jump.spans.iter().enumerate();
    let (flight, (flight_phase, in_air)) = spans
        .filter(|(_, (phase, _))| flies(*phase))
        .max_by_key(|(_, (_, range))| range.len())?;
    let before = &jump.spans[..flight];
    let landing = &jump.spans[flight + 1..];
    if before.is_empty() || before.iter().any(|(phase, _)| flies(*phase)) {
        return None;
    }
    let thrust = 1 + (0..in_air.start).rev().find(|&sample| !rising(sample))?;
    let landmark = |name: &str, phase: usize| {
        Some(Landmark {
            name: name.to_owned(),
            phase,
            feet: feet_of(training, phase)?,
        })
    };
    let (mut kind, mut borders) = (Vec::new(), Vec::new());
    for (phase, range) in before {
        let name = &patterns[*phase].name;
        if range.contains(&thrust) && range.start < thrust {
            kind.push(landmark("crouch", *phase)?);
            kind.push(landmark("thrust", *phase)?);
            borders.extend([range.start, thrust]);
        } else {
            kind.push(landmark(name, *phase)?);
            borders.push(range.start);
        }
    }
    kind.push(landmark("flight", *flight_phase)?);
    borders.push(in_air.start);
    let last = jump.samples() - 1;
    let landed_s = jump.time_s[last] - jump.time_s[in_air.end.min(last)];
    if landed_s < LEAST_LANDING_S || last < in_air.end + LEAST_SAMPLES {
        borders.push(in_air.end - 1);
        // A recording that ends on the way up does not contain its apex.
        return finished(jump, kind, borders).filter(|_| !rising(in_air.end - 1));
    }
    let length = |phase: &usize| -> usize {
        let own = landing.iter().filter(|(of, _)| of == phase);
        own.map(|(_, range)| range.len()).sum()
    };
    let grounded = (0..patterns.len()).filter(|phase| !flies(*phase));
    kind.push(landmark("landing", grounded.max_by_key(length)?)?);
    borders.extend([in_air.end, last]);
    finished(jump, kind, borders)
}

/// The cut at these borders; none with a part of too few samples.
fn finished(jump: &Jump, kind: Vec<Landmark>, borders: Vec<usize>) -> Option<Cut> {
    let mut parts = borders.windows(2);
    let long_enough = parts.all(|pair| pair[1] >= pair[0] + LEAST_SAMPLES);
    long_enough.then(|| Cut {
        kind,
        times_s: borders.iter().map(|&sample| jump.time_s[sample]).collect(),
        borders,
    })
}

/// The pattern with the most feet down that selects a phase.
fn feet_of(training: &Dataset, phase: usize) -> Option<ContactFlags> {
    let all = (0..16u8).map(|bits| -> ContactFlags { std::array::from_fn(|k| bits >> k & 1 == 1) });
    all.filter(|feet| training.phases.phase_of(*feet) == Some(phase))
        .max_by_key(|feet| feet.iter().filter(|down| **down).count())
}

/// The jumps with the parts that most jumps have, and their cuts.
pub(super) fn of_commonest_kind(cuts: &[Option<Cut>]) -> Vec<(usize, &Cut)> {
    let all = cuts.iter().enumerate();
    let mut all: Vec<_> = (all.filter_map(|(jump, cut)| Some((jump, cut.as_ref()?)))).collect();
    let count = |kind: &[Landmark]| all.iter().filter(|(_, cut)| cut.kind == kind).count();
    // `max_by_key` returns the last of equals: reversed, it returns the first.
    let commonest = all.iter().rev().max_by_key(|(_, cut)| count(&cut.kind));
    let kind = commonest.map(|(_, cut)| &cut.kind);
    all.retain(|(_, cut)| Some(&cut.kind) == kind);
    all
}

const NODE_STEP_S: f64 = 0.014; // between nodes, aimed at
const INTERVALS: [usize; 2] = [10, 60]; // fewest and most of a part

/// Nodes of one part of one jump; one row per node, scaled units.
pub(super) struct PartNodes {
    pub duration_s: f64,
    pub z: DMatrix<f64>,
    pub dz: DMatrix<f64>,
    /// Latent inputs, averaged over half an interval to each side.
    pub u_lat: DMatrix<f64>,
}

impl PartNodes {
    pub(super) fn step_s(&self) -> f64 {
        self.duration_s / (self.z.nrows() - 1) as f64
    }
}

pub(super) fn intervals(mean_duration_s: f64) -> usize {
    let [least, most] = INTERVALS;
    ((mean_duration_s / NODE_STEP_S).round() as usize).clamp(least, most)
}

pub(super) fn sample(
    jump: &Jump,
    latent: &Latent,
    cut: &Cut,
    part: usize,
    count: usize,
) -> PartNodes {
    let samples = cut.samples(part);
    let times = &jump.time_s[samples.clone()];
    let (duration_s, last) = (cut.duration_s(part), times.len() - 1);
    let step = duration_s / count as f64;
    let d = latent.z.nrows();
    let time_of = |node: usize| times[0] + step * node as f64;
    let at_nodes = |rows: &DMatrix<f64>| {
        DMatrix::from_fn(count + 1, d, |node, i| {
            let time = time_of(node);
            let after = times.partition_point(|t| *t <= time).clamp(1, last);
            let (a, b) = (times[after - 1], times[after]);
            let share = ((time - a) / (b - a)).clamp(0.0, 1.0);
            let value = |k: usize| rows[(i, samples.start + k)];
            value(after - 1) + share * (value(after) - value(after - 1))
        })
    };
    let averaged = |rows: &DMatrix<f64>| {
        DMatrix::from_fn(count + 1, d, |node, i| {
            let value = |k: usize| rows[(i, samples.start + k)];
            let is_near = |k: &usize| (times[*k] - time_of(node)).abs() <= 0.5 * step + 1e-9;
            // The last sample is the next part's first, if there is one.
            let near = (0..last).filter(is_near);
            match near.fold((0.0, 0), |(sum, n), k| (sum + value(k), n + 1)) {
                (_, 0) => value(last - 1),
                (sum, n) => sum / f64::from(n),
            }
        })
    };
    PartNodes {
        duration_s,
        z: at_nodes(&latent.z),
        dz: at_nodes(&latent.dz),
        u_lat: averaged(&latent.u_lat),
    }
}

/// Ridge on the coefficients of the goal's numbers, which have unit variance; the constant is free.
const GOAL_RIDGE: f64 = 3.0;

/// The linear map from the values of all jumps to the coefficients of the features.
pub(super) struct GoalRegression {
    solution: DMatrix<f64>, // FEATURE_DIM x jumps
}

impl GoalRegression {
    pub(super) fn of<'a>(
        jumps: impl IntoIterator<Item = &'a Sampled>,
        goal: &[GoalRange; GOAL_DIM],
    ) -> Self {
        let features = |jump: &Sampled| GoalRange::features(goal, &jump.goal).to_vec().into();
        let columns: Vec<DVector<f64>> = jumps.into_iter().map(features).collect();
        let phi = DMatrix::from_columns(&columns);
        let ridge = DVector::from_fn(FEATURE_DIM, |k, _| if k == 0 { 0.0 } else { GOAL_RIDGE });
        let gram = &phi * phi.transpose() + DMatrix::from_diagonal(&ridge);
        let factor = gram.cholesky().expect("invariant: a constant and a ridge");
        Self {
            solution: factor.solve(&phi),
        }
    }

    pub(super) fn numbers(&self, values: &[f64]) -> [f64; FEATURE_DIM] {
        let fitted = &self.solution * DVector::from_column_slice(values);
        std::array::from_fn(|k| fitted[k])
    }

    /// Coefficients of one table per jump, `n x d` each: `n x (FEATURE_DIM d)`.
    pub(super) fn table<'a>(
        &self,
        values: impl IntoIterator<Item = &'a DMatrix<f64>>,
    ) -> DMatrix<f64> {
        let values: Vec<_> = values.into_iter().collect();
        let (n, d) = values[0].shape();
        let mut table = DMatrix::zeros(n, FEATURE_DIM * d);
        for k in 0..FEATURE_DIM {
            let mut block = table.columns_mut(k * d, d);
            for (jump, value) in values.iter().enumerate() {
                block += *value * self.solution[(k, jump)];
            }
        }
        table
    }
}

const RIDGE: f64 = 1e-2; // relative to the variance of each column

pub(super) struct Fit<'a> {
    pub goal: &'a [GoalRange; GOAL_DIM],
    pub part: usize,
    pub known: DMatrix<f64>, // the first columns of Xi of deviations, 3 d x m
    pub projector: DMatrix<f64>, // leaves out the change of z by a shift forwards
}

impl Fit<'_> {
    /// Tables of `z`, `dz`, `u_lat` and of mean accelerations over the intervals.
    pub(super) fn prior(&self, jumps: &[&Sampled]) -> [DMatrix<f64>; 4] {
        let regression = GoalRegression::of(jumps.iter().copied(), self.goal);
        let parts = || jumps.iter().map(|jump| &jump.parts[self.part]);
        let table = |pick: fn(&PartNodes) -> &DMatrix<f64>| regression.table(parts().map(pick));
        let ddz: Vec<_> = parts().map(accelerations).collect();
        [
            table(|nodes| &nodes.z),
            table(|nodes| &nodes.dz),
            table(|nodes| &nodes.u_lat),
            regression.table(&ddz),
        ]
    }

    /// Variables, one row per interval and `3 d` columns, and accelerations of a jump about a prior.
    pub(super) fn deviations(
        &self,
        [z, dz, u_lat, ddz]: &[DMatrix<f64>; 4],
        jump: &Sampled,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let nodes = &jump.parts[self.part];
        let features = GoalRange::features(self.goal, &jump.goal);
        let at = |table: &DMatrix<f64>| {
            let d = table.ncols() / FEATURE_DIM;
            let blocks = features.iter().enumerate();
            let blocks = blocks.map(|(k, f)| table.columns(k * d, d) * *f);
            blocks.fold(DMatrix::zeros(table.nrows(), d), |sum, block| sum + block)
        };
        let d = nodes.z.ncols();
        let n = nodes.z.nrows() - 1;
        let mut variables = DMatrix::zeros(n, 3 * d);
        let position = (&nodes.z - at(z)) * &self.projector;
        let others = [&nodes.dz - at(dz), &nodes.u_lat - at(u_lat)];
        for (k, delta) in std::iter::once(position).chain(others).enumerate() {
            let mean = (delta.rows(0, n) + delta.rows(1, n)) * 0.5;
            variables.columns_mut(k * d, d).copy_from(&mean);
        }
        (variables, accelerations(nodes) - at(ddz))
    }

    /// `(3 d) x d`.
    pub(super) fn xi(&self, prior: &[DMatrix<f64>; 4], jumps: &[&Sampled]) -> DMatrix<f64> {
        let d = self.projector.nrows();
        let (mut gram, mut product) = (DMatrix::zeros(3 * d, 3 * d), DMatrix::zeros(3 * d, d));
        for jump in jumps {
            let (variables, target) = self.deviations(prior, jump);
            gram += variables.tr_mul(&variables);
            product += variables.tr_mul(&target);
        }
        let scale = gram.diagonal().map(|square| square.sqrt());
        let largest = scale.amax().max(f64::MIN_POSITIVE);
        // A direction that never moves keeps a coefficient of zero.
        let inverse = scale.map(|s| if s > 1e-9 * largest { 1.0 / s } else { 0.0 });
        let inverse = DMatrix::from_diagonal(&inverse);
        let normalised = &inverse * gram * &inverse;
        let ridged = normalised + DMatrix::identity(3 * d, 3 * d) * RIDGE;
        let factor = (ridged.cholesky()).expect("invariant: a Gram matrix and a ridge");
        let mut xi = &inverse * factor.solve(&(&inverse * product));
        let positions = &self.projector * xi.rows(0, d);
        xi.rows_mut(0, d).copy_from(&positions);
        xi.columns_mut(0, self.known.ncols()).copy_from(&self.known);
        xi
    }
}

/// Mean accelerations over the intervals, one row each.
fn accelerations(nodes: &PartNodes) -> DMatrix<f64> {
    let n = nodes.dz.nrows() - 1;
    (nodes.dz.rows(1, n) - nodes.dz.rows(0, n)) / nodes.step_s()
}
