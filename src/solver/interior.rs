//! One iteration of the interior point, and where iterations begin.

use super::lower::Lower;
use super::problem::{Program, Settings};
use super::riccati::{Products, add_multiple, answer, eliminate, plus_columns, plus_product, pull};
use super::rows::{Rows, add_weighted, dot, part, part_mut};
use super::scalar::Real;

/// Share of the way to the boundary that a step leaves: the least and the most.
pub const MARGIN: (f64, f64) = (1e-3, 5e-3);
/// The share between the two, in units of the mean complementarity: near the optimum steps may go further.
pub const MARGIN_FACTOR: f64 = 10.0;
/// Smallest slack and smallest product of slack and multiplier at a start from the gains.
pub const COLD: (f64, f64) = (3e-1, 3.0);
/// The same at a start from a guess.
pub const WARM: (f64, f64) = (1e-2, 1e-3);
/// The same at a start from a guess at the solution of quite another program.
pub const FAR: (f64, f64) = (3e-1, 1.0);
/// The same where a guess turned out to be poor, or the iterations go round in a circle.
pub const AGAIN: (f64, f64) = (1e-1, 2e-1);
/// A guess is of quite another program if the optimum without rows moved further than this, in units of
/// the input's rows.
pub const FAR_CHANGE: f64 = 3.0;
/// A first step from a guess that is shorter than this shows that the guess is not near a solution.
pub const SHORT_STEP: f64 = 0.4;
/// Iterations after which slacks and multipliers are centred again: now and then the method goes round
/// in a circle.
pub const PATIENCE: u32 = 16;

/// Share of the residuals at the last centring, those of the gradient among them, that may be left.
pub const LEFT: f64 = 1e-6;

/// How far a point is from the optimum.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point<T> {
    /// Share of the rows' residuals that the steps since the last centring have left.
    pub left: T,
    /// Largest residual of a row at the last centring.
    pub residual: T,
    /// Sum of the products of slacks and multipliers.
    pub sum: T,
    /// The largest of them.
    pub largest: T,
    /// `Σ vᵀ R v + xᵀ Q x`, one before the first step.
    pub value: T,
}

impl<T: Real> Point<T> {
    /// Largest residual of a row.
    #[inline(always)]
    pub fn infeasibility(&self) -> T {
        self.left * self.residual
    }

    /// Whether the iterations may end here: gradient and rows hold, and each product, or the gap between primal
    /// and dual cost, is small.
    #[inline(always)]
    pub fn is_optimal(&self, settings: &Settings<T>) -> bool {
        self.left <= T::of(LEFT)
            && self.infeasibility() <= settings.tolerance
            && (self.largest <= settings.tolerance
                || self.sum <= settings.gap * T::ONE.or_larger(self.value))
    }
}

/// How far a change of all unknowns may go, and the products of the changes of slacks and multipliers.
struct Reach<T> {
    /// How often the longest step that keeps slacks and multipliers positive goes into a whole one.
    times: T,
    /// Sum of the products, of a change that does not centre.
    second_sum: T,
    /// The largest of them.
    second_largest: T,
}

