//! In which order sums are added.
//!
//! Generated code keeps the association of the program, so it is chosen here: terms that
//! are known early are added in up to four partial sums, which run side by side; terms
//! that wait for a sine or an exponential come last, so that they delay as little as possible.

use crate::ir::{Binary, ProgramBuilder, Unary, ValueId};

/// One term `coefficient * value` of a sum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Term {
    pub coefficient: f64,
    pub value: ValueId,
    /// Whether the value waits for a transcendental function.
    pub late: bool,
}

/// `constant + sum_i coefficient_i value_i`.
pub(super) fn linear_combination(
    builder: &mut ProgramBuilder,
    constant: f64,
    terms: &[Term],
) -> ValueId {
    let (late, early): (Vec<Term>, Vec<Term>) = terms.iter().partition(|term| term.late);
    let start = (constant != 0.0).then(|| builder.constant(constant));
    let sum = partial_sums(builder, start, &early);
    let sum = if late.len() <= 3 {
        chain(builder, sum, &late)
    } else {
        partial_sums(builder, sum, &late)
    };
    sum.unwrap_or_else(|| builder.constant(0.0))
}

/// Adds the terms in one, two or four interleaved chains; the first begins with `start`.
fn partial_sums(
    builder: &mut ProgramBuilder,
    start: Option<ValueId>,
    terms: &[Term],
) -> Option<ValueId> {
    let n_chains = match terms.len() {
        0..=3 => 1,
        4..=7 => 2,
        _ => 4,
    };
    let sums = (0..n_chains).filter_map(|k| {
        let own: Vec<Term> = terms.iter().copied().skip(k).step_by(n_chains).collect();
        chain(builder, start.filter(|_| k == 0), &own)
    });
    let mut sums: Vec<ValueId> = sums.collect();
    while sums.len() > 1 {
        let pairs = sums.chunks(2);
        sums = pairs.map(|pair| builder.add(pair[0], pair[1])).collect();
    }
    sums.pop()
}

fn chain(builder: &mut ProgramBuilder, start: Option<ValueId>, terms: &[Term]) -> Option<ValueId> {
    terms.iter().fold(start, |sum, term| {
        Some(match sum {
            None => scaled(builder, term.coefficient, term.value),
            Some(sum) => {
                let op = if term.coefficient < 0.0 {
                    Binary::Sub
                } else {
                    Binary::Add
                };
                let value = scaled(builder, term.coefficient.abs(), term.value);
                builder.binary(op, sum, value)
            }
        })
    })
}

/// `coefficient * value` without needless operations.
pub(super) fn scaled(builder: &mut ProgramBuilder, coefficient: f64, value: ValueId) -> ValueId {
    if coefficient == 1.0 {
        value
    } else if coefficient == -1.0 {
        builder.unary(Unary::Neg, value)
    } else {
        let coefficient = builder.constant(coefficient);
        builder.mul(coefficient, value)
    }
}
