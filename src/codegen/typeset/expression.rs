//! From canonical expressions to the typeset tree: fractions, roots, parentheses
//! and the order in which readers expect factors and terms.

use std::cmp::Ordering;

use crate::equations::Equations;
use crate::model::{LatentVariable, MAX_LATENT_DIM};
use crate::symbolic::{ExprId, ExprPool, Function, Node, Number, SymbolId};

use super::decimal::Decimal;
use super::symbols::SymbolTable;
use super::tree::{Glyph, Math, Signed};

/// Lays out an expression over the variables of a latent model.
///
/// # Panics
/// If the expression has a symbol that is no variable of a latent model, such as `x`; libraries of models refuse these.
pub fn expression(pool: &ExprPool, expr: ExprId, symbols: &SymbolTable) -> Signed {
    Layout { pool, symbols }.signed(expr)
}

/// Lays out all terms of equations, each with its text.
pub(super) fn terms<'e>(
    equations: &'e Equations<'_>,
    symbols: &SymbolTable,
) -> Vec<(&'e str, Signed)> {
    let layout = |expr| expression(equations.pool(), expr, symbols);
    let terms = equations.terms().iter();
    terms
        .map(|term| (term.text(), layout(term.expr())))
        .collect()
}

/// Puts a coefficient before a term: `0.36` and `sin(dz1)` to `0.36 sin(dz1)`.
/// The coefficient takes the place of a term or numerator that is one; one that `is_omitted` prints its
/// sign alone.
pub(super) fn with_coefficient(coefficient: &Decimal, is_omitted: bool, term: Signed) -> Signed {
    let number = Math::Number(coefficient.magnitude());
    let math = match term.math {
        Math::Number(one) if one.is_one() => number,
        sum @ Math::Sum(_) if is_omitted => Math::Group(Box::new(sum)),
        math if is_omitted => math,
        Math::Fraction(top, bottom) if is_one(&top) => Math::Fraction(Box::new(number), bottom),
        sum @ Math::Sum(_) => product(vec![number, Math::Group(Box::new(sum))]),
        Math::Product(mut factors) => {
            factors.insert(0, number);
            product(factors)
        }
        math => product(vec![number, math]),
    };
    Signed {
        negative: coefficient.is_negative() != term.negative,
        math,
    }
}

struct Layout<'a> {
    pool: &'a ExprPool,
    symbols: &'a SymbolTable,
}

/// What a factor is sorted by: kind first, then variable, then exponent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum FactorKey {
    Number,
    Variable(LatentVariable),
    Group,
    Function,
}

/// Numerator, denominator and sign of a product.
#[derive(Default)]
struct Quotient {
    negative: bool,
    numbers: Vec<Math>,
    top: Vec<(FactorKey, Math)>,
    bottom: Vec<(FactorKey, Math)>,
}

