//! The MathML spelling of the typeset tree (MathML Core), without the `math` element around it.

use crate::typeset::tree::{function_name, greek_letter};
use crate::typeset::{Decimal, Glyph, Math, Signed, Symbol};

const INVISIBLE_TIMES: &str = "<mo>\u{2062}</mo>";
/// What TeX puts before a function's name.
const THIN_SPACE: &str = r#"<mspace width="0.167em"/>"#;
const APPLY: &str = "<mo>\u{2061}</mo>";
const MINUS: &str = "\u{2212}";

/// A typeset tree.
pub fn mathml(math: &Math) -> String {
    match math {
        Math::Number(number) => mathml_number(number),
        Math::Symbol(symbol) => mathml_symbol(symbol),
        Math::Sum(terms) => format!("<mrow>{}</mrow>", mathml_terms(terms, false)),
        Math::Product(factors) => {
            let mut row = String::new();
            for (place, factor) in factors.iter().enumerate() {
                let after_dot = place > 0 && factors[place - 1] == Math::Dot;
                if place > 0 && !after_dot && *factor != Math::Dot {
                    row.push_str(INVISIBLE_TIMES);
                    if matches!(factor, Math::Function(..)) {
                        row.push_str(THIN_SPACE);
                    }
                }
                row.push_str(&mathml(factor));
            }
            format!("<mrow>{row}</mrow>")
        }
        Math::Dot => "<mo>\u{22C5}</mo>".to_owned(),
        Math::Fraction(top, bottom) => format!("<mfrac>{}{}</mfrac>", mathml(top), mathml(bottom)),
        Math::Slash(top, bottom) => {
            let (top, bottom) = (mathml(top), mathml(bottom));
            format!("<mrow>{top}<mo>/</mo>{bottom}</mrow>")
        }
        Math::Power(base, exponent) => match &**base {
            // Both scripts stand above each other.
            Math::Symbol(symbol) if !symbol.subscript.is_empty() => {
                let (base, subscript) = (accented(symbol), subscript(symbol));
                let exponent = mathml(exponent);
                format!("<msubsup>{base}{subscript}{exponent}</msubsup>")
            }
            base => format!("<msup>{}{}</msup>", mathml(base), mathml(exponent)),
        },
        Math::Root(inner, None) => format!("<msqrt>{}</msqrt>", mathml(inner)),
        Math::Root(inner, Some(index)) => {
            format!("<mroot>{}<mn>{index}</mn></mroot>", mathml(inner))
        }
        Math::Function(name, power, argument) => {
            let name = format!("<mi>{}</mi>", function_name(*name));
            let head = match power {
                Some(power) => format!("<msup>{name}{}</msup>", mathml(power)),
                None => name,
            };
            let argument = fenced("(", ")", argument);
            format!("<mrow>{head}{APPLY}{argument}</mrow>")
        }
        Math::Absolute(inner) => fenced("|", "|", inner),
        Math::Group(inner) => fenced("(", ")", inner),
    }
}

/// Signed terms one after the other; the first sign may continue a line above.
pub(crate) fn mathml_terms(terms: &[Signed], continues: bool) -> String {
    let mut text = String::new();
    for (place, term) in terms.iter().enumerate() {
        let sign = if term.negative { MINUS } else { "+" };
        let sign = match (place, term.negative, continues) {
            (0, false, false) => String::new(),
            (0, true, false) => format!(r#"<mo form="prefix">{sign}</mo>"#),
            // A sign at the start of a continued line keeps the spaces of an operator.
            (0, _, true) => format!(r#"<mo form="infix">{sign}</mo>"#),
            (_, _, _) => format!("<mo>{sign}</mo>"),
        };
        text += &(sign + &mathml(&term.math));
    }
    text
}

fn mathml_number(number: &Decimal) -> String {
    let digits = format!("<mn>{}</mn>", number.digits());
    let size = match number.exponent() {
        None => digits,
        Some(exponent) => {
            let power = if exponent < 0 {
                let digits = exponent.unsigned_abs();
                format!("<mrow><mo>{MINUS}</mo><mn>{digits}</mn></mrow>")
            } else {
                format!("<mn>{exponent}</mn>")
            };
            format!("<mrow>{digits}<mo>\u{D7}</mo><msup><mn>10</mn>{power}</msup></mrow>")
        }
    };
    match number.is_negative() {
        true => format!(r#"<mrow><mo form="prefix">{MINUS}</mo>{size}</mrow>"#),
        false => size,
    }
}

pub(crate) fn mathml_symbol(symbol: &Symbol) -> String {
    let base = accented(symbol);
    match symbol.subscript.is_empty() {
        true => base,
        false => format!("<msub>{base}{}</msub>", subscript(symbol)),
    }
}

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
        Glyph::Greek(place) => format!("<mi>{}</mi>", greek_letter(*place).1),
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
    format!("<mrow>{open}{}{close}</mrow>", mathml(inner))
}
