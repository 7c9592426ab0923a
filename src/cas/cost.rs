//! Length of an expression for a reader; a shared part counts as often as it is written.
//!
//! | counts | |
//! |---|---|
//! | 4 | a term that is added, with its sign; 2 inside the argument of a function |
//! | 3 | the name of a function |
//! | 3 | a function among the factors of another one's argument, in addition to its name |
//! | 2 | a pair of parentheses, a whole number before a term inside a sum |
//! | 2 | a fraction below the bar of another |
//! | 1 | a whole number before a term of an argument |
//! | 1 | a symbol, a power, a fraction bar, a digit of a coefficient (at most three) |

use super::*;

/// Of an added term, and of one inside a function's argument.
const TERM: u64 = 4;
const INNER_TERM: u64 = 2;
const FUNCTION: u64 = 3;
const PARENTHESES: u64 = 2;
const NESTED: u64 = 2;
const MOST_DIGITS: usize = 3;

#[derive(Clone, Debug, Default)]
pub(super) struct Costs {
    known: IdMap<u64>,
}

impl Costs {
    pub(super) fn of(&mut self, pool: &ExprPool, expr: ExprId) -> u64 {
        let terms = pool.terms_of(expr).into_iter();
        self.of_terms(pool, terms.map(|(number, rest)| (number.to_f64(), rest)))
    }

    /// The length of `sum coefficient * expr`, each term written after its coefficient.
    pub(super) fn of_terms(
        &mut self,
        pool: &ExprPool,
        terms: impl IntoIterator<Item = (f64, ExprId)>,
    ) -> u64 {
        let lengths = terms.into_iter().map(|(coefficient, expr)| {
            let is_number = expr == ExprId::ONE;
            let body = if is_number {
                0
            } else {
                self.of_factor(pool, expr)
            };
            body.saturating_add(TERM + digits(coefficient))
        });
        lengths.fold(0, u64::saturating_add)
    }

    fn of_factor(&mut self, pool: &ExprPool, expr: ExprId) -> u64 {
        let is_new = |node| !self.known.contains_key(&node);
        for node in pool.walk(&[expr], is_new, |_| true) {
            let length = pool.length_of_node(node, |operand| self.known[&operand]);
            self.known.insert(node, length);
        }
        pool.as_factor(expr, self.known[&expr])
    }
}

impl ExprPool {
    /// The length of a node, without additions by the sum around it.
    fn length_of_node(&self, expr: ExprId, length_of: impl Fn(ExprId) -> u64) -> u64 {
        let factor = |operand: ExprId| self.as_factor(operand, length_of(operand));
        match self.node(expr) {
            Node::Number(number) => length_of_number(*number),
            Node::Symbol(_) => 1,
            Node::Sum(terms) => {
                (terms.iter().map(|term| length_of(*term))).fold(0, u64::saturating_add)
            }
            Node::Product(factors) => {
                (factors.iter().map(|operand| factor(*operand))).fold(0, u64::saturating_add)
            }
            Node::Power(base, exponent) => {
                // The power of exp(x) stands outside parentheses.
                let power = match self.node(*base) {
                    Node::Apply(Function::Exp, _) => 1 + PARENTHESES,
                    _ => 1,
                };
                let is_below = |factor: &ExprId| {
                    let (_, exponent) = self.base_and_exponent(*factor);
                    matches!(exponent, Exponent::Number(number) if number.is_negative())
                };
                let nested = match (self.node(*base), self.as_number(*exponent)) {
                    (Node::Sum(terms), Some(number)) if number.is_negative() => {
                        let factors = terms.iter().flat_map(|term| self.factors_of(*term));
                        NESTED * factors.filter(|factor| is_below(factor)).count() as u64
                    }
                    _ => 0,
                };
                let exponent = match self.as_integer(*exponent) {
                    Some(1 | -1) => 1,
                    Some(integer) => power + u64::from(integer < 0),
                    None => FUNCTION + length_of(*exponent),
                };
                factor(*base).saturating_add(exponent + nested)
            }
            Node::Apply(_, argument) => {
                let connectors = INNER_TERM * (self.n_terms(*argument) - 1);
                // Multiples of angles are read at a glance.
                let numbers = self.terms_of(*argument).into_iter();
                let multiples = numbers.filter_map(|(number, _)| number.abs().as_integer());
                let multiple = multiples.filter(|number| *number > 1).count() as u64;
                let nested = FUNCTION * self.n_functions(*argument);
                length_of(*argument).saturating_add(FUNCTION + connectors + nested - multiple)
            }
        }
    }

    /// Length of an operand of a product or power: sums stand in parentheses.
    fn as_factor(&self, expr: ExprId, length: u64) -> u64 {
        match self.n_terms(expr) {
            1 => length,
            n => length.saturating_add(TERM * (n - 1) + PARENTHESES),
        }
    }

    fn n_functions(&self, expr: ExprId) -> u64 {
        let of_term = |term: &ExprId| {
            let powers = self.factors_of(*term).iter();
            powers.filter_map(|f| self.function_power(*f)).count() as u64
        };
        self.summands_of(expr).iter().map(of_term).sum()
    }

    fn n_terms(&self, expr: ExprId) -> u64 {
        self.summands_of(expr).len() as u64
    }
}

fn length_of_number(number: Number) -> u64 {
    match number.abs().as_rational() {
        Some((1, 1)) => 0,
        Some((_, 1) | (1, _)) => 2,
        _ => 3,
    }
}

fn digits(coefficient: f64) -> u64 {
    let text = format!("{:e}", coefficient.abs());
    let mantissa = text.split('e').next().unwrap_or_default();
    let digits = mantissa.bytes().filter(u8::is_ascii_digit).count();
    digits.min(MOST_DIGITS) as u64
}