impl Layout<'_> {
    fn signed(&self, expr: ExprId) -> Signed {
        match self.pool.node(expr) {
            Node::Sum(terms) => self.sum(terms),
            Node::Product(factors) => self.quotient(factors),
            Node::Number(_) | Node::Symbol(_) | Node::Power(..) | Node::Apply(..) => {
                self.quotient(&[expr])
            }
        }
    }

    fn sum(&self, terms: &[ExprId]) -> Signed {
        let mut order: Vec<ExprId> = terms.to_vec();
        order.sort_by(|a, b| self.compare_terms(*a, *b));
        let laid_out = |term| {
            let signed = self.signed(term);
            // A sum inside a sum does not occur in canonical form; brackets keep it right.
            let math = match signed.math {
                sum @ Math::Sum(_) => Math::Group(Box::new(sum)),
                math => math,
            };
            Signed { math, ..signed }
        };
        let mut terms: Vec<Signed> = order.into_iter().map(laid_out).collect();
        // z_1 - 1 rather than -1 + z_1.
        if let Some(positive) = terms.iter().position(|term| !term.negative) {
            terms[..=positive].rotate_right(1);
        }
        Signed::plus(Math::Sum(terms))
    }

    /// Constants first, then monomials by degree and variables, then the rest as the pool has it.
    fn compare_terms(&self, a: ExprId, b: ExprId) -> Ordering {
        match (self.monomial(a), self.monomial(b)) {
            (Some(a), Some(b)) => a.len().cmp(&b.len()).then_with(|| a.cmp(&b)),
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (None, None) => Ordering::Equal,
        }
    }

    /// The variables of a monomial, each as often as its exponent says.
    fn monomial(&self, expr: ExprId) -> Option<Vec<LatentVariable>> {
        let one = [expr];
        let factors: &[ExprId] = match self.pool.node(expr) {
            Node::Product(factors) => factors,
            _other => &one,
        };
        let mut variables = Vec::new();
        for factor in factors {
            let (base, times) = match self.pool.node(*factor) {
                Node::Number(_) => continue,
                Node::Power(base, exponent) => (*base, self.small_power(*exponent)?),
                _other => (*factor, 1),
            };
            let Node::Symbol(symbol) = self.pool.node(base) else {
                return None;
            };
            variables.extend(std::iter::repeat_n(self.variable(*symbol)?, times));
        }
        variables.sort();
        Some(variables)
    }

    fn small_power(&self, exponent: ExprId) -> Option<usize> {
        let integer = self.pool.as_number(exponent)?.as_integer()?;
        usize::try_from(integer).ok().filter(|power| *power <= 64)
    }

    fn quotient(&self, factors: &[ExprId]) -> Signed {
        let mut parts = Quotient::default();
        for factor in factors {
            match self.pool.node(*factor) {
                Node::Number(number) => self.take_number(*number, &mut parts),
                Node::Power(base, exponent) => self.take_power(*base, *exponent, &mut parts),
                _other => parts.top.push(self.factor(*factor)),
            }
        }
        if parts.negative {
            let mut factors = parts.top.iter_mut().chain(&mut parts.bottom);
            parts.negative = !factors.any(|(_, factor)| turn_difference(factor));
        }
        parts.assemble()
    }

    fn take_number(&self, number: Number, parts: &mut Quotient) {
        parts.negative ^= number.is_negative();
        let size = number.abs();
        match size.as_rational() {
            Some((top, bottom)) => {
                if top != 1 {
                    parts.numbers.push(integer(top));
                }
                if bottom != 1 {
                    parts.bottom.push((FactorKey::Number, integer(bottom)));
                }
            }
            None => (parts.numbers).push(Math::Number(Decimal::exact(size.to_f64()))),
        }
    }

    fn take_power(&self, base: ExprId, exponent: ExprId, parts: &mut Quotient) {
        match self.pool.as_number(exponent) {
            Some(number) => {
                let side = match number.is_negative() {
                    true => &mut parts.bottom,
                    false => &mut parts.top,
                };
                side.push(self.numeric_power(base, number.abs()));
            }
            None => {
                let exponent = self.signed(exponent).into_math();
                let (key, base) = self.base(base);
                let power = Math::Power(Box::new(base), Box::new(exponent));
                parts.top.push((key, power));
            }
        }
    }

    /// `base ^ exponent` for a positive number: a root, a power on the function's
    /// name, or a plain power.
    fn numeric_power(&self, base: ExprId, exponent: Number) -> (FactorKey, Math) {
        if exponent.is_one() {
            return self.factor(base);
        }
        let exponent = match exponent.as_rational() {
            // Where a base may be negative its odd root is read as negative, its power is nothing.
            Some((1, index @ (2 | 4 | 6 | 8))) => {
                let inner = self.signed(base).into_math();
                let index = (index != 2).then_some(index as u32);
                return (FactorKey::Function, Math::Root(Box::new(inner), index));
            }
            Some((power, 1)) => match self.pool.node(base) {
                // The pool keeps x^(3/2) as sqrt(x)^3.
                Node::Apply(Function::Sqrt, radicand) => {
                    let (key, base) = self.base(*radicand);
                    let half = Math::Slash(Box::new(integer(power)), Box::new(integer(2)));
                    return (key, Math::Power(Box::new(base), Box::new(half)));
                }
                Node::Apply(function, argument) => {
                    return self.powered_function(*function, *argument, power);
                }
                _other => integer(power),
            },
            Some((top, bottom)) => Math::Slash(Box::new(integer(top)), Box::new(integer(bottom))),
            None => Math::Number(Decimal::exact(exponent.to_f64())),
        };
        let (key, base) = self.base(base);
        (key, Math::Power(Box::new(base), Box::new(exponent)))
    }

    /// `sin(x)^2` with the power on the name; on the whole for functions that do not allow it.
    fn powered_function(
        &self,
        function: Function,
        argument: ExprId,
        power: i64,
    ) -> (FactorKey, Math) {
        let power = Box::new(integer(power));
        let math = match has_power_on_name(function) {
            true => {
                let argument = Box::new(self.signed(argument).into_math());
                Math::Function(function, Some(power), argument)
            }
            // The power of exp(x) without parentheses could be read as one of x.
            false => {
                let base = match self.apply(function, argument) {
                    math @ Math::Function(..) => Math::Group(Box::new(math)),
                    // bars and roots show themselves where they end
                    math => math,
                };
                Math::Power(Box::new(base), power)
            }
        };
        (FactorKey::Function, math)
    }

    /// `expr` as the base of a power, in parentheses where it needs them.
    fn base(&self, expr: ExprId) -> (FactorKey, Math) {
        let (key, math) = self.factor(expr);
        let math = match math {
            Math::Number(ref number) if number.exponent().is_some() => Math::Group(Box::new(math)),
            Math::Product(_)
            | Math::Sum(_)
            | Math::Fraction(..)
            | Math::Slash(..)
            | Math::Power(..)
            | Math::Root(..)
            | Math::Function(..) => Math::Group(Box::new(math)),
            Math::Number(_) | Math::Symbol(_) | Math::Dot | Math::Absolute(_) | Math::Group(_) => {
                math
            }
        };
        (key, math)
    }

    /// One factor of a product, with parentheses around sums and signs.
    fn factor(&self, expr: ExprId) -> (FactorKey, Math) {
        match self.pool.node(expr) {
            Node::Symbol(symbol) => {
                let variable = self.variable(*symbol);
                let variable = variable.expect("terms mention the model's variables only");
                let math = Math::Symbol(self.symbols.symbol(variable));
                (FactorKey::Variable(variable), math)
            }
            Node::Apply(function, argument) => {
                (FactorKey::Function, self.apply(*function, *argument))
            }
            Node::Number(_) | Node::Sum(_) | Node::Product(_) | Node::Power(..) => {
                match self.signed(expr) {
                    Signed {
                        negative: false,
                        math: math @ Math::Number(_),
                    } => (FactorKey::Number, math),
                    Signed {
                        negative: false,
                        math,
                    } if !matches!(math, Math::Sum(_)) => (FactorKey::Group, math),
                    other => (FactorKey::Group, Math::Group(Box::new(other.into_math()))),
                }
            }
        }
    }

    fn variable(&self, symbol: SymbolId) -> Option<LatentVariable> {
        LatentVariable::from_name(self.pool.symbol_name(symbol), MAX_LATENT_DIM)
    }

    fn apply(&self, function: Function, argument: ExprId) -> Math {
        let argument = Box::new(self.signed(argument).into_math());
        match function {
            Function::Sqrt => Math::Root(argument, None),
            Function::Abs => Math::Absolute(argument),
            named => Math::Function(named, None, argument),
        }
    }
}

