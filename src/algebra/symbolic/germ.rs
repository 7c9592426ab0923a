//! Series of expressions beside a point, where roots, magnitudes and signs may have kinks.
//!
//! With one variable at `p + t` or `p - t`, an expression is a sum of terms `c t^r` for small positive `t`, with
//! coefficients that are expressions at the point and real exponents: `sqrt(abs(x))*sin(x)` at `x = 0` is
//! `t^(3/2) - ...`. Arithmetic with such series (Puiseux's, with any exponents) gives the slope where the rules
//! of differentiation end in `0/0` or `0*inf`. Expressions that are smooth at the point have Taylor series.

use std::cmp::Ordering;

use super::id_map::IdMap;
use super::node::{ExprId, Function, Node, SymbolId};
use super::number::Number;
use super::pool::ExprPool;
use super::slope::Facts;

/// Differences of exponents that count as zero: 0.1 + 0.9 and 1 are the same.
const SAME_EXPONENT: f64 = 1e-12;
/// Coefficients from this exponent on are taken not to vanish by chance with all before them.
const RARE: f64 = 3.0;
/// Most terms of a composition; the rest is left open.
const MOST_TERMS: i64 = 24;
/// Largest exponent up to which series are computed.
pub(super) const LAST_ORDER: i64 = 8;

/// Why a series ends.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stop {
    /// It depends on whether this expression is zero.
    Undecided(ExprId),
    /// More terms are needed.
    Order,
    /// The expression has no values on this side of the point.
    Undefined,
    /// It is no sum of powers, or it has no finite value.
    Unknown,
}

/// `sum coefficient t^exponent`, and what is left out: terms from the exponents of `rest` on.
#[derive(Clone, Debug, Default)]
pub(super) struct Series {
    /// Exponent and coefficient; exponents are distinct as expressions.
    pub terms: Vec<(ExprId, ExprId)>,
    rest: Vec<ExprId>,
}

impl Series {
    fn constant(value: ExprId) -> Series {
        Series {
            terms: vec![(ExprId::ZERO, value)],
            rest: Vec::new(),
        }
    }

    /// Whether there is neither a term nor a rest.
    pub fn is_zero(&self) -> bool {
        self.terms.is_empty() && self.rest.is_empty()
    }

    /// Whether a term grows without bound.
    pub fn has_pole(&self, pool: &ExprPool) -> bool {
        let number = |exponent| pool.as_number(exponent).is_some_and(Number::is_negative);
        self.terms.iter().any(|&(exponent, _)| number(exponent))
    }

    /// Leaves out the value at the point, and what is smaller than `t`.
    pub fn keep_up_to_one(&mut self, pool: &ExprPool) {
        let number = |exponent| pool.as_number(exponent).map(Number::to_f64);
        let is_small = |exponent| number(exponent).is_some_and(|n| n > 1.0 + SAME_EXPONENT);
        (self.terms).retain(|&(exponent, _)| exponent != ExprId::ZERO && !is_small(exponent));
        for (exponent, _) in &mut self.terms {
            let difference = number(*exponent).map(|n| n - 1.0);
            if difference.is_some_and(|d| d.abs() <= SAME_EXPONENT) {
                *exponent = ExprId::ONE;
            }
        }
        self.rest.retain(|&exponent| !is_small(exponent));
    }
}

/// What an expression is at the point.
enum Germ {
    /// It has all derivatives.
    Smooth,
    Series(Series),
}

/// Series of expressions by one variable, on one side of a point of which some facts are known.
pub(super) struct Germs<'a> {
    pub pool: &'a mut ExprPool,
    pub facts: &'a Facts,
    pub symbol: SymbolId,
    /// 1 or -1.
    pub side: Number,
    /// Exponent from which on terms are left out.
    pub order: i64,
    known: IdMap<Germ>,
}

