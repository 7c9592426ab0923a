//! Canonical constructors of powers and functions.

use super::function::Parity;
use super::*;

/// Trial divisors for square factors under a root: `sqrt(8) = 2*sqrt(2)`.
const SQUARE_FACTOR_LIMIT: i64 = 1_000;

impl ExprPool {
    pub(crate) fn powi(&mut self, base: ExprId, exponent: i32) -> ExprId {
        self.pow_number(base, Number::integer(i64::from(exponent)))
    }

    /// `base ^ exponent`. Powers that are not integers are those of a non-negative base.
    pub fn pow(&mut self, base: ExprId, exponent: ExprId) -> ExprId {
        if let Some(number) = self.as_number(exponent) {
            return self.pow_number(base, number);
        }
        if base == ExprId::ONE {
            return ExprId::ONE;
        }
        self.intern(Node::Power(base, exponent))
    }

    pub(crate) fn pow_number(&mut self, base: ExprId, exponent: Number) -> ExprId {
        let exponent = half_integer(exponent);
        if exponent.is_zero() {
            return ExprId::ONE;
        }
        if exponent.is_one() {
            return base;
        }
        if let Some(number) = self.as_number(base) {
            return self.pow_of_number(number, exponent);
        }
        let is_integer = exponent.as_integer().is_some();
        let (inner, inner_exponent) = self.base_and_exponent(base);
        match (inner_exponent, self.node(base)) {
            (Exponent::Number(m), _) if !m.is_one() => {
                if let Some(combined) = self.folded(m.checked_mul(exponent)) {
                    // (x^2)^(1/2) = |x|: only even integers lose the sign of the base.
                    let inner = match m.is_even() && !is_integer {
                        true => self.apply(Function::Abs, inner),
                        false => inner,
                    };
                    return self.pow_number(inner, combined);
                }
            }
            (Exponent::Expr(m), _) if is_integer => {
                let combined = self.scale(exponent, m);
                return self.pow(inner, combined);
            }
            (_, Node::Product(factors)) => {
                let factors = factors.to_vec();
                return self.pow_of_product(&factors, exponent);
            }
            (_, Node::Sum(_)) if is_integer && self.starts_negative(base) => {
                let positive = self.neg(base);
                let power = self.pow_number(positive, exponent);
                return self.negated_if(!exponent.is_even(), power);
            }
            (_, &Node::Apply(Function::Abs, argument)) if exponent.is_even() => {
                return self.pow_number(argument, exponent);
            }
            _ => {}
        }
        self.raw_power(base, exponent)
    }

    fn raw_power(&mut self, base: ExprId, exponent: Number) -> ExprId {
        if let Some((halves, 2)) = exponent.as_rational() {
            let root = self.intern(Node::Apply(Function::Sqrt, base));
            if halves == 1 {
                return root;
            }
            let halves = self.integer(halves);
            return self.intern(Node::Power(root, halves));
        }
        let exponent = self.constant(exponent);
        self.intern(Node::Power(base, exponent))
    }

    /// Integer powers go to every factor; of others only a number with an exact root leaves.
    fn pow_of_product(&mut self, factors: &[ExprId], exponent: Number) -> ExprId {
        if exponent.as_integer().is_some() {
            let powers = factors.iter().map(|of| self.pow_number(*of, exponent));
            let powers: Vec<ExprId> = powers.collect();
            return self.product(&powers);
        }
        if let Some((mut roots, common)) = self.common_power(factors)
            && let Some(combined) = exponent.checked_mul(Number::integer(common))
        {
            // sqrt((x*y)^3) = sqrt(x*y)^3, whose derivative has a value at x = 0; the signs as in powers of one base.
            if common % 2 == 0 {
                for root in &mut roots {
                    *root = self.apply(Function::Abs, *root);
                }
            }
            let root = self.product(&roots);
            return self.pow_number(root, combined);
        }
        let whole = |pool: &mut ExprPool| {
            let base = pool.intern(Node::Product(factors.into()));
            pool.raw_power(base, exponent)
        };
        let [Some(coefficient), None] = [factors[0], factors[1]].map(|f| self.as_number(f)) else {
            return whole(self);
        };
        let rest = self.product(&factors[1..]);
        match self.folded(exact_power(coefficient, exponent)) {
            Some(outside) => {
                let rest = self.pow_number(rest, exponent);
                self.scale(outside, rest)
            }
            None if !coefficient.is_negative() && self.common_power(&factors[1..]).is_some() => {
                let outside = self.pow_of_number(coefficient, exponent);
                let rest = self.pow_number(rest, exponent);
                self.product(&[outside, rest])
            }
            None => whole(self),
        }
    }

    /// Factors whose product to an integer power above 1 the given ones are, and that power.
    fn common_power(&mut self, factors: &[ExprId]) -> Option<(Vec<ExprId>, i64)> {
        let mut common = 0;
        let mut powers = Vec::with_capacity(factors.len());
        for factor in factors {
            let (base, Exponent::Number(exponent)) = self.base_and_exponent(*factor) else {
                return None;
            };
            let is_number = self.as_number(base).is_some();
            let exponent = exponent.as_integer().filter(|_| !is_number)?;
            common = exponent.unsigned_abs().gcd(&common);
            powers.push((base, exponent));
        }
        let common = i64::try_from(common).ok().filter(|&common| common > 1)?;
        let roots = powers
            .into_iter()
            .map(|(base, exponent)| self.pow_number(base, Number::integer(exponent / common)));
        Some((roots.collect(), common))
    }

