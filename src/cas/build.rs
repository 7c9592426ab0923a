//! Canonical constructors of numbers, sums and products.

use super::number::exact_sum;
use super::power::half_integer;
use super::*;

/// Bound on passes over operands that become flat only after collecting: each removes a level, two or three suffice.
const MAX_PASSES: usize = 64;

impl ExprPool {
    /// A constant; integral values up to `2^53` become exact integers.
    ///
    /// # Panics
    /// If `value` is NaN or infinite: values are checked where they enter the program.
    pub fn number(&mut self, value: f64) -> ExprId {
        let number = Number::from_f64(value).expect("constants of expressions are finite");
        self.constant(number)
    }

    pub fn integer(&mut self, value: i64) -> ExprId {
        self.constant(Number::integer(value))
    }

    pub fn constant(&mut self, number: Number) -> ExprId {
        let number = match self.is_exact {
            true => half_integer(number),
            false => number,
        };
        self.intern(Node::Number(number))
    }

    pub fn add(&mut self, a: ExprId, b: ExprId) -> ExprId {
        self.sum(&[a, b])
    }

    /// `a - b`.
    pub(crate) fn sub(&mut self, a: ExprId, b: ExprId) -> ExprId {
        let minus_b = self.neg(b);
        self.sum(&[a, minus_b])
    }

    /// `-a`, distributed over the terms of a sum.
    pub fn neg(&mut self, a: ExprId) -> ExprId {
        self.scale(Number::MINUS_ONE, a)
    }

    pub(super) fn negated_if(&mut self, condition: bool, a: ExprId) -> ExprId {
        if condition { self.neg(a) } else { a }
    }

    pub fn mul(&mut self, a: ExprId, b: ExprId) -> ExprId {
        self.product(&[a, b])
    }

    /// `a / b`; the quotient of two numbers is rounded once. Division by zero stays symbolic.
    pub(crate) fn div(&mut self, a: ExprId, b: ExprId) -> ExprId {
        if let Some(divisor) = self.as_number(b) {
            let (coefficient, rest) = self.split(a);
            if let Some(quotient) = self.folded(coefficient.checked_div(divisor)) {
                return self.scale(quotient, rest);
            }
        }
        let reciprocal = self.powi(b, -1);
        self.product(&[a, reciprocal])
    }

    /// The sum of all operands: flat, like terms collected, sorted. Coefficients of like terms are added exactly and
    /// rounded once, so the result does not depend on the order of `operands`. Other coefficients keep their bits.
    pub fn sum(&mut self, operands: &[ExprId]) -> ExprId {
        let mut terms = Vec::with_capacity(operands.len());
        for &operand in operands {
            self.push_terms(operand, &mut terms);
        }
        self.sum_of_terms(terms)
    }

    /// The sum of `coefficient * rest` over `terms`, where no rest has a numeric factor.
    pub(super) fn sum_of_terms(&mut self, terms: Vec<(Number, ExprId)>) -> ExprId {
        let mut terms = terms;
        self.spend(terms.len());
        for _ in 0..MAX_PASSES {
            terms = self.collected(terms);
            // Collecting may leave `1 * (a + b)`, which belongs into this sum.
            let nested = |&(coefficient, rest): &(Number, ExprId)| {
                coefficient.abs().is_one() && matches!(self.node(rest), Node::Sum(_))
            };
            if !terms.iter().any(nested) {
                break;
            }
            let mut flat = Vec::with_capacity(terms.len());
            for (coefficient, rest) in terms {
                let term = self.scale(coefficient, rest);
                self.push_terms(term, &mut flat);
            }
            terms = flat;
        }
        terms.sort_by(|a, b| self.compare(a.1, b.1).then(a.0.cmp(&b.0)));
        let terms = terms
            .into_iter()
            .map(|(number, rest)| self.scale(number, rest));
        match terms.collect::<Vec<_>>().as_slice() {
            [] => ExprId::ZERO,
            [only] => *only,
            terms => self.intern(Node::Sum(terms.into())),
        }
    }

    fn collected(&self, mut terms: Vec<(Number, ExprId)>) -> Vec<(Number, ExprId)> {
        terms.sort_by_key(|(_, rest)| *rest);
        let add = |a: Number, b| self.folded(a.checked_add(b));
        let mut collected = Vec::with_capacity(terms.len());
        for group in terms.chunk_by(|a, b| a.1 == b.1) {
            if let [only] = group {
                collected.push(*only);
                continue;
            }
            let numbers: Vec<Number> = group.iter().map(|(coefficient, _)| *coefficient).collect();
            if let Some(sum) = exact_sum(&numbers).filter(|_| !self.is_exact) {
                collected.push((sum, group[0].1));
                continue;
            }
            let sums = fold(numbers, add, Number::is_negative);
            collected.extend(sums.into_iter().map(|sum| (sum, group[0].1)));
        }
        collected.retain(|(coefficient, _)| !coefficient.is_zero());
        collected
    }

