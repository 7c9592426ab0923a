//! Linear combinations of expressions with floating-point coefficients. Generated code keeps the order in which sums
//! are added here. Terms that are known early come first, in up to four parallel partial sums. Terms that wait for a
//! sine or an exponential come last, so that they delay as little as possible.

use super::*;
use crate::symbolic::Number;

/// `constant + sum_i coefficient_i expr_i`; the expressions are distinct, not sums and without numeric factor.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Combination {
    pub constant: f64,
    pub items: Vec<(f64, ExprId)>,
}

impl Combination {
    /// Collects `sum_i coefficient_i expr_i`. Sums are decomposed, equal expressions are merged in order of first
    /// appearance, and terms that cancel exactly are left out.
    pub(crate) fn collect(
        pool: &ExprPool,
        summands: impl IntoIterator<Item = (f64, ExprId)>,
    ) -> Self {
        let mut constants = Vec::new();
        let mut items: Vec<(Vec<f64>, ExprId)> = Vec::new();
        let mut position = HashMap::new();
        for (coefficient, expr) in summands {
            for (number, rest) in pool.terms_of(expr) {
                let product = coefficient * number.to_f64();
                if rest == ExprId::ONE {
                    constants.push(product);
                    continue;
                }
                let at = *position.entry(rest).or_insert(items.len());
                match items.get_mut(at) {
                    Some((products, _)) => products.push(product),
                    None => items.push((vec![product], rest)),
                }
            }
        }
        let items = items.into_iter();
        let items = items.map(|(products, expr)| (sum_of_floats(&products), expr));
        let items = items.filter(|&(coefficient, _)| coefficient != 0.0);
        Self {
            constant: sum_of_floats(&constants),
            items: items.collect(),
        }
    }

    /// The slope by one variable. Terms whose slopes may be infinite count as one: infinities of both signs can have a
    /// finite sum.
    pub(crate) fn derivative(&self, pool: &mut ExprPool, by: SymbolId) -> Self {
        let mut items = self.items.clone();
        let mut is_steep = |item: &(f64, ExprId)| pool.may_be_steep(item.1, by);
        let steep: Vec<_> = items.iter().copied().filter(&mut is_steep).collect();
        if steep.len() > 1 {
            let terms = steep.iter().map(|&(coefficient, expr)| {
                let number = Number::from_f64(coefficient)?;
                Some(pool.scale(number, expr))
            });
            let terms: Option<Vec<ExprId>> = terms.collect();
            if let Some(terms) = terms {
                items.retain(|item| !steep.contains(item));
                items.push((1.0, pool.sum(&terms)));
            }
        }
        let summands: Vec<_> = items
            .into_iter()
            .map(|(coefficient, expr)| (coefficient, pool.slope(expr, by)))
            .filter(|&(_, expr)| expr != ExprId::ZERO)
            .collect();
        Self::collect(pool, summands)
    }

    pub(crate) fn is_zero(&self) -> bool {
        self.items.is_empty() && self.constant == 0.0
    }
}

/// One term `coefficient * value` of a sum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Term {
    pub coefficient: f64,
    pub value: ValueId,
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
    let sum = match late.len() {
        0..=3 => chain(builder, sum, &late),
        _ => partial_sums(builder, sum, &late),
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
                let op = match term.coefficient < 0.0 {
                    true => Binary::Sub,
                    false => Binary::Add,
                };
                let value = scaled(builder, term.coefficient.abs(), term.value);
                builder.binary(op, sum, value)
            }
        })
    })
}

/// `coefficient * value` without needless operations.
pub(super) fn scaled(builder: &mut ProgramBuilder, coefficient: f64, value: ValueId) -> ValueId {
    match coefficient {
        1.0 => value,
        -1.0 => builder.unary(Unary::Neg, value),
        _ => {
            let coefficient = builder.constant(coefficient);
            builder.mul(coefficient, value)
        }
    }
}
