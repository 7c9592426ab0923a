//! Derivatives that have values wherever the function has slopes. The rules give `g'/(2 sqrt(g))` for a root, which is
//! `0/0` where `g` and `g'` vanish. The slope of an expression is the derivative, where it exists. Otherwise it is the
//! limit of slopes from above, or from below if there are no values above; it may be infinite. A jump itself adds
//! nothing. Selections decide at run time: the derivative by the rules where no argument of a root, magnitude, sign or
//! power is zero, otherwise a slope from series (see `germ.rs`). If that needs too many cases, a difference of values
//! replaces a derivative that is not a number.

use super::*;

/// Most cases of one slope; those that are not decided have the derivative by the rules, or a difference.
const MOST_CASES: usize = 256;
/// Work on one slope, counted in constructors, after which its remaining cases are left undecided.
const MOST_WORK: u64 = 300_000;
/// The step of differences, a compromise of both precisions.
const STEP: f64 = 1.0 / 8192.0;

#[derive(Clone, Copy, Debug)]
pub(super) struct Slope {
    expr: ExprId,
    has_infinity: bool,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Facts {
    first_zero: Option<ExprId>,
    zero: Vec<ExprId>,
    nonzero: Vec<ExprId>,
    /// Symbols that equal a number or another symbol.
    values: Vec<(SymbolId, ExprId)>,
}

impl Facts {
    pub(crate) fn at(&self, pool: &mut ExprPool, expr: ExprId) -> ExprId {
        pool.substitute(expr, &self.values)
    }

    /// Whether an expression is zero; a product, factor by factor.
    pub(crate) fn is_zero(&self, pool: &mut ExprPool, expr: ExprId) -> Result<bool, Stop> {
        let expr = self.at(pool, expr);
        let mut undecided = None;
        for factor in pool.factors_of(expr).to_vec() {
            match self.known(pool, factor) {
                Some(true) => return Ok(true),
                Some(false) => {}
                None => undecided = undecided.or(Some(factor)),
            }
        }
        match undecided {
            None => Ok(false),
            Some(test) => Err(Stop::Undecided(self.simplest(pool, test))),
        }
    }

    /// A symbol that makes the test zero by being zero, or the test: facts about symbols hold in all expressions.
    fn simplest(&self, pool: &mut ExprPool, test: ExprId) -> ExprId {
        for symbol in pool.symbols_of(test) {
            let variable = pool.symbol_expr(symbol);
            if !self.nonzero.contains(&variable)
                && core(pool, test) != variable
                && pool.substitute(test, &[(symbol, ExprId::ZERO)]) == ExprId::ZERO
            {
                return variable;
            }
        }
        test
    }

    pub(crate) fn is_positive(&self, pool: &mut ExprPool, expr: ExprId) -> Result<bool, Stop> {
        let expr = self.at(pool, expr);
        if pool.is_constant(expr) {
            return Ok(pool.evaluate(expr, &|_| f64::NAN) > 0.0);
        }
        if pool.sign(expr) != Sign::Any {
            return Ok(true);
        }
        let (content, rest) = pool.content(expr);
        let sign = pool.apply(Function::Sign, rest);
        let below = pool.sub(sign, ExprId::ONE);
        Ok(self.is_zero(pool, below)? != content.is_negative())
    }

    pub(crate) fn known(&self, pool: &mut ExprPool, expr: ExprId) -> Option<bool> {
        let core = core(pool, expr);
        if pool.is_constant(core) {
            return Some(pool.evaluate(core, &|_| f64::NAN) == 0.0);
        }
        if self.zero.contains(&core) {
            return Some(true);
        }
        let is_nonzero = |pool: &mut ExprPool, expr: ExprId| {
            let core = self::core(pool, expr);
            pool.sign(core) == Sign::Positive || self.nonzero.contains(&core)
        };
        let is_other = match pool.node(core).clone() {
            Node::Sum(terms) => {
                let is_signed = |term: &ExprId| pool.sign(*term) != Sign::Any;
                terms.iter().all(is_signed) && terms.iter().any(|term| is_nonzero(pool, *term))
            }
            Node::Power(base, exponent) => {
                pool.as_number(exponent).is_some() || is_nonzero(pool, base)
            }
            Node::Product(factors) => {
                let known: Vec<_> = factors.iter().map(|f| self.known(pool, *f)).collect();
                if known.contains(&Some(true)) {
                    return Some(true);
                }
                known.iter().all(|known| *known == Some(false))
            }
            _ => false,
        };
        (is_other || is_nonzero(pool, core)).then_some(false)
    }

