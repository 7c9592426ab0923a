//! The LaTeX spelling of the typeset tree, for math mode.

use crate::equations::Unit;
use crate::symbolic::Function;
use crate::typeset::tree::{function_name, greek_letter};
use crate::typeset::{Decimal, Glyph, Math, NumberStyle, Signed, Symbol};

pub(crate) fn tex(math: &Math, numbers: NumberStyle) -> String {
    let inner = |math: &Math| tex(math, numbers);
    // Exponents are structure, not measured values: no siunitx.
    let exponent_of = |math| script(tex(math, NumberStyle::Plain));
    // Delimiters grow only around something tall: `\left` and `\right` would put a space after
    // the function's name.
    let delimited = |open: &str, close: &str, math: &Math| match math.is_tall() {
        true => format!(r"\left{open}{}\right{}", inner(math), close.trim_start()),
        false => format!("{open}{}{close}", inner(math)),
    };
    match math {
        Math::Number(number) => tex_number(number, numbers),
        Math::Symbol(symbol) => tex_symbol(symbol),
        Math::Sum(terms) => tex_terms(terms, numbers, false),
        Math::Product(factors) => {
            let mut text = String::new();
            for factor in factors {
                append(&mut text, &inner(factor));
            }
            text
        }
        Math::Dot => r" \cdot ".to_owned(),
        Math::Fraction(top, bottom) => format!(r"\frac{{{}}}{{{}}}", inner(top), inner(bottom)),
        Math::Slash(top, bottom) => format!("{}/{}", inner(top), inner(bottom)),
        Math::Power(base, exponent) => format!("{}^{}", inner(base), exponent_of(exponent)),
        Math::Root(radicand, None) => format!(r"\sqrt{{{}}}", inner(radicand)),
        Math::Root(radicand, Some(index)) => format!(r"\sqrt[{index}]{{{}}}", inner(radicand)),
        Math::Function(name, power, argument) => {
            let power = (power.as_ref()).map(|power| format!("^{}", exponent_of(power)));
            function(*name) + &power.unwrap_or_default() + &delimited("(", ")", argument)
        }
        Math::Absolute(argument) => delimited(r"\lvert ", r" \rvert", argument),
        Math::Group(argument) => delimited("(", ")", argument),
    }
}

/// Signed terms one after the other: `0.36 - 0.16\dot{z}_1`; the first sign may be a binary operator that
/// continues a line above.
pub(crate) fn tex_terms(terms: &[Signed], numbers: NumberStyle, continues: bool) -> String {
    let mut text = String::new();
    for (place, term) in terms.iter().enumerate() {
        text.push_str(match (place, term.negative, continues) {
            (0, false, false) => "",
            (0, true, false) => "-",
            (0, false, true) => "{} + ",
            (0, true, true) => "{} - ",
            (_, false, _) => " + ",
            (_, true, _) => " - ",
        });
        text.push_str(&tex(&term.math, numbers));
    }
    text
}

pub(crate) fn tex_number(number: &Decimal, numbers: NumberStyle) -> String {
    match (numbers, number.exponent()) {
        (NumberStyle::Plain, None) => number.to_string(),
        (NumberStyle::Plain, Some(exponent)) => {
            let sign = if number.is_negative() { "-" } else { "" };
            format!(r"{sign}{} \times 10^{{{exponent}}}", number.digits())
        }
        (NumberStyle::Siunitx, _) => format!(r"\num{{{number}}}"),
    }
}

/// A symbol: `\ddot{z}_{10}`.
pub(crate) fn tex_symbol(symbol: &Symbol) -> String {
    let base = glyph(&symbol.glyph);
    let dotted = match symbol.dots {
        0 => base,
        1 => format!(r"\dot{{{base}}}"),
        2 => format!(r"\ddot{{{base}}}"),
        // amsmath goes on to `\ddddot`; the latent model never asks for more.
        _ => format!(r"\dddot{{{base}}}"),
    };
    if symbol.subscript.is_empty() {
        return dotted;
    }
    let parts: Vec<String> = symbol.subscript.iter().map(glyph).collect();
    format!("{dotted}_{}", script(parts.join(",")))
}

/// Appends `next`, with a space where a command such as `\theta` would swallow its first letter.
fn append(text: &mut String, next: &str) {
    let ends_in_command = text
        .trim_end_matches(|c: char| c.is_ascii_alphabetic())
        .ends_with('\\');
    let letters = text.ends_with(|c: char| c.is_ascii_alphabetic());
    if ends_in_command && letters && next.starts_with(|c: char| c.is_ascii_alphabetic()) {
        text.push(' ');
    }
    text.push_str(next);
}

/// A superscript or subscript: bare for one character, in braces otherwise.
fn script(text: String) -> String {
    match text.chars().count() {
        1 => text,
        _ => format!("{{{text}}}"),
    }
}

fn glyph(glyph: &Glyph) -> String {
    match glyph {
        Glyph::Letter(letter) => letter.to_string(),
        Glyph::Greek(place) => format!(r"\{}", greek_letter(*place).0),
        Glyph::Digits(digits) => digits.clone(),
        Glyph::Word(word) => format!(r"\mathrm{{{word}}}"),
    }
}

fn function(function: Function) -> String {
    match function {
        Function::Sign => r"\mathop{\mathrm{sgn}}".to_owned(),
        named => format!(r"\{}", function_name(named)),
    }
}

/// A unit in upright letters: `\mathrm{m/s^{2}}`.
pub(crate) fn tex_unit(unit: Unit) -> String {
    let unit = unit.spelled(r"\,", |power| format!("^{{{power}}}"));
    format!(r"\mathrm{{{unit}}}")
}
