//! Derivatives, memoised per expression and symbol.

use super::id_map::IdSet;
use super::node::{ExprId, Function, Node, SymbolId};
use super::number::Number;
use super::pool::ExprPool;

impl ExprPool {
    /// The derivative of `expr` by `symbol`.
    ///
    /// `d|x| = sign(x) dx` and `d sign(x) = 0`, which hold except at zero. Results are kept in
    /// the pool: asking again, or for an expression with common parts, costs little.
    pub fn derivative(&mut self, expr: ExprId, symbol: SymbolId) -> ExprId {
        if let Some(known) = self.known_derivative(expr, symbol) {
            return known;
        }
        for node in self.to_differentiate(expr, symbol) {
            let derivative = self.derivative_of_node(node, symbol);
            self.derivatives.insert((node, symbol), derivative);
        }
        self.derivatives[&(expr, symbol)]
    }

    /// What has to be differentiated before and with `expr`, operands first. A product with a
    /// numeric factor needs only the rest, which other terms share.
    fn to_differentiate(&self, expr: ExprId, symbol: SymbolId) -> Vec<ExprId> {
        let mut seen = IdSet::default();
        let mut stack = vec![expr];
        while let Some(node) = stack.pop() {
            if self.known_derivative(node, symbol).is_some() || !seen.insert(node) {
                continue;
            }
            match self.split(node) {
                (_, rest) if rest != node => stack.push(rest),
                _ => stack.extend(self.children(node)),
            }
        }
        let mut order: Vec<ExprId> = seen.into_iter().collect();
        order.sort_unstable();
        order
    }

    fn known_derivative(&self, expr: ExprId, symbol: SymbolId) -> Option<ExprId> {
        if !self.may_contain(expr, symbol) {
            return Some(ExprId::ZERO);
        }
        self.derivatives.get(&(expr, symbol)).copied()
    }

    /// The derivative of one node whose operands' derivatives are known.
    fn derivative_of_node(&mut self, expr: ExprId, symbol: SymbolId) -> ExprId {
        let inner = |pool: &ExprPool, operand: ExprId| {
            pool.known_derivative(operand, symbol)
                .expect("operands are differentiated before what uses them")
        };
        let (coefficient, rest) = self.split(expr);
        if rest != expr {
            let derivative = inner(self, rest);
            return self.scale(coefficient, derivative);
        }
        match self.node(expr).clone() {
            Node::Number(_) => ExprId::ZERO,
            Node::Symbol(other) if other == symbol => ExprId::ONE,
            Node::Symbol(_) => ExprId::ZERO,
            Node::Sum(terms) => {
                let derivatives: Vec<ExprId> = terms
                    .iter()
                    .map(|term| inner(self, *term))
                    .filter(|derivative| *derivative != ExprId::ZERO)
                    .collect();
                self.sum(&derivatives)
            }
            Node::Product(factors) => {
                let mut terms = Vec::new();
                for (index, factor) in factors.iter().enumerate() {
                    let derivative = inner(self, *factor);
                    if derivative != ExprId::ZERO {
                        let mut product = factors.to_vec();
                        product[index] = derivative;
                        terms.push(self.product(&product));
                    }
                }
                self.sum(&terms)
            }
            Node::Power(base, exponent) => {
                if let (&Node::Apply(Function::Sqrt, radicand), Some(halves)) =
                    (self.node(base), self.as_number(exponent))
                {
                    let d_radicand = inner(self, radicand);
                    return self.derivative_of_half_power(base, halves, d_radicand);
                }
                let (d_base, d_exponent) = (inner(self, base), inner(self, exponent));
                self.derivative_of_power(expr, (base, d_base), (exponent, d_exponent))
            }
            Node::Apply(function, argument) => {
                let d_argument = inner(self, argument);
                let outer = self.outer_derivative(function, argument, expr);
                self.product(&[outer, d_argument])
            }
        }
    }

    /// `d(b^e) = e b^(e-1) db + b^e log(b) de`.
    fn derivative_of_power(
        &mut self,
        power: ExprId,
        (base, d_base): (ExprId, ExprId),
        (exponent, d_exponent): (ExprId, ExprId),
    ) -> ExprId {
        let mut terms = Vec::new();
        if d_base != ExprId::ZERO {
            let minus_one = self.constant(Number::MINUS_ONE);
            let lower = self.add(exponent, minus_one);
            let lowered = self.pow(base, lower);
            terms.push(self.product(&[exponent, lowered, d_base]));
        }
        if d_exponent != ExprId::ZERO {
            let log = self.apply(Function::Log, base);
            terms.push(self.product(&[power, log, d_exponent]));
        }
        self.sum(&terms)
    }

