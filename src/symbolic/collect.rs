//! Collecting terms by symbols, and taking common factors out of sums.

use super::node::{ExprId, Node, SymbolId};
use super::number::Number;
use super::order::Exponent;
use super::pool::ExprPool;

impl ExprPool {
    /// `expr`, expanded, with terms that agree in everything that depends on `symbols` put
    /// together: `a*x + b*x + c` by `x` is `(a + b)*x + c`.
    pub fn collect(&mut self, expr: ExprId, symbols: &[SymbolId]) -> ExprId {
        let expanded = self.expand(expr);
        let mut parts: Vec<(ExprId, ExprId)> = Vec::new();
        for (coefficient, rest) in self.terms_of(expanded) {
            let factors = self.factors_of(rest).to_vec();
            let (depending, free): (Vec<ExprId>, Vec<ExprId>) =
                factors.into_iter().partition(|factor| {
                    let found = self.symbols_of(*factor);
                    symbols.iter().any(|symbol| found.contains(symbol))
                });
            let free = self.product(&free);
            parts.push((self.product(&depending), self.scale(coefficient, free)));
        }
        parts.sort_by_key(|(depending, _)| *depending);
        let mut terms = Vec::new();
        for group in parts.chunk_by(|a, b| a.0 == b.0) {
            let coefficients: Vec<ExprId> = group.iter().map(|(_, free)| *free).collect();
            let coefficient = self.sum(&coefficients);
            terms.push(self.product(&[coefficient, group[0].0]));
        }
        self.sum(&terms)
    }

    /// `expr` with factors that all terms of a sum share taken out of it, from the inside out:
    /// `x*y + x^2*z` becomes `x*(y + x*z)`.
    ///
    /// Of numbers only exact common factors are taken out (`2*x + 4*y = 2*(x + 2*y)`), so that
    /// multiplying out gives the same coefficients back.
    pub fn factor_common(&mut self, expr: ExprId) -> ExprId {
        let order = self.reachable(&[expr]);
        let mut factored = std::collections::HashMap::new();
        for node in order {
            let rebuilt = self.rebuild(node, |child| factored[&child]);
            factored.insert(node, self.factor_sum(rebuilt));
        }
        factored[&expr]
    }

    /// Takes common factors out of one sum.
    pub(super) fn factor_sum(&mut self, expr: ExprId) -> ExprId {
        if !matches!(self.node(expr), Node::Sum(_)) {
            return expr;
        }
        let terms = self.terms_of(expr);
        let content = exact_content(&terms);
        let mut common = self.numeric_powers(terms[0].1);
        for (_, rest) in &terms[1..] {
            let powers = self.numeric_powers(*rest);
            common = common_powers(&common, &powers);
            if common.is_empty() {
                break;
            }
        }
        if common.is_empty() && content.is_one() {
            return expr;
        }
        let outside: Vec<ExprId> = common
            .iter()
            .map(|(base, exponent)| self.pow_number(*base, *exponent))
            .collect();
        let outside = self.product(&outside);
        let inverse: Vec<ExprId> = common
            .iter()
            .map(|(base, exponent)| self.pow_number(*base, -*exponent))
            .collect();
        let mut inside = Vec::with_capacity(terms.len());
        for (coefficient, rest) in terms {
            let Some(coefficient) = coefficient.checked_div(content) else {
                return expr;
            };
            let mut factors = inverse.clone();
            factors.push(rest);
            let quotient = self.product(&factors);
            inside.push(self.scale(coefficient, quotient));
        }
        let inside = self.sum(&inside);
        let product = self.product(&[outside, inside]);
        self.scale(content, product)
    }

    /// The factors of a term as powers with constant exponents.
    pub(super) fn numeric_powers(&self, rest: ExprId) -> Vec<(ExprId, Number)> {
        self.factors_of(rest)
            .iter()
            .filter_map(|factor| match self.base_and_exponent(*factor) {
                (base, Exponent::Number(number)) if self.as_number(base).is_none() => {
                    Some((base, number))
                }
                (_, Exponent::Number(_)) => None,
                (_, Exponent::Expr(_)) => Some((*factor, Number::ONE)),
            })
            .collect()
    }
}

