//! From canonical expressions to the typeset tree, with factors and terms in the order that readers expect.

use super::*;

/// Lays out an expression over the variables of a latent model. [`Rounding::Significant`] also rounds the factors in
/// arguments of functions, which units leave there; other roundings are of coefficients alone.
///
/// # Panics
/// If it has a symbol that is no such variable; libraries of models refuse these.
pub(crate) fn expression(
    pool: &ExprPool,
    expr: ExprId,
    symbols: &SymbolTable,
    rounding: Rounding,
) -> Signed {
    let layout = Layout {
        pool,
        symbols,
        rounding,
    };
    layout.signed(expr)
}

pub(super) fn terms<'e>(
    equations: &'e Equations<'_>,
    symbols: &SymbolTable,
    rounding: Rounding,
) -> Vec<(&'e str, Signed)> {
    let layout = |expr| expression(&equations.pool, expr, symbols, rounding);
    let terms = equations.terms.iter();
    terms
        .map(|term| (term.text.as_str(), layout(term.expr)))
        .collect()
}

/// Whether `rounding` changes a factor inside one of these terms.
pub(super) fn are_rounded(
    terms: &[(&str, Signed)],
    equations: &Equations<'_>,
    symbols: &SymbolTable,
) -> bool {
    terms != self::terms(equations, symbols, Rounding::Exact)
}

/// Puts a coefficient before a term: `0.36` and `sin(dz1)` to `0.36 sin(dz1)`. The coefficient replaces a term or
/// numerator equal to one; if `is_omitted`, only its sign is printed.
pub(super) fn with_coefficient(coefficient: &Decimal, is_omitted: bool, term: Signed) -> Signed {
    let number = Math::Number(coefficient.magnitude());
    let math = match term.math {
        Math::Number(one) if one.is_one() => number,
        math if is_omitted => in_brackets(math),
        Math::Fraction(top, bottom) if is_one(&top) => Math::Fraction(Box::new(number), bottom),
        Math::Product(mut factors) => {
            factors.insert(0, number);
            product(factors)
        }
        math => product(vec![number, in_brackets(math)]),
    };
    Signed {
        negative: coefficient.negative != term.negative,
        math,
    }
}

struct Layout<'a> {
    pool: &'a ExprPool,
    symbols: &'a SymbolTable,
    rounding: Rounding,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum FactorKey {
    Number,
    Variable(LatentVariable),
    Group,
    Function,
}

