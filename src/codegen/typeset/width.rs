//! Estimated widths, and where a long equation is broken.
//!
//! Widths are in em of the surrounding text, from the metrics of Computer
//! Modern: good to a few percent, which is all that line breaking needs.

use super::tree::{Glyph, Math, Signed, Symbol, function_name};

const DIGIT: f64 = 0.5;
const POINT: f64 = 0.278;
const LETTER: f64 = 0.55;
const THIN_SPACE: f64 = 0.167;
const PARENTHESIS: f64 = 0.39;
/// A binary plus or minus with its spaces.
const OPERATOR: f64 = 1.222;
/// An equals sign with its spaces.
pub(crate) const EQUALS: f64 = 1.333;
const MINUS: f64 = 0.778;
/// Of a character in a script of the same, whose font is wider than the large one scaled to its size.
const SCRIPT: f64 = 0.8;

pub(crate) fn width(math: &Math) -> f64 {
    match math {
        Math::Number(number) => {
            let points = number.digits().bytes().filter(|byte| *byte == b'.').count() as f64;
            let digits = number.digits().len() as f64 - points;
            let power = number.exponent().map_or(0.0, |exponent| {
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

/// Splits `terms` into lines no wider than `available` em where that is
/// possible: greedily, and only before a sign. `first` em of the first line and
/// `indent` em of each further line are taken by what stands before the terms.
pub(crate) fn break_lines(
    terms: &[Signed],
    available: f64,
    first: f64,
    indent: f64,
) -> Vec<&[Signed]> {
    let mut lines = Vec::new();
    let mut start = 0;
    let mut used = first;
    for (place, term) in terms.iter().enumerate() {
        let is_signed = place > 0 || term.negative;
        let sign = if is_signed { OPERATOR } else { 0.0 };
        let needed = sign + width(&term.math);
        if place > start && used + needed > available {
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

#[cfg(test)]
mod tests {
    use super::super::decimal::Decimal;
    use super::*;

    #[test]
    fn break_lines_keeps_every_term_once_and_each_line_within_the_width_but_for_a_single_term() {
        let terms = vec![Signed::plus(Math::Number(Decimal::exact(0.25))); 40];
        let lines = break_lines(&terms, 20.0, 3.0, 2.0);
        assert!(lines.len() > 1 && lines.concat() == terms);
        assert!((lines.iter()).all(|line| 2.0 + OPERATOR + sum_width(line) <= 20.0 + 3.0));
        assert_eq!(break_lines(&terms, 0.5, 0.0, 0.0).len(), 40);
        assert!(break_lines(&[], 20.0, 0.0, 0.0).is_empty());
    }
}