impl<T: Real, const NX: usize, const NU: usize> Program<'_, T, NX, NU> {
    /// First point of the iterations, to be centred: the guess, or the point of the gains.
    #[inline(always)]
    pub(super) fn start(&mut self, x0: &[T; NX], is_warm: bool) {
        let (price, slack_row) = (self.cost.slack, self.shape.input + self.shape.soft);
        let mut x = *x0;
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            if !is_warm {
                stage.v = stage.dv;
                stage.t = T::ZERO;
            }
            stage.x = plus_product(&stage.b, &stage.v, plus_product(&stage.a, &x, stage.c));
            x = stage.x;
            stage.keep_columns();
            if !is_warm {
                let rows = self.rows_of(k);
                for multiplier in rows.multiplier.iter_mut() {
                    *multiplier = T::ZERO;
                }
                if slack_row < rows.multiplier.len() {
                    rows.multiplier[slack_row] = price;
                }
            }
        }
    }

    /// How far the optimum without rows moved since the last program, in units of the input's rows.
    #[inline(always)]
    pub(super) fn change_of_gains(&mut self) -> T {
        let shape = self.shape;
        let mut largest = T::ZERO;
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            let mut change = stage.dv;
            for i in 0..NU {
                change[i] = change[i] - stage.plain[i];
            }
            stage.plain = stage.dv;
            let matrix = &self.matrices.input[stage.input_rows..][..shape.input];
            for row in matrix {
                largest = dot(row, &change).magnitude().or_larger(largest);
            }
        }
        largest
    }

    /// Slacks and multipliers of the present point, none smaller than these: slacks, and products of
    /// the two.
    #[inline(always)]
    pub(super) fn centre(&mut self, (smallest, product): (f64, f64)) -> Point<T> {
        let (smallest, product) = (T::of(smallest), T::of(product));
        let (mut residual, mut sum, mut largest) = (T::ZERO, T::ZERO, T::ZERO);
        for k in 0..self.stages.len() {
            let stage = &self.stages[self.at(k)];
            let (v, x, t) = (stage.v, stage.x, stage.t);
            let rows = self.rows_times(k, &v, &x, t);
            for i in 0..rows.bound.len() {
                let room = rows.bound[i] - rows.target[i];
                let slack = smallest.or_larger(room);
                rows.slack[i] = slack;
                rows.multiplier[i] = (product / slack).or_larger(rows.multiplier[i]);
                rows.residual[i] = slack - room;
            }
            residual = largest_of(rows.residual, residual);
            for i in 0..rows.bound.len() {
                rows.target[i] = rows.slack[i] * rows.multiplier[i];
            }
            sum += sum_of(rows.target);
            largest = largest_of(rows.target, largest);
        }
        Point {
            left: T::ONE,
            residual,
            sum,
            largest,
            value: T::ONE,
        }
    }

    /// One step of Mehrotra's method; its length, none if a Hessian is not positive definite.
    #[inline(always)]
    pub(super) fn step(&mut self, point: &mut Point<T>, settings: &Settings<T>) -> Option<T> {
        if !self.predict(point.left) {
            return None;
        }
        let count = T::of((self.shape.rows() * self.stages.len()) as f64);
        let complementarity = point.sum / count;
        let share = boundary_share(complementarity);
        let mut longest = T::ZERO;
        // A loop of two turns, so that the passes over the stages are compiled once: the first looks for
        // the step that does not centre, the second takes the one that does.
        let mut aim = T::ZERO;
        for is_corrected in [false, true] {
            if is_corrected {
                self.pull_all(point.left, aim);
            }
            let reach = self.advance(point.left, is_corrected);
            longest = share / reach.times.or_larger(share);
            if !is_corrected {
                // What is left of the products, exactly: a change that does not centre cancels their
                // first order.
                let (rest, square) = (T::ONE - longest, longest * longest);
                let predicted = Point {
                    left: rest * point.left,
                    sum: rest * point.sum + square * reach.second_sum,
                    largest: rest * point.largest + square * reach.second_largest,
                    ..*point
                };
                if predicted.is_optimal(settings) {
                    break;
                }
                let length = T::ONE / reach.times.or_larger(T::ONE);
                let left = (T::ONE - length) * point.sum + length * length * reach.second_sum;
                let ratio = left / point.sum;
                aim = ratio * ratio * ratio * complementarity;
            }
        }
        self.move_by(longest, point);
        Some(longest)
    }

    /// Gains with the weights of the rows, and the constant parts of the inputs' changes for a step that
    /// does not centre; `left` is the share of the rows' residuals that is left.
    #[inline(always)]
    fn predict(&mut self, left: T) -> bool {
        let (horizon, shape) = (self.stages.len(), self.shape);
        let mut products = Products::new();
        let mut p = [[T::ZERO; NX]; NX];
        let mut by_x = [T::ZERO; NX];
        for k in (0..horizon).rev() {
            let weight = self.cost.state_at(k, horizon);
            let (at, memory) = (self.at(k), shape.memory());
            let mut rows = Rows::of(&mut self.rows[at * memory..][..memory], shape.rows());
            rows.weigh(left);
            let (w, y) = (&*rows.weight, &*rows.dmultiplier);
            let stage = &mut self.stages[at];
            let mut by_v = [T::ZERO; NU];
            for i in 0..NX {
                p[i][i] += weight[i];
                by_x[i] += weight[i] * stage.x[i];
            }
            for i in 0..NU {
                by_v[i] = self.cost.input[i] * stage.v[i];
            }
            let mut hessian = Lower::diagonal(&self.cost.input);
            let input = &self.matrices.input[stage.input_rows..];
            add_weighted(
                &w[..shape.input],
                &y[..shape.input],
                input,
                &mut hessian,
                &mut by_v,
            );
            let (w, y) = (&w[shape.input..], &y[shape.input..]);
            if shape.soft > 0 {
                let soft = &self.matrices.soft[stage.soft_rows..];
                let mut square = Lower::zeros();
                let by_z = part_mut(&mut by_x, 0);
                let mut pull = [T::ZERO; NU];
                let mut curvature = T::ZERO;
                let mut by_t = self.cost.slack;
                for ((w, y), row) in w[..shape.soft].iter().zip(y).zip(soft) {
                    curvature += *w;
                    by_t -= *y;
                    add_multiple(*w, row, &mut pull);
                }
                add_weighted(&w[..shape.soft], &y[..shape.soft], soft, &mut square, by_z);
                stage.soft_pull = pull;
                stage.soft_inverse = T::ONE / (curvature + w[shape.soft]);
                stage.dt = -(by_t - y[shape.soft]) * stage.soft_inverse;
                for j in 0..NU {
                    by_z[j] = by_z[j] - stage.soft_pull[j] * stage.dt;
                }
                square.add_square(-stage.soft_inverse, &pull);
                square.add_to(0, &mut p);
            }
            if shape.hard > 0 {
                let own = shape.soft + usize::from(shape.soft > 0);
                let hard = &self.matrices.hard[stage.hard_rows..];
                let mut square = Lower::zeros();
                let by_z = part_mut(&mut by_x, shape.hard_offset);
                add_weighted(&w[own..], &y[own..], hard, &mut square, by_z);
                square.add_to(shape.hard_offset, &mut p);
            }
            if !eliminate(stage, &mut p, hessian.rows(), &mut products) {
                return false;
            }
            pull(stage, &mut by_x, by_v);
        }
        true
    }

    /// Constant parts of the inputs' changes for a step that aims at this product of slacks and
    /// multipliers, with the second order of the step that does not centre.
    #[inline(always)]
    fn pull_all(&mut self, left: T, aim: T) {
        let (horizon, shape) = (self.stages.len(), self.shape);
        let mut p = [T::ZERO; NX];
        for k in (0..horizon).rev() {
            let rows = self.rows_of(k);
            for i in 0..rows.slack.len() {
                let second = rows.dslack[i] * rows.dmultiplier[i];
                rows.dmultiplier[i] =
                    rows.weight[i] * (left * rows.residual[i]) + (aim - second) * rows.inverse[i];
            }
            let stage = &self.stages[self.at(k)];
            let weight = self.cost.state_at(k, horizon);
            let mut by_v = [T::ZERO; NU];
            let mut by_x = p;
            for i in 0..NX {
                by_x[i] += weight[i] * stage.x[i];
            }
            for i in 0..NU {
                by_v[i] = self.cost.input[i] * stage.v[i];
            }
            let (count, memory) = (shape.rows(), shape.memory());
            let aims = &self.rows[self.at(k) * memory + 7 * count..][..count];
            let by_t = self.add_rows_pull(k, aims, &mut by_v, &mut by_x);
            let at = self.at(k);
            let stage = &mut self.stages[at];
            if shape.soft > 0 {
                stage.dt = -by_t * stage.soft_inverse;
                for j in 0..NU {
                    by_x[j] = by_x[j] - stage.soft_pull[j] * stage.dt;
                }
            }
            p = by_x;
            pull(stage, &mut p, by_v);
        }
    }

    /// The changes of all unknowns. Before the correction the multipliers aimed at are those that make
    /// every product zero to first order, so that their changes follow from those of the slacks.
    #[inline(always)]
    fn advance(&mut self, left: T, is_corrected: bool) -> Reach<T> {
        let shape = self.shape;
        let (mut times, mut second_sum, mut second_largest) = (T::ZERO, T::ZERO, T::ZERO);
        let mut dx = [T::ZERO; NX];
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            stage.dv = answer(stage, &dx);
            dx = plus_columns(&stage.a_columns, &dx, [T::ZERO; NX]);
            dx = plus_columns(&stage.b_columns, &stage.dv, dx);
            stage.dx = dx;
            if shape.soft > 0 {
                // Without its own share the slack's change was kept by the gradient's pass.
                let z: &[T; NU] = part(&dx, 0);
                let pulled = dot(&stage.soft_pull, z);
                stage.dt += pulled * stage.soft_inverse;
            }
            let (dv, dt) = (stage.dv, stage.dt);
            let rows = self.rows_times(k, &dv, &dx, dt);
            if is_corrected {
                for i in 0..rows.target.len() {
                    let change = rows.target[i];
                    let dslack = -(left * rows.residual[i]) - change;
                    let dmultiplier =
                        rows.dmultiplier[i] - rows.multiplier[i] + rows.weight[i] * change;
                    rows.dslack[i] = dslack;
                    rows.dmultiplier[i] = dmultiplier;
                    let to_slack = -dslack * rows.inverse[i];
                    let to_multiplier = -dmultiplier / rows.multiplier[i];
                    rows.target[i] = to_slack.or_larger(to_multiplier);
                }
                times = largest_of(rows.target, times);
                continue;
            }
            for i in 0..rows.target.len() {
                let dslack = -(left * rows.residual[i]) - rows.target[i];
                rows.dslack[i] = dslack;
                rows.dmultiplier[i] = -rows.multiplier[i] - rows.weight[i] * dslack;
                // The relative changes of slack and multiplier have the sum of minus one.
                let to_slack = -dslack * rows.inverse[i];
                rows.target[i] = to_slack.or_larger(T::ONE - to_slack);
            }
            times = largest_of(rows.target, times);
            for i in 0..rows.target.len() {
                rows.target[i] = rows.dslack[i] * rows.dmultiplier[i];
            }
            second_sum += sum_of(rows.target);
            second_largest = largest_of(rows.target, second_largest);
        }
        Reach {
            times,
            second_sum,
            second_largest,
        }
    }

    /// Moves all unknowns along their changes.
    #[inline(always)]
    fn move_by(&mut self, length: T, point: &mut Point<T>) {
        let (mut sum, mut largest, mut value) = (T::ZERO, T::ZERO, T::ZERO);
        let horizon = self.stages.len();
        for k in 0..horizon {
            let weight = self.cost.state_at(k, horizon);
            let at = self.at(k);
            let stage = &mut self.stages[at];
            for i in 0..NU {
                stage.v[i] += length * stage.dv[i];
                value += self.cost.input[i] * stage.v[i] * stage.v[i];
            }
            for i in 0..NX {
                stage.x[i] += length * stage.dx[i];
                value += weight[i] * stage.x[i] * stage.x[i];
            }
            stage.t += length * stage.dt;
            let rows = self.rows_of(k);
            for i in 0..rows.slack.len() {
                rows.slack[i] += length * rows.dslack[i];
                rows.multiplier[i] += length * rows.dmultiplier[i];
                rows.target[i] = rows.slack[i] * rows.multiplier[i];
            }
            sum += sum_of(rows.target);
            largest = largest_of(rows.target, largest);
        }
        // The rows are linear: each step takes its share of all residuals.
        *point = Point {
            left: (T::ONE - length) * point.left,
            residual: point.residual,
            sum,
            largest,
            value,
        };
    }
}

