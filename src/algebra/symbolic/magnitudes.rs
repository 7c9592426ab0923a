//! Identities of magnitudes and signs.

use super::node::{ExprId, Function, Node};
use super::number::Number;
use super::order::Exponent;
use super::pool::ExprPool;

impl ExprPool {
    /// `abs(a*b) = abs(a)*abs(b)`.
    pub(super) fn split_abs(&mut self, argument: ExprId) -> Option<ExprId> {
        if !matches!(self.node(argument), Node::Product(_) | Node::Power(..)) {
            return None;
        }
        let factors = self.factors_of(argument).to_vec();
        let mut parts = Vec::with_capacity(factors.len());
        for factor in factors {
            let part = match self.base_and_exponent(factor) {
                (base, Exponent::Number(exponent)) if exponent.as_integer().is_some() => {
                    let magnitude = self.apply(Function::Abs, base);
                    self.pow_number(magnitude, exponent)
                }
                _ => self.apply(Function::Abs, factor),
            };
            parts.push(part);
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
        self.merge_factors(Function::Sign, &factors).unwrap_or(expr)
    }

    /// `f(a)*f(b) = f(a*b)`, for magnitudes and signs.
    fn merge_factors(&mut self, function: Function, factors: &[ExprId]) -> Option<ExprId> {
        let (mut inside, mut outside) = (Vec::new(), Vec::new());
        for &factor in factors {
            match self.function_power(factor) {
                Some((of_factor, argument, 1)) if of_factor == function => inside.push(argument),
                _ => outside.push(factor),
            }
        }
        if inside.len() < 2 {
            return None;
        }
        let product = self.product(&inside);
        outside.push(self.apply(function, product));
        Some(self.product(&outside))
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
            let occurs = factors.iter().any(|factor| {
                let (found, exponent) = self.base_and_exponent(*factor);
                let exponent = match exponent {
                    Exponent::Number(number) => number.as_integer(),
                    Exponent::Expr(_) => None,
                };
                found == base && exponent.is_some_and(|exponent| exponent > 0)
            });
            if occurs {
                return Some((base, other));
            }
        }
        None
    }

    /// `abs(a)*abs(b) = abs(a*b)`.
    pub(super) fn merge_abs(&mut self, expr: ExprId) -> ExprId {
        let factors = self.factors_of(expr).to_vec();
        self.merge_factors(Function::Abs, &factors).unwrap_or(expr)
    }

    /// `abs(a)/a = sign(a)`.
    pub(super) fn abs_to_sign(&mut self, expr: ExprId) -> ExprId {
        let factors = self.factors_of(expr).to_vec();
        for (place, &factor) in factors.iter().enumerate() {
            let Some((Function::Abs, argument, 1)) = self.function_power(factor) else {
                continue;
            };
            let is_divisor = |factor: &ExprId| match self.base_and_exponent(*factor) {
                (base, Exponent::Number(number)) => {
                    base == argument && number.is_negative() && number.as_integer().is_some()
                }
                (_, Exponent::Expr(_)) => false,
            };
            if factors.iter().any(is_divisor) {
                let mut merged = factors.clone();
                merged[place] = self.apply(Function::Sign, argument);
                merged.push(argument);
                return self.product(&merged);
            }
        }
        expr
    }
}
