//! The program of a plan about an iterate.
//!
//! Every part has `n + 1` nodes. With the prior's trajectory `(z_p, dz_p, u_p)`, variables are deviations in standard
//! deviations: `z = z_p + sigma zeta`, `dz = dz_p + sigma nu`, `u_lat = u_p + L mu`, and a duration `T = T_p (1 + 0.15
//! tau)` per part. Over an interval `h = T / n`, with a bar for the mean of its ends and `f` the model of deviations:
//!
//! ```text
//! minimise   sum over nodes of h/10 ms (|mu|^2 + posture + rates + smoothness + feet) + durations
//! subject to z_(k+1)  - z_k  = h (bar dz + drift_k)
//!            dz_(k+1) - dz_k = h (ddz_k + bar f(zeta, nu, mu))
//!            z, dz continuous, those measured at the start
//!            body x at the end, body z + vz |vz| / 2 g where it is highest, height at the end, rest on ground
//!            |lift u_lat + losses| <= limit, joints inside their limits, |Fx| <= mu Fz
//! ```
//!
//! `drift_k` and `ddz_k` are such that the prior itself is a trajectory; `f` is zero for a coordinate that the model
//! lets fall freely. Only products with `h`, `vz^2`, the feet and the losses are not linear: they are linearised about
//! the iterate, or kept from it. Bounds that are far from active are left out, and looked at again with the result.

use super::costs::{Affine, Builder};
use super::*;

pub(crate) const DURATION_SHARE: f64 = 0.15; // change of a duration for tau = 1
const DURATION_BOUND: f64 = 3.0;
const DURATION_STEP: f64 = 2.0;
/// Cost per unit of a bound that is not kept: high enough that only bounds that cannot be kept are not.
const SLACK_COST: f64 = 2000.0;
const FORCE_UNIT_N: f64 = 100.0;
/// Torques below this share of their limit, joints farther than this from theirs (rad), get no row.
const FAR_TORQUE: f64 = 0.5;
const FAR_JOINT_RAD: f64 = 0.3;
/// Distance of joints from their limits at the nodes: between two of them angles bend beyond both.
const JOINT_INSET_RAD: f64 = 0.01;

/// Bounds whose violation is a variable of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bound {
    Torque,
    Joint,
    Friction, // violation in 100 N
    Height,
}

impl Bound {
    pub(crate) const ALL: [Self; 4] = [Self::Torque, Self::Joint, Self::Friction, Self::Height];
}

pub(crate) struct NodeValues {
    pub z: DVector<f64>,
    pub dz: DVector<f64>,
    pub u_lat: DVector<f64>,
}

pub(crate) struct Task<'a> {
    pub seed: &'a Seed<'a>,
    pub settings: &'a PlanSettings,
    first: Vec<usize>,
    pub apex_node: usize,
}

impl<'a> Task<'a> {
    pub(crate) fn new(seed: &'a Seed<'a>, settings: &'a PlanSettings) -> Self {
        let mut first = vec![0];
        for part in &seed.parts {
            first.push(first[first.len() - 1] + 3 * seed.latent_dim * part.z.len());
        }
        let mut task = Self {
            seed,
            settings,
            first,
            apex_node: 0,
        };
        task.place_apex(&task.prior_point());
        task
    }

    pub(crate) fn node(&self, part: usize, node: usize) -> usize {
        self.first[part] + 3 * self.seed.latent_dim * node
    }

    pub(crate) fn duration(&self, part: usize) -> usize {
        self.first[self.seed.parts.len()] + part
    }

    pub(crate) fn slack(&self, bound: Bound) -> usize {
        self.duration(self.seed.parts.len()) + bound as usize
    }

    fn variables(&self) -> usize {
        self.duration(self.seed.parts.len()) + Bound::ALL.len()
    }

    pub(crate) fn duration_s(&self, part: usize, y: &[f64]) -> f64 {
        let tau = y[self.duration(part)];
        self.seed.parts[part].duration_s * (1.0 + DURATION_SHARE * tau)
    }

