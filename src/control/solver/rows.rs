//! The rows of a stage: their numbers, their products with a point, and their share of gradients.

use super::problem::Program;
use super::riccati::add_multiple;
use super::scalar::Real;

/// The numbers of one stage's rows, as many of each kind.
pub(super) struct Rows<'a, T> {
    pub(super) count: usize,
    pub(super) bound: &'a mut [T],
    pub(super) slack: &'a mut [T],
    pub(super) multiplier: &'a mut [T],
    pub(super) weight: &'a mut [T],
    /// Products of the rows with a point, and later numbers that are made of them.
    pub(super) target: &'a mut [T],
    pub(super) residual: &'a mut [T],
    pub(super) dslack: &'a mut [T],
    pub(super) dmultiplier: &'a mut [T],
    pub(super) inverse: &'a mut [T],
}

impl<'a, T: Real> Rows<'a, T> {
    #[inline(always)]
    pub(super) fn of(memory: &'a mut [T], count: usize) -> Self {
        let (bound, rest) = memory.split_at_mut(count);
        let (slack, rest) = rest.split_at_mut(count);
        let (multiplier, rest) = rest.split_at_mut(count);
        let (weight, rest) = rest.split_at_mut(count);
        let (target, rest) = rest.split_at_mut(count);
        let (residual, rest) = rest.split_at_mut(count);
        let (dslack, rest) = rest.split_at_mut(count);
        let (dmultiplier, rest) = rest.split_at_mut(count);
        let inverse = &mut rest[..count];
        Self {
            count,
            bound,
            slack,
            multiplier,
            weight,
            target,
            residual,
            dslack,
            dmultiplier,
            inverse,
        }
    }

    /// Weights of the rows, and multipliers aimed at by a step that does not centre, in `dmultiplier`.
    #[inline(always)]
    pub(super) fn weigh(&mut self, left: T) {
        for i in 0..self.count {
            let inverse = T::ONE / self.slack[i];
            let weight = self.multiplier[i] * inverse;
            self.inverse[i] = inverse;
            self.weight[i] = weight;
            self.dmultiplier[i] = weight * (left * self.residual[i]);
        }
    }

    /// The same of rows that are softened.
    #[inline(always)]
    pub(super) fn weigh_softened(&mut self, softness: T) {
        for i in 0..self.count {
            let yield_of_row = softness * self.multiplier[i];
            let inverse = T::ONE / (self.slack[i] + yield_of_row);
            let weight = self.multiplier[i] * inverse;
            self.inverse[i] = inverse;
            self.weight[i] = weight;
            self.dmultiplier[i] = weight * (self.residual[i] + yield_of_row);
        }
    }

    /// Multipliers aimed at by a step that aims at this product of slacks and multipliers, from the changes of the step
    /// that does not centre.
    #[inline(always)]
    pub(super) fn aim_at(&mut self, left: T, aim: T) {
        for i in 0..self.count {
            let second = self.dslack[i] * self.dmultiplier[i];
            let residual = left * self.residual[i];
            self.dmultiplier[i] = self.weight[i] * residual + (aim - second) * self.inverse[i];
        }
    }

    /// The same of rows that are softened.
    #[inline(always)]
    pub(super) fn aim_softened(&mut self, softness: T, aim: T) {
        for i in 0..self.count {
            let second = self.dslack[i] * self.dmultiplier[i];
            let residual = self.residual[i] + softness * self.multiplier[i];
            self.dmultiplier[i] = self.weight[i] * residual + (aim - second) * self.inverse[i];
        }
    }

    /// Changes of slacks and multipliers in the predictor, from the products of the rows in `target`. Writes to
    /// `target` the reciprocal of the largest step that each row permits.
    #[inline(always)]
    pub(super) fn change(&mut self, left: T) {
        for i in 0..self.count {
            let dslack = -(left * self.residual[i]) - self.target[i];
            self.dslack[i] = dslack;
            self.dmultiplier[i] = -self.multiplier[i] - self.weight[i] * dslack;
            // The relative changes of slack and multiplier have the sum of minus one.
            let to_slack = -dslack * self.inverse[i];
            self.target[i] = to_slack.or_larger(T::ONE - to_slack);
        }
    }

