//! Identities of the factors of a product: a table for two factors, and common factors of magnitudes and signs.

use super::*;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// On the way to the normal form.
    Normal,
    /// Towards fewer calls, before and after magnitudes are put together.
    Angles,
    Signs,
}

/// Left and right sides for all `a`. A factor matches to any power of the same sign, a sum to that power alone.
const IDENTITIES: [(Stage, &str, &str); 14] = [
    (Stage::Normal, "sign(a)*abs(a)", "a"),
    (Stage::Normal, "sign(a)*a", "abs(a)"),
    (Stage::Normal, "sign(a)^3", "sign(a)"),
    (Stage::Normal, "abs(a)^3", "abs(a)*a^2"),
    (Stage::Normal, "1/abs(a)", "abs(a)/a^2"),
    (Stage::Angles, "sin(a)/cos(a)", "tan(a)"),
    (Stage::Angles, "cos(a)/sin(a)", "1/tan(a)"),
    (Stage::Angles, "tan(a)/(1 - tan(a)^2)", "tan(2*a)/2"),
    (Stage::Angles, "tanh(a)/(1 + tanh(a)^2)", "tanh(2*a)/2"),
    (Stage::Angles, "sin(a)/(1 + cos(a))", "tan(a/2)"),
    (Stage::Angles, "sin(a)/(1 - cos(a))", "1/tan(a/2)"),
    (Stage::Angles, "(1 + cos(a))/sin(a)", "1/tan(a/2)"),
    (Stage::Angles, "(1 - cos(a))/sin(a)", "tan(a/2)"),
    (Stage::Signs, "abs(a)/a", "sign(a)"),
];

/// A line of the table in the expressions of a pool.
#[derive(Debug)]
pub(super) struct Identity {
    stage: Stage,
    variable: SymbolId,
    left: ExprId,
    factors: Vec<Power>,
    right: ExprId,
}

/// Base and exponent.
type Power = (ExprId, i64);

impl Identity {
    /// The value of the variable for a product of these factors, and how often the left side is part of it.
    fn find(
        &self,
        pool: &ExprPool,
        wanted: &[Power],
        factors: &[Power],
        bound: Option<ExprId>,
    ) -> Option<(ExprId, i64)> {
        let Some((&(pattern, power), rest)) = wanted.split_first() else {
            return Some((bound?, i64::MAX));
        };
        factors.iter().find_map(|&(base, found)| {
            let mut bound = bound;
            let (count, is_whole) = match pool.node(pattern) {
                Node::Sum(_) => (1, found == power),
                _ => (found / power, found / power > 0),
            };
            if !is_whole || !pool.binds(pattern, base, self.variable, &mut bound) {
                return None;
            }
            let (value, others) = self.find(pool, rest, factors, bound)?;
            // Even powers of magnitudes are no magnitudes.
            let count = if power.abs() == 1 { count } else { 1 };
            Some((value, count.min(others)))
        })
    }
}

impl ExprPool {
    fn identities(&mut self) -> Arc<[Identity]> {
        if let Some(known) = &self.identities {
            return known.clone();
        }
        let variable = self.symbol_id("a");
        let identities = IDENTITIES.map(|(stage, left, right)| {
            let [left, right] = [left, right].map(|text| {
                self.parse(text, &|name| name == "a")
                    .expect("the table's expressions parse")
            });
            let factors = self.factors_of(left).iter();
            Identity {
                stage,
                variable,
                left,
                factors: factors.filter_map(|f| self.integer_power(*f)).collect(),
                right,
            }
        });
        let identities: Arc<[Identity]> = identities.into();
        self.identities = Some(identities.clone());
        identities
    }

    /// A product with the left sides of all identities of a stage replaced by the right ones.
    pub(super) fn merge_factors(&mut self, stage: Stage, expr: ExprId) -> ExprId {
        let mut product = expr;
        for identity in self.identities().iter().filter(|i| i.stage == stage) {
            loop {
                let factors = self.factors_of(product).iter();
                let factors: Vec<Power> = factors.filter_map(|f| self.integer_power(*f)).collect();
                let found = identity.find(self, &identity.factors, &factors, None);
                let Some((value, count)) = found else { break };
                let sides = [(identity.left, -count), (identity.right, count)];
                let [before, after] = sides.map(|(side, power)| {
                    let side = self.substitute(side, &[(identity.variable, value)]);
                    self.pow_number(side, Number::integer(power))
                });
                product = self.product(&[product, before, after]);
            }
        }
        product
    }

    /// Whether an expression is a pattern with some value of its variable.
    fn binds(
        &self,
        pattern: ExprId,
        expr: ExprId,
        variable: SymbolId,
        bound: &mut Option<ExprId>,
    ) -> bool {
        let mut all = |patterns: &[ExprId], exprs: &[ExprId]| {
            let mut pairs = patterns.iter().zip(exprs);
            patterns.len() == exprs.len() && pairs.all(|(p, e)| self.binds(*p, *e, variable, bound))
        };
        match (self.node(pattern), self.node(expr)) {
            (Node::Symbol(symbol), _) if *symbol == variable => *bound.get_or_insert(expr) == expr,
            (Node::Apply(f, x), Node::Apply(g, y)) => f == g && all(&[*x], &[*y]),
            (Node::Power(x, m), Node::Power(y, n)) => m == n && all(&[*x], &[*y]),
            (Node::Sum(x), Node::Sum(y)) | (Node::Product(x), Node::Product(y)) => all(x, y),
            _ => pattern == expr,
        }
    }

    /// `abs(a*b) = abs(a)*abs(b)`.
    pub(super) fn split_abs(&mut self, argument: ExprId) -> Option<ExprId> {
        if !matches!(self.node(argument), Node::Product(_) | Node::Power(..)) {
            return None;
        }
        let factors = self.factors_of(argument).to_vec();
        let mut parts = Vec::with_capacity(factors.len());
        for factor in factors {
            parts.push(match self.integer_power(factor) {
                Some((base, power)) => self.apply_power(Function::Abs, base, power),
                None => self.apply(Function::Abs, factor),
            });
        }
        let product = self.product(&parts);
        let whole = self.intern(Node::Apply(Function::Abs, argument));
        (product != whole).then_some(product)
    }

    /// `f(a)*f(b) = f(a*b)`, for magnitudes and signs.
    pub(super) fn merge_calls(&mut self, function: Function, expr: ExprId) -> ExprId {
        let (inside, mut outside) =
            self.partition_factors(expr, |pool, factor| match pool.function_power(factor) {
                Some((of_factor, argument, 1)) if of_factor == function => Some(argument),
                _ => None,
            });
        if inside.len() < 2 {
            return expr;
        }
        let product = self.product(&inside);
        outside.push(self.apply(function, product));
        self.product(&outside)
    }
}
