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

impl<'a, T> Rows<'a, T> {
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
    pub fn weigh(&mut self, left: T)
    where
        T: Real,
    {
        for i in 0..self.slack.len() {
            let inverse = T::ONE / self.slack[i];
            let weight = self.multiplier[i] * inverse;
            self.inverse[i] = inverse;
            self.weight[i] = weight;
            self.dmultiplier[i] = weight * (left * self.residual[i]);
        }
    }
}

impl<T: Real, const NX: usize, const NU: usize> Program<'_, T, NX, NU> {
    #[inline(always)]
    pub(super) fn rows_of(&mut self, stage: usize) -> Rows<'_, T> {
        let (count, memory) = (self.shape.rows(), self.shape.memory());
        let first = self.at(stage) * memory;
        Rows::of(&mut self.rows[first..][..memory], count)
    }

    /// The rows of a stage times a point, into their `target`.
    #[inline(always)]
    pub(super) fn rows_times(&mut self, k: usize, v: &[T; NU], x: &[T; NX], t: T) -> Rows<'_, T> {
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
    pub(super) fn add_rows_pull(
        &self,
        k: usize,
        y: &[T],
        by_v: &mut [T; NU],
        by_x: &mut [T; NX],
    ) -> T {
        let (shape, stage, matrices) = (self.shape, &self.stages[self.at(k)], self.matrices);
        let (input, rest) = y.split_at(shape.input);
        add_rows(input, &matrices.input[stage.input_rows..], by_v);
        let mut by_t = T::ZERO;
        if shape.soft > 0 {
            by_t = self.cost.slack;
            for y in &rest[..shape.soft] {
                by_t -= *y;
            }
            let soft = &matrices.soft[stage.soft_rows..];
            add_rows(&rest[..shape.soft], soft, part_mut(by_x, 0));
            by_t -= rest[shape.soft];
        }
        if shape.hard > 0 {
            let y = &rest[shape.soft + usize::from(shape.soft > 0)..];
            let hard = &matrices.hard[stage.hard_rows..];
            add_rows(y, hard, part_mut(by_x, shape.hard_offset));
        }
        by_t
    }
}

#[inline(always)]
pub(super) fn part<T, const NX: usize, const NU: usize>(x: &[T; NX], first: usize) -> &[T; NU] {
    x[first..]
        .first_chunk()
        .expect("rows on states begin at least NU before their end")
}

#[inline(always)]
pub(super) fn part_mut<T, const NX: usize, const NU: usize>(
    x: &mut [T; NX],
    first: usize,
) -> &mut [T; NU] {
    x[first..]
        .first_chunk_mut()
        .expect("rows on states begin at least NU before their end")
}

/// `sum += Σ y row`.
#[inline(always)]
fn add_rows<T: Real, const N: usize>(y: &[T], rows: &[[T; N]], sum: &mut [T; N]) {
    // A local sum stays in registers.
    let mut local = *sum;
    for (y, row) in y.iter().zip(rows) {
        for j in 0..N {
            local[j] += *y * row[j];
        }
    }
    *sum = local;
}

/// `square += Σ w row rowᵀ` and `sum += Σ y row`.
#[inline(always)]
pub(super) fn add_weighted<T: Real, const N: usize>(
    w: &[T],
    y: &[T],
    rows: &[[T; N]],
    square: &mut Lower<T, N>,
    sum: &mut [T; N],
) {
    let (mut local, mut local_sum) = (*square, *sum);
    for ((w, y), row) in w.iter().zip(y).zip(rows) {
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
