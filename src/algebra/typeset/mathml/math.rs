//! The MathML spelling of the typeset tree (MathML Core).

use std::fmt;

use crate::typeset::tree::function_name;
use crate::typeset::{Decimal, GREEK, Glyph, Math, Signed, Symbol};

const INVISIBLE_TIMES: &str = "<mo>\u{2062}</mo>";
/// What TeX puts before a function's name.
const THIN_SPACE: &str = r#"<mspace width="0.167em"/>"#;
const APPLY: &str = "<mo>\u{2061}</mo>";
const MINUS: &str = "\u{2212}";

/// A typeset tree that displays as MathML elements, without the `math` around them.
#[derive(Clone, Copy, Debug)]
pub struct Mathml<'a>(pub &'a Math);

/// A symbol that displays as MathML.
#[derive(Clone, Copy, Debug)]
pub struct MathmlSymbol<'a>(pub &'a Symbol);

/// A number with its sign that displays as MathML.
#[derive(Clone, Copy, Debug)]
pub struct MathmlNumber<'a>(pub &'a Decimal);

/// Signed terms one after the other.
#[derive(Clone, Copy, Debug)]
pub struct MathmlTerms<'a> {
    /// The terms.
    pub terms: &'a [Signed],
    /// Whether the first sign continues a line above.
    pub continues: bool,
}

impl fmt::Display for Mathml<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Math::Number(number) => MathmlNumber(number).fmt(f),
            Math::Symbol(symbol) => MathmlSymbol(symbol).fmt(f),
            Math::Sum(terms) => {
                let continues = false;
                write!(f, "<mrow>{}</mrow>", MathmlTerms { terms, continues })
            }
            Math::Product(factors) => {
                f.write_str("<mrow>")?;
                for (place, factor) in factors.iter().enumerate() {
                    let after_dot = place > 0 && factors[place - 1] == Math::Dot;
                    if place > 0 && !after_dot && *factor != Math::Dot {
                        f.write_str(INVISIBLE_TIMES)?;
                        if matches!(factor, Math::Function(..)) {
                            f.write_str(THIN_SPACE)?;
                        }
                    }
                    Mathml(factor).fmt(f)?;
                }
                f.write_str("</mrow>")
            }
            Math::Dot => f.write_str("<mo>\u{22C5}</mo>"),
            Math::Fraction(top, bottom) => {
                write!(f, "<mfrac>{}{}</mfrac>", Mathml(top), Mathml(bottom))
            }
            Math::Slash(top, bottom) => {
                write!(
                    f,
                    "<mrow>{}<mo>/</mo>{}</mrow>",
                    Mathml(top),
                    Mathml(bottom)
                )
            }
            Math::Power(base, exponent) => match &**base {
                // Both scripts stand above each other.
                Math::Symbol(symbol) if !symbol.subscript.is_empty() => {
                    let (base, subscript) = (accented(symbol), subscript(symbol));
                    let exponent = Mathml(exponent);
                    write!(f, "<msubsup>{base}{subscript}{exponent}</msubsup>")
                }
                base => write!(f, "<msup>{}{}</msup>", Mathml(base), Mathml(exponent)),
            },
            Math::Root(inner, None) => write!(f, "<msqrt>{}</msqrt>", Mathml(inner)),
            Math::Root(inner, Some(index)) => {
                write!(f, "<mroot>{}<mn>{index}</mn></mroot>", Mathml(inner))
            }
            Math::Function(name, power, argument) => {
                let name = format!("<mi>{}</mi>", function_name(*name));
                let head = match power {
                    Some(power) => format!("<msup>{name}{}</msup>", Mathml(power)),
                    None => name,
                };
                let argument = fenced("(", ")", argument);
                write!(f, "<mrow>{head}{APPLY}{argument}</mrow>")
            }
            Math::Absolute(inner) => f.write_str(&fenced("|", "|", inner)),
            Math::Group(inner) => f.write_str(&fenced("(", ")", inner)),
        }
    }
}

impl fmt::Display for MathmlTerms<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, term) in self.terms.iter().enumerate() {
            let sign = if term.negative { MINUS } else { "+" };
            match (place, term.negative, self.continues) {
                (0, false, false) => {}
                (0, true, false) => write!(f, r#"<mo form="prefix">{sign}</mo>"#)?,
                // A sign at the start of a continued line keeps the spaces of an operator.
                (0, _, true) => write!(f, r#"<mo form="infix">{sign}</mo>"#)?,
                (_, _, _) => write!(f, "<mo>{sign}</mo>")?,
            }
            Mathml(&term.math).fmt(f)?;
        }
        Ok(())
    }
}

impl fmt::Display for MathmlNumber<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = format!("<mn>{}</mn>", self.0.digits());
        let size = match self.0.exponent() {
            None => number,
            Some(exponent) => {
                let power = if exponent < 0 {
                    let digits = exponent.unsigned_abs();
                    format!("<mrow><mo>{MINUS}</mo><mn>{digits}</mn></mrow>")
                } else {
                    format!("<mn>{exponent}</mn>")
                };
                format!("<mrow>{number}<mo>\u{D7}</mo><msup><mn>10</mn>{power}</msup></mrow>")
            }
        };
        if self.0.is_negative() {
            write!(f, r#"<mrow><mo form="prefix">{MINUS}</mo>{size}</mrow>"#)
        } else {
            f.write_str(&size)
        }
    }
}

impl fmt::Display for MathmlSymbol<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let base = accented(self.0);
        if self.0.subscript.is_empty() {
            f.write_str(&base)
        } else {
            write!(f, "<msub>{base}{}</msub>", subscript(self.0))
        }
    }
}

/// The glyph of a symbol with its dots.
fn accented(symbol: &Symbol) -> String {
    let glyph = element(&symbol.glyph);
    let dots = match symbol.dots {
        0 => return glyph,
        1 => '\u{2D9}',
        2 => '\u{A8}',
        _ => '\u{20DB}',
    };
    // Without `accent`: Chromium would set an accent's dots onto the letter.
    format!("<mover>{glyph}<mo>{dots}</mo></mover>")
}

/// The subscript of a symbol as one element.
fn subscript(symbol: &Symbol) -> String {
    let parts: Vec<String> = symbol.subscript.iter().map(element).collect();
    match parts.as_slice() {
        [one] => one.clone(),
        several => format!("<mrow>{}</mrow>", several.join("<mo>,</mo>")),
    }
}

/// A glyph as an element. Only letters and digits get here, so nothing needs escaping.
fn element(glyph: &Glyph) -> String {
    match glyph {
        Glyph::Letter(letter) => format!("<mi>{letter}</mi>"),
        Glyph::Greek(place) => format!("<mi>{}</mi>", GREEK[*place].1),
        Glyph::Digits(digits) => format!("<mn>{digits}</mn>"),
        Glyph::Word(word) => format!("<mi>{word}</mi>"),
    }
}

fn fenced(open: &str, close: &str, inner: &Math) -> String {
    let stretchy = inner.is_tall();
    let mark = |form: &str, text: &str| {
        format!(r#"<mo fence="true" form="{form}" stretchy="{stretchy}">{text}</mo>"#)
    };
    let (open, close) = (mark("prefix", open), mark("postfix", close));
    format!("<mrow>{open}{}{close}</mrow>", Mathml(inner))
}
