//! Linear combinations of expressions with floating-point coefficients.

use std::collections::HashMap;

use crate::symbolic::{ExprId, ExprPool, Number, SymbolId, sum_of_floats};

/// `constant + sum_i coefficient_i expr_i`; the expressions are distinct, not sums and
/// without numeric factor.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Combination {
    pub constant: f64,
    pub items: Vec<(f64, ExprId)>,
}

impl Combination {
    /// Collects `sum_i coefficient_i expr_i`; sums are taken apart, equal expressions
    /// merged in order of first appearance, and what cancels exactly is left out.
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
        Self {
            constant: sum_of_floats(&constants),
            items: items
                .filter(|&(coefficient, _)| coefficient != 0.0)
                .collect(),
        }
    }

    /// The slope by one variable. Terms whose slopes may be infinite count as one: infinities of both signs
    /// can have a finite sum.
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

    /// The first number of the combination that is not finite.
    pub(crate) fn non_finite(&self) -> Option<f64> {
        std::iter::once(self.constant)
            .chain(self.items.iter().map(|&(coefficient, _)| coefficient))
            .find(|value| !value.is_finite())
    }
}
