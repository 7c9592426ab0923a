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

#[cfg(test)]
mod tests {
    use super::*;

    /// Characters that change how TeX reads what follows.
    const ACTIVE: &str = "$&#%_^~";

    #[test]
    fn text_escape_leaves_no_active_character_bare() {
        for hostile in [
            r"\input{x}",
            "50% of $x_1$ & #2",
            "^^5cinput",
            "~tilde_under",
            "a\\\\b",
            "}\\end{document}",
        ] {
            let text = tex_text(hostile);
            let mut previous = ' ';
            for character in text.chars() {
                assert!(!ACTIVE.contains(character) || previous == '\\', "{text}");
                previous = character;
            }
            // Every backslash begins one of the commands of the table.
            for piece in text.split('\\').skip(1) {
                let known = piece.starts_with("text")
                    || piece.starts_with(['{', '}', '$', '&', '#', '%', '_']);
                assert!(known, "{text}");
            }
        }
    }

    #[test]
    fn text_escape_has_no_line_break_no_ligature_and_unknown_characters_by_code_point() {
        for (text, escaped) in [
            ("a\r\nb\u{2028}c\u{85}d\u{0b}e\u{0}f", "a  b c d e f"),
            ("跳 ü", "[U+8DF3] ü"),
            ("a--b-c", "a-{}-b-c"),
        ] {
            assert_eq!(tex_text(text), escaped);
        }
    }

    #[test]
    fn comment_text_stays_on_its_line() {
        let text = comment_text("a\r\\input{x}\nb\u{85}c\u{2028}d");
        assert_eq!(text, "a \\input{x} b c d");
    }
}