    pub(crate) fn values(&self, part: usize, node: usize, y: &[f64]) -> NodeValues {
        let d = self.seed.latent_dim;
        let of = &self.seed.parts[part];
        let at = self.node(part, node);
        let std = &self.seed.prior.state_std;
        let mu = DVector::from_column_slice(&y[at + 2 * d..at + 3 * d]);
        NodeValues {
            z: DVector::from_fn(d, |i, _| of.z[node][i] + std[i] * y[at + i]),
            dz: DVector::from_fn(d, |i, _| of.dz[node][i] + std[d + i] * y[at + d + i]),
            u_lat: &of.u_lat[node] + &of.root * mu,
        }
    }

    pub(crate) fn acceleration(&self, part: usize, interval: usize, i: usize) -> Affine {
        let of = &self.seed.parts[part];
        let mut sum = Affine::from(of.ddz[interval][i]);
        for node in [interval, interval + 1] {
            for (k, slope) in of.slope[node].row(i).iter().enumerate() {
                sum = sum.plus(self.node(part, node) + k, 0.5 * slope);
            }
        }
        sum
    }

    /// Latent position `i` of a node, from `latent_dim` on a velocity.
    pub(crate) fn latent(&self, part: usize, node: usize, i: usize) -> Affine {
        let of = &self.seed.parts[part];
        let prior = match i.checked_sub(self.seed.latent_dim) {
            None => of.z[node][i],
            Some(i) => of.dz[node][i],
        };
        let variable = self.node(part, node) + i;
        Affine::from(prior).plus(variable, self.seed.prior.state_std[i])
    }

    pub(crate) fn x(&self, part: usize, node: usize, coordinate: usize) -> Affine {
        let factors = self.seed.decode.row(coordinate);
        let terms = (factors.iter().enumerate()).map(|(i, f)| self.latent(part, node, i) * *f);
        terms.fold(Affine::from(self.seed.decode_bias[coordinate]), Add::add)
    }

    pub(crate) fn dx(&self, part: usize, node: usize, coordinate: usize) -> Affine {
        let (factors, d) = (self.seed.decode.row(coordinate), self.seed.latent_dim);
        let terms = (factors.iter().enumerate()).map(|(i, f)| self.latent(part, node, d + i) * *f);
        terms.fold(Affine::default(), Add::add)
    }

    pub(crate) fn input(&self, part: usize, node: usize, entry: usize) -> Affine {
        let of = &self.seed.parts[part];
        let row = self.seed.lift.row(entry);
        let first = self.node(part, node) + 2 * self.seed.latent_dim;
        let by_mu = row * &of.root;
        let prior = Affine::from((row * &of.u_lat[node])[0]);
        ((first..).zip(by_mu.iter())).fold(prior, |sum, (mu, factor)| sum.plus(mu, *factor))
    }

    pub(crate) fn losses(&self, part: usize, node: usize, y: &[f64]) -> [f64; JOINT_DIM] {
        let d = self.seed.latent_dim;
        let of = &self.seed.parts[part];
        let at = self.values(part, node, y);
        let (decode, bias) = (&self.seed.decode, &self.seed.decode_bias);
        let [x, rates] = [decode * at.z + bias, decode * at.dz];
        let last = of.intervals() - 1;
        let around = [node.saturating_sub(1).min(last), node.min(last)];
        let mean = DVector::from_fn(d, |i, _| {
            let both = around.map(|interval| self.acceleration(part, interval, i).at(y));
            0.5 * (both[0] + both[1])
        });
        let array = |v: DVector<f64>| std::array::from_fn(|i| v[i]);
        let [x, dx, ddx] = [x, rates, decode * mean].map(array);
        (self.seed.rule).losses([&x, &dx, &ddx], of.landmark.feet)
    }

    pub(crate) fn program(&self, y: &[f64]) -> ConeProgram {
        let mut builder = Builder::default();
        costs::add(self, y, &mut builder);
        for part in 0..self.seed.parts.len() {
            self.equations(part, y, &mut builder);
            self.bounds(part, y, &mut builder);
        }
        self.ends(y, &mut builder);
        for bound in Bound::ALL {
            let slack = self.slack(bound);
            builder.linear(slack, SLACK_COST);
            builder.at_most(Affine::default().plus(slack, -1.0));
        }
        builder.program(self.variables())
    }