    /// The same of a step that centres, from the multipliers aimed at in `dmultiplier`.
    #[inline(always)]
    pub(super) fn change_corrected(&mut self, left: T) {
        for i in 0..self.count {
            let change = self.target[i];
            let dslack = -(left * self.residual[i]) - change;
            let dmultiplier = self.dmultiplier[i] - self.multiplier[i] + self.weight[i] * change;
            self.dslack[i] = dslack;
            self.dmultiplier[i] = dmultiplier;
            let to_slack = -dslack * self.inverse[i];
            let to_multiplier = -dmultiplier / self.multiplier[i];
            self.target[i] = to_slack.or_larger(to_multiplier);
        }
    }

    /// The same of either step, of rows that are softened.
    #[inline(always)]
    pub(super) fn change_softened(&mut self, softness: T) {
        for i in 0..self.count {
            let change = self.target[i];
            let dmultiplier = self.dmultiplier[i] - self.multiplier[i] + self.weight[i] * change;
            let dslack = softness * dmultiplier - (self.residual[i] + change);
            self.dslack[i] = dslack;
            self.dmultiplier[i] = dmultiplier;
            let to_multiplier = -dmultiplier / self.multiplier[i];
            self.target[i] = (-dslack / self.slack[i]).or_larger(to_multiplier);
        }
    }

    /// Multipliers of a stage where no row is active: the whole price at the slack.
    #[inline(always)]
    pub(super) fn write_multipliers(&mut self, soft: usize, slack_row: usize, price: T) {
        for i in 0..self.count {
            self.multiplier[i] = T::ZERO;
        }
        if soft > 0 {
            self.multiplier[slack_row] = price;
        }
    }
}

impl<T: Real, const NX: usize, const NU: usize, const LINKED: bool> Program<'_, T, NX, NU, LINKED> {
    #[inline(always)]
    pub(super) fn rows_of(&mut self, stage: usize) -> Rows<'_, T> {
        let memory = self.shape.memory();
        let first = self.at(stage) * memory;
        Rows::of(&mut self.rows[first..][..memory], self.shape.rows())
    }

    /// The rows of a stage times a point, into their `target`; `before` is the input of the stage before.
    #[inline(always)]
    pub(super) fn rows_times(
        &mut self,
        k: usize,
        before: &[T; NU],
        v: &[T; NU],
        x: &[T; NX],
        t: T,
    ) -> Rows<'_, T> {
        let shape = self.shape;
        let linked = self.is_linked();
        let memory = shape.memory();
        let place = self.at(k);
        let before_place = if k > 0 { self.at(k - 1) } else { 0 };
        let rows: Rows<T> = Rows::of(&mut self.rows[place * memory..][..memory], shape.rows());
        let stage = &self.stages[place];
        let input = &self.matrices.input[stage.input_rows..];
        times(input, shape.pairs, shape.input, v, rows.target);
        if NU <= NX && shape.soft > 0 {
            let z: &[T; NU] = part(x, 0);
            let soft = &self.matrices.soft[stage.soft_rows..][..shape.soft];
            let products = &mut rows.target[shape.input..][..shape.soft];
            for i in 0..shape.soft {
                products[i] = dot(&soft[i], z) - t;
            }
            rows.target[shape.slack_row()] = -t;
        }
        if linked {
            let products = &mut rows.target[shape.first_link()..];
            let first = place * shape.link;
            times(&self.links.rows[first..], 0, shape.link, v, products);
            if k > 0 {
                let first_earlier = before_place * shape.link;
                let earlier = &self.links.rows[first_earlier..][..shape.link];
                for i in 0..shape.link {
                    products[i] = products[i] - dot(&earlier[i], before);
                }
            }
        }
        rows
    }

    /// Adds the rows' share, with multipliers `y`, of the gradient by input and state; returns that by the slack.
    #[inline(always)]
    pub(super) fn add_rows_pull(
        &self,
        k: usize,
        y: &[T],
        by_v: &mut [T; NU],
        by_x: &mut [T; NX],
    ) -> T {
        let shape = self.shape;
        let linked = self.is_linked();
        let stage = &self.stages[self.at(k)];
        let input = &self.matrices.input[stage.input_rows..];
        add_rows(y, input, shape.pairs, shape.input, by_v);
        let mut by_t = T::ZERO;
        if NU <= NX && shape.soft > 0 {
            let y_soft = &y[shape.input..][..shape.soft + 1];
            by_t = self.cost.slack;
            for i in 0..shape.soft {
                by_t -= y_soft[i];
            }
            let soft = &self.matrices.soft[stage.soft_rows..];
            let by_z: &mut [T; NU] = part_mut(by_x, 0);
            add_rows(y_soft, soft, 0, shape.soft, by_z);
            by_t -= y_soft[shape.soft];
        }
        if linked {
            let y_link = &y[shape.first_link()..];
            add_rows(y_link, self.link_rows(k), 0, shape.link, by_v);
        }
        by_t
    }
}

