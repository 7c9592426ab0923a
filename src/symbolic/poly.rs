//! Expressions as polynomials in chosen symbols.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use super::node::{ExprId, Node, SymbolId};
use super::number::Number;
use super::pool::ExprPool;

/// Sorting key of a monomial: degree, then higher powers of earlier symbols first.
type MonomialKey = (u32, Vec<Reverse<u32>>);

/// A polynomial in given symbols, with coefficients free of them.
///
/// Monomials are listed by degree, and within a degree as a library lists them: `x^2`, `x*y`,
/// `y^2`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Polynomial {
    symbols: Vec<SymbolId>,
    terms: BTreeMap<MonomialKey, ExprId>,
}

impl Polynomial {
    /// The symbols, in the order of exponents.
    pub fn symbols(&self) -> &[SymbolId] {
        &self.symbols
    }

    /// The highest total degree; `None` for the zero polynomial.
    pub fn degree(&self) -> Option<u32> {
        self.terms.keys().next_back().map(|(degree, _)| *degree)
    }

    /// The coefficient of the monomial with these exponents.
    pub fn coefficient(&self, exponents: &[u32]) -> Option<ExprId> {
        self.terms.get(&key(exponents)).copied()
    }

    /// Exponents (one a symbol) and coefficient of every monomial, in order.
    pub fn terms(&self) -> impl Iterator<Item = (Vec<u32>, ExprId)> + '_ {
        self.terms.iter().map(|((_, exponents), coefficient)| {
            (
                exponents.iter().map(|exponent| exponent.0).collect(),
                *coefficient,
            )
        })
    }
}

fn key(exponents: &[u32]) -> MonomialKey {
    let degree = exponents.iter().sum();
    (degree, exponents.iter().copied().map(Reverse).collect())
}

impl ExprPool {
    /// `expr`, expanded, as a polynomial in `symbols`; `None` if it is not one (a symbol occurs
    /// in a function, a denominator or an exponent) or is too large to expand.
    pub fn polynomial(&mut self, expr: ExprId, symbols: &[SymbolId]) -> Option<Polynomial> {
        let expanded = self.expand(expr);
        let mut coefficients: BTreeMap<MonomialKey, Vec<ExprId>> = BTreeMap::new();
        for (coefficient, rest) in self.terms_of(expanded) {
            let mut exponents = vec![0; symbols.len()];
            let mut others = vec![self.constant(coefficient)];
            for &factor in &self.factors_of(rest).to_vec() {
                match self.power_of_symbol(factor, symbols)? {
                    Some((index, exponent)) => exponents[index] = exponent,
                    None => others.push(factor),
                }
            }
            let coefficient = self.product(&others);
            coefficients
                .entry(key(&exponents))
                .or_default()
                .push(coefficient);
        }
        let terms = coefficients
            .into_iter()
            .map(|(key, parts)| (key, self.sum(&parts)))
            .filter(|(_, coefficient)| *coefficient != ExprId::ZERO)
            .collect();
        Some(Polynomial {
            symbols: symbols.to_vec(),
            terms,
        })
    }

    /// The expression of a polynomial: its terms, added.
    pub fn polynomial_expr(&mut self, polynomial: &Polynomial) -> ExprId {
        let mut terms = Vec::new();
        for (exponents, coefficient) in polynomial.terms() {
            let mut factors = vec![coefficient];
            for (&symbol, exponent) in polynomial.symbols().iter().zip(exponents) {
                let base = self.symbol_expr(symbol);
                factors.push(self.pow_number(base, Number::integer(i64::from(exponent))));
            }
            terms.push(self.product(&factors));
        }
        self.sum(&terms)
    }

    /// Which symbol a factor is a power of: `Some(None)` if it contains none of them, `None` if
    /// it contains one in another way.
    fn power_of_symbol(
        &self,
        factor: ExprId,
        symbols: &[SymbolId],
    ) -> Option<Option<(usize, u32)>> {
        let index_of = |expr| {
            let symbol = self.as_symbol(expr)?;
            symbols.iter().position(|known| *known == symbol)
        };
        if let Some(index) = index_of(factor) {
            return Some(Some((index, 1)));
        }
        if let Node::Power(base, exponent) = *self.node(factor)
            && let Some(index) = index_of(base)
        {
            let exponent = self.as_number(exponent)?.as_integer()?;
            return Some(Some((index, u32::try_from(exponent).ok()?)));
        }
        let found = self.symbols_of(factor);
        let is_free = !symbols.iter().any(|symbol| found.contains(symbol));
        is_free.then_some(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial(pool: &mut ExprPool, text: &str, names: &[&str]) -> Option<Polynomial> {
        let expr = pool.parse(text, &|_| true).expect("test text parses");
        let symbols: Vec<SymbolId> = names.iter().map(|name| pool.symbol_id(name)).collect();
        pool.polynomial(expr, &symbols)
    }

    #[test]
    fn polynomial_lists_coefficients_by_monomial() {
        let mut pool = ExprPool::new();
        let view = polynomial(&mut pool, "(x + a*y)^2 + 3 - sin(a)*x", &["x", "y"])
            .expect("a polynomial in x and y");
        let listed: Vec<(Vec<u32>, String)> = view
            .terms()
            .map(|(exponents, coefficient)| (exponents, pool.display(coefficient).to_string()))
            .collect();
        let expected = [
            (vec![0, 0], "3"),
            (vec![1, 0], "-sin(a)"),
            (vec![2, 0], "1"),
            (vec![1, 1], "2*a"),
            (vec![0, 2], "a^2"),
        ];
        assert_eq!(
            listed,
            expected.map(|(exponents, text)| (exponents, text.to_owned()))
        );
        assert_eq!(view.degree(), Some(2));
        assert_eq!(view.coefficient(&[2, 0]), Some(ExprId::ONE));
        assert_eq!(view.coefficient(&[3, 0]), None);
    }

    #[test]
    fn polynomial_of_other_functions_is_none() {
        let mut pool = ExprPool::new();
        for text in ["sin(x)", "1/x", "2^x", "sqrt(x)", "y*abs(x)"] {
            assert_eq!(polynomial(&mut pool, text, &["x"]), None, "{text}");
        }
    }

    #[test]
    fn polynomial_turns_back_into_its_expression() {
        let mut pool = ExprPool::new();
        let text = "0.36 - 0.16*x + 2*x^2*sin(y)";
        let expr = pool.parse(text, &|_| true).expect("parses");
        let view = polynomial(&mut pool, text, &["x"]).expect("a polynomial in x");
        assert_eq!(pool.polynomial_expr(&view), expr);
        let zero = polynomial(&mut pool, "0", &["x"]).expect("zero is a polynomial");
        assert_eq!(
            (zero.degree(), pool.polynomial_expr(&zero)),
            (None, ExprId::ZERO)
        );
    }
}
