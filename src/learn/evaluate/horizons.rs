//! Prediction errors of all coordinates over several horizons, compared with baselines: a constant velocity, a robot at
//! rest, the mean training jump, a rigid body. Baselines of walks are also the mean training stride and a linear
//! inverted pendulum.

use std::borrow::Cow;
use std::ops::Range;

use super::coordinates::coasted;
use super::*;

/// Times between restarts, s.
const RESTARTS_S: [f64; 3] = [0.1, 0.2, 0.3];
const LONG_S: f64 = 2.0; // of walks
const MODEL: &str = "model";
const CONSTANT_VELOCITY: &str = "constant velocity";
const AT_REST: &str = "at rest";
const MEAN_JUMP: &str = "mean training jump";
const MEAN_STRIDE: &str = "mean stride";
const RIGID_BODY: &str = "rigid body";
const PENDULUM: &str = "pendulum";

/// A motion with its latent samples, and the accelerations that baselines give the body.
struct Motion<'a> {
    segment: Cow<'a, Segment>,
    latent: Cow<'a, LatentSegment>,
    rigid_body: Option<DMatrix<f64>>, // 6 x n
    pendulum: Option<Pendulum>,
    stride: Option<MeanStride>,
}

impl<'a> Horizon {
    /// Predictions with restarts every 0.1, 0.2 and 0.3 s, at all samples; of walks also over a stride and 2 s, each
    /// from the axes of the heading at its start. Also predictions from each take-off, at the sample of the touchdown
    /// only.
    pub fn all(model: &ReducedModel, assessment: &'a Assessment<'_>) -> Result<Vec<Self>> {
        let compiled = CompiledModel::new(model)?;
        let segments: Vec<&Segment> = assessment.runs.iter().map(|run| &*run.segment).collect();
        let baselines = Baselines {
            mean_jump: MeanJump::of(model)?,
            rigid_body: RigidBody::of(model, &segments)?,
        };
        let stride_s = stride_s(assessment.recorded.iter().copied());
        let names = [MODEL, CONSTANT_VELOCITY, AT_REST].into_iter();
        let names = names.chain(baselines.mean_jump.as_ref().map(|_| MEAN_JUMP));
        let names = names.chain(baselines.rigid_body.as_ref().map(|_| RIGID_BODY));
        let names = names.chain(stride_s.map(|_| PENDULUM));
        let has_strides = stride_s.is_some() && model.stride_prior().is_ok();
        let names = names.chain(has_strides.then_some(MEAN_STRIDE));
        let mass_centre = model.mass_centre();
        let sums = CoordinateSums::new(model)?.with_more(mass_centre.len());
        let predictors: Vec<_> = names.map(|name| (name, sums.clone())).collect();
        let motion =
            |segment: Cow<'a, Segment>, latent: Cow<'a, LatentSegment>, recorded: &Segment| {
                // Of a piece without three touchdowns the stride of all motions.
                let own_s = crate::recording::stride_s(std::iter::once(recorded)).or(stride_s);
                let pendulum = stride_s
                    .map(|_| Pendulum::of(model, &segment))
                    .transpose()?;
                Ok(Motion {
                    rigid_body: (baselines.rigid_body.as_ref())
                        .map(|body| body.accelerations(&segment))
                        .transpose()?,
                    pendulum,
                    stride: own_s.and_then(|stride_s| MeanStride::of(model, &segment, stride_s)),
                    segment,
                    latent,
                })
            };
        let runs = assessment.runs.iter().map(|run| {
            motion(
                Cow::Borrowed(&*run.segment),
                Cow::Borrowed(&run.latent),
                &run.segment,
            )
        });
        let runs: Vec<Motion<'_>> = runs.collect::<Result<_>>()?;
        let mut horizons = Vec::new();
        let restarts = RESTARTS_S.map(|time_s| (format!("{time_s} s"), Restart::Every(time_s)));
        for (name, restart) in restarts {
            horizons.push((name, restart, None));
        }
        for (name, time_s) in stride_s.into_iter().flat_map(|stride_s| {
            [
                (format!("stride, {stride_s:.2} s"), stride_s),
                (format!("{LONG_S} s"), LONG_S),
            ]
        }) {
            let mut long = Vec::new();
            for segment in assessment.recorded.iter().copied() {
                for window in restart_windows(&segment.time_s, Restart::Every(time_s)) {
                    let lasts_s = segment.time_s[window.end - 1] - segment.time_s[window.start];
                    if lasts_s < 0.95 * time_s {
                        continue;
                    }
                    let own = segment.slice(window).in_its_heading();
                    let latent = LatentSegment::encode(model, &own)?;
                    long.push(motion(Cow::Owned(own), Cow::Owned(latent), segment)?);
                }
            }
            horizons.push((name, Restart::Every(f64::INFINITY), Some(long)));
        }
        horizons.push(("take-off to touchdown".to_owned(), Restart::Never, None));
        let all = horizons.into_iter();
        all.map(|(name, restart, motions)| {
            let mut horizon = Self {
                name,
                mass_centre: mass_centre.clone(),
                predictors: predictors.clone(),
            };
            for motion in motions.as_ref().unwrap_or(&runs) {
                horizon.add(model, &compiled, motion, &baselines, restart)?;
            }
            Ok(horizon)
        })
        .collect()
    }

    fn add(
        &mut self,
        model: &ReducedModel,
        compiled: &CompiledModel,
        motion: &Motion<'_>,
        baselines: &Baselines,
        restart: Restart,
    ) -> Result<()> {
        let (segment, latent) = (&*motion.segment, &*motion.latent);
        let flights = flights(segment)?;
        let is_flight = restart == Restart::Never;
        let windows = match is_flight {
            true => flights.clone(),
            false => restart_windows(&latent.time_s, restart),
        };
        let take_off_s = flights.first().map(|flight| segment.time_s[flight.start]);
        let rollout = rollout_over(compiled, latent, windows);
        let state_dim = model.decoder_map()?.output_dim();
        for (sample, window, column) in rollout.predictions() {
            let Range { start, end } = window.samples;
            if is_flight && sample + 1 < end {
                continue;
            }
            let (phase, from) = (latent.phase[sample], segment.x.column(start));
            let coasted = coasted(segment, start, sample);
            for (name, sums) in &mut self.predictors {
                let predicted = match *name {
                    MODEL => Predicted::Latent(window.z.column(column).into_owned()),
                    CONSTANT_VELOCITY => Predicted::All(coasted.clone()),
                    AT_REST => Predicted::All(from.into_owned()),
                    MEAN_JUMP => {
                        let Some((jump, at_s)) = baselines.mean_jump.as_ref().zip(take_off_s)
                        else {
                            continue;
                        };
                        let [before, after] =
                            [start, sample].map(|sample| jump.at(segment.time_s[sample] - at_s));
                        Predicted::All(from + after - before)
                    }
                    MEAN_STRIDE => {
                        let Some(stride) = &motion.stride else {
                            continue;
                        };
                        let [before, after] = [start, sample].map(|k| segment.time_s[k]);
                        Predicted::All(from + stride.at(after) - stride.at(before))
                    }
                    PENDULUM => {
                        let pendulum = motion.pendulum.iter();
                        let moved = pendulum.flat_map(|of| of.moved(segment, start..sample));
                        Predicted::Body([BODY_X, BODY_X + 1].into_iter().zip(moved).collect())
                    }
                    _ => {
                        let by = motion.rigid_body.iter();
                        let moved = by.flat_map(|by| moved_by(segment, by, start..sample));
                        Predicted::Body(BODY.into_iter().zip(moved).collect())
                    }
                };
                let centre = predicted.mass_centre(model, &self.mass_centre, &coasted)?;
                for (row, (of, y_hat)) in (state_dim..).zip(self.mass_centre.iter().zip(centre)) {
                    let y = latent.z[(of.latent, sample)] / of.factor;
                    if let Some(y_hat) = y_hat {
                        sums.add_pair(phase, row, [y, y_hat]);
                    }
                }
                match predicted {
                    Predicted::Latent(z) => sums.add(segment, sample, phase, &model.decode(&z)?),
                    Predicted::All(x) => sums.add(segment, sample, phase, &x),
                    Predicted::Body(rows) => (rows.into_iter())
                        .for_each(|(row, x)| sums.add_one(segment, sample, phase, (row, x))),
                }
            }
        }
        let own = &mut self.predictors[0].1;
        let diverged = rollout.windows.iter();
        own.diverged += diverged.filter(|w| w.diverged_at_s.is_some()).count();
        own.windows += rollout.windows.len();
        Ok(())
    }
}

