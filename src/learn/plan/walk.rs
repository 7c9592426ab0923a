//! Walks that nobody recorded: a speed and a yaw rate in, a recording out, from the strides of the training.

use super::*;
use crate::model::{GAIT_DIM, StridePrior};

const SOURCE: &str = "plan";
const MOST_SAMPLES: f64 = 1e6;
const SPEEDS: usize = 8; // of a map
const YAW_RATES: usize = 7;
const STRIDES: f64 = 2.0; // of each of its walks
const SMOOTHED: usize = 2; // samples on each side of a sample over which velocities are averaged
const NAMES: [(&str, &str); 3] = [
    ("speed", "m/s"),
    ("sideways speed", "m/s"),
    ("yaw rate", "rad/s"),
];

/// A steady walk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WalkGoal {
    /// Forwards, m/s.
    pub speed_m_s: f64,
    /// To the left, rad/s.
    pub yaw_rate_rad_s: f64,
    /// Of the walk, s.
    pub duration_s: f64,
}

/// A planned walk, which is a recording.
#[derive(Clone, Debug)]
pub struct WalkPlan {
    pub motion: Segment,
    /// Duration of a stride, s, share of it that a foot stands, height of the body, m.
    pub stride_s: f64,
    pub duty: f64,
    pub height_m: f64,
    pub verdict: Verdict,
}

/// Walks over a grid of speeds and yaw rates, a row a yaw rate.
#[derive(Clone, Debug)]
pub struct WalkMap {
    pub speeds_m_s: Vec<f64>,
    pub yaw_rates_rad_s: Vec<f64>,
    pub points: Vec<MappedWalk>,
}

#[derive(Clone, Debug)]
pub struct MappedWalk {
    pub speed_m_s: f64,
    pub yaw_rate_rad_s: f64,
    pub status: &'static str,
    /// Largest torque of a motor, as a share of its limit.
    pub torque_share: f64,
}

/// Plans walks over the whole range in which walks are planned.
///
/// # Errors
/// Those of [`walk`].
pub fn walk_reach(model: &ReducedModel) -> Result<WalkMap> {
    let (prior, limits) = (model.stride_prior()?, model.robot()?.torque_limit_nm());
    let [speeds_m_s, yaw_rates_rad_s] = [(0, SPEEDS), (2, YAW_RATES)].map(|(axis, count)| {
        let [least, most] = prior.reach(axis);
        let share = |k: usize| k as f64 / (count - 1) as f64;
        (0..count)
            .map(|k| least + share(k) * (most - least))
            .collect::<Vec<f64>>()
    });
    let mut points = Vec::with_capacity(SPEEDS * YAW_RATES);
    for &yaw_rate_rad_s in &yaw_rates_rad_s {
        for &speed_m_s in &speeds_m_s {
            let goal = WalkGoal {
                speed_m_s,
                yaw_rate_rad_s,
                duration_s: STRIDES / prior.gait[3].mean,
            };
            let planned = walk(model, &goal)?;
            let torques = planned.motion.torque_nm.column_iter();
            let shares = torques.flat_map(|column| {
                let pairs: Vec<f64> = column
                    .iter()
                    .zip(limits)
                    .map(|(t, limit)| t.abs() / limit)
                    .collect();
                pairs
            });
            points.push(MappedWalk {
                speed_m_s,
                yaw_rate_rad_s,
                status: planned.verdict.word(),
                torque_share: shares.fold(0.0, f64::max),
            });
        }
    }
    Ok(WalkMap {
        speeds_m_s,
        yaw_rates_rad_s,
        points,
    })
}

