//! Rewriting level by level: sums, products and integer powers on one side, what is inside
//! functions and other powers on the other.
//!
//! A *region* is what can be reached from an expression through sums, products and integer powers.
//! Function calls and other powers are its atoms; their arguments are regions of their own.

use super::function::Function;
use super::id_map::IdMap;
use super::node::{ExprId, Node};
use super::number::Number;
use super::order::Exponent;
use super::pool::ExprPool;

impl ExprPool {
    /// Rebuilds `expr` bottom-up within its region, passing every new node through `rule`.
    pub(super) fn rewrite_region(
        &mut self,
        expr: ExprId,
        mut rule: impl FnMut(&mut ExprPool, ExprId) -> ExprId,
    ) -> ExprId {
        let mut rewritten = IdMap::default();
        for node in self.region(expr) {
            let rebuilt = if self.is_atom(node) {
                node
            } else {
                self.rebuild(node, |child| *rewritten.get(&child).unwrap_or(&child))
            };
            let result = match self.affords(1) {
                true => rule(self, rebuilt),
                false => rebuilt,
            };
            rewritten.insert(node, result);
        }
        rewritten[&expr]
    }

    /// Passes every region through `finish`, innermost first, and puts the results together.
    pub(super) fn map_regions(
        &mut self,
        expr: ExprId,
        mut finish: impl FnMut(&mut ExprPool, ExprId) -> ExprId,
    ) -> ExprId {
        let mut rebuilt = IdMap::default();
        let mut finished = IdMap::default();
        for node in self.reachable(&[expr]) {
            let is_atom = self.is_atom(node);
            if is_atom {
                for child in self.children(node).collect::<Vec<_>>() {
                    finished
                        .entry(child)
                        .or_insert_with(|| finish(self, rebuilt[&child]));
                }
            }
            let operands = if is_atom { &finished } else { &rebuilt };
            let result = self.rebuild(node, |child| operands[&child]);
            rebuilt.insert(node, result);
        }
        finish(self, rebuilt[&expr])
    }

    fn region(&self, expr: ExprId) -> Vec<ExprId> {
        self.walk(&[expr], |_| true, |node| !self.is_atom(node))
    }

    /// The function calls and other powers of the region of `expr`, in order of creation.
    pub(super) fn atoms_of(&self, expr: ExprId) -> Vec<ExprId> {
        let mut atoms = self.region(expr);
        atoms.retain(|node| self.is_atom(*node));
        atoms
    }

    /// Whether the operands of a node are regions of their own.
    fn is_atom(&self, expr: ExprId) -> bool {
        match *self.node(expr) {
            Node::Apply(..) => true,
            Node::Power(_, exponent) => self.as_integer(exponent).is_none(),
            Node::Number(_) | Node::Symbol(_) | Node::Sum(_) | Node::Product(_) => false,
        }
    }

    pub(super) fn integer_power(&self, factor: ExprId) -> Option<(ExprId, i64)> {
        match self.base_and_exponent(factor) {
            (base, Exponent::Number(number)) => Some((base, number.as_integer()?)),
            (_, Exponent::Expr(_)) => None,
        }
    }

    /// A factor as an integer power of a function call: `sin(x)^2` is `(Sin, x, 2)`.
    pub(super) fn function_power(&self, factor: ExprId) -> Option<(Function, ExprId, i64)> {
        let (base, power) = self.integer_power(factor)?;
        match self.node(base) {
            Node::Apply(function, argument) => Some((*function, *argument, power)),
            _ => None,
        }
    }

    pub(super) fn sum_power(&self, factor: ExprId) -> Option<(ExprId, i64)> {
        let is_sum = |(base, _): &(ExprId, i64)| matches!(self.node(*base), Node::Sum(_));
        self.integer_power(factor).filter(is_sum)
    }

    /// What `pick` takes of the factors of a product, and its other factors.
    pub(super) fn partition_factors<T>(
        &mut self,
        expr: ExprId,
        mut pick: impl FnMut(&mut ExprPool, ExprId) -> Option<T>,
    ) -> (Vec<T>, Vec<ExprId>) {
        let (mut picked, mut others) = (Vec::new(), Vec::new());
        for factor in self.factors_of(expr).to_vec() {
            match pick(self, factor) {
                Some(found) => picked.push(found),
                None => others.push(factor),
            }
        }
        (picked, others)
    }

    pub(super) fn apply_power(
        &mut self,
        function: Function,
        argument: ExprId,
        exponent: i64,
    ) -> ExprId {
        let value = self.apply(function, argument);
        self.pow_number(value, Number::integer(exponent))
    }
}