/// The state that a predictor gives for one sample.
enum Predicted {
    Latent(DVector<f64>),
    /// All coordinates of the robot.
    All(DVector<f64>),
    /// Some coordinates of the body.
    Body(Vec<(usize, f64)>),
}

impl Predicted {
    /// Coordinates of the centre of mass, m or rad. If the body alone is predicted, both have the same acceleration.
    fn mass_centre(
        &self,
        model: &ReducedModel,
        all: &[MassCentre],
        coasted: &DVector<f64>,
    ) -> Result<Vec<Option<f64>>> {
        if all.is_empty() {
            return Ok(Vec::new());
        }
        let z = match self {
            Self::Latent(z) => z.clone(),
            Self::All(x) => model.encode(x)?,
            Self::Body(_) => model.encode(coasted)?,
        };
        let accelerated = |of: &MassCentre| match self {
            Self::Latent(_) | Self::All(_) => Some(0.0),
            Self::Body(rows) => {
                let (row, moved) = rows.iter().find(|(row, _)| *row == of.axis)?;
                Some(moved - coasted[*row])
            }
        };
        let each = all.iter();
        Ok(each
            .map(|of| Some(z[of.latent] / of.factor + accelerated(of)?))
            .collect())
    }
}

/// Samples from each take-off to the touchdown after it, both included.
fn flights(segment: &Segment) -> Result<Vec<Range<usize>>> {
    let rule = PhaseRule::two_phase().with_min_samples(CHATTER_SAMPLES);
    let spans = rule.spans(segment)?.into_iter();
    Ok(spans
        .filter(|span| span.kind == Stance::Flight)
        .filter(|span| span.range.start > 0 && span.range.end < segment.len())
        .map(|span| span.range.start..span.range.end + 1)
        .collect())
}