    fn equations(&self, part: usize, y: &[f64], builder: &mut Builder) {
        let (of, tau) = (&self.seed.parts[part], self.duration(part));
        let step = self.duration_s(part, y) / of.intervals() as f64;
        for interval in 0..of.intervals() {
            for i in 0..2 * self.seed.latent_dim {
                let (row, rate) = self.equation(part, interval, i, step);
                // h = h_0 (1 + share tau): the product with the rate, by its slope at the iterate.
                let by_tau = -of.duration_s / of.intervals() as f64 * DURATION_SHARE * rate.at(y);
                let row = row.plus(tau, by_tau) + -by_tau * y[tau];
                builder.equal(row / self.seed.prior.state_std[i]);
            }
        }
        for sign in [-1.0, 1.0] {
            let bound = DURATION_BOUND.min(sign * y[tau] + DURATION_STEP);
            builder.at_most(Affine::from(-bound).plus(tau, sign));
        }
    }

    fn equation(&self, part: usize, interval: usize, i: usize, step: f64) -> (Affine, Affine) {
        let d = self.seed.latent_dim;
        let [here, next] = [interval, interval + 1];
        let rate = match i.checked_sub(d) {
            None => {
                Affine::from(self.seed.parts[part].drift[interval][i])
                    + self.latent(part, here, d + i) * 0.5
                    + self.latent(part, next, d + i) * 0.5
            }
            Some(i) => self.acceleration(part, interval, i),
        };
        let change = self.latent(part, next, i) - self.latent(part, here, i);
        (change - rate.clone() * step, rate)
    }

    pub(crate) fn defect(&self, y: &[f64]) -> f64 {
        let mut worst = 0.0_f64;
        for (part, of) in self.seed.parts.iter().enumerate() {
            let step = self.duration_s(part, y) / of.intervals() as f64;
            for interval in 0..of.intervals() {
                for i in 0..2 * self.seed.latent_dim {
                    let (row, _) = self.equation(part, interval, i, step);
                    worst = worst.max((row.at(y) / self.seed.prior.state_std[i]).abs());
                }
            }
        }
        let apex = self.apex(y).at(y) / self.seed.prior.ranges()[1].std;
        worst.max(apex.abs())
    }

    fn ends(&self, y: &[f64], builder: &mut Builder) {
        let d = self.seed.latent_dim;
        let std = &self.seed.prior.state_std;
        let each = || (0..d).flat_map(|i| [i, d + i]);
        for i in each() {
            let row = self.latent(0, 0, i) + -self.seed.start[i / d][i % d];
            builder.equal(row / std[i]);
        }
        for part in 1..self.seed.parts.len() {
            let last = self.seed.parts[part - 1].intervals();
            for i in each() {
                let row = self.latent(part, 0, i) - self.latent(part - 1, last, i);
                builder.equal(row / std[i]);
            }
        }
        builder.equal(self.apex(y) / 0.1);
        let (part, node) = self.last();
        let end = self.start_x(BODY_X) + self.seed.goal.goal_m()[0];
        builder.equal((self.x(part, node, BODY_X) + -end) / 0.1);
        if self.seed.parts[part].is_grounded() {
            self.rest(builder);
        }
        let [least, most] = self.seed.prior.landmarks.end_height_m;
        let slack = self.settings.height_slack_m;
        let height = self.slack(Bound::Height);
        let range = [least - slack, most + slack];
        within(builder, &self.x(part, node, BODY_Z), range, Some(height));
    }

    fn rest(&self, builder: &mut Builder) {
        let (part, node) = self.last();
        let speed = self.settings.end_speed_m_s;
        for coordinate in [BODY_X, BODY_Z] {
            let rate = self.dx(part, node, coordinate);
            within(builder, &rate, [-speed, speed], None);
        }
        let pitch = self.settings.end_pitch_rad;
        within(builder, &self.x(part, node, PITCH), [-pitch, pitch], None);
    }

    pub(crate) fn last(&self) -> (usize, usize) {
        let part = self.seed.parts.len() - 1;
        (part, self.seed.parts[part].intervals())
    }

    pub(crate) fn start_x(&self, coordinate: usize) -> f64 {
        self.seed.decoded(&self.seed.start[0])[coordinate]
    }