    fn push_terms(&self, expr: ExprId, terms: &mut Vec<(Number, ExprId)>) {
        terms.extend(self.summands_of(expr).iter().map(|term| self.split(*term)));
    }

    /// `coefficient * expr`; a factor of `1` or `-1` goes into the terms of a sum.
    pub fn scale(&mut self, coefficient: Number, expr: ExprId) -> ExprId {
        if coefficient.is_zero() {
            return ExprId::ZERO;
        }
        if coefficient.is_one() {
            return expr;
        }
        let (inner, rest) = self.split(expr);
        let Some(coefficient) = self.folded(coefficient.checked_mul(inner)) else {
            let factor = self.constant(coefficient);
            return self.product(&[factor, expr]);
        };
        match self.node(rest) {
            _ if coefficient.is_one() => rest,
            Node::Number(number) if number.is_one() => self.constant(coefficient),
            Node::Sum(terms) if coefficient == Number::MINUS_ONE => {
                // The order of terms ignores coefficients: negating keeps it.
                let terms = terms.clone();
                let negated = terms.iter().map(|term| self.neg(*term)).collect();
                self.intern(Node::Sum(negated))
            }
            _ => {
                let factor = self.constant(coefficient);
                if self.starts_negative(rest) || self.is_unfolded(rest) {
                    return self.product(&[factor, rest]);
                }
                let factors = self.factors_of(rest).iter().copied();
                let all = std::iter::once(factor).chain(factors).collect();
                self.intern(Node::Product(all))
            }
        }
    }

    fn is_unfolded(&self, expr: ExprId) -> bool {
        match self.node(expr) {
            Node::Product(factors) => {
                self.as_number(factors[0]).is_some() && self.as_number(factors[1]).is_some()
            }
            _ => false,
        }
    }

    pub(super) fn starts_negative(&self, expr: ExprId) -> bool {
        self.split(self.summands_of(expr)[0]).0.is_negative()
    }

    /// An expression as a number times the rest that all its multiples share: `x - 2*y` for `2*x - 4*y`.
    pub(super) fn content(&mut self, expr: ExprId) -> (Number, ExprId) {
        let (mut number, mut rest) = self.split(expr);
        loop {
            let terms = self.terms_of(rest);
            let first = terms.first().map_or(Number::ONE, |term| term.0);
            if terms.len() < 2 || first.is_one() {
                return (number, rest);
            }
            let quotients = (terms.iter()).map(|&(n, rest)| Some((n.checked_div(first)?, rest)));
            let (Some(terms), Some(product)) = (quotients.collect(), number.checked_mul(first))
            else {
                return (number, rest);
            };
            // A part that is no longer multiplied may be a sum itself.
            (number, rest) = (product, self.sum_of_terms(terms));
        }
    }

    /// The product of all operands: flat, powers of like bases collected, sorted. Sums are not multiplied out.
    pub fn product(&mut self, operands: &[ExprId]) -> ExprId {
        if let &[a, b] = operands {
            // Scaling is by far the most frequent product and needs no sorting.
            for (number, other) in [(a, b), (b, a)] {
                if let Some(number) = self.as_number(number)
                    && !self.starts_negative(other)
                    && !self.is_unfolded(other)
                    && let (inner, _) = self.split(other)
                    && self.folded(number.checked_mul(inner)).is_some()
                {
                    return self.scale(number, other);
                }
            }
        }
        let mut numbers = Vec::new();
        let mut pending: Vec<ExprId> = operands.to_vec();
        let mut factors = Vec::new();
        for _ in 0..MAX_PASSES {
            let mut powers = Vec::new();
            for factor in pending.drain(..) {
                self.push_factors(factor, &mut numbers, &mut powers);
            }
            self.collect_powers(powers, &mut factors, &mut pending);
            if pending.is_empty() {
                break;
            }
            pending.append(&mut factors);
        }
        factors.append(&mut pending);
        self.assemble_product(numbers, factors)
    }

    fn push_factors(
        &mut self,
        expr: ExprId,
        numbers: &mut Vec<Number>,
        powers: &mut Vec<(ExprId, Exponent)>,
    ) {
        for factor in self.factors_of(expr).to_vec() {
            if let Some(number) = self.as_number(factor) {
                numbers.push(number);
                continue;
            }
            let (base, exponent) = self.base_and_exponent(factor);
            match exponent {
                Exponent::Number(number)
                    if number.as_integer().is_some()
                        && matches!(self.node(base), Node::Sum(_))
                        && self.starts_negative(base) =>
                {
                    if !number.is_even() {
                        numbers.push(Number::MINUS_ONE);
                    }
                    powers.push((self.neg(base), exponent));
                }
                _ => powers.push((base, exponent)),
            }
        }
    }