struct Baselines {
    mean_jump: Option<MeanJump>,
    rigid_body: Option<RigidBody>,
}

/// The training jump of the mean goal, by the time since its take-off. A prediction is the change along it.
struct MeanJump {
    time_s: Vec<f64>,
    x: Vec<DVector<f64>>,
}

impl MeanJump {
    /// None for a model without a prior of jumps.
    fn of(model: &ReducedModel) -> Result<Option<Self>> {
        let Ok(prior) = model.jump_prior() else {
            return Ok(None);
        };
        let mean = prior.ranges().map(|range| range.mean);
        let features = prior.features(mean);
        let parts = prior.parts.iter().zip(&prior.landmarks.parts);
        let launch = parts.take_while(|(_, landmark)| landmark.is_grounded());
        let take_off_s: f64 = launch.map(|(part, _)| part.duration(&features)).sum();
        let (mut time_s, mut x, mut start_s) = (Vec::new(), Vec::new(), -take_off_s);
        for part in &prior.parts {
            let duration_s = part.duration(&features);
            let last = (part.nodes() - 1) as f64;
            for node in 0..part.nodes() {
                time_s.push(start_s + duration_s * node as f64 / last);
                x.push(model.decode(&JumpPart::at(&part.z, node, &features))?);
            }
            start_s += duration_s;
        }
        Ok(Some(Self { time_s, x }))
    }

