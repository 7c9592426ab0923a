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
    pub fn substitute_all(
        &mut self,
        exprs: &[ExprId],
        replacements: &[(SymbolId, ExprId)],
    ) -> Vec<ExprId> {
        let affected = |expr| {
            let mut symbols = replacements.iter().map(|(symbol, _)| *symbol);
            symbols.any(|symbol| self.may_contain(expr, symbol))
        };
        let order = self.walk(exprs, affected, |_| true);
        // The first entry of a symbol is inserted last.
        let new = replacements.iter().rev();
        let new = new.map(|&(symbol, new)| (self.symbol_expr(symbol), new));
        let replaced = new.collect();
        self.replace(exprs, order, replaced)
    }

    /// The expressions with every part that has no variable but a finite value as a number: `exp(3)*x` is
    /// `20.085536923187668*x`.
    pub fn fold_constants(&mut self, exprs: &[ExprId]) -> Vec<ExprId> {
        let order = self.reachable(exprs);
        let mut folded: IdMap<ExprId> = IdMap::default();
        for &expr in &order {
            if self.is_constant(expr) && self.as_number(expr).is_none() {
                let value = self.evaluate(expr, &|_| f64::NAN);
                if value.is_finite() {
                    folded.insert(expr, self.number(value));
                }
            }
        }
        self.replace(exprs, order, folded)
    }

    /// The expressions with the parts that `replaced` has, and what is made of these, built again; `order` lists their
    /// parts, operands first.
    pub(super) fn replace(
        &mut self,
        exprs: &[ExprId],
        order: Vec<ExprId>,
        mut replaced: IdMap<ExprId>,
    ) -> Vec<ExprId> {
        let of = |replaced: &IdMap<ExprId>, expr| replaced.get(&expr).copied().unwrap_or(expr);
        for expr in order {
            if !replaced.contains_key(&expr) {
                let new = self.rebuild(expr, |operand| of(&replaced, operand));
                replaced.insert(expr, new);
            }
        }
        exprs.iter().map(|expr| of(&replaced, *expr)).collect()
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
