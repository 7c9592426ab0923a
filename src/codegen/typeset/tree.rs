//! The typeset tree: mathematics as it is laid out, before it has a spelling.

use super::decimal::Decimal;
use crate::symbolic::Function;

/// One piece of laid-out mathematics.
///
/// Parentheses ([`Math::Group`]) and multiplication dots ([`Math::Dot`]) are already in place, and signs sit only in
/// [`Signed`], so that a printer chooses spelling and nothing else.
#[derive(Clone, Debug, PartialEq)]
pub enum Math {
    /// A number without sign.
    Number(Decimal),
    /// A variable with its dots and subscript.
    Symbol(Symbol),
    /// Terms with signs; a single negative term is a negated expression.
    Sum(Vec<Signed>),
    /// Factors side by side.
    Product(Vec<Math>),
    /// A visible multiplication sign between two factors of a product.
    Dot,
    /// `numerator / denominator` with a bar.
    Fraction(Box<Math>, Box<Math>),
    /// `numerator / denominator` on the line, for exponents.
    Slash(Box<Math>, Box<Math>),
    /// `base ^ exponent`.
    Power(Box<Math>, Box<Math>),
    /// A root; no index means the square root.
    Root(Box<Math>, Option<u32>),
    /// A function of one argument by its name, with an optional power on that; square roots and magnitudes have forms
    /// of their own.
    Function(Function, Option<Box<Math>>, Box<Math>),
    /// The absolute value.
    Absolute(Box<Math>),
    /// Parentheses.
    Group(Box<Math>),
}

/// A piece of mathematics with the sign in front of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Signed {
    /// Whether a minus stands in front.
    pub negative: bool,
    /// What follows the sign.
    pub math: Math,
}

impl Signed {
    pub(crate) fn plus(math: Math) -> Self {
        Self {
            negative: false,
            math,
        }
    }

    /// The same as one [`Math`]: a negative one becomes a sum of one term.
    pub fn into_math(self) -> Math {
        if self.negative {
            Math::Sum(vec![self])
        } else {
            self.math
        }
    }
}

/// A variable: a glyph, dots above it for time derivatives, and a subscript.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Symbol {
    /// The letter or word.
    pub glyph: Glyph,
    /// How many dots stand above it: 0, 1 or 2.
    pub dots: u8,
    /// The parts of the subscript, printed with commas between them.
    pub subscript: Vec<Glyph>,
}

/// A letter or word inside a symbol.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Glyph {
    /// One Latin letter, italic.
    Letter(char),
    /// A Greek letter, by its place in `GREEK`.
    Greek(usize),
    /// Digits, upright.
    Digits(String),
    /// Two or more letters or digits, upright: a word is no product of its letters.
    Word(String),
}

/// The Greek letters that a symbol can be renamed to: TeX's name and the character.
const GREEK: &str = "
    alpha α beta β gamma γ delta δ epsilon ϵ varepsilon ε zeta ζ eta η theta θ iota ι kappa κ
    lambda λ mu μ nu ν xi ξ pi π rho ρ sigma σ tau τ upsilon υ phi ϕ varphi φ chi χ psi ψ omega ω
    Gamma Γ Delta Δ Theta Θ Lambda Λ Xi Ξ Phi Φ Psi Ψ Omega Ω Sigma Σ
";

pub(super) fn greek() -> impl Iterator<Item = (&'static str, &'static str)> {
    let words = GREEK.split_whitespace();
    words.clone().step_by(2).zip(words.skip(1).step_by(2))
}

pub(super) fn greek_letter(place: usize) -> (&'static str, &'static str) {
    greek().nth(place).expect("a place in the table")
}

/// The name of a function as it is read: `ln` for the natural logarithm, `sgn` for the sign.
pub(super) fn function_name(function: Function) -> &'static str {
    match function {
        Function::Log => "ln",
        Function::Sign => "sgn",
        named => named.name(),
    }
}

impl Math {
    /// Whether it is taller than a line of text, so that delimiters must grow.
    pub(crate) fn is_tall(&self) -> bool {
        match self {
            Math::Number(_) | Math::Symbol(_) | Math::Dot => false,
            Math::Fraction(..) | Math::Root(..) => true,
            Math::Sum(terms) => terms.iter().any(|term| term.math.is_tall()),
            Math::Product(factors) => factors.iter().any(Math::is_tall),
            Math::Slash(a, b) => a.is_tall() || b.is_tall(),
            Math::Power(base, exponent) => base.is_tall() || matches!(**exponent, Math::Power(..)),
            Math::Function(_, _, inner) | Math::Absolute(inner) | Math::Group(inner) => {
                inner.is_tall()
            }
        }
    }

    /// Whether the first thing printed is a digit.
    pub fn starts_with_digit(&self) -> bool {
        match self {
            Math::Number(_) => true,
            Math::Product(factors) => factors.first().is_some_and(Math::starts_with_digit),
            Math::Fraction(top, _) | Math::Slash(top, _) => top.starts_with_digit(),
            Math::Power(base, _) => base.starts_with_digit(),
            Math::Sum(terms) => terms
                .first()
                .is_some_and(|term| !term.negative && term.math.starts_with_digit()),
            Math::Symbol(_)
            | Math::Dot
            | Math::Root(..)
            | Math::Function(..)
            | Math::Absolute(_)
            | Math::Group(_) => false,
        }
    }
}