    fn at(&self, time_s: f64) -> DVector<f64> {
        let (left, right, share) = between(&self.time_s, time_s);
        self.x[left].lerp(&self.x[right], share)
    }
}

/// The training's mean stride at the mean speed, yaw rate and height of a motion, synchronised with its touchdowns. A
/// prediction is the change along it.
struct MeanStride {
    nodes: DMatrix<f64>, // n x 40, see StridePrior
    stride_s: f64,
    touchdown_s: f64,
    velocity: [(usize, f64); 3],
}

impl MeanStride {
    /// None for a model without strides, and for a motion in which no pair of feet comes down.
    fn of(model: &ReducedModel, segment: &Segment, stride_s: f64) -> Option<Self> {
        let (prior, robot) = (model.stride_prior().ok()?, model.robot().ok()?);
        // The stride begins with the front right foot and the one across it; the others come half a stride later.
        let pairs = [([0, 3], 0.0), ([1, 2], 0.5 * stride_s)];
        let touchdown = |sample: usize| {
            let is_up = |sample: usize, pair: [usize; 2]| {
                !pair.iter().any(|&foot| segment.feet[sample][foot])
            };
            let comes =
                |(pair, _): &([usize; 2], f64)| is_up(sample - 1, *pair) && !is_up(sample, *pair);
            let late_s = pairs.iter().find(|pair| comes(pair))?.1;
            Some(segment.time_s[sample] - late_s)
        };
        let touchdown_s = (1..segment.len()).find_map(touchdown)?;
        let (last, duration_s) = (segment.len() - 1, segment.duration_s());
        let velocity = [BODY_X, BODY_X + 1, BODY_X + 5].map(|row| {
            (
                row,
                (segment.x[(row, last)] - segment.x[(row, 0)]) / duration_s,
            )
        });
        let [forward, left, turn] = velocity.map(|(_, rate)| rate);
        let (duty, height) = (prior.gait[4].mean, segment.x.row(BODY_Z).mean());
        let gait = [forward, left, turn, 1.0 / stride_s, duty, height];
        Some(Self {
            nodes: prior.stride(robot, &gait),
            stride_s,
            touchdown_s,
            velocity,
        })
    }

    fn at(&self, time_s: f64) -> DVector<f64> {
        let count = self.nodes.nrows();
        let passed_s = time_s - self.touchdown_s;
        let place = (passed_s / self.stride_s).rem_euclid(1.0) * count as f64;
        let (node, share) = (place as usize % count, place.fract());
        let [from, to] = [node, (node + 1) % count].map(|node| self.nodes.row(node));
        let mut x = DVector::from_fn(STATE_DIM, |i, _| from[i] + share * (to[i] - from[i]));
        for (row, rate) in self.velocity {
            x[row] += rate * passed_s;
        }
        x
    }
}

/// State rows of the rigid body.
const BODY: [usize; BODY_DIM] = [
    BODY_X,
    BODY_X + 1,
    BODY_Z,
    BODY_X + 3,
    BODY_X + 4,
    BODY_X + 5,
];

/// `ddx = F_x / m` and likewise `y`, `ddz = F_z / m - g`, `ddpitch = M_y / I_y` and likewise roll and yaw. `1 / m` and
/// `1 / I` are fitted to the recorded accelerations by least squares.
struct RigidBody {
    by: [f64; 4], // 1 / m, then 1 / I of roll, pitch and yaw
    rule: InputRule,
}

impl RigidBody {
    /// None without a sample on the ground.
    fn of(model: &ReducedModel, segments: &[&Segment]) -> Result<Option<Self>> {
        let rule = model.input_rule()?;
        let rule = InputRule::new(rule.robot(), rule.actuators().cloned(), WrenchFrame::Ground);
        // Load times acceleration and load squared; of the mass, then of the inertias.
        let mut sums = [[0.0; 2]; 4];
        for segment in segments {
            let load = segment.input(&rule)?.rows(JOINT_DIM, BODY_DIM).into_owned();
            for (sample, load) in load.column_iter().enumerate() {
                for (i, row) in BODY.into_iter().enumerate() {
                    let fall = if row == BODY_Z { GRAVITY_M_S2 } else { 0.0 };
                    let of = &mut sums[inertia(i)];
                    of[0] += load[i] * (segment.ddx[(row, sample)] + fall);
                    of[1] += load[i] * load[i];
                }
            }
        }
        if sums.iter().any(|of| of[1] <= 0.0) {
            return Ok(None);
        }
        let by = sums.map(|of| of[0] / of[1]);
        Ok(Some(Self { by, rule }))
    }

