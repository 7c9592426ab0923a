//! The typeset tree: mathematics as it is laid out, before it has a spelling, with its estimated width in em (metrics
//! of Computer Modern, good to a few percent) and where a long equation is broken.

use super::*;

/// One piece of laid-out mathematics: parentheses, dots and signs are in place, a printer only chooses the spelling.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Math {
    /// A number without sign.
    Number(Decimal),
    Symbol(Symbol),
    /// Terms with signs; a single negative term is a negated expression.
    Sum(Vec<Signed>),
    Product(Vec<Math>),
    /// A visible multiplication sign between two factors of a product.
    Dot,
    /// `numerator / denominator` with a bar.
    Fraction(Box<Math>, Box<Math>),
    /// `numerator / denominator` on the line, for exponents.
    Slash(Box<Math>, Box<Math>),
    Power(Box<Math>, Box<Math>),
    /// A root; no index means the square root.
    Root(Box<Math>, Option<u32>),
    /// A function by its name, with an optional power on that; roots and magnitudes have forms of their own.
    Function(Function, Option<Box<Math>>, Box<Math>),
    Absolute(Box<Math>),
    Group(Box<Math>),
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Signed {
    pub negative: bool,
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
    pub(crate) fn into_math(self) -> Math {
        if self.negative {
            Math::Sum(vec![self])
        } else {
            self.math
        }
    }
}

/// A variable: a glyph, up to two dots above it for time derivatives, and a subscript, its parts joined by commas.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Symbol {
    pub(crate) glyph: Glyph,
    pub dots: u8,
    pub(crate) subscript: Vec<Glyph>,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Glyph {
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

    pub(crate) fn starts_with_digit(&self) -> bool {
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

const DIGIT: f64 = 0.5;
const POINT: f64 = 0.278;
const LETTER: f64 = 0.55;
const THIN_SPACE: f64 = 0.167;
const PARENTHESIS: f64 = 0.39;
const OPERATOR: f64 = 1.222; // plus or minus with its spaces
pub(crate) const EQUALS: f64 = 1.333; // with its spaces
const MINUS: f64 = 0.778;
/// Of a character in a script, relative to the text; the script's font is wider than the text's scaled to its size.
const SCRIPT: f64 = 0.8;

pub(crate) fn width(math: &Math) -> f64 {
    match math {
        Math::Number(number) => {
            let points = number.digits.bytes().filter(|byte| *byte == b'.').count() as f64;
            let digits = number.digits.len() as f64 - points;
            let power = number.exponent.map_or(0.0, |exponent| {
                let sign = if exponent < 0 { MINUS } else { 0.0 };
                let places = exponent.unsigned_abs().to_string().len() as f64;
                OPERATOR + 2.0 * DIGIT + SCRIPT * (sign + DIGIT * places)
            });
            digits * DIGIT + points * POINT + power
        }
        Math::Symbol(symbol) => symbol_width(symbol),
        Math::Sum(terms) => sum_width(terms),
        Math::Product(factors) => factors.iter().map(width).sum(),
        Math::Dot => 0.722,
        Math::Fraction(top, bottom) => width(top).max(width(bottom)) + 0.24,
        Math::Slash(top, bottom) => width(top) + DIGIT + width(bottom),
        Math::Power(base, exponent) => width(base) + SCRIPT * width(exponent) + 0.05,
        Math::Root(inner, _) => width(inner) + 0.9,
        Math::Function(name, power, argument) => {
            let power = power.as_ref().map_or(0.0, |power| SCRIPT * width(power));
            0.45 * function_name(*name).len() as f64
                + power
                + width(argument)
                + 2.0 * PARENTHESIS
                + THIN_SPACE
        }
        Math::Absolute(inner) => width(inner) + 0.56,
        Math::Group(inner) => width(inner) + 2.0 * PARENTHESIS,
    }
}

fn sum_width(terms: &[Signed]) -> f64 {
    let mut total = 0.0;
    for (place, term) in terms.iter().enumerate() {
        total += match (place, term.negative) {
            (0, false) => 0.0,
            (0, true) => MINUS,
            (_, _) => OPERATOR,
        };
        total += width(&term.math);
    }
    total
}

pub(crate) fn symbol_width(symbol: &Symbol) -> f64 {
    let commas = symbol.subscript.len().saturating_sub(1) as f64 * POINT;
    let subscript: f64 = symbol.subscript.iter().map(glyph_width).sum();
    glyph_width(&symbol.glyph) + SCRIPT * (subscript + commas) + 0.05
}

fn glyph_width(glyph: &Glyph) -> f64 {
    match glyph {
        Glyph::Letter(_) | Glyph::Greek(_) => LETTER,
        Glyph::Digits(text) | Glyph::Word(text) => text.len() as f64 * DIGIT,
    }
}

/// Splits terms before signs into lines of `limit` em, greedily; `first` em of the first line and `indent` em of the
/// others are in use already.
pub(crate) fn break_lines(terms: &[Signed], limit: f64, first: f64, indent: f64) -> Vec<&[Signed]> {
    let mut lines = Vec::new();
    let mut start = 0;
    let mut used = first;
    for (place, term) in terms.iter().enumerate() {
        let is_signed = place > 0 || term.negative;
        let sign = if is_signed { OPERATOR } else { 0.0 };
        let needed = sign + width(&term.math);
        if place > start && used + needed > limit {
            lines.push(&terms[start..place]);
            start = place;
            used = indent;
        }
        used += needed;
    }
    if start < terms.len() {
        lines.push(&terms[start..]);
    }
    lines
}