/// A stride of the goal's gait, repeated: half a stride from the prior, half the mirror image of the gait that turns
/// the other way. Velocities are differences of the positions. Torques are those of the prior plus the losses of this
/// motion.
///
/// # Errors
/// Those of a model without strides or robot, and for more than 1e6 samples.
pub fn walk(model: &ReducedModel, goal: &WalkGoal) -> Result<WalkPlan> {
    let (prior, rule) = (model.stride_prior()?, model.input_rule()?);
    let [.., frequency, duty, height] = prior.gait.map(|range| range.mean);
    let gait = [
        goal.speed_m_s,
        0.0,
        goal.yaw_rate_rad_s,
        frequency,
        duty,
        height,
    ];
    let stride = prior.stride(rule.robot(), &gait);
    let sample_time_s = model.sample_time_s()?;
    let steps = (goal.duration_s / sample_time_s).round().max(1.0);
    if steps > MOST_SAMPLES {
        return Err(PlanError::Goal {
            what: "samples of the walk",
            found: steps,
            expected: format!(
                "at most {MOST_SAMPLES}: a shorter duration, or a longer `sample_time_s`"
            ),
        });
    }
    let count = steps as usize + 1;
    let times = (0..count).map(|sample| sample as f64 * sample_time_s);
    let mut motion = Segment::still(SOURCE, times.collect());
    motion.is_walk = true;
    let mut net = DMatrix::zeros(JOINT_DIM, count);
    for sample in 0..count {
        let time_s = motion.time_s[sample];
        let place = (time_s * frequency).fract() * stride.nrows() as f64;
        let (node, share) = (place as usize % stride.nrows(), place.fract());
        let next = (node + 1) % stride.nrows();
        let row = stride.row(node) * (1.0 - share) + stride.row(next) * share;
        for i in 0..STATE_DIM {
            motion.x[(i, sample)] = row[i];
        }
        let heading = goal.yaw_rate_rad_s * time_s;
        // The place on a circle: a chord along the mean heading, on a line as long as the way.
        let half = 0.5 * heading;
        let shortened = if half == 0.0 { 1.0 } else { half.sin() / half };
        let [x, y] = about_vertical([goal.speed_m_s * time_s * shortened, 0.0], half);
        let [along, across] = about_vertical([row[BODY_X], row[BODY_X + 1]], heading);
        motion.x[(BODY_X, sample)] = x + along;
        motion.x[(BODY_X + 1, sample)] = y + across;
        motion.x[(YAW, sample)] += heading;
        for joint in 0..JOINT_DIM {
            net[(joint, sample)] = row[STATE_DIM + joint];
        }
        motion.feet[sample] = std::array::from_fn(|foot| row[2 * STATE_DIM + foot] > 0.5);
    }
    motion.dx = smoothed_differences(&motion.time_s, &motion.x);
    motion.ddx = smoothed_differences(&motion.time_s, &motion.dx);
    motion.torque_nm = net + motion.losses(&rule);
    Ok(WalkPlan {
        motion,
        stride_s: 1.0 / frequency,
        duty,
        height_m: height,
        verdict: verdict(prior, &gait),
    })
}

/// Central differences, each the mean of its neighbours'.
fn smoothed_differences(time_s: &[f64], values: &DMatrix<f64>) -> DMatrix<f64> {
    let last = time_s.len() - 1;
    let mut rates = DMatrix::zeros(values.nrows(), time_s.len());
    for sample in 0..=last {
        let (from, to) = (
            sample.saturating_sub(SMOOTHED + 1),
            (sample + SMOOTHED + 1).min(last),
        );
        let rate = (values.column(to) - values.column(from)) / (time_s[to] - time_s[from]);
        rates.set_column(sample, &rate);
    }
    rates
}

fn verdict(prior: &StridePrior, gait: &[f64; GAIT_DIM]) -> Verdict {
    let (mut beyond, mut far) = (Vec::new(), Vec::new());
    for (number, ((range, value), (name, unit))) in
        prior.gait.iter().zip(gait).zip(NAMES).enumerate()
    {
        let [least, most] = prior.reach(number);
        let text = format!(
            "{name} {value} {unit}, recorded from {:.2} to {:.2}",
            range.least, range.most
        );
        if *value < least || *value > most {
            far.push(text);
        } else if *value < range.least || *value > range.most {
            beyond.push(text);
        }
    }
    match (far.is_empty(), beyond.is_empty()) {
        (false, _) => Verdict::Refused(far),
        (true, false) => Verdict::Extrapolates(beyond),
        (true, true) => Verdict::Trusted,
    }
}