impl<'a> Germs<'a> {
    pub fn new(
        pool: &'a mut ExprPool,
        facts: &'a Facts,
        symbol: SymbolId,
        side: Number,
        order: i64,
    ) -> Self {
        Self {
            pool,
            facts,
            symbol,
            side,
            order,
            known: IdMap::default(),
        }
    }

    /// The series of an expression; nothing if it is smooth.
    pub fn of(&mut self, root: ExprId) -> Result<Option<Series>, Stop> {
        let symbol = self.symbol;
        let wanted = |node| self.pool.may_contain(node, symbol);
        for node in self.pool.walk(&[root], wanted, |_| true) {
            let germ = match self.germ_of_node(node)? {
                Some(series) => Germ::Series(self.cut(series)),
                None => Germ::Smooth,
            };
            self.known.insert(node, germ);
        }
        Ok(match self.is_smooth(root) {
            true => None,
            false => Some(self.series(root)),
        })
    }

    fn germ_of_node(&mut self, expr: ExprId) -> Result<Option<Series>, Stop> {
        let node = self.pool.node(expr).clone();
        let operands: Vec<ExprId> = node.operands().collect();
        let is_smooth = operands.iter().all(|operand| self.is_smooth(*operand));
        match node {
            Node::Number(_) | Node::Symbol(_) => Ok(None),
            Node::Sum(_) | Node::Product(_) if is_smooth => Ok(None),
            Node::Sum(terms) => {
                let mut sum = Series::default();
                for term in terms {
                    let series = self.series(term);
                    sum = self.plus(sum, series);
                }
                Ok(Some(sum))
            }
            Node::Product(factors) => {
                let factors = factors.iter().map(|factor| self.series(*factor));
                let factors: Vec<Series> = factors.collect();
                // A pole beside a zero has no value: 0*inf.
                let vanishes = |series: &Series| {
                    let mut exponents = series.terms.iter().map(|term| term.0);
                    !series.has_pole(self.pool) && !exponents.any(|e| e == ExprId::ZERO)
                };
                let has_pole = factors.iter().any(|series| series.has_pole(self.pool));
                if has_pole && factors.iter().any(vanishes) {
                    return Err(Stop::Unknown);
                }
                let mut product = Series::constant(ExprId::ONE);
                for series in &factors {
                    product = self.times(&product, series);
                }
                Ok(Some(product))
            }
            Node::Power(base, exponent) if self.pool.may_contain(exponent, self.symbol) => {
                self.varying_power(base, exponent, is_smooth)
            }
            Node::Power(base, exponent) => match self.pool.as_integer(exponent) {
                Some(0..) if is_smooth => Ok(None),
                _ if is_smooth && !self.vanishes(base)? => Ok(None),
                _ => {
                    let (base, exponent) = (self.series(base), self.facts.at(self.pool, exponent));
                    self.power(base, exponent).map(Some)
                }
            },
            Node::Apply(function, argument) => match function {
                Function::Abs | Function::Sign | Function::Sqrt | Function::Log => {
                    if is_smooth && !self.vanishes(argument)? {
                        return Ok(None);
                    }
                    let argument = self.series(argument);
                    self.kinked(function, argument).map(Some)
                }
                _ if is_smooth => Ok(None),
                _ => {
                    let argument = self.series(argument);
                    self.smooth_of(function, argument).map(Some)
                }
            },
        }
    }

    fn is_smooth(&self, expr: ExprId) -> bool {
        !matches!(self.known.get(&expr), Some(Germ::Series(_)))
    }

    fn vanishes(&mut self, expr: ExprId) -> Result<bool, Stop> {
        self.facts.is_zero(self.pool, expr)
    }

    fn series(&mut self, expr: ExprId) -> Series {
        match self.known.get(&expr) {
            Some(Germ::Series(series)) => series.clone(),
            _ => self.taylor(expr),
        }
    }

