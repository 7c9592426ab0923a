//! Identities of the factors of a product: sines and cosines that are a tangent, tangents of doubles
//! and halves of an angle, magnitudes and signs.

use super::function::Function;
use super::node::{ExprId, Node};
use super::number::Number;
use super::order::Exponent;
use super::pool::ExprPool;

impl ExprPool {
    /// What `merge` makes of a product, given its factors and the first place for which it finds
    /// something; else `expr`.
    pub(super) fn merge_first(
        &mut self,
        expr: ExprId,
        merge: impl Fn(&mut ExprPool, &[ExprId], usize) -> Option<ExprId>,
    ) -> ExprId {
        let factors = self.factors_of(expr).to_vec();
        let merged = (0..factors.len()).find_map(|place| merge(self, &factors, place));
        merged.unwrap_or(expr)
    }

    /// `sin(a)/cos(a) = tan(a)`, also with powers.
    pub(super) fn merge_tangents(&mut self, expr: ExprId) -> ExprId {
        self.merge_first(expr, |pool, factors, place| {
            let Some((Function::Cos, argument, cosines)) = pool.function_power(factors[place])
            else {
                return None;
            };
            let sines = factors
                .iter()
                .filter_map(|factor| pool.function_power(*factor))
                .find(|(function, angle, _)| (*function, *angle) == (Function::Sin, argument))
                .map_or(0, |(_, _, power)| power);
            if sines.signum() * cosines.signum() >= 0 {
                return None;
            }
            let tangents = sines.signum() * sines.abs().min(cosines.abs());
            let mut merged = factors.to_vec();
            merged.push(pool.apply_power(Function::Tan, argument, tangents));
            merged.push(pool.apply_power(Function::Sin, argument, -tangents));
            merged.push(pool.apply_power(Function::Cos, argument, tangents));
            Some(pool.product(&merged))
        })
    }

    /// `tan(a)/(1 - tan(a)^2) = tan(2*a)/2`, `tanh(a)/(1 + tanh(a)^2) = tanh(2*a)/2`,
    /// `sin(a)/(1 + cos(a)) = (1 - cos(a))/sin(a) = tan(a/2)` and `sin(a)/(1 - cos(a)) = 1/tan(a/2)`.
    pub(super) fn merge_double_angles(&mut self, expr: ExprId) -> ExprId {
        self.merge_first(expr, |pool, factors, place| {
            let (base, Exponent::Number(side)) = pool.base_and_exponent(factors[place]) else {
                return None;
            };
            let terms = pool.terms_of(base);
            let [(Number::ONE, ExprId::ONE), (sign, rest)] = terms[..] else {
                return None;
            };
            let (inner, angle, power) = pool.function_power(rest)?;
            let (is_below, is_above) = (side == Number::MINUS_ONE, side.is_one());
            let (two, half) = (Number::integer(2), Number::HALF);
            // The other factor with its power, the new function, what its angle and the product are multiplied by.
            let (partner, wanted, new, multiple, scale) = match (inner, power, sign) {
                (Function::Tan, 2, Number::MINUS_ONE) | (Function::Tanh, 2, Number::ONE)
                    if is_below =>
                {
                    (inner, 1, (inner, 1), two, half)
                }
                (Function::Cos, 1, Number::ONE | Number::MINUS_ONE) if is_below || is_above => {
                    let wanted = if is_below { 1 } else { -1 };
                    let new = if sign.is_one() { wanted } else { -wanted };
                    (
                        Function::Sin,
                        wanted,
                        (Function::Tan, new),
                        half,
                        Number::ONE,
                    )
                }
                _ => return None,
            };
            let mut powers = factors
                .iter()
                .filter_map(|other| pool.function_power(*other));
            if !powers.any(|(f, of, n)| (f, of) == (partner, angle) && n * wanted > 0) {
                return None;
            }
            let angle_of_new = pool.scale(multiple, angle);
            let mut merged = factors.to_vec();
            merged[place] = pool.apply_power(new.0, angle_of_new, new.1);
            merged.push(pool.apply_power(partner, angle, -wanted));
            let product = pool.product(&merged);
            Some(pool.scale(scale, product))
        })
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

    /// `abs(a)*sign(a) = a`, `sign(a)*a = abs(a)`, and even powers of both.
    pub(super) fn merge_signs(&mut self, expr: ExprId) -> ExprId {
        let factors = self.factors_of(expr).to_vec();
        for (place, &factor) in factors.iter().enumerate() {
            let mut rest = factors.clone();
            match self.function_power(factor) {
                Some((Function::Abs, argument, power)) if !(0..2).contains(&power) => {
                    let even = power - power.rem_euclid(2);
                    rest[place] = self.apply_power(Function::Abs, argument, power - even);
                    rest.push(self.pow_number(argument, Number::integer(even)));
                }
                Some((Function::Sign, argument, power)) if power > 0 => {
                    if power > 2 {
                        let lower = 2 - power % 2;
                        rest[place] = self.apply_power(Function::Sign, argument, lower);
                    } else if let Some(partner) = self.partner_of_sign(&factors, argument) {
                        let (base, with_sign) = partner;
                        let lower = self.powi(base, -1);
                        rest[place] = self.apply_power(Function::Sign, argument, power - 1);
                        rest.extend([lower, with_sign]);
                    } else {
                        continue;
                    }
                }
                _ => continue,
            }
            return self.product(&rest);
        }
        self.merge_factors(Function::Sign, expr)
    }

    /// `f(a)*f(b) = f(a*b)`, for magnitudes and signs.
    pub(super) fn merge_factors(&mut self, function: Function, expr: ExprId) -> ExprId {
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

    /// What loses a factor and what takes its place when `sign(argument)` is multiplied in:
    /// `x` becomes `abs(x)`, `abs(x)` becomes `x`.
    fn partner_of_sign(
        &mut self,
        factors: &[ExprId],
        argument: ExprId,
    ) -> Option<(ExprId, ExprId)> {
        let magnitude = self.apply(Function::Abs, argument);
        for (base, other) in [(magnitude, argument), (argument, magnitude)] {
            let mut powers = (factors.iter()).filter_map(|factor| self.integer_power(*factor));
            if powers.any(|(found, power)| found == base && power > 0) {
                return Some((base, other));
            }
        }
        None
    }

    /// `abs(a)/a = sign(a)`.
    pub(super) fn abs_to_sign(&mut self, expr: ExprId) -> ExprId {
        self.merge_first(expr, |pool, factors, place| {
            let Some((Function::Abs, argument, 1)) = pool.function_power(factors[place]) else {
                return None;
            };
            let mut powers = (factors.iter()).filter_map(|factor| pool.integer_power(*factor));
            if !powers.any(|(base, power)| base == argument && power < 0) {
                return None;
            }
            let mut merged = factors.to_vec();
            merged[place] = pool.apply(Function::Sign, argument);
            merged.push(argument);
            Some(pool.product(&merged))
        })
    }
}