    /// Of the body, 6 x n.
    fn accelerations(&self, segment: &Segment) -> Result<DMatrix<f64>> {
        let mut load = (segment.input(&self.rule)?.rows(JOINT_DIM, BODY_DIM)).into_owned();
        for (i, mut row) in load.row_iter_mut().enumerate() {
            row *= self.by[inertia(i)];
        }
        load.row_mut(2).add_scalar_mut(-GRAVITY_M_S2);
        Ok(load)
    }
}

fn inertia(row: usize) -> usize {
    row.saturating_sub(2)
}

/// Where a body with these accelerations (6 x n) is after the samples of a range, from its state at the first.
fn moved_by(
    segment: &Segment,
    accelerations: &DMatrix<f64>,
    range: Range<usize>,
) -> [f64; BODY_DIM] {
    std::array::from_fn(|i| {
        let state = |m: &DMatrix<f64>| m[(BODY[i], range.start)];
        let (mut position, mut velocity) = (state(&segment.x), state(&segment.dx));
        for sample in range.clone() {
            let h = segment.time_s[sample + 1] - segment.time_s[sample];
            let [before, after] = [sample, sample + 1].map(|k| accelerations[(i, k)]);
            position += h * velocity + h * h * (2.0 * before + after) / 6.0;
            velocity += 0.5 * h * (before + after);
        }
        position
    })
}

/// A linear inverted pendulum over the middle `p` of the feet on the ground (Kajita et al. 2001):
/// `ddx = (g / h) (x - p_x)` and likewise `y`, with the mean height `h` of the body over its feet. Without a foot on
/// the ground `ddx = 0`.
struct Pendulum {
    middle: Vec<Option<[f64; 2]>>,
    rate_per_s2: f64, // g / h
}

impl Pendulum {
    fn of(model: &ReducedModel, segment: &Segment) -> Result<Self> {
        let robot = model.robot()?;
        let (mut height, mut stances) = (0.0, 0.0);
        let middle = (0..segment.len()).map(|sample| {
            let x = segment.state(sample);
            let down: Vec<_> = Leg::down(segment.feet[sample])
                .map(|leg| robot.foot_in_world(leg, &x))
                .collect();
            let count = down.len() as f64;
            let mean = |axis: usize| down.iter().map(|foot| foot[axis]).sum::<f64>() / count;
            (!down.is_empty()).then(|| {
                height += x[BODY_Z] - mean(2);
                stances += 1.0;
                [mean(0), mean(1)]
            })
        });
        let middle = middle.collect();
        let height: f64 = height / f64::max(stances, 1.0);
        let rate_per_s2 = if height > 0.0 {
            GRAVITY_M_S2 / height
        } else {
            0.0
        };
        Ok(Self {
            middle,
            rate_per_s2,
        })
    }

    /// x and y after the samples of a range, from the state at the first: semi-implicit steps.
    fn moved(&self, segment: &Segment, range: Range<usize>) -> [f64; 2] {
        std::array::from_fn(|axis| {
            let state = |m: &DMatrix<f64>| m[(BODY_X + axis, range.start)];
            let (mut position, mut velocity) = (state(&segment.x), state(&segment.dx));
            for sample in range.clone() {
                let h = segment.time_s[sample + 1] - segment.time_s[sample];
                if let Some(middle) = self.middle[sample] {
                    velocity += h * self.rate_per_s2 * (position - middle[axis]);
                }
                position += h * velocity;
            }
            position
        })
    }
}
