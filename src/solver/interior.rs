//! The solve: the linear-quadratic optimum if it keeps every row, otherwise an interior point.

use super::problem::{Outcome, Program, Report, Residuals, Settings};
use super::riccati::{add_transposed, answer, eliminate, plus_product, pull};
use super::scalar::Real;

/// Share of the way to the boundary that a step goes.
pub const TO_THE_BOUNDARY: f64 = 0.995;
/// Smallest slack and smallest product of slack and multiplier at a start from the gains.
pub const COLD: (f64, f64) = (3e-1, 1e-1);
/// The same at a start from a guess.
pub const WARM: (f64, f64) = (1e-2, 1e-3);
/// A first step from a guess that is shorter than this shows that the guess is not near a solution.
pub const SHORT_STEP: f64 = 0.3;

/// The numbers of one stage's rows.
struct Rows<'a, T> {
    bound: &'a mut [T],
    slack: &'a mut [T],
    multiplier: &'a mut [T],
    weight: &'a mut [T],
    target: &'a mut [T],
    residual: &'a mut [T],
    dslack: &'a mut [T],
    dmultiplier: &'a mut [T],
}

impl<'a, T> Rows<'a, T> {
    #[inline(always)]
    fn of(memory: &'a mut [T], count: usize) -> Self {
        let (bound, rest) = memory.split_at_mut(count);
        let (slack, rest) = rest.split_at_mut(count);
        let (multiplier, rest) = rest.split_at_mut(count);
        let (weight, rest) = rest.split_at_mut(count);
        let (target, rest) = rest.split_at_mut(count);
        let (residual, rest) = rest.split_at_mut(count);
        let (dslack, rest) = rest.split_at_mut(count);
        let (dmultiplier, _) = rest.split_at_mut(count);
        Self {
            bound,
            slack,
            multiplier,
            weight,
            target,
            residual,
            dslack,
            dmultiplier,
        }
    }
}

