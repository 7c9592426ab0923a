//! Multiplying out, within limits.

use super::node::{ExprId, Node};
use super::number::Number;
use super::pool::ExprPool;

/// Most terms of one expanded sum, and most products of two terms on the way to it; what would take more stays a
/// product or power.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    terms: usize,
    products: usize,
}

pub(super) const WIDE: Limits = Limits {
    terms: 2_000,
    products: 100_000,
};
/// Of intermediate results.
pub(super) const NARROW: Limits = Limits {
    terms: 500,
    products: 500,
};

/// A sum taken apart: `coefficient * rest` each.
pub(super) type Terms = Vec<(Number, ExprId)>;

impl ExprPool {
    /// A region (see `region.rs`) with products and integer powers of sums multiplied out.
    pub(super) fn expand_region(&mut self, region: ExprId) -> ExprId {
        self.rewrite_region(region, |pool, node| pool.expand_node(node, WIDE))
    }

    pub(super) fn expand_node(&mut self, expr: ExprId, limits: Limits) -> ExprId {
        if !matches!(self.node(expr), Node::Product(_) | Node::Power(..)) {
            return expr;
        }
        let factors = self.factors_of(expr).to_vec();
        let mut plain = Vec::new();
        let mut sums: Vec<(ExprId, i64)> = Vec::new();
        for factor in factors {
            match self.sum_power(factor) {
                Some((sum, exponent @ 0..)) => sums.push((sum, exponent)),
                _ => plain.push(factor),
            }
        }
        if sums.is_empty() {
            return expr;
        }
        let plain = self.product(&plain);
        let (mut terms, mut products_left) = (vec![self.split(plain)], limits.products);
        for (sum, exponent) in sums {
            let factor = self.terms_of(sum);
            for _ in 0..exponent {
                let n_products = terms.len().saturating_mul(factor.len());
                if n_products > products_left || !self.affords(n_products) {
                    return expr;
                }
                products_left -= n_products;
                terms = self.multiply(&terms, &factor);
                if terms.len() > limits.terms {
                    return expr;
                }
            }
        }
        self.sum_of_terms(terms)
    }

    fn multiply(&mut self, a: &Terms, b: &Terms) -> Terms {
        let mut products = Vec::with_capacity(a.len() * b.len());
        for &(coefficient_a, rest_a) in a {
            for &(coefficient_b, rest_b) in b {
                let rest = self.product(&[rest_a, rest_b]);
                let (extra, rest) = self.split(rest);
                let folded = coefficient_a
                    .checked_mul(coefficient_b)
                    .and_then(|coefficient| coefficient.checked_mul(extra));
                match folded {
                    Some(coefficient) => products.push((coefficient, rest)),
                    None => {
                        let numbers = [coefficient_a, coefficient_b, extra];
                        let numbers = numbers.map(|number| self.constant(number));
                        let whole = self.product(&[numbers[0], numbers[1], numbers[2], rest]);
                        products.push((Number::ONE, whole));
                    }
                }
            }
        }
        let sum = self.sum_of_terms(products);
        self.terms_of(sum)
    }
}
