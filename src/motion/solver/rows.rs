//! The rows of a stage: their numbers, their products with a point, and their share of gradients.

use super::lower::Lower;
use super::problem::Program;
use super::riccati::add_multiple;
use super::scalar::Real;

/// The numbers of one stage's rows.
pub(super) struct Rows<'a, T> {
    pub bound: &'a mut [T],
    pub slack: &'a mut [T],
    pub multiplier: &'a mut [T],
    pub weight: &'a mut [T],
    pub target: &'a mut [T],
    pub residual: &'a mut [T],
    pub dslack: &'a mut [T],
    pub dmultiplier: &'a mut [T],
    pub inverse: &'a mut [T],
}

impl<'a, T: Real> Rows<'a, T> {
    #[inline(always)]
    pub fn of(memory: &'a mut [T], count: usize) -> Self {
        let (bound, rest) = memory.split_at_mut(count);
        let (slack, rest) = rest.split_at_mut(count);
        let (multiplier, rest) = rest.split_at_mut(count);
        let (weight, rest) = rest.split_at_mut(count);
        let (target, rest) = rest.split_at_mut(count);
        let (residual, rest) = rest.split_at_mut(count);
        let (dslack, rest) = rest.split_at_mut(count);
        let (dmultiplier, rest) = rest.split_at_mut(count);
        let (inverse, _) = rest.split_at_mut(count);
        Self {
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
    pub fn weigh(&mut self, left: T) {
        for i in 0..self.slack.len() {
            let inverse = T::ONE / self.slack[i];
            let weight = self.multiplier[i] * inverse;
            self.inverse[i] = inverse;
            self.weight[i] = weight;
            self.dmultiplier[i] = weight * (left * self.residual[i]);
        }
    }

    /// The same of rows that are softened.
    #[inline(always)]
    pub fn weigh_softened(&mut self, softness: T) {
        for i in 0..self.slack.len() {
            let yield_of_row = softness * self.multiplier[i];
            let inverse = T::ONE / (self.slack[i] + yield_of_row);
            let weight = self.multiplier[i] * inverse;
            self.inverse[i] = inverse;
            self.weight[i] = weight;
            self.dmultiplier[i] = weight * (self.residual[i] + yield_of_row);
        }
    }

    /// Changes of slacks and multipliers of rows that are softened, from the products of the rows in `target` and
    /// the multipliers aimed at in `dmultiplier`; into `target`, how often they go into what is left of each.
    #[inline(always)]
    pub fn change_softened(&mut self, softness: T) {
        for i in 0..self.slack.len() {
            let change = self.target[i];
            let dmultiplier = self.dmultiplier[i] - self.multiplier[i] + self.weight[i] * change;
            let dslack = softness * dmultiplier - (self.residual[i] + change);
            self.dslack[i] = dslack;
            self.dmultiplier[i] = dmultiplier;
            let to_multiplier = -dmultiplier / self.multiplier[i];
            self.target[i] = (-dslack / self.slack[i]).or_larger(to_multiplier);
        }
    }
}

impl<T: Real, const NX: usize, const NU: usize, const LINKED: bool> Program<'_, T, NX, NU, LINKED> {
    #[inline(always)]
    pub(super) fn rows_of(&mut self, stage: usize) -> Rows<'_, T> {
        let (count, memory) = (self.shape.rows(), self.shape.memory());
        let first = self.at(stage) * memory;
        Rows::of(&mut self.rows[first..][..memory], count)
    }

    /// The rows of a stage times a point, into their `target`; `before` is the input of the stage before.
    #[inline(always)]
    pub(super) fn rows_times(
        &mut self,
        k: usize,
        (before, v): (&[T; NU], &[T; NU]),
        x: &[T; NX],
        t: T,
    ) -> Rows<'_, T> {
        let place = self.at(k);
        let (own, earlier) = self.link_pairs(k);
        let (shape, stage, matrices) = (self.shape, &self.stages[place], self.matrices);
        let (count, memory) = (shape.rows(), shape.memory());
        let rows = Rows::of(&mut self.rows[place * memory..][..memory], count);
        let (input, rest) = rows.target.split_at_mut(shape.input);
        let on_input = &matrices.input[stage.input_rows..];
        times(on_input, shape.pairs.input, v, input);
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
            let hard = &mut rest[usize::from(shape.soft > 0)..][..shape.hard];
            times(&matrices.hard[stage.hard_rows..], shape.pairs.hard, z, hard);
        }
        if LINKED {
            let link = &mut rows.target[count - shape.link..];
            times(own, 0, v, link);
            for (out, row) in link.iter_mut().zip(earlier) {
                *out = *out - dot(row, before);
            }
        }
        rows
    }

    /// Adds the rows' share, with multipliers `y`, of the gradient by input and state; returns that by
    /// the slack.
    #[inline(always)]
    pub(super) fn add_rows_pull(
        &self,
        k: usize,
        y: &[T],
        by_v: &mut [T; NU],
        by_x: &mut [T; NX],
    ) -> T {
        let (shape, stage, matrices) = (self.shape, &self.stages[self.at(k)], self.matrices);
        let (input, rest) = y.split_at(shape.input);
        let on_input = &matrices.input[stage.input_rows..];
        add_rows(input, on_input, shape.pairs.input, by_v);
        let mut by_t = T::ZERO;
        if shape.soft > 0 {
            by_t = self.cost.slack;
            for y in &rest[..shape.soft] {
                by_t -= *y;
            }
            let soft = &matrices.soft[stage.soft_rows..];
            add_rows(&rest[..shape.soft], soft, 0, part_mut(by_x, 0));
            by_t -= rest[shape.soft];
        }
        if shape.hard > 0 {
            let y = &rest[shape.soft + usize::from(shape.soft > 0)..][..shape.hard];
            let hard = &matrices.hard[stage.hard_rows..];
            add_rows(y, hard, shape.pairs.hard, part_mut(by_x, shape.hard_offset));
        }
        if LINKED {
            add_rows(&y[y.len() - shape.link..], self.link_rows(k), 0, by_v);
        }
        by_t
    }
}

