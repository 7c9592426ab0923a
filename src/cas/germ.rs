//! Series of expressions next to a point, where roots, magnitudes and signs may have kinks. With one variable at
//! `p + t` or `p - t`, they are sums of terms `c t^r` for small positive `t`, with expressions at the point as
//! coefficients and real exponents (Puiseux series). `sqrt(abs(x))*sin(x)` at 0 is `t^(3/2) - ...`; smooth expressions
//! have Taylor series.

use super::series::Series;
use super::slope::Facts;
use super::*;

pub(super) const LAST_ORDER: i64 = 8;

#[derive(Clone, Copy, Debug)]
pub(super) enum Stop {
    /// It depends on whether this expression is zero.
    Undecided(ExprId),
    /// More terms are needed, or more work than there may be.
    Order,
    /// The expression has no values on this side of the point.
    Undefined,
    /// It is no sum of powers, or it has no finite value.
    Unknown,
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
    /// Series of the expressions that are not smooth.
    pub known: IdMap<Series>,
}

impl Germs<'_> {
    pub(crate) fn of(&mut self, root: ExprId) -> Result<Option<Series>, Stop> {
        let symbol = self.symbol;
        let wanted = |node| self.pool.may_contain(node, symbol);
        for node in self.pool.walk(&[root], wanted, |_| true) {
            if !self.pool.affords(1) {
                return Err(Stop::Order);
            }
            if let Some(series) = self.series_of_node(node)? {
                let series = self.cut(series);
                self.known.insert(node, series);
            }
        }
        Ok(self.known.get(&root).cloned())
    }

    fn series_of_node(&mut self, expr: ExprId) -> Result<Option<Series>, Stop> {
        let node = self.pool.node(expr).clone();
        let operands: Vec<ExprId> = node.operands().collect();
        let is_smooth = operands.iter().all(|operand| self.is_smooth(*operand));
        match node {
            Node::Number(_) | Node::Symbol(_) => Ok(None),
            Node::Sum(_) | Node::Product(_) if is_smooth => Ok(None),
            Node::Sum(terms) => Ok(Some(terms.iter().fold(Series::default(), |sum, term| {
                let series = self.series(*term);
                self.plus(sum, series)
            }))),
            Node::Product(factors) => self.product(&factors).map(Some),
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

    fn product(&mut self, factors: &[ExprId]) -> Result<Series, Stop> {
        let factors: Vec<Series> = factors.iter().map(|factor| self.series(*factor)).collect();
        // A pole multiplied by a zero has no value: 0*inf.
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
        Ok(product)
    }

    fn is_smooth(&self, expr: ExprId) -> bool {
        !self.known.contains_key(&expr)
    }

    pub(super) fn vanishes(&mut self, expr: ExprId) -> Result<bool, Stop> {
        self.facts.is_zero(self.pool, expr)
    }

    fn series(&mut self, expr: ExprId) -> Series {
        let known = self.known.get(&expr).cloned();
        known.unwrap_or_else(|| self.taylor(expr))
    }

    fn taylor(&mut self, expr: ExprId) -> Series {
        let mut series = Series::default();
        let (mut derivative, mut factor) = (expr, Number::ONE);
        for order in 0..self.order {
            if order > 0 {
                factor = over(
                    if self.side.is_negative() {
                        -factor
                    } else {
                        factor
                    },
                    order,
                );
            }
            let coefficient = self.facts.at(self.pool, derivative);
            let coefficient = self.pool.scale(factor, coefficient);
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
        let symbol = self.pool.placeholder("argument", 0);
        let variable = self.pool.symbol_expr(symbol);
        let mut derivative = self.pool.apply(function, variable);
        let mut factor = Number::ONE;
        Ok(self.composed(&inner, |germs, k| {
            if k > 0 {
                derivative = germs.pool.derivative(derivative, symbol);
                factor = over(factor, k);
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

/// A factor of a term of a Taylor series; 0 where it is too small for a number.
fn over(factor: Number, divisor: i64) -> Number {
    (factor.checked_div(Number::integer(divisor))).unwrap_or(Number::ZERO)
}