    fn with(&self, pool: &mut ExprPool, test: ExprId, is_zero: bool) -> Facts {
        let mut facts = self.clone();
        if !is_zero {
            facts.nonzero.push(core(pool, test));
            return facts;
        }
        facts.first_zero.get_or_insert(test);
        let mut pending = vec![test];
        while let Some(expr) = pending.pop() {
            let expr = core(pool, expr);
            facts.zero.push(expr);
            if let Node::Sum(terms) = pool.node(expr).clone()
                && terms.iter().all(|term| pool.sign(*term) != Sign::Any)
            {
                pending.extend(terms.iter());
            }
            if let Some((symbol, value)) = value_of_symbol(pool, expr) {
                facts.set(pool, symbol, value);
            }
        }
        facts
    }

    fn set(&mut self, pool: &mut ExprPool, symbol: SymbolId, value: ExprId) {
        let value = self.at(pool, value);
        let lists = [&mut self.zero, &mut self.nonzero];
        for expr in lists.into_iter().flatten() {
            let known = pool.substitute(*expr, &[(symbol, value)]);
            *expr = core(pool, known);
        }
        for (_, known) in &mut self.values {
            *known = pool.substitute(*known, &[(symbol, value)]);
        }
        self.values.push((symbol, value));
    }
}

/// An expression with the same zeros as `expr`, in floats: no multiple of pi but zero is a float.
fn core(pool: &mut ExprPool, expr: ExprId) -> ExprId {
    if pool.as_number(expr).is_some() {
        return expr;
    }
    let mut core = pool.content(expr).1;
    loop {
        core = match *pool.node(core) {
            Node::Power(base, exponent) if pool.sign(exponent) == Sign::Positive => base,
            Node::Apply(function, inner) if function.vanishes_at_zero() => inner,
            _ => return core,
        };
        core = pool.content(core).1;
    }
}

/// The value that a symbol has where an expression is zero: of `x`, `x - 1` and `x - y`.
fn value_of_symbol(pool: &mut ExprPool, expr: ExprId) -> Option<(SymbolId, ExprId)> {
    if let Some(symbol) = pool.as_symbol(expr) {
        return Some((symbol, ExprId::ZERO));
    }
    let [(a, first), (b, second)] = pool.terms_of(expr)[..] else {
        return None;
    };
    let symbol = pool.as_symbol(second)?;
    let quotient = (-a).checked_div(b)?;
    let is_exact = match pool.as_symbol(first) {
        Some(_) => quotient.abs().is_one(),
        None => first == ExprId::ONE && Number::from_f64(quotient.to_f64())? == quotient,
    };
    is_exact.then(|| (symbol, pool.scale(quotient, first)))
}

/// Behaviour of the values next to a point.
enum Outcome {
    Regular,
    Finite(ExprId),
    /// An infinity with the sign of an expression.
    Infinite(ExprId),
    Open,
}

impl ExprPool {
    /// The slope of `expr` by `symbol` (see the module): to be evaluated, not to be differentiated or rewritten.
    pub fn slope(&mut self, expr: ExprId, symbol: SymbolId) -> ExprId {
        self.full_slope(expr, symbol).expr
    }

    /// Whether the slope of `expr` may be infinite where `expr` has a value, by an argument that is zero.
    pub fn may_be_steep(&mut self, expr: ExprId, symbol: SymbolId) -> bool {
        self.full_slope(expr, symbol).has_infinity
    }