/// Entries of a vector from this one on.
#[inline(always)]
pub(super) fn part<T, const NX: usize, const NU: usize>(x: &[T; NX], first: usize) -> &[T; NU] {
    (x[first..].first_chunk()).expect("a part ends before its vector")
}

#[inline(always)]
pub(super) fn part_mut<T, const NX: usize, const NU: usize>(
    x: &mut [T; NX],
    first: usize,
) -> &mut [T; NU] {
    (x[first..].first_chunk_mut()).expect("a part ends before its vector")
}

/// Pairs of numbers, and the numbers behind them.
#[inline(always)]
fn paired<V>(values: &[V], pairs: usize) -> (&[[V; 2]], &[V]) {
    let (paired, single) = values.split_at(2 * pairs);
    (paired.as_chunks().0, single)
}

/// `out = rows x`, of which so many pairs of opposite rows come first.
#[inline(always)]
fn times<T: Real, const N: usize>(rows: &[[T; N]], pairs: usize, x: &[T; N], out: &mut [T]) {
    let (row_pairs, row_singles) = paired(rows, pairs);
    let (out_pairs, out_singles) = out.split_at_mut(2 * pairs);
    for (out, [row, _]) in out_pairs.as_chunks_mut().0.iter_mut().zip(row_pairs) {
        let product = dot(row, x);
        *out = [product, -product];
    }
    for (out, row) in out_singles.iter_mut().zip(row_singles) {
        *out = dot(row, x);
    }
}

/// `sum += Σ y row`, of which so many pairs of opposite rows come first.
#[inline(always)]
fn add_rows<T: Real, const N: usize>(y: &[T], rows: &[[T; N]], pairs: usize, sum: &mut [T; N]) {
    // A local sum stays in registers.
    let mut local = *sum;
    let (row_pairs, row_singles) = paired(rows, pairs);
    let (y_pairs, y_singles) = paired(y, pairs);
    for ([y, opposite], [row, _]) in y_pairs.iter().zip(row_pairs) {
        add_multiple(*y - *opposite, row, &mut local);
    }
    for (y, row) in y_singles.iter().zip(row_singles) {
        add_multiple(*y, row, &mut local);
    }
    *sum = local;
}

/// `square += Σ w row rowᵀ` and `sum += Σ y row`, of which so many pairs of opposite rows come first.
#[inline(always)]
pub(super) fn add_weighted<T: Real, const N: usize>(
    (w, y): (&[T], &[T]),
    rows: &[[T; N]],
    pairs: usize,
    square: &mut Lower<T, N>,
    sum: &mut [T; N],
) {
    let (mut local, mut local_sum) = (*square, *sum);
    let (row_pairs, row_singles) = paired(rows, pairs);
    let ((w_pairs, w_singles), (y_pairs, y_singles)) = (paired(w, pairs), paired(y, pairs));
    for (([w, other_w], [y, other_y]), [row, _]) in w_pairs.iter().zip(y_pairs).zip(row_pairs) {
        local.add_square(*w + *other_w, row);
        add_multiple(*y - *other_y, row, &mut local_sum);
    }
    for ((w, y), row) in w_singles.iter().zip(y_singles).zip(row_singles) {
        local.add_square(*w, row);
        add_multiple(*y, row, &mut local_sum);
    }
    (*square, *sum) = (local, local_sum);
}

#[inline(always)]
pub(super) fn dot<T: Real, const N: usize>(row: &[T; N], x: &[T; N]) -> T {
    let mut sum = row[0] * x[0];
    for j in 1..N {
        sum += row[j] * x[j];
    }
    sum
}

/// The largest of numbers and one more, four at a time.
#[inline(always)]
pub(super) fn largest_of<T: Real>(values: &[T], so_far: T) -> T {
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
    let (first, second) = (lanes[0].or_larger(lanes[1]), lanes[2].or_larger(lanes[3]));
    first.or_larger(second)
}

/// The sum of numbers in four parts, those of every fourth one.
#[inline(always)]
pub(super) fn sum_of<T: Real>(values: &[T]) -> T {
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
