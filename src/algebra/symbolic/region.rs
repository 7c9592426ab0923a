//! Rewriting level by level: sums, products and integer powers on one side, what is inside
//! functions and other powers on the other.
//!
//! A *region* is what can be reached from an expression through sums, products and integer powers.
//! Function calls and other powers are its atoms; their arguments are regions of their own.

use super::id_map::IdMap;
use super::node::{ExprId, Function, Node};
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

    /// All nodes of the region of `expr`, operands first.
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

    /// A factor as an integer power.
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

    /// `function(argument)^exponent`.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rewrite_region_stops_at_functions_and_roots() {
        let mut pool = ExprPool::new();
        let expr = pool.parsed("x + (x + y)^2*sin(x) + x^0.3");
        let (x, z) = (pool.symbol("x"), pool.symbol("z"));
        let result = pool.rewrite_region(expr, |_, node| if node == x { z } else { node });
        let expected = pool.parsed("z + (z + y)^2*sin(x) + x^0.3");
        assert_eq!(result, expected);
    }

    #[test]
    fn map_regions_finishes_every_region_once_from_the_inside() {
        let mut pool = ExprPool::new();
        let expr = pool.parsed("sin(x + y)*cos(x + y) + exp(sin(x + y))");
        let mut seen = Vec::new();
        let result = pool.map_regions(expr, |pool, region| {
            seen.push(pool.display(region).to_string());
            region
        });
        assert_eq!(result, expr);
        assert_eq!(seen[..2], ["x + y", "sin(x + y)"]);
        assert_eq!(seen.len(), 3);
    }
}
