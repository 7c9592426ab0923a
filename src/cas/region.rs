//! Substitution, multiplying out within limits, and rewriting level by level. A *region* consists of all expressions
//! reached from an expression through sums, products and integer powers. Function calls and other powers are its atoms;
//! their arguments are regions of their own.

use super::*;

#[derive(Clone, Copy)]
pub(super) struct Limits {
    terms: usize,
    products: usize,
}

pub(super) const WIDE: Limits = Limits {
    terms: 2_000,
    products: 100_000,
};
/// Of intermediate results.
pub(super) const NARROW: Limits = Limits {
    terms: 500,
    products: 500,
};

pub(super) type Terms = Vec<(Number, ExprId)>;

impl ExprPool {
    /// Rebuilds `expr` bottom-up within its region, passing every new node through `rule`.
    pub(super) fn rewrite_region(
        &mut self,
        expr: ExprId,
        mut rule: impl FnMut(&mut ExprPool, ExprId) -> ExprId,
    ) -> ExprId {
        let mut rewritten = IdMap::default();
        for node in self.region(expr) {
            let rebuilt = match self.is_atom(node) {
                true => node,
                false => self.rebuild(node, |child| *rewritten.get(&child).unwrap_or(&child)),
            };
            let result = if self.affords(1) {
                rule(self, rebuilt)
            } else {
                rebuilt
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

    /// Results of `pick` for the factors of a product, and the factors without a result.
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

    /// `expr` with symbols replaced all at once, so that `x` and `y` can be exchanged; the first entry of each counts.
    pub(crate) fn substitute(
        &mut self,
        expr: ExprId,
        replacements: &[(SymbolId, ExprId)],
    ) -> ExprId {
        self.substitute_all(&[expr], replacements)[0]
    }

    /// As `substitute` for several expressions with common parts.
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
        let new = new
            .map(|&(symbol, new)| (self.symbol_expr(symbol), new))
            .collect();
        self.replace(exprs, order, new)
    }

    /// The expressions with finite parts that have no variable as numbers: `exp(3)*x` is `20.085536923187668*x`.
    pub fn fold_constants(&mut self, exprs: &[ExprId]) -> Vec<ExprId> {
        let order = self.reachable(exprs);
        let mut folded: IdMap<ExprId> = IdMap::default();
        for &expr in &order {
            let is_folded = self.is_constant(expr) && self.as_number(expr).is_none();
            let value = is_folded.then(|| self.evaluate(expr, &|_| f64::NAN));
            if let Some(value) = value.filter(|value| value.is_finite()) {
                folded.insert(expr, self.number(value));
            }
        }
        self.replace(exprs, order, folded)
    }

    /// The expressions, built again with the parts in `replaced`; `order` lists their parts, operands first.
    pub(super) fn replace(
        &mut self,
        exprs: &[ExprId],
        order: Vec<ExprId>,
        mut replaced: IdMap<ExprId>,
    ) -> Vec<ExprId> {
        for expr in order {
            if !replaced.contains_key(&expr) {
                let new = self.rebuild(expr, |operand| *replaced.get(&operand).unwrap_or(&operand));
                replaced.insert(expr, new);
            }
        }
        (exprs.iter())
            .map(|expr| *replaced.get(expr).unwrap_or(expr))
            .collect()
    }

    pub(super) fn rebuild(&mut self, expr: ExprId, operand: impl Fn(ExprId) -> ExprId) -> ExprId {
        let all = |operands: &[ExprId]| operands.iter().map(|of| operand(*of)).collect::<Vec<_>>();
        match self.node(expr).clone() {
            Node::Number(_) | Node::Symbol(_) => expr,
            Node::Sum(terms) => self.sum(&all(&terms)),
            Node::Product(factors) => self.product(&all(&factors)),
            Node::Power(base, exponent) => self.pow(operand(base), operand(exponent)),
            Node::Apply(function, argument) => self.apply(function, operand(argument)),
        }
    }

    pub(super) fn expand_region(&mut self, region: ExprId) -> ExprId {
        self.rewrite_region(region, |pool, node| pool.expand_node(node, WIDE))
    }

    pub(super) fn expand_node(&mut self, expr: ExprId, limits: Limits) -> ExprId {
        if !matches!(self.node(expr), Node::Product(_) | Node::Power(..)) {
            return expr;
        }
        let (sums, plain) = self.partition_factors(expr, |pool, factor| {
            pool.sum_power(factor)
                .filter(|(_, exponent)| *exponent >= 0)
        });
        if sums.is_empty() {
            return expr;
        }
        let plain = self.product(&plain);
        let (mut terms, mut products_left) = (vec![self.split(plain)], limits.products);
        for (sum, exponent) in sums {
            let factor = self.terms_of(sum);
            for _ in 0..exponent {
                let n_products = terms.len().saturating_mul(factor.len());
                if n_products > products_left || !self.affords(n_products) {
                    return expr;
                }
                products_left -= n_products;
                terms = self.multiply(&terms, &factor);
                if terms.len() > limits.terms {
                    return expr;
                }
            }
        }
        self.sum_of_terms(terms)
    }

    fn multiply(&mut self, a: &Terms, b: &Terms) -> Terms {
        let mut products = Vec::with_capacity(a.len() * b.len());
        for &(coefficient_a, rest_a) in a {
            for &(coefficient_b, rest_b) in b {
                let rest = self.product(&[rest_a, rest_b]);
                let (extra, rest) = self.split(rest);
                let both = coefficient_a.checked_mul(coefficient_b);
                products.push(match both.and_then(|both| both.checked_mul(extra)) {
                    Some(coefficient) => (coefficient, rest),
                    None => {
                        let [a, b, c] =
                            [coefficient_a, coefficient_b, extra].map(|n| self.constant(n));
                        (Number::ONE, self.product(&[a, b, c, rest]))
                    }
                });
            }
        }
        let sum = self.sum_of_terms(products);
        self.terms_of(sum)
    }
}
