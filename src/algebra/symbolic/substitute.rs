//! Simultaneous substitution.

use super::id_map::IdMap;
use super::node::{ExprId, Node, SymbolId};
use super::pool::ExprPool;

impl ExprPool {
    /// `expr` with every symbol of `replacements` replaced, all at once: replacements are not
    /// searched for symbols again, so `x` and `y` can be exchanged. The first entry of a symbol
    /// counts.
    pub fn substitute(&mut self, expr: ExprId, replacements: &[(SymbolId, ExprId)]) -> ExprId {
        self.substitute_all(&[expr], replacements)[0]
    }

    /// As [`substitute`](ExprPool::substitute) for several expressions with common parts.
    pub(crate) fn substitute_all(
        &mut self,
        exprs: &[ExprId],
        replacements: &[(SymbolId, ExprId)],
    ) -> Vec<ExprId> {
        let affected = |expr| {
            let mut symbols = replacements.iter().map(|(symbol, _)| *symbol);
            symbols.any(|symbol| self.may_contain(expr, symbol))
        };
        let order = self.walk(exprs, affected, |_| true);
        let mut replaced: IdMap<ExprId> = IdMap::default();
        for expr in order {
            let symbol = self.as_symbol(expr);
            let known = replacements.iter().find(|(old, _)| Some(*old) == symbol);
            let new = match known {
                Some((_, new)) => *new,
                None => self.rebuild(expr, |child| replaced.get(&child).copied().unwrap_or(child)),
            };
            replaced.insert(expr, new);
        }
        exprs
            .iter()
            .map(|expr| replaced.get(expr).copied().unwrap_or(*expr))
            .collect()
    }

    /// The expressions with every part that has no variable but a finite value as a number: `exp(3)*x` is
    /// `20.085536923187668*x`.
    pub(crate) fn fold_constants(&mut self, exprs: &[ExprId]) -> Vec<ExprId> {
        let mut folded: IdMap<ExprId> = IdMap::default();
        for expr in self.reachable(exprs) {
            let value = match self.is_constant(expr) && self.as_number(expr).is_none() {
                true => self.evaluate(expr, &|_| f64::NAN),
                false => f64::NAN,
            };
            let new = match value.is_finite() {
                true => self.number(value),
                false => self.rebuild(expr, |child| folded[&child]),
            };
            folded.insert(expr, new);
        }
        exprs.iter().map(|expr| folded[expr]).collect()
    }

    pub(super) fn rebuild(
        &mut self,
        expr: ExprId,
        mut operand: impl FnMut(ExprId) -> ExprId,
    ) -> ExprId {
        match self.node(expr).clone() {
            Node::Number(_) | Node::Symbol(_) => expr,
            Node::Sum(terms) => {
                let terms: Vec<ExprId> = terms.iter().map(|term| operand(*term)).collect();
                self.sum(&terms)
            }
            Node::Product(factors) => {
                let factors: Vec<ExprId> = factors.iter().map(|factor| operand(*factor)).collect();
                self.product(&factors)
            }
            Node::Power(base, exponent) => {
                let (base, exponent) = (operand(base), operand(exponent));
                self.pow(base, exponent)
            }
            Node::Apply(function, argument) => {
                let argument = operand(argument);
                self.apply(function, argument)
            }
        }
    }
}
