//! Derivatives, memoised per expression and symbol.

use super::*;

impl ExprPool {
    /// The derivative of `expr` by `symbol`, where `d|x| = sign(x) dx` and `d sign(x) = 0`, which hold except at zero.
    /// Results are kept in the pool: asking again, or for an expression with common parts, costs little.
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

    /// Expressions to differentiate before and with `expr`, operands first; products without the number, so that others
    /// can share them.
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

    fn derivative_of_node(&mut self, expr: ExprId, symbol: SymbolId) -> ExprId {
        let inner = |pool: &ExprPool, operand: ExprId| {
            pool.known_derivative(operand, symbol)
                .expect("operands are differentiated before their parents")
        };
        let (coefficient, rest) = self.split(expr);
        if rest != expr {
            let derivative = inner(self, rest);
            return self.scale(coefficient, derivative);
        }
        match self.node(expr).clone() {
            Node::Symbol(other) if other == symbol => ExprId::ONE,
            Node::Number(_) | Node::Symbol(_) => ExprId::ZERO,
            Node::Sum(terms) => {
                let derivatives: Vec<ExprId> =
                    terms.iter().map(|term| inner(self, *term)).collect();
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
            Node::Power(..) => {
                // sqrt(w)^k as w^(k/2): a product with the derivative of the root has no value where w is 0.
                let (base, exponent) = match self.base_and_exponent(expr) {
                    (base, Exponent::Number(number)) => (base, self.constant(number)),
                    (base, Exponent::Expr(exponent)) => (base, exponent),
                };
                let (d_base, d_exponent) = (inner(self, base), inner(self, exponent));
                self.derivative_of_power(expr, (base, d_base), (exponent, d_exponent))
            }
            Node::Apply(function, argument) => {
                let d_argument = inner(self, argument);
                let outer = function.derivative(self, argument, expr);
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
            let lower = self.sub(exponent, ExprId::ONE);
            let lowered = self.pow(base, lower);
            terms.push(self.product(&[exponent, lowered, d_base]));
        }
        if d_exponent != ExprId::ZERO {
            let log = self.apply(Function::Log, base);
            terms.push(self.product(&[power, log, d_exponent]));
        }
        self.sum(&terms)
    }
}