/// The largest exact number that divides all coefficients into integers; one if any of them is
/// a float.
fn exact_content(terms: &[(Number, ExprId)]) -> Number {
    let Some(ratios) = terms
        .iter()
        .map(|(coefficient, _)| coefficient.as_rational())
        .collect::<Option<Vec<_>>>()
    else {
        return Number::ONE;
    };
    let numerator = ratios.iter().fold(0, |common, ratio| gcd(common, ratio.0));
    let denominator = ratios.iter().try_fold(1_i64, |common, ratio| {
        common.checked_mul(ratio.1 / gcd(common, ratio.1))
    });
    denominator
        .and_then(|denominator| Number::rational(numerator, denominator))
        .unwrap_or(Number::ONE)
}

fn gcd(a: i64, b: i64) -> i64 {
    let (mut a, mut b) = (a.abs(), b.abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

/// The powers by which both can be divided: the smaller exponent of the same sign.
fn common_powers(a: &[(ExprId, Number)], b: &[(ExprId, Number)]) -> Vec<(ExprId, Number)> {
    a.iter()
        .filter_map(|(base, exponent)| {
            let (_, other) = b.iter().find(|(other, _)| other == base)?;
            if exponent.is_negative() != other.is_negative() {
                return None;
            }
            let smaller = if exponent.abs() <= other.abs() {
                exponent
            } else {
                other
            };
            Some((*base, *smaller))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with<T>(text: &str, work: impl FnOnce(&mut ExprPool, ExprId) -> T) -> T {
        let mut pool = ExprPool::new();
        let expr = pool.parse(text, &|_| true).expect("test text parses");
        work(&mut pool, expr)
    }

    fn collected(text: &str, names: &[&str]) -> String {
        with(text, |pool, expr| {
            let symbols: Vec<SymbolId> = names.iter().map(|name| pool.symbol_id(name)).collect();
            let result = pool.collect(expr, &symbols);
            pool.display(result).to_string()
        })
    }

    fn factored(text: &str) -> String {
        with(text, |pool, expr| {
            let result = pool.factor_common(expr);
            pool.display(result).to_string()
        })
    }

    #[test]
    fn collect_groups_terms_by_what_depends_on_the_symbols() {
        assert_eq!(collected("a*x + b*x + c", &["x"]), "c + x*(a + b)");
        assert_eq!(collected("(x + a)^2", &["x"]), "a^2 + 2*a*x + x^2");
        assert_eq!(
            collected("a*sin(x) + x + 2*sin(x)", &["x"]),
            "x + sin(x)*(2 + a)"
        );
        assert_eq!(collected("a*x*y + x*y + y", &["x", "y"]), "y + x*y*(1 + a)");
    }

    #[test]
    fn factor_common_takes_out_shared_factors() {
        assert_eq!(factored("x*y + x^2*z"), "x*(y + x*z)");
        assert_eq!(factored("2*x + 4*y"), "2*(x + 2*y)");
        assert_eq!(factored("x/3 - y/6"), "1/6*(2*x - y)");
        assert_eq!(factored("0.5*x + 0.5*y"), "0.5*x + 0.5*y");
        assert_eq!(factored("x/z^2 + y/z"), "(y + x/z)/z");
        assert_eq!(factored("sin(a*x + b*x)"), "sin(x*(a + b))");
        assert_eq!(factored("x + y"), "x + y");
    }

    #[test]
    fn factor_common_multiplies_out_to_the_same_expression() {
        for text in [
            "0.3*x*y - 0.7*x*z",
            "x^3/2 + x^2/3",
            "sqrt(x)*y + x*z",
            "x^a*y + x^a",
        ] {
            with(text, |pool, expr| {
                let factored = pool.factor_common(expr);
                assert_ne!(factored, expr, "{text}");
                assert_eq!(pool.expand(factored), expr, "{text}");
            });
        }
    }
}