    /// The Taylor series of a smooth expression.
    fn taylor(&mut self, expr: ExprId) -> Series {
        let mut series = Series::default();
        let (mut derivative, mut factor) = (expr, Some(Number::ONE));
        for order in 0..self.order {
            if order > 0 {
                factor = factor
                    .and_then(|f| f.checked_mul(self.side))
                    .and_then(|f| f.checked_div(Number::integer(order)));
            }
            let coefficient = self.facts.at(self.pool, derivative);
            let coefficient = self.pool.scale(factor.unwrap_or(Number::ZERO), coefficient);
            if self.facts.known(self.pool, coefficient) != Some(true) {
                let exponent = self.pool.integer(order);
                series.terms.push((exponent, coefficient));
            }
            derivative = self.pool.derivative(derivative, self.symbol);
            if derivative == ExprId::ZERO {
                return series;
            }
        }
        series.rest.push(self.pool.integer(self.order));
        series
    }

    fn number_of(&self, exponent: ExprId) -> Option<f64> {
        self.pool.as_number(exponent).map(Number::to_f64)
    }

    /// Adds a term, together with one of the same exponent.
    fn push(&mut self, series: &mut Series, (exponent, coefficient): (ExprId, ExprId)) {
        let value = self.number_of(exponent);
        let is_same = |&(other, _): &(ExprId, ExprId)| {
            let difference = value.zip(self.number_of(other)).map(|(a, b)| a - b);
            exponent == other || difference.is_some_and(|d| d.abs() < SAME_EXPONENT)
        };
        match series.terms.iter().position(is_same) {
            Some(at) => {
                let sum = self.pool.add(series.terms[at].1, coefficient);
                match sum {
                    ExprId::ZERO => drop(series.terms.remove(at)),
                    _ => series.terms[at].1 = sum,
                }
            }
            None if coefficient == ExprId::ZERO => {}
            None => series.terms.push((exponent, coefficient)),
        }
    }

    /// Without terms from the order on, counted from zero or, of exponents that vary with the point, from the least of
    /// those that differ by numbers; of what is left out the first terms.
    fn cut(&mut self, mut series: Series) -> Series {
        let exponents: Vec<ExprId> = series.terms.iter().map(|term| term.0).collect();
        let order = self.pool.constant(Number::integer(self.order));
        let mut ends = vec![order];
        for &first in &exponents {
            if self.number_of(first).is_some() {
                continue;
            }
            let mut is_later =
                |&other: &ExprId| self.difference(first, other).is_some_and(|d| d > 0.0);
            if !exponents.iter().any(&mut is_later) {
                ends.push(self.pool.add(first, order));
            }
        }
        for end in ends {
            let n_terms = series.terms.len();
            let is_kept = |&(exponent, _): &(ExprId, ExprId)| {
                self.difference(exponent, end)
                    .is_none_or(|d| d < -SAME_EXPONENT)
            };
            series.terms.retain(is_kept);
            if series.terms.len() < n_terms {
                series.rest.push(end);
            }
        }
        series.rest.sort_unstable();
        series.rest.dedup();
        let all = series.rest.clone();
        (series.rest).retain(|&rest| {
            !all.iter()
                .any(|&other| self.difference(rest, other).is_some_and(|d| d > 0.0))
        });
        series
    }

    /// `a - b` where that is a number.
    fn difference(&mut self, a: ExprId, b: ExprId) -> Option<f64> {
        match self.number_of(a).zip(self.number_of(b)) {
            Some((a, b)) => Some(a - b),
            None if self.pool.is_constant(a) || self.pool.is_constant(b) => None,
            None => {
                let difference = self.pool.sub(a, b);
                self.number_of(difference)
            }
        }
    }

    fn plus(&mut self, mut a: Series, b: Series) -> Series {
        for term in b.terms {
            self.push(&mut a, term);
        }
        a.rest.extend(b.rest);
        self.cut(a)
    }

