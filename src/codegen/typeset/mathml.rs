//! Pages: equations in MathML Core, which browsers draw without scripts, and the one way in for text from outside.

use super::*;
use crate::typeset::tree::function_name;

const INDENT: f64 = 2.0; // of a continued line, in em

/// One phase as a `math` element with lines of `width_em`; an annotation for copying has its LaTeX.
pub fn system(system: &EquationSystem, width_em: f64) -> String {
    let mut rows = Vec::new();
    for equation in &system.equations {
        let relation = if equation.is_approximate { "≈" } else { "=" };
        let head = format!("{}<mo>{relation}</mo>", mathml_symbol(&equation.left));
        let first = symbol_width(&equation.left) + EQUALS;
        let mut lines = break_lines(&equation.terms, width_em, first, INDENT).into_iter();
        let whole = || mathml(&equation.right());
        let first = lines.next().map(|terms| mathml_terms(terms, false));
        rows.push((head, first.unwrap_or_else(whole), 0.0));
        rows.extend(lines.map(|terms| (String::new(), mathml_terms(terms, true), INDENT)));
    }
    let tex = &tex_cases(system, width_em);
    let tex = HtmlText(tex);
    let rendered = Lines { rows, tex }.render();
    rendered.expect("writing to a String cannot fail")
}

/// Lines of a system with their sides and indentation in em, and its LaTeX.
#[derive(Template)]
#[template(path = "mathml/system.askama", config = "templates/askama.toml")]
struct Lines<'a> {
    rows: Vec<(String, String, f64)>,
    tex: HtmlText<'a>,
}

/// The page `NAME.html`: equations and the table of coefficients, without scripts or anything from elsewhere.
///
/// # Errors
/// [`TypesetError::Template`].
pub fn emit(equations: &Equations<'_>, options: &PrintOptions) -> Emitted {
    let page = Page::new(equations, options, &HTML);
    let path = format!("{}.html", equations.model.identifier());
    Ok(vec![EmittedFile::new(path, rendered(&Document { page })?)])
}

#[derive(Template)]
#[template(path = "mathml/page.askama", config = "templates/askama.toml")]
struct Document<'a> {
    page: Page<'a>,
}

/// Text and mathematics for the content of an element.
pub const HTML: Spelling = Spelling {
    text: |text| HtmlText(text).to_string(),
    math: |math, _| format!("<math>{}</math>", mathml(math)),
};

fn after_comma(unit: &Option<Unit>) -> String {
    unit.map_or(String::new(), |unit| format!(", {unit}"))
}

/// Text from outside for the content or an attribute of an element.
#[derive(Clone, Copy, Debug)]
pub struct HtmlText<'a>(pub &'a str);

impl fmt::Display for HtmlText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for character in self.0.chars() {
            match character {
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '&' => f.write_str("&amp;")?,
                '"' => f.write_str("&quot;")?,
                '\'' => f.write_str("&#39;")?,
                _ if character.is_control() => f.write_str(" ")?,
                _ if is_invisible(character) => f.write_str(&code_point(character))?,
                _ => write!(f, "{character}")?,
            }
        }
        Ok(())
    }
}

/// Symbols other than the model's variables: how text spells them, and how MathML does.
const SYMBOLS: [(&str, &str); 14] = [
    ("R^2", "<msup><mi>R</mi><mn>2</mn></msup>"),
    ("R²", "<msup><mi>R</mi><mn>2</mn></msup>"),
    ("W_e", "<msub><mi>W</mi><mi>e</mi></msub>"),
    ("W_e^T", "<msubsup><mi>W</mi><mi>e</mi><mi>T</mi></msubsup>"),
    ("W_eᵀ", "<msubsup><mi>W</mi><mi>e</mi><mi>T</mi></msubsup>"),
    ("u_lat", "<msub><mi>u</mi><mtext>lat</mtext></msub>"),
    ("L_mod", "<msub><mi>L</mi><mtext>mod</mtext></msub>"),
    ("E_dec", "<msub><mi>E</mi><mtext>dec</mtext></msub>"),
    ("k_s", "<msub><mi>k</mi><mi>s</mi></msub>"),
    ("l_0", "<msub><mi>l</mi><mn>0</mn></msub>"),
    ("ddz", "<mover><mi>z</mi><mo>\u{a8}</mo></mover>"),
    ("dz", "<mover><mi>z</mi><mo>\u{2d9}</mo></mover>"),
    ("|Xi|", "<mrow><mo>|</mo><mi>Ξ</mi><mo>|</mo></mrow>"),
    ("lambda", "<mi>λ</mi>"),
];

/// Text in which known symbols become `math` elements, hyphens before digits minus signs, and units their signs.
#[derive(Clone, Copy, Debug)]
pub struct HtmlProse<'a>(pub &'a str);

impl fmt::Display for HtmlProse<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0 == "-" {
            return f.write_str("–");
        }
        let mut rest = self.0;
        let mut before = ' ';
        while let Some(letter) = rest.chars().next() {
            let is_word = |c: char| c.is_alphanumeric() || "_^|".contains(c);
            let length = match is_word(letter) {
                true => rest.find(|c: char| !is_word(c)).unwrap_or(rest.len()),
                false => letter.len_utf8(),
            };
            let (word, after) = rest.split_at(length);
            let is_minus = letter == '-'
                && after.starts_with(|c: char| c.is_ascii_digit())
                && (before.is_whitespace() || before == '(');
            match mathematics(word) {
                Some(math) if !".-".contains(before) && !is_name(after) => {
                    write!(f, "<math>{math}</math>")?;
                }
                Some(_) | None if is_minus => f.write_str("\u{2212}")?,
                Some(_) | None => match word {
                    "s^2" => f.write_str("s²")?,
                    "us" => f.write_str("µs")?,
                    _ => HtmlText(word).fmt(f)?,
                },
            }
            before = word.chars().next_back().unwrap_or(' ');
            rest = after;
        }
        Ok(())
    }
}

/// Whether a word goes on as the name of a file or coordinate.
fn is_name(after: &str) -> bool {
    let mut letters = after.chars();
    let joined = letters.next().is_some_and(|c| ".-".contains(c));
    joined && letters.next().is_some_and(char::is_alphanumeric)
}

fn mathematics(word: &str) -> Option<String> {
    if let Some((_, math)) = SYMBOLS.iter().find(|(text, _)| *text == word) {
        return Some((*math).to_owned());
    }
    let variable = |name| LatentVariable::from_name(name, usize::MAX);
    let symbols = SymbolTable::default();
    let symbol = match (variable(word), word.strip_prefix("dd").and_then(variable)) {
        (Some(known), _) => symbols.symbol(known),
        (None, Some(LatentVariable::Z(index))) => symbols.acceleration(index),
        (None, _) => return None,
    };
    Some(mathml_symbol(&symbol))
}

const INVISIBLE_TIMES: &str = "<mo>\u{2062}</mo>";
/// TeX's space before a function's name.
const THIN_SPACE: &str = r#"<mspace width="0.167em"/>"#;
const APPLY: &str = "<mo>\u{2061}</mo>";
const MINUS: &str = "\u{2212}";

pub(crate) fn mathml(math: &Math) -> String {
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
            // Both scripts are above each other.
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
    let digits = format!("<mn>{}</mn>", number.digits);
    let size = match number.exponent {
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
    match number.negative {
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
