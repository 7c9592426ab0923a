//! Identities of magnitudes and signs.

use super::node::{ExprId, Function, Node};
use super::number::Number;
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
        let factors = self.factors_of(expr).to_vec();
        for (place, &factor) in factors.iter().enumerate() {
            let Some((Function::Abs, argument, 1)) = self.function_power(factor) else {
                continue;
            };
            let mut powers = (factors.iter()).filter_map(|factor| self.integer_power(*factor));
            if powers.any(|(base, power)| base == argument && power < 0) {
                let mut merged = factors.clone();
                merged[place] = self.apply(Function::Sign, argument);
                merged.push(argument);
                return self.product(&merged);
            }
        }
        expr
    }
}
