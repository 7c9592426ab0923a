//! Text of files and arguments on its way out: characters that act instead of being shown, words of a shell.

use super::*;

/// Unicode's categories Zl and Zp, and the invisible characters of Cf.
const INVISIBLE: [(char, char); 10] = [
    ('\u{ad}', '\u{ad}'),
    ('\u{61c}', '\u{61c}'),
    ('\u{180e}', '\u{180e}'),
    ('\u{200b}', '\u{200f}'),
    ('\u{2028}', '\u{202e}'),
    ('\u{2060}', '\u{206f}'),
    ('\u{feff}', '\u{feff}'),
    ('\u{fff9}', '\u{fffb}'),
    ('\u{1d173}', '\u{1d17a}'),
    ('\u{e0000}', '\u{e007f}'),
];

/// Whether a character acts on the text around it instead of being shown.
pub fn is_invisible(c: char) -> bool {
    c.is_control() || (INVISIBLE.iter()).any(|(first, last)| (*first..=*last).contains(&c))
}

/// A path quoted for a shell; no path is interpreted as an option.
pub fn shell_path(path: &Path) -> String {
    let text = path.display().to_string();
    match text.starts_with('-') && text != "-" {
        true => shell_word(&format!("./{text}")),
        false => shell_word(&text),
    }
}

pub fn shell_word(text: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "-_./,=:+%".contains(letter);
    match !text.is_empty() && text.chars().all(plain) {
        true => text.to_owned(),
        false => format!("'{}'", text.replace('\'', r"'\''")),
    }
}
