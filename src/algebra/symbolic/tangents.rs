//! Sines and cosines that are a tangent, and tangents of doubles and halves of an angle.

use super::node::{ExprId, Function};
use super::number::Number;
use super::order::Exponent;
use super::pool::ExprPool;

impl ExprPool {
    /// `sin(a)/cos(a) = tan(a)`, also with powers.
    pub(super) fn merge_tangents(&mut self, expr: ExprId) -> ExprId {
        let factors = self.factors_of(expr).to_vec();
        for &factor in &factors {
            let Some((Function::Cos, argument, cosines)) = self.function_power(factor) else {
                continue;
            };
            let sines = factors
                .iter()
                .filter_map(|factor| self.function_power(*factor))
                .find(|(function, angle, _)| (*function, *angle) == (Function::Sin, argument))
                .map_or(0, |(_, _, power)| power);
            if sines.signum() * cosines.signum() >= 0 {
                continue;
            }
            let tangents = sines.signum() * sines.abs().min(cosines.abs());
            let mut merged = factors.clone();
            merged.push(self.apply_power(Function::Tan, argument, tangents));
            merged.push(self.apply_power(Function::Sin, argument, -tangents));
            merged.push(self.apply_power(Function::Cos, argument, tangents));
            return self.product(&merged);
        }
        expr
    }

    /// `tan(a)/(1 - tan(a)^2) = tan(2*a)/2`, `tanh(a)/(1 + tanh(a)^2) = tanh(2*a)/2`,
    /// `sin(a)/(1 + cos(a)) = (1 - cos(a))/sin(a) = tan(a/2)` and `sin(a)/(1 - cos(a)) = 1/tan(a/2)`.
    pub(super) fn merge_double_angles(&mut self, expr: ExprId) -> ExprId {
        let factors = self.factors_of(expr).to_vec();
        for (place, &factor) in factors.iter().enumerate() {
            let (base, Exponent::Number(side)) = self.base_and_exponent(factor) else {
                continue;
            };
            let terms = self.terms_of(base);
            let [(Number::ONE, ExprId::ONE), (sign, rest)] = terms[..] else {
                continue;
            };
            let Some((inner, angle, power)) = self.function_power(rest) else {
                continue;
            };
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
                _ => continue,
            };
            let mut powers = factors
                .iter()
                .filter_map(|other| self.function_power(*other));
            if !powers.any(|(f, of, n)| (f, of) == (partner, angle) && n * wanted > 0) {
                continue;
            }
            let angle_of_new = self.scale(multiple, angle);
            let mut merged = factors.clone();
            merged[place] = self.apply_power(new.0, angle_of_new, new.1);
            merged.push(self.apply_power(partner, angle, -wanted));
            let product = self.product(&merged);
            return self.scale(scale, product);
        }
        expr
    }
}
