//! One iteration of the interior point, and where iterations begin.

use super::links::{Before, answer_before, pull_before, take_answer};
use super::lower::Lower;
use super::point::{Centring, Point, boundary_share};
use super::problem::{Program, Settings, Stage};
use super::riccati::{Products, add_multiple, add_product, eliminate};
use super::rows::{Rows, dot, largest_of, part, part_mut, sum_of};
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
        let shape = self.shape;
        let price = self.cost.slack;
        let mut x = *x0;
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            if !is_warm {
                stage.v = stage.dv;
                stage.t = T::ZERO;
            }
            let mut end = [T::ZERO; NX];
            stage.end(&x, &stage.v, &mut end);
            stage.x = end;
            x = end;
            if !is_warm {
                let mut rows = self.rows_of(k);
                rows.write_multipliers(shape.soft, shape.slack_row(), price);
            }
        }
    }

    /// How far the optimum without rows moved since the last program, in units of the input's rows.
    #[inline(always)]
    pub(super) fn change_of_gains(&mut self) -> T {
        let linked = self.is_linked();
        let mut largest = T::ZERO;
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            let mut change = stage.dv;
            for i in 0..NU {
                change[i] = change[i] - stage.plain[i];
            }
            stage.plain = stage.dv;
            let input = &self.matrices.input[stage.input_rows..][..self.shape.input];
            for i in 0..self.shape.input {
                largest = dot(&input[i], &change).magnitude().or_larger(largest);
            }
            if linked {
                let links = self.link_rows(k);
                for i in 0..self.shape.link {
                    largest = dot(&links[i], &change).magnitude().or_larger(largest);
                }
            }
        }
        largest
    }

    /// Slacks and multipliers of the present point, none smaller than these.
    #[inline(always)]
    pub(super) fn centre(&mut self, smallest: Centring) -> Point<T> {
        let mut residual = T::ZERO;
        let mut sum = T::ZERO;
        let mut largest = T::ZERO;
        let mut before = [T::ZERO; NU];
        for k in 0..self.stages.len() {
            let stage = &self.stages[self.at(k)];
            let v = stage.v;
            let x = stage.x;
            let t = stage.t;
            let rows = self.rows_times(k, &before, &v, &x, t);
            before = v;
            for i in 0..rows.count {
                let room = rows.bound[i] - rows.target[i];
                let slack = T::of(smallest.slack).or_larger(room);
                let multiplier = T::of(smallest.product) / slack;
                rows.slack[i] = slack;
                rows.multiplier[i] = multiplier.or_larger(rows.multiplier[i]);
                rows.residual[i] = slack - room;
            }
            residual = largest_of(rows.residual, rows.count, residual);
            for i in 0..rows.count {
                rows.target[i] = rows.slack[i] * rows.multiplier[i];
            }
            sum += sum_of(rows.target, rows.count);
            largest = largest_of(rows.target, rows.count, largest);
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

    /// One step of Mehrotra's method; its length, negative if a Hessian is not positive definite.
    #[inline(always)]
    pub(super) fn step(&mut self, point: &mut Point<T>, settings: &Settings<T>) -> T {
        if !self.predict(point.kept) {
            return -T::ONE;
        }
        let count = T::of((self.shape.rows() * self.stages.len()) as f64);
        let complementarity = point.sum / count;
        let share = boundary_share(complementarity);
        let mut longest = T::ZERO;
        let mut aim = T::ZERO;
        // A loop of two turns, so that the passes over the stages are compiled once. The first turn computes the
        // predictor, a step without centring; the second computes the corrector.
        for turn in 0..2 {
            let is_corrected = turn > 0;
            if is_corrected {
                self.pull_all(point.kept, aim);
            }
            let reach = self.advance(point.kept, is_corrected);
            longest = share / reach.times.or_larger(share);
            if !is_corrected {
                // The products that remain, exactly: the predictor cancels their first order.
                let rest = T::ONE - longest;
                let square = longest * longest;
                let predicted = Point {
                    left: rest * point.left,
                    kept: rest * point.kept,
                    residual: point.residual,
                    sum: rest * point.sum + square * reach.second_sum,
                    largest: rest * point.largest + square * reach.second_largest,
                    value: point.value,
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
        longest
    }

    /// Gains with the weights of the rows, and the constant parts of the inputs' changes for the predictor. `left` is
    /// the remaining share of the rows' residuals.
    #[inline(always)]
    fn predict(&mut self, left: T) -> bool {
        let shape = self.shape;
        let memory = shape.memory();
        let horizon = self.stages.len();
        let linked = self.is_linked();
        let mut after: Before<T, NX, NU> = Before::zeros();
        let mut products: Products<T, NX, NU> = Products::zeros();
        let mut p = [[T::ZERO; NX]; NX];
        let mut by_x = [T::ZERO; NX];
        for k in (0..horizon).rev() {
            let weight = self.cost.state_at(k, horizon);
            let at = self.at(k);
            let before = if k > 0 { self.at(k - 1) } else { 0 };
            let mut rows: Rows<T> = Rows::of(&mut self.rows[at * memory..][..memory], shape.rows());
            if linked {
                rows.weigh_softened(self.links.softness);
            } else {
                rows.weigh(left);
            }
            let w = &rows.weight[..rows.count];
            let y = &rows.dmultiplier[..rows.count];
            let stage = &mut self.stages[at];
            let mut by_v = [T::ZERO; NU];
            for i in 0..NX {
                p[i][i] += weight[i];
                by_x[i] += weight[i] * stage.x[i];
            }
            for i in 0..NU {
                by_v[i] = self.cost.input[i] * stage.v[i];
            }
            let mut hessian: Lower<T, NU> = Lower::diagonal(&self.cost.input);
            let input = &self.matrices.input[stage.input_rows..];
            hessian.add_rows(w, y, input, shape.pairs, shape.input, &mut by_v);
            if NU <= NX && shape.soft > 0 {
                let soft = &self.matrices.soft[stage.soft_rows..];
                let by_z: &mut [T; NU] = part_mut(&mut by_x, 0);
                let w_soft = &w[shape.input..];
                let y_soft = &y[shape.input..];
                let price = self.cost.slack;
                stage.add_soft_rows(w_soft, y_soft, soft, shape.soft, price, by_z, &mut p);
            }
            products.clear_hessian();
            if linked {
                let w_link = &w[shape.first_link()..];
                let y_link = &y[shape.first_link()..];
                let own = &self.links.rows[at * shape.link..];
                hessian.add_rows(w_link, y_link, own, 0, shape.link, &mut by_v);
                hessian.write_rows(&mut products.hvv);
                after.add_to(stage, &mut by_v, &mut products);
            } else {
                hessian.write_rows(&mut products.hvv);
            }
            if !eliminate(stage, &mut p, &mut products) {
                return false;
            }
            stage.pull(&mut by_x, &mut by_v);
            if linked && k > 0 {
                let gain = &mut self.links.gains[at];
                let own = &self.links.rows[at * shape.link..];
                let earlier = &self.links.rows[before * shape.link..];
                let w_link = &w[shape.first_link()..];
                let y_link = &y[shape.first_link()..];
                after.write(stage, gain, w_link, y_link, own, earlier, shape.link, &by_v);
            }
        }
        true
    }

    /// Constant parts of the inputs' changes for a step that aims at this product of slacks and multipliers, with the
    /// second order of the step that does not centre.
    #[inline(always)]
    fn pull_all(&mut self, left: T, aim: T) {
        let shape = self.shape;
        let horizon = self.stages.len();
        let linked = self.is_linked();
        let softness = self.links.softness;
        let mut p = [T::ZERO; NX];
        let mut by_after = [T::ZERO; NU];
        for k in (0..horizon).rev() {
            let at = self.at(k);
            let mut rows = self.rows_of(k);
            if linked {
                rows.aim_softened(softness, aim);
            } else {
                rows.aim_at(left, aim);
            }
            let stage = &self.stages[at];
            let weight = self.cost.state_at(k, horizon);
            let mut by_v = [T::ZERO; NU];
            for i in 0..NX {
                p[i] += weight[i] * stage.x[i];
            }
            for i in 0..NU {
                by_v[i] = self.cost.input[i] * stage.v[i];
            }
            let aims = &self.rows[at * shape.memory() + 7 * shape.rows()..][..shape.rows()];
            let by_t = self.add_rows_pull(k, aims, &mut by_v, &mut p);
            if linked {
                for i in 0..NU {
                    by_v[i] += by_after[i];
                }
                if k > 0 {
                    let y = &aims[shape.first_link()..];
                    pull_before(y, self.link_rows(k - 1), shape.link, &mut by_after);
                }
            }
            let stage = &mut self.stages[at];
            if NU <= NX && shape.soft > 0 {
                stage.dt = -by_t * stage.soft_inverse;
                let by_z: &mut [T; NU] = part_mut(&mut p, 0);
                for j in 0..NU {
                    by_z[j] = by_z[j] - stage.soft_pull[j] * stage.dt;
                }
            }
            stage.pull(&mut p, &mut by_v);
            if linked && k > 0 {
                take_answer(&self.links.gains[at], &by_v, &mut by_after);
            }
        }
    }

    /// The changes of all unknowns. Before the correction the multipliers aimed at are those that make every product
    /// zero to first order, so that their changes follow from those of the slacks.
    #[inline(always)]
    fn advance(&mut self, left: T, is_corrected: bool) -> Reach<T> {
        let soft = self.shape.soft;
        let linked = self.is_linked();
        let softness = self.links.softness;
        let mut times = T::ZERO;
        let mut second_sum = T::ZERO;
        let mut second_largest = T::ZERO;
        let mut dx = [T::ZERO; NX];
        let mut before = [T::ZERO; NU];
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            let mut dv = [T::ZERO; NU];
            stage.answer(&dx, &mut dv);
            if linked && k > 0 {
                answer_before(&self.links.gains[at], &before, &mut dv);
            }
            let mut end = [T::ZERO; NX];
            add_product(&stage.a, &dx, &mut end);
            add_product(&stage.b, &dv, &mut end);
            dx = end;
            stage.dv = dv;
            stage.dx = dx;
            if NU <= NX && soft > 0 {
                // Without its own share the slack's change was kept by the gradient's pass.
                let z: &[T; NU] = part(&dx, 0);
                stage.dt += dot(&stage.soft_pull, z) * stage.soft_inverse;
            }
            let dt = stage.dt;
            let mut rows = self.rows_times(k, &before, &dv, &dx, dt);
            before = dv;
            if linked {
                rows.change_softened(softness);
            } else if is_corrected {
                rows.change_corrected(left);
            } else {
                rows.change(left);
            }
            times = largest_of(rows.target, rows.count, times);
            if !is_corrected {
                for i in 0..rows.count {
                    rows.target[i] = rows.dslack[i] * rows.dmultiplier[i];
                }
                second_sum += sum_of(rows.target, rows.count);
                second_largest = largest_of(rows.target, rows.count, second_largest);
            }
        }
        Reach {
            times,
            second_sum,
            second_largest,
        }
    }

    #[inline(always)]
    fn move_by(&mut self, length: T, point: &mut Point<T>) {
        let horizon = self.stages.len();
        let linked = self.is_linked();
        let softness = self.links.softness;
        // The rows are linear: each step reduces all residuals by its share.
        let rest = T::ONE - length;
        let mut sum = T::ZERO;
        let mut largest = T::ZERO;
        let mut value = T::ZERO;
        let mut residual = T::ZERO;
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
            for i in 0..rows.count {
                rows.slack[i] += length * rows.dslack[i];
                rows.multiplier[i] += length * rows.dmultiplier[i];
                rows.target[i] = rows.slack[i] * rows.multiplier[i];
            }
            sum += sum_of(rows.target, rows.count);
            largest = largest_of(rows.target, rows.count, largest);
            if linked {
                for i in 0..rows.count {
                    rows.residual[i] =
                        rest * rows.residual[i] + length * (softness * rows.dmultiplier[i]);
                    residual = rows.residual[i].magnitude().or_larger(residual);
                }
            }
        }
        point.left = rest * point.left;
        if linked {
            point.residual = residual;
        } else {
            point.kept = rest * point.kept;
        }
        point.sum = sum;
        point.largest = largest;
        point.value = value;
    }
}

impl<T: Real, const NX: usize, const NU: usize> Stage<T, NX, NU> {
    /// Adds the `count` soft rows, with weights `w` and multipliers `y`, to gradient and Hessian by the state; the
    /// slack is eliminated.
    #[inline(always)]
    fn add_soft_rows(
        &mut self,
        w: &[T],
        y: &[T],
        rows: &[[T; NU]],
        count: usize,
        price: T,
        by_z: &mut [T; NU],
        p: &mut [[T; NX]; NX],
    ) {
        let mut square: Lower<T, NU> = Lower::zeros();
        let mut pull = [T::ZERO; NU];
        let mut curvature = T::ZERO;
        let mut by_t = price;
        for i in 0..count {
            curvature += w[i];
            by_t -= y[i];
            add_multiple(w[i], &rows[i], &mut pull);
        }
        square.add_rows(w, y, rows, 0, count, by_z);
        self.soft_pull = pull;
        self.soft_inverse = T::ONE / (curvature + w[count]);
        self.dt = -(by_t - y[count]) * self.soft_inverse;
        for j in 0..NU {
            by_z[j] = by_z[j] - pull[j] * self.dt;
        }
        square.add_square(-self.soft_inverse, &pull);
        square.add_to(p);
    }
}
