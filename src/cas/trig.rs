//! Trigonometric identities, each in the direction asked for, in sums, products and integer powers, not in arguments.

use super::region::NARROW;
use super::*;

/// Largest multiple of an angle, and most angles in one argument, that are expanded.
const MAX_MULTIPLE: i64 = 6;
/// Most sines and cosines multiplied in one term that are combined.
const MAX_TRIG_DEGREE: i64 = 8;

/// The unit in which multiples of an angle are counted, by the angle without its coefficient.
type Units = BTreeMap<ExprId, Number>;

impl ExprPool {
    /// `expr` with sines, cosines, tangents of sums and exact multiples by those of single angles, not multiplied out.
    pub(crate) fn expand_angles(&mut self, expr: ExprId) -> ExprId {
        self.expand_angles_like(expr, ExprId::ZERO)
    }

    /// As [`expand_angles`](ExprPool::expand_angles), with multiples of the units common to `other` and `expr`.
    pub(super) fn expand_angles_like(&mut self, expr: ExprId, other: ExprId) -> ExprId {
        let expr = self.rewrite_region(expr, |pool, node| match *pool.node(node) {
            Node::Apply(Function::Tan, argument) => {
                let sine = pool.apply(Function::Sin, argument);
                let cosine = pool.apply_power(Function::Cos, argument, -1);
                pool.product(&[sine, cosine])
            }
            _ => node,
        });
        let mut units = Units::new();
        self.note_units(expr, &mut units);
        self.note_units(other, &mut units);
        self.rewrite_region(expr, |pool, node| match *pool.node(node) {
            Node::Apply(Function::Sin, angle) => pool
                .sine_and_cosine(angle, &units)
                .map_or(node, |(sine, _)| sine),
            Node::Apply(Function::Cos, angle) => pool
                .sine_and_cosine(angle, &units)
                .map_or(node, |(_, cosine)| cosine),
            _ => node,
        })
    }

    fn note_units(&self, expr: ExprId, units: &mut Units) {
        for atom in self.atoms_of(expr) {
            if let Node::Apply(Function::Sin | Function::Cos, argument) = *self.node(atom) {
                for (coefficient, rest) in self.terms_of(argument) {
                    note_unit(units, coefficient, rest);
                }
            }
        }
    }

    /// Sine and cosine of a sum of multiples of units; `None` if there are too many.
    fn sine_and_cosine(&mut self, argument: ExprId, units: &Units) -> Option<(ExprId, ExprId)> {
        let mut multiples: Vec<(Number, ExprId, i64)> = Vec::new();
        let mut total = 0_i64;
        for (coefficient, rest) in self.terms_of(argument) {
            let (unit, multiple) = match units.get(&rest) {
                Some(unit) if coefficient.is_exact() => {
                    (*unit, coefficient.checked_div(*unit)?.as_integer()?)
                }
                _ if coefficient.is_negative() => (-coefficient, -1),
                _ => (coefficient, 1),
            };
            multiples.push((unit, rest, multiple));
            total = total.checked_add(multiple.checked_abs()?)?;
        }
        if total > MAX_MULTIPLE || !self.affords(1) {
            return None;
        }
        let (mut sine, mut cosine) = (ExprId::ZERO, ExprId::ONE);
        for (unit, rest, multiple) in multiples {
            let angle = self.scale(unit, rest);
            let unit_sine = self.apply(Function::Sin, angle);
            let unit_sine = self.negated_if(multiple < 0, unit_sine);
            let unit_cosine = self.apply(Function::Cos, angle);
            for _ in 0..multiple.abs() {
                // sin(a + b) = sin a cos b + cos a sin b; cos(a + b) = cos a cos b - sin a sin b.
                let parts = [
                    self.expanded_product(sine, unit_cosine),
                    self.expanded_product(cosine, unit_sine),
                    self.expanded_product(cosine, unit_cosine),
                    self.expanded_product(sine, unit_sine),
                ];
                sine = self.add(parts[0], parts[1]);
                cosine = self.sub(parts[2], parts[3]);
            }
        }
        Some((sine, cosine))
    }