    /// Adds the exponents of equal bases. A result that is no longer a power of its base (`sqrt(2)^2`) goes to `again`.
    fn collect_powers(
        &mut self,
        mut powers: Vec<(ExprId, Exponent)>,
        factors: &mut Vec<ExprId>,
        again: &mut Vec<ExprId>,
    ) {
        powers.sort_by_key(|(base, _)| *base);
        for group in powers.chunk_by(|a, b| a.0 == b.0) {
            let base = group[0].0;
            let exponent = match group {
                [(_, only)] => *only,
                _ => self.add_exponents(group),
            };
            let power = match exponent {
                Exponent::Number(number) => self.pow_number(base, number),
                Exponent::Expr(exponent) => self.pow(base, exponent),
            };
            let is_number = self.as_number(power).is_some();
            match !is_number && self.base_and_exponent(power) == (base, exponent) {
                _ if power == ExprId::ONE => {}
                true => factors.push(power),
                false => again.push(power),
            }
        }
    }

    fn add_exponents(&mut self, group: &[(ExprId, Exponent)]) -> Exponent {
        let mut terms = Vec::with_capacity(group.len());
        for (_, exponent) in group {
            match exponent {
                Exponent::Number(number) => terms.push((*number, ExprId::ONE)),
                Exponent::Expr(expr) => self.push_terms(*expr, &mut terms),
            }
        }
        let sum = self.sum_of_terms(terms);
        match self.as_number(sum) {
            Some(number) => Exponent::Number(number),
            None => Exponent::Expr(sum),
        }
    }

    fn assemble_product(&mut self, numbers: Vec<Number>, mut factors: Vec<ExprId>) -> ExprId {
        let is_negative = numbers.iter().filter(|n| n.is_negative()).count() % 2 == 1;
        let magnitudes = numbers.into_iter().map(Number::abs).collect();
        let product = |a: Number, b| self.folded(a.checked_mul(b));
        let mut numbers = fold(magnitudes, product, |n| n.to_f64() < 1.0);
        if numbers.iter().any(|number| number.is_zero()) {
            return ExprId::ZERO;
        }
        numbers.retain(|number| !number.is_one());
        if is_negative {
            match numbers.first_mut() {
                Some(first) => *first = -*first,
                None => numbers.push(Number::MINUS_ONE),
            }
        }
        match (numbers.as_slice(), factors.as_slice()) {
            ([], []) => return ExprId::ONE,
            ([], [only]) => return *only,
            ([only], []) => return self.constant(*only),
            ([Number::MINUS_ONE], [only]) => return self.scale(Number::MINUS_ONE, *only),
            // By base alone: bases are distinct, and `x` keeps its place for any exponent.
            _ => factors.sort_by(|a, b| {
                let [a, b] = [a, b].map(|factor| self.base_and_exponent(*factor).0);
                self.compare(a, b)
            }),
        }
        let numbers: Vec<ExprId> = numbers.into_iter().map(|n| self.constant(n)).collect();
        self.intern(Node::Product(numbers.into_iter().chain(factors).collect()))
    }
}

/// Folds numbers in an order that depends on their values alone. Exact numbers come first, then floats from both ends;
/// each float is chosen against the side of the present result, to avoid overflow. Numbers that overflow nevertheless
/// stay separate.
fn fold(
    mut numbers: Vec<Number>,
    combine: impl Fn(Number, Number) -> Option<Number>,
    is_low: impl Fn(Number) -> bool,
) -> Vec<Number> {
    if numbers.len() < 2 {
        return numbers;
    }
    numbers.sort_by_key(|number| (!number.is_exact(), *number));
    let n_exact = numbers.iter().filter(|number| number.is_exact()).count();
    let mut floats = std::collections::VecDeque::from(numbers.split_off(n_exact));
    let mut exact = numbers.into_iter();
    let mut next = |is_low: bool| {
        exact.next().or_else(|| match is_low {
            true => floats.pop_back(),
            false => floats.pop_front(),
        })
    };
    let mut left_over = Vec::new();
    let mut current = next(false).expect("there are two numbers or more");
    while let Some(number) = next(is_low(current)) {
        current = combine(current, number).unwrap_or_else(|| {
            left_over.push(current);
            number
        });
    }
    left_over.push(current);
    left_over.sort_unstable();
    left_over
}
