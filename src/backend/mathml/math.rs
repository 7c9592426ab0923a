//! The MathML spelling of the typeset tree (MathML Core).

use std::fmt;

use crate::backend::typeset::{Decimal, GREEK, Glyph, Math, Signed, Symbol};

const INVISIBLE_TIMES: &str = "<mo>\u{2062}</mo>";
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
            Math::Power(base, exponent) => {
                write!(f, "<msup>{}{}</msup>", Mathml(base), Mathml(exponent))
            }
            Math::Root(inner, None) => write!(f, "<msqrt>{}</msqrt>", Mathml(inner)),
            Math::Root(inner, Some(index)) => {
                write!(f, "<mroot>{}<mn>{index}</mn></mroot>", Mathml(inner))
            }
            Math::Function(name, power, argument) => {
                let name = format!("<mi>{}</mi>", name.text());
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
        let glyph = element(&self.0.glyph);
        let accent = match self.0.dots {
            0 => None,
            1 => Some('\u{2D9}'),
            2 => Some('\u{A8}'),
            _ => Some('\u{20DB}'),
        };
        let base = match accent {
            None => glyph,
            Some(dots) => format!(r#"<mover accent="true">{glyph}<mo>{dots}</mo></mover>"#),
        };
        let parts: Vec<String> = self.0.subscript.iter().map(element).collect();
        match parts.as_slice() {
            [] => f.write_str(&base),
            [one] => write!(f, "<msub>{base}{one}</msub>"),
            several => {
                let list = several.join("<mo>,</mo>");
                write!(f, "<msub>{base}<mrow>{list}</mrow></msub>")
            }
        }
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
    format!(
        r#"<mrow><mo fence="true" form="prefix">{open}</mo>{}<mo fence="true" form="postfix">{close}</mo></mrow>"#,
        Mathml(inner)
    )
}