    /// A power of a constant, folded where exact or correctly rounded; else a root remains: `2^(3/2) = 2*sqrt(2)`.
    fn pow_of_number(&mut self, base: Number, exponent: Number) -> ExprId {
        if base.is_one() {
            return ExprId::ONE;
        }
        if base.is_zero() && !exponent.is_negative() {
            return ExprId::ZERO;
        }
        if let Some(integer) = exponent.as_integer() {
            if let Some(value) = self.folded(base.checked_powi(integer)) {
                return self.constant(value);
            }
            // Only a positive base is left under a power: (-x)^n = +-(x^n).
            let magnitude = self.constant(base.abs());
            let power = self.raw_power(magnitude, exponent);
            return self.negated_if(base.is_negative() && !exponent.is_even(), power);
        }
        if let Some(value) = self.folded(exact_power(base, exponent)) {
            return self.constant(value);
        }
        if base.is_exact()
            && !base.is_negative()
            && !base.is_zero()
            && let Some(exponent) = exponent.as_rational()
            && let Some(power) = self.pow_of_rational(base, exponent)
        {
            return power;
        }
        let base = self.constant(base);
        self.raw_power(base, exponent)
    }

    /// `base ^ (numerator/denominator)` as a number times a root of an integer or fraction.
    fn pow_of_rational(
        &mut self,
        base: Number,
        (numerator, denominator): (i64, i64),
    ) -> Option<ExprId> {
        let outside = self.folded(base.checked_powi(numerator.div_euclid(denominator)))?;
        let fraction = Number::rational(numerator.rem_euclid(denominator), denominator)?;
        let (factor, radicand) = match denominator {
            2 => square_free(base)?,
            _ => (Number::ONE, base),
        };
        let outside = self.folded(outside.checked_mul(factor))?;
        let radicand = self.constant(radicand);
        let root = self.raw_power(radicand, fraction);
        Some(self.scale(outside, root))
    }

    /// `function(argument)`, with the values and symmetries that need no rounding: `sin(0) = 0`, `log(exp(x)) = x`,
    /// `cos(-x) = cos(abs(x)) = cos(x)`, `abs(-2) = 2`. `sin(1)` stays: the last bit of sines varies by machine.
    pub fn apply(&mut self, function: Function, argument: ExprId) -> ExprId {
        if function == Function::Sqrt {
            return self.pow_number(argument, Number::HALF);
        }
        if let Some(value) = self.special_value(function, argument) {
            return value;
        }
        let parity = function.row().parity;
        if parity != Parity::Neither && self.starts_negative(argument) {
            let positive = self.neg(argument);
            let value = self.apply(function, positive);
            return self.negated_if(parity == Parity::Odd, value);
        }
        self.intern(Node::Apply(function, argument))
    }

    fn special_value(&mut self, function: Function, argument: ExprId) -> Option<ExprId> {
        let is_zero = argument == ExprId::ZERO;
        match (function, self.node(argument)) {
            (Function::Cos | Function::Exp, _) if is_zero => Some(ExprId::ONE),
            (_, _) if is_zero && function.vanishes_at_zero() => Some(ExprId::ZERO),
            (Function::Cos, &Node::Apply(Function::Abs, inner)) => {
                Some(self.apply(Function::Cos, inner))
            }
            (Function::Log, _) if argument == ExprId::ONE => Some(ExprId::ZERO),
            (Function::Log, &Node::Apply(Function::Exp, inner))
            | (Function::Exp, &Node::Apply(Function::Log, inner)) => Some(inner),
            (Function::Abs, _) if self.sign(argument) != Sign::Any => Some(argument),
            (Function::Abs, _) => {
                let (coefficient, rest) = self.split(argument);
                if coefficient.is_one() {
                    return None;
                }
                let magnitude = self.apply(Function::Abs, rest);
                Some(self.scale(coefficient.abs(), magnitude))
            }
            (Function::Sign, _) if self.sign(argument) == Sign::Positive => Some(ExprId::ONE),
            (Function::Sign, Node::Number(_)) => Some(self.integer(-1)),
            (Function::Sign, Node::Apply(Function::Sign, _)) => Some(argument),
            (Function::Sign, _) => {
                let (coefficient, rest) = self.split(argument);
                if coefficient.is_one() || coefficient.is_negative() {
                    return None;
                }
                Some(self.apply(Function::Sign, rest))
            }
            _ => None,
        }
    }
}

pub(super) fn half_integer(exponent: Number) -> Number {
    let twice = exponent.to_f64() * 2.0;
    match Number::from_f64(twice).and_then(Number::as_integer) {
        Some(halves) if !exponent.is_exact() => Number::rational(halves, 2).unwrap_or(exponent),
        _ => exponent,
    }
}

fn exact_power(base: Number, exponent: Number) -> Option<Number> {
    let (numerator, denominator) = exponent.as_rational()?;
    let root = base.checked_root(u32::try_from(denominator).ok()?)?;
    root.checked_powi(numerator)
}

/// `sqrt(base) = factor * sqrt(radicand)`, an integer radicand without small squares; `None` if numbers grow too large.
fn square_free(base: Number) -> Option<(Number, Number)> {
    let (numerator, denominator) = base.as_rational()?;
    let mut radicand = numerator.checked_mul(denominator)?;
    let mut outside = 1;
    let mut divisor = 2;
    while divisor <= SQUARE_FACTOR_LIMIT && divisor * divisor <= radicand {
        if radicand % (divisor * divisor) == 0 {
            radicand /= divisor * divisor;
            outside *= divisor;
        } else {
            divisor += 1;
        }
    }
    Some((
        Number::rational(outside, denominator)?,
        Number::integer(radicand),
    ))
}