    fn bounds(&self, part: usize, y: &[f64], builder: &mut Builder) {
        let of = &self.seed.parts[part];
        let robot = self.seed.rule.robot();
        let landing = part + 1 == self.seed.parts.len() && of.is_grounded();
        let [torque, joint, friction, height] = Bound::ALL.map(|b| self.slack(b));
        for node in 0..of.z.len() {
            let losses = self.losses(part, node, y);
            for j in 0..JOINT_DIM {
                let command = (self.input(part, node, j) + losses[j]) / robot.torque_limit_nm()[j];
                let share = self.settings.torque_share;
                let far = -FAR_TORQUE..FAR_TORQUE;
                near(builder, &command, y, ([-share, share], far), torque);
                let (least, most) = robot.joint_limit_rad()[j];
                let far = least + FAR_JOINT_RAD..most - FAR_JOINT_RAD;
                let angle = self.x(part, node, j);
                let inside = [least + JOINT_INSET_RAD, most - JOINT_INSET_RAD];
                near(builder, &angle, y, (inside, far), joint);
            }
            if of.is_grounded() {
                self.friction(part, node, friction, builder);
            }
            if landing {
                let least =
                    self.seed.prior.landmarks.landing_height_m - self.settings.height_slack_m;
                let low = (Affine::from(least) - self.x(part, node, BODY_Z)).plus(height, -1.0);
                if low.at(y) > -0.04 {
                    builder.at_most(low);
                }
            }
        }
    }

    fn friction(&self, part: usize, node: usize, slack: usize, builder: &mut Builder) {
        let [forwards, up] = [BODY_X, BODY_Z].map(|entry| self.input(part, node, entry));
        for sign in [-1.0, 1.0] {
            let row = Affine::from(-self.settings.friction_slack_n / FORCE_UNIT_N)
                + forwards.clone() * (sign / FORCE_UNIT_N)
                + up.clone() * (-self.settings.friction / FORCE_UNIT_N);
            builder.at_most(row.plus(slack, -1.0));
        }
    }

    pub(crate) fn place_apex(&mut self, y: &[f64]) {
        let flight = self.flight();
        let height = |node: usize| self.x(flight, node, BODY_Z).at(y);
        let nodes = 0..=self.seed.parts[flight].intervals();
        let highest = nodes.max_by(|a, b| height(*a).total_cmp(&height(*b)));
        self.apex_node = highest.expect("invariant: a part has nodes");
    }

    pub(crate) fn flight(&self) -> usize {
        let mut parts = self.seed.parts.iter();
        let flight = parts.position(|part| !part.is_grounded());
        flight.expect("invariant: checked with the model")
    }

    /// The part at whose first node the feet of `part` stand: the first part, or the landing itself.
    pub(crate) fn anchor_part(&self, part: usize) -> usize {
        if part > self.flight() { part } else { 0 }
    }

    /// Height reached by ballistic motion from the node of the apex, less the wanted one; linear about the iterate.
    fn apex(&self, y: &[f64]) -> Affine {
        let flight = self.flight();
        let wanted = self.start_x(BODY_Z) + self.seed.goal.goal_m()[1];
        let height = self.x(flight, self.apex_node, BODY_Z) + -wanted;
        let speed = self.dx(flight, self.apex_node, BODY_Z);
        let now = speed.at(y);
        height + speed * (now.abs() / GRAVITY_M_S2) + -(0.5 * now * now.abs() / GRAVITY_M_S2)
    }

    pub(crate) fn prior_point(&self) -> Vec<f64> {
        vec![0.0; self.variables()]
    }
}

fn within(builder: &mut Builder, value: &Affine, range: [f64; 2], slack: Option<usize>) {
    for (sign, bound) in [(-1.0, -range[0]), (1.0, range[1])] {
        side(builder, value, (sign, bound), slack);
    }
}

fn side(builder: &mut Builder, value: &Affine, (sign, bound): (f64, f64), slack: Option<usize>) {
    let row = Affine::from(-bound) + value.clone() * sign;
    builder.at_most(match slack {
        Some(slack) => row.plus(slack, -1.0),
        None => row,
    });
}

/// [`within`], but only where the expression is not inside `far` at the iterate.
fn near(
    builder: &mut Builder,
    value: &Affine,
    y: &[f64],
    (range, far): ([f64; 2], std::ops::Range<f64>),
    slack: usize,
) {
    let now = value.at(y);
    if now < far.start {
        side(builder, value, (-1.0, -range[0]), Some(slack));
    }
    if now > far.end {
        side(builder, value, (1.0, range[1]), Some(slack));
    }
}
