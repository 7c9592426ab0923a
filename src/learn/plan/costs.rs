//! The cost of a plan as affine expressions of a program's variables, and where the feet of a plan are.

use std::ops::{Div, Mul, Sub};

use nalgebra::Vector3;

use super::*;
use crate::mpc::{Cone, sparse};

const TIME_UNIT_S: f64 = 0.01;
const FIRST_OF_POSTURE: usize = 2; // the two before it carry the body

pub(crate) fn add(task: &Task<'_>, y: &[f64], builder: &mut Builder) {
    for (expression, weight) in squares(task, y) {
        builder.square(&expression, weight);
    }
}

pub(crate) fn value(task: &Task<'_>, y: &[f64]) -> f64 {
    let squares = squares(task, y).into_iter();
    squares.fold(0.0, |total, (expression, weight)| {
        total + weight * expression.at(y).powi(2)
    })
}

fn squares(task: &Task<'_>, y: &[f64]) -> Vec<(Affine, f64)> {
    let (d, settings) = (task.seed.latent_dim, task.settings);
    let share = 1.0 / d as f64;
    let one = |variable: usize, weight: f64| (Affine::default().plus(variable, 1.0), weight);
    let mut out = Vec::new();
    for (part, of) in task.seed.parts.iter().enumerate() {
        let step = of.duration_s / of.intervals() as f64;
        let next = task.seed.parts.get(part + 1);
        let lifts = of.is_grounded() && next.is_some_and(|next| !next.is_grounded());
        for node in 0..of.z.len() {
            let is_take_off = lifts && node == of.intervals();
            let [input, rate] = [[1.0; 2], settings.at_take_off][usize::from(is_take_off)];
            let end = node == 0 || node == of.intervals();
            let time = step / TIME_UNIT_S * if end { 0.5 } else { 1.0 };
            let at = task.node(part, node);
            for i in 0..d {
                if i >= FIRST_OF_POSTURE {
                    out.push(one(at + i, settings.posture * share * time));
                }
                out.push(one(at + d + i, settings.rate * rate * share * time));
                out.push(one(at + 2 * d + i, settings.input * input * share * time));
            }
            if node < of.intervals() {
                let next = task.node(part, node + 1);
                let per_unit = (TIME_UNIT_S / step).powi(2) * step / TIME_UNIT_S;
                for i in 0..d {
                    let change = Affine::default().plus(next + 2 * d + i, 1.0);
                    let change = change.plus(at + 2 * d + i, -1.0);
                    out.push((change, settings.smoothness * share * per_unit));
                }
            }
        }
        let weight = match part {
            0 => settings.first_duration,
            _ => settings.duration[usize::from(!of.is_grounded())],
        };
        // A small cost of every duration keeps the program strictly convex.
        out.push(one(task.duration(part), weight.max(1e-3)));
    }
    for part in 0..task.seed.parts.len() {
        add_feet(task, y, part, &mut out);
        if part > 0 {
            add_take_off(task, y, part, &mut out);
        }
    }
    out
}

/// Feet rise after take-off as in the prior. If they rise more slowly, the cost acts like a soft floor.
fn add_take_off(task: &Task<'_>, y: &[f64], part: usize, out: &mut Vec<(Affine, f64)>) {
    let (settings, of) = (task.settings, &task.seed.parts[part]);
    let (before, after) = (task.seed.parts[part - 1].landmark.feet, of.landmark.feet);
    let step = of.duration_s / of.intervals() as f64;
    let lifted: Vec<Leg> = Leg::down(before)
        .filter(|leg| !after[leg.index()])
        .collect();
    for &leg in &lifted {
        let [_, from] = moved_foot(task, y, leg, (part, 0));
        let nodes = (settings.take_off_s / step).round() as usize;
        for node in 1..=nodes.min(of.intervals()) {
            let [_, moved] = moved_foot(task, y, leg, (part, node));
            let unit = settings.foot_m[1];
            let weight = settings.take_off / lifted.len() as f64 * step / TIME_UNIT_S;
            out.push((moved - from.clone(), weight / (unit * unit)));
        }
    }
}

/// Feet stay as far as they do in the prior: along the floor from the start or touch-down, above it from the start.
fn add_feet(task: &Task<'_>, y: &[f64], part: usize, out: &mut Vec<(Affine, f64)>) {
    let (settings, of) = (task.settings, &task.seed.parts[part]);
    let anchor_part = task.anchor_part(part);
    let time = of.duration_s / of.intervals() as f64 / TIME_UNIT_S;
    let count = Leg::down(of.landmark.feet).count();
    for leg in Leg::down(of.landmark.feet) {
        let anchor = moved_foot(task, y, leg, (anchor_part, 0));
        for node in 0..of.z.len() {
            if (part, node) == (anchor_part, 0) {
                continue;
            }
            let moved = moved_foot(task, y, leg, (part, node));
            for (axis, mut slip) in moved.into_iter().enumerate() {
                if axis == 0 || anchor_part == 0 {
                    slip = slip - anchor[axis].clone();
                }
                let unit = settings.foot_m[axis];
                out.push((slip, settings.feet / count as f64 * time / (unit * unit)));
            }
        }
    }
}

pub(crate) fn moved_foot(
    task: &Task<'_>,
    y: &[f64],
    leg: Leg,
    (part, node): (usize, usize),
) -> [Affine; 2] {
    let z = task.values(part, node, y).z;
    let now = foot_place(task.seed, leg, &z);
    let before = foot_place(task.seed, leg, &task.seed.parts[part].z[node]);
    std::array::from_fn(|axis| {
        let moved = Affine::from(now.at[axis] - before.at[axis]);
        (0..task.seed.latent_dim).fold(moved, |moved, i| {
            let slope = now.by_z[(axis, i)];
            moved + task.latent(part, node, i) * slope + -(slope * z[i])
        })
    })
}