impl<T: Real, const NX: usize, const NU: usize> Program<'_, T, NX, NU> {
    /// Eliminates all stages without their rows: gains and constant parts of the linear-quadratic
    /// optimum from any initial state. False if a Hessian is not positive definite.
    pub fn prepare(&mut self) -> bool {
        let horizon = self.stages.len();
        let mut p = [[T::ZERO; NX]; NX];
        let mut linear = [T::ZERO; NX];
        for k in (0..horizon).rev() {
            let weight = self.cost.state_at(k, horizon);
            for i in 0..NX {
                p[i][i] += weight[i];
            }
            let at = self.at(k);
            let stage = &mut self.stages[at];
            linear = plus_product(&p, &stage.c, linear);
            let mut hessian = [[T::ZERO; NU]; NU];
            for i in 0..NU {
                hessian[i][i] = self.cost.input[i];
            }
            if !eliminate(stage, &mut p, hessian) {
                return false;
            }
            pull(stage, &mut linear, [T::ZERO; NU]);
        }
        true
    }

    /// Solves the program from an initial state, with the gains of [`Program::prepare`] for the present stages.
    ///
    /// `is_warm` says that inputs and multipliers are a guess at the solution, such as the last one's,
    /// shifted by a stage.
    pub fn solve(&mut self, x0: &[T; NX], is_warm: bool, settings: &Settings<T>) -> Report<T> {
        let worst = self.follow_gains(x0);
        if !worst.is_finite_number() {
            return self.broken(0);
        }
        let mut iterations = 0;
        if worst <= settings.tolerance {
            self.take_gains();
        } else {
            self.start(x0, is_warm);
            let mut may_restart = is_warm;
            loop {
                let (infeasibility, complementarity, largest) = self.measure();
                if !(infeasibility + complementarity).is_finite_number() {
                    return self.broken(iterations);
                }
                if infeasibility <= settings.tolerance && largest <= settings.tolerance {
                    break;
                }
                if iterations == settings.max_iterations {
                    let residuals = self.residuals(x0);
                    return Report {
                        outcome: Outcome::IterationCap,
                        iterations,
                        residuals,
                    };
                }
                iterations += 1;
                // Where rounding ends the progress the residuals decide what the point is worth.
                let Some(length) = self.step(complementarity) else {
                    break;
                };
                if may_restart && length < T::of(SHORT_STEP) {
                    self.centre(COLD);
                }
                may_restart = false;
            }
        }
        let residuals = self.residuals(x0);
        Report {
            outcome: if residuals.within(settings.accepted_residual) {
                Outcome::Solved
            } else {
                Outcome::Inaccurate
            },
            iterations,
            residuals,
        }
    }

    fn broken(&self, iterations: u32) -> Report<T> {
        let none = T::ONE / T::ZERO;
        Report {
            outcome: Outcome::NumericalFailure,
            iterations,
            residuals: Residuals {
                primal: none,
                dual: none,
                gap: none,
            },
        }
    }

    /// States and inputs that the gains give, kept if no row is violated; returns the largest violation.
    fn follow_gains(&mut self, x0: &[T; NX]) -> T {
        let horizon = self.stages.len();
        let mut worst = T::ZERO;
        let mut x = *x0;
        for k in 0..horizon {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            stage.dv = answer(stage, &x);
            stage.dx = plus_product(&stage.b, &stage.dv, plus_product(&stage.a, &x, stage.c));
            x = stage.dx;
            let (v, x) = (stage.dv, stage.dx);
            let rows = self.rows_times(k, &v, &x, T::ZERO);
            for (product, bound) in rows.target.iter().zip(rows.bound.iter()) {
                let violation = *product - *bound;
                // Written so that a violation that is not a number is kept.
                if !(violation <= worst) {
                    worst = violation;
                }
            }
            if !worst.is_finite_number() {
                return worst;
            }
        }
        worst
    }

    /// Takes the point of the gains for the solution: no row is active.
    fn take_gains(&mut self) {
        let soft = self.shape.soft;
        for k in 0..self.stages.len() {
            let at = self.at(k);
            let stage = &mut self.stages[at];
            stage.v = stage.dv;
            stage.x = stage.dx;
            stage.t = T::ZERO;
            let price = self.cost.slack;
            let slack_row = self.shape.input + soft;
            let rows = self.rows_of(k);
            for multiplier in rows.multiplier.iter_mut() {
                *multiplier = T::ZERO;
            }
            if soft > 0 {
                rows.multiplier[slack_row] = price;
            }
        }
    }

    #[inline(always)]
    fn rows_of(&mut self, stage: usize) -> Rows<'_, T> {
        let (count, memory) = (self.shape.rows(), self.shape.memory());
        let first = self.at(stage) * memory;
        Rows::of(&mut self.rows[first..][..memory], count)
    }

    /// The rows of a stage times a point, into their `target`.
    #[inline(always)]
    fn rows_times(&mut self, k: usize, v: &[T; NU], x: &[T; NX], t: T) -> Rows<'_, T> {
        let place = self.at(k);
        let (shape, stage, matrices) = (self.shape, &self.stages[place], self.matrices);
        let (count, memory) = (shape.rows(), shape.memory());
        let rows = Rows::of(&mut self.rows[place * memory..][..memory], count);
        let (input, rest) = rows.target.split_at_mut(shape.input);
        for (out, row) in input.iter_mut().zip(&matrices.input[stage.input_rows..]) {
            *out = dot(row, v);
        }
        let (soft, rest) = rest.split_at_mut(shape.soft);
        if shape.soft > 0 {
            let z: &[T; NU] = part(x, 0);
            for (out, row) in soft.iter_mut().zip(&matrices.soft[stage.soft_rows..]) {
                *out = dot(row, z) - t;
            }
            rest[0] = -t;
        }
        if shape.hard > 0 {
            let z: &[T; NU] = part(x, shape.hard_offset);
            let hard = &mut rest[usize::from(shape.soft > 0)..];
            for (out, row) in hard.iter_mut().zip(&matrices.hard[stage.hard_rows..]) {
                *out = dot(row, z);
            }
        }
        rows
    }

    /// Adds the rows' share, with multipliers `y`, of the gradient by input and state; returns that by
    /// the slack.
    #[inline(always)]
    fn add_rows_pull(&self, k: usize, y: &[T], by_v: &mut [T; NU], by_x: &mut [T; NX]) -> T {
        let (shape, stage, matrices) = (self.shape, &self.stages[self.at(k)], self.matrices);
        let (input, rest) = y.split_at(shape.input);
        for (y, row) in input.iter().zip(&matrices.input[stage.input_rows..]) {
            for j in 0..NU {
                by_v[j] += *y * row[j];
            }
        }
        let mut by_t = T::ZERO;
        if shape.soft > 0 {
            by_t = self.cost.slack;
            for (y, row) in rest[..shape.soft]
                .iter()
                .zip(&matrices.soft[stage.soft_rows..])
            {
                by_t -= *y;
                for j in 0..NU {
                    by_x[j] += *y * row[j];
                }
            }
            by_t -= rest[shape.soft];
        }
        if shape.hard > 0 {
            let hard = &rest[shape.soft + usize::from(shape.soft > 0)..];
            for (y, row) in hard.iter().zip(&matrices.hard[stage.hard_rows..]) {
                for j in 0..NU {
                    by_x[shape.hard_offset + j] += *y * row[j];
                }
            }
        }
        by_t
    }

    /// First point of the iterations: the guess, or the point of the gains.
    fn start(&mut self, x0: &[T; NX], is_warm: bool) {
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
        self.centre(if is_warm { WARM } else { COLD });
    }

    /// Slacks and multipliers of the present point, none smaller than these: slacks, and products of
    /// the two.
    fn centre(&mut self, (smallest, product): (f64, f64)) {
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
    fn measure(&mut self) -> (T, T, T) {
        let (mut infeasibility, mut sum, mut largest) = (T::ZERO, T::ZERO, T::ZERO);
        for k in 0..self.stages.len() {
            let stage = &self.stages[self.at(k)];
            let (v, x, t) = (stage.v, stage.x, stage.t);
            let rows = self.rows_times(k, &v, &x, t);
            for i in 0..rows.bound.len() {
                let residual = rows.target[i] + rows.slack[i] - rows.bound[i];
                rows.residual[i] = residual;
                infeasibility = residual.magnitude().or_larger(infeasibility);
                let product = rows.slack[i] * rows.multiplier[i];
                sum += product;
                largest = product.or_larger(largest);
            }
        }
        let count = self.shape.rows() * self.stages.len();
        (infeasibility, sum / T::of(count as f64), largest)
    }

    /// One step of Mehrotra's method from the present point with this mean complementarity; its length,
    /// none if a Hessian is not positive definite.
    fn step(&mut self, complementarity: T) -> Option<T> {
        if !self.eliminate_all() {
            return None;
        }
        self.pull_all();
        let (to_slack, to_multiplier) = self.advance();
        let length = T::ONE / to_slack.or_larger(to_multiplier).or_larger(T::ONE);
        // What is left of the complementarity after the step that does not centre decides how much is
        // aimed at.
        let mut left = T::ZERO;
        for k in 0..self.stages.len() {
            let rows = self.rows_of(k);
            for i in 0..rows.slack.len() {
                left += (rows.slack[i] + length * rows.dslack[i])
                    * (rows.multiplier[i] + length * rows.dmultiplier[i]);
            }
        }
        let count = T::of((self.shape.rows() * self.stages.len()) as f64);
        let ratio = left / (count * complementarity);
        let aim = ratio * ratio * ratio * complementarity;
        for k in 0..self.stages.len() {
            let rows = self.rows_of(k);
            for i in 0..rows.slack.len() {
                let second_order = rows.dslack[i] * rows.dmultiplier[i];
                rows.target[i] =
                    rows.weight[i] * rows.residual[i] + (aim - second_order) / rows.slack[i];
            }
        }
        self.pull_all();
        let (to_slack, to_multiplier) = self.advance();
        let margin = T::of(TO_THE_BOUNDARY);
        let longest = margin / to_slack.or_larger(to_multiplier).or_larger(margin);
        self.move_by(longest);
        Some(longest)
    }

    /// Gains with the weights of the rows; the rows' targets are those of the step that does not centre.
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
                let weight = rows.multiplier[i] / rows.slack[i];
                rows.weight[i] = weight;
                rows.target[i] = weight * rows.residual[i];
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

    /// Constant parts of the inputs' changes, from the rows' targets.
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
            let target = &self.rows[self.at(k) * memory + 4 * count..][..count];
            let by_t = self.add_rows_pull(k, target, &mut by_v, &mut by_x);
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
    fn advance(&mut self) -> (T, T) {
        let shape = self.shape;
        let (mut to_slack, mut to_multiplier) = (T::ZERO, T::ZERO);
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
            let (count, memory) = (shape.rows(), shape.memory());
            // `rows_times` overwrites the targets, which the multipliers' change is made of.
            let targets = Rows::of(&mut self.rows[at * memory..][..memory], count);
            targets.dmultiplier.copy_from_slice(targets.target);
            let rows = self.rows_times(k, &dv, &dx, dt);
            for i in 0..count {
                let change = rows.target[i];
                let dslack = -rows.residual[i] - change;
                let dmultiplier =
                    rows.dmultiplier[i] - rows.multiplier[i] + rows.weight[i] * change;
                rows.dslack[i] = dslack;
                rows.dmultiplier[i] = dmultiplier;
                to_slack = (-dslack / rows.slack[i]).or_larger(to_slack);
                to_multiplier = (-dmultiplier / rows.multiplier[i]).or_larger(to_multiplier);
            }
        }
        (to_slack, to_multiplier)
    }

    /// Moves all unknowns along their changes.
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

    /// Residuals of the optimality conditions at the present point, from the program's own numbers.
    pub fn residuals(&mut self, x0: &[T; NX]) -> Residuals<T> {
        let (horizon, shape) = (self.stages.len(), self.shape);
        let (mut primal, mut dual, mut gap) = (T::ZERO, T::ZERO, T::ZERO);
        let (mut size, mut multipliers, mut value) = (T::ONE, T::ONE, T::ZERO);
        for k in 0..horizon {
            let stage = &self.stages[self.at(k)];
            let before = if k == 0 {
                *x0
            } else {
                self.stages[self.at(k - 1)].x
            };
            let next = plus_product(&stage.b, &stage.v, plus_product(&stage.a, &before, stage.c));
            let (v, x, t) = (stage.v, stage.x, stage.t);
            for i in 0..NX {
                primal = kept_larger((next[i] - x[i]).magnitude(), primal);
                size = kept_larger(x[i].magnitude(), size);
            }
            let rows = self.rows_times(k, &v, &x, t);
            for i in 0..rows.bound.len() {
                let (room, multiplier) = (rows.bound[i] - rows.target[i], rows.multiplier[i]);
                primal = kept_larger(-room, primal);
                dual = kept_larger(-multiplier, dual);
                multipliers = kept_larger(multiplier, multipliers);
                gap += multiplier * room;
            }
        }
        let mut p = [T::ZERO; NX];
        for k in (0..horizon).rev() {
            let weight = self.cost.state_at(k, horizon);
            let stage = &self.stages[self.at(k)];
            let mut by_v = [T::ZERO; NU];
            for i in 0..NU {
                by_v[i] = self.cost.input[i] * stage.v[i];
                value += by_v[i] * stage.v[i];
            }
            for i in 0..NX {
                let pulled = weight[i] * stage.x[i];
                multipliers = kept_larger(pulled.magnitude(), multipliers);
                value += pulled * stage.x[i];
                p[i] += pulled;
            }
            let (count, memory) = (shape.rows(), shape.memory());
            let y = &self.rows[self.at(k) * memory + 2 * count..][..count];
            let by_t = self.add_rows_pull(k, y, &mut by_v, &mut p);
            dual = kept_larger(by_t.magnitude(), dual);
            add_transposed(&stage.b, &p, &mut by_v);
            for entry in by_v {
                dual = kept_larger(entry.magnitude(), dual);
            }
            let mut next = [T::ZERO; NX];
            add_transposed(&stage.a, &p, &mut next);
            p = next;
        }
        Residuals {
            primal: primal / size,
            dual: dual / multipliers,
            gap: gap.magnitude() / kept_larger(value, T::ONE),
        }
    }
}

