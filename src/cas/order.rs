//! The structural order that makes canonical forms independent of how they were built. The constant comes first, then
//! polynomial terms by degree (`z1`, `z2`, `dz1`, `z1^2`, `z1*z2`, ...), then everything else (`sin(z1)`, ...), as in a
//! library of candidate terms. Coefficients do not matter, so that a term keeps its place when its sign changes.

use std::ops::ControlFlow;

use super::*;

/// Grades from here on are not polynomial.
const NOT_POLYNOMIAL: u32 = 1 << 31;

/// Sorting key of a symbol's name: `z2` before `z10`, and `z1` before `dz1`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct SymbolKey {
    prefix_len: usize,
    prefix: String,
    index: Option<u64>,
    pub(super) name: String,
}

impl SymbolKey {
    pub(super) fn of(name: &str) -> SymbolKey {
        let prefix = name.trim_end_matches(|c: char| c.is_ascii_digit());
        SymbolKey {
            prefix_len: prefix.chars().count(),
            prefix: prefix.to_owned(),
            index: name[prefix.len()..].parse().ok(),
            name: name.to_owned(),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Exponent {
    Number(Number),
    Expr(ExprId),
}

/// One step of a comparison: decided, or the same question about a pair of operands.
type Step = ControlFlow<Ordering, (ExprId, ExprId)>;

impl ExprPool {
    /// The canonical order, by structure and symbol names, never by creation; equal only for the same expression.
    pub fn compare(&self, a: ExprId, b: ExprId) -> Ordering {
        let (mut a, mut b) = (a, b);
        // Distinct ids are distinct structures: the first differing pair of operands decides, so no stack is needed.
        loop {
            if a == b {
                return Ordering::Equal;
            }
            match self.compare_step(a, b) {
                Step::Break(ordering) => return ordering,
                Step::Continue(operands) => (a, b) = operands,
            }
        }
    }

    fn compare_step(&self, a: ExprId, b: ExprId) -> Step {
        let by_grade = self.grade(a).cmp(&self.grade(b));
        if by_grade.is_ne() {
            return Step::Break(by_grade);
        }
        let ((coefficient_a, rest_a), (coefficient_b, rest_b)) = (self.split(a), self.split(b));
        if rest_a == rest_b {
            return Step::Break(coefficient_a.cmp(&coefficient_b));
        }
        if rest_a != a || rest_b != b {
            return Step::Continue((rest_a, rest_b));
        }
        let is_base = |expr| self.base_and_exponent(expr).0 == expr;
        let is_atom = |expr| !matches!(self.node(expr), Node::Product(_)) && is_base(expr);
        if is_atom(a) && is_atom(b) {
            return self.compare_atoms(a, b);
        }
        self.compare_factors(self.factors_of(a), self.factors_of(b))
    }

    /// Lexicographic by base, then higher exponents first: `x^2*y` before `x*y^2`.
    fn compare_factors(&self, a: &[ExprId], b: &[ExprId]) -> Step {
        for (&factor_a, &factor_b) in a.iter().zip(b) {
            let (base_a, exponent_a) = self.base_and_exponent(factor_a);
            let (base_b, exponent_b) = self.base_and_exponent(factor_b);
            if base_a != base_b {
                return Step::Continue((base_a, base_b));
            }
            match (exponent_a, exponent_b) {
                (m, n) if m == n => {}
                (Exponent::Number(m), Exponent::Number(n)) => return Step::Break(n.cmp(&m)),
                (Exponent::Number(_), Exponent::Expr(_)) => return Step::Break(Ordering::Less),
                (Exponent::Expr(_), Exponent::Number(_)) => {
                    return Step::Break(Ordering::Greater);
                }
                (Exponent::Expr(m), Exponent::Expr(n)) => return Step::Continue((m, n)),
            }
        }
        Step::Break(a.len().cmp(&b.len()))
    }

    fn compare_atoms(&self, a: ExprId, b: ExprId) -> Step {
        let rank = |node: &Node| match node {
            Node::Number(_) => 0,
            Node::Symbol(_) => 1,
            Node::Apply(..) => 2,
            Node::Power(..) | Node::Product(_) | Node::Sum(_) => 3,
        };
        match (self.node(a), self.node(b)) {
            (Node::Number(m), Node::Number(n)) => Step::Break(m.cmp(n)),
            (Node::Symbol(s), Node::Symbol(t)) => {
                Step::Break(self.symbol_key(*s).cmp(self.symbol_key(*t)))
            }
            (Node::Apply(f, x), Node::Apply(g, y)) if f == g => Step::Continue((*x, *y)),
            (Node::Apply(f, _), Node::Apply(g, _)) => Step::Break(f.cmp(g)),
            (Node::Sum(x), Node::Sum(y)) => match x.iter().zip(y.iter()).find(|(x, y)| x != y) {
                Some((x, y)) => Step::Continue((*x, *y)),
                None => Step::Break(x.len().cmp(&y.len())),
            },
            (a, b) => Step::Break(rank(a).cmp(&rank(b))),
        }
    }

    /// A factor as `base ^ exponent`, with square roots read as powers of a half.
    pub(super) fn base_and_exponent(&self, factor: ExprId) -> (ExprId, Exponent) {
        match *self.node(factor) {
            Node::Apply(Function::Sqrt, argument) => (argument, Exponent::Number(Number::HALF)),
            Node::Power(base, exponent) => {
                let Some(exponent) = self.as_number(exponent) else {
                    return (base, Exponent::Expr(exponent));
                };
                if let (Node::Apply(Function::Sqrt, argument), Some(halves)) =
                    (self.node(base), exponent.as_integer())
                    && let Some(exponent) = Number::rational(halves, 2)
                {
                    return (*argument, Exponent::Number(exponent));
                }
                (base, Exponent::Number(exponent))
            }
            _ => (factor, Exponent::Number(Number::ONE)),
        }
    }

    /// The first sorting key of a node: its degree, with non-polynomials after all polynomials.
    pub(super) fn grade_of(&self, node: &Node) -> u32 {
        match node {
            Node::Number(_) => 0,
            Node::Symbol(_) => 1,
            Node::Sum(_) | Node::Apply(..) => NOT_POLYNOMIAL + 1,
            // Degrees add (and saturate); one factor that is not polynomial makes the product so.
            Node::Product(factors) => factors.iter().fold(0, |all, factor| {
                let own = self.grade(*factor);
                let degree = (all % NOT_POLYNOMIAL) + (own % NOT_POLYNOMIAL);
                degree.min(NOT_POLYNOMIAL - 1) | ((all | own) & NOT_POLYNOMIAL)
            }),
            Node::Power(base, exponent) => {
                let degree = self.as_integer(*exponent).map(u32::try_from);
                match degree.map(|n| n.map(|n| n.min(NOT_POLYNOMIAL - 1))) {
                    Some(Ok(degree)) if self.as_symbol(*base).is_some() => degree,
                    Some(Ok(degree)) => NOT_POLYNOMIAL | degree,
                    Some(Err(_)) | None => NOT_POLYNOMIAL + 1,
                }
            }
        }
    }
}
