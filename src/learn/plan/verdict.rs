//! Whether to trust a plan.

use super::*;

const LEAST_WEIGHT_SHARE: f64 = 0.5;
const NO_SLACK: f64 = 2e-3;
const NO_JOINT: f64 = 2e-3;
const NO_FRICTION_N: f64 = 2.0;
/// Twice the drift of plans and recordings with rolling, point-like feet.
const FOOT_DRIFT_M: [f64; 2] = [0.04, 0.02];

#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    Trusted,
    /// Beyond the recordings, with the reasons: it may miss its goal.
    Extrapolates(Vec<String>),
    Refused(Vec<String>),
}

impl Verdict {
    pub fn word(&self) -> &'static str {
        match self {
            Self::Trusted => "trusted",
            Self::Extrapolates(_) => "extrapolates",
            Self::Refused(_) => "refused",
        }
    }

    pub fn reasons(&self) -> &[String] {
        match self {
            Self::Trusted => &[],
            Self::Extrapolates(reasons) | Self::Refused(reasons) => reasons,
        }
    }
}

/// The verdict on the plan at a point of a task; `carried` is the share of the weight that its torques carry.
pub(crate) fn verdict(task: &Task<'_>, y: &[f64], plan: &Plan, carried: Option<f64>) -> Verdict {
    let refused = refusals(task, y, plan, carried);
    if !refused.is_empty() {
        return Verdict::Refused(refused);
    }
    match doubts(task.seed, task.settings, plan) {
        reasons if reasons.is_empty() => Verdict::Trusted,
        reasons => Verdict::Extrapolates(reasons),
    }
}

fn reasons(rules: impl IntoIterator<Item = Option<String>>) -> Vec<String> {
    rules.into_iter().flatten().collect()
}

fn refusals(task: &Task<'_>, y: &[f64], plan: &Plan, carried: Option<f64>) -> Vec<String> {
    let slack = |bound: Bound| {
        let slack = y[task.slack(bound)];
        let percent = 100.0 * slack;
        (slack > NO_SLACK).then(|| match bound {
            Bound::Torque => format!(
                "it would need torques {percent:.0} % beyond the share of the limits that plans may use"
            ),
            Bound::Joint => format!("joints would leave their limits by {slack:.3} rad"),
            Bound::Friction => {
                format!("the feet would slip: the force leaves the friction cone by {percent:.0} N")
            }
            Bound::Height => {
                format!("the body would be {slack:.3} m too low or high in the landing or at the end")
            }
        })
    };
    let percent = 100.0 * plan.margins.torque_share;
    let joint = plan.margins.beyond_joint_limit_rad;
    let force = plan.margins.beyond_friction_n;
    let carried = carried.filter(|share| *share < LEAST_WEIGHT_SHARE);
    let settings = task.settings;
    let (deviation, most) = (plan.input_deviation, settings.refuse_deviation);
    reasons(Bound::ALL.map(slack).into_iter().chain([
        (percent > 100.0)
            .then(|| format!("torques reach {percent:.0} % of their limits between nodes")),
        (joint > NO_JOINT)
            .then(|| format!("a joint is {joint:.3} rad beyond its limit between nodes")),
        (force > settings.friction_slack_n + NO_FRICTION_N)
            .then(|| format!("the force is {force:.0} N outside the friction cone between nodes")),
        carried.map(|share| {
            format!(
                "its torques carry {share:.3} of the robot's weight: the model's inputs cannot be lifted \
                 to forces of its feet"
            )
        }),
        (deviation > most).then(|| {
            format!("its input is {deviation:.1} standard deviations from the recorded ones, more than {most}")
        }),
    ]))
}

fn doubts(seed: &Seed<'_>, settings: &PlanSettings, plan: &Plan) -> Vec<String> {
    let beyond = outside(seed, plan.goal_m);
    let outside = |(what, outside): (&str, f64)| {
        let percent = 100.0 * outside;
        (outside > 0.0).then(|| {
            format!("the {what} is beyond the recorded jumps by {percent:.0} % of their range")
        })
    };
    let deviation = plan.input_deviation;
    let drift = plan.margins.foot_drift_m;
    let [along, below] = drift.map(|drift| 1e3 * drift);
    let lost = seed.start_lost.join(", ");
    reasons(["distance", "apex"].into_iter().zip(beyond).map(outside).chain([
        (deviation > settings.warn_deviation).then(|| {
            format!("its input is {deviation:.1} standard deviations from the recorded ones")
        }),
        (drift[0] > FOOT_DRIFT_M[0] || drift[1] > FOOT_DRIFT_M[1]).then(|| {
            format!(
                "feet on the ground move {along:.0} mm along the floor and {below:.0} mm below it: the model's latent \
                 coordinates do not hold them where they stand"
            )
        }),
        (!lost.is_empty()).then(|| {
            format!(
                "the plan does not begin at the recorded start, which the model's latent coordinates cannot hold: {lost}"
            )
        }),
    ]))
}

/// How far a goal is beyond the training jumps, in widths of their range; zero inside.
fn outside(seed: &Seed<'_>, goal_m: [f64; 2]) -> [f64; 2] {
    std::array::from_fn(|i| {
        let range = &seed.prior.ranges()[i];
        let width = (range.most - range.least).max(f64::MIN_POSITIVE);
        let beyond = (range.least - goal_m[i]).max(goal_m[i] - range.most);
        beyond.max(0.0) / width
    })
}
