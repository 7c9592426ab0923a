//! One iteration of the interior point, and where iterations begin.

use super::problem::Program;
use super::riccati::{answer, eliminate, plus_product, pull};
use super::rows::{Rows, add_block, add_square, dot, part};
use super::scalar::Real;

/// Share of the way to the boundary that a step leaves: the least and the most.
pub const MARGIN: (f64, f64) = (1e-3, 5e-3);
/// The share between the two, in units of the mean complementarity: near the optimum steps may go further.
pub const MARGIN_FACTOR: f64 = 10.0;
/// Smallest slack and smallest product of slack and multiplier at a start from the gains.
pub const COLD: (f64, f64) = (3e-1, 3.0);
/// The same at a start from a guess.
pub const WARM: (f64, f64) = (1e-2, 1e-3);
/// The same where a guess turned out to be poor, or the iterations go round in a circle.
pub const AGAIN: (f64, f64) = (1e-1, 5e-1);
/// A first step from a guess that is shorter than this shows that the guess is not near a solution.
pub const SHORT_STEP: f64 = 0.3;
/// Iterations after which slacks and multipliers are centred again: now and then the method goes round
/// in a circle.
pub const PATIENCE: u32 = 16;

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

    /// Slacks and multipliers of the present point, none smaller than these: slacks, and products of
    /// the two.
    #[inline(always)]
    pub(super) fn centre(&mut self, (smallest, product): (f64, f64)) {
        let (smallest, product) = (T::of(smallest), T::of(product));
        for k in 0..self.stages.len() {
            let stage = &self.stages[self.at(k)];
            let (v, x, t) = (stage.v, stage.x, stage.t);
            let rows = self.rows_times(k, &v, &x, t);
            for i in 0..rows.bound.len() {
                let room = rows.bound[i] - rows.target[i];
                rows.slack[i] = smallest.or_larger(room);
                rows.multiplier[i] = (product / rows.slack[i]).or_larger(rows.multiplier[i]);
            }
        }
    }

    /// Residuals of the rows at the present point; the largest of them, and mean and largest product of
    /// slacks and multipliers.
    #[inline(always)]
    pub(super) fn measure(&mut self) -> (T, T, T) {
        let (mut infeasibility, mut sum, mut largest) = (T::ZERO, T::ZERO, T::ZERO);
        for k in 0..self.stages.len() {
            let stage = &self.stages[self.at(k)];
            let (v, x, t) = (stage.v, stage.x, stage.t);
            let rows = self.rows_times(k, &v, &x, t);
            for i in 0..rows.bound.len() {
                let residual = rows.target[i] + rows.slack[i] - rows.bound[i];
                rows.residual[i] = residual;
                rows.target[i] = residual.magnitude();
            }
            infeasibility = largest_of(rows.target, infeasibility);
            for i in 0..rows.bound.len() {
                rows.target[i] = rows.slack[i] * rows.multiplier[i];
            }
            sum += sum_of(rows.target);
            largest = largest_of(rows.target, largest);
        }
        let count = self.shape.rows() * self.stages.len();
        (infeasibility, sum / T::of(count as f64), largest)
    }

    /// One step of Mehrotra's method from the present point with this mean complementarity; its length,
    /// none if a Hessian is not positive definite.
    #[inline(always)]
    pub(super) fn step(&mut self, complementarity: T) -> Option<T> {
        if !self.eliminate_all() {
            return None;
        }
        let mut share = T::ONE;
        let mut longest = T::ONE;
        // A loop of two turns, so that the passes over the stages are compiled once: the first looks for
        // the step that does not centre, the second takes the one that does.
        for is_last in [false, true] {
            if is_last {
                self.aim(complementarity, longest);
                share = boundary_share(complementarity);
            }
            self.pull_all();
            longest = share / self.advance().or_larger(share);
        }
        self.move_by(longest);
        Some(longest)
    }

    /// The multipliers aimed at, from the changes of a step of this length that does not centre: how much
    /// of the complementarity it leaves decides how much is aimed at.
    #[inline(always)]
    fn aim(&mut self, complementarity: T, length: T) {
        let mut left = T::ZERO;
        for k in 0..self.stages.len() {
            let rows = self.rows_of(k);
            for i in 0..rows.slack.len() {
                rows.target[i] = (rows.slack[i] + length * rows.dslack[i])
                    * (rows.multiplier[i] + length * rows.dmultiplier[i]);
            }
            left += sum_of(rows.target);
        }
        let count = T::of((self.shape.rows() * self.stages.len()) as f64);
        let ratio = left / (count * complementarity);
        let aim = ratio * ratio * ratio * complementarity;
        for k in 0..self.stages.len() {
            let rows = self.rows_of(k);
            for i in 0..rows.slack.len() {
                let second_order = rows.dslack[i] * rows.dmultiplier[i];
                rows.dmultiplier[i] =
                    rows.weight[i] * rows.residual[i] + (aim - second_order) * rows.inverse[i];
            }
        }
    }

    /// Gains with the weights of the rows; the multipliers aimed at, in `dmultiplier` until the step is
    /// known, are those of the step that does not centre.
    #[inline(always)]
    fn eliminate_all(&mut self) -> bool {
        let (horizon, shape) = (self.stages.len(), self.shape);
        let mut p = [[T::ZERO; NX]; NX];
        for k in (0..horizon).rev() {
            let weight = self.cost.state_at(k, horizon);
            for i in 0..NX {
                p[i][i] += weight[i];
            }
            let mut hessian = [[T::ZERO; NU]; NU];
            for i in 0..NU {
                hessian[i][i] = self.cost.input[i];
            }
            let (at, memory) = (self.at(k), shape.memory());
            let rows = Rows::of(&mut self.rows[at * memory..][..memory], shape.rows());
            for i in 0..rows.slack.len() {
                let inverse = T::ONE / rows.slack[i];
                let weight = rows.multiplier[i] * inverse;
                rows.inverse[i] = inverse;
                rows.weight[i] = weight;
                rows.dmultiplier[i] = weight * rows.residual[i];
            }
            let stage = &mut self.stages[at];
            let (input, rest) = rows.weight.split_at(shape.input);
            for (w, row) in input.iter().zip(&self.matrices.input[stage.input_rows..]) {
                add_square(*w, row, &mut hessian);
            }
            let mut square = [[T::ZERO; NU]; NU];
            if shape.soft > 0 {
                let mut pull = [T::ZERO; NU];
                let mut curvature = T::ZERO;
                let soft = &rest[..shape.soft];
                for (w, row) in soft.iter().zip(&self.matrices.soft[stage.soft_rows..]) {
                    curvature += *w;
                    for j in 0..NU {
                        pull[j] += *w * row[j];
                    }
                    add_square(*w, row, &mut square);
                }
                curvature += rest[shape.soft];
                stage.soft_pull = pull;
                stage.soft_inverse = T::ONE / curvature;
                add_square(-stage.soft_inverse, &pull, &mut square);
                add_block(&square, 0, &mut p);
            }
            if shape.hard > 0 {
                let hard = &rest[shape.soft + usize::from(shape.soft > 0)..];
                square = [[T::ZERO; NU]; NU];
                for (w, row) in hard.iter().zip(&self.matrices.hard[stage.hard_rows..]) {
                    add_square(*w, row, &mut square);
                }
                add_block(&square, shape.hard_offset, &mut p);
            }
            if !eliminate(stage, &mut p, hessian) {
                return false;
            }
        }
        true
    }

    /// Constant parts of the inputs' changes, from the multipliers aimed at.
    #[inline(always)]
    fn pull_all(&mut self) {
        let (horizon, shape) = (self.stages.len(), self.shape);
        let mut p = [T::ZERO; NX];
        for k in (0..horizon).rev() {
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
            let aim = &self.rows[self.at(k) * memory + 7 * count..][..count];
            let by_t = self.add_rows_pull(k, aim, &mut by_v, &mut by_x);
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

    /// The changes of all unknowns; how often the longest step of slacks, and of multipliers, that
    /// keeps them positive goes into a whole one.
    #[inline(always)]
    fn advance(&mut self) -> T {
        let shape = self.shape;
        let mut longest = T::ZERO;
        let mut dx = [T::ZERO; NX];
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            stage.dv = answer(stage, &dx);
            dx = plus_product(
                &stage.b,
                &stage.dv,
                plus_product(&stage.a, &dx, [T::ZERO; NX]),
            );
            stage.dx = dx;
            if shape.soft > 0 {
                // Without its own share the slack's change was kept by the gradient's pass.
                let z: &[T; NU] = part(&dx, 0);
                let pulled = dot(&stage.soft_pull, z);
                stage.dt += pulled * stage.soft_inverse;
            }
            let (dv, dt) = (stage.dv, stage.dt);
            let rows = self.rows_times(k, &dv, &dx, dt);
            for i in 0..rows.target.len() {
                let change = rows.target[i];
                let dslack = -rows.residual[i] - change;
                let dmultiplier =
                    rows.dmultiplier[i] - rows.multiplier[i] + rows.weight[i] * change;
                rows.dslack[i] = dslack;
                rows.dmultiplier[i] = dmultiplier;
                let to_slack = -dslack * rows.inverse[i];
                let to_multiplier = -dmultiplier / rows.multiplier[i];
                rows.target[i] = to_slack.or_larger(to_multiplier);
            }
            longest = largest_of(rows.target, longest);
        }
        longest
    }

    /// Moves all unknowns along their changes.
    #[inline(always)]
    fn move_by(&mut self, length: T) {
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            for i in 0..NU {
                stage.v[i] += length * stage.dv[i];
            }
            for i in 0..NX {
                stage.x[i] += length * stage.dx[i];
            }
            stage.t += length * stage.dt;
            let rows = self.rows_of(k);
            for i in 0..rows.slack.len() {
                rows.slack[i] += length * rows.dslack[i];
                rows.multiplier[i] += length * rows.dmultiplier[i];
            }
        }
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