    fn full_slope(&mut self, expr: ExprId, symbol: SymbolId) -> Slope {
        if let Some(&known) = self.slopes.get(&(expr, symbol)) {
            return known;
        }
        let wanted = |node| self.may_contain(node, symbol);
        let nodes = self.walk(&[expr], wanted, |_| true);
        // Whether a node is not smooth where an operand is zero.
        let has_kink = |node: ExprId| match self.node(node) {
            Node::Power(_, exponent) => !matches!(self.as_integer(*exponent), Some(0..)),
            Node::Apply(Function::Abs | Function::Sign | Function::Sqrt, _) => true,
            _ => false,
        };
        let slope = match nodes.into_iter().any(has_kink) {
            true => self.limited(MOST_WORK, |pool| pool.selected(expr, symbol)),
            false => Slope {
                expr: self.derivative(expr, symbol),
                has_infinity: false,
            },
        };
        self.slopes.insert((expr, symbol), slope);
        slope
    }

    /// The slope at all points: undecided tests split the cases, the first test first.
    fn selected(&mut self, expr: ExprId, symbol: SymbolId) -> Slope {
        let mut cases = vec![Facts::default()];
        // Of each case its test and the first of its two parts, or its outcome.
        let mut known: Vec<Result<Outcome, (ExprId, usize)>> = Vec::new();
        while let Some(facts) = cases.get(known.len()).cloned() {
            let first_part = cases.len();
            known.push(match self.outcome(expr, symbol, &facts) {
                Err(test) if first_part < MOST_CASES && self.affords(1) => {
                    let parts = [true, false].map(|is_zero| facts.with(self, test, is_zero));
                    cases.extend(parts);
                    Err((test, first_part))
                }
                outcome => Ok(outcome.unwrap_or(Outcome::Open)),
            });
        }
        let mut slopes: Vec<Slope> = Vec::new();
        for (facts, known) in cases.iter().zip(known).rev() {
            slopes.push(match known {
                Ok(outcome) => self.slope_of_case(expr, symbol, facts, outcome),
                Err((test, first_part)) => {
                    // Slopes are in the reverse order of cases.
                    let part = |position: usize| slopes[cases.len() - 1 - position];
                    let (zero, other) = (part(first_part), part(first_part + 1));
                    Slope {
                        expr: self.select(test, zero.expr, other.expr),
                        has_infinity: zero.has_infinity || other.has_infinity,
                    }
                }
            });
        }
        slopes[cases.len() - 1]
    }

    fn slope_of_case(
        &mut self,
        expr: ExprId,
        symbol: SymbolId,
        facts: &Facts,
        outcome: Outcome,
    ) -> Slope {
        let regular = self.derivative(expr, symbol);
        let has_infinity = matches!(outcome, Outcome::Infinite(_));
        let expr = match (outcome, facts.first_zero) {
            (Outcome::Finite(slope), _) if self.is_reached(regular, slope, facts) => regular,
            (Outcome::Finite(slope), _) => slope,
            (Outcome::Infinite(sign), Some(zero)) => {
                let magnitude = self.apply(Function::Abs, zero);
                self.div(sign, magnitude)
            }
            (Outcome::Open, _) => self.guarded(expr, symbol, regular),
            (Outcome::Regular | Outcome::Infinite(_), _) => regular,
        };
        Slope { expr, has_infinity }
    }

    /// The derivative by the rules; where that is not a number, the difference to the value a step above.
    fn guarded(&mut self, expr: ExprId, symbol: SymbolId, regular: ExprId) -> ExprId {
        let (variable, step) = (self.symbol_expr(symbol), self.number(STEP));
        let above = self.add(variable, step);
        let above = self.substitute(expr, &[(symbol, above)]);
        let rise = self.sub(above, expr);
        let difference = self.div(rise, step);
        // The sign of a number is the cube of itself.
        let sign = self.apply(Function::Sign, regular);
        let cube = self.powi(sign, 3);
        let is_number = self.sub(cube, sign);
        self.select(is_number, regular, difference)
    }