/// The larger of two numbers, or not a number if the new one is not.
fn kept_larger<T: Real>(new: T, so_far: T) -> T {
    if new <= so_far { so_far } else { new }
}

#[inline(always)]
fn part<T, const NX: usize, const NU: usize>(x: &[T; NX], first: usize) -> &[T; NU] {
    x[first..]
        .first_chunk()
        .expect("rows on states begin at least NU before their end")
}

#[inline(always)]
fn dot<T: Real, const N: usize>(row: &[T; N], x: &[T; N]) -> T {
    let mut sum = row[0] * x[0];
    for j in 1..N {
        sum += row[j] * x[j];
    }
    sum
}

/// `M += w r rᵀ`.
#[inline(always)]
fn add_square<T: Real, const N: usize>(w: T, row: &[T; N], matrix: &mut [[T; N]; N]) {
    for i in 0..N {
        let factor = w * row[i];
        for j in 0..N {
            matrix[i][j] += factor * row[j];
        }
    }
}

#[inline(always)]
fn add_block<T: Real, const N: usize, const NX: usize>(
    block: &[[T; N]; N],
    first: usize,
    matrix: &mut [[T; NX]; NX],
) {
    for i in 0..N {
        for j in 0..N {
            matrix[first + i][first + j] += block[i][j];
        }
    }
}
