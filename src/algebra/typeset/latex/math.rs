//! The LaTeX spelling of the typeset tree.

use std::fmt;

use crate::equations::Unit;
use crate::symbolic::Function;
use crate::typeset::tree::function_name;
use crate::typeset::{Decimal, GREEK, Glyph, Math, NumberStyle, Signed, Symbol};

/// A typeset tree that displays as LaTeX, for math mode.
#[derive(Clone, Copy, Debug)]
pub struct TexMath<'a> {
    /// What is printed.
    pub math: &'a Math,
    /// How its numbers are written.
    pub numbers: NumberStyle,
}

/// A symbol that displays as LaTeX: `\ddot{z}_{10}`.
#[derive(Clone, Copy, Debug)]
pub struct TexSymbol<'a>(pub &'a Symbol);

/// Signed terms one after the other: `0.36 - 0.16\dot{z}_1`.
#[derive(Clone, Copy, Debug)]
pub struct TexTerms<'a> {
    /// The terms.
    pub terms: &'a [Signed],
    /// How their numbers are written.
    pub numbers: NumberStyle,
    /// Whether the first sign is a binary operator that continues a line above.
    pub continues: bool,
}

/// A number that displays as LaTeX, with its sign.
#[derive(Clone, Copy, Debug)]
pub struct TexNumber<'a> {
    /// The number.
    pub number: &'a Decimal,
    /// How it is written.
    pub numbers: NumberStyle,
}

impl fmt::Display for TexMath<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let numbers = self.numbers;
        let inner = |math| TexMath { math, numbers };
        // Exponents are structure, not measured values: no siunitx.
        let exponent_of = |math| {
            script(&TexMath {
                math,
                numbers: NumberStyle::Plain,
            })
        };
        match self.math {
            Math::Number(number) => TexNumber { number, numbers }.fmt(f),
            Math::Symbol(symbol) => TexSymbol(symbol).fmt(f),
            Math::Sum(terms) => TexTerms {
                terms,
                numbers,
                continues: false,
            }
            .fmt(f),
            Math::Product(factors) => {
                let mut text = String::new();
                for factor in factors {
                    append(&mut text, &inner(factor).to_string());
                }
                f.write_str(&text)
            }
            Math::Dot => f.write_str(r" \cdot "),
            Math::Fraction(top, bottom) => {
                write!(f, r"\frac{{{}}}{{{}}}", inner(top), inner(bottom))
            }
            Math::Slash(top, bottom) => write!(f, "{}/{}", inner(top), inner(bottom)),
            Math::Power(base, exponent) => {
                write!(f, "{}^{}", inner(base), exponent_of(exponent))
            }
            Math::Root(radicand, None) => write!(f, r"\sqrt{{{}}}", inner(radicand)),
            Math::Root(radicand, Some(index)) => {
                write!(f, r"\sqrt[{index}]{{{}}}", inner(radicand))
            }
            Math::Function(name, power, argument) => {
                f.write_str(&function(*name))?;
                if let Some(power) = power {
                    write!(f, "^{}", exponent_of(power))?;
                }
                delimited(f, "(", ")", &inner(argument))
            }
            Math::Absolute(argument) => delimited(f, r"\lvert ", r" \rvert", &inner(argument)),
            Math::Group(argument) => delimited(f, "(", ")", &inner(argument)),
        }
    }
}

impl fmt::Display for TexTerms<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, term) in self.terms.iter().enumerate() {
            let math = TexMath {
                math: &term.math,
                numbers: self.numbers,
            };
            f.write_str(match (place, term.negative, self.continues) {
                (0, false, false) => "",
                (0, true, false) => "-",
                (0, false, true) => "{} + ",
                (0, true, true) => "{} - ",
                (_, false, _) => " + ",
                (_, true, _) => " - ",
            })?;
            math.fmt(f)?;
        }
        Ok(())
    }
}

impl fmt::Display for TexNumber<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.numbers, self.number.exponent()) {
            (NumberStyle::Plain, None) => self.number.fmt(f),
            (NumberStyle::Plain, Some(exponent)) => {
                let sign = if self.number.is_negative() { "-" } else { "" };
                write!(
                    f,
                    r"{sign}{} \times 10^{{{exponent}}}",
                    self.number.digits()
                )
            }
            (NumberStyle::Siunitx, _) => write!(f, r"\num{{{}}}", self.number),
        }
    }
}

impl fmt::Display for TexSymbol<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let symbol = self.0;
        let base = glyph(&symbol.glyph);
        match symbol.dots {
            0 => f.write_str(&base)?,
            1 => write!(f, r"\dot{{{base}}}")?,
            2 => write!(f, r"\ddot{{{base}}}")?,
            // amsmath goes on to `\ddddot`; the latent model never asks for more.
            _ => write!(f, r"\dddot{{{base}}}")?,
        }
        if !symbol.subscript.is_empty() {
            let parts: Vec<String> = symbol.subscript.iter().map(glyph).collect();
            write!(f, "_{}", script(&parts.join(",")))?;
        }
        Ok(())
    }
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
fn script(text: &impl ToString) -> String {
    let text = text.to_string();
    if text.chars().count() == 1 {
        text
    } else {
        format!("{{{text}}}")
    }
}

fn glyph(glyph: &Glyph) -> String {
    match glyph {
        Glyph::Letter(letter) => letter.to_string(),
        Glyph::Greek(place) => format!(r"\{}", GREEK[*place].0),
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

/// `inner` between delimiters, which grow only around something tall: `\left`
/// and `\right` would put a space after the function's name.
fn delimited(
    f: &mut fmt::Formatter<'_>,
    open: &str,
    close: &str,
    inner: &TexMath<'_>,
) -> fmt::Result {
    if inner.math.is_tall() {
        write!(f, r"\left{open}{inner}\right{}", close.trim_start())
    } else {
        write!(f, "{open}{inner}{close}")
    }
}

/// A unit as upright LaTeX: `\mathrm{m/s^{2}}`.
pub struct TexUnit(pub Unit);

impl fmt::Display for TexUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let unit = self.0.spelled(r"\,", |power| format!("^{{{power}}}"));
        write!(f, r"\mathrm{{{unit}}}")
    }
}
