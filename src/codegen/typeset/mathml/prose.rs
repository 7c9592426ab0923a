//! The one way for text of a model file into a page. In romc's own sentences and tables a few symbols become
//! mathematics.

use std::fmt;

use crate::files::is_invisible;
use crate::model::LatentVariable;
use crate::typeset::SymbolTable;
use crate::typeset::words::code_point;

use super::math::mathml_symbol;

/// Text from outside for the content or an attribute of an element.
///
/// ```
/// use romc::typeset::mathml::HtmlText;
/// assert_eq!(HtmlText("<b a=\"1\">&").to_string(), "&lt;b a=&quot;1&quot;&gt;&amp;");
/// ```
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

/// Text for the content of an element: known symbols become `math` elements, a hyphen before a digit a minus, `s^2` a
/// raised digit, `us` microseconds, a lone hyphen a dash.
///
/// ```
/// use romc::typeset::mathml::HtmlProse;
/// let html = HtmlProse("R^2 below -0.5, m/s^2").to_string();
/// assert!(html.starts_with("<math><msup>") && html.ends_with("below \u{2212}0.5, m/s²"));
/// ```
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
