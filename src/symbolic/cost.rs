//! What computing an expression costs, as simplification sees it.

use std::collections::HashMap;

use super::intern::BuildIdHasher;
use super::node::{ExprId, Function, Node};
use super::number::Number;
use super::pool::ExprPool;

/// Costs found so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Costs {
    known: HashMap<ExprId, u64, BuildIdHasher>,
}

impl Costs {
    /// The cost of `expr`, see [`ExprPool::cost`].
    pub(super) fn of(&mut self, pool: &ExprPool, expr: ExprId) -> u64 {
        for node in pool.reachable_where(&[expr], |node| !self.known.contains_key(&node)) {
            let cost = pool.cost_of_node(node, |operand| self.known[&operand]);
            self.known.insert(node, cost);
        }
        self.known[&expr]
    }
}

impl ExprPool {
    /// What computing `expr` costs, by counting operations of the tree (shared parts as often as
    /// they are used): 2 an addition or multiplication, more a division, most a function call,
    /// 1 a number or symbol. Saturates.
    pub fn cost(&self, expr: ExprId) -> u64 {
        Costs::default().of(self, expr)
    }

    fn cost_of_node(&self, expr: ExprId, cost_of: impl Fn(ExprId) -> u64) -> u64 {
        match self.node(expr) {
            Node::Number(_) | Node::Symbol(_) => 1,
            Node::Sum(operands) | Node::Product(operands) => operands
                .iter()
                // A sign costs nothing: it makes an addition a subtraction.
                .filter(|operand| self.as_number(**operand) != Some(Number::MINUS_ONE))
                .map(|operand| cost_of(*operand).saturating_add(2))
                .fold(0, u64::saturating_add)
                .saturating_sub(2),
            Node::Power(base, exponent) => {
                match self.as_number(*exponent).and_then(Number::as_integer) {
                    Some(integer) => {
                        let products = u64::from(integer.unsigned_abs().ilog2()) + 1;
                        let division = if integer < 0 { 6 } else { 0 };
                        cost_of(*base).saturating_add(products + division)
                    }
                    None => cost_of(*base)
                        .saturating_add(cost_of(*exponent))
                        .saturating_add(40),
                }
            }
            Node::Apply(function, argument) => {
                let call = match function {
                    Function::Abs | Function::Sign => 2,
                    Function::Sqrt => 6,
                    Function::Sin
                    | Function::Cos
                    | Function::Tan
                    | Function::Tanh
                    | Function::Exp
                    | Function::Log => 20,
                };
                cost_of(*argument).saturating_add(call)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(text: &str) -> u64 {
        let mut pool = ExprPool::new();
        let expr = pool.parse(text, &|_| true).expect("test text parses");
        pool.cost(expr)
    }

    #[test]
    fn cost_counts_operations() {
        assert_eq!(cost("x"), 1);
        assert_eq!(cost("x + y"), 4);
        assert_eq!(cost("x - y"), 4);
        assert_eq!(cost("x*(y + z)"), cost("x*y + x*z") - 3);
        assert!(cost("x/y") > cost("x*y"));
        assert!(cost("sin(2*x)") < cost("2*sin(x)*cos(x)"));
    }

    #[test]
    fn cost_of_exponentially_large_tree_saturates() {
        let mut pool = ExprPool::new();
        let mut expr = pool.symbol("x");
        for _ in 0..100 {
            let sine = pool.apply(Function::Sin, expr);
            let cosine = pool.apply(Function::Cos, expr);
            expr = pool.add(sine, cosine);
        }
        assert_eq!(pool.cost(expr), u64::MAX - 2);
    }
}