    /// Whether a constant part has no value, or an infinite one: neither has the whole, and not all targets run it.
    fn has_pole(&self, expr: ExprId) -> bool {
        (self.reachable(&[expr]).into_iter())
            .any(|part| self.is_constant(part) && !self.evaluate(part, &|_| f64::NAN).is_finite())
    }

    /// Whether the derivative by the rules has the slope's value in the numbers of a computer, without `0*inf`.
    fn is_reached(&mut self, regular: ExprId, slope: ExprId, facts: &Facts) -> bool {
        let is_by_values = facts.zero.iter().all(|zero| *zero == ExprId::ZERO);
        if !is_by_values || facts.at(self, regular) != slope {
            return false;
        }
        // No divisor may vanish at other points of the case.
        for node in self.reachable(&[regular]) {
            let base = match *self.node(node) {
                Node::Power(_, exponent) if matches!(self.as_integer(exponent), Some(0..)) => {
                    continue;
                }
                Node::Power(base, _) | Node::Apply(Function::Log, base) => facts.at(self, base),
                _ => continue,
            };
            if facts.known(self, base) != Some(false) {
                return false;
            }
        }
        true
    }

    fn outcome(
        &mut self,
        expr: ExprId,
        symbol: SymbolId,
        facts: &Facts,
    ) -> Result<Outcome, ExprId> {
        for side in [Number::ONE, Number::MINUS_ONE] {
            let mut order = 2;
            let stop = loop {
                let mut germs = Germs {
                    pool: self,
                    facts,
                    symbol,
                    side,
                    order,
                    known: IdMap::default(),
                };
                match germs.slope(expr) {
                    Ok(Outcome::Finite(slope) | Outcome::Infinite(slope))
                        if self.has_pole(slope) =>
                    {
                        return Ok(Outcome::Regular);
                    }
                    Ok(outcome) => return Ok(outcome),
                    Err(Stop::Order) if order < LAST_ORDER && self.affords(1) => order *= 2,
                    Err(stop) => break stop,
                }
            };
            match stop {
                Stop::Undecided(test) => return Err(test),
                Stop::Undefined => {}
                Stop::Order => return Ok(Outcome::Open),
                Stop::Unknown => return Ok(Outcome::Regular),
            }
        }
        // An isolated point.
        Ok(Outcome::Finite(ExprId::ZERO))
    }

    /// `zero` where `test` is zero, else `other` (also for NaN), behind a symbol that only values look into.
    fn select(&mut self, test: ExprId, zero: ExprId, other: ExprId) -> ExprId {
        if zero == other {
            return zero;
        }
        let parts = [test, zero, other];
        let name = format!("selection {:?}", parts.map(ExprId::index));
        let id = self.symbol_for(&name, Some(parts), None);
        self.symbol_expr(id)
    }
}

impl Germs<'_> {
    fn slope(&mut self, expr: ExprId) -> Result<Outcome, Stop> {
        let Some(mut series) = self.of(expr)? else {
            return Ok(Outcome::Regular);
        };
        if series.has_pole(self.pool) {
            return Ok(Outcome::Regular);
        }
        series.keep_up_to_one(self.pool);
        while !series.is_zero() {
            if let Some(coefficient) = self.linear(&series)? {
                return Ok(Outcome::Finite(self.pool.scale(self.side, coefficient)));
            }
            let Some((exponent, coefficient)) = self.lead(&mut series)? else {
                break;
            };
            let coefficient = self.pool.scale(self.side, coefficient);
            match self.compare(exponent, ExprId::ONE)? {
                Ordering::Greater => break,
                Ordering::Equal => return Ok(Outcome::Finite(coefficient)),
                Ordering::Less => {}
            }
            match self.compare(exponent, ExprId::ZERO)? {
                Ordering::Greater => {
                    let sign = self.pool.apply(Function::Sign, coefficient);
                    return Ok(Outcome::Infinite(sign));
                }
                Ordering::Equal => {}
                Ordering::Less => return Ok(Outcome::Regular),
            }
        }
        Ok(Outcome::Finite(ExprId::ZERO))
    }
}