#[inline(always)]
pub(super) fn part<T, const N: usize>(values: &[T], first: usize) -> &[T; N] {
    (values[first..].first_chunk()).expect("a part ends before its vector")
}

#[inline(always)]
pub(super) fn part_mut<T, const N: usize>(values: &mut [T], first: usize) -> &mut [T; N] {
    (values[first..].first_chunk_mut()).expect("a part ends before its vector")
}

/// `out = rows x` of `count` rows, of which so many pairs of opposite ones come first.
#[inline(always)]
fn times<T: Real, const NU: usize>(
    rows: &[[T; NU]],
    pairs: usize,
    count: usize,
    x: &[T; NU],
    out: &mut [T],
) {
    let rows = &rows[..count];
    let out = &mut out[..count];
    for pair in 0..pairs {
        let product = dot(&rows[2 * pair], x);
        out[2 * pair] = product;
        out[2 * pair + 1] = -product;
    }
    for i in 2 * pairs..count {
        out[i] = dot(&rows[i], x);
    }
}

/// `sum += Σ y row` of `count` rows, of which so many pairs of opposite ones come first.
#[inline(always)]
fn add_rows<T: Real, const NU: usize>(
    y: &[T],
    rows: &[[T; NU]],
    pairs: usize,
    count: usize,
    sum: &mut [T; NU],
) {
    let y = &y[..count];
    let rows = &rows[..count];
    // A local sum stays in registers.
    let mut local = *sum;
    for pair in 0..pairs {
        let both = y[2 * pair] - y[2 * pair + 1];
        add_multiple(both, &rows[2 * pair], &mut local);
    }
    for i in 2 * pairs..count {
        add_multiple(y[i], &rows[i], &mut local);
    }
    *sum = local;
}

#[inline(always)]
pub(super) fn dot<T: Real, const NU: usize>(row: &[T; NU], x: &[T; NU]) -> T {
    let mut sum = row[0] * x[0];
    for j in 1..NU {
        sum += row[j] * x[j];
    }
    sum
}

/// The largest of numbers and one more, four at a time.
#[inline(always)]
pub(super) fn largest_of<T: Real>(values: &[T], count: usize, so_far: T) -> T {
    let values = &values[..count];
    let fours = count / 4;
    let mut lanes = [so_far; 4];
    for four in 0..fours {
        let next: &[T; 4] = part(values, 4 * four);
        for j in 0..4 {
            lanes[j] = next[j].or_larger(lanes[j]);
        }
    }
    for i in 4 * fours..count {
        lanes[i % 4] = values[i].or_larger(lanes[i % 4]);
    }
    let first = lanes[0].or_larger(lanes[1]);
    first.or_larger(lanes[2].or_larger(lanes[3]))
}

/// The sum of numbers in four parts, those of every fourth one.
#[inline(always)]
pub(super) fn sum_of<T: Real>(values: &[T], count: usize) -> T {
    let values = &values[..count];
    let fours = count / 4;
    let mut parts = [T::ZERO; 4];
    for four in 0..fours {
        let next: &[T; 4] = part(values, 4 * four);
        for j in 0..4 {
            parts[j] += next[j];
        }
    }
    for i in 4 * fours..count {
        parts[i % 4] += values[i];
    }
    (parts[0] + parts[1]) + (parts[2] + parts[3])
}