struct FootPlace {
    at: [f64; 2],
    by_z: DMatrix<f64>,
}

/// The foot of a leg at a latent position; roll and yaw of a jump forwards are left out.
fn foot_place(seed: &Seed<'_>, leg: Leg, z: &DVector<f64>) -> FootPlace {
    let robot = seed.rule.robot();
    let x = seed.decoded(z);
    let joints: [f64; JOINT_DIM] = std::array::from_fn(|i| x[i]);
    let q = leg.of_joints(&joints);
    let (sin, cos) = x[PITCH].sin_cos();
    let foot = robot.foot_from_body(leg, &q);
    let along = |v: &Vector3<f64>| cos * v.x + sin * v.z;
    let above = |v: &Vector3<f64>| -sin * v.x + cos * v.z;
    let jacobian = robot.geometry(leg).foot_jacobian(&q);
    let mut by_x = DMatrix::zeros(2, STATE_DIM);
    for joint in 0..3 {
        let column = Vector3::from(jacobian.column(joint));
        let at = 3 * leg.index() + joint;
        by_x[(0, at)] = along(&column);
        by_x[(1, at)] = above(&column);
    }
    by_x[(0, BODY_X)] = 1.0;
    by_x[(1, BODY_Z)] = 1.0;
    by_x[(0, PITCH)] = above(&foot);
    by_x[(1, PITCH)] = -along(&foot);
    FootPlace {
        at: [x[BODY_X] + along(&foot), x[BODY_Z] + above(&foot)],
        by_z: by_x * &seed.decode,
    }
}

/// `constant + sum of factor times variable`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Affine {
    pub terms: Vec<(usize, f64)>,
    pub constant: f64,
}

impl Affine {
    pub(crate) fn plus(mut self, variable: usize, factor: f64) -> Self {
        if factor != 0.0 {
            self.terms.push((variable, factor));
        }
        self
    }

    pub(crate) fn at(&self, y: &[f64]) -> f64 {
        self.constant + self.terms.iter().map(|&(i, f)| f * y[i]).sum::<f64>()
    }
}

impl From<f64> for Affine {
    fn from(constant: f64) -> Self {
        let terms = Vec::new();
        Self { terms, constant }
    }
}

impl<T: Into<Self>> Add<T> for Affine {
    type Output = Self;

    fn add(mut self, other: T) -> Self {
        let other = other.into();
        self.constant += other.constant;
        self.terms.extend(other.terms);
        self
    }
}

impl Sub for Affine {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl Mul<f64> for Affine {
    type Output = Self;

    fn mul(mut self, factor: f64) -> Self {
        self.constant *= factor;
        self.terms.iter_mut().for_each(|(_, f)| *f *= factor);
        self.terms.retain(|(_, f)| *f != 0.0);
        self
    }
}

impl Div<f64> for Affine {
    type Output = Self;

    fn div(mut self, unit: f64) -> Self {
        self.constant /= unit;
        self.terms.iter_mut().for_each(|(_, f)| *f /= unit);
        self
    }
}

/// A program under construction: half the sum of weighted squares, linear costs, rows.
#[derive(Default)]
pub(crate) struct Builder {
    cost: Vec<(usize, usize, f64)>,
    linear: Vec<(usize, f64)>,
    equal: Vec<Affine>,
    at_most: Vec<Affine>,
}

impl Builder {
    /// Adds `weight/2 (expression)^2` to the cost.
    pub(crate) fn square(&mut self, expression: &Affine, weight: f64) {
        let mut terms = expression.terms.clone();
        terms.sort_unstable_by_key(|&(variable, _)| variable);
        terms.dedup_by(|next, before| {
            let same = next.0 == before.0;
            before.1 += if same { next.1 } else { 0.0 };
            same
        });
        for (number, &(i, a)) in terms.iter().enumerate() {
            self.linear.push((i, weight * a * expression.constant));
            for &(j, b) in &terms[number..] {
                self.cost.push((i, j, weight * a * b));
            }
        }
    }

    pub(crate) fn linear(&mut self, variable: usize, factor: f64) {
        self.linear.push((variable, factor));
    }

    pub(crate) fn equal(&mut self, expression: Affine) {
        self.equal.push(expression);
    }

    pub(crate) fn at_most(&mut self, expression: Affine) {
        self.at_most.push(expression);
    }

    pub(crate) fn program(self, variables: usize) -> ConeProgram {
        let mut q = vec![0.0; variables];
        for (variable, factor) in self.linear {
            q[variable] += factor;
        }
        let rows = self.equal.len() + self.at_most.len();
        let mut entries = Vec::new();
        let mut b = Vec::with_capacity(rows);
        for (row, expression) in self.equal.iter().chain(&self.at_most).enumerate() {
            b.push(-expression.constant);
            entries.extend(expression.terms.iter().map(|&(col, f)| (row, col, f)));
        }
        let mut cones = vec![Cone::Zero(self.equal.len())];
        if !self.at_most.is_empty() {
            cones.push(Cone::Nonnegative(self.at_most.len()));
        }
        ConeProgram {
            p: sparse(variables, variables, &self.cost),
            q,
            a: sparse(rows, variables, &entries),
            b,
            cones,
        }
    }
}