    fn times(&mut self, a: &Series, b: &Series) -> Series {
        let mut product = Series::default();
        for &(r, c) in &a.terms {
            for &(s, d) in &b.terms {
                let term = (self.pool.add(r, s), self.pool.mul(c, d));
                self.push(&mut product, term);
            }
        }
        for (one, other) in [(a, b), (b, a)] {
            let exponents = other.terms.iter().map(|&(exponent, _)| exponent);
            for exponent in exponents.chain(other.rest.iter().copied()) {
                for &rest in &one.rest {
                    product.rest.push(self.pool.add(rest, exponent));
                }
            }
        }
        self.cut(product)
    }

    /// With every term multiplied by `coefficient t^exponent`.
    fn shifted(&mut self, series: &Series, exponent: ExprId, coefficient: ExprId) -> Series {
        let factor = Series {
            terms: vec![(exponent, coefficient)],
            rest: Vec::new(),
        };
        let order = std::mem::replace(&mut self.order, i64::MAX);
        let shifted = self.times(series, &factor);
        self.order = order;
        shifted
    }

    /// How two exponents compare at the point.
    pub fn compare(&mut self, a: ExprId, b: ExprId) -> Result<Ordering, Stop> {
        let difference = self.pool.sub(a, b);
        let difference = self.facts.at(self.pool, difference);
        if let Some(number) = self.number_of(difference) {
            let is_same = number.abs() < SAME_EXPONENT;
            return Ok(if is_same { 0.0 } else { number }.total_cmp(&0.0));
        }
        if self.vanishes(difference)? {
            return Ok(Ordering::Equal);
        }
        Ok(match self.is_positive(difference)? {
            true => Ordering::Greater,
            false => Ordering::Less,
        })
    }

    /// Whether an expression that is not zero is positive.
    fn is_positive(&mut self, expr: ExprId) -> Result<bool, Stop> {
        self.facts.is_positive(self.pool, expr)
    }

    /// Takes out the first term that is not zero: exponent and coefficient.
    pub fn lead(&mut self, series: &mut Series) -> Result<Option<(ExprId, ExprId)>, Stop> {
        while let Some(&(first, _)) = series.terms.first() {
            let mut least = first;
            for position in 1..series.terms.len() {
                let exponent = series.terms[position].0;
                if self.compare(exponent, least)?.is_lt() {
                    least = exponent;
                }
            }
            for position in 0..series.rest.len() {
                if self.compare(series.rest[position], least)?.is_le() {
                    return Err(self.too_short());
                }
            }
            let mut coefficients = Vec::new();
            for (exponent, coefficient) in std::mem::take(&mut series.terms) {
                match self.compare(exponent, least)? {
                    Ordering::Equal => coefficients.push(coefficient),
                    _ => series.terms.push((exponent, coefficient)),
                }
            }
            let coefficient = self.pool.sum(&coefficients);
            let coefficient = self.facts.at(self.pool, coefficient);
            let vanishes = match self.vanishes(coefficient) {
                Err(Stop::Undecided(_)) if self.number_of(least).is_some_and(|n| n >= RARE) => {
                    false
                }
                known => known?,
            };
            if !vanishes {
                return Ok(Some((least, coefficient)));
            }
        }
        match series.rest.is_empty() || self.order >= LAST_ORDER {
            true => Ok(None),
            false => Err(Stop::Order),
        }
    }

    /// The coefficient of `t`, if no smaller exponent is left.
    pub fn linear(&mut self, series: &Series) -> Result<Option<ExprId>, Stop> {
        if !series.terms.iter().all(|term| term.0 == ExprId::ONE) {
            return Ok(None);
        }
        for &rest in &series.rest {
            if self.compare(rest, ExprId::ONE)?.is_le() {
                return Err(self.too_short());
            }
        }
        let coefficient = series.terms.first().map(|term| term.1);
        Ok(Some(coefficient.unwrap_or(ExprId::ZERO)))
    }