type Factor = (FactorKey, Math);

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

    fn boxed(&self, expr: ExprId) -> Box<Math> {
        Box::new(self.signed(expr).into_math())
    }

    /// A positive number that is no fraction of integers.
    fn number(&self, size: f64) -> Decimal {
        match self.rounding {
            rounding @ Rounding::Significant(_) => Decimal::rounded(size, rounding),
            Rounding::Adaptive | Rounding::Decimals(_) | Rounding::Exact => Decimal::exact(size),
        }
    }

    /// Constants first, then monomials by degree and variables, then the rest in the pool's order.
    fn sum(&self, terms: &[ExprId]) -> Signed {
        let mut order: Vec<ExprId> = terms.to_vec();
        order.sort_by_cached_key(|&term| {
            let monomial = self.monomial(term);
            let degree = monomial.as_ref().map_or(usize::MAX, Vec::len);
            (degree, monomial)
        });
        let laid_out = |term| {
            let Signed { negative, math } = self.signed(term);
            // A sum inside a sum does not occur in canonical form; brackets keep it correct.
            let math = in_brackets(math);
            Signed { negative, math }
        };
        let mut terms: Vec<Signed> = order.into_iter().map(laid_out).collect();
        // z_1 - 1 rather than -1 + z_1.
        if let Some(positive) = terms.iter().position(|term| !term.negative) {
            terms[..=positive].rotate_right(1);
        }
        Signed::plus(Math::Sum(terms))
    }

    fn monomial(&self, expr: ExprId) -> Option<Vec<LatentVariable>> {
        let bases = self.pool.repeated_factors(expr, 64)?.into_iter();
        let bases = bases.filter(|&base| self.pool.as_number(base).is_none());
        let variables = bases.map(|base| self.variable(self.pool.as_symbol(base)?));
        let mut variables: Vec<LatentVariable> = variables.collect::<Option<_>>()?;
        variables.sort();
        Some(variables)
    }

    fn quotient(&self, factors: &[ExprId]) -> Signed {
        let mut negative = false;
        let mut numbers = Vec::new();
        let (mut top, mut bottom): (Vec<Factor>, Vec<Factor>) = (Vec::new(), Vec::new());
        for &factor in factors {
            match self.pool.node(factor) {
                Node::Number(number) => {
                    negative ^= number.is_negative();
                    let size = number.abs();
                    let unless_one = |value: i64| Some(integer(value)).filter(|_| value != 1);
                    let (over, under) = match size.as_rational() {
                        Some((over, under)) => (unless_one(over), unless_one(under)),
                        // 1.0001 is printed as 1.00, and not left out.
                        None => (Some(Math::Number(self.number(size.to_f64()))), None),
                    };
                    numbers.extend(over);
                    bottom.extend(under.map(|under| (FactorKey::Number, under)));
                }
                Node::Power(base, exponent) => match self.pool.as_number(*exponent) {
                    Some(power) if power.is_negative() => {
                        bottom.push(self.numeric_power(*base, power.abs()));
                    }
                    Some(power) => top.push(self.numeric_power(*base, power)),
                    None => {
                        let exponent = self.boxed(*exponent);
                        let (key, base) = self.base(*base);
                        top.push((key, Math::Power(Box::new(base), exponent)));
                    }
                },
                _other => top.push(self.factor(factor)),
            }
        }
        if negative {
            let mut factors = top.iter_mut().chain(&mut bottom);
            negative = !factors.any(|(_, factor)| turn_difference(factor));
        }
        let in_order = |mut factors: Vec<Factor>| {
            factors.sort_by_key(|(key, _)| *key);
            factors.into_iter().map(|(_, math)| math)
        };
        numbers.extend(in_order(top));
        if numbers.is_empty() {
            numbers.push(integer(1));
        }
        let (top, bottom) = (product(numbers), in_order(bottom).collect::<Vec<_>>());
        let math = match bottom.is_empty() {
            true => top,
            false => Math::Fraction(Box::new(bare(top)), Box::new(bare(product(bottom)))),
        };
        Signed { negative, math }
    }

    /// `base ^ exponent` for a positive number: a root, a power on the function's name, or a plain power.
    fn numeric_power(&self, base: ExprId, exponent: Number) -> Factor {
        if exponent.is_one() {
            return self.factor(base);
        }
        let slash = |top, bottom| Math::Slash(Box::new(integer(top)), Box::new(integer(bottom)));
        let (base, exponent) = match (exponent.as_rational(), self.pool.node(base)) {
            // If a base may be negative, its odd root is a real number and its power is undefined.
            (Some((1, index @ (2 | 4 | 6 | 8))), _) => {
                let index = (index != 2).then_some(index as u32);
                return (FactorKey::Function, Math::Root(self.boxed(base), index));
            }
            // The pool keeps x^(3/2) as sqrt(x)^3.
            (Some((power, 1)), Node::Apply(Function::Sqrt, radicand)) => {
                (*radicand, slash(power, 2))
            }
            (Some((power, 1)), Node::Apply(function, argument)) => {
                let math = self.powered_function(*function, *argument, integer(power));
                return (FactorKey::Function, math);
            }
            (Some((power, 1)), _) => (base, integer(power)),
            (Some((top, bottom)), _) => (base, slash(top, bottom)),
            (None, _) => (base, Math::Number(Decimal::exact(exponent.to_f64()))),
        };
        let (key, base) = self.base(base);
        (key, Math::Power(Box::new(base), Box::new(exponent)))
    }

    /// `sin(x)^2` with the power on the name; on the whole for functions that do not allow it.
    fn powered_function(&self, function: Function, argument: ExprId, power: Math) -> Math {
        use Function::{Abs, Exp, Sign, Sqrt};
        if !matches!(function, Exp | Sqrt | Abs | Sign) {
            return Math::Function(function, Some(Box::new(power)), self.boxed(argument));
        }
        // The power of exp(x) without parentheses could be read as one of x.
        let base = match self.apply(function, argument) {
            math @ Math::Function(..) => Math::Group(Box::new(math)),
            // bars and roots show their own extent
            math => math,
        };
        Math::Power(Box::new(base), Box::new(power))
    }

    /// `expr` as the base of a power, in parentheses where it needs them.
    fn base(&self, expr: ExprId) -> Factor {
        let (key, math) = self.factor(expr);
        let is_whole = match &math {
            Math::Number(number) => number.exponent.is_none(),
            Math::Symbol(_) | Math::Dot | Math::Absolute(_) | Math::Group(_) => true,
            _other => false,
        };
        match is_whole {
            true => (key, math),
            false => (key, Math::Group(Box::new(math))),
        }
    }

    fn factor(&self, expr: ExprId) -> Factor {
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
                match self.signed(expr).into_math() {
                    math @ Math::Number(_) => (FactorKey::Number, math),
                    math => (FactorKey::Group, in_brackets(math)),
                }
            }
        }
    }

    fn variable(&self, symbol: SymbolId) -> Option<LatentVariable> {
        LatentVariable::from_name(self.pool.symbol_name(symbol), MAX_LATENT_DIM)
    }

    fn apply(&self, function: Function, argument: ExprId) -> Math {
        let argument = self.boxed(argument);
        match function {
            Function::Sqrt => Math::Root(argument, None),
            Function::Abs => Math::Absolute(argument),
            named => Math::Function(named, None, argument),
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

/// A sum in parentheses; anything else as it is.
fn in_brackets(math: Math) -> Math {
    match math {
        sum @ Math::Sum(_) => Math::Group(Box::new(sum)),
        math => math,
    }
}

/// A numerator or denominator needs no parentheses of its own.
fn bare(math: Math) -> Math {
    match math {
        Math::Group(inner) => *inner,
        math => math,
    }
}

/// Factors side by side, with a dot where digits or words would run together; other dots among them are dropped.
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

fn integer(value: i64) -> Math {
    Math::Number(Decimal::integer(value))
}

fn is_one(math: &Math) -> bool {
    matches!(math, Math::Number(number) if number.is_one())
}