    pub(super) fn expanded_product(&mut self, a: ExprId, b: ExprId) -> ExprId {
        let product = self.mul(a, b);
        self.expand_node(product, NARROW)
    }

    /// `expr` with powers of sines reduced to the first by `sin(x)^2 = 1 - cos(x)^2`, also below; not multiplied out.
    pub(crate) fn sines_to_cosines(&mut self, expr: ExprId) -> ExprId {
        self.reduce_powers(expr, Function::Sin, Function::Cos, |_| true)
    }

    /// As [`sines_to_cosines`](ExprPool::sines_to_cosines) with the functions exchanged.
    pub(crate) fn cosines_to_sines(&mut self, expr: ExprId) -> ExprId {
        self.reduce_powers(expr, Function::Cos, Function::Sin, |_| true)
    }

    pub(super) fn squared_angles(&self, expr: ExprId) -> Vec<ExprId> {
        let mut angles = Vec::new();
        for (_, rest) in self.terms_of(expr) {
            for factor in self.factors_of(rest) {
                match self.function_power(*factor) {
                    Some((Function::Sin | Function::Cos, angle, power))
                        if power != 1 && !angles.contains(&angle) =>
                    {
                        angles.push(angle);
                    }
                    _ => {}
                }
            }
        }
        angles
    }

    pub(super) fn reduce_powers(
        &mut self,
        expr: ExprId,
        from: Function,
        to: Function,
        is_chosen: impl Fn(ExprId) -> bool,
    ) -> ExprId {
        self.rewrite_region(expr, |pool, node| {
            // Single factors of products were visited before the product.
            if matches!(pool.node(node), Node::Product(_) | Node::Sum(_)) {
                return node;
            }
            let Some((function, argument, exponent)) = pool.function_power(node) else {
                return node;
            };
            if function != from || (0..2).contains(&exponent) || !is_chosen(argument) {
                return node;
            }
            let other_square = pool.apply_power(to, argument, 2);
            let square = pool.sub(ExprId::ONE, other_square);
            let squares = pool.pow_number(square, Number::integer(exponent.div_euclid(2)));
            let single = pool.apply_power(from, argument, exponent.rem_euclid(2));
            pool.product(&[single, squares])
        })
    }

    /// `expr` with products of sines and cosines in outermost terms as sums: `sin(x)^2` is `1/2 - 1/2*cos(2*x)`.
    pub(crate) fn combine_angles(&mut self, expr: ExprId) -> ExprId {
        let terms = self.terms_of(expr);
        let mut combined = Vec::with_capacity(terms.len());
        for (coefficient, rest) in terms {
            let term = self.combine_angles_of_term(rest);
            combined.push(match self.node(term) {
                Node::Sum(_) => {
                    let factor = self.constant(coefficient);
                    self.expanded_product(factor, term)
                }
                _ => self.scale(coefficient, term),
            });
        }
        self.sum(&combined)
    }

    /// As [`combine_angles`](ExprPool::combine_angles), in sums that are factors or divisors too.
    pub(super) fn combine_all_angles(&mut self, expr: ExprId) -> ExprId {
        let inside = self.rewrite_region(expr, |pool, node| match pool.node(node) {
            Node::Sum(_) => pool.combine_angles(node),
            _ => node,
        });
        self.combine_angles(inside)
    }

    /// `1/(a + b*sin(x)) = (a - b*sin(x))/(a^2 - b^2*(1 - cos(x)^2))`, if `x` is the first angle in the sum and all its
    /// sines have the power 1.
    pub(super) fn without_sine_below(&mut self, expr: ExprId) -> ExprId {
        let Some((base, -1)) = self.sum_power(expr) else {
            return expr;
        };
        let terms = self.terms_of(base);
        let sine_of = |pool: &ExprPool, rest: ExprId| {
            pool.factors_of(rest)
                .iter()
                .copied()
                .find(|factor| matches!(pool.function_power(*factor), Some((Function::Sin, _, 1))))
        };
        let Some(sine) = terms.iter().find_map(|(_, rest)| sine_of(self, *rest)) else {
            return expr;
        };
        let (with, without): (Vec<_>, Vec<_>) =
            (terms.into_iter()).partition(|(_, rest)| self.factors_of(*rest).contains(&sine));
        let (with, without) = (self.sum_of_terms(with), self.sum_of_terms(without));
        let other = self.sub(without, with);
        let product = self.mul(other, base);
        let product = self.expand_node(product, NARROW);
        let product = self.sines_to_cosines(product);
        let below = self.rewrite_region(product, |pool, node| pool.expand_node(node, NARROW));
        let below = self.powi(below, -1);
        self.mul(other, below)
    }