    fn too_short(&self) -> Stop {
        match self.order < LAST_ORDER {
            true => Stop::Order,
            false => Stop::Unknown,
        }
    }

    /// The value at `t = 0` and the terms that vanish there; the leading coefficient as an error where there is
    /// a pole.
    fn split(&mut self, mut series: Series) -> Result<Result<(ExprId, Series), ExprId>, Stop> {
        let numbers: Option<Vec<f64>> = (series.terms.iter())
            .map(|&(e, _)| self.number_of(e))
            .collect();
        if numbers.is_some_and(|numbers| numbers.iter().all(|&number| number >= 0.0)) {
            let is_constant = |&(e, _): &(ExprId, ExprId)| e == ExprId::ZERO;
            let at = series.terms.iter().position(is_constant);
            let value = at.map_or(ExprId::ZERO, |at| series.terms.remove(at).1);
            return Ok(Ok((value, series)));
        }
        let Some((exponent, coefficient)) = self.lead(&mut series)? else {
            return Ok(Ok((ExprId::ZERO, series)));
        };
        Ok(match self.compare(exponent, ExprId::ZERO)? {
            Ordering::Less => Err(coefficient),
            Ordering::Equal => Ok((coefficient, series)),
            Ordering::Greater => {
                self.push(&mut series, (exponent, coefficient));
                Ok((ExprId::ZERO, series))
            }
        })
    }

    /// `sum_k f_k G^k` for a series without terms that do not vanish.
    fn composed(
        &mut self,
        inner: &Series,
        mut coefficient: impl FnMut(&mut Self, i64) -> ExprId,
    ) -> Series {
        let mut result = Series::constant(coefficient(self, 0));
        let numbers: Option<Vec<f64>> = (inner.terms.iter())
            .map(|&(e, _)| self.number_of(e))
            .collect();
        let most = if numbers.is_some() { MOST_TERMS } else { 1 };
        let mut power = Series::constant(ExprId::ONE);
        for k in 1.. {
            power = self.times(&power, inner);
            if power.is_zero() {
                break;
            }
            if power.terms.is_empty() || k > most {
                let exponents = power.terms.into_iter().map(|(exponent, _)| exponent);
                result.rest.extend(exponents.chain(power.rest));
                break;
            }
            let factor = coefficient(self, k);
            let term = self.shifted(&power, ExprId::ZERO, factor);
            result = self.plus(result, term);
        }
        self.cut(result)
    }

    /// A function that is smooth wherever it has values.
    fn smooth_of(&mut self, function: Function, argument: Series) -> Result<Series, Stop> {
        let (value, inner) = match self.split(argument)? {
            Ok(parts) => parts,
            // At infinity tanh and exp have limits, which they reach faster than any power.
            Err(pole) => {
                let is_positive = self.is_positive(pole)?;
                return match function {
                    Function::Tanh => {
                        let limit = if is_positive { 1 } else { -1 };
                        Ok(Series::constant(self.pool.integer(limit)))
                    }
                    Function::Exp if !is_positive => Ok(Series::default()),
                    _ => Err(Stop::Unknown),
                };
            }
        };
        let symbol = self.pool.symbol_id("argument of a function");
        let variable = self.pool.symbol_expr(symbol);
        let mut derivative = self.pool.apply(function, variable);
        let mut factor = Number::ONE;
        Ok(self.composed(&inner, |germs, k| {
            if k > 0 {
                derivative = germs.pool.derivative(derivative, symbol);
                factor = factor
                    .checked_div(Number::integer(k))
                    .unwrap_or(Number::ZERO);
            }
            let at_value = germs.pool.substitute(derivative, &[(symbol, value)]);
            germs.pool.scale(factor, at_value)
        }))
    }

