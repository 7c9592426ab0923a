//! The one way for text of a model file into a TeX file.

use crate::files::is_invisible;
use crate::typeset::words::code_point;

/// Text from outside, printed so that TeX shows its characters and runs none of
/// them: every special character becomes a command, control characters and line
/// ends become a space, and characters that pdfTeX does not know by default their code
/// point in brackets. The result never contains a line break, so it is as safe
/// inside a comment as in the running text.
///
/// ```
/// use romc::typeset::latex::tex_text;
/// assert_eq!(tex_text(r"50% \input{x}"), r"50\% \textbackslash{}input\{x\}");
/// ```
pub fn tex_text(text: &str) -> String {
    let mut tex = String::new();
    let mut previous = ' ';
    for character in text.chars() {
        // Two of these in a row are a ligature.
        if character == previous && "-,".contains(character) {
            tex.push_str("{}");
        }
        previous = character;
        match escaped(character) {
            Some(command) => tex.push_str(command),
            None if is_plain(character) => tex.push(character),
            None => tex.push_str(&code_point(character)),
        }
    }
    tex
}

/// Text from outside for a `%` comment: as it is, but on one line and without what changes how its
/// reader sees the line. TeX skips the rest of a comment's line without looking at it, so only a
/// line end could let something out.
pub(crate) fn comment_text(text: &str) -> String {
    text.replace(is_invisible, " ")
}

/// The command for a character that TeX would not print as it is.
fn escaped(character: char) -> Option<&'static str> {
    let text = match character {
        '\\' => r"\textbackslash{}",
        '{' => r"\{",
        '}' => r"\}",
        '$' => r"\$",
        '&' => r"\&",
        '#' => r"\#",
        '%' => r"\%",
        '_' => r"\_",
        '^' => r"\textasciicircum{}",
        '~' => r"\textasciitilde{}",
        '<' => r"\textless{}",
        '>' => r"\textgreater{}",
        '|' => r"\textbar{}",
        '"' => r"\textquotedbl{}",
        '\'' => r"\textquotesingle{}",
        '`' => r"\textasciigrave{}",
        '\u{2013}' => r"\textendash{}",
        '\u{2014}' => r"\textemdash{}",
        '\u{2018}' => r"\textquoteleft{}",
        '\u{2019}' => r"\textquoteright{}",
        '\u{201C}' => r"\textquotedblleft{}",
        '\u{201D}' => r"\textquotedblright{}",
        '\u{2026}' => r"\dots{}",
        '°' => r"\textdegree{}",
        'µ' => r"\textmu{}",
        '±' => r"\textpm{}",
        '×' => r"\texttimes{}",
        '·' => r"\textperiodcentered{}",
        '²' => r"\texttwosuperior{}",
        '³' => r"\textthreesuperior{}",
        _ if character.is_control() || character.is_whitespace() => " ",
        _ => return None,
    };
    Some(text)
}

/// ASCII letters, digits and harmless marks, and the Latin letters that the
/// default fonts of pdfTeX carry.
fn is_plain(character: char) -> bool {
    character.is_ascii_alphanumeric()
        || "!()*+,-./:;=?@[] ".contains(character)
        || "ÀÁÂÃÄÅÆÇÈÉÊËÌÍÎÏÑÒÓÔÕÖØÙÚÛÜÝßàáâãäåæçèéêëìíîïñòóôõöøùúûüýÿČčĎďĚěŇňŘřŠšŤťŮůŽžŁłŃńŚśŹźŻżŐőŰű"
            .contains(character)
}

/// A name reduced to what a `\label` and a file name can hold: ASCII letters and
/// digits, everything else a hyphen.
///
/// ```
/// use romc::typeset::latex::label;
/// assert_eq!(label(r"rear stance_2}\b%"), "rear-stance-2--b-");
/// ```
pub fn label(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect()
}
