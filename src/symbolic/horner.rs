//! Horner forms of polynomials in several variables.

use std::collections::BTreeMap;

use super::expand::Terms;
use super::node::ExprId;
use super::number::Number;
use super::pool::ExprPool;

/// Deepest nesting of a Horner form; what is left beyond stays a sum.
const MAX_DEPTH: usize = 256;

/// A sum to be written in nested form, or the pieces of one waiting to be put together.
enum Task {
    /// Nest these terms at this depth.
    Nest(Terms, usize),
    /// Take the nested remainder and the nested quotient: `factor * quotient + remainder`.
    Combine(ExprId),
}

impl ExprPool {
    /// A nested form with fewer multiplications: the factor that most terms share is taken out of
    /// them, again and again: `a + b*x + c*x^2` becomes `a + x*(b + c*x)`.
    ///
    /// Greedy, ties going to the factor that comes first in canonical order. Only sums are
    /// rewritten (not inside functions), and coefficients keep their bits.
    pub fn horner(&mut self, expr: ExprId) -> ExprId {
        let terms = self.terms_of(expr);
        let mut tasks = vec![Task::Nest(terms, 0)];
        let mut results = Vec::new();
        while let Some(task) = tasks.pop() {
            match task {
                Task::Combine(factor) => {
                    let remainder = results.pop().expect("the remainder was nested");
                    let quotient = results.pop().expect("the quotient was nested");
                    let product = self.product(&[factor, quotient]);
                    results.push(self.add(product, remainder));
                }
                Task::Nest(terms, depth) => {
                    let Some(factor) = self.most_shared(&terms).filter(|_| depth < MAX_DEPTH)
                    else {
                        results.push(self.sum_of_terms(terms));
                        continue;
                    };
                    let (quotient, remainder) = self.divide_terms(terms, factor);
                    tasks.push(Task::Combine(factor));
                    tasks.push(Task::Nest(remainder, depth));
                    tasks.push(Task::Nest(quotient, depth + 1));
                }
            }
        }
        results.pop().expect("the whole sum was nested")
    }

    /// The base that occurs with a positive integer power in the most terms, at least two.
    fn most_shared(&self, terms: &[(Number, ExprId)]) -> Option<ExprId> {
        let mut counts: BTreeMap<ExprId, usize> = BTreeMap::new();
        for (_, rest) in terms {
            for (base, exponent) in self.numeric_powers(*rest) {
                if is_dividable(exponent) && *rest != ExprId::ONE {
                    *counts.entry(base).or_default() += 1;
                }
            }
        }
        counts
            .into_iter()
            .filter(|(_, count)| *count >= 2)
            .max_by(|(base, count), (other, other_count)| {
                count
                    .cmp(other_count)
                    .then_with(|| self.compare(*other, *base))
            })
            .map(|(base, _)| base)
    }

    /// Terms divided by `factor` where it occurs, and the others.
    fn divide_terms(&mut self, terms: Terms, factor: ExprId) -> (Terms, Terms) {
        let (mut quotient, mut remainder) = (Vec::new(), Vec::new());
        let inverse = self.powi(factor, -1);
        for (coefficient, rest) in terms {
            let occurs = self
                .numeric_powers(rest)
                .iter()
                .any(|(base, exponent)| *base == factor && is_dividable(*exponent));
            if !occurs {
                remainder.push((coefficient, rest));
                continue;
            }
            quotient.push((coefficient, self.product(&[rest, inverse])));
        }
        (quotient, remainder)
    }
}

/// Whether one factor can be taken from a power without making it a quotient.
fn is_dividable(exponent: Number) -> bool {
    exponent.to_f64() >= 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn horner(text: &str) -> String {
        let mut pool = ExprPool::new();
        let expr = pool.parse(text, &|_| true).expect("test text parses");
        let nested = pool.horner(expr);
        assert_eq!(pool.expand(nested), expr, "{text}");
        pool.display(nested).to_string()
    }

    #[test]
    fn horner_nests_polynomials_of_one_and_more_variables() {
        assert_eq!(horner("1 + 2*x + 3*x^2 + 4*x^3"), "1 + x*(2 + x*(3 + 4*x))");
        assert_eq!(horner("x*y + x*z + y*z"), "y*z + x*(y + z)");
        assert_eq!(
            horner("0.1*x^2 + 0.2*x^2*y + 0.3"),
            "0.3 + x^2*(0.1 + 0.2*y)"
        );
        assert_eq!(horner("a*sin(x) + b*sin(x)^2"), "sin(x)*(a + b*sin(x))");
    }

    #[test]
    fn horner_of_sum_without_common_factors_is_itself() {
        assert_eq!(horner("1 + x + y"), "1 + x + y");
        assert_eq!(horner("x^2"), "x^2");
        assert_eq!(horner("1/x + y/x"), "1/x + y/x");
        assert_eq!(horner("0"), "0");
    }

    #[test]
    fn horner_of_high_degree_is_bounded_in_depth() {
        let mut pool = ExprPool::new();
        let x = pool.symbol("x");
        let terms: Vec<ExprId> = (1..=600).map(|n| pool.powi(x, n)).collect();
        let sum = pool.sum(&terms);
        let nested = pool.horner(sum);
        let (direct, value) = (
            pool.evaluate(sum, &|_| 0.9),
            pool.evaluate(nested, &|_| 0.9),
        );
        assert!((direct - value).abs() < 1e-12);
    }
}