impl Quotient {
    fn assemble(mut self) -> Signed {
        self.top.sort_by_key(|(key, _)| *key);
        self.bottom.sort_by_key(|(key, _)| *key);
        let mut top = self.numbers;
        top.extend(self.top.into_iter().map(|(_, math)| math));
        if top.is_empty() {
            top.push(integer(1));
        }
        let top = product(top);
        let math = if self.bottom.is_empty() {
            top
        } else {
            let bottom = product(self.bottom.into_iter().map(|(_, math)| math).collect());
            Math::Fraction(Box::new(bare(top)), Box::new(bare(bottom)))
        };
        Signed {
            negative: self.negative,
            math,
        }
    }
}

/// Changes the sign of `(1 - z_1)`, which is then `(z_1 - 1)`; other factors stay.
fn turn_difference(factor: &mut Math) -> bool {
    let Math::Group(inner) = factor else {
        return false;
    };
    let Math::Sum(terms) = inner.as_mut() else {
        return false;
    };
    let is_constant = |term: &Signed| matches!(term.math, Math::Number(_));
    let is_difference = terms[0].negative != terms[1].negative
        && is_constant(&terms[0])
        && terms[1..].iter().all(|term| term.negative);
    if is_difference {
        terms.rotate_left(1);
        (terms.iter_mut()).for_each(|term| term.negative = !term.negative);
    }
    is_difference
}

/// A numerator or denominator needs no parentheses of its own.
fn bare(math: Math) -> Math {
    match math {
        Math::Group(inner) => *inner,
        math => math,
    }
}

/// Factors side by side, with a dot where digits or words would run together; dots among the factors, as a
/// product that is extended has them, are set anew.
fn product(factors: Vec<Math>) -> Math {
    let mut laid_out: Vec<Math> = Vec::with_capacity(factors.len());
    for factor in factors {
        if matches!(factor, Math::Dot) {
            continue;
        }
        let runs_together = laid_out.last().is_some_and(|before| {
            factor.starts_with_digit() || (ends_with_word(before) && starts_with_word(&factor))
        });
        if runs_together {
            laid_out.push(Math::Dot);
        }
        laid_out.push(factor);
    }
    match laid_out.len() {
        1 => laid_out.swap_remove(0),
        _ => Math::Product(laid_out),
    }
}

fn starts_with_word(math: &Math) -> bool {
    match math {
        Math::Symbol(symbol) => matches!(symbol.glyph, Glyph::Word(_)),
        Math::Power(base, _) => starts_with_word(base),
        _other => false,
    }
}

fn ends_with_word(math: &Math) -> bool {
    matches!(math, Math::Symbol(symbol) if symbol.subscript.is_empty()) && starts_with_word(math)
}

/// Whether the power of a function is written on its name, as in `sin^2`.
fn has_power_on_name(function: Function) -> bool {
    use Function::{Abs, Cos, Exp, Log, Sign, Sin, Sqrt, Tan, Tanh};
    match function {
        Sin | Cos | Tan | Tanh | Log => true,
        Exp | Sqrt | Abs | Sign => false,
    }
}

fn integer(value: i64) -> Math {
    Math::Number(Decimal::integer(value))
}

fn is_one(math: &Math) -> bool {
    matches!(math, Math::Number(number) if number.is_one())
}
