//! From expressions to values: shared parts, and the computation of powers and functions.

use super::*;

/// Turns expressions of one pool into values of one program; an expression that occurs again is the same value.
pub(super) struct ExpressionLowering<'a> {
    pub pool: &'a ExprPool,
    pub builder: ProgramBuilder,
    values: HashMap<ExprId, ValueId>,
    angles: HashMap<ExprId, (ValueId, ValueId)>,
    variables: HashMap<SymbolId, ValueId>,
    late: HashSet<ExprId>, // wait for a function of the library or the kernel
}

impl<'a> ExpressionLowering<'a> {
    pub(crate) fn new(
        pool: &'a ExprPool,
        builder: ProgramBuilder,
        variables: HashMap<SymbolId, ValueId>,
    ) -> Self {
        Self {
            pool,
            builder,
            values: HashMap::new(),
            angles: HashMap::new(),
            variables,
            late: HashSet::new(),
        }
    }

    /// Computes all sines and cosines that occur in the expressions, as few array statements as their nesting allows.
    pub(crate) fn prepare(&mut self, roots: &[ExprId]) {
        let mut levels: BTreeMap<usize, Vec<ExprId>> = BTreeMap::new();
        let mut nesting: HashMap<ExprId, usize> = HashMap::new();
        let mut seen = HashSet::new();
        for expr in self.pool.reachable(roots) {
            let node = self.pool.node(expr);
            let inner = self.pool.children(expr).map(|child| nesting[&child]).max();
            let mut level = inner.unwrap_or(0);
            let late = match node {
                Node::Apply(Function::Sin | Function::Cos, argument) => {
                    if seen.insert(*argument) {
                        levels.entry(level).or_default().push(*argument);
                    }
                    level += 1;
                    true
                }
                Node::Apply(function, _) => {
                    Unary::by_name(function.name()).is_none_or(Unary::is_by_library)
                }
                Node::Power(_, exponent) => self.pool.as_number(*exponent).is_none(),
                Node::Number(_) | Node::Symbol(_) | Node::Sum(_) | Node::Product(_) => false,
            };
            let waits = |child: ExprId| self.late.contains(&child);
            if late || self.pool.children(expr).any(waits) {
                self.late.insert(expr);
            }
            nesting.insert(expr, level);
        }
        for arguments in levels.into_values() {
            self.sines_and_cosines(&arguments);
        }
    }

    /// Computes the sines and cosines that are still missing, in one statement.
    pub(crate) fn sines_and_cosines(&mut self, arguments: &[ExprId]) {
        let mut missing = arguments.to_vec();
        missing.retain(|argument| !self.angles.contains_key(argument));
        if missing.is_empty() {
            return;
        }
        let arguments = missing.into_iter();
        let mut arguments: Vec<(ExprId, ValueId)> = arguments
            .map(|argument| (argument, self.value(argument)))
            .collect();
        // Arguments in the order of the inputs can be read in place by generated loops.
        arguments.sort_by_key(|&(_, value)| value);
        let values: Vec<ValueId> = arguments.iter().map(|&(_, value)| value).collect();
        let (sines, cosines) = self.builder.sin_cos(&values);
        for ((argument, _), pair) in arguments.into_iter().zip(sines.into_iter().zip(cosines)) {
            self.angles.insert(argument, pair);
        }
    }

    pub(crate) fn value(&mut self, expr: ExprId) -> ValueId {
        if let Some(&value) = self.values.get(&expr) {
            return value;
        }
        let pool = self.pool;
        let value = match pool.node(expr) {
            Node::Number(number) => self.builder.constant(number.to_f64()),
            Node::Symbol(symbol) => match pool.selection(*symbol) {
                Some(parts) => {
                    let [test, zero, other] = parts.map(|part| self.value(part));
                    self.builder.select(test, zero, other)
                }
                // Every variable of a model's pool is an input.
                None => self.variables[symbol],
            },
            Node::Sum(_) => {
                let combination = Combination::collect(pool, [(1.0, expr)]);
                self.combination(&combination)
            }
            Node::Product(_) => self.product(expr),
            Node::Power(base, exponent) => self.power(*base, *exponent),
            Node::Apply(function, argument) => self.apply(*function, *argument),
        };
        self.values.insert(expr, value);
        value
    }

    pub(crate) fn combination(&mut self, combination: &Combination) -> ValueId {
        let terms = self.terms(combination);
        linear_combination(&mut self.builder, combination.constant, &terms)
    }

    fn terms(&mut self, combination: &Combination) -> Vec<Term> {
        let term = |&(coefficient, expr): &(f64, ExprId)| Term {
            coefficient,
            value: self.value(expr),
            late: self.late.contains(&expr),
        };
        combination.items.iter().map(term).collect()
    }

