//! Whether to trust a plan.

use super::motion::Margins;
use super::settings::PlanSettings;
use super::transcribe::Bound;

/// Share of the weight that the torques of a plan have to carry.
const LEAST_WEIGHT_SHARE: f64 = 0.5;
/// Violation of a bound at the nodes that counts as none, in its unit.
const NO_SLACK: f64 = 2e-3;
/// Farthest outside a joint's limit between nodes, rad.
const NO_JOINT: f64 = 2e-3;
/// Force outside the friction cone between nodes beyond that allowed at them, N.
const NO_FRICTION_N: f64 = 2.0;
/// Farthest that standing feet may be from where they came down, along the floor, and below it, m:
/// twice what plans and recordings with rolling, point-like feet show.
const FOOT_DRIFT_M: [f64; 2] = [0.04, 0.02];

/// What a plan is worth.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Within what the recordings carry.
    Trusted,
    /// Beyond the recordings, with the reasons: it may miss its goal.
    Extrapolates(Vec<String>),
    /// Not to be carried out, with the reasons.
    Refused(Vec<String>),
}

impl Verdict {
    /// One word: `trusted`, `extrapolates`, `refused`.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Trusted => "trusted",
            Self::Extrapolates(_) => "extrapolates",
            Self::Refused(_) => "refused",
        }
    }

    /// The reasons; none for a trusted plan.
    pub fn reasons(&self) -> &[String] {
        match self {
            Self::Trusted => &[],
            Self::Extrapolates(reasons) | Self::Refused(reasons) => reasons,
        }
    }
}

pub(crate) struct Findings<'a> {
    pub input_deviation: f64,
    pub slack: [(Bound, f64); 4],
    pub margins: &'a Margins,
    /// Widths of the recorded ranges that distance and apex are beyond them.
    pub outside: [f64; 2],
    /// Impulse of the feet over what the robot's weight and change of velocity need.
    pub weight_share: Option<f64>,
    /// What the latent coordinates do not hold of the start, in words.
    pub start_lost: Vec<String>,
}

pub(crate) fn verdict(settings: &PlanSettings, found: &Findings<'_>) -> Verdict {
    let refused = refusals(settings, found);
    if !refused.is_empty() {
        return Verdict::Refused(refused);
    }
    match doubts(settings, found) {
        reasons if reasons.is_empty() => Verdict::Trusted,
        reasons => Verdict::Extrapolates(reasons),
    }
}

fn refusals(settings: &PlanSettings, found: &Findings<'_>) -> Vec<String> {
    let mut refused = Vec::new();
    for (bound, slack) in found.slack {
        if slack > NO_SLACK {
            refused.push(match bound {
                Bound::Torque => format!(
                    "it would take torques {:.0} % beyond the share of the limits that plans may use",
                    100.0 * slack
                ),
                Bound::Joint => format!("joints would leave their limits by {slack:.3} rad"),
                Bound::Friction => format!(
                    "the feet would slip: the force leaves the friction cone by {:.0} N",
                    100.0 * slack
                ),
                Bound::Height => format!("the body would be {slack:.3} m too low or high in the landing or at the end"),
            });
        }
    }
    let margins = found.margins;
    if margins.torque_share > 1.0 {
        let share = 100.0 * margins.torque_share;
        refused.push(format!(
            "torques reach {share:.0} % of their limits between nodes"
        ));
    }
    let (joint, force) = (margins.beyond_joint_limit_rad, margins.beyond_friction_n);
    if joint > NO_JOINT {
        refused.push(format!(
            "a joint is {joint:.3} rad beyond its limit between nodes"
        ));
    }
    if force > settings.friction_slack_n + NO_FRICTION_N {
        refused.push(format!(
            "the force is {force:.0} N outside the friction cone between nodes"
        ));
    }
    if let Some(share) = found.weight_share
        && share < LEAST_WEIGHT_SHARE
    {
        refused.push(format!(
            "its torques carry {share:.3} of what the robot's weight needs: the model's inputs cannot be lifted to \
             forces of its feet"
        ));
    }
    if found.input_deviation > settings.refuse_deviation {
        refused.push(format!(
            "its input is {:.1} standard deviations from what was recorded, more than {}",
            found.input_deviation, settings.refuse_deviation
        ));
    }
    refused
}

fn doubts(settings: &PlanSettings, found: &Findings<'_>) -> Vec<String> {
    let mut reasons = Vec::new();
    for (what, outside) in ["distance", "apex"].into_iter().zip(found.outside) {
        if outside > 0.0 {
            let share = 100.0 * outside;
            reasons.push(format!(
                "the {what} is beyond the recorded jumps by {share:.0} % of their range"
            ));
        }
    }
    if found.input_deviation > settings.warn_deviation {
        reasons.push(format!(
            "its input is {:.1} standard deviations from what was recorded",
            found.input_deviation
        ));
    }
    let [along, below] = found.margins.foot_drift_m;
    if along > FOOT_DRIFT_M[0] || below > FOOT_DRIFT_M[1] {
        reasons.push(format!(
            "feet on the ground move {:.0} mm along the floor and {:.0} mm below it: the model's latent coordinates \
             do not hold them where they stand",
            1e3 * along,
            1e3 * below
        ));
    }
    if !found.start_lost.is_empty() {
        reasons.push(format!(
            "the plan does not begin at the recorded start, which the model's latent coordinates cannot hold: {}",
            found.start_lost.join(", ")
        ));
    }
    reasons
}