    fn combine_angles_of_term(&mut self, rest: ExprId) -> ExprId {
        let (mut others, mut above, mut below) = (Vec::new(), Vec::new(), Vec::new());
        for factor in self.factors_of(rest).to_vec() {
            match self.function_power(factor) {
                Some((function @ (Function::Sin | Function::Cos), argument, exponent))
                    if (1..=MAX_TRIG_DEGREE).contains(&exponent.abs()) =>
                {
                    let waves = if exponent > 0 { &mut above } else { &mut below };
                    waves.extend((0..exponent.abs()).map(|_| (function, argument)));
                }
                _ => others.push(factor),
            }
        }
        // One divisor replaces two: 1/(sin(x)*cos(x)) = 2/sin(2*x).
        let divisor = self.sum_of_waves(&below);
        match divisor.filter(|divisor| !matches!(self.node(*divisor), Node::Sum(_))) {
            Some(divisor) => others.push(self.powi(divisor, -1)),
            None => others.extend((below.iter()).map(|&(f, x)| self.apply_power(f, x, -1))),
        }
        let sum = self.sum_of_waves(&above);
        if sum.is_none() {
            others.extend(above.iter().map(|&(f, x)| self.apply(f, x)));
        }
        let others = self.product(&others);
        match sum {
            Some(sum) => self.expanded_product(others, sum),
            None => others,
        }
    }

    /// A product of at least two sines and cosines as a sum of them.
    fn sum_of_waves(&mut self, waves: &[(Function, ExprId)]) -> Option<ExprId> {
        if waves.len() < 2
            || waves.len() > MAX_TRIG_DEGREE as usize
            || !self.affords(1 << waves.len())
        {
            return None;
        }
        // The product so far, as a sum of sines and cosines.
        let (function, argument) = waves[0];
        let mut sum = vec![(Number::ONE, function, argument)];
        for &(factor, angle) in &waves[1..] {
            let mut next = Vec::with_capacity(2 * sum.len());
            for (coefficient, function, argument) in sum {
                let half = coefficient.checked_mul(Number::HALF).unwrap_or(coefficient);
                let (plus, minus) = (self.add(argument, angle), self.sub(argument, angle));
                let (product, sign_plus, sign_minus) = match (function, factor) {
                    (Function::Sin, Function::Sin) => (Function::Cos, -half, half),
                    (Function::Cos, Function::Sin) => (Function::Sin, half, -half),
                    (Function::Sin, _) => (Function::Sin, half, half),
                    (_, _) => (Function::Cos, half, half),
                };
                next.push((sign_plus, product, plus));
                next.push((sign_minus, product, minus));
            }
            sum = next;
        }
        let mut terms = Vec::with_capacity(sum.len());
        for (coefficient, function, argument) in sum {
            let wave = self.apply(function, argument);
            terms.push(self.scale(coefficient, wave));
        }
        Some(self.sum(&terms))
    }
}

/// Notes a coefficient of `rest`; its unit is the largest exact number of which all exact ones are multiples.
fn note_unit(units: &mut Units, coefficient: Number, rest: ExprId) {
    let Some((numerator, denominator)) = coefficient.abs().as_rational() else {
        return;
    };
    let unit = units.entry(rest).or_insert(Number::ZERO);
    let Some((known_numerator, known_denominator)) = unit.as_rational() else {
        return;
    };
    // gcd(a/b, c/d) = gcd(a d, c b) / (b d)
    let common = || {
        let a = known_numerator.checked_mul(denominator)?;
        let b = numerator.checked_mul(known_denominator)?;
        Number::rational(a.gcd(&b), known_denominator.checked_mul(denominator)?)
    };
    *unit = common().unwrap_or(*unit);
}