/// Share of the way to the boundary that a step goes at a mean complementarity.
#[inline(always)]
fn boundary_share<T: Real>(complementarity: T) -> T {
    let (least, most) = (T::of(MARGIN.0), T::of(MARGIN.1));
    let margin = T::of(MARGIN_FACTOR) * complementarity;
    if margin < most {
        T::ONE - least.or_larger(margin)
    } else {
        T::ONE - most
    }
}

/// The largest of numbers and one more, four at a time.
#[inline(always)]
fn largest_of<T: Real>(values: &[T], so_far: T) -> T {
    let mut lanes = [so_far; 4];
    let (fours, rest) = values.as_chunks::<4>();
    for four in fours {
        for j in 0..4 {
            lanes[j] = four[j].or_larger(lanes[j]);
        }
    }
    for (lane, value) in lanes.iter_mut().zip(rest) {
        *lane = value.or_larger(*lane);
    }
    lanes[0]
        .or_larger(lanes[1])
        .or_larger(lanes[2].or_larger(lanes[3]))
}

/// The sum of numbers in four parts, those of every fourth one.
#[inline(always)]
fn sum_of<T: Real>(values: &[T]) -> T {
    let mut parts = [T::ZERO; 4];
    let (fours, rest) = values.as_chunks::<4>();
    for four in fours {
        for j in 0..4 {
            parts[j] += four[j];
        }
    }
    for (part, value) in parts.iter_mut().zip(rest) {
        *part += *value;
    }
    (parts[0] + parts[1]) + (parts[2] + parts[3])
}
