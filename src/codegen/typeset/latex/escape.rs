//! The one way for text of a model file into a TeX file.

use crate::files::is_invisible;
use crate::typeset::words::code_point;

/// Text from outside, printed so that TeX shows its characters and runs none of them: every special character becomes a
/// command, control characters and line ends become a space, and characters that pdfTeX does not know by default their
/// code point in brackets. The result never contains a line break, so it is as safe inside a comment as in the running
/// text.
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

/// Text from outside for a `%` comment: as it is, but on one line and without what changes how its reader sees the
/// line. TeX skips the rest of a comment's line without looking at it, so only a line end could let something out.
pub(crate) fn comment_text(text: &str) -> String {
    text.replace(is_invisible, " ")
}

/// Characters that TeX would not print as they are, and their commands.
const COMMANDS: &str = r#"
    \ \textbackslash{} { \{ } \} $ \$ & \& # \# % \% _ \_ ^ \textasciicircum{} ~ \textasciitilde{}
    < \textless{} > \textgreater{} | \textbar{} " \textquotedbl{} ' \textquotesingle{} ` \textasciigrave{}
    – \textendash{} — \textemdash{} ‘ \textquoteleft{} ’ \textquoteright{} “ \textquotedblleft{}
    ” \textquotedblright{} … \dots{} ° \textdegree{} µ \textmu{} ± \textpm{} × \texttimes{}
    · \textperiodcentered{} ² \texttwosuperior{} ³ \textthreesuperior{}
"#;

fn escaped(character: char) -> Option<&'static str> {
    if character.is_control() || character.is_whitespace() {
        return Some(" ");
    }
    let words = COMMANDS.split_whitespace();
    let mut pairs = words.clone().step_by(2).zip(words.skip(1).step_by(2));
    let known = pairs.find(|(plain, _)| plain.starts_with(character));
    known.map(|(_, command)| command)
}

/// ASCII letters, digits and harmless marks, and the Latin letters that the default fonts of pdfTeX carry.
fn is_plain(character: char) -> bool {
    character.is_ascii_alphanumeric()
        || "!()*+,-./:;=?@[] ".contains(character)
        || "ÀÁÂÃÄÅÆÇÈÉÊËÌÍÎÏÑÒÓÔÕÖØÙÚÛÜÝßàáâãäåæçèéêëìíîïñòóôõöøùúûüýÿČčĎďĚěŇňŘřŠšŤťŮůŽžŁłŃńŚśŹźŻżŐőŰű"
            .contains(character)
}

/// A name reduced to what a `\label` and a file name can hold: ASCII letters and digits, everything else a hyphen.
pub(crate) fn label(name: &str) -> String {
    name.chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect()
}