    /// A function that has a kink or no values from zero on.
    fn kinked(&mut self, function: Function, argument: Series) -> Result<Series, Stop> {
        if function == Function::Sqrt {
            let half = self.pool.constant(Number::HALF);
            return self.power(argument, half);
        }
        let mut behind = argument.clone();
        let Some((exponent, coefficient)) = self.lead(&mut behind)? else {
            return match function {
                Function::Log => Err(Stop::Unknown),
                _ => Ok(Series::default()),
            };
        };
        if function == Function::Log {
            return match self.compare(exponent, ExprId::ZERO)? {
                Ordering::Equal => self.smooth_of(function, argument),
                _ => Err(Stop::Unknown),
            };
        }
        let sign = self.pool.apply(Function::Sign, coefficient);
        if function == Function::Sign {
            return Ok(Series::constant(sign));
        }
        let mut series = self.shifted(&behind, ExprId::ZERO, sign);
        let magnitude = self.pool.apply(Function::Abs, coefficient);
        self.push(&mut series, (exponent, magnitude));
        Ok(series)
    }

    /// `(c t^r (1 + G))^e = c^e t^(r e) sum_k binomial(e, k) G^k` for an exponent that does not vary.
    fn power(&mut self, base: Series, exponent: ExprId) -> Result<Series, Stop> {
        let integer = self.pool.as_integer(exponent);
        if let Some(n @ 0..=LAST_ORDER) = integer {
            let mut power = Series::constant(ExprId::ONE);
            for _ in 0..n {
                power = self.times(&power, &base);
            }
            return Ok(power);
        }
        let mut inner = base;
        let Some((r, c)) = self.lead(&mut inner)? else {
            return match self.number_of(exponent) {
                Some(number) if number < 0.0 => Err(Stop::Unknown),
                _ => Ok(Series::default()),
            };
        };
        if integer.is_none() && !self.is_positive(c)? {
            return Err(Stop::Undefined);
        }
        let (minus_r, reciprocal) = (self.pool.neg(r), self.pool.powi(c, -1));
        let inner = self.shifted(&inner, minus_r, reciprocal);
        let mut binomial = ExprId::ONE;
        let series = self.composed(&inner, |germs, k| {
            if k > 0 {
                let before = germs.pool.integer(k - 1);
                let factor = germs.pool.sub(exponent, before);
                let product = germs.pool.mul(binomial, factor);
                let k = germs.pool.integer(k);
                binomial = germs.pool.div(product, k);
            }
            binomial
        });
        let (shift, outside) = (self.pool.mul(r, exponent), self.pool.pow(c, exponent));
        Ok(self.shifted(&series, shift, outside))
    }

    /// A power whose exponent varies: `exp(e log(b))` where the base is not zero, else its leading term.
    fn varying_power(
        &mut self,
        base: ExprId,
        exponent: ExprId,
        is_smooth: bool,
    ) -> Result<Option<Series>, Stop> {
        if is_smooth && !self.vanishes(base)? {
            return Ok(None);
        }
        let (base, exponent) = (self.series(base), self.series(exponent));
        let mut behind = base.clone();
        let Some((r, c)) = self.lead(&mut behind)? else {
            return Ok(Some(Series::default()));
        };
        match self.compare(r, ExprId::ZERO)? {
            Ordering::Equal => {
                let log = self.smooth_of(Function::Log, base)?;
                let product = self.times(&exponent, &log);
                self.smooth_of(Function::Exp, product).map(Some)
            }
            Ordering::Less => Err(Stop::Unknown),
            Ordering::Greater if !self.is_positive(c)? => Err(Stop::Undefined),
            Ordering::Greater => {
                let Ok((value, _)) = self.split(exponent)? else {
                    return Err(Stop::Unknown);
                };
                let (lead, half) = (self.pool.mul(r, value), self.pool.constant(Number::HALF));
                let term = (lead, self.pool.pow(c, value));
                // Next comes t log(t) times the first term.
                let rest = vec![self.pool.add(lead, half)];
                let terms = vec![term];
                Ok(Some(Series { terms, rest }))
            }
        }
    }
}