    /// The value of a nested sum and of each group's `single` part; `shared` is the part that is known already.
    pub(crate) fn nested(
        &mut self,
        nested: &Nested,
        shared: Option<ValueId>,
    ) -> (ValueId, Vec<ValueId>) {
        let mut terms = self.terms(&nested.flat);
        terms.extend(shared.map(|value| Term {
            coefficient: 1.0,
            value,
            late: false,
        }));
        let mut singles = Vec::new();
        for group in &nested.groups {
            let single = self.combination(&group.single);
            let inner = match (group.single.is_zero(), group.repeated.is_zero()) {
                (_, true) => single,
                (true, false) => self.combination(&group.repeated),
                (false, false) => {
                    let repeated = self.combination(&group.repeated);
                    self.builder.add(single, repeated)
                }
            };
            let factor = self.value(group.factor);
            let parts = [&group.single, &group.repeated];
            let items = parts.into_iter().flat_map(|sum| &sum.items);
            let mut exprs = items.map(|(_, expr)| expr).chain([&group.factor]);
            terms.push(Term {
                coefficient: 1.0,
                value: self.builder.mul(factor, inner),
                late: exprs.any(|expr| self.late.contains(expr)),
            });
            singles.push(single);
        }
        let sum = linear_combination(&mut self.builder, nested.flat.constant, &terms);
        (sum, singles)
    }

    /// Factors with negative exponents form one divisor; canonical order lets monomials share their beginnings.
    fn product(&mut self, expr: ExprId) -> ValueId {
        let pool = self.pool;
        let (number, rest) = pool.split(expr);
        if number.to_f64() != 1.0 {
            let value = self.value(rest);
            return scaled(&mut self.builder, number.to_f64(), value);
        }
        let (mut over, mut under): (Option<ValueId>, Option<ValueId>) = (None, None);
        for &factor in pool.factors_of(expr) {
            let (side, value) = match reciprocal_power(pool, factor) {
                Some((base, exponent)) => {
                    let base = self.value(base);
                    (&mut under, self.integer_power(base, exponent))
                }
                None => (&mut over, self.value(factor)),
            };
            *side = Some(match *side {
                None => value,
                Some(product) => self.builder.mul(product, value),
            });
        }
        self.quotient(over, under)
    }

    fn quotient(&mut self, over: Option<ValueId>, under: Option<ValueId>) -> ValueId {
        let over = over.unwrap_or_else(|| self.builder.constant(1.0));
        match under {
            None => over,
            Some(under) => self.builder.div(over, under),
        }
    }

    fn power(&mut self, base: ExprId, exponent: ExprId) -> ValueId {
        let integer = self.pool.as_integer(exponent);
        match integer.map(|exponent| (exponent, u32::try_from(exponent.unsigned_abs()))) {
            Some((exponent, Ok(magnitude))) => {
                let base = self.value(base);
                let power = self.integer_power(base, magnitude);
                match exponent >= 0 {
                    true => power,
                    false => self.quotient(None, Some(power)),
                }
            }
            _ => {
                let (base, exponent) = (self.value(base), self.value(exponent));
                self.builder.binary(Binary::Pow, base, exponent)
            }
        }
    }

    /// A chain of squarings and products; not `pow`, whose rounding differs by platform.
    fn integer_power(&mut self, base: ValueId, exponent: u32) -> ValueId {
        match exponent {
            0 => self.builder.constant(1.0),
            1 => base,
            _ => {
                let half = self.integer_power(base, exponent / 2);
                let square = self.builder.mul(half, half);
                match exponent % 2 {
                    0 => square,
                    _ => self.builder.mul(square, base),
                }
            }
        }
    }

    fn apply(&mut self, function: Function, argument: ExprId) -> ValueId {
        match (function, Unary::by_name(function.name())) {
            (Function::Sin, _) => self.angle(argument).0,
            (_, None) => self.angle(argument).1,
            (_, Some(op)) => {
                let argument = self.value(argument);
                self.builder.unary(op, argument)
            }
        }
    }

    pub(crate) fn angle(&mut self, argument: ExprId) -> (ValueId, ValueId) {
        self.sines_and_cosines(&[argument]);
        self.angles[&argument]
    }
}

/// `base^-n` as `(base, n)`.
fn reciprocal_power(pool: &ExprPool, factor: ExprId) -> Option<(ExprId, u32)> {
    let Node::Power(base, exponent) = pool.node(factor) else {
        return None;
    };
    let exponent = pool.as_integer(*exponent)?;
    let magnitude = u32::try_from(exponent.checked_neg()?).ok()?;
    Some((*base, magnitude))
}
