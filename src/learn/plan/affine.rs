//! Affine expressions of a program's variables, and sparse matrices made of them.

use std::ops::{Add, Div, Mul, Sub};

use crate::mpc::{Cone, ConeProgram, sparse};

/// `constant + sum of factor times variable`.
#[derive(Clone, Debug, Default)]
pub(crate) struct Affine {
    pub terms: Vec<(usize, f64)>,
    pub constant: f64,
}

impl Affine {
    pub(crate) fn of(constant: f64) -> Self {
        let terms = Vec::new();
        Self { terms, constant }
    }

    /// The expression with `factor` times a variable on top.
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

impl Add for Affine {
    type Output = Self;

    fn add(mut self, other: Self) -> Self {
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

impl Add<f64> for Affine {
    type Output = Self;

    fn add(mut self, constant: f64) -> Self {
        self.constant += constant;
        self
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
