//! One iteration of the interior point, and where iterations begin.

use super::links::{Before, answer_before, pull_before, take_answer};
use super::lower::Lower;
use super::point::{Point, boundary_share};
use super::problem::{Program, Settings};
use super::riccati::{Products, add_multiple, answer, eliminate, plus_columns, plus_product, pull};
use super::rows::{Rows, add_weighted, dot, largest_of, part, part_mut, sum_of};
use super::scalar::Real;

/// How far a change of all unknowns may go, and the products of the changes of slacks and multipliers.
struct Reach<T> {
    /// How often the longest step that keeps slacks and multipliers positive goes into a whole one.
    times: T,
    /// Sum of the products, of a change that does not centre.
    second_sum: T,
    /// The largest of them.
    second_largest: T,
}

impl<T: Real, const NX: usize, const NU: usize, const LINKED: bool> Program<'_, T, NX, NU, LINKED> {
    /// First point of the iterations, to be centred: the guess, or the point of the gains.
    #[inline(always)]
    pub(super) fn start(&mut self, x0: &[T; NX], is_warm: bool) {
        let (price, soft) = (self.cost.slack, self.shape.soft);
        let slack_row = self.shape.input + soft;
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
                rows.multiplier.fill(T::ZERO);
                if soft > 0 {
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
            let links = self.link_rows(k);
            let stage = &mut self.stages[at];
            let mut change = stage.dv;
            for i in 0..NU {
                change[i] = change[i] - stage.plain[i];
            }
            stage.plain = stage.dv;
            let matrix = &self.matrices.input[stage.input_rows..][..shape.input];
            for row in matrix.iter().chain(links) {
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
        let mut before = [T::ZERO; NU];
        for k in 0..self.stages.len() {
            let stage = &self.stages[self.at(k)];
            let (v, x, t) = (stage.v, stage.x, stage.t);
            let rows = self.rows_times(k, (&before, &v), &x, t);
            before = v;
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
            kept: T::ONE,
            residual,
            sum,
            largest,
            value: T::ONE,
        }
    }

    /// One step of Mehrotra's method; its length, none if a Hessian is not positive definite.
    #[inline(always)]
    pub(super) fn step(&mut self, point: &mut Point<T>, settings: &Settings<T>) -> Option<T> {
        if !self.predict(point.kept) {
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
                self.pull_all(point.kept, aim);
            }
            let reach = self.advance(point.kept, is_corrected);
            longest = share / reach.times.or_larger(share);
            if !is_corrected {
                // What is left of the products, exactly: a change that does not centre cancels their
                // first order.
                let (rest, square) = (T::ONE - longest, longest * longest);
                let predicted = Point {
                    left: rest * point.left,
                    kept: rest * point.kept,
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
        let mut after = Before::none();
        let mut products = Products::new();
        let mut p = [[T::ZERO; NX]; NX];
        let mut by_x = [T::ZERO; NX];
        for k in (0..horizon).rev() {
            let weight = self.cost.state_at(k, horizon);
            let (at, memory) = (self.at(k), shape.memory());
            let (own_links, earlier_links) = self.link_pairs(k);
            let mut rows = Rows::of(&mut self.rows[at * memory..][..memory], shape.rows());
            match LINKED {
                true => rows.weigh_softened(self.links.softness),
                false => rows.weigh(left),
            }
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
            let (numbers, pairs) = ((&w[..shape.input], &y[..shape.input]), shape.pairs.input);
            add_weighted(numbers, input, pairs, &mut hessian, &mut by_v);
            let first_link = w.len() - shape.link;
            let links = (&w[first_link..], &y[first_link..]);
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
                let numbers = (&w[..shape.soft], &y[..shape.soft]);
                add_weighted(numbers, soft, 0, &mut square, by_z);
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
                let numbers = (&w[own..][..shape.hard], &y[own..][..shape.hard]);
                add_weighted(numbers, hard, shape.pairs.hard, &mut square, by_z);
                square.add_to(shape.hard_offset, &mut p);
            }
            if !LINKED {
                if !eliminate::<T, NX, NU, false>(stage, &mut p, hessian.rows(), &mut products) {
                    return false;
                }
                pull(stage, &mut by_x, by_v);
                continue;
            }
            add_weighted(links, own_links, 0, &mut hessian, &mut by_v);
            let hessian = after.add_to(stage, &hessian, &mut by_v, &mut products.hvx);
            if !eliminate::<T, NX, NU, true>(stage, &mut p, hessian, &mut products) {
                return false;
            }
            let h = pull(stage, &mut by_x, by_v);
            if k > 0 {
                let gain = &mut self.links.gains[at];
                after = Before::of_stage(stage, gain, links, (own_links, earlier_links), &h);
            }
        }
        true
    }

    /// Constant parts of the inputs' changes for a step that aims at this product of slacks and
    /// multipliers, with the second order of the step that does not centre.
    #[inline(always)]
    fn pull_all(&mut self, left: T, aim: T) {
        let (horizon, shape) = (self.stages.len(), self.shape);
        let softness = self.links.softness;
        let mut p = [T::ZERO; NX];
        let mut by_after = [T::ZERO; NU];
        for k in (0..horizon).rev() {
            let rows = self.rows_of(k);
            for i in 0..rows.slack.len() {
                let second = rows.dslack[i] * rows.dmultiplier[i];
                let residual = match LINKED {
                    true => rows.residual[i] + softness * rows.multiplier[i],
                    false => left * rows.residual[i],
                };
                rows.dmultiplier[i] = rows.weight[i] * residual + (aim - second) * rows.inverse[i];
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
            if !LINKED {
                pull(stage, &mut p, by_v);
                continue;
            }
            for i in 0..NU {
                by_v[i] += by_after[i];
            }
            let h = pull(stage, &mut p, by_v);
            if k > 0 {
                let aims = &self.rows[at * memory + 8 * count - shape.link..][..shape.link];
                by_after = pull_before(aims, self.link_pairs(k).1);
                take_answer(&self.links.gains[at], &h, &mut by_after);
            }
        }
    }

    /// The changes of all unknowns. Before the correction the multipliers aimed at are those that make
    /// every product zero to first order, so that their changes follow from those of the slacks.
    #[inline(always)]
    fn advance(&mut self, left: T, is_corrected: bool) -> Reach<T> {
        let shape = self.shape;
        let (mut times, mut second_sum, mut second_largest) = (T::ZERO, T::ZERO, T::ZERO);
        let softness = self.links.softness;
        let mut dx = [T::ZERO; NX];
        let mut before = [T::ZERO; NU];
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            stage.dv = answer(stage, &dx);
            if LINKED && k > 0 {
                answer_before(&self.links.gains[at], &before, &mut stage.dv);
            }
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
            let mut rows = self.rows_times(k, (&before, &dv), &dx, dt);
            before = dv;
            if LINKED {
                rows.change_softened(softness);
                times = largest_of(rows.target, times);
                if is_corrected {
                    continue;
                }
            } else if is_corrected {
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
            } else {
                for i in 0..rows.target.len() {
                    let dslack = -(left * rows.residual[i]) - rows.target[i];
                    rows.dslack[i] = dslack;
                    rows.dmultiplier[i] = -rows.multiplier[i] - rows.weight[i] * dslack;
                    // The relative changes of slack and multiplier have the sum of minus one.
                    let to_slack = -dslack * rows.inverse[i];
                    rows.target[i] = to_slack.or_larger(T::ONE - to_slack);
                }
                times = largest_of(rows.target, times);
            }
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
        let mut residual = T::ZERO;
        let (horizon, softness) = (self.stages.len(), self.links.softness);
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
            if LINKED {
                for i in 0..rows.residual.len() {
                    rows.residual[i] = (T::ONE - length) * rows.residual[i]
                        + length * (softness * rows.dmultiplier[i]);
                    residual = rows.residual[i].magnitude().or_larger(residual);
                }
            }
        }
        // The rows are linear: each step takes its share of all residuals.
        let rest = T::ONE - length;
        *point = Point {
            left: rest * point.left,
            kept: match LINKED {
                true => point.kept,
                false => rest * point.kept,
            },
            residual: if LINKED { residual } else { point.residual },
            sum,
            largest,
            value,
        };
    }
}