    /// `d(sqrt(w)^k) = k/2 sqrt(w)^(k-2) dw`, which has a value where `w` is 0 and `k` above 2; a product with the
    /// derivative of the root has none.
    fn derivative_of_half_power(
        &mut self,
        root: ExprId,
        halves: Number,
        d_radicand: ExprId,
    ) -> ExprId {
        let (halves, two) = (self.constant(halves), self.integer(2));
        let lower = self.sub(halves, two);
        let lowered = self.pow(root, lower);
        let product = self.product(&[halves, lowered, d_radicand]);
        self.scale(Number::HALF, product)
    }

    /// `f'(x)` for `f(x) = value`, written with `value` where that saves work.
    fn outer_derivative(&mut self, function: Function, x: ExprId, value: ExprId) -> ExprId {
        match function {
            Function::Sin => self.apply(Function::Cos, x),
            Function::Cos => {
                let sine = self.apply(Function::Sin, x);
                self.neg(sine)
            }
            Function::Tan => {
                let square = self.powi(value, 2);
                self.add(ExprId::ONE, square)
            }
            Function::Tanh => {
                let square = self.powi(value, 2);
                self.sub(ExprId::ONE, square)
            }
            Function::Exp => value,
            Function::Log => self.powi(x, -1),
            Function::Sqrt => {
                let reciprocal = self.powi(value, -1);
                self.scale(Number::HALF, reciprocal)
            }
            Function::Abs => self.apply(Function::Sign, x),
            Function::Sign => ExprId::ZERO,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::assert_rewritten;
    use super::*;

    #[test]
    fn derivative_of_polynomials_and_every_function() {
        let by_x = |pool: &mut ExprPool, expr| {
            let x = pool.symbol_id("x");
            pool.derivative(expr, x)
        };
        assert_rewritten(
            by_x,
            &[
                ("3*x^2*y + x - y^3 + 7", "1 + 6*x*y"),
                ("1/x", "-1/x^2"),
                ("(1 + x)^5", "5*(1 + x)^4"),
                ("0.36 - 0.16*x*y", "-0.16*y"),
                ("sin(x)", "cos(x)"),
                ("cos(x)", "-sin(x)"),
                ("tan(x)", "1 + tan(x)^2"),
                ("tanh(x)", "1 - tanh(x)^2"),
                ("exp(2*x)", "2*exp(2*x)"),
                ("log(x)", "1/x"),
                ("sqrt(x)", "1/2/sqrt(x)"),
                ("abs(x)", "sign(x)"),
                ("sign(x)", "0"),
                ("x^0.3", "0.3/x^0.7"),
                ("x^y", "x^(-1 + y)*y"),
                ("(x*y)^1.5", "3/2*y*sqrt(x*y)"),
                ("(x*y)^(5/2)", "5/2*y*sqrt(x*y)^3"),
                ("sqrt((x*y)^3)", "3/2*y*sqrt(x*y)"),
                ("sqrt(2*(x*y)^3)", "3/2*sqrt(2)*y*sqrt(x*y)"),
                ("sqrt(x^2*y^4)", "y^2*sign(x)"),
                ("(x*y)^(-1/2)", "-1/2*y/sqrt(x*y)^3"),
                ("y^x", "y^x*log(y)"),
                ("sin(x)*cos(x)", "-sin(x)^2 + cos(x)^2"),
            ],
        );
    }

    #[test]
    fn derivative_by_absent_symbol_is_zero_beyond_the_symbol_mask() {
        let mut pool = ExprPool::new();
        let symbols: Vec<ExprId> = (0..100).map(|i| pool.symbol(&format!("x{i}"))).collect();
        let product = pool.product(&symbols[80..82]);
        let (inside, outside) = (pool.symbol_id("x80"), pool.symbol_id("x90"));
        assert_eq!(pool.derivative(product, inside), symbols[81]);
        assert_eq!(pool.derivative(product, outside), ExprId::ZERO);
    }

    #[test]
    fn derivative_of_deep_expression_needs_no_stack() {
        let mut pool = ExprPool::new();
        let x = pool.symbol("x");
        let mut deep = x;
        for _ in 0..300 {
            deep = pool.apply(Function::Sin, deep);
        }
        let symbol = pool.symbol_id("x");
        let derivative = pool.derivative(deep, symbol);
        assert_eq!(pool.factors_of(derivative).len(), 300);
    }
}
